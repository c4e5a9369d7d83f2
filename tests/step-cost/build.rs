//! Passes the linker script to the linker for the board target, and the networks in C where there is a compiler; the host binaries only print a
//! hint.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The compiler of C for the board.
const COMPILER: &str = "arm-none-eabi-gcc";
/// Ending of the functions' names, and how they are compiled.
const VARIANTS: [(&str, &str); 2] = [("exact", "-ffp-contract=off"), ("fused", "-ffp-contract=fast")];

fn main() {
    println!("cargo:rerun-if-changed=link.x");
    println!("cargo:rerun-if-changed=c/networks.c");
    println!("cargo:rerun-if-env-changed=PATH");
    println!("cargo:rustc-check-cfg=cfg(beside_c)");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
        println!("cargo:rustc-link-arg-bins=-T{}", folder.join("link.x").display());
        // No page alignment, so that no ELF headers are loaded before the vector table.
        println!("cargo:rustc-link-arg-bins=--nmagic");
        if has_compiler() {
            let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
            for (ending, contraction) in VARIANTS {
                let object = out.join(format!("networks_{ending}.o"));
                compile(&folder.join("c/networks.c"), &object, ending, contraction);
                println!("cargo:rustc-link-arg-bin=beside-c={}", object.display());
            }
            println!("cargo:rustc-cfg=beside_c");
        }
    }
}

fn has_compiler() -> bool {
    let version = Command::new(COMPILER).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    version.is_ok_and(|status| status.success())
}

fn compile(source: &Path, object: &Path, ending: &str, contraction: &str) {
    let status = Command::new(COMPILER)
        .args(["-std=c11", "-O3", "-ffreestanding", "-Wall", "-Werror", contraction, "-c"])
        .args(["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"])
        .arg(format!("-DNAME(name)=name##_{ending}"))
        .arg("-o")
        .args([object, source])
        .status();
    assert!(status.is_ok_and(|status| status.success()), "{COMPILER} cannot compile {}", source.display());
}
