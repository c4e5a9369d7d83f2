//! `footfall watch` of a board that runs: bytes of a log from a server, a file and standard input, saved bytes of a serial port; on terminals of
//! several sizes, with keys, and as lines.
#![cfg(unix)]

mod support;

use footfall::board::telemetry::record_in;
use serde_json::Value;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, ExitCode, Output, Stdio};
use std::time::Duration;
use support::{Bench, SimulatedBoard, frame};
use test_suite::terminal::Terminal;
use test_suite::tests;
use wire::{MAX_FRAME_BYTES, Record, frame_record};

fn main() -> ExitCode {
    test_suite::run(tests![
        a_log_from_a_server_is_lines_json_and_a_screen(Terminal),
        the_screen_is_whole_on_small_and_large_terminals(Terminal),
        a_terminal_without_cursor_or_utf_8_gets_lines(Terminal),
        a_server_that_comes_back_is_connected_again(Terminal),
        standard_input_leaves_the_keys_to_the_terminal(Terminal),
        lines_of_probe_rs_show_what_the_raw_bytes_do(),
        another_image_is_refused_and_its_lines_are_not_shown(),
        saved_bytes_of_a_port_are_not_written_to(Terminal),
        silence_is_reported_with_what_to_check(),
    ])
}

/// A board that walks for so long: its log.
fn walked(secs: u32) -> Vec<Vec<u8>> {
    let mut simulated = SimulatedBoard::new();
    simulated.walk(secs);
    pieces(&simulated)
}

