//! `footfall watch`: the flashed image on the virtual board, fed with a recorded gait, watched live, recorded and replayed.
//!
//! Everything that can be refused is refused before anything is started or written. The screen, the plain lines and the JSON
//! lines are three ways to show the same [`View`].

use crate::board::feed;
use crate::board::feed::Feed;
use crate::board::image::Image;
use crate::board::process::{BoardProcess, Output};
use crate::board::session::{Event, Session};
use crate::command::record;
use crate::failure::Failure;
use crate::file::capture::{Capture, Format, about_sensors};
use crate::file::sensors::{SensorArgument, joints};
use crate::view::plain;
use crate::view::screen;
use crate::view::state::View;
use crate::view::summary::Summary;
use clap::Args;
use gait_trace::format::csv_file;
use generator_file::file::GeneratorFile;
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, sensor_record};
use ratatui::crossterm::event::{self, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// When `--press auto` presses the button, in virtual seconds.
pub const ARM_AT_S: f64 = 0.3;

/// How long before the end `--disarm` presses it: the stop takes 1 s, and half a second shows that nothing moves after it.
pub const DISARM_BEFORE_END_S: f64 = 1.7;

/// Virtual seconds of a run without a terminal, where nobody says how many.
pub const DEFAULT_SECS: f64 = 10.0;

/// How long a press by the space bar lasts, in virtual seconds.
const PRESS_S: f64 = 0.1;

/// Pictures a second.
const FRAME: Duration = Duration::from_millis(33);

/// How long a board that was asked to end may take for its last line.
const LAST_LINE: Duration = Duration::from_secs(10);

/// Options of `footfall watch`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The firmware's ELF file: the one that would be flashed
    #[arg(long, value_name = "FILE")]
    pub elf: PathBuf,
    /// The virtual board's program
    #[arg(long, value_name = "PROGRAM")]
    pub virtual_board: PathBuf,
    /// Record every tick: a name that ends in .csv or .mcap; what belongs to the whole run goes to FILE.json
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// What is played, and how it is shown
    #[command(flatten)]
    pub played: Played,
}

/// What is played on the virtual board, and how it is shown.
#[derive(Debug, Clone, Args)]
pub struct Played {
    /// A recording to feed the sensors with: angles in degrees (of the joints that they are worn on, or its only channel) or volts at
    /// their pins (PA1, PC1, PB0, PB1) [default: the shipped recording of a healthy adult]
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// A sensor that is worn, from channel 1 on, up to four: its joint, and its calibration, which `footfall calibrate` makes. They are
    /// written into the board's second parameter sector [default: one, with the published curve, on the joint that the walker follows or
    /// on left_knee]
    #[arg(long, value_name = "JOINT[=TOML]")]
    pub sensor: Vec<SensorArgument>,
    /// Walk with a walker's parameters: they are written into the board's parameter sector [default: the built-in walk]
    #[arg(long, value_name = "TOML")]
    pub params: Option<PathBuf>,
    /// Virtual seconds to run [default: until q or Ctrl-C on a terminal, else 10]
    #[arg(long, value_name = "N", value_parser = seconds)]
    pub secs: Option<f64>,
    /// Print one JSON object a line; the last one is the whole run
    #[arg(long)]
    pub json: bool,
    /// Print plain lines even on a terminal
    #[arg(long, conflicts_with = "json")]
    pub plain: bool,
    /// When to press the user button: `auto` (0.3 s), `none`, or times in virtual seconds such as 0.5,4
    #[arg(long, value_name = "WHEN", default_value = "auto")]
    pub press: Press,
    /// Press it again before the end, early enough to come to rest (needs --secs)
    #[arg(long, requires = "secs")]
    pub disarm: bool,
    /// Hold real time, as on a terminal
    #[arg(long)]
    pub pace: bool,
    /// Further options for the virtual board, as in `-- --hang control_step@3`
    #[arg(last = true, value_name = "OPTION")]
    pub board: Vec<OsString>,
}

/// When the user button is pressed.
#[derive(Debug, Clone, PartialEq)]
pub enum Press {
    /// At [`ARM_AT_S`].
    Auto,
    /// At these times, in virtual seconds; perhaps never.
    At(Vec<f64>),
}

