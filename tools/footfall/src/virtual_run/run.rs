//! Runs an image on the virtual board until it ends, shows it, and reports the result.
//!
//! Screen, plain lines and JSON lines show the same [`View`].

use joint_loop::RobotConfig;
use joint_loop::setup::default_loop::Parameters;
use serde_json::Value;
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::prepare::{Prepared, about, arguments, prepare, tests_stop};
use super::settings::{PRESS_S, STOP_TEST_S, Settings, Show};
use super::tuned::Tuned;
use crate::board::lines::BoardLine;
use crate::board::process::{BoardProcess, Output};
use crate::board::run::{BoardRun, Event};
use crate::board::run_result::RunResult;
use crate::channel::clock::unix_ns;
use crate::failure::Failure;
use crate::file::capture::{Capture, counts_in_words};
use crate::messages;
use crate::options::sensors::joints;
use crate::output;
use crate::publish::Publisher;
use crate::view::keys::{Key, key};
use crate::view::plain;
use crate::view::screen;
use crate::view::state::View;

/// Time between two frames of the screen.
const FRAME: Duration = Duration::from_millis(33);

/// How long the board may take for its last line after it was asked to end.
const LAST_LINE: Duration = Duration::from_secs(10);

/// Exit code of the virtual board for wrong input, such as a script that it cannot read.
const WRONG_INPUT: i32 = 2;

/// What is done with the user button for the user, in words: nothing else arms a board.
fn holds(settings: &Settings, presses: &[f64]) -> String {
    let given = settings.board.iter().any(|option| option.to_string_lossy().starts_with("--press"));
    let more = if given { ", and as the options after `--` say" } else { "" };
    match presses {
        [] if given => "only as the options after `--` say".into(),
        [] => "not held; without a hold of it the board does not arm".into(),
        [first, later @ ..] => {
            let later: String = later.iter().map(|at| format!(", pressed at {at:.1} s")).collect();
            format!("held from {first} to {:.1} s, and its release arms the board{later}{more}", first + PRESS_S)
        }
    }
}

/// Runs the image. `interrupt` is set by a signal that asks the run to end.
///
/// # Errors
/// Wrong input, a board that cannot be started or reached, a file that cannot be written, or a run that was not sound.
pub fn run(settings: &Settings, interrupt: &AtomicBool) -> Result<(), Failure> {
    let prepared = prepare(settings)?;
    output::notes(&prepared.notes);
    if settings.robot_file.is_none() {
        messages::status("robot: the record of the default robot is written to the board; --robot writes another");
    }
    let [at, _] = STOP_TEST_S;
    messages::status(format_args!(
        "emergency stop: {}; without this test after each boot a board does not arm",
        if tests_stop(settings) {
            format!("pressed and released at {at} s")
        } else {
            format!("only as the options after `--` say, which replace its press and release at {at} s")
        }
    ));
    messages::status(format_args!("button: {}", holds(settings, &prepared.presses)));
    if let Some(path) = &settings.generator {
        messages::status(format_args!("walks: {}", walks(path, &settings.parameters.robot)?));
    }
    let arguments = arguments(settings, &prepared)?;
    let Parameters { sensors, robot, .. } = &settings.parameters;
    let publisher = Publisher::open(&settings.receivers, joints(sensors), robot)?;
    let mut board = BoardProcess::start(&settings.virtual_board, &arguments.all).map_err(Failure::input)?;
    let mut run = Run::new(settings, &prepared, publisher);
    let shown = match settings.show {
        Show::Screen => on_screen(&mut run, &mut board, interrupt, tests_stop(settings)),
        Show::Plain | Show::Json => in_lines(&mut run, &mut board, interrupt, settings.show),
    };
    // Even after an error the capture is finished, and the board has ended.
    run.finish(&mut board)?;
    shown?;
    run.report(settings.show)
}

/// Whether the generator of a file walks on the robot, in words.
#[cfg(feature = "analysis")]
fn walks(path: &Path, robot: &RobotConfig) -> Result<String, Failure> {
    use generator_file::{drive, file::GeneratorFile};
    let set = GeneratorFile::read(path).map_err(Failure::input)?.set;
    let drive = drive::walks(&set, &joint_loop::LoopConfig::of(robot)).map_err(Failure::input)?;
    Ok(drive.in_words())
}

#[cfg(not(feature = "analysis"))]
fn walks(path: &Path, _robot: &RobotConfig) -> Result<String, Failure> {
    Ok(format!(
        "not judged by this program, which is built without certificates; `cargo footfall certify {}` does",
        path.display()
    ))
}

