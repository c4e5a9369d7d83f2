//! Words that occur nowhere, names that nothing has, files that do not use each other in circles, and chips that the cores do not name.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use serde_json::Value;
use syn::{Attribute, Item, UseTree, Visibility};

/// Words that occur nowhere, each in two parts, so that this file does not contain them.
const WORDS: [(&str, &str); 8] = [
    ("to", "ld"),
    ("foreto", "ld"),
    ("belie", "ved"),
    ("an", "ew"),
    ("gra", "ver"),
    ("gra", "vest"),
    ("le", "st"),
    ("ea", "rs"),
];

/// Words that are no part of a name of a program, and their plurals: a generator is no person, an image no part of one.
const NAME_PARTS: [(&str, &str); 8] = [
    ("wal", "ker"),
    ("rhy", "thm"),
    ("bo", "dy"),
    ("do", "or"),
    ("ro", "om"),
    ("hou", "se"),
    ("wo", "rn"),
    ("ship", "ped"),
];

/// Names that have such a part for a reason: where the file's path begins, the name, why.
const ALLOWED_NAMES: [(&str, &str, &str); 0] = [];

/// The crates that compile for every chip.
const CORES: [&str; 5] = ["joint-units", "hgod-adc", "cpg-core", "joint-loop", "wire"];

/// The one module of the cores that is about a chip, as a file or a folder.
const CHIP_MODULE: &str = "hgod-adc/src/stm32f4";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ is in the workspace")
}

/// Every file of the repository that git does not ignore, relative to the root.
static FILES: LazyLock<Vec<String>> = LazyLock::new(|| {
    let output = Command::new("git")
        .args(["-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(root())
        .output()
        .expect("git starts");
    assert!(output.status.success(), "git ls-files: {}", String::from_utf8_lossy(&output.stderr));
    let list = String::from_utf8(output.stdout).expect("file names are text");
    // A file that was removed but not from the index is not there.
    let files: Vec<String> =
        list.split('\0').filter(|name| !name.is_empty() && root().join(name).is_file()).map(str::to_owned).collect();
    assert!(files.len() > 200, "{} files", files.len());
    files
});

/// The files whose names end so.
fn files(endings: &'static [&'static str]) -> impl Iterator<Item = &'static str> {
    let ends = move |name: &&str| endings.iter().any(|ending| name.ends_with(ending));
    FILES.iter().map(String::as_str).filter(ends)
}

fn read(name: impl AsRef<Path>) -> String {
    let path = root().join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn joined(words: &[(&str, &str)]) -> Vec<String> {
    words.iter().map(|(first, second)| format!("{first}{second}")).collect()
}

/// A word, or a name in snake_case, CamelCase or kebab-case, as lower-case parts.
fn parts(text: &str) -> Vec<String> {
    let mut parts = Vec::new();
    for run in text.split(|c: char| !c.is_alphabetic()) {
        let letters: Vec<char> = run.chars().collect();
        let mut part = String::new();
        for (n, &letter) in letters.iter().enumerate() {
            let after_lower = n > 0 && letters[n - 1].is_lowercase();
            let before_lower = letters.get(n + 1).is_some_and(|next| next.is_lowercase());
            if letter.is_uppercase() && (after_lower || before_lower) && !part.is_empty() {
                parts.push(std::mem::take(&mut part));
            }
            part.extend(letter.to_lowercase());
        }
        if !part.is_empty() {
            parts.push(part);
        }
    }
    parts
}

/// Fails with the list of what was found.
fn assert_none(found: &[String], what: &str) {
    assert!(found.is_empty(), "{} {what}:\n{}", found.len(), found.join("\n"));
}

#[test]
fn names_are_split_into_their_parts() {
    for (name, want) in [
        ("stride_clock", vec!["stride", "clock"]),
        ("PhaseLock", vec!["phase", "lock"]),
        ("HTTPServer", vec!["http", "server"]),
        ("everybody", vec!["everybody"]),
        ("A_LONG_NAME2", vec!["a", "long", "name"]),
        ("core-selftest", vec!["core", "selftest"]),
    ] {
        assert_eq!(parts(name), want, "{name}");
    }
}

#[test]
fn some_words_occur_nowhere() {
    let words = joined(&WORDS);
    let mut found = Vec::new();
    for name in files(&[".rs", ".md", ".toml", ".html"]) {
        for (number, line) in read(name).lines().enumerate() {
            for word in parts(line).into_iter().filter(|part| words.contains(part)) {
                found.push(format!("{name}:{}: `{word}`", number + 1));
            }
        }
    }
    assert_none(&found, "places with words that occur nowhere (say it in plain English)");
}

/// The part of a name that nothing has, with or without the plural's s.
fn bad_part(name: &str, bad: &[String]) -> Option<String> {
    let singular = |part: &String| match part.strip_suffix("ies") {
        Some(stem) => format!("{stem}y"),
        None => part.strip_suffix('s').unwrap_or(part).to_owned(),
    };
    parts(name).into_iter().find(|part| bad.contains(part) || bad.contains(&singular(part)))
}

fn is_allowed(file: &str, name: &str) -> bool {
    ALLOWED_NAMES.iter().any(|(place, allowed, _)| file.starts_with(place) && name == *allowed)
}

/// Calls `each` with every identifier and its line. Comments and literals are none; lifetimes are.
fn identifiers(tokens: TokenStream, each: &mut impl FnMut(String, usize)) {
    for token in tokens {
        match token {
            TokenTree::Ident(ident) => each(ident.to_string(), ident.span().start().line),
            TokenTree::Group(group) => identifiers(group.stream(), each),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

fn keys(value: &toml::Value, each: &mut impl FnMut(&str)) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                each(key);
                keys(value, each);
            }
        }
        toml::Value::Array(values) => values.iter().for_each(|value| keys(value, each)),
        _ => {}
    }
}

