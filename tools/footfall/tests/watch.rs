//! `footfall watch` as a program, on a board that plays lines: what it prints, what it writes, how it ends.

mod support;

use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use support::{Bench, SimulatedBoard, framed, framed_bytes, hex, records};
use wire::Record;

fn walked(secs: u32) -> SimulatedBoard {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(secs);
    simulated.end();
    simulated
}

fn run(command: &mut Command) -> Output {
    command.stdin(Stdio::null()).output().unwrap()
}

fn objects(output: &Output) -> Vec<Value> {
    let text = std::str::from_utf8(&output.stdout).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("no object: {line}"))).collect()
}

fn complaints(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn json_ends_with_the_whole_run() {
    let bench = Bench::plays(&walked(3).lines);
    let output = run(bench.watch().args(["--json", "--secs", "3"]));
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    let objects = objects(&output);
    let last = objects.last().unwrap();
    assert_eq!((&last["type"], &last["ticks"], &last["state"]), (&"end".into(), &3000.into(), &"walking".into()));
    for zero in ["late_ticks", "missed_ticks", "unmodelled", "edges_before_arming", "lost_lines", "different_lines"] {
        assert_eq!(last[zero], 0, "{zero}");
    }
    assert_eq!(last["pulse_us"][0], serde_json::json!([1300.5, 1800.0]));
    assert_eq!(last["pulse_us"][3], Value::Null);
    assert_eq!(last["setpoint_hash"], last["host_replay_hash"]);
    assert_eq!(last["setpoint_hash"].as_str().unwrap().len(), 16);
    assert_eq!((&last["host_replay"], &last["replayed_calls"]), (&"equal".into(), &3000.into()));

    let ticks: Vec<&Value> = objects.iter().filter(|object| object["type"] == "tick").collect();
    assert_eq!(ticks.len(), 30, "one every 100 ms");
    assert!((ticks[29]["tick_rate_hz"].as_f64().unwrap() - 1000.0).abs() < 1e-6);
    assert_eq!(ticks[29]["setpoint_deg"].as_array().unwrap().len(), 4);
    let states: Vec<&str> = ticks.iter().map(|tick| tick["state"].as_str().unwrap()).collect();
    assert_eq!((states[0], states[4], states[29]), ("disarmed", "arming", "walking"));
}

#[test]
fn without_a_terminal_there_is_a_line_every_100_ms_and_a_summary() {
    let bench = Bench::plays(&walked(2).lines);
    let output = run(bench.watch().args(["--secs", "2"]));
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.iter().filter(|line| line.contains(" sensor ")).count(), 20, "{text}");
    assert!(lines[19].contains("arming") && lines[19].contains("tick   2000  1000 Hz  late 0  missed 0"), "{text}");
    assert!(text.contains("ticks 2000, late 0, missed 0; unmodelled accesses 0"), "{text}");
    assert!(text.contains(": equal; 200 lines and 2000 calls replayed, 0 lines lost"), "{text}");
}

#[test]
fn the_board_gets_the_options_and_a_loop_of_volts() {
    let bench = Bench::plays(&walked(1).lines);
    let board = ["--secs", "7.5", "--disarm", "--press", "0.5,2", "--", "--hang", "control_step@3"];
    run(bench.watch().args(board));
    let arguments = bench.text("arguments");
    // Of the parameter sectors only that of the robot is filled without an option.
    assert!(
        arguments.contains("--loop --flash 0x0800c000=") && arguments.matches("--flash").count() == 1,
        "{arguments}"
    );
    assert!(
        arguments.contains(
            " --secs 7.5 --emergency-stop 0.05:0.04 --press 0.5:0.5 --press 2:0.5 --press 5.8:0.5 --hang control_step@3"
        ),
        "{arguments}"
    );
    let volts = bench.text("volts.csv");
    let rows: Vec<(f64, f64)> = volts
        .lines()
        .skip(1)
        .map(|row| row.split_once(',').unwrap())
        .map(|(t, v)| (t.parse().unwrap(), v.parse().unwrap()))
        .collect();
    assert!(volts.starts_with("time_s,PA1\n0,"));
    assert_eq!(rows[0].1, rows[rows.len() - 1].1, "the last row is where the first comes again");
    let two_strides = rows[rows.len() - 1].0;
    assert!((2.1..2.3).contains(&two_strides), "{two_strides}");
    assert!(rows.iter().all(|(_, volts)| (0.795..=2.58).contains(volts)));
}

