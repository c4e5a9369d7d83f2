//! Circles between the files of a library or a program: there are none.
//!
//! A file has an edge to another file of its crate if it uses an item that is defined there:
//! - A private `use` and a path that begins with `crate`, `super`, `self` or a child's name are resolved segment by segment. A name that a
//!   module only re-exports (`pub use`) is looked up where it is defined, so that `super::X` of a child goes to the sibling that defines X,
//!   and a parent that re-exports its children has no edge from any of them.
//! - A `pub use` is itself no edge; the same name used in the file's own code is one.
//! - `mod child;` is no edge. A path that ends with a module is an edge to the file of that module. A glob is one to the file of the
//!   module that it names.
//! - What is compiled for tests only (`#[cfg(test)]`) is left out: a test may use what it likes.
//! - A name that no item, import or glob explains (made by a macro) is taken for an item of the module where it was looked for.

mod edges;
mod modules;

use std::path::Path;

use edges::circles;
use footfall_tests::workspace::{assert_none, metadata};
use modules::Target;

#[test]
fn circles_are_found_and_re_exports_are_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, text).expect("written");
    };
    let circles = || circles(&Target::open(&folder.path().join("lib.rs")));
    write("lib.rs", "mod a;\nmod b;\npub use a::A;\n");
    write("a/mod.rs", "mod part;\npub use part::A;\npub use other::B;\nmod other;\n");
    // By way of the parent to the sibling, and by a path in a macro.
    write("a/part.rs", "use super::B;\npub struct A(B);\n#[cfg(test)]\nmod tests { use crate::b::C; }\n");
    write("a/other.rs", "pub struct B;\n");
    write("b.rs", "use crate::A;\npub struct C(A);\n");
    assert_eq!(circles(), Vec::<Vec<String>>::new());
    write("a/other.rs", "pub struct B;\nfn f() { assert!(crate::b::C::new()); }\n");
    assert_eq!(circles().len(), 1);
    assert_eq!(circles()[0].len(), 3, "{:?}", circles());
    // A child that uses what its parent defines, and a parent that uses the child.
    write("a/other.rs", "pub struct B;\n");
    write("lib.rs", "mod a;\nmod b;\npub use a::A;\npub struct Top;\nfn f(a: A) {}\n");
    assert_eq!(circles(), Vec::<Vec<String>>::new());
    write("b.rs", "pub struct C(crate::Top);\n");
    write("a/part.rs", "pub struct A(crate::b::C);\n");
    assert_eq!(circles()[0].len(), 3, "{:?}", circles());
}

#[test]
fn no_files_of_a_crate_use_each_other_in_a_circle() {
    let mut found = Vec::new();
    for package in metadata()["packages"].as_array().expect("a list of packages") {
        for target in package["targets"].as_array().expect("a list of targets") {
            let path = Path::new(target["src_path"].as_str().expect("a path"));
            if target["kind"][0] != "lib" && target["kind"][0] != "bin" {
                continue;
            }
            found.extend(circles(&Target::open(path)).into_iter().map(|circle| circle.join("\n  ")));
        }
    }
    assert_none(&found, "circles of files");
}
