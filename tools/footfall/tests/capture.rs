//! Captures: what the board measured is what the file holds, sample by sample; what was lost is counted; and `footfall fit` and
//! `gait_trace::format::open` take the file as it is.

mod support;

use gait_trace::RawJoints;
use gait_trace::ReadOptions;
use gait_trace::format::open;
use hgod_adc::{OVERSAMPLING, trimmed_mean};
use joint_units::AdcCode;
use joint_units::Joint;
use serde_json::Value;
use std::io::Write;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output, Stdio};
use support::{Bench, SimulatedBoard, frame, records};
use test_suite::tests;
use wire::Record;

fn main() -> ExitCode {
    test_suite::run(tests![
        every_tick_is_there_with_the_code_that_was_measured_and_both_formats_hold_the_same(),
        watch_records_mcap_too_and_other_names_are_refused(),
        angles_are_the_boards_own(),
        samples_missed_by_a_stalled_reader_are_counted(),
        samples_before_the_capture_are_not_lost_ones(),
        raw_bytes_of_a_real_board_make_the_same_capture(),
        endless_noise_ends_the_command(),
        a_late_start_records_codes_without_the_boot_record(),
        a_reset_restarts_the_ticks_and_time_goes_on(),
        bytes_that_are_no_log_are_refused_and_missing_sources_too(),
        a_killed_recorder_leaves_a_file_that_can_be_read(),
        half_a_row_at_the_end_is_left_out_and_one_in_the_middle_refused(),
        fit_of_one_joint_names_the_missing_ones(),
        a_capture_is_replayed_and_every_change_in_it_is_named(),
        what_cannot_be_replayed_is_said(),
        the_virtual_boards_conversions_are_the_codes_of_the_capture(Image),
        a_capture_of_four_sensors_is_fitted_as_it_is(Image),
    ])
}

fn walked(secs: u32) -> SimulatedBoard {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(secs);
    simulated.end();
    simulated
}

/// The code that [`SimulatedBoard::tick`] measures in its n-th millisecond, counted from 0.
fn code(ms: u32) -> u16 {
    (2200.0 + 500.0 * (f64::from(ms) * 0.0057).sin()) as u16
}

fn footfall(arguments: &[&str], paths: &[&Path]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.args(arguments).args(paths).stdin(Stdio::null()).output().unwrap()
}

