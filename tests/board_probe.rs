//! The flashed image under a debugger: stock `probe-rs` connects to the virtual board as to a debug probe with its target, and `gdb-multiarch` to probe-rs.
//!
//! probe-rs' own loader programs the flash: it runs on the emulated core, against the model of the flash interface. What a debugger has set lasts, as on
//! the chip, until the power is switched off: halting by a break point, and the vector catches, with which a fault or a reset halts the core.

use firmware::board::ROBOT_SECTOR;
use footfall_tests::limits::assert_in_time;
use footfall_tests::recordings::default_volts_file;
use joint_loop::store::robot_record;
use joint_loop::{RecordName, RobotConfig};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, ExitCode, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        an_erased_chip_is_flashed_walks_and_is_erased(Image, ProbeRs),
        the_log_is_read_by_run_and_by_attach(Image, ProbeRs),
        registers_and_memory_are_read_and_written(Image, ProbeRs),
        gdb_stops_in_a_tick_and_watches_a_variable(Image, ProbeRs, Debugger),
        catches_outlast_client_and_reset_until_the_power_is_off(Image, ProbeRs),
        without_catches_a_fault_switches_the_outputs_off_in_time(Image, ProbeRs),
        vs_code_attaches_as_the_page_says(Image, ProbeRs),
    ])
}

/// Longest wait for anything: a sector of 128 KiB takes a second, and the machine may do other things.
const PATIENCE: Duration = Duration::from_secs(240);
/// The name of the chip for probe-rs.
const CHIP: &str = "STM32F407VG";
/// Show the log alone, and catch nothing: all four, or a fault still halts.
const NO_CATCH: [&str; 6] =
    ["--rtt-up-channels", "0", "--no-catch-reset", "--no-catch-hardfault", "--no-catch-svc", "--no-catch-hlt"];
/// Debug halting control and status, and its bits; exception and monitor control, with the catches.
const DHCSR: u32 = 0xE000_EDF0;
const C_DEBUGEN: u32 = 1;
const S_HALT: u32 = 1 << 17;
const DEMCR: u32 = 0xE000_EDFC;
const VC_CORERESET: u32 = 1;
const VC_HARDERR: u32 = 1 << 10;

fn variable(name: &str) -> OsString {
    std::env::var_os(name).unwrap_or_else(|| panic!("{name} is set"))
}

/// A virtual board that is a debug probe.
struct Board {
    child: Child,
    console: ChildStdin,
    lines: Arc<Mutex<Vec<Value>>>,
    address: String,
    robot: tempfile::NamedTempFile,
}

