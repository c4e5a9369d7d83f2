//! The command lines of docs/first-walk.md and docs/boards.md, one after the other as they are written, with a virtual board at stock probe-rs. Those of
//! docs/pico.md are run by the step `pico` of `cargo xtask test`.
//!
//! A line is run by the shell in a folder that has the samples. Only a serial port and a network address are replaced by those of the virtual board.

use footfall_tests::bench::{Bench, Log, root, until};
use footfall_tests::board::Board;
use joint_loop::store::robot_record;
use std::process::{Command, ExitCode, Output, Stdio};
use tempfile::TempDir;
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![
        those_of_the_first_walk(Image, Program, ProbeRs),
        those_of_boards_flash_keep_and_watch(Image, Program, ProbeRs),
    ])
}

/// The page's serial port of a board.
const PORT: &str = "/dev/ttyACM0";
/// The page's address of a server of RTT data.
const SERVER: &str = "tcp:localhost:9090";

/// A page whose lines are taken from top to bottom.
struct Page<'a> {
    name: &'static str,
    lines: std::vec::IntoIter<String>,
    bench: &'a Bench,
    /// The server of RTT data that stands for [`SERVER`].
    server: Option<String>,
    folder: TempDir,
}

impl<'a> Page<'a> {
    fn open(name: &'static str, bench: &'a Bench) -> Self {
        let text = std::fs::read_to_string(root().join(name)).expect("the page");
        // Below the root, where cargo finds its settings.
        let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder");
        let samples = std::fs::canonicalize(root().join("samples")).expect("the samples");
        std::os::unix::fs::symlink(samples, folder.path().join("samples")).expect("a link");
        Self { name, lines: command_lines(&text).into_iter(), bench, server: None, folder }
    }

    /// The next line, which must be this one.
    fn take(&mut self, line: &str) {
        assert_eq!(self.lines.next().as_deref(), Some(line), "the next command line of {}", self.name);
        report!("{line}");
    }

    fn command(&self, line: &str) -> Command {
        let mut line = line.to_owned();
        if line.contains(PORT) {
            line = line.replace(PORT, &self.bench.port());
        }
        if line.contains(SERVER) {
            line = line.replace(SERVER, self.server.as_ref().expect("a server of RTT data"));
        }
        let mut shell = self.bench.beside("sh", "");
        // The shell gives way to the command, which gets Ctrl-C.
        shell.current_dir(self.folder.path()).args(["-c", &format!("exec {line}")]);
        shell
    }

    fn run(&mut self, line: &str) -> Output {
        self.take(line);
        self.command(line).stdin(Stdio::null()).output().expect("a shell")
    }

    /// A line that ends with success. What it said.
    fn ends(&mut self, line: &str) -> String {
        let output = self.run(line);
        let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
        assert!(output.status.success(), "{}: `{line}`: {}\n{said}", self.name, output.status);
        said
    }

    /// Sets a parameter of the board, which is not a line of the page.
    fn set(&self, change: &str) {
        let set = self.command(&format!("cargo footfall set --serial {PORT} {change}")).output().expect("a shell");
        assert!(set.status.success(), "{change}: {}", String::from_utf8_lossy(&set.stderr));
    }

    /// A line that shows something until it is ended.
    fn shows(&mut self, line: &str, words: &str) -> Log {
        self.take(line);
        let mut log = Log::start(&mut self.command(line));
        log.until(words);
        log
    }

    /// A line that this test does not run, and why.
    fn not_run(&mut self, line: &str, why: &str) {
        assert!(!why.is_empty());
        self.take(line);
    }

    /// Writes a file of the repository under a name that the page uses for a file of the reader.
    fn copy(&self, from: &str, to: &str) {
        std::fs::copy(root().join(from), self.folder.path().join(to)).expect("copied");
    }

    fn end(mut self) {
        assert_eq!(self.lines.next(), None, "a command line of {} that no test runs", self.name);
    }
}