impl FromStr for Press {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "none" => Ok(Self::At(vec![])),
            times => {
                let time = |text: &str| text.trim().parse().ok().filter(|t: &f64| t.is_finite() && *t >= 0.0);
                let wanted = || format!("`{times}`: allowed are `auto`, `none`, and times in seconds such as 0.5,4");
                times.split(',').map(time).collect::<Option<_>>().map(Self::At).ok_or_else(wanted)
            }
        }
    }
}

impl Played {
    /// What the board's two parameter sectors hold, or what is built in where nothing is said.
    ///
    /// # Errors
    /// A file is not as it must be, or the sensors do not go together.
    pub(crate) fn parameters(&self) -> Result<Parameters, Failure> {
        let walker = match &self.params {
            Some(path) => Some(GeneratorFile::read(path).map_err(Failure::input)?.set.config()),
            None => None,
        };
        let worn = if self.sensor.is_empty() { None } else { Some(SensorArgument::read_all(&self.sensor)?) };
        let parameters = Parameters::with_defaults(walker, worn).map_err(Failure::run)?;
        match parameters.generator.follows() {
            Some(joint) if parameters.sensors.channel_of(joint).is_none() => {
                let joint = joint.name();
                Err(Failure::input(format!("the walker follows {joint}, and no --sensor is worn on it")))
            }
            _ => Ok(parameters),
        }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(secs) if (0.1..=86_400.0).contains(&secs) => Ok(secs),
        _ => Err("allowed is a number of seconds from 0.1 to 86400".into()),
    }
}

/// How the run is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Show {
    Screen,
    Plain,
    Json,
}

/// Everything that was read and found good.
struct Prepared {
    image: Image,
    feed: Feed,
    parameters: Parameters,
    secs: Option<f64>,
    presses: Vec<f64>,
    notes: Vec<String>,
}

/// Runs the command. `interrupt` is set by a signal that asks it to end.
///
/// # Errors
/// Bad input, a board that cannot be started or talked to, a file that cannot be written, or a run that was not sound.
pub fn run(options: &Options, interrupt: &Arc<AtomicBool>) -> Result<(), Failure> {
    let show =
        match (options.played.json, options.played.plain, io::stdout().is_terminal() && io::stdin().is_terminal()) {
            (true, ..) => Show::Json,
            (false, false, true) => Show::Screen,
            (false, ..) => Show::Plain,
        };
    let prepared = prepare(options, show)?;
    for note in &prepared.notes {
        eprintln!("note: {note}");
    }
    let volts = volts_file(&prepared.feed)?;
    let sectors = sectors(&options.played, &prepared.parameters)?;
    let arguments = arguments(options, &prepared, volts.path(), &sectors, show);
    let mut board = BoardProcess::start(&options.virtual_board, &arguments).map_err(Failure::input)?;
    let capture = match &options.record {
        Some(path) => {
            let about = about(options, &prepared)?;
            let begun = Capture::begin(path, about, &prepared.image, prepared.parameters.clone());
            Some(begun.map_err(|error| writing(path, error))?)
        }
        None => None,
    };
    let title = format!("footfall watch: {}", prepared.feed.title);
    let view = View::titled(title, joints(&prepared.parameters.sensors));
    let session = Session::new(&prepared.image, prepared.parameters.clone());
    let mut run = Run { session, view, capture, summary: None, trouble: None };
    let quitting = match show {
        Show::Screen => on_screen(&mut run, &mut board, interrupt),
        Show::Plain | Show::Json => in_lines(&mut run, &mut board, interrupt, show),
    };
    // Whatever happened: the recording is finished, and the board has ended.
    run.finish(options, &prepared, &mut board)?;
    quitting?;
    run.verdict(show)
}

