//! `cargo xtask board`, `watch`, `record` and `flash --dfu` against stand-ins for probe-rs and dfu-util: programs that keep the flash of a board
//! in a file, and take the command lines and print the lists and the log of the real ones.

use footfall::board::image::Image;
use footfall::board::lines::{self, BoardLine};
use footfall_tests::board::Board;
use footfall_tests::gestures::ARM;
use footfall_tests::host::Host;
use footfall_tests::recordings::default_volts_file;
use generator_file::file::{GeneratorFile, GeneratorSet};
use joint_loop::SupervisorState;
use joint_loop::store::generator_record;
use object::{Object, ObjectSegment};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use tempfile::TempDir;
use test_suite::tests;

fn main() -> ExitCode {
    test_suite::run(tests![
        records_are_shown_saved_and_erased(Program),
        what_was_tuned_becomes_the_record(Image, Program),
        usb_writes_program_and_records(Image),
        a_board_is_watched_and_recorded_behind_probe_rs(Image),
    ])
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
            .env("LOG", self.at("log"))
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// `probe-rs list`, `read --chip CHIP b32 ADDRESS WORDS`, `download --chip CHIP --binary-format bin --base-address ADDRESS FILE` and
/// `reset --chip CHIP`.
const STAND_IN: &str = r#"#!/bin/sh
case "$1" in
list) echo "The following debug probes were found:"; echo "[0]: STLink V2 -- 0483:3748:0668FF (ST-LINK)" ;;
read) [ "$2 $3 $4" = "--chip STM32F407VGTx b32" ] || exit 3
    od -An -v -tx4 -w32 -j $(($5 - 0x08000000)) -N $(($6 * 4)) "$FLASH" ;;
download) [ "$2 $3 $4 $5 $6" = "--chip STM32F407VGTx --binary-format bin --base-address" ] || exit 3
    dd if="$8" of="$FLASH" bs=1 seek=$(($7 - 0x08000000)) conv=notrunc 2>/dev/null ;;
reset) [ "$2 $3" = "--chip STM32F407VGTx" ] || exit 3
    echo reset >> "$LOG" ;;
*) echo "unknown: $*" >&2; exit 3 ;;
esac
"#;

fn records_are_shown_saved_and_erased() {
    let board = Connected::by("probe-rs", STAND_IN, &[0xFF; 0x10000]);
    let at = |name: &str| board.at(name);
    let xtask = |arguments: &str| board.xtask(&format!("board {arguments}"));
    let pack = |name: &str, arguments: &[&str], address: usize| {
        let program = std::env::var_os("FOOTFALL_BIN").expect("the program");
        let status = Command::new(program)
            .args(["pack", "--out"])
            .arg(at(name))
            .args(arguments)
            .current_dir(root().join("samples"))
            .status()
            .unwrap();
        assert!(status.success());
        let (mut flash, record) = (board.flash(), std::fs::read(at(name)).unwrap());
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
    let mut flash = board.flash();
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
    assert_eq!(board.flash(), flash);
    let (code, _, errors) = xtask("erase --robot");
    assert!(code == Some(0) && errors.contains("robot sector: erased; the board gives no pulse"), "{errors}");
    let after = board.flash();
    assert!(after[0xC000..].iter().all(|byte| *byte == 0xFF));
    assert_eq!(after[..0xC000], flash[..0xC000]);
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

/// The virtual board plays the serial port, the stand-in the probe. The record that is written makes the board move as it was tuned.
fn what_was_tuned_becomes_the_record() {
    let connected = Connected::by("probe-rs", STAND_IN, &[0xFF; 0x10000]);
    let file = GeneratorFile::default_of("phase-coupled").unwrap();
    std::fs::write(connected.at("walk.toml"), file.to_toml()).unwrap();
    let [walk, out] = ["walk.toml", "tuned.toml"].map(|name| connected.at(name).display().to_string());
    let walks: [OsString; 5] =
        ["--volts".into(), default_volts_file().into(), "--loop".into(), "--press".into(), ARM.into()];
    let ran = Board::find().run_with_host(walks, |path, _| {
        let port = path.display().to_string();
        let save = || connected.xtask(&format!("board save {walk} --serial {port} --out {out} --force"));
        let set = |words: &[&str]| {
            let words = [&["footfall", "set", "--serial", &port], words].concat();
            footfall::cli::call(words.into_iter().map(Into::into)).unwrap();
        };
        Host::open(&path).until("walking", |host| host.state == SupervisorState::Walking);
        set(&["speed", "1.2"]);
        let (code, _, errors) = save();
        assert!(code == Some(1) && errors.contains("the board is in the state `walking`"), "{errors}");
        assert!(connected.flash().iter().all(|byte| *byte == 0xFF), "nothing is written");
        set(&["--stop"]);
        Host::open(&path).until("disarmed", |host| host.state == SupervisorState::Disarmed);
        let (code, said, errors) = save();
        assert!(code == Some(0) && errors.contains("read back; the board was reset"), "{said}{errors}");
    });
    ran.assert_sound();
    assert_eq!(std::fs::read_to_string(connected.at("log")).unwrap(), "reset\n");
    let tuned = GeneratorFile::read(Path::new(&out)).unwrap();
    let stored = generator_record::read(&connected.flash()[0x4000..0x8000]).unwrap().expect("a record");
    assert_eq!((stored.config, stored.name.as_str()), (tuned.set.config(), "tuned"));
    let (GeneratorSet::PhaseCoupled(before), GeneratorSet::PhaseCoupled(after)) = (file.set, tuned.set) else {
        panic!()
    };
    assert!((before.natural_period_s / after.natural_period_s - 1.2).abs() < 1e-5);
}

/// `probe-rs list`, and `attach --chip CHIP --log-format '{L} {s}' ELF`, which prints the log and stays attached until it is ended.
const ATTACH_STAND_IN: &str = r#"#!/bin/sh
case "$1" in
list) echo "The following debug probes were found:"; echo "[0]: STLink V2 -- 0483:3748:0668FF (ST-LINK)" ;;
attach) [ "$2 $3 $4 $5" = "--chip STM32F407VGTx --log-format {L} {s}" ] && [ -f "$6" ] || exit 3
    echo "attached to the stand-in" >&2
    trap 'echo ended >> "$LOG.ended"; exit 0' TERM PIPE
    cat "$LOG"
    while :; do sleep 0.1; done ;;
