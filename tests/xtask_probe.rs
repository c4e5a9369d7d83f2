//! `cargo xtask` and `cargo run` with a board at a debug probe: probe-rs as it is released, and the virtual board as probe and target.

use footfall_tests::bench::{Bench, Log, Said, elf, root, until};
use footfall_tests::host::Host;
use generator_file::file::{GeneratorFile, GeneratorSet};
use joint_loop::SupervisorState;
use joint_loop::store::generator_record;
use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use test_suite::tests;

fn main() -> ExitCode {
    test_suite::run(tests![
        records_are_shown_saved_and_erased(Image, Program, ProbeRs),
        what_was_tuned_becomes_the_record(Image, Program, ProbeRs),
        a_walk_is_watched_and_recorded(Image, Program, ProbeRs),
        the_number_of_the_chip_names_a_bring_up(Image, Program, ProbeRs),
        the_brown_out_reset_gets_its_level_and_nothing_else_changes(Image, ProbeRs),
        the_runner_of_cargo_seals_writes_and_starts(Image, ProbeRs),
        cargo_embed_writes_an_image_that_walks(Image, ProbeRs, Terminal),
    ])
}

fn records_are_shown_saved_and_erased() {
    let board = Bench::with_image(&[]);
    let xtask = |arguments: &str| board.xtask(&format!("board {arguments}"));
    let (code, said, errors) = xtask("info");
    assert!(
        code == Some(0) && said == "generator.bin: erased\nsensors.bin: erased\nrobot.bin: erased\n",
        "{said}{errors}"
    );
    // Records are written by probe-rs alone, as `cargo xtask flash` does.
    let write = |name: &str, arguments: &[&str], address: &str, change: &dyn Fn(&mut Vec<u8>)| {
        let program = std::env::var_os("FOOTFALL_BIN").expect("the program");
        let mut pack = Command::new(program);
        pack.args(["pack", "--force", "--out"]).arg(board.at(name)).args(arguments);
        assert!(pack.current_dir(root().join("samples")).status().unwrap().success());
        let mut bytes = std::fs::read(board.at(name)).unwrap();
        change(&mut bytes);
        std::fs::write(board.at(name), &bytes).unwrap();
        let mut download = board.beside(test_suite::probe_rs(), "");
        download.args(["download", "--chip", "STM32F407VGTx", "--binary-format", "bin", "--base-address", address]);
        assert!(download.arg(board.at(name)).status().unwrap().success());
    };
    write("g.bin", &["generator.toml", "--name", "normal walk"], "0x08004000", &|_| {});
    write("r.bin", &["--robot", "robot.toml"], "0x0800C000", &|_| {});
    let said = board.must("board info");
    assert!(said.contains("generator.bin: good: the generator \"normal walk\", shape, check sum"), "{said}");
    assert!(said.contains("robot.bin: good: the robot \"small biped\", check sum"), "{said}");

    // A bit of the robot's record flips.
    write("r.bin", &["--robot", "robot.toml"], "0x0800C000", &|bytes| bytes[0x40] ^= 1);
    let (code, said, errors) = xtask("info");
    assert!(code == Some(2) && errors.contains("robot.bin: damaged: check sum"), "{code:?} {said}{errors}");
    assert!(said.contains("normal walk"), "{said}");

    let flash = board.memory(0x0800_4000, 0xC000);
    let saved = board.at("saved");
    let read = format!("read --out {}", saved.display());
    let (code, _, errors) = xtask(&read);
    assert_eq!(code, Some(0), "{errors}");
    let sectors = ["generator.bin", "sensors.bin", "robot.bin"].map(|name| std::fs::read(saved.join(name)).unwrap());
    assert!(sectors.concat() == flash);
    let (code, _, errors) = xtask(&read);
    assert!(code == Some(1) && errors.contains("exists"), "{errors}");
    assert_eq!(xtask(&format!("{read} --force")).0, Some(0));

    assert_eq!(xtask("erase").0, Some(2), "no sector is named");
    let (code, _, errors) = xtask("erase --robot");
    assert!(code == Some(0) && errors.contains("robot sector: erased; the board runs the built-in robot"), "{errors}");
    let after = board.memory(0x0800_4000, 0xC000);
    assert!(after[0x8000..].iter().all(|byte| *byte == 0xFF));
    assert!(after[..0x8000] == flash[..0x8000]);
}

