//! The flashed image on the virtual board.
//!
//! `FOOTFALL_ELF` and `FOOTFALL_VIRTUAL_BOARD` name the two; `cargo xtask test` sets them. A test that uses them names
//! [`test_suite::Need::Image`], [`test_suite::Need::ShadowImage`], [`test_suite::Need::NoSensorImage`] or [`test_suite::Need::BlackPillImage`].

use crate::gestures;
use crate::lockstep::Conversation;
use firmware::board::ROBOT_SECTOR;
use footfall::board::counters::Counters;
use footfall::board::host_copy::begin;
use footfall::board::image::{Image, Message};
use footfall::board::lines;
use footfall::board::lines::{BoardLine, End, RECORDS};
use footfall::board::run::BoardRun;
use footfall::board::transport::{Heard, Transport};
use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop};
use joint_loop::store::robot_record;
use joint_loop::{Frame, GeneratorConfig, RecordName, RobotConfig, SENSORS};
use joint_units::{AdcCode, Volts};
use serde_json::Value;
use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex};
use wire::{Boot, Call, Change, Conditions, Cost, Edge, Environment, Record, Refused};

/// Image and virtual board.
#[derive(Debug)]
pub struct Board {
    elf: PathBuf,
    program: PathBuf,
    image: Image,
}

/// A run: what the board wrote, and what it comes to.
#[derive(Debug)]
pub struct Ran {
    /// Standard output, as it came.
    pub output: String,
    /// The exit code.
    pub code: Option<i32>,
    /// Boots in order.
    pub boots: Vec<Booted>,
    /// Pulses of each servo period: time of the first rising edge, widths in microseconds.
    pub pulses: Vec<(f64, [Option<f64>; 4])>,
    /// Other lines, such as `injected` and `reaction`.
    pub remarks: Vec<Value>,
    /// Last line.
    pub end: End,
    /// The books of a [`BoardRun`] that was given the same lines.
    pub books: Counters,
}

/// What the board logged between two resets.
#[derive(Debug, Clone, Default)]
pub struct Booted {
    /// When, in virtual seconds.
    pub t_s: f64,
    /// Why.
    pub cause: String,
    /// The boot record.
    pub boot: Option<Boot>,
    /// Frames.
    pub ticks: Vec<wire::Frame>,
    /// When each of them was taken, in virtual seconds.
    pub tick_times: Vec<f64>,
    /// What every call of the loop was given, in order, each with its tick.
    pub calls: Vec<(u32, Call)>,
    /// Changes of state and cause.
    pub changes: Vec<Change>,
    /// Edges at the synchronisation input.
    pub edges: Vec<Edge>,
    /// Load and reserves, once a second.
    pub costs: Vec<Cost>,
    /// Temperature and supply, once a second.
    pub environment: Vec<Environment>,
    /// What was not as it should be, once a second.
    pub conditions: Vec<Conditions>,
    /// The settings in effect, once a second and after a change.
    pub settings: Vec<wire::Settings>,
    /// Lines for people.
    pub log: Vec<String>,
    /// Their time stamps, in seconds by the board's clock.
    pub log_times: Vec<f64>,
    /// What the board refused.
    pub refused: Vec<Refused>,
}

impl Booted {
    /// The board's loop with this generator, run again on the host: a frame for every call.
    ///
    /// # Panics
    /// The boot record is missing, or inputs were lost.
    #[must_use]
    pub fn replay(&self, generator: &GeneratorConfig) -> Vec<Frame<SENSORS>> {
        self.watch(generator, BoardLoop::frame)
    }

    /// The same, and what `see` makes of the loop after every call.
    ///
    /// # Panics
    /// As [`Booted::replay`].
    #[must_use]
    pub fn watch<T>(&self, generator: &GeneratorConfig, see: impl FnMut(&BoardLoop) -> T) -> Vec<T> {
        self.watch_as(&with_generator(generator), see)
    }

    /// The same of a board with these parameters.
    ///
    /// # Panics
    /// As [`Booted::replay`].
    #[must_use]
    pub fn watch_as<T>(&self, parameters: &Parameters, mut see: impl FnMut(&BoardLoop) -> T) -> Vec<T> {
        let boot = self.boot.as_ref().expect("a boot record");
        let mut joints =
            board_loop(parameters, AdcCode(boot.reference_cal), Volts(boot.min_supply_v), boot.sensor_required)
                .expect("the loop");
        begin(&mut joints, boot);
        let seen = self.calls.iter().map(|(tick, call)| {
            joints.tick(&call.sample());
            assert_eq!(joints.frame().tick, *tick, "inputs were lost");
            see(&joints)
        });
        seen.collect()
    }
}