/// A run in progress.
struct Run<'t> {
    board_run: BoardRun<'t>,
    view: View,
    publisher: Publisher,
    /// The capture, from the board's first line on: where the board refuses its input, nothing was written.
    capture: Option<Capture>,
    settings: &'t Settings,
    prepared: &'t Prepared,
    /// The serial port, if keys of the screen change the board.
    tuned: Option<Tuned>,
    result: Option<RunResult>,
    /// The error that ended the run early.
    error: Option<Failure>,
    /// What the virtual board's program wrote to its standard error.
    messages: Vec<String>,
    /// The exit code of the virtual board's program is 1, though its last line came.
    failed: bool,
}

impl<'t> Run<'t> {
    fn new(settings: &'t Settings, prepared: &'t Prepared, publisher: Publisher) -> Self {
        let parameters = &settings.parameters;
        let mut view = View::titled(format!("footfall watch: {}", prepared.feed.title), joints(&parameters.sensors));
        view.pulse_limits_us = Some(parameters.robot.servos.map(|servo| [servo.shortest.0, servo.longest.0]));
        let board_run = BoardRun::new(&prepared.image, parameters.clone());
        let tuned = settings.tune.then(Tuned::default);
        Self {
            board_run,
            view,
            publisher,
            capture: None,
            settings,
            prepared,
            tuned,
            result: None,
            error: None,
            messages: vec![],
            failed: false,
        }
    }

    /// Writes a line of the board to the capture, if there is one.
    fn record(&mut self, line: &BoardLine) -> Result<(), Failure> {
        let Settings { record: Some(path), parameters, zero_ns, .. } = self.settings else { return Ok(()) };
        let capture = match &mut self.capture {
            Some(capture) => capture,
            none => {
                // The board powers on now.
                let zero_ns = zero_ns.unwrap_or_else(unix_ns);
                let about = about(self.settings, self.prepared);
                let begun = Capture::begin(path, about, None, parameters.clone(), Some(zero_ns));
                none.insert(begun.map_err(|error| output::cannot_write(path, error))?)
            }
        };
        capture.board_line(line).map_err(|error| Failure::run(format!("the capture: {error}")))
    }

    /// Takes one output of the board; returns the events, or `None` after the last output.
    fn take(&mut self, output: Output) -> Option<Vec<Event>> {
        let events = match output {
            Output::Line(line) => {
                let recorded = self.record(&line);
                match self.board_run.take(line) {
                    Ok(events) => {
                        self.error = self.error.take().or(recorded.err());
                        events
                    }
                    Err(error) => {
                        self.error = Some(Failure::run(error));
                        return None;
                    }
                }
            }
            Output::Malformed(error) => {
                self.error = Some(Failure::run(error));
                return None;
            }
            Output::Message(text) => {
                self.messages.push(text.clone());
                vec![Event::Remark { kind: "message".into(), text }]
            }
            Output::Closed => return None,
        };
        for event in &events {
            self.account(event);
        }
        Some(events)
    }

    fn account(&mut self, event: &Event) {
        self.view.take(event, self.board_run.counters());
        self.publisher.event(event);
        if let Some(tuned) = &mut self.tuned {
            tuned.account(event, &mut self.view);
        }
        if let Event::Ended(end) = event {
            self.result = Some(RunResult::new(Some(end), self.board_run.counters(), "", Value::Null));
        }
    }

    fn finish(&mut self, board: &mut BoardProcess) -> Result<(), Failure> {
        for event in self.board_run.finish() {
            self.account(&event);
        }
        self.publisher.finish();
        let complete = self.result.is_some();
        let mut result =
            self.result.take().unwrap_or_else(|| RunResult::new(None, self.board_run.counters(), "", Value::Null));
        result.elf_sha256.clone_from(&self.prepared.image.sha256);
        result.trace.clone_from(&self.prepared.feed.about);
        if let (Some(capture), Some(path)) = (self.capture.take(), &self.settings.record) {
            let value = serde_json::to_value(&result).map_err(Failure::run)?;
            let counts = capture.finish(&value).map_err(|error| output::cannot_write(path, error))?;
            messages::status(counts_in_words(path, &counts));
            messages::next(
                "fit a generator to it",
                format!("footfall fit {} -o generator.toml", gait_trace::shell_word(path)),
            );
        }
        self.result = Some(result);
        let (status, messages) = board.wait().map_err(Failure::run)?;
        self.messages.extend(messages);
        self.failed = status.code() == Some(1);
        if status.code() == Some(WRONG_INPUT) && self.error.is_none() {
            self.error = Some(Failure::input(self.words_of_board("the virtual board refused its input")));
        } else if !complete && self.error.is_none() {
            let words = format!("the virtual board ended without its last line ({status}); {}", self.last_log_line());
            self.error = Some(Failure::run(self.words_of_board(&words)));
        }
        Ok(())
    }

    /// These words, and what the virtual board's program wrote to its standard error.
    fn words_of_board(&self, words: &str) -> String {
        if self.messages.is_empty() { words.into() } else { format!("{words}: {}", self.messages.join("\n")) }
    }

