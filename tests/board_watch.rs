//! `footfall watch` with the flashed image: what it says of a run that does not end as it should, and of one with a calibrated sensor.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use serde_json::Value;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        a_board_that_is_held_in_reset_is_not_called_walking(Image),
        a_fault_excuses_its_own_end_alone(Image),
        a_wrong_script_is_wrong_input(Image),
        an_event_that_does_not_come_fails_the_run(Image),
        a_sensor_that_the_board_refuses_fails_the_run(Image),
        the_sensor_of_the_sample_rows_walks(Image),
        a_board_that_nobody_arms_is_called_dark(Image),
        who_holds_the_button_is_said(Image),
        a_contact_and_a_dip_between_two_lines_are_in_the_lines(Image),
        the_last_object_of_the_page_is_that_of_today(Image),
    ])
}

fn path(variable: &str) -> PathBuf {
    std::env::var_os(variable).unwrap_or_else(|| panic!("{variable}")).into()
}

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../samples").join(name)
}

/// The exit code of a run, its last object, and its messages.
fn watched(options: &[&str]) -> (Option<i32>, Value, String) {
    let mut watch = Command::new(path("FOOTFALL_BIN"));
    watch.arg("watch").arg("--elf").arg(path("FOOTFALL_ELF"));
    watch.arg("--virtual-board").arg(path("FOOTFALL_VIRTUAL_BOARD")).arg("--json").args(options);
    let output = watch.stdin(Stdio::null()).output().expect("the program starts");
    let text = String::from_utf8(output.stdout).expect("text");
    let last = text.lines().last().map_or(Value::Null, |line| serde_json::from_str(line).expect("an object"));
    (output.status.code(), last, String::from_utf8_lossy(&output.stderr).into_owned())
}

/// A run with a script.
fn scripted(script: &str, secs: &str) -> (Option<i32>, Value, String) {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), script).expect("written");
    watched(&["--secs", secs, "--", "--script", file.path().to_str().expect("text")])
}

fn a_board_that_is_held_in_reset_is_not_called_walking() {
    let (code, last, messages) = scripted("[[event]]\nat_s = 2.0\ninject = \"reset-button\"\n", "3");
    // The pressed button explains it.
    assert_eq!(code, Some(0), "{messages}");
    assert_eq!(last["state"], "unknown");
    let since = last["no_frame_since_s"].as_f64().expect("a time");
    assert!((1.98..=2.0).contains(&since), "{since}");
    report!("no frame since {since} s");
}

fn a_fault_excuses_its_own_end_alone() {
    let open = "inject = { volts = { pin = \"PA1\", volts = 0.0 } }";
    let (code, last, messages) = scripted(&format!("[[event]]\nat_s = 2.0\n{open}\n"), "3");
    assert_eq!((code, &last["cause"]), (Some(0), &"sensor_open".into()), "{messages}");
    // The sensor's wire comes off after the emergency stop was pressed: it explains nothing.
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), format!("[[event]]\nat_s = 2.5\n{open}\n")).expect("written");
    let script = file.path().to_str().expect("text");
    let (code, last, messages) =
        watched(&["--secs", "3", "--", "--script", script, "--emergency-stop", "0.05:0.04", "2"]);
    assert_eq!((code, &last["cause"]), (Some(1), &"break_input".into()), "{messages}");
    assert!(messages.contains("the motion ended: fault, cause break_input"), "{messages}");
    assert!(messages.contains("emergency stop: only as the options after `--` say"), "{messages}");
}

fn a_wrong_script_is_wrong_input() {
    // The order of a process' two outputs is not fixed: often enough to meet either.
    for _ in 0..5 {
        let (code, _, messages) = scripted("[[event]]\nat_s = 2.0\ninject = \"quake\"\n", "3");
        assert_eq!(code, Some(2), "{messages}");
        let end = messages.rsplit_once("the virtual board refused its input: ").expect("the end").1;
        assert!(end.contains("line 3") && end.contains("unknown variant `quake`"), "{messages}");
    }
}

fn an_event_that_does_not_come_fails_the_run() {
    let (code, _, messages) = scripted("[[event]]\nname = \"dip\"\nat_s = 4.0\ninject = { vdd = 2.4 }\n", "1");
    assert_eq!(code, Some(1), "{messages}");
    assert!(messages.contains("the run did not show the event `dip` (line 1): it was due at 4 s"), "{messages}");
}

fn a_sensor_that_the_board_refuses_fails_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("wide.toml");
    let text = std::fs::read_to_string(sample("sensor.toml")).expect("the sample");
    let (first, last) = text.rsplit_once("sensor_v = ").expect("a point");
    let (_, rest) = last.split_once(',').expect("its end");
    std::fs::write(&file, format!("{first}sensor_v = 2.6500,{rest}")).expect("written");
    let sensor = format!("left_knee={}", file.display());
    let (code, last, messages) = watched(&["--secs", "2", "--sensor", &sensor]);
    assert_eq!((code, &last["has_armed"]), (Some(1), &false.into()), "{messages}");
    assert!(messages.contains("the board refused to start: ") && messages.contains("reads code 4019"), "{messages}");
}