fn complaints(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// `footfall record` of the board that plays lines.
fn record(bench: &Bench, out: &str, more: &[&str]) -> (PathBuf, Output) {
    let file = bench.path(out);
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.arg("record").arg("--elf").arg(bench.path("fw.elf")).arg("--virtual-board").arg(bench.path("board"));
    let output = command.arg("--out").arg(&file).args(more).stdin(Stdio::null()).output().unwrap();
    (file, output)
}

/// The bytes of RTT channel 1 that a board's lines carry.
fn log_bytes(lines: &[String]) -> Vec<u8> {
    let objects = lines.iter().map(|line| serde_json::from_str::<Value>(line).unwrap());
    objects
        .filter(|object| object["type"] == "rtt" && object["channel"] == 1)
        .flat_map(|object| {
            let hex = object["hex"].as_str().unwrap().to_owned();
            (0..hex.len()).step_by(2).map(move |i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect::<Vec<_>>()
        })
        .collect()
}

/// `footfall record` of raw bytes in a file.
fn record_rtt(bench: &Bench, bytes: &[u8], out: &str, more: &[&str]) -> (PathBuf, Output) {
    let (raw, file) = (bench.path("log.rtt"), bench.path(out));
    std::fs::write(&raw, bytes).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.arg("record").arg("--elf").arg(bench.path("fw.elf")).arg("--rtt").arg(&raw).arg("--out").arg(&file);
    let output = command.args(more).stdin(Stdio::null()).output().unwrap();
    (file, output)
}

fn open(file: &Path) -> RawJoints {
    open::read(file, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn about(file: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(footfall::file::capture::beside(file)).unwrap()).unwrap()
}

/// A column of a capture, as text.
fn column(file: &Path, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut rows = text.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let index = header.iter().position(|heading| *heading == name).unwrap_or_else(|| panic!("no {name}: {header:?}"));
    rows.map(|row| {
        assert_eq!(row.len(), header.len());
        row[index].to_owned()
    })
    .collect()
}

fn numbers(file: &Path, name: &str) -> Vec<f64> {
    column(file, name).iter().map(|text| text.parse().unwrap_or(f64::NAN)).collect()
}

fn every_tick_is_there_with_the_code_that_was_measured_and_both_formats_hold_the_same() {
    let bench = Bench::plays(&walked(10).lines);
    let (csv, output) = record(&bench, "walk.csv", &["--secs", "10"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    assert!(complaints(&output).contains("10000 samples, 0 lost, 0 periods missed"), "{}", complaints(&output));
    let codes: Vec<u16> = column(&csv, "left_knee_code").iter().map(|text| text.parse().unwrap()).collect();
    assert_eq!(codes, (0..10_000).map(code).collect::<Vec<_>>());
    assert!(numbers(&csv, "time_s").iter().enumerate().all(|(n, t)| *t == (n + 1) as f64 / 1000.0));
    assert!(column(&csv, "known").iter().all(|known| known == "replay"));
    let said = about(&csv);
    assert_eq!((&said["finished"], &said["rows"]), (&true.into(), &10_000.into()));
    let counts = &said["counts"];
    assert_eq!((&counts["lost_samples"], &counts["confirmed_ticks"]), (&0.into(), &1000.into()));
    assert_eq!((&counts["different_ticks"], &counts["malformed_frames"]), (&0.into(), &0.into()));
    assert_eq!(said["about"]["elf_sha256"], footfall::board::image::sha256(&support::elf()).as_str());
    assert_eq!(said["about"]["sensors"][0]["joint"], "left_knee");
    assert!(said["about"]["sensors"][0]["points_v_deg"].as_array().unwrap().len() > 2);
    assert_eq!((&said["boots"][0]["reset"], &said["boots"][0]["vrefint_cal"]), (&"power_on".into(), &1502.into()));

    let (mcap, output) = record(&bench, "walk.mcap", &["--secs", "10"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    let (one, two) = (open(&csv), open(&mcap));
    assert_eq!(one.time_s, two.time_s);
    let knee = |raw: &RawJoints| raw.joints[Joint::LeftKnee as usize].as_ref().unwrap().angle_deg.clone();
    assert!(knee(&one).iter().zip(knee(&two)).all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())));
    assert!(knee(&one).iter().filter(|angle| angle.is_nan()).count() < 10);
    assert_eq!((one.joints.iter().flatten().count(), two.joints.iter().flatten().count()), (1, 1));
    assert_eq!(two.notes, Vec::<String>::new());
}

fn watch_records_mcap_too_and_other_names_are_refused() {
    let bench = Bench::plays(&walked(2).lines);
    let file = bench.path("out.mcap");
    let output = bench.watch().args(["--secs", "2", "--record"]).arg(&file).stdin(Stdio::null()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    assert_eq!(open(&file).time_s.len(), 2000);
    let (file, output) = record(&bench, "out.txt", &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaints(&output).contains("out.txt: allowed is a name that ends in .csv or .mcap"));
    assert!(!file.exists());
}

/// The joint's angle equals that of the loop, bit for bit, where the board sent a frame of the tick.
fn angles_are_the_boards_own() {
    let simulated = walked(3);
    let bench = Bench::plays(&simulated.lines);
    let (csv, _) = record(&bench, "walk.csv", &["--secs", "3"]);
    let (angles, hips) = (column(&csv, "left_knee_deg"), column(&csv, "set_right_hip_deg"));
    let mut compared = 0;
    for (_, record) in records(&simulated.lines) {
        let Record::Frame(tick) = record else { continue };
        let row = tick.tick as usize - 1;
        assert_eq!(angles[row].parse::<f32>().unwrap().to_bits(), tick.sensors[0].unwrap().angle_deg().to_bits());
        assert_eq!(hips[row].parse::<f32>().unwrap().to_bits(), tick.setpoints_deg()[1].to_bits());
        compared += 1;
    }
    assert_eq!(compared, 300);
}

/// A reader that stalls makes the board drop whole frames: they are missing, counted, and nothing is put in their place.
fn samples_missed_by_a_stalled_reader_are_counted() {
    let mut simulated = walked(4);
    // 250 ms of the log, lines of both kinds.
    let of_time = |line: &String| {
        let object: Value = serde_json::from_str(line).unwrap();
        object["type"] == "rtt" && (2.0005..2.2505).contains(&object["t_s"].as_f64().unwrap())
    };
    let before = simulated.lines.len();
    simulated.lines.retain(|line| !of_time(line));
    assert_eq!(before - simulated.lines.len(), 50);
    let bench = Bench::plays(&simulated.lines);
    for out in ["walk.csv", "walk.mcap"] {
        let (file, output) = record(&bench, out, &["--secs", "4"]);
        assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
        assert!(complaints(&output).contains("3750 samples, 250 lost"), "{}", complaints(&output));
        let said = about(&file);
        assert_eq!(said["counts"]["lost_samples"], 250);
        assert_eq!(said["counts"]["gaps"], serde_json::json!([{ "boot": 1, "after_tick": 2000, "next_tick": 2251 }]));
        let raw = open(&file);
        assert_eq!(raw.time_s.len(), 3750);
        assert_eq!((raw.time_s[1999], raw.time_s[2000]), (2.0, 2.251));
    }
    let csv = bench.path("walk.csv");
    let codes: Vec<u16> = column(&csv, "left_knee_code").iter().map(|text| text.parse().unwrap()).collect();
    assert_eq!(codes, (0..2000).chain(2250..4000).map(code).collect::<Vec<_>>());
    let lost = numbers(&csv, "lost");
    assert_eq!((lost[1999], lost[2000], lost[3749]), (0.0, 250.0, 250.0));
    // Behind the gap the loop's outputs are known from the board's own lines alone, every tenth tick.
    let known = column(&csv, "known");
    assert!(known[..2000].iter().all(|known| known == "replay"));
    let lines = known[2000..].iter().filter(|known| *known == "line").count();
    assert_eq!((lines, known[2000..].iter().filter(|known| known.is_empty()).count()), (175, 1575));
    // The angle is known all the same, and soon the board's own again: a host that lost nothing measures the same.
    let whole = Bench::plays(&walked(4).lines);
    let (reference, _) = record(&whole, "walk.csv", &["--secs", "4"]);
    let (angles, all) = (numbers(&csv, "left_knee_deg"), numbers(&reference, "left_knee_deg"));
    let off: Vec<f64> = angles[2000..].iter().zip(&all[2250..]).map(|(a, b)| (a - b).abs()).collect();
    assert!(off[100..].iter().all(|off| *off < 0.05), "{:?}", &off[..110]);
}

/// A board that nobody read: its buffer has the first samples, and the capture begins later.
fn samples_before_the_capture_are_not_lost_ones() {
    let mut simulated = walked(4);
    simulated.lines.retain(|line| {
        let object: Value = serde_json::from_str(line).unwrap();
        object["type"] != "rtt" || !(0.2405..2.2505).contains(&object["t_s"].as_f64().unwrap())
    });
    let bench = Bench::plays(&simulated.lines);
    let (file, output) = record(&bench, "walk.csv", &["--secs", "4"]);
    let said = complaints(&output);
    assert!(said.contains("1990 samples, 0 lost") && said.contains("from the board's buffer, 2.0 s before"), "{said}");
    let counts = &about(&file)["counts"];
    assert_eq!((&counts["lost_samples"], &counts["periods_before"]), (&0.into(), &2010.into()));
    assert_eq!(numbers(&file, "lost"), [0.0; 1990]);
}

fn raw_bytes_of_a_real_board_make_the_same_capture() {
    let simulated = walked(3);
    let bench = Bench::plays(&simulated.lines);
    let (of_board, _) = record(&bench, "board.csv", &["--secs", "3"]);
    let bytes = log_bytes(&simulated.lines);
    let (of_rtt, output) = record_rtt(&bench, &bytes, "rtt.csv", &["--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    assert_eq!(std::fs::read_to_string(&of_board).unwrap(), std::fs::read_to_string(&of_rtt).unwrap());
    let end: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&end["samples"], &end["confirmed_ticks"], &end["no_replay"]),
        (&3000.into(), &300.into(), &Value::Null)
    );

    // From a server, cut into pieces that are no frames.
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", server.local_addr().unwrap());
    let serving = std::thread::spawn(move || {
        let (mut peer, _) = server.accept().unwrap();
        bytes.chunks(37).for_each(|piece| peer.write_all(piece).unwrap());
    });
    let (elf, out) = (bench.path("fw.elf"), bench.path("tcp.mcap"));
    let output = footfall(&["record", "--rtt", &address, "--elf"], &[&elf, Path::new("--out"), &out]);
    serving.join().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    assert_eq!(open(&out).time_s, open(&of_rtt).time_s);
}

/// Whoever plugs a server of something else in gets an end, and `--secs` ends what sends nothing of use.
fn endless_noise_ends_the_command() {
    let bench = Bench::plays(&["{}".into()]);
    for noise in [&[0xFF][..], &[0], &[5, 9, 9, 0], b"a line of text\n"] {
        for more in [&[][..], &["--secs", "1"]] {
            let server = TcpListener::bind("127.0.0.1:0").unwrap();
            let address = format!("tcp:{}", server.local_addr().unwrap());
            let noise = noise.repeat(1000);
            let serving = std::thread::spawn(move || {
                let (mut peer, _) = server.accept().unwrap();
                while peer.write_all(&noise).is_ok() {}
            });
            let out = bench.path("noise.csv");
            let began = std::time::Instant::now();
            let output =
                footfall(&[&["record", "--force", "--rtt", &address][..], more, &["--out"]].concat(), &[out.as_path()]);
            assert_eq!(output.status.code(), Some(1));
            assert!(complaints(&output).contains("these are not the records of a board"), "{}", complaints(&output));
            assert!(began.elapsed().as_secs() < 20);
            serving.join().unwrap();
        }
    }
    // A byte now and then: the seconds cannot come any more.
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", server.local_addr().unwrap());
    let serving = std::thread::spawn(move || {
        let (mut peer, _) = server.accept().unwrap();
        while peer.write_all(&[7]).is_ok() {
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
    });
    let out = bench.path("slow.csv");
    let output = footfall(&["record", "--rtt", &address, "--secs", "1", "--out"], &[out.as_path()]);
    assert!(complaints(&output).contains("silent; check that the board runs"), "{}", complaints(&output));
    serving.join().unwrap();
}

/// Somebody attaches to a board that runs: its factory values are not known, so there are codes, and the angles of its lines.
fn a_late_start_records_codes_without_the_boot_record() {
    let bytes = log_bytes(&walked(3).lines);
    let bench = Bench::plays(&["{}".into()]);
    let (csv, output) = record_rtt(&bench, &bytes[bytes.len() / 2..], "late.csv", &[]);
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    assert!(complaints(&output).contains("the capture has no boot record of the board"), "{}", complaints(&output));
    let codes = numbers(&csv, "left_knee_code");
    let ticks = numbers(&csv, "tick");
    assert!((1400..1600).contains(&codes.len()), "{}", codes.len());
    assert!(codes.iter().zip(&ticks).all(|(found, tick)| *found == f64::from(code(*tick as u32 - 1))));
    assert!(column(&csv, "left_knee_volts").iter().all(String::is_empty));
    assert_eq!(about(&csv)["boots"][0]["boot_record"], false);
    assert_eq!(about(&csv)["counts"]["lost_samples"], 0);
}

fn a_reset_restarts_the_ticks_and_time_goes_on() {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(1);
    simulated.reset();
    simulated.walk(1);
    let injections = serde_json::json!([{ "kind": "hang", "injected_s": 1.0 }]);
    let resets = serde_json::json!([{ "t_s": 1.005, "cause": "iwdg" }]);
    simulated.end_as("time", serde_json::json!({ "resets": resets, "injections": injections }));
    let bench = Bench::plays(&simulated.lines);
    let (csv, output) = record(&bench, "walk.csv", &["--secs", "2"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    let times = numbers(&csv, "time_s");
    assert!(times.is_sorted_by(|a, b| a < b) && times.len() == 2000);
    assert_eq!((times[999], times[1000]), (1.0, 1.006));
    let (boots, ticks) = (numbers(&csv, "boot"), numbers(&csv, "tick"));
    assert_eq!((boots[999], boots[1000], ticks[1000]), (1.0, 2.0, 1.0));
    assert_eq!(about(&csv)["boots"][1]["reset"], "iwdg");
    assert_eq!(about(&csv)["counts"]["lost_samples"], 0);
}

fn bytes_that_are_no_log_are_refused_and_missing_sources_too() {
    let bench = Bench::plays(&["{}".into()]);
    let noise: Vec<u8> = (0..20_000_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let (_, output) = record_rtt(&bench, &noise, "noise.csv", &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaints(&output).contains("these are not the records of a board"), "{}", complaints(&output));
    // The lines for people, from the other channel.
    let (_, output) = record_rtt(&bench, &frame("ready").repeat(100), "text.csv", &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaints(&output).contains("channel 0 is its log for people"), "{}", complaints(&output));
    let (_, output) = record_rtt(&bench, &frame("ready"), "silent.mcap", &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaints(&output).contains("no sample came"), "{}", complaints(&output));
    let elf = bench.path("fw.elf");
    let refused = |source: &str| footfall(&["record", "--out", "x.csv", "--rtt", source, "--elf"], &[&elf]);
    for (source, words) in [("/no/such/file", "/no/such/file: cannot be opened"), ("tcp:nowhere", "tcp:HOST:PORT")] {
        let output = refused(source);
        assert_eq!(output.status.code(), Some(2));
        assert!(complaints(&output).contains(words), "{}", complaints(&output));
    }
}

/// The recorder is killed: what has been written is whole.
fn a_killed_recorder_leaves_a_file_that_can_be_read() {
    let mut simulated = walked(3);
    simulated.lines.truncate(simulated.lines.len() - 1);
    simulated.end_as("killed", serde_json::json!({}));
    for out in ["walk.csv", "walk.mcap"] {
        let bench = Bench::waits(&simulated.lines);
        let file = bench.path(out);
        let mut command = bench.watch();
        command.args(["--json", "--secs", "60", "--record"]).arg(&file);
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let began = std::time::Instant::now();
        // The board waits after two whole chunks. The program is killed then, and not in the middle of writing one.
        let length = || std::fs::metadata(&file).map_or(0, |file| file.len());
        let mut before = 0;
        while length() < 200_000 || length() != before {
            before = length();
            assert!(began.elapsed().as_secs() < 30 && child.try_wait().unwrap().is_none());
            std::thread::sleep(std::time::Duration::from_millis(500));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let raw = open(&file);
        assert!(raw.time_s.len() >= 1000, "{out}: {}", raw.time_s.len());
        assert_eq!(raw.notes.iter().any(|note| note.contains("The file has no end")), out == "walk.mcap");
        assert_eq!(about(&file)["finished"], false);
    }
}

/// `footfall replay --json` of a capture: the exit code, the object, and what it says.
fn replayed(file: &Path) -> (Option<i32>, Value, String) {
    let output = footfall(&["replay", "--json"], &[file]);
    let object = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output.status.code(), object, complaints(&output))
}

fn a_capture_is_replayed_and_every_change_in_it_is_named() {
    let bench = Bench::plays(&walked(3).lines);
    for out in ["walk.csv", "walk.mcap"] {
        let (file, output) = record(&bench, out, &["--secs", "3"]);
        assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
        let (code, object, said) = replayed(&file);
        assert_eq!((code, said.as_str()), (Some(0), ""), "{object}");
        assert_eq!((&object["ticks"], &object["compared"]), (&3000.into(), &3000.into()), "{object}");
        assert_eq!((&object["different"], &object["not_replayed"]), (&0.into(), &0.into()), "{object}");
    }
    // One value of one row, near the end, so that nothing after it hides the change.
    let text = std::fs::read_to_string(bench.path("walk.csv")).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let changed = |column: &str, change: &dyn Fn(&str) -> String| {
        let index = header.iter().position(|name| *name == column).unwrap();
        let rows = text.lines().enumerate().map(|(row, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if row == 2900 {
                cells[index] = change(&cells[index]);
            }
            cells.join(",")
        });
        let file = bench.path("changed.csv");
        std::fs::write(&file, rows.collect::<Vec<_>>().join("\n") + "\n").unwrap();
        std::fs::copy(bench.path("walk.csv.json"), bench.path("changed.csv.json")).unwrap();
        replayed(&file)
    };
    let next_bit = |text: &str| f32::from_bits(text.parse::<f32>().unwrap().to_bits() ^ 1).to_string();
    let plus_one = |text: &str| (text.parse::<u32>().unwrap() + 1).to_string();
    for (column, field, change) in [
        ("set_right_knee_deg", "set", &next_bit as &dyn Fn(&str) -> String),
        ("left_hip_us", "pulse", &plus_one),
        ("state", "state", &|_| "fault".into()),
        ("seq", "seq", &plus_one),
        ("limited", "limited", &|_| "1".into()),
    ] {
        let (code, object, said) = changed(column, change);
        assert_eq!((code, &object["different"]), (Some(1), &1.into()), "{column}: {object} {said}");
        let found = &object["differences"][0];
        assert_eq!((&found["tick"], &found["field"]), (&2900.into(), &field.into()), "{object}");
        assert!(said.contains(&format!("boot 1, tick 2900: {field} is ")), "{said}");
    }
    // Another input is another run: a fault of the board at that tick stops it.
    let (code, object, _) = changed("flags", &|_| "252".into());
    assert!(code == Some(1) && object["different"].as_u64() > Some(50), "{object}");
    // What is no number is named with its line.
    let (code, _, said) = changed("left_knee_code", &|_| "2x".into());
    assert!(code == Some(2) && said.contains("changed.csv:2901: `left_knee_code` is `2x`"), "{said}");
}

fn what_cannot_be_replayed_is_said() {
    let mut simulated = walked(4);
    let of_time = |line: &String| {
        let object: Value = serde_json::from_str(line).unwrap();
        object["type"] == "rtt" && (2.0005..2.2505).contains(&object["t_s"].as_f64().unwrap())
    };
    simulated.lines.retain(|line| !of_time(line));
    let bench = Bench::plays(&simulated.lines);
    for out in ["walk.csv", "walk.mcap"] {
        let (file, _) = record(&bench, out, &["--secs", "4"]);
        let (code, object, said) = replayed(&file);
        assert_eq!((code, &object["compared"], &object["not_replayed"]), (Some(0), &2000.into(), &1750.into()));
        assert!(
            said.contains("boot 1: not replayed from there on: the inputs of ticks 2001 to 2250 were lost"),
            "{said}"
        );
    }
    // A recorder that is stopped leaves what a replay needs.
    let mut killed = walked(3);
    killed.lines.truncate(killed.lines.len() - 1);
    let bench = Bench::waits(&killed.lines);
    for out in ["walk.csv", "walk.mcap"] {
        let file = bench.path(out);
        let mut child = bench
            .watch()
            .args(["--json", "--secs", "60", "--record"])
            .arg(&file)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let began = std::time::Instant::now();
        let length = || std::fs::metadata(&file).map_or(0, |file| file.len());
        let mut before = 0;
        while length() < 200_000 || length() != before {
            before = length();
            assert!(began.elapsed().as_secs() < 30);
            std::thread::sleep(std::time::Duration::from_millis(500));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let (code, object, said) = replayed(&file);
        assert_eq!((code, &object["different"], &object["finished"]), (Some(0), &0.into(), &false.into()), "{said}");
        assert!(object["compared"].as_u64() >= Some(1000) && said.contains("has no end"), "{object} {said}");
    }
    // No boot record, another layout, no capture.
    let bytes = log_bytes(&walked(3).lines);
    let bench = Bench::plays(&["{}".into()]);
    let (late, _) = record_rtt(&bench, &bytes[bytes.len() / 2..], "late.csv", &[]);
    let (code, _, said) = replayed(&late);
    assert!(code == Some(1) && said.contains("the boot record was lost") && said.contains("no tick could be compared"));
    let json = bench.path("late.csv.json");
    let text = std::fs::read_to_string(&json).unwrap().replacen("\"schema\": 9", "\"schema\": 5", 1);
    std::fs::write(&json, text).unwrap();
    let (code, _, said) = replayed(&late);
    assert!(code == Some(2) && said.contains("late.csv.json: schema 5; allowed is 9"), "{said}");
    std::fs::remove_file(&json).unwrap();
    assert!(replayed(&late).2.contains("late.csv.json: cannot be read"));
    std::fs::write(bench.path("x.mcap"), b"no").unwrap();
    let (code, _, said) = replayed(&bench.path("x.mcap"));
    assert_eq!(code, Some(2), "{said}");
}

/// A program that is killed while it writes can leave half a row.
fn half_a_row_at_the_end_is_left_out_and_one_in_the_middle_refused() {
    let bench = Bench::plays(&walked(1).lines);
    let (file, output) = record(&bench, "walk.csv", &["--secs", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    let (whole, text) = (open(&file), std::fs::read_to_string(&file).unwrap());
    assert_eq!(whole.notes, Vec::<String>::new());
    let last = text.trim_end().rfind('\n').unwrap() + 1;
    let last_comma = text.rfind(',').unwrap();
    let cut = bench.path("cut.csv");
    for at in last + 1..=last_comma {
        std::fs::write(&cut, &text[..at]).unwrap();
        let raw = open(&cut);
        assert_eq!(raw.notes, ["The last row is cut short (line 1001): it is left out."], "{}", &text[last..at]);
        assert_eq!(raw.time_s, whole.time_s[..999]);
        let knee = |raw: &RawJoints| raw.joints[Joint::LeftKnee as usize].as_ref().unwrap().angle_deg.clone();
        assert!(knee(&raw).iter().zip(knee(&whole)).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
    let half = text[last..last_comma].to_owned() + "\n";
    std::fs::write(&cut, text[..last].to_owned() + &half + &text[last..]).unwrap();
    let error = open::read(&cut, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("cut.csv:1001: ") && error.contains("fields; allowed are"), "{error}");
}

/// The errors of a capture of one joint name the missing joints.
fn fit_of_one_joint_names_the_missing_ones() {
    let bench = Bench::plays(&walked(4).lines);
    for joint in Joint::ALL {
        let name = format!("{}.mcap", joint.name());
        let (file, output) = record(&bench, &name, &["--secs", "4", "--sensor", joint.name()]);
        assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
        assert!(Joint::ALL.into_iter().all(|other| open(&file).joints[other as usize].is_some() == (other == joint)));
        let fitted = footfall(&["fit"], &[&file]);
        assert_eq!(fitted.status.code(), Some(2));
        let said = complaints(&fitted);
        let missing: Vec<String> = Joint::ALL
            .into_iter()
            .filter(|other| *other != joint)
            .map(|other| format!("no {}", other.name()))
            .collect();
        assert!(said.contains(&missing.join(", ")), "{said}");
    }
}

/// `footfall record` of the flashed image on the virtual board, as `cargo xtask test` names them.
fn record_image(out: &Path, more: &[&str]) -> Output {
    let path = |variable: &str| std::env::var_os(variable).expect(variable);
    let (elf, board) = (path("FOOTFALL_ELF"), path("FOOTFALL_VIRTUAL_BOARD"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.arg("record").arg("--out").arg(out).arg("--elf").arg(elf).arg("--virtual-board").arg(board);
    let output = command.args(more).stdin(Stdio::null()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", complaints(&output));
    output
}

fn the_virtual_boards_conversions_are_the_codes_of_the_capture() {
    let folder = tempfile::tempdir().unwrap();
    let (out, conversions) = (folder.path().join("walk.csv"), folder.path().join("conversions.csv"));
    record_image(&out, &["--secs", "10.1", "--", "--record-conversions", conversions.to_str().unwrap()]);
    let counts = about(&out)["counts"].clone();
    assert!(counts["samples"].as_u64().unwrap() >= 10_000, "{counts}");
    for none in ["lost_samples", "missed_periods", "dropped_by_the_board", "different_ticks", "malformed_frames"] {
        assert_eq!(counts[none], 0, "{none}");
    }
    assert_eq!(counts["no_replay"], Value::Null);
    assert!(counts["confirmed_ticks"].as_u64().unwrap() >= 1000, "{counts}");
    let channels = column(&conversions, "channel");
    let converted: Vec<AdcCode> = column(&conversions, "code")
        .into_iter()
        .zip(channels)
        .filter(|(_, channel)| channel == "ADC1_IN1")
        .map(|(code, _)| AdcCode(code.parse().unwrap()))
        .collect();
    // A code is what four conversions come to.
    let (fours, _) = converted.as_chunks::<OVERSAMPLING>();
    let delivered: Vec<String> = fours.iter().map(|four| trimmed_mean(*four).0.to_string()).collect();
    let codes = column(&out, "left_knee_code");
    assert!(delivered.starts_with(&codes));
}

/// A sensor on each joint: `footfall fit` takes the capture as it is, in both formats, and their angles are those of the recorded leg.
fn a_capture_of_four_sensors_is_fitted_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let sensors = Joint::ALL.map(|joint| ["--sensor", joint.name()]).concat();
    let walk = gait_trace::format::csv_file::parse(
        footfall::board::feed::DEFAULT_TRACE_NAME,
        footfall::board::feed::DEFAULT_TRACE.as_bytes(),
    );
    let looped = walk.unwrap().looped(1000.0).unwrap().recording;
    for out in ["four.csv", "four.mcap"] {
        let (out, generator) = (folder.path().join(out), folder.path().join("generator.toml"));
        record_image(&out, &[&["--secs", "8", "--press", "none"], sensors.as_slice()].concat());
        let said = about(&out);
        assert_eq!(said["counts"]["lost_samples"], 0);
        assert_eq!(said["counts"]["different_ticks"], 0, "{said}");
        let raw = open(&out);
        assert_eq!(raw.joints.iter().flatten().count(), 4);
        for joint in Joint::ALL {
            let channel = looped.of_joint(joint).unwrap();
            let angles = &raw.joints[joint as usize].as_ref().unwrap().angle_deg;
            // The board's time begins with its first tick, some milliseconds after the feed's; its filter is some late.
            let off_if_late = |late_s: f64| {
                let off = |(t, angle): (&f64, &f64)| {
                    (angle - looped.at(channel, (t - late_s).rem_euclid(looped.duration_s()))).abs()
                };
                raw.time_s.iter().zip(angles).skip(100).map(off).fold(0.0, f64::max)
            };
            let worst = (-10..=10).map(|ms| off_if_late(f64::from(ms) * 1e-3)).fold(f64::MAX, f64::min);
            assert!(worst < 1.0, "{}: {worst} degrees off", joint.name());
        }
        let fitted = footfall(&["fit"], &[&out, Path::new("--out"), &generator]);
        assert_eq!(fitted.status.code(), Some(0), "{}", complaints(&fitted));
        assert!(generator.exists());
        std::fs::remove_file(&generator).unwrap();
    }
}
