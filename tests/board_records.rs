//! `cargo xtask flash --dfu` against a stand-in for dfu-util: a program that keeps the flash of a board in a file, and takes the command lines and prints
//! the lists of the real one. `xtask_probe.rs` has the other commands, with probe-rs itself.

use object::{Object, ObjectSegment};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use tempfile::TempDir;
use test_suite::tests;

fn main() -> ExitCode {
    test_suite::run(tests![usb_writes_program_and_records(Image)])
}

/// A board: its flash, and the stand-in by which it is connected.
struct Connected {
    folder: TempDir,
    search_path: std::ffi::OsString,
}

impl Connected {
    /// By a stand-in with this name and this text.
    fn by(name: &str, text: &str, flash: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let programs = folder.path().join("bin");
        std::fs::create_dir(&programs).unwrap();
        std::fs::write(programs.join(name), text).unwrap();
        assert!(Command::new("chmod").arg("755").arg(programs.join(name)).status().unwrap().success());
        std::fs::write(folder.path().join("flash"), flash).unwrap();
        let path = std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()).collect::<Vec<_>>();
        let search_path = std::env::join_paths(std::iter::once(programs).chain(path)).unwrap();
        Self { folder, search_path }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn flash(&self) -> Vec<u8> {
        std::fs::read(self.at("flash")).unwrap()
    }

    /// Exit code, standard output, standard error of `cargo xtask`.
    fn xtask(&self, arguments: &str) -> (Option<i32>, String, String) {
        let output = Command::new("cargo")
            .arg("xtask")
            .args(arguments.split(' '))
            .current_dir(root())
            .env("PATH", &self.search_path)
            .env("FLASH", self.at("flash"))
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// `dfu-util --list` and `--device 0483:df11 --alt 0 --dfuse-address ADDRESS --download FILE`, which lists what it writes.
const DFU_STAND_IN: &str = r#"#!/bin/sh
case "$1" in
--list) echo 'Found DFU: [0483:df11] ver=2200, devnum=7, cfg=1, intf=0, path="1-1", alt=0, name="@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg", serial="1"' ;;
--device) [ "$2 $3 $4 $5 $7" = "0483:df11 --alt 0 --dfuse-address --download" ] || exit 3
    echo "$(($6)) $(wc -c < "$8")" >> "$FLASH.writes"
    dd if="$8" of="$FLASH" bs=1024 oflag=seek_bytes seek=$(($6 - 0x08000000)) conv=notrunc 2>/dev/null ;;
*) echo "unknown: $*" >&2; exit 3 ;;
esac
"#;

/// Start and end of each sector of an STM32F407 (RM0090 table 5).
fn sectors() -> Vec<std::ops::Range<usize>> {
    let sizes = [16, 16, 16, 16, 64, 128, 128, 128, 128, 128, 128, 128].map(|kib: usize| kib * 1024);
    let start = |n: usize| sizes[..n].iter().sum::<usize>();
    (0..sizes.len()).map(|n| start(n)..start(n + 1)).collect()
}

/// The boot loader erases each sector that a download touches: so no two downloads may touch one, and the program's none of the records'.
fn usb_writes_program_and_records() {
    let board = Connected::by("dfu-util", DFU_STAND_IN, &[0x55; 0x10_0000]);
    let (code, _, errors) = board.xtask("flash --dfu --keep --generator samples/generator.toml");
    assert!(code == Some(0) && errors.contains("next: connect BOOT0 with GND"), "{errors}");
    let writes = std::fs::read_to_string(board.at("flash.writes")).unwrap();
    let touched = |line: &str| {
        let (address, size) = line.split_once(' ').unwrap();
        let start = address.parse::<usize>().unwrap() - 0x0800_0000;
        let end = start + size.trim().parse::<usize>().unwrap();
        sectors().into_iter().filter(|sector| sector.start < end && sector.end > start).collect::<Vec<_>>()
    };
    let touched: Vec<_> = writes.lines().flat_map(touched).collect();
    for (n, sector) in touched.iter().enumerate() {
        assert!(!touched[..n].contains(sector), "erased twice: {sector:x?} of {touched:x?}");
    }
    let flash = board.flash();
    let kept = |range: std::ops::Range<usize>| flash[range].iter().all(|byte| *byte == 0x55);
    assert!(flash[0x4000..].starts_with(b"FFWK") && kept(0x8000..0x10000), "{touched:x?}");
    let elf = std::fs::read(std::env::var_os("FOOTFALL_ELF").expect("the image")).unwrap();
    let elf = object::File::parse(&*elf).unwrap();
    let mut compared = 0;
    for segment in elf.segments() {
        let (object::SegmentFlags::Elf { .. }, Ok(bytes)) = (segment.flags(), segment.data()) else { panic!("an ELF") };
        // Variables are stored behind the program; their segment has its address in RAM.
        let start = (segment.address() as usize).wrapping_sub(0x0800_0000);
        if start < flash.len() && !bytes.is_empty() {
            assert!(flash[start..].starts_with(bytes), "a segment at {start:x}");
            compared += bytes.len();
        }
    }
    assert!(compared > 100_000, "{compared} bytes of the program");

    let (code, _, errors) = board.xtask("flash --dfu --board nucleo-f446re");
    assert!(code == Some(1) && errors.contains("no USB connector of its chip"), "{errors}");
}
