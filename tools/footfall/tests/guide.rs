//! `footfall calibrate --guide` as a person uses it: on a terminal, with a sensor that speaks all the while. The terminal is a pseudo one,
//! made by `script` of util-linux.

use footfall::file::calibration_file;
use generator_file::toml_file::TomlFile;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitCode, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use test_suite::tests;

fn main() -> ExitCode {
    default_interrupts();
    test_suite::run(tests![
        poses_are_taken_by_enter_while_the_codes_run_on_the_screen(Terminal),
        codes_by_standard_input_leave_the_keys_to_the_terminal(Terminal),
        whoever_breaks_off_leaves_no_file(Terminal),
        an_unsteady_pose_and_a_silent_sensor_are_reported(Terminal),
    ])
}

/// Gives every child the default reaction to the interrupt signal, which ends it.
///
/// A shell that runs the tests in the background, or under `nohup`, may have them ignore the signal, and a child inherits that. It does
/// not inherit a handler: exec puts the default in its place (POSIX, execve). The handler does what the default does.
fn default_interrupts() {
    let is_default = Arc::new(AtomicBool::new(true));
    signal_hook::flag::register_conditional_default(signal_hook::consts::SIGINT, is_default).unwrap();
}

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(60);

/// A sensor that writes a code each millisecond into a pipe, as long as somebody reads.
struct Sensor {
    code: Arc<AtomicU32>,
    done: Arc<AtomicBool>,
}

impl Sensor {
    fn on(pipe: PathBuf) -> Self {
        let sensor = Self { code: Arc::new(AtomicU32::new(1000)), done: Arc::new(AtomicBool::new(false)) };
        let (code, done) = (Arc::clone(&sensor.code), Arc::clone(&sensor.done));
        std::thread::spawn(move || {
            let Ok(mut pipe) = File::options().write(true).open(pipe) else { return };
            let mut n = 0;
            while !done.load(Ordering::Relaxed) {
                // Two codes of noise.
                n += 1;
                if writeln!(pipe, "{}", code.load(Ordering::Relaxed) + n % 3).is_err() {
                    return;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        sensor
    }

    fn at(&self, degrees: f64) {
        self.code.store((600.0 + 25.0 * degrees) as u32, Ordering::Relaxed);
    }
}

impl Drop for Sensor {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Relaxed);
    }
}

/// A person at a terminal.
struct Person {
    child: Child,
    keys: ChildStdin,
    screen: Arc<Mutex<String>>,
    /// Where on the screen he has read to.
    read: usize,
}

impl Person {
    /// Types a command into a terminal.
    fn types(command: &str) -> Self {
        let mut script = Command::new("script");
        script.args(["--quiet", "--return", "--flush", "--command", command, "/dev/null"]);
        let mut child = script.env("SHELL", "/bin/sh").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (keys, mut out) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let screen = Arc::new(Mutex::new(String::new()));
        let shared = Arc::clone(&screen);
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(n @ 1..) = out.read(&mut bytes) {
                shared.lock().unwrap().push_str(&String::from_utf8_lossy(&bytes[..n]));
            }
        });
        Self { child, keys, screen, read: 0 }
    }

