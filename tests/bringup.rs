//! `footfall bringup` as a person does it, with the flashed image on the virtual board: a good board passes, and values that are wrong are refused.

use firmware::board::{ROBOT_SECTOR, SENSORS_SECTOR};
use footfall::command::bringup::evidence::{Evidence, Port, Quantity, Status, Value, Verdict};
use joint_loop::store::{robot_record, sensor_record};
use joint_loop::{JointSensor, JointSensors, RecordName, RobotConfig};
use joint_units::Joint;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitCode, Stdio};
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        a_good_board_passes(Image, Program),
        a_pulse_that_is_20_us_off_is_refused(Image, Program),
        a_crystal_that_is_2_percent_off_is_refused(Image, Program),
        a_board_that_ends_the_pulses_itself_gives_its_cause(Image, Program),
    ])
}

/// A virtual board in real time, with four sensors in its sensor record.
struct Board {
    child: Child,
    console: ChildStdin,
    port: String,
    output: std::thread::JoinHandle<String>,
}

impl Board {
    fn start(folder: &Path, options: &[&str]) -> Self {
        let of = |name: &str| std::env::var_os(name).unwrap_or_else(|| panic!("{name}"));
        let sensors = JointSensors::build(Joint::ALL.map(|joint| JointSensor::uncalibrated(joint).expect("a sensor")));
        let sensors = sensor_record::record_of(&sensors.expect("four sensors"), &RecordName::BUILT_IN);
        let robot = robot_record::record_of(&RobotConfig::default_biped(), &RecordName::BUILT_IN);
        let flash = |address: u32, name: &str, bytes: &[u8]| {
            let file = folder.join(name);
            std::fs::write(&file, bytes).expect("written");
            ["--flash".into(), OsString::from(format!("{address:#010x}={}", file.display()))]
        };
        let mut child = Command::new(of("FOOTFALL_VIRTUAL_BOARD"))
            .arg(of("FOOTFALL_ELF"))
            .args(["--serial", "--pace"])
            .args(flash(ROBOT_SECTOR, "robot.bin", robot.bytes()))
            .args(flash(SENSORS_SECTOR, "sensors.bin", sensors.bytes()))
            .args(options)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the virtual board starts");
        let console = child.stdin.take().expect("piped");
        let mut lines = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        while !line.contains("\"type\":\"serial\"") {
            line.clear();
            assert!(lines.read_line(&mut line).expect("text") > 0, "the board names its port");
        }
        let named: serde_json::Value = serde_json::from_str(&line).expect("an object");
        let port = named["port"].as_str().expect("a name").to_owned();
        let output = std::thread::spawn(move || {
            // Only the last line is kept.
            lines.lines().map(|line| line.expect("text")).last().unwrap_or_default()
        });
        Self { child, console, port, output }
    }

    fn command(&mut self, command: &str) {
        writeln!(self.console, "{command}").expect("the board takes commands");
    }

    /// The exit code and the last line.
    fn end(mut self) -> (Option<i32>, serde_json::Value) {
        self.command("quit");
        let last = self.output.join().expect("it reads");
        let code = self.child.wait().expect("it ends").code();
        (code, serde_json::from_str(&last).expect("an object"))
    }
}

/// What a bring-up wrote.
struct BroughtUp {
    code: Option<i32>,
    said: String,
    evidence: Evidence,
}

impl BroughtUp {
    fn quantity(&self, begin: &str) -> &Quantity {
        let found = self.evidence.quantities.iter().find(|one| one.name.starts_with(begin));
        found.unwrap_or_else(|| panic!("no quantity {begin}"))
    }

    fn number(&self, begin: &str) -> f64 {
        let quantity = self.quantity(begin);
        let Some(Value::Number(value)) = quantity.value else { panic!("{quantity}") };
        value
    }
}