/// The serial port and the probe are the same board's. The record that is written makes the board move as it was tuned.
fn what_was_tuned_becomes_the_record() {
    let board = Bench::with_image(&["--serial"]);
    let file = GeneratorFile::default_of("phase-coupled").unwrap();
    std::fs::write(board.at("walk.toml"), file.to_toml()).unwrap();
    let [walk, out] = ["walk.toml", "tuned.toml"].map(|name| board.at(name).display().to_string());
    let port = board.port();
    let save = || board.xtask(&format!("board save {walk} --serial {port} --out {out} --force"));
    let set = |words: &[&str]| {
        let words = [&["footfall", "set", "--serial", &port], words].concat();
        footfall::cli::call(words.into_iter().map(Into::into)).unwrap();
    };
    board.arm();
    Host::open(Path::new(&port)).until("walking", |host| host.state == SupervisorState::Walking);
    set(&["speed", "1.2"]);
    let (code, _, errors) = save();
    assert!(code == Some(1) && errors.contains("the board is in the state `walking`"), "{errors}");
    set(&["--stop"]);
    Host::open(Path::new(&port)).until("disarmed", |host| host.state == SupervisorState::Disarmed);
    let (code, said, errors) = save();
    assert!(code == Some(0) && errors.contains("read back; the board was reset"), "{said}{errors}");
    assert!(board.of_kind("boot").len() >= 2, "{:?}", board.of_kind("boot"));
    let tuned = GeneratorFile::read(Path::new(&out)).unwrap();
    let stored = generator_record::read(&board.memory(0x0800_4000, 0x4000)).unwrap().expect("a record");
    assert_eq!((stored.config, stored.name.as_str()), (tuned.set.config(), "tuned"));
    let (GeneratorSet::PhaseCoupled(before), GeneratorSet::PhaseCoupled(after)) = (file.set, tuned.set) else {
        panic!("other kinds")
    };
    assert!((before.natural_period_s / after.natural_period_s - 1.2).abs() < 1e-5);
}

/// All steps are skipped: what is left is what the probe adds.
fn the_number_of_the_chip_names_a_bring_up() {
    let board = Bench::with_image(&["--serial"]);
    let port = board.port();
    let out = board.at("found.toml");
    let mut bringup = board.beside("cargo", "");
    bringup.args(["xtask", "bringup", "--serial", &port, "--out"]).arg(&out);
    let mut child = bringup.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    writeln!(child.stdin.take().unwrap(), "q").unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found = std::fs::read_to_string(out).unwrap();
    for words in ["board = \"f4-discovery\"", "chip_id = \"003500273133510c34373439\"", "verdict = \"incomplete\""] {
        assert!(found.contains(words), "{words}: {found}");
    }
}

/// Attached before it is armed, a walk comes whole: on the screen's lines and in a file.
fn a_walk_is_watched_and_recorded() {
    /// Ticks from one frame to the next.
    const EVERY: u64 = 10;
    let board = Bench::with_image(&[]);
    let mut watch = Log::start(board.beside("cargo", "").args(["xtask", "watch", "--json", "--secs", "20"]));
    watch.until("\"type\":\"tick\"");
    board.arm();
    watch.until("\"walking\"");
    until("the end of the view", || watch.child.try_wait().unwrap().is_some());
    let [said, errors] = [&watch.said, &watch.errors].map(Said::text);
    assert!(watch.child.wait().unwrap().success(), "{errors}");
    let ticks: Vec<u64> = said
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("an object"))
        .filter(|object| object["type"] == "tick")
        .map(|object| object["tick"].as_u64().expect("a number"))
        .collect();
    // The first ones are from the buffer, which was full before.
    let gaps = |ticks: &[u64]| ticks.windows(2).filter(|pair| pair[1] - pair[0] != EVERY).count();
    assert!(ticks.len() > 500 && gaps(&ticks[40..]) == 0 && gaps(&ticks[..41]) <= 1, "a tick is lost: {ticks:?}");
    board.stop();

    let out = board.at("walk.csv");
    let said = board.must(&format!("record --secs 2 -o {}", out.display()));
    assert!(said.contains(" 0 lost"), "{said}");
    assert!(std::fs::read_to_string(out).unwrap().lines().count() > 1_900);
}