fn prepare(options: &Options, show: Show) -> Result<Prepared, Failure> {
    let image = Image::read(&options.elf).map_err(Failure::input)?;
    let mut notes = Vec::new();
    let parameters = options.played.parameters()?;
    let secs = options.played.secs.or((show != Show::Screen).then_some(DEFAULT_SECS));
    let (name, recording) = match &options.played.trace {
        Some(path) => {
            let opened = feed::opened(path)?;
            notes.extend(opened.notes);
            (opened.name, opened.recording)
        }
        None => feed::default_trace().map_err(Failure::input)?,
    };
    let feed = feed::feed(&name, &recording, &parameters.sensors, secs)?;
    let mut presses = match &options.played.press {
        Press::Auto => vec![ARM_AT_S],
        Press::At(times) => times.clone(),
    };
    if options.played.disarm {
        let at = secs.unwrap_or(DEFAULT_SECS) - DISARM_BEFORE_END_S;
        let last = presses.iter().copied().fold(0.0, f64::max);
        if at < last + 2.0 * PRESS_S {
            let least = last + 2.0 * PRESS_S + DISARM_BEFORE_END_S;
            return Err(Failure::input(format!("--disarm: allowed with --secs of {least:.1} or more here")));
        }
        presses.push(at);
    }
    if let Some(path) = &options.record {
        output_file(path)?;
    }
    notes.extend(feed.notes.iter().cloned());
    Ok(Prepared { image, feed, parameters, secs, presses, notes })
}

/// Refuses a name that no recording can have.
pub(crate) fn output_file(path: &Path) -> Result<(), Failure> {
    if path.is_dir() {
        return Err(Failure::input(format!("{}: is a folder; allowed is the name of a file", path.display())));
    }
    Format::of(path).map(|_| ()).map_err(Failure::input)
}

fn volts_file(feed: &Feed) -> Result<tempfile::NamedTempFile, Failure> {
    let mut file = tempfile::Builder::new().prefix("footfall-").suffix(".csv").tempfile().map_err(Failure::run)?;
    let mut out = io::BufWriter::new(&mut file);
    csv_file::write_to(&mut out, &feed.volts).and_then(|()| out.flush()).map_err(Failure::run)?;
    drop(out);
    Ok(file)
}

/// Bytes for the board's flash.
struct Sector {
    address: u32,
    file: tempfile::NamedTempFile,
}

/// What the parameter sectors are to hold; those of which nothing is said stay erased.
fn sectors(played: &Played, parameters: &Parameters) -> Result<Vec<Sector>, Failure> {
    let walker = generator_record::record_of(&parameters.generator);
    let worn = sensor_record::record_of(&parameters.sensors);
    let said = [
        (played.params.is_some(), generator_record::ADDRESS, walker.bytes()),
        (!played.sensor.is_empty(), sensor_record::ADDRESS, worn.bytes()),
    ];
    let mut sectors = Vec::new();
    for (_, address, bytes) in said.into_iter().filter(|(said, ..)| *said) {
        let mut file = tempfile::Builder::new().prefix("footfall-").suffix(".bin").tempfile().map_err(Failure::run)?;
        file.write_all(bytes).and_then(|()| file.flush()).map_err(Failure::run)?;
        sectors.push(Sector { address, file });
    }
    Ok(sectors)
}

fn arguments(options: &Options, prepared: &Prepared, volts: &Path, sectors: &[Sector], show: Show) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec![options.elf.clone().into(), "--volts".into(), volts.into()];
    if prepared.feed.repeat {
        arguments.push("--loop".into());
    }
    for Sector { address, file } in sectors {
        let mut download = OsString::from(format!("{address:#010x}="));
        download.push(file.path());
        arguments.extend(["--flash".into(), download]);
    }
    if let Some(secs) = prepared.secs {
        arguments.extend(["--secs".into(), secs.to_string().into()]);
    }
    for press in &prepared.presses {
        arguments.extend(["--press".into(), format!("{press}:{PRESS_S}").into()]);
    }
    if options.played.pace || show == Show::Screen {
        arguments.push("--pace".into());
    }
    arguments.extend(options.played.board.iter().cloned());
    arguments
}

/// What runs, for the file beside a recording.
fn about(options: &Options, prepared: &Prepared) -> Result<Value, Failure> {
    let Parameters { generator, sensors } = &prepared.parameters;
    Ok(json!({
        "elf": options.elf,
        "elf_sha256": prepared.image.sha256,
        "virtual_board": options.virtual_board,
        "trace": prepared.feed.about,
        "params": options.played.params,
        "generator": generator.name(),
        "generator_crc": format!("{:08x}", generator_record::record_of(generator).crc()),
        "sensors": about_sensors(sensors),
        "sensors_crc": format!("{:08x}", sensor_record::record_of(sensors).crc()),
        "secs": prepared.secs,
        "presses_s": prepared.presses,
    }))
}

fn writing(path: &Path, error: io::Error) -> Failure {
    Failure::run(format!("{}: cannot be written: {error}", path.display()))
}

