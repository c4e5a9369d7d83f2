//! `footfall watch` of a board that runs: records from a server, a file and standard input; on terminals of several sizes, with
//! keys, and as lines; a serial port is a terminal.
#![cfg(unix)]

mod support;

use serde_json::Value;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::process::{Command, ExitCode, Output, Stdio};
use std::time::Duration;
use support::{Bench, SimulatedBoard, frame, framed, framed_bytes};
use test_suite::terminal::Terminal;
use test_suite::tests;
use wire::Record;

fn main() -> ExitCode {
    test_suite::run(tests![
        records_from_a_server_are_lines_json_and_a_screen(Terminal),
        the_screen_is_whole_on_small_and_large_terminals(Terminal),
        a_terminal_without_cursor_or_utf_8_gets_lines(Terminal),
        a_server_that_comes_back_is_connected_again(Terminal),
        standard_input_leaves_the_keys_to_the_terminal(Terminal),
        what_is_no_record_is_refused_with_what_to_do(),
        a_file_is_no_port_and_keeps_its_bytes(),
        silence_is_reported_with_what_to_check(),
        noise_and_records_without_time_end_with_the_seconds(),
    ])
}

/// A board that walks for so long: its records.
fn walked(secs: u32) -> Vec<Vec<u8>> {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(secs);
    pieces(&simulated)
}

/// The bytes of RTT channel 1, a piece for each record.
fn pieces(simulated: &SimulatedBoard) -> Vec<Vec<u8>> {
    let objects = simulated.lines.iter().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let hex = objects.filter_map(|object| object["hex"].as_str().map(str::to_owned));
    hex.map(|hex| {
        (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect::<Vec<_>>()
    })
    .collect()
}

fn samples() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples")
}

fn bench() -> Bench {
    Bench::plays(&["{}".into()])
}

fn watch(arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.arg("watch").stdin(Stdio::null());
    arguments.iter().for_each(|argument| {
        command.arg(argument);
    });
    command
}

fn parts(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// The line of a shell that watches.
fn line(arguments: &str) -> String {
    format!("{} watch {arguments}", env!("CARGO_BIN_EXE_footfall"))
}

/// A server of bytes, as OpenOCD's and J-Link's are: each connection gets the next list, in pieces that are no frames and in a tenth of real time;
/// it stays open as long as `stays`.
fn serve(connections: Vec<Vec<Vec<u8>>>, stays: Duration) -> (String, std::thread::JoinHandle<()>) {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", server.local_addr().unwrap());
    let serving = std::thread::spawn(move || {
        for log in connections {
            let (mut peer, _) = server.accept().unwrap();
            for bytes in log {
                if send(&mut peer, &bytes).is_err() {
                    break;
                }
            }
            std::thread::sleep(stays);
        }
    });
    (address, serving)
}

fn send(peer: &mut TcpStream, bytes: &[u8]) -> std::io::Result<()> {
    for piece in bytes.chunks(37) {
        peer.write_all(piece)?;
    }
    std::thread::sleep(Duration::from_micros(500));
    Ok(())
}

fn records_from_a_server_are_lines_json_and_a_screen() {
    let log = walked(3);
    let (address, serving) = serve(vec![log.clone(); 3], Duration::from_secs(2));
    let (code, text, errors) = parts(&watch(&[&"--rtt", &address]).output().unwrap());
    assert_eq!(code, Some(0), "{errors}");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 30, "{text}");
    // No rate: the board has no clock here but its own.
    assert!(lines[29].contains("walking   tick   3000  late 0  missed 0  sensor"), "{text}");
    assert!(errors.contains("boot: power_on"), "{errors}");
    let (code, text, errors) = parts(&watch(&[&"--rtt", &address, &"--json"]).output().unwrap());
    assert_eq!(code, Some(0), "{errors}");
    let objects: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let ticks: Vec<&Value> = objects.iter().filter(|object| object["type"] == "tick").collect();
    assert_eq!((ticks.len(), &ticks[299]["tick"], &ticks[299]["tick_rate_hz"]), (300, &3000.into(), &Value::Null));
    // What is at the pins is not known, what was commanded is.
    assert_eq!(ticks[299]["pulse_us"], serde_json::json!([null, null, null, null]));
    assert!(ticks[299]["commanded_us"][0].as_u64().unwrap() > 500);
    let mut terminal = Terminal::run(&line(&format!("--rtt {address}")), 100, 30);
    let words = ["walking", "boots seen 1 (power_on)", "left knee", "damaged frames 0", "500 ", "2500 us", "q: end"];
    let shown = terminal.sees_all(&[["tick 3000"].as_slice(), &words].concat());
    assert!(!shown.contains("host replay") && !shown.contains(" Hz"), "{shown}");
    terminal.presses("q");
    assert_eq!(terminal.ends().0, Some(0));
    serving.join().unwrap();
}