impl Booted {
    /// Takes a record.
    pub(crate) fn take(&mut self, record: Record) {
        match record {
            Record::Boot(record) => self.boot = Some(record),
            Record::Refused(refused) => self.refused.push(refused),
            Record::Frame(frame) => self.ticks.push(frame),
            Record::Inputs(inputs) => self.calls.extend(inputs.ticks().map(|(tick, call)| (tick, call.clone()))),
            Record::Environment(environment) => self.environment.push(environment),
            Record::Conditions(conditions) => self.conditions.push(conditions),
            Record::Edge(edge) => self.edges.push(edge),
            Record::Cost(cost) => self.costs.push(cost),
            Record::Settings(settings) => self.settings.push(settings),
            Record::Change(change) => self.changes.push(change),
            Record::Answered(_) | Record::Port(_) => {}
        }
    }

    /// Takes a line for people.
    pub(crate) fn read(&mut self, message: Message) {
        self.log_times.push(message.stamp_s.expect("every message has a time stamp"));
        self.log.push(message.text);
    }
}

impl Ran {
    /// Checks what is the same in every run without a fault: one boot, nothing irregular, and every line the host's to the bit.
    ///
    /// # Panics
    /// It is not.
    pub fn assert_sound(&self) {
        assert_eq!((self.code, self.end.unmodelled, self.end.lints.len(), self.boots.len()), (Some(0), 0, 0, 1));
        let books = &self.books;
        assert_eq!((books.different, books.not_compared, books.lost_lines), (0, 0, 0), "{:?}", books.differences);
        let last = self.boots[0].ticks.last().expect("frames");
        assert_eq!((last.missed, last.late), (0, 0));
    }
}

/// The user button of a board that runs, and its other commands.
#[derive(Debug, Clone)]
pub struct Button(Arc<Mutex<ChildStdin>>);

impl Button {
    /// Holds it for half a virtual second: its release arms, or begins a trim.
    ///
    /// # Panics
    /// The board has ended.
    pub fn hold(&self) {
        self.command("hold");
    }

    fn command(&self, command: &str) {
        writeln!(self.0.lock().expect("no thread has failed"), "{command}").expect("the board takes commands");
    }
}

impl Board {
    /// The board with the image that drives the servos.
    ///
    /// # Panics
    /// The environment does not name the two, or the file is no image.
    #[must_use]
    pub fn find() -> Self {
        Self::with("FOOTFALL_ELF")
    }

    /// The board with the image that drives nothing.
    ///
    /// # Panics
    /// As [`Board::find`].
    #[must_use]
    pub fn shadow() -> Self {
        Self::with("FOOTFALL_SHADOW_ELF")
    }

    /// The board with the image of the features `no-sensor` and `no-debugger`.
    ///
    /// # Panics
    /// As [`Board::find`].
    #[must_use]
    pub fn no_sensor() -> Self {
        Self::with("FOOTFALL_NO_SENSOR_ELF")
    }

    /// The Black Pill with its image.
    ///
    /// # Panics
    /// As [`Board::find`].
    #[must_use]
    pub fn black_pill() -> Self {
        Self::with("FOOTFALL_BLACK_PILL_ELF")
    }

    /// The image in another file.
    ///
    /// # Panics
    /// As [`Board::find`].
    #[must_use]
    pub fn of(elf: PathBuf) -> Self {
        let program = PathBuf::from(std::env::var_os("FOOTFALL_VIRTUAL_BOARD").expect("FOOTFALL_VIRTUAL_BOARD"));
        let image = Image::read(&elf).unwrap_or_else(|error| panic!("{error}"));
        Self { elf, program, image }
    }

    fn with(image: &str) -> Self {
        Self::of(PathBuf::from(std::env::var_os(image).expect(image)))
    }

    /// Runs the image with these options of the virtual board.
    ///
    /// # Panics
    /// The board cannot be started, or writes what cannot be read.
    #[must_use]
    pub fn run<A: AsRef<OsStr>>(&self, options: impl IntoIterator<Item = A>) -> Ran {
        self.run_with(&GeneratorConfig::default_walk(), options)
    }