/// A run under way.
struct Run<'t> {
    session: Session<'t>,
    view: View,
    capture: Option<Capture<'t>>,
    summary: Option<Summary>,
    /// What made the run stop early.
    trouble: Option<Failure>,
}

impl Run<'_> {
    /// Takes one output of the board; gives what happened, and `None` once nothing more will come.
    fn take(&mut self, output: Output) -> Option<Vec<Event>> {
        let events = match output {
            Output::Line(line) => {
                let captured = self.capture.as_mut().map_or(Ok(()), |capture| capture.board_line(&line));
                match self.session.take(line) {
                    Ok(events) => {
                        if let Err(error) = captured {
                            self.trouble = Some(Failure::run(format!("the recording: {error}")));
                        }
                        events
                    }
                    Err(error) => {
                        self.trouble = Some(Failure::run(error));
                        return None;
                    }
                }
            }
            Output::Strange(error) => {
                self.trouble = Some(Failure::run(error));
                return None;
            }
            Output::Complaint(text) => vec![Event::Remark { kind: "says".into(), text }],
            Output::Closed => return None,
        };
        for event in &events {
            self.account(event);
        }
        Some(events)
    }

    fn account(&mut self, event: &Event) {
        self.view.take(event, self.session.books());
        if let Event::Ended(end) = event {
            self.summary = Some(Summary::new(Some(end), self.session.books(), "", Value::Null));
        }
    }

    fn finish(&mut self, options: &Options, prepared: &Prepared, board: &mut BoardProcess) -> Result<(), Failure> {
        for event in self.session.finish() {
            self.account(&event);
        }
        let complete = self.summary.is_some();
        let mut summary =
            self.summary.take().unwrap_or_else(|| Summary::new(None, self.session.books(), "", Value::Null));
        summary.elf_sha256.clone_from(&prepared.image.sha256);
        summary.trace.clone_from(&prepared.feed.about);
        if let (Some(capture), Some(path)) = (self.capture.take(), &options.record) {
            let value = serde_json::to_value(&summary).map_err(Failure::run)?;
            let counts = capture.finish(&value).map_err(|error| writing(path, error))?;
            eprintln!("{}", record::told(path, &counts));
        }
        self.summary = Some(summary);
        let status = board.wait().map_err(Failure::run)?;
        if !complete && self.trouble.is_none() {
            let words = format!("the virtual board ended without its last line ({status}); {}", self.last_words());
            self.trouble = Some(Failure::run(words));
        }
        Ok(())
    }

    /// The last thing that the board said, which is often why it ended.
    fn last_words(&self) -> String {
        self.view.log.back().map_or("it said nothing".into(), |line| format!("the last that came was: {line}"))
    }

    fn verdict(mut self, show: Show) -> Result<(), Failure> {
        if let Some(trouble) = self.trouble.take() {
            return Err(trouble);
        }
        let Some(summary) = &self.summary else { return Ok(()) };
        let text = match show {
            Show::Json => serde_json::to_string(summary).map_err(Failure::run)? + "\n",
            Show::Plain | Show::Screen => plain::summary(summary),
        };
        // A reader that has left does not want it.
        let _ = io::stdout().write_all(text.as_bytes()).and_then(|()| io::stdout().flush());
        let faults = summary.faults();
        if faults.is_empty() {
            Ok(())
        } else {
            Err(Failure::run(format!("the run was not sound: {}", faults.join("; "))))
        }
    }
}

/// The wish to end, and what follows from it.
struct Ending<'a> {
    interrupt: &'a AtomicBool,
    /// Set by a key or by a reader that left.
    wished: bool,
    asked: Option<Instant>,
}

impl<'a> Ending<'a> {
    fn new(interrupt: &'a AtomicBool) -> Self {
        Self { interrupt, wished: false, asked: None }
    }