#[test]
fn no_identifier_has_one_of_some_parts() {
    let bad = joined(&NAME_PARTS);
    let mut found = BTreeSet::new();
    for file in files(&[".rs"]) {
        let tokens: TokenStream = read(file).parse().unwrap_or_else(|error| panic!("{file}: {error}"));
        identifiers(tokens, &mut |name, line| {
            if bad_part(&name, &bad).is_some() && !is_allowed(file, &name) {
                found.insert(format!("{file}:{line}: `{name}`"));
            }
        });
    }
    let found: Vec<String> = found.into_iter().collect();
    assert_none(&found, "identifiers with a part that no name has (see `NAME_PARTS`)");
}

#[test]
fn no_key_of_a_file_has_one_of_these_parts() {
    let bad = joined(&NAME_PARTS);
    let mut found = Vec::new();
    for file in files(&[".toml"]) {
        let table: toml::Table = read(file).parse().unwrap_or_else(|error| panic!("{file}: {error}"));
        keys(&toml::Value::Table(table), &mut |key| {
            if bad_part(key, &bad).is_some() && !is_allowed(file, key) {
                found.push(format!("{file}: `{key}`"));
            }
        });
    }
    assert_none(&found, "keys with a part that no name has (see `NAME_PARTS`)");
}

#[test]
fn no_file_or_folder_has_one_of_these_parts() {
    let bad = joined(&NAME_PARTS);
    let is_bad = |name: &&String| bad_part(name, &bad).is_some() && !is_allowed(name, name);
    let found: Vec<String> = FILES.iter().filter(is_bad).cloned().collect();
    assert_none(&found, "files with a part that no name has (see `NAME_PARTS`)");
}

#[test]
fn no_allowed_name_is_left_over() {
    let bad = joined(&NAME_PARTS);
    for (place, name, reason) in ALLOWED_NAMES {
        assert!(!reason.is_empty() && bad_part(name, &bad).is_some(), "{name} needs no permission");
        let uses = |file: &&str| file.starts_with(place) && (*file == name || read(file).contains(name));
        assert!(files(&[".rs", ".toml"]).any(|file| uses(&file)), "{name} does not occur in {place} any more");
    }
}

// Circles between the files of a library or a program.
//
// A file has an edge to another file of its crate if it uses an item that is defined there:
// - A private `use` and a path that begins with `crate`, `super`, `self` or a child's name are resolved segment by segment. A name that a
//   module only re-exports (`pub use`) is looked up where it is defined, so that `super::X` of a child goes to the sibling that defines X,
//   and a parent that re-exports its children has no edge from any of them.
// - A `pub use` is itself no edge; the same name used in the file's own code is one.
// - `mod child;` is no edge. A path that ends with a module is an edge to the file of that module. A glob is one to the file of the
//   module that it names.
// - What is compiled for tests only (`#[cfg(test)]`) is left out: a test may use what it likes.
// - A name that no item, import or glob explains (made by a macro) is taken for an item of the module where it was looked for.

static METADATA: LazyLock<Value> = LazyLock::new(|| {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "cargo metadata: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("cargo metadata is JSON")
});

/// A module's path: the empty one is the crate's root.
type ModulePath = Vec<String>;

/// A name that a module imports.
#[derive(Debug, Clone)]
struct Import {
    /// `None` for a glob.
    name: Option<String>,
    path: Vec<String>,
    is_public: bool,
}