    /// The same on a board whose parameter sector was given this generator by one of the options.
    ///
    /// # Panics
    /// As [`Board::run`].
    #[must_use]
    pub fn run_with<A: AsRef<OsStr>>(&self, generator: &GeneratorConfig, options: impl IntoIterator<Item = A>) -> Ran {
        self.run_as(&with_generator(generator), options)
    }

    /// The same on a board whose parameter sectors were given these by some of the options.
    ///
    /// # Panics
    /// As [`Board::run`].
    #[must_use]
    pub fn run_as<A: AsRef<OsStr>>(&self, parameters: &Parameters, options: impl IntoIterator<Item = A>) -> Ran {
        self.run_beside(parameters, options, |child| {
            let output = child.wait_with_output().expect("the board ends");
            (String::from_utf8(output.stdout).expect("JSON is text"), output.status.code())
        })
    }

    /// Runs the image with its serial port, and beside it a host that is given the name of the port and the board's button. The board ends when
    /// the host does.
    ///
    /// # Panics
    /// As [`Board::run`], or the host panics.
    #[must_use]
    pub fn run_with_host<A: AsRef<OsStr>>(
        &self,
        options: impl IntoIterator<Item = A>,
        host: impl FnOnce(PathBuf, Button) + Send,
    ) -> Ran {
        self.run_with_line(options, &["--serial"], "serial", |line, button| {
            host(PathBuf::from(line["port"].as_str().expect("a name")), button);
        })
    }

    /// The same with a server of RTT channel 1, as a debug probe's program has it, in place of the port: the host is given its source, `tcp:HOST:PORT`.
    ///
    /// # Panics
    /// As [`Board::run_with_host`].
    #[must_use]
    pub fn run_with_probe<A: AsRef<OsStr>>(
        &self,
        options: impl IntoIterator<Item = A>,
        host: impl FnOnce(String, Button) + Send,
    ) -> Ran {
        self.run_with_line(options, &["--rtt-server", "127.0.0.1:0"], "rtt_server", |line, button| {
            host(format!("tcp:{}", line["address"].as_str().expect("an address")), button);
        })
    }

    fn run_with_line<A: AsRef<OsStr>>(
        &self,
        options: impl IntoIterator<Item = A>,
        more: &[&str],
        kind: &str,
        host: impl FnOnce(Value, Button) + Send,
    ) -> Ran {
        let options = options.into_iter().map(|option| option.as_ref().to_owned()).chain(more.iter().map(Into::into));
        self.run_beside(&with_generator(&GeneratorConfig::default_walk()), options.collect::<Vec<_>>(), |mut child| {
            let (console, output) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
            let console = Button(Arc::new(Mutex::new(console)));
            let mut lines = BufReader::new(output);
            let mut text = String::new();
            let named = format!("\"type\":\"{kind}\"");
            while !text.contains(&named) {
                assert!(lines.read_line(&mut text).expect("JSON is text") > 0, "the board names its port");
            }
            let line: Value = serde_json::from_str(text.lines().last().expect("a line")).expect("an object");
            std::thread::scope(|scope| {
                let button = console.clone();
                let host = scope.spawn(move || host(line, button));
                let waiting = scope.spawn(move || {
                    let ended = host.join();
                    console.command("quit");
                    ended
                });
                lines.read_to_string(&mut text).expect("JSON is text");
                if let Err(panic) = waiting.join().expect("it waits") {
                    std::panic::resume_unwind(panic);
                }
            });
            (text, child.wait().expect("the board ends").code())
        })
    }

