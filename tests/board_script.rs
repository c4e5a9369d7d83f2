//! Fault scripts on the virtual board: the one of the page, a supply that dips, a record that was torn, a memory of any content, and scripts that are wrong.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, ExitCode};

use firmware::board::ROBOT_SECTOR;
use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::{ARM, ARMED_S, hold};
use footfall_tests::recordings::default_volts_file;
use test_suite::{report, tests};
use wire::{Reset, Subject};

fn main() -> ExitCode {
    test_suite::run(tests![
        the_script_of_the_page_does_what_it_says(Image),
        a_dip_resets_only_with_the_brown_out_reset(Image),
        a_torn_record_keeps_the_board_dark(Image),
        a_memory_of_any_content_boots_disarmed(Image),
        a_wrong_script_names_its_line(Image),
        events_that_overlap_are_refused_with_both_names(Image),
        an_event_that_does_not_come_is_named_and_fails_the_run(Image),
        a_fault_of_an_option_that_does_not_come_fails_the_run_too(Image),
        a_phase_of_a_timer_that_stands_is_not_waited_for(Image),
    ])
}

/// The script of docs/virtual-board.md.
fn script_of_the_page() -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/virtual-board.md");
    let text = std::fs::read_to_string(page).expect("the page");
    let (_, rest) = text.split_once("```toml\n").expect("a script");
    rest.split_once("```").expect("its end").0.to_owned()
}

/// A run that is armed at 0.4 s, with a script and further options.
fn run(script: &str, secs: &str, options: &[&str]) -> Ran {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), script).expect("written");
    let (file, volts) = (file.path().to_str().expect("text"), default_volts_file());
    let volts = volts.to_str().expect("text");
    let own = ["--script", file, "--secs", secs, "--press", ARM, "--loop", "--volts", volts];
    Board::find().run(own.iter().chain(options))
}

/// Times at which something was injected, by its name, s.
fn injected(ran: &Ran, name: &str) -> Vec<f64> {
    let lines = ran.remarks.iter().filter(|line| line["type"] == "injected" && line["symbol"] == name);
    lines.filter_map(|line| line["t_s"].as_f64()).collect()
}

const NO_PULSES: [f64; 0] = [];

/// Times of the pulses from a time on, s.
fn pulses_from(ran: &Ran, seconds: f64) -> Vec<f64> {
    ran.pulses.iter().map(|(at, _)| *at).filter(|at| *at > seconds).collect()
}

fn the_script_of_the_page_does_what_it_says() {
    let ran = run(&script_of_the_page(), "1.5", &[]);
    let [dip] = injected(&ran, "the servos pull the supply down")[..] else { panic!("{:?}", ran.remarks) };
    assert!((0.3..ARMED_S + 0.3 + 0.02).contains(&(dip - 0.3)), "{dip}");
    // 500 us after the beginning of a servo frame, where the pulses begin.
    let (frame, _) = ran.pulses.iter().rfind(|(at, _)| *at <= dip).expect("pulses");
    assert!((dip - frame - 500e-6).abs() < 3e-6, "{} us", (dip - frame) * 1e6);
    let causes: Vec<&str> = ran.boots.iter().map(|boot| boot.cause.as_str()).collect();
    assert_eq!(causes, ["power_on", "brown_out"]);
    assert_eq!(ran.boots[1].boot.as_ref().map(|boot| boot.reset), Some(Reset::BrownOut));
    assert_eq!(pulses_from(&ran, dip), NO_PULSES);
    let [stops] = injected(&ran, "rtt")[..] else { panic!("{:?}", ran.remarks) };
    assert!((stops - dip - 0.1).abs() < 1e-3, "{stops}");
    let lost = injected(&ran, "overrun");
    assert_eq!(lost.len(), 3);
    assert!(lost.windows(2).all(|pair| (pair[1] - pair[0] - 0.4).abs() < 1e-6), "{lost:?}");
    // Ticks begin some milliseconds after the boot.
    assert!((0.060..0.075).contains(&lost[0]), "{lost:?}");
    report!("supply dips at {dip} s, results are lost at {lost:?} s");
}

const DIP: &str = "[[event]]\nat_s = 1.5\ninject = { vdd = 2.4 }\nfor_ms = 20\n";

fn a_dip_resets_only_with_the_brown_out_reset() {
    for (options, causes) in [(&[][..], &["power_on", "brown_out"][..]), (&["--no-brown-out-reset"], &["power_on"])] {
        let ran = run(DIP, "1.7", options);
        let seen: Vec<&str> = ran.boots.iter().map(|boot| boot.cause.as_str()).collect();
        assert_eq!(seen, causes);
        // Without the reset so short a dip is only counted.
        assert_eq!(pulses_from(&ran, 1.52).is_empty(), options.is_empty());
    }
}