/// The lines of docs/entrainment.md.
fn the_sensor_of_the_sample_rows_walks() {
    let folder = tempfile::tempdir().expect("a folder");
    let [hip, follower] = ["hip.toml", "follower.toml"].map(|name| folder.path().join(name));
    let footfall = |arguments: &[&str], input: &Path, out: &Path| {
        let mut command = Command::new(path("FOOTFALL_BIN"));
        let output = command.arg(arguments[0]).arg(input).args(&arguments[1..]).arg("-o").arg(out).output();
        let output = output.expect("the program starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    footfall(&["calibrate", "--name", "hip 3"], &sample("rows.csv"), &hip);
    footfall(&["fit", "--follow", "left_hip"], &sample("walk.csv"), &follower);
    let (sensor, walk) = (format!("left_hip={}", hip.display()), sample("walk.csv"));
    let [follower, walk] = [&follower, &walk].map(|path| path.to_str().expect("text"));
    let (code, last, messages) =
        watched(&["--secs", "8", "--generator", follower, "--sensor", &sensor, "--trace", walk]);
    assert_eq!((code, &last["state"], &last["not_started"]), (Some(0), &"walking".into(), &Value::Null), "{messages}");
    assert!(last["pulse_us"].as_array().expect("four").iter().all(Value::is_array), "{last}");
    assert!(last["following"]["locked_at_s"].as_f64().is_some(), "{}", last["following"]);
}

/// Counts of docs/virtual-board.md. Hashes are those of one image, and pulses change with a motion: they are only compared in kind.
fn the_last_object_of_the_page_is_that_of_today() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/virtual-board.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let (_, object) = page.split_once("```text\n{\"type\": \"end\"").expect("the object");
    let object = format!("{{\"type\": \"end\"{}", object.split_once("```").expect("its end").0);
    let shown: serde_json::Map<String, Value> = serde_json::from_str(&object).expect("an object");
    let (code, last, messages) = watched(&["--secs", "10", "--disarm"]);
    assert_eq!(code, Some(0), "{messages}");
    for (key, value) in &shown {
        let now = &last[key];
        match key.as_str() {
            "t_s" => assert!((now.as_f64().expect("s") - value.as_f64().expect("s")).abs() < 1e-6),
            "setpoint_hash" | "host_replay_hash" => assert!(now.as_str().is_some_and(|hash| hash.len() == 16), "{now}"),
            "pulse_us" => {
                let (now, value) = (now.as_array().expect("four"), value.as_array().expect("four"));
                for (now, value) in now.iter().zip(value) {
                    let apart = |end: usize| (now[end].as_f64().expect("us") - value[end].as_f64().expect("us")).abs();
                    assert!(apart(0) < 20.0 && apart(1) < 20.0, "{now} {value}");
                }
            }
            _ => assert_eq!(now, value, "{key}"),
        }
    }
    assert!(shown.len() > 10, "{shown:?}");
}

/// The lines for people of a run.
fn said(options: &[&str]) -> String {
    let mut watch = Command::new(path("FOOTFALL_BIN"));
    watch.arg("watch").arg("--elf").arg(path("FOOTFALL_ELF"));
    watch.arg("--virtual-board").arg(path("FOOTFALL_VIRTUAL_BOARD")).args(options);
    let output = watch.stdin(Stdio::null()).output().expect("the program starts");
    String::from_utf8(output.stdout).expect("text") + &String::from_utf8_lossy(&output.stderr)
}

/// Never armed, refused because the emergency stop was not tested, and off by the stop before the first pulse: the summary says that no output was on, and
/// why; of a walk it says nothing of the kind.
fn a_board_that_nobody_arms_is_called_dark() {
    const DARK: &str = "outputs never on: ";
    for (options, why) in [
        (&["--secs", "1", "--press", "none"][..], "the board was never armed; no hold of the button counted"),
        (
            &["--secs", "1.5", "--", "--emergency-stop", "1.4"],
            "the last hold of the button was refused, cause stop_untested",
        ),
    ] {
        let text = said(options);
        assert!(text.contains(DARK) && text.contains(why), "{options:?}: {text}");
    }
    let text = said(&["--secs", "2"]);
    assert!(!text.contains(DARK), "{text}");
}

fn who_holds_the_button_is_said() {
    for (options, words) in [
        (&["--secs", "1"][..], "button: held from 0.1 to 0.6 s, and its release arms the board"),
        (&["--secs", "1", "--press", "none"], "button: not held; without a hold of it the board does not arm"),
        (&["--secs", "6", "--disarm"], "and its release arms the board, pressed at 4.3 s"),
        (&["--secs", "1", "--press", "none", "--", "--press", "0.3"], "button: only as the options after `--` say"),
    ] {
        let text = said(options);
        assert!(text.contains(words), "{options:?}: {text}");
    }
}

/// The sensor's wire is off for 25 ms, the supply low for 20 ms: over before the next line, which has both.
fn a_contact_and_a_dip_between_two_lines_are_in_the_lines() {
    let script = "[[event]]\nat_s = 1.51\ninject = { volts = { pin = \"PA1\", volts = 0.0 } }\nfor_ms = 25\n\
                  [[event]]\nat_s = 1.61\ninject = { supply = 2.6 }\nfor_ms = 20\n";
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), script).expect("written");
    let text = said(&["--json", "--secs", "3.5", "--", "--script", file.path().to_str().expect("text")]);
    let mut lines = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let last = lines.rfind(|line| line["type"] == "tick" && line["supply_dips"].is_u64()).expect("counts");
    let sensor = &last["sensors"][0];
    report!(
        "{} dips, {} changes, {} ms not good",
        last["supply_dips"],
        sensor["validity_changes"],
        sensor["not_good_ms"]
    );
    assert_eq!(last["supply_dips"], 1, "{last}");
    assert!(sensor["validity_changes"].as_u64().is_some_and(|changes| changes >= 4), "{last}");
    assert!(sensor["not_good_ms"].as_u64().is_some_and(|ms| (40..100).contains(&ms)), "{last}");
}