#[derive(Debug, Default)]
struct Module {
    /// Index of its file.
    file: usize,
    items: BTreeSet<String>,
    imports: Vec<Import>,
    /// Everything but the imports.
    code: TokenStream,
}

/// The modules of one target and the files that they are in.
#[derive(Debug, Default)]
struct Target {
    files: Vec<PathBuf>,
    modules: BTreeMap<ModulePath, Module>,
    /// Exported macros, by the index of their file.
    macros: BTreeMap<String, usize>,
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || attribute.path().is_ident("cfg")
                && attribute.meta.to_token_stream().to_string().replace(' ', "").starts_with("cfg(test")
    })
}

/// `#[path = "..."]`.
fn given_path(attributes: &[Attribute]) -> Option<String> {
    let attribute = attributes.iter().find(|attribute| attribute.path().is_ident("path"))?;
    let syn::Meta::NameValue(pair) = &attribute.meta else { return None };
    let syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) = &pair.value else { return None };
    Some(text.value())
}

fn imports(tree: &UseTree, before: &[String], is_public: bool, all: &mut Vec<Import>) {
    let with = |name: String| before.iter().cloned().chain([name]).collect::<Vec<_>>();
    match tree {
        UseTree::Path(path) => imports(&path.tree, &with(path.ident.to_string()), is_public, all),
        UseTree::Group(group) => group.items.iter().for_each(|tree| imports(tree, before, is_public, all)),
        UseTree::Glob(_) => all.push(Import { name: None, path: before.to_vec(), is_public }),
        UseTree::Name(name) if name.ident == "self" => {
            all.push(Import { name: before.last().cloned(), path: before.to_vec(), is_public });
        }
        UseTree::Name(name) => {
            all.push(Import { name: Some(name.ident.to_string()), path: with(name.ident.to_string()), is_public });
        }
        UseTree::Rename(rename) => {
            let path = if rename.ident == "self" { before.to_vec() } else { with(rename.ident.to_string()) };
            all.push(Import { name: Some(rename.rename.to_string()), path, is_public });
        }
    }
}

/// Name and attributes of an item that can be used by its path.
fn named(item: &Item) -> (Option<String>, &[Attribute]) {
    let (ident, attributes) = match item {
        Item::Const(item) => (Some(&item.ident), &item.attrs),
        Item::Enum(item) => (Some(&item.ident), &item.attrs),
        Item::Fn(item) => (Some(&item.sig.ident), &item.attrs),
        Item::Macro(item) => (item.ident.as_ref(), &item.attrs),
        Item::Mod(item) => (Some(&item.ident), &item.attrs),
        Item::Static(item) => (Some(&item.ident), &item.attrs),
        Item::Struct(item) => (Some(&item.ident), &item.attrs),
        Item::Trait(item) => (Some(&item.ident), &item.attrs),
        Item::TraitAlias(item) => (Some(&item.ident), &item.attrs),
        Item::Type(item) => (Some(&item.ident), &item.attrs),
        Item::Union(item) => (Some(&item.ident), &item.attrs),
        Item::Impl(item) => (None, &item.attrs),
        Item::Use(item) => (None, &item.attrs),
        _ => (None, const { &Vec::new() }),
    };
    (ident.map(ToString::to_string), attributes)
}

impl Target {
    fn open(root_file: &Path) -> Self {
        let mut target = Self::default();
        let folder = root_file.parent().expect("a file is in a folder").to_owned();
        target.file(root_file.to_owned(), &folder, vec![]);
        target
    }

    /// Reads a file as a module; files of its children are in `folder`.
    fn file(&mut self, path: PathBuf, folder: &Path, module: ModulePath) {
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        self.files.push(path);
        self.module(self.files.len() - 1, folder, module, parsed.items);
    }