*) echo "unknown: $*" >&2; exit 3 ;;
esac
"#;

/// What the image logs on the virtual board, as probe-rs prints it, goes through `cargo xtask` to the program and comes out whole.
fn a_board_is_watched_and_recorded_behind_probe_rs() {
    let connected = Connected::by("probe-rs", ATTACH_STAND_IN, &[]);
    let image = Image::read(&PathBuf::from(std::env::var_os("FOOTFALL_ELF").expect("the image"))).expect("an image");
    let ran = Board::find().run(["--secs", "3", "--press", ARM]);
    let mut decoder = image.decoder();
    for line in ran.output.lines() {
        if let BoardLine::Rtt { bytes, .. } = lines::parse(line).expect("a line") {
            decoder.push(&bytes);
        }
    }
    let mut log = String::new();
    while let Some(message) = decoder.message() {
        let message = message.expect("whole frames");
        let level =
            if message.level.is_empty() { "<lvl>".into() } else { format!("{:<5}", message.level.to_uppercase()) };
        log += &format!("{level} {}\n", message.text);
    }
    std::fs::write(connected.at("log"), log).unwrap();

    let (code, said, errors) = connected.xtask("watch --json --secs 2");
    assert_eq!(code, Some(0), "{errors}");
    let ticks: Vec<serde_json::Value> = said
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).expect("an object"))
        .filter(|object| object["type"] == "tick")
        .collect();
    let sent: Vec<u32> = ran.boots[0].ticks.iter().map(|tick| tick.tick).take(ticks.len()).collect();
    assert!(ticks.len() >= 200, "{}", ticks.len());
    assert_eq!(ticks.iter().map(|tick| tick["tick"].as_u64().unwrap() as u32).collect::<Vec<_>>(), sent);
    // probe-rs was asked to end.
    assert_eq!(std::fs::read_to_string(connected.at("log.ended")).unwrap(), "ended\n");

    let out = connected.at("walk.csv");
    let (code, _, errors) = connected.xtask(&format!("record --secs 2 -o {}", out.display()));
    assert!(code == Some(0) && errors.contains("0 lost"), "{errors}");
    assert!(std::fs::read_to_string(out).unwrap().lines().count() > 2_000);

    // A board that says nothing: the words of probe-rs are passed on.
    std::fs::write(connected.at("log"), "").unwrap();
    let (code, _, errors) = connected.xtask("watch --plain --secs 0.5");
    assert_eq!(code, Some(1), "{errors}");
    for words in ["no byte for 5 s; check that the board runs", "probe-rs: attached to the stand-in"] {
        assert!(errors.contains(words), "{errors}");
    }
}