/// The robot's record is torn in a walk: the board resets, and stays dark whatever the button does, also after its flash was taken out and put in again.
fn a_torn_record_keeps_the_board_dark() {
    let folder = tempfile::tempdir().expect("a folder");
    for (n, what) in [
        "{ flash-erase = { sector = 3, cut_ms = 5 } }",
        "{ flash-erase = { sector = 3 } }",
        "{ flash-program = { address = 0x0800_C010, value = 0, cut_us = 8 } }",
    ]
    .into_iter()
    .enumerate()
    {
        let file = folder.path().join(format!("sector{n}.bin"));
        let sector = format!("{ROBOT_SECTOR:#010X}={}", file.display()).replacen("0X", "0x", 1);
        let again = hold(0.8);
        let script = format!("[[event]]\nat_s = 0.6\ninject = {what}\n");
        let ran = run(&script, "1.6", &["--save-flash", &sector, "--press", &again]);
        assert_eq!(ran.boots.len(), 2, "{what}");
        assert!(ran.pulses.iter().any(|(at, _)| *at < 0.6), "it walked before");
        let pulses = pulses_from(&ran, 0.65);
        assert_eq!(pulses, NO_PULSES, "{what}");
        let [refused] = &ran.boots[1].refused[..] else { panic!("{what}: {:?}", ran.boots[1].refused) };
        assert_eq!(refused.subject, Subject::RobotRecord, "{what}: {}", refused.reason);
        // An erase that was cut changes any word: that of kind, schema and length too.
        let is_torn = ["damaged", "unknown record kind", "schema"].iter().any(|words| refused.reason.contains(words));
        assert!(is_torn, "{what}: {}", refused.reason);
        report!("{what}: {}", refused.reason);
        let bytes = std::fs::read(&file).expect("the sector");
        assert_eq!(bytes.len(), 16 * 1024);
        // Put in again; the lower case names the sector as filled.
        let put_in = format!("{ROBOT_SECTOR:#010x}={}", file.display());
        let ran = run("", "1.6", &["--flash", &put_in, "--press", &again]);
        assert!(ran.pulses.is_empty() && ran.boots[0].refused.len() == 1, "{what}");
    }
}

fn a_memory_of_any_content_boots_disarmed() {
    for ram in ["ram = \"kept\"", "ram = \"scrambled\", seed = 1", "ram = \"scrambled\", seed = 2"] {
        let script = format!("[[event]]\nat_s = 1.0\ninject = {{ power-cycle = {{ {ram} }} }}\nfor_ms = 30\n");
        let ran = run(&script, "1.4", &[]);
        let [first, second] = &ran.boots[..] else { panic!("{ram}: {} boots", ran.boots.len()) };
        assert!(!first.calls.is_empty() && second.calls.len() > 300, "{ram}: {}", second.calls.len());
        let boot = second.boot.as_ref().expect("a boot record");
        assert_eq!((boot.reset, pulses_from(&ran, 1.0).is_empty()), (Reset::PowerOn, true), "{ram}");
    }
}

/// The exit code, the messages and the lines of a run of 0.4 s with these options, with the default robot and an emergency stop that is tested.
fn ended(options: &[&OsStr]) -> (Option<i32>, String, Vec<u8>) {
    let path = |name: &str| std::env::var_os(name).unwrap_or_else(|| panic!("{name}"));
    let mut board = Command::new(path("FOOTFALL_VIRTUAL_BOARD"));
    let board = board.arg(path("FOOTFALL_ELF")).args(["--secs", "0.4"]).args(options);
    let output = board.output().expect("the virtual board starts");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned(), output.stdout)
}

/// The same with a script.
fn judged(script: &str) -> (Option<i32>, String, Vec<u8>) {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), script).expect("written");
    ended(&["--script".as_ref(), file.path().as_os_str()])
}

fn events_that_overlap_are_refused_with_both_names() {
    let two = |one: &str, two: &str| format!("[[event]]\nname = \"a\"\n{one}\n[[event]]\nname = \"b\"\n{two}\n");
    let volts = "inject = { volts = { pin = \"PA1\", volts = 1.0 } }";
    let slow = "inject = { slow = 2.0 }";
    for (script, words) in [
        // Their times are known before the run.
        (
            two(&format!("at_s = 0.1\n{volts}\nfor_ms = 50"), &format!("at_s = 0.12\n{volts}")),
            Some("on the pin PA1, 0.12"),
        ),
        (
            two("at_s = 0.1\ninject = { vdd = 2.9 }", "at_s = 0.2\ninject = { supply = 2.9 }\nfor_ms = 5"),
            Some("on the supply, 0.2"),
        ),
        // They are known only in the run.
        (
            two(&format!("at_s = 0.1\n{slow}\nfor_ms = 200"), &format!("on = \"boot\"\nafter_ms = 150\n{slow}")),
            Some("on the speed of the core at 0.15"),
        ),
        (two(&format!("at_s = 0.1\n{volts}\nfor_ms = 50"), &format!("at_s = 0.15\n{volts}\nfor_ms = 50")), None),
        (two(&format!("at_s = 0.1\n{volts}\nfor_ms = 50"), &format!("at_s = 0.12\n{slow}\nfor_ms = 50")), None),
        (two(&format!("at_s = 0.1\n{volts}"), &format!("at_s = 0.2\n{volts}")), None),
    ] {
        let (code, error, _) = judged(&script);
        assert_eq!(code, Some(if words.is_some() { 2 } else { 0 }), "{script}: {error}");
        let named =
            words.is_none_or(|words| ["`a` (line 1)", "`b` (line", words].iter().all(|part| error.contains(part)));
        assert!(named, "{script}: {error}");
    }
    let (code, error, _) = judged(&format!("[[event]]\nat_s = 0.1\nevery_ms = 5\ntimes = 3\nfor_ms = 6\n{slow}\n"));
    assert!(code == Some(2) && error.contains("`slow` (line 1) overlaps itself"), "{error}");
}

