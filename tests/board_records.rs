//! `cargo xtask board` against a stand-in for probe-rs: a program that keeps the flash of a board in a file, and takes the command lines
//! and prints the lists of words of the real one.

use std::path::Path;
use std::process::{Command, ExitCode};
use test_suite::tests;

fn main() -> ExitCode {
    test_suite::run(tests![records_are_shown_saved_and_erased(Program)])
}

/// `probe-rs list`, `read --chip CHIP b32 ADDRESS WORDS` and `download --chip CHIP --binary-format bin --base-address ADDRESS FILE`.
const STAND_IN: &str = r#"#!/bin/sh
case "$1" in
list) echo "The following debug probes were found:"; echo "[0]: STLink V2 -- 0483:3748:0668FF (ST-LINK)" ;;
read) [ "$2 $3 $4" = "--chip STM32F407VGTx b32" ] || exit 3
    od -An -v -tx4 -w32 -j $(($5 - 0x08000000)) -N $(($6 * 4)) "$FLASH" ;;
download) [ "$2 $3 $4 $5 $6" = "--chip STM32F407VGTx --binary-format bin --base-address" ] || exit 3
    dd if="$8" of="$FLASH" bs=1 seek=$(($7 - 0x08000000)) conv=notrunc 2>/dev/null ;;
*) echo "unknown: $*" >&2; exit 3 ;;
esac
"#;

fn records_are_shown_saved_and_erased() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("bin")).unwrap();
    std::fs::write(at("bin/probe-rs"), STAND_IN).unwrap();
    assert!(Command::new("chmod").arg("755").arg(at("bin/probe-rs")).status().unwrap().success());
    std::fs::write(at("flash"), [0xFF; 0x10000]).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let path = std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()).collect::<Vec<_>>();
    let path = std::env::join_paths(std::iter::once(at("bin")).chain(path)).unwrap();
    let xtask = |arguments: &str| {
        let output = Command::new("cargo")
            .args(["xtask", "board"])
            .args(arguments.split(' '))
            .current_dir(&root)
            .env("PATH", &path)
            .env("FLASH", at("flash"))
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let pack = |name: &str, arguments: &[&str], address: usize| {
        let program = std::env::var_os("FOOTFALL_BIN").expect("the program");
        let status = Command::new(program)
            .args(["pack", "--out"])
            .arg(at(name))
            .args(arguments)
            .current_dir(root.join("samples"))
            .status()
            .unwrap();
        assert!(status.success());
        let (mut flash, record) = (std::fs::read(at("flash")).unwrap(), std::fs::read(at(name)).unwrap());
        flash[address..address + record.len()].copy_from_slice(&record);
        std::fs::write(at("flash"), flash).unwrap();
    };

    let (code, said, errors) = xtask("info");
    assert!(
        code == Some(0) && said == "generator.bin: erased\nsensors.bin: erased\nrobot.bin: erased\n",
        "{said}{errors}"
    );

    pack("g.bin", &["generator.toml", "--name", "normal walk"], 0x4000);
    pack("r.bin", &["--robot", "robot.toml"], 0xC000);
    let (code, said, errors) = xtask("info");
    assert_eq!(code, Some(0), "{said}{errors}");
    assert!(said.contains("generator.bin: good: the generator \"normal walk\", shape, check sum"), "{said}");
    assert!(said.contains("robot.bin: good: the robot \"small biped\", check sum"), "{said}");

    // A bit of the robot's record flips.
    let mut flash = std::fs::read(at("flash")).unwrap();
    flash[0xC040] ^= 1;
    std::fs::write(at("flash"), &flash).unwrap();
    let (code, said, errors) = xtask("info");
    assert!(code == Some(2) && errors.contains("robot.bin: damaged: check sum"), "{code:?} {said}{errors}");
    assert!(said.contains("normal walk"), "{said}");

    let saved = at("saved");
    let read = format!("read --out {}", saved.display());
    assert_eq!(xtask(&read).0, Some(0));
    let sectors = ["generator.bin", "sensors.bin", "robot.bin"].map(|name| std::fs::read(saved.join(name)).unwrap());
    assert_eq!(sectors.concat(), flash[0x4000..]);
    let (code, _, errors) = xtask(&read);
    assert!(code == Some(1) && errors.contains("exists"), "{errors}");
    assert_eq!(xtask(&format!("{read} --force")).0, Some(0));

    assert_eq!(xtask("erase").0, Some(2), "no sector is named");
    assert_eq!(std::fs::read(at("flash")).unwrap(), flash);
    let (code, _, errors) = xtask("erase --robot");
    assert!(code == Some(0) && errors.contains("robot sector: erased; the board gives no pulse"), "{errors}");
    let after = std::fs::read(at("flash")).unwrap();
    assert!(after[0xC000..].iter().all(|byte| *byte == 0xFF));
    assert_eq!(after[..0xC000], flash[..0xC000]);
}