/// The bytes of the log, a piece for each message.
fn pieces(simulated: &SimulatedBoard) -> Vec<Vec<u8>> {
    let objects = simulated.lines.iter().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let hex = objects.filter_map(|object| object["hex"].as_str().map(str::to_owned));
    hex.map(|hex| {
        (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect::<Vec<_>>()
    })
    .collect()
}

/// The same as text, as `probe-rs attach --log-format '{L} {s}'` prints it.
fn printed_lines(bench: &Bench, bytes: &[u8]) -> String {
    let image = footfall::board::image::Image::read(&bench.path("fw.elf")).unwrap();
    let mut decoder = image.decoder();
    decoder.push(bytes);
    let mut text = String::new();
    while let Some(Ok(message)) = decoder.message() {
        let level = if record_in(&message.text).is_some() { "<lvl>" } else { "INFO " };
        text += &format!("{level} {}\n", message.text);
    }
    text
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

fn a_log_from_a_server_is_lines_json_and_a_screen() {
    let (bench, log) = (bench(), walked(3));
    let elf = bench.path("fw.elf");
    let (address, serving) = serve(vec![log.clone(); 3], Duration::from_secs(2));
    let (code, text, errors) = parts(&watch(&[&"--rtt", &address, &"--elf", &elf]).output().unwrap());
    assert_eq!(code, Some(0), "{errors}");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 30, "{text}");
    // No rate: the board has no clock here but its own.
    assert!(lines[29].contains("walking   tick   3000  late 0  missed 0  sensor"), "{text}");
    assert!(errors.contains("boot: power_on"), "{errors}");
    let (code, text, errors) = parts(&watch(&[&"--rtt", &address, &"--elf", &elf, &"--json"]).output().unwrap());
    assert_eq!(code, Some(0), "{errors}");
    let objects: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let ticks: Vec<&Value> = objects.iter().filter(|object| object["type"] == "tick").collect();
    assert_eq!((ticks.len(), &ticks[299]["tick"], &ticks[299]["tick_rate_hz"]), (300, &3000.into(), &Value::Null));
    // What is at the pins is not known, what was commanded is.
    assert_eq!(ticks[299]["pulse_us"], serde_json::json!([null, null, null, null]));
    assert!(ticks[299]["commanded_us"][0].as_u64().unwrap() > 500);
    let mut terminal = Terminal::run(&line(&format!("--rtt {address} --elf {}", elf.display())), 100, 30);
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
    let arguments = format!("--rtt {} --elf {}", saved.display(), bench.path("fw.elf").display());
    for (columns, rows) in [(80, 24), (120, 40), (200, 60)] {
        let mut terminal = Terminal::run(&line(&arguments), columns, rows);
        let shown = terminal.sees_all(&[
            "has ended",
            "tick 5000",
            "measured left knee",
            "left hip ",
            "right knee ",
            " 90│",
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
    let arguments = format!("--rtt {} --elf {}", saved.display(), bench.path("fw.elf").display());
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
    let bench = bench();
    let log = walked(3);
    let (first, second) = log.split_at(log.len() / 2);
    let (address, serving) = serve(vec![first.to_vec(), second.to_vec()], Duration::from_millis(300));
    let arguments = format!("--rtt {address} --elf {}", bench.path("fw.elf").display());
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
    let saved = bench.path("log.txt");
    std::fs::write(&saved, printed_lines(&bench, &walked(2).concat())).unwrap();
    let command = format!("cat {} | {}", saved.display(), line("--rtt-lines -"));
    let mut terminal = Terminal::run(&command, 100, 30);
    let _ = terminal.sees_all(&["standard input has ended", "tick 2000"]);
    terminal.presses("q");
    assert_eq!(terminal.ends().0, Some(0));
}

fn lines_of_probe_rs_show_what_the_raw_bytes_do() {
    let (bench, bytes) = (bench(), walked(3).concat());
    let (raw, text) = (bench.path("log.rtt"), bench.path("log.txt"));
    std::fs::write(&raw, &bytes).unwrap();
    std::fs::write(&text, printed_lines(&bench, &bytes)).unwrap();
    let of_raw = parts(&watch(&[&"--rtt", &raw, &"--elf", &bench.path("fw.elf"), &"--json"]).output().unwrap());
    let of_text = parts(&watch(&[&"--rtt-lines", &text, &"--json"]).output().unwrap());
    assert_eq!((of_raw.0, of_text.0), (Some(0), Some(0)), "{}{}", of_raw.2, of_text.2);
    assert_eq!(of_raw.1, of_text.1);
    assert!(of_raw.1.lines().count() > 300, "{}", of_raw.1);
    // A recording too.
    let record = |source: [&dyn AsRef<std::ffi::OsStr>; 2], out: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
        command.arg("record").args(source).arg("--elf").arg(bench.path("fw.elf")).arg("--out").arg(out);
        let (code, _, errors) = parts(&command.stdin(Stdio::null()).output().unwrap());
        assert!(code == Some(0) && errors.contains("3000 samples, 0 lost"), "{errors}");
        std::fs::read_to_string(out).unwrap()
    };
    let of_raw = record([&"--rtt", &raw], &bench.path("raw.csv"));
    assert_eq!(of_raw, record([&"--rtt-lines", &text], &bench.path("text.csv")));
}

fn another_image_is_refused_and_its_lines_are_not_shown() {
    let bench = bench();
    let elf = bench.path("fw.elf");
    let noise: Vec<u8> = (0..20_000_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    // What another image's table makes of a log: lines, but no record.
    let strange = frame("a line of another program").repeat(100);
    for (bytes, words) in [
        (noise, "the board runs another image than this ELF file"),
        (strange, "40 without a record"),
        (frame("wire [00, 63, 01, 02]"), "the board sends records of version 99"),
    ] {
        let saved = bench.path("log.rtt");
        std::fs::write(&saved, bytes).unwrap();
        let (code, text, errors) = parts(&watch(&[&"--rtt", &saved, &"--elf", &elf]).output().unwrap());
        assert_eq!((code, text.as_str()), (Some(1), ""), "{errors}");
        assert!(errors.contains(words) && errors.contains("log.rtt"), "{errors}");
    }
    // The tables of two boards are alike: the boot record says which one it is.
    let (nucleo, saved) = (bench.path("nucleo.elf"), bench.path("log.rtt"));
    std::fs::write(&nucleo, support::elf_of("nucleo-f446re")).unwrap();
    std::fs::write(&saved, walked(1).concat()).unwrap();
    let (code, text, errors) = parts(&watch(&[&"--rtt", &saved, &"--elf", &nucleo]).output().unwrap());
    assert_eq!((code, text.as_str()), (Some(1), ""), "{errors}");
    assert!(
        errors.contains("the board is a f4-discovery, and this ELF file is the image of another board"),
        "{errors}"
    );
    let (code, _, errors) = parts(&watch(&[&"--rtt", &"tcp:127.0.0.1:1", &"--elf", &elf]).output().unwrap());
    assert!(code == Some(2) && errors.contains("tcp:127.0.0.1:1: cannot be opened"), "{errors}");
    let (code, _, errors) = parts(&watch(&[&"--rtt", &"log.rtt"]).output().unwrap());
    assert!(code == Some(2) && errors.contains("--elf"), "{errors}");
}

/// The keys of the screen have nothing to send to: a file with what a port sent is no port.
fn saved_bytes_of_a_port_are_not_written_to() {
    let bench = bench();
    let image = footfall::board::image::Image::read(&bench.path("fw.elf")).unwrap();
    let mut decoder = image.decoder();
    decoder.push(&walked(2).concat());
    let mut bytes = Vec::new();
    while let Some(Ok(message)) = decoder.message() {
        let Some(Ok(record)) = record_in(&message.text) else { continue };
        let mut buffer = [0; MAX_FRAME_BYTES];
        if !matches!(record, Record::Inputs(_)) {
            bytes.extend(frame_record(&record, &mut buffer).unwrap());
        }
    }
    let saved = bench.path("port.bin");
    std::fs::write(&saved, &bytes).unwrap();
    let mut terminal = Terminal::run(&line(&format!("--serial {}", saved.display())), 100, 30);
    let _ = terminal.sees_all(&["has ended", "tick 2000", "nothing can be changed here"]);
    terminal.presses("s\u{1b}[Cuq");
    assert_eq!(terminal.ends().0, Some(0));
    assert_eq!(std::fs::read(&saved).unwrap(), bytes);
}

fn silence_is_reported_with_what_to_check() {
    let bench = bench();
    let (address, serving) = serve(vec![vec![]], Duration::from_secs(20));
    let arguments: [&dyn AsRef<std::ffi::OsStr>; 6] =
        [&"--rtt", &address, &"--elf", &bench.path("fw.elf"), &"--secs", &"1"];
    let (code, text, errors) = parts(&watch(&arguments).output().unwrap());
    assert_eq!((code, text.as_str()), (Some(1), ""), "{errors}");
    assert!(errors.contains("no byte for 5 s; check that the board runs"), "{errors}");
    assert!(errors.contains("silent; check that the board runs") && errors.contains("channel 0"), "{errors}");
    serving.join().unwrap();
}