/// The lines in the shell blocks of a page, without what is said behind them.
fn command_lines(page: &str) -> Vec<String> {
    let blocks = page.split("```").skip(1).step_by(2).filter_map(|block| block.strip_prefix("sh\n"));
    let lines = blocks.flat_map(str::lines).map(|line| line.split(" #").next().unwrap_or(line).trim());
    lines.filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

/// From a chip as delivered to a walk.
fn those_of_the_first_walk() {
    const INFO: &str = "cargo xtask board info --board f4-discovery";
    let bench = Bench::start(["--erased", "--no-brown-out-reset"]);
    let mut page = Page::open("docs/first-walk.md", &bench);
    page.shows("cargo xtask run", "walking").end();
    page.ends("cargo footfall defaults robot > robot.toml");
    assert!(page.ends("cargo footfall check --robot robot.toml").contains("good"));
    let certified = page.ends("cargo footfall certify samples/generator.toml --robot robot.toml -o certificate.json");
    assert!(certified.contains("accepted"), "{certified}");
    let line = "cargo xtask run --no-sensor --generator samples/generator.toml --robot robot.toml";
    page.shows(line, "walking").end();
    page.not_run("cargo xtask setup --with probe", "the set-up of this test is the same");
    let flash =
        "cargo xtask flash --board f4-discovery --no-sensor --generator samples/generator.toml --robot robot.toml";

    let mut log = page.shows(&format!("{flash} --shadow"), "disarmed");
    bench.command("stop");
    bench.command("hold");
    log.until("walking");
    let said = log.terminate();
    for words in
        ["brown-out reset: level off; this board should have level 2", "until its supply is switched off and on"]
    {
        assert!(said.contains(words), "`{words}`: {said}");
    }
    assert!(bench.of_kind("pulses").is_empty(), "pulses in shadow mode");
    let info = page.ends(INFO);
    assert!(info.contains("generator.bin: good") && info.contains("robot.bin: good"), "{info}");

    let mut log = page.shows(flash, "disarmed");
    bench.arm();
    log.until("walking");
    bench.stop();
    log.terminate();
    assert!(page.ends(INFO).contains("robot.bin: good"));
    let robot = robot_record::read(&bench.memory(0x0800_C000, 0x4000));
    assert!(robot.is_ok_and(|record| record.is_some()), "the robot's record");
    let catches = u32::from_le_bytes(bench.memory(0xE000_EDFC, 4).try_into().expect("a word"));
    assert_eq!(catches & (1 << 10 | 1), 0, "VC_HARDERR, VC_CORERESET");

    // The log has ended; the program has not.
    bench.arm();
    let boots = bench.of_kind("boot").len();
    let (code, _, errors) = bench.xtask("board info");
    let is_refused = code == Some(1) && errors.contains("servo outputs are on: stop the walk first");
    // Where attaching takes longer than the watchdog bears, there is nothing left to refuse.
    assert!(is_refused || bench.of_kind("boot").len() > boots, "{code:?} {errors}");
    page.end();
}

fn those_of_boards_flash_keep_and_watch() {
    const NUCLEO: &str = "the virtual board is no STM32F446";
    const BLACK_PILL: &str = "this virtual board is a Discovery";
    const CARGO: &str = "its target cannot be had everywhere; tests/xtask_probe.rs runs what cargo would run";
    let bench = Bench::start(["--erased", "--serial"]);
    let mut page = Page::open("docs/boards.md", &bench);
    page.copy("samples/generator.toml", "generator.toml");
    page.copy("samples/robot.toml", "robot.toml");
    for sensor in ["hip.toml", "knee.toml"] {
        page.copy("samples/sensor.toml", sensor);
    }
    page.not_run("cargo xtask setup --with probe", "the set-up of this test is the same");
    page.shows("cargo xtask flash", "disarmed").terminate();
    page.not_run("cargo xtask flash --board nucleo-f446re", NUCLEO);
    page.not_run("cargo xtask flash --board black-pill-f411", BLACK_PILL);
    page.shows("cargo xtask flash --generator generator.toml", "disarmed").terminate();
    let line = "cargo xtask flash --sensor left_hip=hip.toml --sensor left_knee=knee.toml";
    page.shows(line, "disarmed").terminate();
    page.shows("cargo xtask flash --robot robot.toml", "disarmed").terminate();
    page.shows("cargo xtask flash --shadow", "disarmed").terminate();
    let mut log = page.shows("cargo xtask flash --no-sensor", "disarmed");
    bench.arm();
    log.until("walking");
    bench.stop();
    log.terminate();
    page.not_run("cargo xtask flash --board black-pill-f411 --dfu", "no USB boot loader is modelled");
    assert!(page.ends("cargo xtask board info").contains("robot.bin: good"));
    page.ends("cargo xtask board read -o saved");
    page.ends("cargo xtask board erase --generator");
    page.ends("cargo xtask board brown-out");

    page.not_run("cargo run -p firmware --release --target thumbv7em-none-eabihf", CARGO);
    page.not_run("cd firmware", CARGO);
    page.not_run("cargo run --release --features nucleo-f446re", NUCLEO);
    page.not_run("cargo embed nucleo-f446re --release --features nucleo-f446re", NUCLEO);

    page.ends("cargo footfall defaults robot > robot.toml");
    page.ends("cargo footfall check --robot robot.toml");
    page.copy("samples/generator.toml", "earlier.toml");
    std::fs::remove_file(page.folder.path().join("generator.toml")).expect("removed");
    page.ends("cargo footfall fit samples/walk.csv --robot robot.toml --fit-limits -o generator.toml");
    page.ends("cargo footfall certify generator.toml --robot robot.toml");
    page.shows("cargo xtask run --generator generator.toml --robot robot.toml", "walking").end();
    let mut log = page.shows("cargo xtask flash --generator generator.toml --robot robot.toml", "disarmed");
    bench.arm();
    log.until("walking");
    bench.stop();
    log.terminate();
    let line = "cargo footfall trim left_hip --serial /dev/ttyACM0 --robot robot.toml -o robot.toml --force";
    page.not_run(line, "it asks for angles that a person measures; tests/board_trim.rs answers");

    let line = "cargo xtask run --sensor left_hip --sensor right_hip --sensor left_knee=knee.toml --sensor right_knee --record walk.mcap";
    page.shows(line, "walking").end();
    page.not_run("cargo footfall fit walk.mcap -o generator.toml", "the recording of the line before has few strides");
    page.ends("cargo footfall replay walk.mcap");
    page.ends("cargo footfall record --help");

    page.shows("cargo xtask watch", "disarmed").end();
    page.not_run("cargo xtask watch --board nucleo-f446re --serial /dev/ttyACM0", NUCLEO);
    page.not_run("cargo xtask record --board nucleo-f446re -o walk.csv", NUCLEO);

    // What is saved below is tuned from the built-in walk.
    bench.must("board erase --generator");
    page.ends("cargo footfall set --list");
    page.shows("cargo footfall watch --serial /dev/ttyACM0", "disarmed").end();
    for line in ["speed 1.2", "gait human-walk", "record_rate 1000", "--show", "--undo", "--stop"] {
        page.ends(&format!("cargo footfall set --serial /dev/ttyACM0 {line}"));
    }
    // Of another board: with a probe, its client reads the RTT data.
    let ran = Board::find().run_with_probe(["--secs", "600"], |server, _| {
        page.server = Some(server);
        page.ends("cargo footfall set --rtt tcp:localhost:9090 speed 1.2");
    });
    ran.assert_sound();
    let recorded = page.folder.path().join("walk.csv");
    let log = page.shows("cargo footfall record --serial /dev/ttyACM0 -o walk.csv", "");
    // Ctrl-C before may come where the program does not heed it yet, if its parents ignore it.
    until("the recording", || recorded.exists());
    log.end();
    assert!(page.ends("cargo xtask run --pace -- --serial").contains("/dev/pts/"), "the name of the port");

    page.ends("cargo footfall defaults generator > walk.toml");
    // A gait by name is no generator of a file; `save` says so, and what to do.
    page.set("gait own");
    page.ends("cargo xtask board save walk.toml --serial /dev/ttyACM0 -o tuned.toml");
    // The next lines are other ways to the same file.
    for made in ["tuned.toml", "tuned.certificate.json"] {
        std::fs::remove_file(page.folder.path().join(made)).expect("removed");
    }
    // The same without a probe begins with the same board.
    bench.must("board erase --generator");
    page.set("speed 1.2");
    page.ends("cargo footfall save walk.toml --serial /dev/ttyACM0 -o tuned.toml");
    std::fs::remove_file(page.folder.path().join("tuned.toml")).expect("removed");
    page.ends("cargo footfall save samples/generator.toml --set speed=1.2 --set offset_left_hip=-2.5 -o tuned.toml");
    page.ends("cargo footfall certify tuned.toml");
    page.shows("cargo xtask flash --keep --generator tuned.toml", "disarmed").terminate();
    page.ends("cargo footfall sync samples/edges.csv");
    page.ends("cargo footfall sync samples/line-board.csv --against samples/line-recorder.csv");
    page.end();
}
