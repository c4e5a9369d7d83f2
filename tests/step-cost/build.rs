//! Passes the linker script to the linker for the board target, and the networks and the gate in C where there is a compiler; the host binaries only
//! print a hint. The recorded walk becomes an array for the board.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The compiler of C for the board.
const COMPILER: &str = "arm-none-eabi-gcc";
/// The sources in C.
const SOURCES: [&str; 2] = ["networks", "gate"];
/// The programs that call them.
const PROGRAMS: [&str; 2] = ["beside-c", "witness"];
/// A recorded walk: time, and four angles in degrees.
const RECORDED: &str = "../traces/gaitkit_fukuchi_healthy.csv";
/// Ending of the functions' names, and how they are compiled.
const VARIANTS: [(&str, &str); 2] = [("exact", "-ffp-contract=off"), ("fused", "-ffp-contract=fast")];

fn main() {
    println!("cargo:rerun-if-changed=link.x");
    println!("cargo:rerun-if-changed=c");
    println!("cargo:rerun-if-changed={RECORDED}");
    println!("cargo:rerun-if-env-changed=PATH");
    // xtask sets it to the compiler that it finds: one that is installed later in a folder of PATH changes no file that cargo looks at.
    println!("cargo:rerun-if-env-changed=FOOTFALL_C_COMPILER");
    println!("cargo:rustc-check-cfg=cfg(beside_c)");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
        println!("cargo:rustc-link-arg-bins=-T{}", folder.join("link.x").display());
        // No page alignment, so that no ELF headers are loaded before the vector table.
        println!("cargo:rustc-link-arg-bins=--nmagic");
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
        std::fs::write(out.join("recorded.rs"), recorded(&folder.join(RECORDED)))
            .expect("the recorded walk is written");
        if has_compiler() {
            for source in SOURCES {
                for (ending, contraction) in VARIANTS {
                    let object = out.join(format!("{source}_{ending}.o"));
                    compile(&folder.join(format!("c/{source}.c")), &object, ending, contraction);
                    for program in PROGRAMS {
                        println!("cargo:rustc-link-arg-bin={program}={}", object.display());
                    }
                }
            }
            println!("cargo:rustc-cfg=beside_c");
        }
    }
}

/// The walk as an array of poses, degrees.
fn recorded(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("reading {}: {error}", file.display()));
    let pose = |line: &str| {
        let angles: Vec<f32> =
            line.split(',').skip(1).map(|angle| angle.parse().expect("an angle in degrees")).collect();
        format!("    {angles:?},\n")
    };
    let poses: Vec<String> = text.lines().skip(1).map(pose).collect();
    format!("[\n{}]\n", poses.concat())
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
