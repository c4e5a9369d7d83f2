//! Hands the one memory map of the workspace to the linker. Here and not in `.cargo/config.toml`, because link arguments there vanish
//! when RUSTFLAGS is set, and the build then "succeeds" with an empty program.

use std::path::PathBuf;
use std::{env, fs};

/// The boards, as cargo names their features; the first is the default.
const BOARDS: [&str; 3] = ["F4_DISCOVERY", "NUCLEO_F446RE", "BLACK_PILL_F411"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../memory.x");
    println!("cargo:rerun-if-changed=seal.x");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("../memory.x", out.join("memory.x")).expect("copy ../memory.x to OUT_DIR");
    fs::copy("seal.x", out.join("seal.x")).expect("copy seal.x to OUT_DIR");
    println!("cargo:rustc-link-search={}", out.display());
    // Names the board in the ELF file, as a symbol of the value 0: a program that runs or reads the file knows what it is for.
    let named: Vec<&str> =
        BOARDS.into_iter().filter(|board| env::var_os(format!("CARGO_FEATURE_{board}")).is_some()).collect();
    let has_default = env::var_os("CARGO_FEATURE_DEFAULT_BOARD").is_some();
    assert!(
        !named.is_empty() || !has_default || env::var_os("CARGO_CFG_DEFAULT_BOARD").is_some(),
        "choose one board: `--features f4-discovery`, `--features nucleo-f446re` or `--features black-pill-f411`"
    );
    let default = (named.is_empty() && has_default).then_some(BOARDS[0]);
    for board in named.into_iter().chain(default) {
        println!("cargo:rustc-link-arg-bins=--defsym=__board_{}=0", board.to_lowercase());
    }
    // Only the program takes them: a host tool or a test of the library must not.
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x", "-Tseal.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
