//! Passes the entry point to the linker, from which it searches for reachable code. The proof has no start-up code and no memory map.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!("cargo:rustc-link-arg-bins=--entry=prove");
    }
}