    /// Waits until this is on the screen, further on than what was waited for before.
    fn sees(&mut self, what: &str) {
        let began = Instant::now();
        loop {
            let screen = self.screen.lock().unwrap().clone();
            if let Some(at) = screen[self.read..].find(what) {
                self.read += at + what.len();
                return;
            }
            assert!(began.elapsed() < PATIENCE, "never saw `{what}` after byte {}: {screen}", self.read);
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn presses(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
        self.keys.flush().unwrap();
    }

    /// The exit code, and all that was on the screen.
    fn ends(mut self) -> (Option<i32>, String) {
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                std::thread::sleep(Duration::from_millis(50));
                return (status.code(), self.screen.lock().unwrap().clone());
            }
            assert!(began.elapsed() < PATIENCE, "it does not end: {}", self.screen.lock().unwrap());
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

struct Bench {
    folder: tempfile::TempDir,
    pipe: PathBuf,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("codes");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        Self { folder, pipe }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `footfall calibrate --guide` with codes from there, up to 60 degrees and back.
    fn command(&self, codes: &Path) -> String {
        let (footfall, codes) = (env!("CARGO_BIN_EXE_footfall"), codes.display());
        let [out, rows, page] =
            ["knee.toml", "rows.csv", "knee.html"].map(|name| self.path(name).display().to_string());
        format!(
            "{footfall} calibrate --guide --codes {codes} --angles 0,20,40,60,40,20,0 --samples 200 --supply 3.3 \
             --name 'knee 3' --out {out} --keep-rows {rows} --report {page}"
        )
    }

    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

/// Brings the joint to an angle, looks until the live mean is there, and presses Enter.
fn pose(person: &mut Person, sensor: &Sensor, degrees: f64) {
    person.sees(&format!("{degrees} degrees: hold, then Enter"));
    sensor.at(degrees);
    // The mean of the last second, as it settles: 600 + 25 codes a degree, and one of noise.
    let code = 600.0 + 25.0 * degrees + 1.0;
    person.sees(&format!("mean {code:.1}, standard deviation 0.82, drift "));
    person.presses("\r");
    person.sees(&format!("{degrees} degrees: mean "));
}

fn calibrates(bench: &Bench, command: &str) {
    let mut person = Person::types(command);
    let sensor = Sensor::on(bench.pipe.clone());
    for degrees in [0.0, 20.0, 40.0, 60.0, 40.0, 20.0, 0.0] {
        pose(&mut person, &sensor, degrees);
    }
    let (code, screen) = person.ends();
    assert_eq!(code, Some(0), "{screen}");
    // Over a live line the cursor goes up and comes back; what is typed stays where it is.
    assert!(screen.matches("\u{1b}7\u{1b}[1A\r\u{1b}[Kcode ").count() >= 7, "{screen}");
    assert_eq!(bench.files(), ["codes", "knee.html", "knee.toml", "rows.csv"]);
    let text = std::fs::read_to_string(bench.path("knee.toml")).unwrap();
    let file = calibration_file::parse_whole(&TomlFile::of_text("knee.toml", text.clone())).unwrap();
    let measured = file.measured.unwrap();
    assert_eq!(measured.sensor, "knee 3");
    assert!(measured.rms_deg < 0.1 && measured.hysteresis.is_some_and(|h| h.largest < 0.2), "{text}");
    assert!(text.contains("crc = \"0x") && text.contains("date = \"20"), "{text}");
    for line in [
        "residual: 0.0",
        "hysteresis: 0.000 degrees at most",
        "monotone: volts rise with the angle, no poses joined",
        "saturation: none",
    ] {
        assert!(screen.contains(line), "{line}: {screen}");
    }
    assert_eq!(std::fs::read_to_string(bench.path("rows.csv")).unwrap().lines().count(), 1 + 7 * 200);
}

fn poses_are_taken_by_enter_while_the_codes_run_on_the_screen() {
    let bench = Bench::new();
    calibrates(&bench, &bench.command(&bench.pipe));
}

/// Codes by standard input: the answers are those of the terminal all the same.
fn codes_by_standard_input_leave_the_keys_to_the_terminal() {
    let bench = Bench::new();
    let command = format!("cat {} | {}", bench.pipe.display(), bench.command(Path::new("-")));
    calibrates(&bench, &command);
}

fn whoever_breaks_off_leaves_no_file() {
    let bench = Bench::new();
    let mut person = Person::types(&format!("exec {}", bench.command(&bench.pipe)));
    let sensor = Sensor::on(bench.pipe.clone());
    for degrees in [0.0, 20.0] {
        pose(&mut person, &sensor, degrees);
    }
    person.sees("40 degrees: hold");
    person.presses("\u{3}");
    let (code, screen) = person.ends();
    assert_eq!(code, Some(130), "{screen}");
    assert_eq!(bench.files(), ["codes"], "{screen}");
}

/// A pose that moves is asked for again, with why; a word that is none too; then the sensor falls silent.
fn an_unsteady_pose_and_a_silent_sensor_are_reported() {
    let bench = Bench::new();
    let mut person = Person::types(&bench.command(&bench.pipe));
    let sensor = Sensor::on(bench.pipe.clone());
    person.sees("0 degrees: hold");
    person.presses("yes\r");
    person.sees("allowed are Enter, an angle from -60 to 170 degrees, skip, end");
    person.sees("0 degrees: hold");
    sensor.at(0.0);
    person.sees("mean 601.0");
    person.presses("\r");
    // Within the 200 samples: long enough for it to have begun, not for it to have ended.
    std::thread::sleep(Duration::from_millis(60));
    sensor.at(10.0);
    person.sees("unsteady: allowed is a standard deviation of 8 codes; hold the angle again");
    person.sees("0 degrees: hold");
    drop(sensor);
    person.sees("the codes have ended");
    person.presses("\r");
    person.sees("the codes end, 0 of 200 were taken");
    let (code, screen) = person.ends();
    assert_eq!((code, bench.files()), (Some(2), vec!["codes".to_owned()]), "{screen}");
}