    /// Runs the image step by step, as `talk` asks. The board ends when `talk` does, unless `talk` has ended the conversation.
    ///
    /// # Panics
    /// As [`Board::run`], or `talk` panics.
    #[must_use]
    pub fn converse<A: AsRef<OsStr>>(
        &self,
        options: impl IntoIterator<Item = A>,
        talk: impl FnOnce(&mut Conversation),
    ) -> Ran {
        let options = options.into_iter().map(|option| option.as_ref().to_owned()).chain(["--lockstep".into()]);
        self.run_beside(&with_generator(&GeneratorConfig::default_walk()), options.collect::<Vec<_>>(), |mut child| {
            let mut conversation =
                Conversation::new(child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
            talk(&mut conversation);
            (conversation.finish(), child.wait().expect("the board ends").code())
        })
    }

    fn run_beside<A: AsRef<OsStr>>(
        &self,
        parameters: &Parameters,
        options: impl IntoIterator<Item = A>,
        wait: impl FnOnce(Child) -> (String, Option<i32>),
    ) -> Ran {
        // A board without a robot record warns of the built-in one: each one gets its own, unless an option fills that sector.
        let options: Vec<OsString> = options.into_iter().map(|option| option.as_ref().to_owned()).collect();
        let sector = format!("{ROBOT_SECTOR:#010x}=");
        let record = tempfile::NamedTempFile::new().expect("a file");
        let robot = robot_record::record_of(&parameters.robot, &RecordName::BUILT_IN);
        std::fs::write(record.path(), robot.bytes()).expect("written");
        let is_filled = options.iter().any(|option| option.to_string_lossy().starts_with(&sector));
        // A board does not arm before its emergency stop was tested.
        let has_stop = options.iter().any(|option| {
            let option = option.to_string_lossy();
            // A program that steps the board presses it itself.
            option.starts_with("--emergency-stop") || option.contains("PB12") || option == "--lockstep"
        });
        let violates = options.iter().any(|option| option == "--violates");
        let stop = ["--emergency-stop", gestures::STOP_TEST];
        let download = ["--flash".into(), OsString::from(format!("{sector}{}", record.path().display()))];
        let child = Command::new(&self.program)
            .arg(&self.elf)
            .args(options)
            .args(download.iter().filter(|_| !is_filled))
            .args(stop.iter().filter(|_| !has_stop))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .unwrap_or_else(|error| panic!("{}: {error}", self.program.display()));
        let (text, code) = wait(child);
        self.read(parameters, text, code, violates)
    }

    fn read(&self, parameters: &Parameters, output: String, code: Option<i32>, violates: bool) -> Ran {
        let mut session = BoardRun::new(&self.image, parameters.clone());
        let (mut decoder, mut transport) = (self.image.decoder(), Transport::default());
        let (mut boots, mut pulses, mut remarks, mut end) = (Vec::<Booted>::new(), vec![], vec![], None);
        for text in output.lines() {
            let line = lines::parse(text).unwrap_or_else(|error| panic!("{error}"));
            session.take(line.clone()).unwrap_or_else(|error| panic!("{error}"));
            match line {
                BoardLine::Boot { t_s, cause } => {
                    decoder.restart();
                    transport.restart();
                    boots.push(Booted { t_s, cause, ..Booted::default() });
                }
                BoardLine::Rtt { t_s, channel: RECORDS, bytes } => {
                    let boot = boots.last_mut().expect("records come after a boot");
                    let pushed = transport.push(&bytes, |heard| match heard {
                        Heard::Record(record) => boot.take(record),
                        Heard::Damaged => panic!("a damaged frame at {t_s} s"),
                    });
                    pushed.unwrap_or_else(|error| panic!("{error}"));
                    boot.tick_times.resize(boot.ticks.len(), t_s);
                }
                BoardLine::Rtt { bytes, .. } => {
                    decoder.push(&bytes);
                    let boot = boots.last_mut().expect("a log comes after a boot");
                    while let Some(message) = decoder.message() {
                        boot.read(message.expect("whole frames"));
                    }
                }
                BoardLine::Pulses { t_s, us } => pulses.push((t_s, us)),
                BoardLine::Remark { text, .. } => remarks.push(serde_json::from_str(&text).expect("an object")),
                BoardLine::End(last) => end = Some(*last),
                BoardLine::Start { .. } | BoardLine::Status { .. } => {}
            }
        }
        let end = end.unwrap_or_else(|| panic!("no last line, exit code {code:?}"));
        // Here, so that no test can leave it out. A run with `--violates REASON` is meant to have violations.
        assert_eq!(end.judged.violations > 0, violates, "pulses that no servo may get: {:#?}", end.judged.first);
        assert!(
            end.judged.trimmed.is_empty(),
            "outside the range of its joint, as in a trim: {:?}",
            end.judged.trimmed
        );
        Ran { boots, pulses, remarks, end, books: session.counters().clone(), code, output }
    }
}

/// A board with this generator, and the default sensors.
fn with_generator(generator: &GeneratorConfig) -> Parameters {
    Parameters::with_defaults(Some(*generator), None, RobotConfig::default_biped()).expect("the defaults are valid")
}
