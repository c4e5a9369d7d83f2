//! Passes the linker script to the linker for the board target; the host binaries only print a hint.

use std::env;
use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=link.x");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
        println!("cargo:rustc-link-arg-bins=-T{}", folder.join("link.x").display());
        // No page alignment, so that no ELF headers are loaded before the vector table.
        println!("cargo:rustc-link-arg-bins=--nmagic");
    }
}