/// A person who reads what the program says, moves the wire and presses what it asks for. Steps whose number is not in `steps` are skipped, and so is one
/// that has had no result.
fn bring_up(folder: &Path, board: &mut Board, clock_secs: &str, steps: &[u32]) -> BroughtUp {
    let out = folder.join("found.toml");
    let mut child = Command::new(std::env::var_os("FOOTFALL_BIN").expect("FOOTFALL_BIN"))
        .args(["bringup", "--serial", &board.port, "--chip-id", "virtual-1", "--clock-secs", clock_secs, "-o"])
        .arg(&out)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut answers = child.stdin.take().expect("piped");
    let mut printed = child.stdout.take().expect("piped");
    let (mut said, mut step, mut is_failed) = (String::new(), 0, false);
    for line in BufReader::new(child.stderr.take().expect("piped")).lines() {
        let line = line.expect("text");
        said += &line;
        said.push('\n');
        if let Some(number) = line.strip_prefix("step ").and_then(|rest| rest.split(' ').next()) {
            let number = number.parse().expect("a number");
            (step, is_failed) = (number, is_failed && number == step);
        }
        is_failed |= line.contains("no result:");
        match line.trim() {
            to_do if to_do.ends_with("[Enter, s, q]") => {
                let pins: Vec<&str> = to_do.split([' ', '.', ',']).filter(|word| is_pin(word)).collect();
                let [from, to] = pins[..] else {
                    writeln!(answers, "{}", if steps.contains(&step) && !is_failed { "" } else { "s" }).expect("taken");
                    continue;
                };
                board.command(&format!("wire {from}={to}"));
                writeln!(answers, "{}", if steps.contains(&step) && !is_failed { "" } else { "s" }).expect("taken");
            }
            "now: press the reset button and release it" => board.command("inject \"reset-button\", for_ms = 50"),
            "now: press the emergency stop and release it; then hold the button for half a second" => {
                board.command("stop");
                board.command("hold");
            }
            "now: hold the button for half a second" => board.command("hold"),
            "now: press the emergency stop, and hold it for a second" => board.command("stop"),
            "now: release the emergency stop, and hold the button for half a second, which acknowledges the fault" => {
                board.command("hold");
            }
            "now: halt the core with the debug probe" => board.command("inject \"halt\""),
            "now: switch the board's supply off and on again" => {
                board.command("inject { power-cycle = { ram = \"scrambled\", seed = 1 } }, for_ms = 500");
            }
            other => assert!(!other.starts_with("now: "), "{other}"),
        }
    }
    let mut table = String::new();
    printed.read_to_string(&mut table).expect("text");
    let code = child.wait().expect("it ends").code();
    let text = std::fs::read_to_string(&out).unwrap_or_else(|error| panic!("{error}:\n{said}"));
    let evidence = Evidence::parse(&text).unwrap_or_else(|error| panic!("{error}:\n{text}"));
    assert!(table.ends_with(&format!("verdict: {}\n", evidence.verdict.name())), "{table}");
    BroughtUp { code, said, evidence }
}

fn is_pin(word: &str) -> bool {
    matches!(word.as_bytes(), [b'P', b'A'..=b'E', digits @ ..] if !digits.is_empty() && digits.iter().all(u8::is_ascii_digit))
}

fn a_good_board_passes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut board = Board::start(folder.path(), &[]);
    let found = bring_up(folder.path(), &mut board, "15", &(1..=13).collect::<Vec<_>>());
    let BroughtUp { code, said, evidence } = &found;
    assert_eq!((evidence.verdict, *code), (Verdict::Passed, Some(0)), "{said}");
    assert_eq!((evidence.board.as_str(), evidence.port), ("f4-discovery", Port::PseudoTerminal));
    assert!(evidence.versions.sensors.as_ref().is_some_and(|name| name.starts_with("built-in ")));
    // What the model has, to the digit.
    assert_eq!(found.number("period, left_hip"), 20_000.0);
    assert_eq!(found.number("width error, median, right_knee"), 0.0);
    assert_eq!((found.number("code of PB1 at the low"), found.number("code of PB1 at the high")), (0.0, 4095.0));
    assert!((found.number("watchdog oscillator") - 32_000.0).abs() < 50.0);
    let stated = |one: &&Quantity| one.least.or(one.most).is_some() && one.stated.is_none();
    assert!(evidence.quantities.iter().find(stated).is_none(), "a limit without its place");
    let (code, last) = board.end();
    assert_eq!((code, &last["judged"]["violations"]), (Some(0), &0.into()), "{last}");
    report!(
        "{} quantities; clock {}, emergency stop {}, watchdog {}",
        evidence.quantities.len(),
        found.quantity("board clock"),
        found.quantity("emergency stop to"),
        found.quantity("halt to")
    );
}