fn the_screen_is_whole_on_small_and_large_terminals() {
    let bench = bench();
    let saved = bench.path("log.rtt");
    std::fs::write(&saved, walked(5).concat()).unwrap();
    let arguments = format!("--rtt {}", saved.display());
    for (columns, rows) in [(80, 24), (120, 40), (200, 60)] {
        let mut terminal = Terminal::run(&line(&arguments), columns, rows);
        let shown = terminal.sees_all(&[
            "has ended",
            "tick 5000",
            "measured left knee",
            "left hip ",
            "right knee ",
            " 30│",
            "  0│",
            "-30│",
            "-4 s",
            "-2 s",
            "0 s",
            " log ",
            // The last row.
            "q: end",
        ]);
        let screen: Vec<&str> = shown.lines().collect();
        assert_eq!(screen.len(), usize::from(rows), "{columns}x{rows}:\n{shown}");
        assert!(shown.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count() > 100, "{shown}");
        assert!(screen.iter().all(|line| line.chars().count() <= usize::from(columns)), "{shown}");
        terminal.presses("q");
        assert_eq!(terminal.ends().0, Some(0));
    }
    // Too small for charts: text.
    let mut terminal = Terminal::run(&line(&arguments), 60, 12);
    let _ = terminal.sees_all(&["walking", "q: end"]);
    terminal.presses("q");
    assert_eq!(terminal.ends().0, Some(0));
}

fn a_terminal_without_cursor_or_utf_8_gets_lines() {
    let bench = bench();
    let saved = bench.path("log.rtt");
    std::fs::write(&saved, walked(1).concat()).unwrap();
    let arguments = format!("--rtt {}", saved.display());
    for (variable, plain, words) in [
        ("TERM=dumb", "", "TERM=dumb has no cursor control: plain lines instead of the live screen"),
        ("LANG=C", "", "LANG=C has no UTF-8"),
        ("LANG=C.UTF-8", " --plain", "tick   1000"),
    ] {
        let command = format!("env {variable} {}{plain}", line(&arguments));
        let (code, text) = Terminal::run(&command, 80, 24).ends();
        assert_eq!(code, Some(0), "{text}");
        assert!(text.contains(words) && text.contains("tick   1000"), "{variable}: {text}");
        assert!(text.is_ascii() && !text.contains("\u{1b}[?1049h"), "{variable}: {text}");
    }
}

fn a_server_that_comes_back_is_connected_again() {
    let log = walked(3);
    let (first, second) = log.split_at(log.len() / 2);
    let (address, serving) = serve(vec![first.to_vec(), second.to_vec()], Duration::from_millis(300));
    let arguments = format!("--rtt {address}");
    let mut terminal = Terminal::run(&line(&arguments), 100, 30);
    let shown = terminal.sees("is closed (it has ended); tried again every second");
    assert!(!shown.contains("tick 3000"), "{shown}");
    let _ = terminal.sees_all(&["tick 3000", "connected again"]);
    serving.join().unwrap();
    let _ = terminal.sees("is closed");
    terminal.presses("q");
    assert_eq!(terminal.ends().0, Some(0));
}

fn standard_input_leaves_the_keys_to_the_terminal() {
    let bench = bench();
    let saved = bench.path("log.rtt");
    std::fs::write(&saved, walked(2).concat()).unwrap();
    let command = format!("cat {} | {}", saved.display(), line("--rtt -"));
    let mut terminal = Terminal::run(&command, 100, 30);
    let _ = terminal.sees_all(&["standard input has ended", "tick 2000"]);
    terminal.presses("q");
    assert_eq!(terminal.ends().0, Some(0));
}