impl Board {
    /// Starts a board with these options. A sensor is moved by a recorded walk.
    fn start(options: &[&str], has_image: bool) -> Board {
        let robot = tempfile::NamedTempFile::new().expect("a file");
        let record = robot_record::record_of(&RobotConfig::default_biped(), &RecordName::BUILT_IN);
        fs::write(robot.path(), record.bytes()).expect("written");
        let mut command = Command::new(variable("FOOTFALL_VIRTUAL_BOARD"));
        command.args(["--probe", "127.0.0.1:0", "--loop", "--volts"]).arg(default_volts_file()).args(options);
        if has_image {
            command.arg(variable("FOOTFALL_ELF"));
            command.arg("--flash").arg(format!("{ROBOT_SECTOR:#010x}={}", robot.path().display()));
        } else {
            command.arg("--erased");
        }
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the virtual board runs");
        let console = child.stdin.take().expect("piped");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        let lines = Arc::new(Mutex::new(Vec::new()));
        let to = Arc::clone(&lines);
        thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                to.lock().expect("no panic").push(serde_json::from_str(&line).expect("an object"));
            }
        });
        let mut board = Board { child, console, lines, address: String::new(), robot };
        let address = |lines: &[Value]| lines.iter().find_map(|line| Some(of(line, "probe")?["address"].clone()));
        board.address = board.until("address of the probe", address).as_str().expect("a text").into();
        board
    }

    /// Waits until the lines of the board show something.
    fn until<T>(&self, what: &str, mut find: impl FnMut(&[Value]) -> Option<T>) -> T {
        let begin = Instant::now();
        loop {
            if let Some(found) = find(&self.lines.lock().expect("no panic")) {
                return found;
            }
            let lines = self.lines.lock().expect("no panic");
            assert!(begin.elapsed() < PATIENCE, "no {what}: {:?}", lines.iter().rev().take(5).collect::<Vec<_>>());
            drop(lines);
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Number of lines so far, from which on [`Board::until`] may look for new ones.
    fn count(&self) -> usize {
        self.lines.lock().expect("no panic").len()
    }

    /// Waits until so much more virtual time has passed.
    fn pass(&self, seconds: f64) {
        let from = self.count();
        let time = |line: &Value| of(line, "status")?["t_s"].as_f64();
        let start = self.until("status", |lines| lines[from..].iter().find_map(time));
        self.until("status", |lines| lines[from..].iter().filter_map(time).find(|t_s| *t_s >= start + seconds));
    }

    /// Gives the board a command.
    fn command(&mut self, command: &str) {
        writeln!(self.console, "{command}").expect("the board reads");
    }

    /// The emergency stop is tested, and the button is held: the board arms and walks. Returns the first line of pulses.
    fn arm(&mut self) -> Value {
        self.pass(1.0);
        let from = self.count();
        self.command("stop");
        self.pass(0.3);
        self.command("hold");
        self.until("pulses", |lines| lines[from..].iter().find(|line| of(line, "pulses").is_some()).cloned())
    }

    /// probe-rs with these arguments, and the options that find this board.
    fn probe_rs(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(test_suite::probe_rs());
        let (name, rest) = arguments.split_first().expect("a command");
        command.arg(name).args(["--probe", &format!("1d50:6018:{}", self.address), "--protocol", "swd"]);
        command.args(["--chip", CHIP]).args(rest);
        // A warning for each kind of probe for which there is no USB.
        command.env("RUST_LOG", "error").env("RUST_BACKTRACE", "0").stdin(Stdio::null());
        command
    }

    /// Runs probe-rs to its end; returns its standard output.
    fn probe(&self, arguments: &[&str]) -> String {
        let output = self.probe_rs(arguments).output().expect("probe-rs runs");
        assert_good(&output, arguments);
        String::from_utf8(output.stdout).expect("text")
    }

    /// Reads words.
    fn read(&self, address: u32, count: usize) -> Vec<u32> {
        let text = self.probe(&["read", "b32", &format!("{address:#x}"), &count.to_string()]);
        let words = text.split_whitespace().filter(|word| !word.ends_with(':'));
        words.map(|word| u32::from_str_radix(word, 16).expect("hexadecimal")).collect()
    }

    /// Downloads image and robot record, and lets the board boot.
    fn download(&self) {
        let elf = variable("FOOTFALL_ELF");
        self.probe(&["download", "--verify", elf.to_str().expect("text")]);
        let robot = self.robot.path().to_str().expect("text");
        let sector = format!("{ROBOT_SECTOR:#x}");
        self.probe(&["download", "--binary-format", "bin", "--base-address", &sector, "--verify", robot]);
    }

    /// Ends the board; returns its last line.
    fn end(mut self) -> Value {
        self.command("quit");
        let end = self.until("last line", |lines| lines.iter().find_map(|line| of(line, "end").cloned()));
        assert_eq!((&end["unmodelled"], &end["unexpected_faults"]), (&0.into(), &0.into()), "{end}");
        assert_eq!(end["lints"], Value::Array(vec![]), "accesses of a debugger are no lints");
        end
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The line if it is of a type.
fn of<'a>(line: &'a Value, kind: &str) -> Option<&'a Value> {
    (line["type"] == kind).then_some(line)
}

/// Whether the last that came or went is a client that came.
fn is_connected(lines: &[Value]) -> Option<()> {
    let last = lines.iter().rev().find_map(|line| of(line, "probe_client")?["connected"].as_bool());
    (last == Some(true)).then_some(())
}

fn assert_good(output: &Output, arguments: &[&str]) {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "probe-rs {arguments:?}: {errors}{}", String::from_utf8_lossy(&output.stdout));
}