#[test]
fn a_long_recording_is_played_as_it_is_and_one_without_strides_is_held() {
    let bench = Bench::plays(&walked(1).lines);
    let rows: String =
        (0..600).map(|n| format!("{},{}\n", 5.0 + f64::from(n) * 0.01, 10.0 + f64::from(n) * 0.05)).collect();
    std::fs::write(bench.path("ramp.csv"), format!("time_s,knee_deg\n{rows}")).unwrap();
    let with = |secs: &str| {
        let output = run(bench.watch().arg("--trace").arg(bench.path("ramp.csv")).args(["--secs", secs]));
        (complaints(&output), bench.text("arguments"), bench.text("volts.csv"))
    };
    let (notes, arguments, volts) = with("5");
    assert!(!notes.contains("cannot be repeated") && !arguments.contains("--loop"), "{notes}{arguments}");
    assert!(volts.starts_with("time_s,PA1\n0,") && volts.lines().count() == 601);
    let (notes, arguments, _) = with("20");
    assert!(notes.contains("cannot be repeated") && notes.contains("held") && !arguments.contains("--loop"), "{notes}");
}

#[test]
fn a_capture_is_finished_and_names_its_source() {
    let bench = Bench::plays(&walked(3).lines);
    let output = run(bench.watch().args(["--json", "--secs", "3", "--record"]).arg(bench.path("out.csv")));
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    let text = bench.text("out.csv");
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 3001);
    assert_eq!((rows[1][0], rows[3000][0], rows[0][8], rows[3000][8]), ("0.001", "3", "state", "walking"));
    let times: Vec<f64> = rows[1..].iter().map(|row| row[0].parse().unwrap()).collect();
    assert!(times.is_sorted_by(|a, b| a < b));
    let about: Value = serde_json::from_str(&bench.text("out.csv.json")).unwrap();
    assert_eq!((&about["finished"], &about["rows"]), (&true.into(), &3000.into()));
    assert_eq!(about["about"]["elf_sha256"], footfall::board::image::sha256(&support::elf()).as_str());
    assert_eq!(about["result"], objects(&output).last().unwrap().clone());
}