fn the_brown_out_reset_gets_its_level_and_nothing_else_changes() {
    let board = Bench::start(["--erased", "--no-brown-out-reset"]);
    let optcr = || u32::from_le_bytes(board.memory(0x4002_3C14, 4).try_into().unwrap());
    let delivered = optcr();
    assert_eq!(delivered >> 2 & 3, 3, "off: {delivered:#010x}");
    let said = board.must("board brown-out");
    assert!(
        said.contains("the brown-out reset is at level 2 now") && said.contains("feed 3.3 V to its 3V pin"),
        "{said}"
    );
    assert_eq!(optcr(), delivered & !0xC | 1 << 2);
    assert!(board.must("board brown-out").contains("at level 2 already"));
    for (options, words) in
        [("--level 3", "add `--measured-vdd VOLTS`"), ("--level 3 --measured-vdd 2.95", "some chips would not start")]
    {
        let (code, _, errors) = board.xtask(&format!("board brown-out {options}"));
        assert!(code == Some(1) && errors.contains(words), "{errors}");
    }
    assert_eq!(optcr(), delivered & !0xC | 1 << 2);
    board.must("board brown-out --level 3 --measured-vdd 3.02");
    assert_eq!(optcr(), delivered & !0xC);
    board.must("board brown-out --level off");
    assert_eq!(optcr(), delivered);
}

/// The line of `.cargo/config.toml`, as cargo runs it from the root and from the folder of the firmware. Its image has no seal.
fn the_runner_of_cargo_seals_writes_and_starts() {
    const SEAL: usize = 0x0800_3FF4;
    let board = Bench::start(["--erased"]);
    let mut image = std::fs::read(elf()).unwrap();
    let at = image.windows(4).position(|bytes| bytes == b"SEAL").expect("a sealed image");
    image[at..at + 12].fill(0xFF);
    let unsealed = board.at("firmware");
    std::fs::write(&unsealed, image).unwrap();
    for folder in ["", "firmware"] {
        let config: toml::Table =
            std::fs::read_to_string(root().join(folder).join(".cargo/config.toml")).unwrap().parse().unwrap();
        let runner = config["target"]["thumbv7em-none-eabihf"]["runner"].as_str().expect("a line").to_owned();
        let mut words = runner.split(' ');
        let mut command = board.beside(words.next().expect("a program"), folder);
        let mut log = Log::start(command.args(words).arg(&unsealed));
        log.until("disarmed");
        let said = log.terminate();
        assert!(said.contains("image for f4-discovery"), "{said}");
        assert_eq!(board.memory(SEAL as u32, 4), b"SEAL");
        board.command("power");
    }
    board.arm();

    let mut other = board.beside("cargo", "");
    let other = other.args(["xtask", "run-image"]).arg(std::env::var_os("FOOTFALL_VIRTUAL_BOARD").unwrap()).output();
    let errors = String::from_utf8_lossy(&other.unwrap().stderr).into_owned();
    assert!(errors.contains("not a 32 bit little-endian ELF file"), "{errors}");
}

/// With the settings in the folder of the firmware, which `cargo embed` reads there; its screen wants a terminal.
fn cargo_embed_writes_an_image_that_walks() {
    let board = Bench::start(["--erased"]);
    let mut image = std::fs::read(elf()).unwrap();
    let at = image.windows(4).position(|bytes| bytes == b"SEAL").expect("a sealed image");
    image[at..at + 12].fill(0xFF);
    std::fs::write(board.at("firmware"), image).unwrap();
    let embed = format!(
        "{} cargo-embed --disable-progressbars --probe 1d50:6018:{} --path {}",
        test_suite::probe_rs().display(),
        board.address,
        board.at("firmware").display()
    );
    let mut screen = Log::start(board.beside("script", "firmware").args(["-qfec", &embed, "/dev/null"]));
    let boots = board.of_kind("boot").len();
    // The loader resets the chip, and the end of the download once more.
    until("the boot of the image", || {
        assert!(screen.child.try_wait().unwrap().is_none(), "{}", screen.said.text());
        board.of_kind("boot").len() > boots
            && board.of_kind("status").last().is_some_and(|line| line["hclk_hz"] == 168_000_000)
    });
    board.arm();
    screen.child.kill().unwrap();
    screen.child.wait().unwrap();
}