/// A probe-rs that runs until it is ended, and what it writes.
struct Session {
    child: Child,
    text: Arc<Mutex<String>>,
}

impl Session {
    fn start(command: &mut Command) -> Session {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("probe-rs runs");
        let text = Arc::new(Mutex::new(String::new()));
        let streams: [Box<dyn Read + Send>; 2] =
            [Box::new(child.stdout.take().expect("piped")), Box::new(child.stderr.take().expect("piped"))];
        for stream in streams {
            let to = Arc::clone(&text);
            thread::spawn(move || {
                let (mut lines, mut line) = (BufReader::new(stream), Vec::new());
                while lines.read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
                    to.lock().expect("no panic").push_str(&String::from_utf8_lossy(&line));
                    line.clear();
                }
            });
        }
        Session { child, text }
    }

    /// Waits until it has written a word.
    fn until(&self, word: &str) {
        let begin = Instant::now();
        loop {
            let text = self.text.lock().expect("no panic").clone();
            if text.contains(word) {
                return;
            }
            assert!(begin.elapsed() < PATIENCE, "no `{word}` in:\n{text}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Ends it. By SIGTERM: probe-rs 0.32 does not heed SIGINT where an image has a down channel and no terminal is there.
    fn interrupt(mut self) -> String {
        let ended = Command::new("kill").args(["-TERM", &self.child.id().to_string()]).status();
        assert!(ended.expect("kill runs").success());
        self.child.wait().expect("it ends");
        let text = self.text.lock().expect("no panic");
        text.clone()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn an_erased_chip_is_flashed_walks_and_is_erased() {
    let mut board = Board::start(&[], false);
    assert_eq!(board.read(0x0800_0000, 2), [u32::MAX; 2]);
    let begin = Instant::now();
    board.download();
    report!("image and robot record are downloaded and verified in {:.1} s", begin.elapsed().as_secs_f64());
    // The first word of the image: the initial stack pointer.
    assert_eq!(board.read(0x0800_0000, 1)[0] >> 24, 0x20);
    board.probe(&["reset"]);
    board.arm();
    board.pass(3.0);
    board.probe(&["erase"]);
    let ends: Vec<u32> = [0x0800_0000, ROBOT_SECTOR, 0x080F_FFFC].iter().flat_map(|at| board.read(*at, 1)).collect();
    assert_eq!(ends, [u32::MAX; 3]);
    // The judge has the limits of the record that was downloaded.
    let end = board.end();
    assert!(end["judged"]["pulses"].as_u64().is_some_and(|pulses| pulses > 400), "{end}");
    assert_eq!(end["judged"]["violations"], 0, "{end}");
}

fn the_log_is_read_by_run_and_by_attach() {
    let elf = variable("FOOTFALL_ELF");
    let elf = elf.to_str().expect("text");
    let mut board = Board::start(&[], true);
    // `run` downloads the image again. The parameter sectors stay.
    let run = Session::start(board.probe_rs(&["run"]).args(NO_CATCH).arg(elf));
    run.until("f4-discovery");
    assert!(run.interrupt().contains("reset"));
    board.pass(1.0);
    let attach = Session::start(board.probe_rs(&["attach"]).args(NO_CATCH).arg(elf));
    board.until("client", is_connected);
    board.arm();
    attach.until("walking");
    attach.interrupt();
    let end = board.end();
    assert_eq!(end["judged"]["violations"], 0, "{end}");
}

fn registers_and_memory_are_read_and_written() {
    let board = Board::start(&[], true);
    // DBGMCU_IDCODE, and the part of CPUID that says Cortex-M4.
    assert_eq!(board.read(0xE004_2000, 1)[0] & 0xFFF, 0x413);
    assert_eq!(board.read(0xE000_ED00, 1)[0] >> 4 & 0xFFF, 0xC24);
    // The top of the RAM, above the stack.
    let free = 0x2001_FF00_u32;
    board.probe(&["write", "b32", &format!("{free:#x}"), "0x12345678", "0xcafef00d"]);
    assert_eq!(board.read(free, 2), [0x1234_5678, 0xCAFE_F00D]);
    board.probe(&["write", "b8", &format!("{:#x}", free + 1), "0xaa"]);
    assert_eq!(board.read(free, 1), [0x1234_AA78]);
    // A store to the flash without its key has no effect but an error flag.
    let first = board.read(0x0800_0000, 1);
    board.probe(&["write", "b32", "0x08000000", "0"]);
    assert_eq!(board.read(0x0800_0000, 1), first);
    // An address without memory is an error, and the next access is good.
    let failed = board.probe_rs(&["read", "b32", "0x30000000", "1"]).output().expect("probe-rs runs");
    assert!(!failed.status.success());
    // The sticky bit of a reset, by the cause that the board reports.
    let from = board.count();
    board.probe(&["reset"]);
    let is_software = |line: &&Value| of(line, "boot").is_some_and(|boot| boot["cause"] == "software");
    board.until("boot", |lines| lines[from..].iter().find(is_software).map(drop));
    assert_eq!(board.read(DHCSR, 1)[0] & (C_DEBUGEN | S_HALT), C_DEBUGEN);
    board.end();
}

/// A port that nobody uses.
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port").port()
}

fn gdb_stops_in_a_tick_and_watches_a_variable() {
    // The watchdog's oscillator stops before the debugger comes: a core that a person holds at a break point is not reset then. It need not stop where the
    // board lets the watchdog be frozen with the core.
    let board = Board::start(&["--lsi", "0@2"], true);
    board.pass(3.0);
    let port = free_port().to_string();
    let at = format!("127.0.0.1:{port}");
    let stub = Session::start(&mut board.probe_rs(&["gdb", "--gdb-connection-string", &at]));
    stub.until(&port);
    let script = [
        "set pagination off",
        "set confirm off",
        "set remotetimeout 60",
        &format!("target remote {at}"),
        "break control_step",
        "continue",
        "backtrace 12",
        "delete",
        // probe-rs 0.32 has no watch points of the hardware: gdb steps, and compares. The word is where the next call saves its return address.
        "set can-use-hw-watchpoints 0",
        "set language c",
        "set var $word = (unsigned *)($sp - 4)",
        "set var *$word = 0",
        "watch *$word",
        "continue",
        "info registers pc",
        "delete",
        "stepi",
        "detach",
    ];
    let mut gdb = Command::new("gdb-multiarch");
    gdb.args(["--nx", "--batch"]).args(script.iter().flat_map(|line| ["-ex", line])).arg(variable("FOOTFALL_ELF"));
    let output = gdb.stdin(Stdio::null()).output().expect("gdb-multiarch runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let all = format!("{text}{}", String::from_utf8_lossy(&output.stderr));
    report!("{all}");
    let (before, after) = text.split_once("Breakpoint 1, ").unwrap_or_else(|| panic!("no break point: {all}"));
    assert!(before.contains("Breakpoint 1 at"), "{all}");
    assert!(after.contains("#0 ") && after.contains("#1 "), "a back trace: {all}");
    let (_, watched) = after.split_once("atchpoint 2").unwrap_or_else(|| panic!("no watch point: {all}"));
    assert!(watched.contains("Old value = ") && watched.contains("New value = "), "{all}");
    drop(stub);
    board.end();
}

/// Waits until the board reports a boot after line `from`; returns its cause.
fn next_boot(board: &Board, from: usize) -> String {
    let cause = |line: &Value| of(line, "boot").map(|boot| boot["cause"].as_str().expect("a text").to_owned());
    board.until("boot", |lines| lines[from..].iter().find_map(cause))
}

/// `attach` as it is by default: a hard fault and a reset halt the core, also when probe-rs is gone.
fn catches_outlast_client_and_reset_until_the_power_is_off() {
    let elf = variable("FOOTFALL_ELF");
    // A slow oscillator of the watchdog gives a client on a busy machine the time to halt and go on.
    let mut board = Board::start(&["--lsi-hz", "17000"], true);
    board.pass(1.0);
    let attach = Session::start(board.probe_rs(&["attach"]).arg(&elf));
    let catches = || board.read(DEMCR, 1)[0] & (VC_CORERESET | VC_HARDERR);
    board.until("client", is_connected);
    thread::sleep(Duration::from_secs(2));
    attach.interrupt();
    assert_eq!(catches(), VC_CORERESET | VC_HARDERR);
    // A reset: the core halts before its first instruction.
    let from = board.count();
    board.command("reset");
    assert_eq!(next_boot(&board, from), "pin");
    let executed = |board: &Board| {
        let status = |line: &Value| of(line, "status")?["instructions"].as_u64();
        let from = board.count();
        board.until("status", |lines| lines[from..].iter().find_map(status))
    };
    let first = executed(&board);
    board.pass(1.0);
    assert_eq!(executed(&board), first, "the core executes after a reset that is caught");
    // `read` lets the core go on when it ends.
    assert_eq!(board.read(DHCSR, 1)[0] & (C_DEBUGEN | S_HALT), C_DEBUGEN | S_HALT);
    assert_eq!(board.read(DEMCR, 1)[0] & (VC_CORERESET | VC_HARDERR), VC_CORERESET | VC_HARDERR);
    // Only the power ends it.
    let from = board.count();
    board.command("power");
    assert_eq!(next_boot(&board, from), "power_on");
    board.pass(1.0);
    assert!(executed(&board) > first + 1_000);
    let demcr = board.read(DEMCR, 1)[0];
    assert_eq!(demcr & (VC_CORERESET | VC_HARDERR), 0);

    // With a catch a hard fault halts the core. The outputs are off, so the watchdog stands still with it.
    board.probe(&["write", "b32", &format!("{DEMCR:#x}"), &format!("{:#x}", demcr | VC_HARDERR)]);
    board.pass(0.5);
    let from = board.count();
    // When no client is there, whose end would let the core go on.
    board.command("inject { undefined = \"control_step\" }");
    board.until("fault", |lines| lines[from..].iter().find_map(|line| of(line, "fault").cloned()));
    board.pass(1.0);
    let halted = executed(&board);
    board.pass(1.0);
    assert_eq!(executed(&board), halted, "the handler of the fault runs");
    let boots = |lines: &[Value]| lines[from..].iter().any(|line| of(line, "boot").is_some());
    assert!(!boots(&board.lines.lock().expect("no panic")), "a reset while the core is halted and the outputs are off");
}

/// With the options that the documents name, a fault in a walk runs its handler, although a debugger is there.
fn without_catches_a_fault_switches_the_outputs_off_in_time() {
    let elf: PathBuf = variable("FOOTFALL_ELF").into();
    let mut board = Board::start(&["--lsi-hz", "17000", "--pace", "--fault", "control_step@40"], true);
    let attach = Session::start(board.probe_rs(&["attach"]).args(NO_CATCH).arg(elf));
    board.arm();
    let reaction = board.until("reaction", |lines| {
        lines.iter().find_map(|line| of(line, "boot").filter(|boot| boot["cause"] == "software").cloned())
    });
    report!("{reaction}");
    attach.interrupt();
    board.command("quit");
    let end = board.until("last line", |lines| lines.iter().find_map(|line| of(line, "end").cloned()));
    let fault = &end["injections"][0];
    let ms = fault["rail_us"].as_f64().unwrap_or_else(|| panic!("no rail_us: {end}")) / 1_000.0;
    report!("supply of the servos off {ms} ms after the fault, with a debugger attached");
    assert_in_time("H07", ms, "with a debugger attached");
    assert_eq!(end["judged"]["violations"], 0, "{end}");
}

/// A message of the Debug Adapter Protocol.
fn send(to: &mut impl Write, message: &Value) {
    let text = message.to_string();
    write!(to, "Content-Length: {}\r\n\r\n{text}", text.len()).expect("sent");
}

/// The next message.
fn receive(from: &mut impl BufRead) -> Value {
    let mut length = 0;
    loop {
        let mut line = String::new();
        assert!(from.read_line(&mut line).expect("a header") > 0, "the adapter has closed the connection");
        match line.trim().split_once(": ") {
            Some(("Content-Length", bytes)) => length = bytes.parse().expect("a length"),
            Some(_) => {}
            None => break,
        }
    }
    let mut bytes = vec![0; length];
    from.read_exact(&mut bytes).expect("a message");
    serde_json::from_slice(&bytes).expect("JSON")
}

/// The configuration of docs/debugging.md, given to the adapter as the extension gives it: the log comes, and no catch is set.
fn vs_code_attaches_as_the_page_says() {
    let page = fs::read_to_string(footfall_tests::bench::root().join("docs/debugging.md")).expect("the page");
    let (_, block) = page.split_once("```json\n").expect("a block");
    let mut launch: Value = serde_json::from_str(block.split_once("```").expect("its end").0).expect("JSON");
    let mut configuration = launch["configurations"][0].take();
    let mut board = Board::start(&[], true);
    configuration["cwd"] = footfall_tests::bench::root().to_str().expect("text").into();
    configuration["probe"] = format!("1d50:6018:{}", board.address).into();
    configuration["coreConfigs"][0]["programBinary"] = variable("FOOTFALL_ELF").to_str().expect("text").into();

    let port = free_port().to_string();
    let mut server = Command::new(test_suite::probe_rs());
    let server = Session::start(server.args(["dap-server", "--port", &port]).env("RUST_LOG", "error"));
    let begin = Instant::now();
    let stream = loop {
        match TcpStream::connect(format!("127.0.0.1:{port}")) {
            Ok(stream) => break stream,
            Err(error) => assert!(begin.elapsed() < PATIENCE, "{error}"),
        }
        thread::sleep(Duration::from_millis(50));
    };
    stream.set_read_timeout(Some(PATIENCE)).expect("a time limit");
    let (mut to, mut from) = (stream.try_clone().expect("a stream"), BufReader::new(stream));
    let kind = configuration["request"].clone();
    let requests = [
        (
            1,
            "initialize".into(),
            json!({"adapterID": "probe-rs-debug", "linesStartAt1": true, "columnsStartAt1": true}),
        ),
        (2, kind, configuration),
        (3, "configurationDone".into(), json!({})),
    ];
    let mut logged = String::new();
    for (number, command, arguments) in requests {
        send(&mut to, &json!({"seq": number, "type": "request", "command": command, "arguments": arguments}));
        // What has to come before the next request.
        let is_answer = |message: &Value| message["type"] == "response" && message["request_seq"] == number;
        let answer = std::iter::repeat_with(|| receive(&mut from)).find(is_answer).expect("an answer");
        assert_eq!(answer["success"], true, "{answer} {}", server.text.lock().expect("no panic"));
    }
    board.arm();
    while !logged.contains("walking: hips") {
        let message = receive(&mut from);
        // The extension opens a window for each channel, and says so before it gets what the channel has.
        if message["event"] == "probe-rs-rtt-channel-config" {
            let channel = &message["body"]["channelNumber"];
            let window = json!({"channelNumber": channel, "windowIsOpen": true});
            send(&mut to, &json!({"seq": 4, "type": "request", "command": "rttWindowOpened", "arguments": window}));
        }
        if message["event"] == "probe-rs-rtt-data" && message["body"]["channelNumber"] == 0 {
            logged += message["body"]["data"].as_str().expect("text");
        }
    }
    send(
        &mut to,
        &json!({"seq": 5, "type": "request", "command": "disconnect", "arguments": {"terminateDebuggee": false}}),
    );
    while receive(&mut from)["command"] != "disconnect" {}
    server.interrupt();
    assert_eq!(board.read(DEMCR, 1)[0] & (VC_CORERESET | VC_HARDERR), 0);
    board.end();
}
