//! What a debug probe reads and writes while the board walks: lines for people in RTT channel 0, records in channel 1, requests in the down channel. The
//! virtual board is the probe: it reads each millisecond, or as seldom as a test says, and serves channel 1 as OpenOCD does.

use footfall_tests::board::{Board, Ran};
use footfall_tests::gestures::ARM;
use footfall_tests::recordings::default_volts_file;
use joint_loop::SupervisorState;
use serde_json::Value;
use std::ffi::OsString;
use std::process::{Command, ExitCode, Stdio};
use test_suite::terminal::Terminal;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        a_reader_that_looks_each_100_ms_loses_nothing(Image, Program),
        lines_for_people_are_ten_a_second_and_fit(Image),
        a_channel_that_is_not_read_drops_whole_frames_and_goes_on(Image),
        a_program_that_shows_text_gets_lines_alone(Image),
        set_and_record_go_through_the_probe(Image, Program),
        keys_of_the_live_screen_go_through_the_probe(Image, Program, Terminal),
    ])
}

/// Options of a board whose sensor is moved by a recorded walk, and whose button is held once.
fn walks(secs: &str, more: &[&str]) -> Vec<OsString> {
    let mut options: Vec<OsString> = vec!["--volts".into(), default_volts_file().into(), "--loop".into()];
    options.extend(["--press", ARM, "--secs", secs].map(Into::into));
    options.extend(more.iter().map(Into::into));
    options
}

fn variable(name: &str) -> OsString {
    std::env::var_os(name).unwrap_or_else(|| panic!("{name}"))
}

/// The ticks of the calls that were recorded, without a gap between the first and the last.
fn has_every_call(ran: &Ran) -> bool {
    ran.boots[0].calls.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1)
}

/// Programs look ten times a second (probe-rs after an empty read, OpenOCD always): a minute of a walk, and every sample is there.
fn a_reader_that_looks_each_100_ms_loses_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("walk.csv");
    let mut record = Command::new(variable("FOOTFALL_BIN"));
    record.arg("record").arg("--elf").arg(variable("FOOTFALL_ELF")).arg("--virtual-board");
    record.arg(variable("FOOTFALL_VIRTUAL_BOARD")).arg("--out").arg(&out).args(["--secs", "60", "--json"]);
    let output = record.args(["--", "--rtt-every", "100"]).stdin(Stdio::null()).output().expect("it runs");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let about = std::fs::read_to_string(folder.path().join("walk.csv.json")).expect("a file");
    let about: Value = serde_json::from_str(&about).expect("an object");
    let counts = &about["counts"];
    report!("{counts}");
    assert!(counts["samples"].as_u64() >= Some(59_900), "{counts}");
    for none in ["lost_samples", "dropped_by_the_board", "different_ticks", "malformed_frames"] {
        assert_eq!(counts[none], 0, "{none}");
    }
    assert_eq!(counts["no_replay"], Value::Null);
}

fn lines_for_people_are_ten_a_second_and_fit() {
    let ran = Board::find().run(walks("6", &[]));
    ran.assert_sound();
    let boot = &ran.boots[0];
    let is_status =
        |line: &str| SupervisorState::ALL.iter().any(|state| line.starts_with(&format!("{}: ", state.name())));
    let status: Vec<(f64, &String)> =
        boot.log_times.iter().copied().zip(&boot.log).filter(|(_, line)| is_status(line)).collect();
    let walking: Vec<&String> =
        status.iter().map(|(_, line)| *line).filter(|line| line.starts_with("walking: ")).collect();
    report!("{} lines, {} of them of a walk, such as `{}`", boot.log.len(), walking.len(), walking[walking.len() / 2]);
    // Their stamps are of whole milliseconds, and telemetry has rounds of 2 ms. In any second but the first, which has the lines of the boot, at most ten and the changes of state.
    for (start, _) in &status {
        let times = boot.log_times.iter().filter(|time| (*start..start + 0.995).contains(*time) && *start > 1.0);
        assert!(times.count() <= 12, "from {start} s on");
        let lines = status.iter().filter(|(time, _)| (*start..start + 0.995).contains(time));
        assert!(lines.count() <= 10, "from {start} s on");
    }
    assert!(walking.len() > 35);
    for line in walking {
        assert!(line.len() <= 66 && line.contains(" deg, sensor ") && line.ends_with(" V"), "{line}");
    }
    // The numbers of a line are those of its frame.
    let place = boot.log.iter().rposition(|line| is_status(line)).expect("a line");
    let frame =
        boot.ticks.iter().rfind(|frame| f64::from(frame.tick) * 1e-3 <= boot.log_times[place]).expect("a frame");
    let [hip, ..] = frame.setpoints_deg().map(|angle| angle.round() as i32);
    assert!(boot.log[place].contains(&format!("hips {hip:>3} ")), "{} beside {frame:?}", boot.log[place]);
    for state in ["arming, cause none", "walking, cause none"] {
        assert!(boot.log.iter().any(|line| line == state), "{state}");
    }
}