    /// Asks the board to end once somebody wishes it; true when waiting any longer is senseless.
    fn see_to_it(&mut self, board: &mut BoardProcess) -> bool {
        match self.asked {
            None if self.wished || self.interrupt.load(Ordering::Relaxed) => {
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
    while run.trouble.is_none() && !ending.see_to_it(board) {
        let Some(output) = board.next(Duration::from_millis(50)) else { continue };
        let Some(events) = run.take(output) else { break };
        for event in &events {
            match say(event, &run.view, show) {
                Ok(()) => {}
                // Nobody reads on: as good as Ctrl-C.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => ending.wished = true,
                Err(error) => return Err(Failure::run(error)),
            }
        }
    }
    Ok(())
}

/// Prints what is worth a line. Data go to standard output; in plain text, talk goes to standard error.
fn say(event: &Event, view: &View, show: Show) -> io::Result<()> {
    let status = matches!(event, Event::Status { .. });
    let mut out = io::stdout().lock();
    match show {
        Show::Json => {
            let object = if status { Some(plain::object(view)) } else { plain::news_object(event) };
            let Some(object) = object else { return Ok(()) };
            writeln!(out, "{object}")?;
        }
        Show::Plain | Show::Screen => {
            if let Some(news) = plain::news(event) {
                eprintln!("{news}");
            }
            if !status {
                return Ok(());
            }
            writeln!(out, "{}", plain::line(view))?;
        }
    }
    out.flush()
}

fn on_screen(run: &mut Run<'_>, board: &mut BoardProcess, interrupt: &AtomicBool) -> Result<(), Failure> {
    let mut terminal = ratatui::try_init().map_err(|error| Failure::run(format!("no screen: {error}")))?;
    let mut ending = Ending::new(interrupt);
    let mut released_at: Option<f64> = None;
    let mut drawn = Instant::now();
    let shown = loop {
        if run.trouble.is_some() || ending.see_to_it(board) {
            break Ok(());
        }
        if let Some(output) = board.next(FRAME / 4)
            && run.take(output).is_none()
        {
            break Ok(());
        }
        if released_at.is_some_and(|at| run.view.t_s >= at) {
            board.hold_button(false);
            released_at = None;
        }
        if drawn.elapsed() < FRAME {
            continue;
        }
        drawn = Instant::now();
        let key = match terminal.draw(|frame| screen::draw(frame, &run.view)).and_then(|_| key()) {
            Ok(key) => key,
            Err(error) => break Err(Failure::run(error)),
        };
        match key {
            Some(Key::Button) if released_at.is_none() => {
                board.hold_button(true);
                released_at = Some(run.view.t_s + PRESS_S);
            }
            Some(Key::End) => ending.wished = true,
            Some(Key::Button) | None => {}
        }
    };
    let restored = ratatui::try_restore().map_err(Failure::run);
    shown.and(restored)
}

/// What a key means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    Button,
    End,
}

/// The meaning of the next key that was pressed, if one was.
fn key() -> io::Result<Option<Key>> {
    while event::poll(Duration::ZERO)? {
        if let event::Event::Key(key) = event::read()?
            && let Some(meaning) = meaning(&key)
        {
            return Ok(Some(meaning));
        }
    }
    Ok(None)
}

fn meaning(key: &KeyEvent) -> Option<Key> {
    if key.kind != KeyEventKind::Press {
        return None;
    }
    match key.code {
        KeyCode::Char(' ') => Some(Key::Button),
        KeyCode::Char('q') | KeyCode::Esc => Some(Key::End),
        // In raw mode the terminal sends no signal.
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Key::End),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_presses_are_read() {
        assert_eq!("auto".parse(), Ok(Press::Auto));
        assert_eq!("none".parse(), Ok(Press::At(vec![])));
        assert_eq!("0.5, 4".parse(), Ok(Press::At(vec![0.5, 4.0])));
        for bad in ["", "soon", "-1", "1,,2", "nan", "inf"] {
            let error = bad.parse::<Press>().unwrap_err();
            assert!(error.contains("allowed are `auto`"), "{bad}: {error}");
        }
    }

    #[test]
    fn keys_mean_what_the_last_line_of_the_screen_says() {
        let pressed = |code, modifiers| meaning(&KeyEvent::new(code, modifiers));
        assert_eq!(pressed(KeyCode::Char(' '), KeyModifiers::NONE), Some(Key::Button));
        assert_eq!(pressed(KeyCode::Char('q'), KeyModifiers::NONE), Some(Key::End));
        assert_eq!(pressed(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(Key::End));
        assert_eq!(pressed(KeyCode::Char('c'), KeyModifiers::NONE), None);
        let released = KeyEvent::new_with_kind(KeyCode::Char('q'), KeyModifiers::NONE, KeyEventKind::Release);
        assert_eq!(meaning(&released), None);
    }
}