    /// The last log line, which often has the reason of the end.
    fn last_log_line(&self) -> String {
        self.view.log.back().map_or("its log is empty".into(), |line| format!("its last log line is: {line}"))
    }

    fn report(mut self, show: Show) -> Result<(), Failure> {
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        let Some(result) = &self.result else { return Ok(()) };
        let text = match show {
            Show::Json => serde_json::to_string(result).map_err(Failure::run)? + "\n",
            Show::Plain | Show::Screen => plain::result(result),
        };
        // A closed pipe is no error here.
        let _ = io::stdout().write_all(text.as_bytes()).and_then(|()| io::stdout().flush());
        let mut faults = result.faults();
        if self.failed && faults.is_empty() {
            faults.push(self.words_of_board("the virtual board ended with exit code 1"));
        }
        if faults.is_empty() {
            Ok(())
        } else {
            Err(Failure::run(format!("the run was not sound: {}", faults.join("; "))))
        }
    }
}

/// The request to end the run.
struct Ending<'a> {
    interrupt: &'a AtomicBool,
    /// Set by a key or a closed pipe.
    requested: bool,
    asked: Option<Instant>,
}

impl<'a> Ending<'a> {
    fn new(interrupt: &'a AtomicBool) -> Self {
        Self { interrupt, requested: false, asked: None }
    }

    /// Asks the board to end once requested; true when the time limit for its end is over.
    fn end_if_requested(&mut self, board: &mut BoardProcess) -> bool {
        match self.asked {
            None if self.requested || self.interrupt.load(Ordering::Relaxed) => {
                board.quit();
                self.asked = Some(Instant::now());
                false
            }
            None => false,
            Some(asked) => asked.elapsed() > LAST_LINE,
        }
    }
}

fn in_lines(run: &mut Run<'_>, board: &mut BoardProcess, interrupt: &AtomicBool, show: Show) -> Result<(), Failure> {
    let mut ending = Ending::new(interrupt);
    while run.error.is_none() && !ending.end_if_requested(board) {
        let Some(output) = board.next(Duration::from_millis(50)) else { continue };
        let Some(events) = run.take(output) else { break };
        for event in &events {
            match print_event(event, &run.view, show) {
                Ok(()) => {}
                // A closed pipe ends the run like Ctrl-C.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => ending.requested = true,
                Err(error) => return Err(Failure::run(error)),
            }
        }
    }
    Ok(())
}

/// Prints an event. Data go to standard output; in plain text, messages go to standard error.
fn print_event(event: &Event, view: &View, show: Show) -> io::Result<()> {
    let status = matches!(event, Event::Status { .. });
    let mut out = io::stdout().lock();
    match show {
        Show::Json => {
            let object = if status { Some(plain::object(view)) } else { plain::event_object(event) };
            let Some(object) = object else { return Ok(()) };
            writeln!(out, "{}", messages::escaped(&object.to_string()))?;
        }
        Show::Plain | Show::Screen => {
            if let Some(line) = plain::event_line(event) {
                messages::status(line);
            }
            if !status {
                return Ok(());
            }
            writeln!(out, "{}", plain::line(view))?;
        }
    }
    out.flush()
}

fn on_screen(
    run: &mut Run<'_>,
    board: &mut BoardProcess,
    interrupt: &AtomicBool,
    script_tests_stop: bool,
) -> Result<(), Failure> {
    let mut terminal =
        ratatui::try_init().map_err(|error| Failure::run(format!("the screen cannot be opened: {error}")))?;
    let mut ending = Ending::new(interrupt);
    let mut drawn = Instant::now();
    let mut tested = u32::from(script_tests_stop);
    let shown = loop {
        if run.error.is_some() || ending.end_if_requested(board) {
            break Ok(());
        }
        if let Some(output) = board.next(FRAME / 4)
            && run.take(output).is_none()
        {
            break Ok(());
        }
        if drawn.elapsed() < FRAME {
            continue;
        }
        drawn = Instant::now();
        if let Some(tuned) = &mut run.tuned {
            tuned.receive(&mut run.view);
        }
        let key = match terminal.draw(|frame| screen::draw(frame, &run.view)).and_then(|_| key()) {
            Ok(key) => key,
            Err(error) => break Err(Failure::run(error)),
        };
        match key {
            Some(Key::Button) => {
                // The script has tested the stop of the first boot.
                if run.view.boots > tested {
                    tested = run.view.boots;
                    board.test_emergency_stop();
                }
                board.hold_button();
            }
            Some(Key::End) => ending.requested = true,
            Some(Key::Tune(key)) => {
                if let Some(tuned) = &mut run.tuned {
                    tuned.press(key, &mut run.view);
                }
            }
            None => {}
        }
    };
    let restored = ratatui::try_restore().map_err(Failure::run);
    shown.and(restored)
}