    fn module(&mut self, file: usize, folder: &Path, path: ModulePath, items: Vec<Item>) {
        let mut module = Module { file, ..Module::default() };
        let mut children = Vec::new();
        for item in items {
            let (name, attributes) = named(&item);
            if is_for_tests(attributes) {
                continue;
            }
            match item {
                Item::Use(item) => {
                    imports(&item.tree, &[], !matches!(item.vis, Visibility::Inherited), &mut module.imports);
                }
                Item::Mod(item) => children.push(item),
                Item::Macro(item) if item.ident.is_some() => {
                    let name = name.unwrap_or_default();
                    if item.attrs.iter().any(|attribute| attribute.path().is_ident("macro_export")) {
                        self.macros.insert(name.clone(), file);
                    }
                    module.items.insert(name);
                    item.to_tokens(&mut module.code);
                }
                item => {
                    module.items.extend(name);
                    item.to_tokens(&mut module.code);
                }
            }
        }
        self.modules.insert(path.clone(), module);
        for child in children {
            let name = child.ident.to_string();
            let inside = path.iter().cloned().chain([name.clone()]).collect();
            if let Some((_, items)) = child.content {
                self.module(file, &folder.join(name), inside, items);
                continue;
            }
            let in_file = folder.join(format!("{name}.rs"));
            if let Some(given) = given_path(&child.attrs) {
                let of_file = self.files[file].parent().expect("a file is in a folder").join(given);
                let beside = of_file.parent().expect("a file is in a folder").to_owned();
                self.file(of_file, &beside, inside);
            } else if in_file.is_file() {
                self.file(in_file, &folder.join(name), inside);
            } else {
                self.file(folder.join(&name).join("mod.rs"), &folder.join(name), inside);
            }
        }
    }

    /// The file that defines what `path` names in `module`; `None` if it is of another crate.
    fn definition(&self, module: &[String], path: &[String], depth: usize) -> Option<usize> {
        let first = path.first()?;
        let (start, rest) = match first.as_str() {
            "crate" => (vec![], &path[1..]),
            "self" => (module.to_vec(), &path[1..]),
            "super" => (module.split_last()?.1.to_vec(), &path[1..]),
            _ => (module.to_vec(), path),
        };
        if rest.first().is_some_and(|next| next == "super") {
            return self.definition(&start, rest, depth);
        }
        // A name with no prefix may be another crate's; one with a prefix is this crate's.
        self.within(&start, rest, rest.len() < path.len(), depth)
    }

    fn within(&self, start: &[String], path: &[String], is_ours: bool, depth: usize) -> Option<usize> {
        let module = self.modules.get(start)?;
        let Some((first, rest)) = path.split_first() else { return Some(module.file) };
        let child: ModulePath = start.iter().cloned().chain([first.clone()]).collect();
        if self.modules.contains_key(&child) {
            return self.within(&child, rest, true, depth);
        }
        if module.items.contains(first) {
            return Some(module.file);
        }
        if start.is_empty() && self.macros.contains_key(first) {
            return self.macros.get(first).copied();
        }
        if depth > 0 {
            if let Some(import) = module.imports.iter().find(|import| import.name.as_ref() == Some(first)) {
                let whole: Vec<String> = import.path.iter().chain(rest).cloned().collect();
                return self.definition(start, &whole, depth - 1);
            }
            for glob in module.imports.iter().filter(|import| import.name.is_none()) {
                let whole: Vec<String> = glob.path.iter().chain(path).cloned().collect();
                if let Some(file) = self.definition(start, &whole, depth - 1) {
                    return Some(file);
                }
            }
        }
        is_ours.then_some(module.file)
    }

    /// For each file the files that it uses.
    fn edges(&self) -> Vec<BTreeSet<usize>> {
        let mut edges = vec![BTreeSet::new(); self.files.len()];
        for (path, module) in &self.modules {
            let mut uses: BTreeSet<Vec<String>> = BTreeSet::new();
            let private = module.imports.iter().filter(|import| !import.is_public);
            uses.extend(private.map(|import| import.path.clone()));
            let mut in_code = BTreeSet::new();
            paths(module.code.clone(), &mut in_code);
            for used in in_code {
                let is_prefixed = ["crate", "super", "self"].contains(&used[0].as_str()) && used.len() > 1;
                let is_child = self.modules.contains_key(&[path.as_slice(), &used[..1]].concat()) && used.len() > 1;
                let is_imported = module.imports.iter().any(|import| import.name.as_ref() == Some(&used[0]));
                if is_prefixed || is_child || is_imported {
                    uses.insert(used);
                }
            }
            let used = uses.iter().filter_map(|used| self.definition(path, used, 16));
            edges[module.file].extend(used.filter(|&file| file != module.file));
        }
        edges
    }