/// The timer's counter is set back by 20 us before the end of each pulse of 1500 us, and forward after it, between two ticks, while the
/// joint is parked: no register shows it, and the frames stay where they are.
fn a_pulse_that_is_20_us_off_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let script = folder.path().join("late.toml");
    let event = |phase_us: u32, count: u32| {
        format!(
            "[[event]]\non = \"armed\"\nphase_us = {phase_us}\nevery_ms = 20\ntimes = 75\n\
             inject = {{ write = {{ address = 0x4001_0024, value = {count} }} }}\n"
        )
    };
    std::fs::write(&script, event(1_490, 1_470) + &event(1_530, 1_530)).expect("written");
    let script = script.display().to_string();
    let mut board = Board::start(folder.path(), &["--script", &script]);
    let found = bring_up(folder.path(), &mut board, "10", &[1, 7]);
    assert_eq!((found.evidence.verdict, found.code), (Verdict::Refused, Some(1)), "{}", found.said);
    assert_eq!(found.number("width error, median, left_hip"), 20.0);
    assert_eq!(found.quantity("width error, median, left_hip").status, Status::Refused);
    assert_eq!(found.number("period, left_hip"), 20_000.0);
    assert!(found.said.contains("error: refused: width error, median, left_hip"), "{}", found.said);
    let (code, last) = board.end();
    assert_eq!((code, &last["judged"]["violations"]), (Some(0), &0.into()), "{last}");
}

/// The board takes the crystal, because its own oscillator may be off by more; its pulses are right by its own clock. The computer's clock shows it.
fn a_crystal_that_is_2_percent_off_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut board = Board::start(folder.path(), &["--hse-hz", "8160000"]);
    let found = bring_up(folder.path(), &mut board, "15", &[1, 2]);
    assert_eq!((found.evidence.verdict, found.code), (Verdict::Refused, Some(1)), "{}", found.said);
    let refused = found.evidence.refused();
    assert!(refused.len() == 1 && refused[0].starts_with("board clock against the host: refused, "), "{refused:?}");
    let ppm = found.number("board clock against the host");
    assert!((19_000.0..=21_000.0).contains(&ppm), "{ppm}");
    report!("{}", refused[0]);
    board.end();
}

/// A register of the timer is changed while the pulses run: the board finds it and switches off, and the step has that as its reason.
fn a_board_that_ends_the_pulses_itself_gives_its_cause() {
    let folder = tempfile::tempdir().expect("a folder");
    let script = folder.path().join("changed.toml");
    let event = "[[event]]\non = \"armed\"\nafter_ms = 300\n";
    std::fs::write(&script, format!("{event}inject = {{ write = {{ address = 0x4001_0034, value = 1520 }} }}\n"))
        .expect("written");
    let script = script.display().to_string();
    let mut board = Board::start(folder.path(), &["--script", &script]);
    let found = bring_up(folder.path(), &mut board, "10", &[1, 7]);
    assert_eq!((found.evidence.verdict, found.code), (Verdict::Refused, Some(1)), "{}", found.said);
    assert_eq!(found.quantity("fault of the board, left_hip").value, Some(Value::Word("outputs".into())));
    board.end();
}