/// Sends a signal once the first line has come, and gives the end of the program.
fn interrupted(bench: &Bench, signal: &str) -> (Option<i32>, Vec<String>) {
    let mut child = bench
        .watch()
        .args(["--json", "--secs", "60", "--record"])
        .arg(bench.path("out.csv"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut seen = vec![lines.next().unwrap().unwrap()];
    // The shell has `kill`; a program of that name need not be there.
    let sent = Command::new("sh").args(["-c", "kill \"$0\" \"$1\"", signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    seen.extend(lines.map(Result::unwrap));
    (child.wait().unwrap().code(), seen)
}

#[test]
fn ctrl_c_ends_cleanly_and_leaves_a_finished_recording() {
    for signal in ["-INT", "-TERM"] {
        let mut simulated = SimulatedBoard::new();
        simulated.walk(2);
        simulated.end_as("killed", serde_json::json!({}));
        let bench = Bench::waits(&simulated.lines);
        let started = Instant::now();
        let (code, lines) = interrupted(&bench, signal);
        assert_eq!(code, Some(0), "{signal}");
        assert!(started.elapsed() < Duration::from_secs(30));
        let last: Value = serde_json::from_str(lines.last().unwrap()).unwrap();
        assert_eq!((&last["type"], &last["reason"]), (&"end".into(), &"killed".into()));
        let about: Value = serde_json::from_str(&bench.text("out.csv.json")).unwrap();
        assert_eq!(about["finished"], true);
        assert!(bench.text("out.csv").ends_with('\n'));
    }
}

#[test]
fn a_reader_that_leaves_ends_the_run_and_the_recording_is_finished() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(5);
    simulated.end();
    let bench = Bench::plays(&simulated.lines);
    let mut child = bench
        .watch()
        .args(["--json", "--record"])
        .arg(bench.path("out.csv"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut out = child.stdout.take().unwrap();
    out.read_exact(&mut [0; 10]).unwrap();
    drop(out);
    let output = child.wait_with_output().unwrap();
    assert!(!complaints(&output).contains("panicked"), "{}", complaints(&output));
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    assert!(bench.text("out.csv.json").contains("\"finished\": true"));
}

/// One bit of one setpoint is other than the host's.
#[test]
fn a_single_bit_that_differs_is_found_and_the_run_is_not_sound() {
    let mut simulated = walked(3);
    let (index, last) = records(&simulated.lines).pop().unwrap();
    let Record::Frame(mut tick) = last else { panic!("{last:?}") };
    tick.setpoints_rad[2] = f32::from_bits(tick.setpoints_rad[2].to_bits() ^ 1);
    let mut changed: Value = serde_json::from_str(&simulated.lines[index]).unwrap();
    changed["hex"] = hex(&framed(&Record::Frame(tick))).into();
    simulated.lines[index] = changed.to_string();
    let output = run(Bench::plays(&simulated.lines).watch().args(["--json", "--secs", "3"]));
    assert_eq!(output.status.code(), Some(1));
    assert!(complaints(&output).contains("board and host differ: tick 3000: set is ["), "{}", complaints(&output));
    let objects = objects(&output);
    let last = objects.last().unwrap();
    assert_eq!((&last["host_replay"], &last["different_lines"]), (&"different".into(), &1.into()));
}

#[test]
fn frames_without_inputs_are_not_called_equal() {
    let mut simulated = walked(3);
    let inputs = |record: &Record| matches!(record, Record::Inputs(inputs) if inputs.first_tick == 1001);
    let (index, _) = records(&simulated.lines).into_iter().find(|(_, record)| inputs(record)).unwrap();
    simulated.lines.remove(index);
    let output = run(Bench::plays(&simulated.lines).watch().args(["--json", "--secs", "3"]));
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    let objects = objects(&output);
    let last = objects.last().unwrap();
    assert_eq!(last["host_replay_hash"], Value::Null);
    assert_eq!(last["host_replay"], "not known: inputs of ticks 1001 to 1010 were lost");
    assert_eq!((&last["compared_lines"], &last["ticks"]), (&100.into(), &3000.into()));
}

#[test]
fn lost_lines_are_counted_and_do_not_hinder_the_comparison() {
    let mut simulated = walked(3);
    let tick = |record: &Record| matches!(record, Record::Frame(frame) if frame.tick == 1010);
    let (index, _) = records(&simulated.lines).into_iter().find(|(_, record)| tick(record)).unwrap();
    simulated.lines.remove(index);
    let output = run(Bench::plays(&simulated.lines).watch().args(["--json", "--secs", "3"]));
    let objects = objects(&output);
    let last = objects.last().unwrap();
    assert_eq!(
        (&last["lost_lines"], &last["host_replay"], &last["compared_lines"]),
        (&1.into(), &"equal".into(), &299.into())
    );
}

#[test]
fn after_a_reset_the_counters_restart_and_time_goes_on() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(1);
    simulated.tick(7, false);
    // The reset comes in the middle of a frame.
    let (_, last) = records(&simulated.lines).pop().unwrap();
    let cut = framed(&last);
    let half = hex(&cut[..cut.len() / 2]);
    simulated.line(serde_json::json!({ "type": "rtt", "t_s": simulated.t_s(), "channel": 1, "hex": half }));
    simulated.reset();
    simulated.walk(1);
    let resets = serde_json::json!([{ "t_s": 1.012, "cause": "iwdg" }]);
    let injections = serde_json::json!([{ "kind": "hang", "injected_s": 1.0 }]);
    simulated.end_as("time", serde_json::json!({ "resets": resets, "injections": injections }));
    let bench = Bench::plays(&simulated.lines);
    let output = run(bench.watch().args(["--json", "--secs", "3", "--record"]).arg(bench.path("out.csv")));
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    let objects = objects(&output);
    let last = objects.last().unwrap();
    assert_eq!((&last["boots"], &last["ticks"], &last["host_replay"]), (&2.into(), &1000.into(), &"equal".into()));
    assert_eq!(last["replayed_calls"], 2000);
    let text = bench.text("out.csv");
    let times: Vec<f64> = text.lines().skip(1).map(|row| row.split(',').next().unwrap().parse().unwrap()).collect();
    assert!(times.is_sorted_by(|a, b| a < b) && times.len() == 2000, "{}", times.len());
    // Seven ticks had not been sent when the reset came.
    assert_eq!((times[999], times[1000]), (1.0, 1.013));
}

#[test]
fn a_fault_of_a_run_is_in_the_exit_code_and_the_message() {
    for (key, value, words) in [
        ("unmodelled", serde_json::json!(3), "3 accesses that the models do not support"),
        ("reason", "lockup".into(), "the board ended early: lockup"),
        ("unexpected_faults", 1.into(), "1 faults that were not injected"),
        ("edges_before_arming", 2.into(), "2 edges of servo pins while disarmed"),
        ("edges_after_disarming", 1.into(), "1 edges of servo pins while disarmed"),
        (
            "judged",
            serde_json::json!({ "pulses": 9, "cut": 0, "trimmed": [], "violations": 1, "first": ["PE9 at 0.1 s: 90 us"] }),
            "1 pulses that no servo may get: PE9 at 0.1 s: 90 us",
        ),
    ] {
        let mut simulated = SimulatedBoard::new();
        simulated.walk(1);
        simulated.end_as("time", serde_json::json!({ key: value }));
        let output = run(Bench::plays(&simulated.lines).watch().args(["--json", "--secs", "1"]));
        assert_eq!(output.status.code(), Some(1), "{key}");
        assert!(complaints(&output).contains(words), "{key}: {}", complaints(&output));
    }
}

#[test]
fn a_board_that_breaks_off_is_no_good_run_but_the_recording_is_finished() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(1);
    let bench = Bench::plays(&simulated.lines);
    let output = run(bench.watch().args(["--secs", "1", "--record"]).arg(bench.path("out.csv")));
    assert_eq!(output.status.code(), Some(1));
    assert!(complaints(&output).contains("ended without its last line"), "{}", complaints(&output));
    assert!(bench.text("out.csv.json").contains("\"finished\": true"));
    assert_eq!(bench.text("out.csv").lines().count(), 1001);
}

#[test]
fn another_image_or_another_version_is_refused() {
    let mut other = walked(1);
    other.lines[0] = r#"{"type":"start","elf_sha256":"00","hclk_hz":1}"#.into();
    let mut garbage = SimulatedBoard::new();
    garbage.lines.truncate(2);
    garbage.line(serde_json::json!({ "type": "rtt", "t_s": 0.1, "channel": 0, "hex": "0102030405060700" }));
    let mut version = SimulatedBoard::new();
    // The version comes first: whatever follows is of another image.
    let bytes = hex(&framed_bytes(&[99, 1, 2]));
    version.line(serde_json::json!({ "type": "rtt", "t_s": 0.1, "channel": 1, "hex": bytes }));
    let strange = vec!["thread 'main' panicked".to_owned()];
    for (lines, words) in [
        (other.lines, "do not rebuild it during the run"),
        (garbage.lines, "does not begin with a frame of this image"),
        (
            version.lines,
            "the board sends records of version 99, this program reads version 9: flash the image of this checkout",
        ),
        (strange, "the virtual board wrote `thread 'main' panicked`"),
    ] {
        let output = run(Bench::plays(&lines).watch().args(["--secs", "1"]));
        assert_eq!(output.status.code(), Some(1));
        assert!(complaints(&output).contains(words), "{words}: {}", complaints(&output));
    }
}

#[test]
fn a_broken_frame_on_the_way_is_counted_and_the_next_one_is_read() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(1);
    simulated
        .line(serde_json::json!({ "type": "rtt", "t_s": simulated.t_s(), "channel": 1, "hex": "0102030405060700" }));
    simulated.tick(1000, false);
    simulated.end();
    let output = run(Bench::plays(&simulated.lines).watch().args(["--json", "--secs", "2"]));
    let objects = objects(&output);
    let last = objects.last().unwrap();
    assert_eq!(
        (&last["malformed_frames"], &last["ticks"], &last["host_replay"]),
        (&1.into(), &2000.into(), &"equal".into())
    );
    assert_eq!(output.status.code(), Some(1));
}