    /// Files that use each other, directly or not: each set once, by name.
    fn circles(&self) -> Vec<Vec<String>> {
        let edges = self.edges();
        let reach: Vec<BTreeSet<usize>> = (0..edges.len())
            .map(|from| {
                let (mut seen, mut next) = (BTreeSet::new(), edges[from].iter().copied().collect::<Vec<_>>());
                while let Some(file) = next.pop() {
                    if seen.insert(file) {
                        next.extend(&edges[file]);
                    }
                }
                seen
            })
            .collect();
        let mut circles: Vec<Vec<usize>> = (0..edges.len())
            .filter(|&file| reach[file].contains(&file))
            .map(|file| reach[file].iter().copied().filter(|&other| reach[other].contains(&file)).collect())
            .collect();
        circles.sort();
        circles.dedup();
        let name =
            |file: usize| self.files[file].strip_prefix(root()).unwrap_or(&self.files[file]).display().to_string();
        let with_edges = |circle: &Vec<usize>, file: usize| {
            let inside: Vec<String> =
                edges[file].iter().copied().filter(|other| circle.contains(other)).map(name).collect();
            format!("{} -> {}", name(file), inside.join(", "))
        };
        circles.iter().map(|circle| circle.iter().map(|&file| with_edges(circle, file)).collect()).collect()
    }
}

/// Every path `a::b::c` in code, each name alone too; what follows a dot is a field or a method.
fn paths(tokens: TokenStream, all: &mut BTreeSet<Vec<String>>) {
    let (mut path, mut colons, mut after_dot) = (Vec::<String>::new(), 0, false);
    for token in tokens {
        match token {
            TokenTree::Ident(ident) => {
                if colons != 2 && !path.is_empty() {
                    all.insert(std::mem::take(&mut path));
                }
                if !after_dot {
                    path.push(ident.to_string());
                }
                (colons, after_dot) = (0, false);
            }
            TokenTree::Punct(punct) => {
                colons = if punct.as_char() == ':' { colons + 1 } else { 0 };
                after_dot = punct.as_char() == '.';
                if colons == 0 && !path.is_empty() {
                    all.insert(std::mem::take(&mut path));
                }
            }
            TokenTree::Group(group) => {
                if !path.is_empty() {
                    all.insert(std::mem::take(&mut path));
                }
                (colons, after_dot) = (0, false);
                paths(group.stream(), all);
            }
            TokenTree::Literal(_) => (colons, after_dot) = (0, false),
        }
    }
    if !path.is_empty() {
        all.insert(path);
    }
}

#[test]
fn circles_are_found_and_re_exports_are_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, text).expect("written");
    };
    let circles = || Target::open(&folder.path().join("lib.rs")).circles();
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
    for package in METADATA["packages"].as_array().expect("a list of packages") {
        for target in package["targets"].as_array().expect("a list of targets") {
            let path = Path::new(target["src_path"].as_str().expect("a path"));
            if target["kind"][0] != "lib" && target["kind"][0] != "bin" {
                continue;
            }
            found.extend(Target::open(path).circles().into_iter().map(|circle| circle.join("\n  ")));
        }
    }
    assert_none(&found, "circles of files");
}

/// Whether a word names a chip, a part of one, its manual or a pin.
fn is_of_a_chip(word: &str) -> bool {
    let lower = word.to_lowercase();
    let mut letters = lower.chars();
    let is_pin = letters.next() == Some('p')
        && letters.next().is_some_and(|port| ('a'..='k').contains(&port))
        && (3..=4).contains(&lower.len())
        && letters.all(|digit| digit.is_ascii_digit());
    let named = ["rm0090", "tim1", "adc1", "dma"].contains(&lower.as_str());
    // `vrefint` is the loop's name for the code of the internal reference.
    lower.starts_with("stm32") || lower.starts_with("cortex") || named || is_pin || word == "VREFINT"
}

#[test]
fn words_of_a_chip_are_recognised() {
    for word in ["STM32F407", "Cortex", "PA1", "PC13", "DMA", "RM0090", "TIM1", "ADC1", "VREFINT"] {
        assert!(is_of_a_chip(word), "{word}");
    }
    for word in ["park", "pad", "page", "p", "phase", "vrefint", "adc", "P1", "PA123"] {
        assert!(!is_of_a_chip(word), "{word}");
    }
}

/// Outside of the one module for it. A path that leads into that module may have its name.
#[test]
fn the_cores_name_no_chip() {
    let mut found = Vec::new();
    for file in files(&[".rs"]) {
        let is_core = CORES.iter().any(|core| file.starts_with(&format!("{core}/src/")));
        if !is_core || file.starts_with(CHIP_MODULE) {
            continue;
        }
        for (number, line) in read(file).lines().enumerate() {
            let line = line.replace("::stm32f4", "").replace("stm32f4::", "").replace("mod stm32f4;", "");
            let words = line.split(|c: char| !c.is_alphanumeric());
            found
                .extend(words.filter(|word| is_of_a_chip(word)).map(|word| format!("{file}:{}: `{word}`", number + 1)));
        }
    }
    assert_none(&found, &format!("names of chips in the cores (they belong into {CHIP_MODULE})"));
}