fn what_is_no_record_is_refused_with_what_to_do() {
    let bench = bench();
    let noise: Vec<u8> = (0..20_000_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    for (bytes, words) in [
        (noise, "no record: these are not the records of a board"),
        // The log for people.
        (frame("walking: hips   0   0").repeat(100), "RTT channel 1 (with OpenOCD `rtt server start PORT 1`)"),
        (framed_bytes(&[99, 1, 2]), "the board sends records of version 99"),
    ] {
        let saved = bench.path("log.rtt");
        std::fs::write(&saved, bytes).unwrap();
        let (code, text, errors) = parts(&watch(&[&"--rtt", &saved]).output().unwrap());
        assert_eq!((code, text.as_str()), (Some(1), ""), "{errors}");
        assert!(errors.contains(words) && errors.contains("log.rtt"), "{errors}");
    }
    // The ELF file of a recording is of one board: the boot record says which one it is.
    let (nucleo, saved) = (bench.path("nucleo.elf"), bench.path("log.rtt"));
    std::fs::write(&nucleo, support::elf_of("nucleo-f446re")).unwrap();
    std::fs::write(&saved, walked(1).concat()).unwrap();
    let mut record = Command::new(env!("CARGO_BIN_EXE_footfall"));
    record.args(["record", "--rtt"]).arg(&saved).arg("--elf").arg(&nucleo).arg("--out").arg(bench.path("walk.csv"));
    let (code, _, errors) = parts(&record.stdin(Stdio::null()).output().unwrap());
    assert!(
        code == Some(1)
            && errors.contains("the board is a f4-discovery, and this ELF file is the image of another board"),
        "{errors}"
    );
    let (code, _, errors) = parts(&watch(&[&"--rtt", &"tcp:127.0.0.1:1"]).output().unwrap());
    assert!(code == Some(2) && errors.contains("tcp:127.0.0.1:1: cannot be opened"), "{errors}");
}

/// A file is no port, whatever is in it, and no command writes to it as to one.
fn a_file_is_no_port_and_keeps_its_bytes() {
    let bench = bench();
    let saved = bench.path("port.bin");
    let bytes = walked(2).concat();
    std::fs::write(&saved, &bytes).unwrap();
    let (robot, capture, out) = (bench.path("robot.toml"), bench.path("walk.csv"), bench.path("out.toml"));
    std::fs::copy(samples().join("robot.toml"), &robot).unwrap();
    let generator = samples().join("generator.toml");
    let of = |path: &std::path::Path| path.to_str().unwrap().to_owned();
    let (robot, capture, out, generator) = (of(&robot), of(&capture), of(&out), of(&generator));
    for command in [
        &["watch"][..],
        &["record", "-o", &capture],
        &["set", "speed", "1.1"],
        &["set", "--stop"],
        &["set", "--show"],
        &["save", &generator, "-o", &out],
        &["trim", "left_hip", "--robot", &robot, "-o", &out],
    ] {
        let mut footfall = Command::new(env!("CARGO_BIN_EXE_footfall"));
        footfall.args(command).arg("--serial").arg(&saved).stdin(Stdio::null());
        let (code, _, errors) = parts(&footfall.output().unwrap());
        let words = "port.bin: cannot be opened: is a regular file; allowed is the device file of a serial port";
        assert!(code == Some(2) && errors.contains(words), "{command:?}: {errors}");
        assert_eq!(std::fs::read(&saved).unwrap(), bytes, "{command:?}");
    }
    assert!(!bench.path("walk.csv").exists(), "no capture was begun");
}

fn silence_is_reported_with_what_to_check() {
    let (address, serving) = serve(vec![vec![]], Duration::from_secs(20));
    let arguments: [&dyn AsRef<std::ffi::OsStr>; 4] = [&"--rtt", &address, &"--secs", &"1"];
    let (code, text, errors) = parts(&watch(&arguments).output().unwrap());
    assert_eq!((code, text.as_str()), (Some(1), ""), "{errors}");
    assert!(errors.contains("no byte for 5 s; check that the board runs"), "{errors}");
    assert!(errors.contains("silent; check that the board runs") && errors.contains("channel 1"), "{errors}");
    serving.join().unwrap();
}

/// Whatever comes, `--secs` is kept: noise with and without zeros, as fast as it is taken, and records of which none has a time.
fn noise_and_records_without_time_end_with_the_seconds() {
    let noise: Vec<u8> = (0..65_536_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let without_zeros: Vec<u8> = noise.iter().map(|byte| byte | 1).collect();
    let edge = framed(&Record::Edge(wire::Edge { tick: 7, offset_us: 0, high: true, lost_before: false }));
    let no_record = "no record: these are not the records of a board";
    for (bytes, pause_ms, words) in
        [(noise, 0, no_record), (without_zeros, 0, no_record), (edge, 50, "silent; check that the board runs")]
    {
        for command in ["watch", "record"] {
            let server = TcpListener::bind("127.0.0.1:0").unwrap();
            let address = format!("tcp:{}", server.local_addr().unwrap());
            let bytes = bytes.clone();
            let serving = std::thread::spawn(move || {
                let (mut peer, _) = server.accept().unwrap();
                // Until the program has left.
                while peer.write_all(&bytes).is_ok() {
                    std::thread::sleep(Duration::from_millis(pause_ms));
                }
            });
            let bench = bench();
            let mut footfall = Command::new(env!("CARGO_BIN_EXE_footfall"));
            footfall.args([command, "--rtt", &address, "--secs", "1"]).stdin(Stdio::null());
            if command == "record" {
                footfall.arg("-o").arg(bench.path("walk.csv"));
            }
            let began = std::time::Instant::now();
            let (code, _, errors) = parts(&footfall.output().unwrap());
            assert!(code == Some(1) && errors.contains(words), "{command}: {errors}");
            assert!(began.elapsed() < Duration::from_secs(20), "{command}: {:?}", began.elapsed());
            serving.join().unwrap();
        }
    }
}