fn an_event_that_does_not_come_is_named_and_fails_the_run() {
    for (moment, words) in [
        ("at_s = 9", "`crystal` (line 2): it was due at 9 s, and the run ended at 0.4"),
        ("on = \"armed\"\ncount = 2", "`crystal` (line 2): its moment did not come: on = \"armed\", count = 2"),
        ("tick = 100000", "`crystal` (line 2): its moment did not come: call = \"control_step\", count = 100000"),
        ("on = \"boot\"\nafter_ms = 700", "`crystal` (line 2): it was due at 0.7"),
    ] {
        let (code, error, _) = judged(&format!("\n[[event]]\n{moment}\ninject = \"crystal\"\n"));
        assert_eq!(code, Some(1), "{moment}: {error}");
        assert!(error.contains("the run did not show the event") && error.contains(words), "{moment}: {error}");
    }
}

fn a_fault_of_an_option_that_does_not_come_fails_the_run_too() {
    for (options, words) in [
        (["--hang", "control_step@9"], "`control_step` (--hang): it was due at 9 s, and the run ended at 0.4"),
        (["--lsi", "60000@9"], "`LSI` (--lsi): it was due at 9 s"),
        (["--hang", "Reset@0.2"], "`Reset` (--hang): nothing called the function from 0.2 s on"),
    ] {
        let (code, error, _) = ended(&options.map(OsStr::new));
        assert_eq!(code, Some(1), "{options:?}: {error}");
        assert!(error.contains("the run did not show the event") && error.contains(words), "{options:?}: {error}");
    }
}

fn a_phase_of_a_timer_that_stands_is_not_waited_for() {
    // At the power-on the timer of the servo frames has no clock.
    let (code, error, output) = judged("[[event]]\nat_s = 0.0\nphase_us = 500\ninject = { vdd = 2.9 }\nfor_ms = 5\n");
    assert_eq!(code, Some(0), "{error}");
    assert!(error.contains("`vdd` (line 1) does not wait for its phase_us: the servo timer stands at 0"), "{error}");
    let output = String::from_utf8_lossy(&output);
    assert!(output.contains(r#""lints":[]"#) && output.contains(r#""kind":"vdd""#), "no access of the program's");
}

fn a_wrong_script_names_its_line() {
    let path = |name: &str| std::env::var_os(name).unwrap_or_else(|| panic!("{name}"));
    let file = tempfile::NamedTempFile::new().expect("a file");
    for (script, words) in [
        ("[[event]]\nat_s = 1\ninject = \"quake\"\n", &["line 3", "unknown variant `quake`", "`panic`"][..]),
        ("[[event]]\nat_s = 1\ninject = \"panic\"\nhow = 2\n", &["line 4", "how", "for_ms"]),
        ("\n[[event]]\ninject = \"panic\"\n", &["line 2", "one moment: at_s, tick, call or on"]),
        ("[[event]]\ncall = \"no_such_step\"\ninject = \"panic\"\n", &["no_such_step"]),
        ("[[event]]\nat_s = 1\ninject = { pll = 3.0 }\n", &["line 1", "allowed are 0 to 2"]),
        ("[[event]]\nat_s = 1\ninject = { supply = 3300 }\n", &["line 1", "supply is 3300; allowed are 0 to 4 V"]),
        (
            "[[event]]\nat_s = 1\ninject = { level = { pin = \"PE9\", high = true } }\n",
            &["line 1", "PE9 is an output of the board", "PC8"],
        ),
        (
            "[[event]]\nat_s = 1\ninject = { volts = { pin = \"PB12\", volts = 1 } }\n",
            &["line 1", "PB12 is no input of the converter", "PC0 to PC5"],
        ),
        ("[[event]]\nat_s = 1\nphase_us = 20000\ninject = \"panic\"\n", &["phase_us is 20000;"]),
    ] {
        std::fs::write(file.path(), script).expect("written");
        let output = Command::new(path("FOOTFALL_VIRTUAL_BOARD"))
            .arg(path("FOOTFALL_ELF"))
            .args(["--secs", "0.1", "--script"])
            .arg(file.path())
            .output()
            .expect("the virtual board starts");
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{script}: {error}");
        assert!(words.iter().all(|words| error.contains(words)), "{script}: {error}");
    }
}
