//! The proof has no start-up code and no memory map: the linker only has to know where to begin looking for what is reachable.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!("cargo:rustc-link-arg-bins=--entry=prove");
    }
}