/// Nobody reads for three seconds: what was in the rings then comes whole, and so does everything after the gap. The board notices nothing of it.
fn a_channel_that_is_not_read_drops_whole_frames_and_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let script = folder.path().join("script.toml");
    std::fs::write(&script, "[[event]]\nat_s = 2\nfor_ms = 3000\ninject = { rtt = \"stopped\" }\n").expect("written");
    let script = script.display().to_string();
    // `Board::run` fails at a damaged frame of either channel.
    let ran = Board::find().run(walks("7", &["--script", &script]));
    let boot = &ran.boots[0];
    let gaps: Vec<(u32, u32)> = boot
        .calls
        .windows(2)
        .map(|pair| (pair[0].0, pair[1].0))
        .filter(|(before, after)| after - before != 1)
        .collect();
    report!("{gaps:?}");
    let [(last, next)] = gaps[..] else { panic!("{gaps:?}") };
    // The ring holds more than 200 ms of records.
    assert!((2_200..3_000).contains(&last) && (4_900..5_100).contains(&next), "{gaps:?}");
    let texts: Vec<f64> = boot.log_times.iter().copied().filter(|time| (2.0..5.0).contains(time)).collect();
    assert!((5..30).contains(&texts.len()), "{texts:?}");
    let end = boot.ticks.last().expect("frames");
    assert_eq!((end.state, end.late, end.missed), (SupervisorState::Walking, 0, 0));
    assert_eq!(boot.costs.last().expect("a second").dropped, 0);
    assert!(!has_every_call(&ran));
}

/// `probe-rs run` sets the mode "block" and prints every channel as text: it finds nothing in channel 1, and the board waits for nobody.
fn a_program_that_shows_text_gets_lines_alone() {
    let ran = Board::find().run(walks("4", &["--rtt-mode", "2"]));
    let boot = &ran.boots[0];
    // The probe finds the control block a moment after the boot.
    assert!(boot.calls.len() < 50 && boot.ticks.len() < 5, "{} calls", boot.calls.len());
    let lines = boot.log.iter().filter(|line| line.starts_with("walking: hips ")).count();
    assert!(lines > 15, "{:?}", boot.log);
    assert_eq!(ran.end.judged.violations, 0);
}

fn footfall(arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(variable("FOOTFALL_BIN"));
    let output = command.args(arguments).stdin(Stdio::null()).output().expect("it runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// As with OpenOCD: one TCP connection, records out and requests in. No serial port is open.
fn set_and_record_go_through_the_probe() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("walk.csv").display().to_string();
    let options: Vec<OsString> = walks("600", &[]);
    let ran = Board::find().run_with_probe(options, |server, _| {
        let set = |words: &[&str]| footfall(&[&["set", "--rtt", &server][..], words].concat());
        let (code, text, errors) = footfall(&["watch", "--rtt", &server, "--secs", "1"]);
        assert_eq!(code, Some(0), "{errors}");
        assert!(text.lines().count() >= 10, "{text}");
        let (code, _, errors) = footfall(&["record", "--rtt", &server, "--secs", "2", "--out", &out]);
        assert!(code == Some(0) && errors.contains(", 0 lost"), "{errors}");
        let (code, text, errors) = set(&["speed", "1.2"]);
        assert!(code == Some(0) && text.contains("in effect"), "{text}{errors}");
        let (code, text, errors) = set(&["--show"]);
        assert!(code == Some(0) && text.contains("speed                 1.2  (changed)"), "{text}{errors}");
        let (code, _, errors) = set(&["follow", "off"]);
        assert!(code == Some(1) && errors.contains("follows nobody"), "{errors}");
        let (code, text, errors) = set(&["--stop"]);
        assert!(code == Some(0) && text.contains("stops"), "{text}{errors}");
        let (code, _, errors) = footfall(&["watch", "--rtt", &server, "--secs", "1", "--json"]);
        assert_eq!(code, Some(0), "{errors}");
    });
    ran.assert_sound();
    let boot = &ran.boots[0];
    let requests: Vec<String> =
        boot.calls.iter().filter_map(|(_, call)| call.request).map(|it| it.to_string()).collect();
    let actions: Vec<&str> =
        requests.iter().filter_map(|text| text.split_once(' ')).map(|(_, action)| action).collect();
    assert_eq!(actions, ["set speed 1.2", "set follow 0", "stop"]);
    assert_eq!(boot.ticks.last().map(|frame| frame.state), Some(SupervisorState::Disarmed));
    assert!(has_every_call(&ran));
}

fn keys_of_the_live_screen_go_through_the_probe() {
    let program = variable("FOOTFALL_BIN").into_string().expect("a name");
    let ran = Board::find().run_with_probe(walks("600", &[]), move |server, _| {
        let mut terminal = Terminal::run(&format!("{program} watch --rtt {server}"), 120, 40);
        let _ = terminal.sees_all(&[" walking ", "1/12 gait = "]);
        terminal.presses("\u{1b}[B");
        let _ = terminal.sees("2/12 speed = ");
        terminal.presses("\u{1b}[C");
        let _ = terminal.sees("set speed 1.05: in effect at tick ");
        terminal.presses("s");
        let _ = terminal.sees(" disarmed ");
        terminal.presses("q");
        let (code, text) = terminal.ends();
        assert_eq!(code, Some(0), "{text}");
    });
    ran.assert_sound();
}
