//! Watches a board that runs until its source ends, enough seconds have passed, a key or a signal.

use joint_loop::{RobotConfig, SENSOR_JOINT};
use serde_json::json;
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use wire::Answered;

use super::connection::{Connection, Received};
use super::shown::{News, Shown};
use crate::board::run::Event;
use crate::board::source::Origin;
use crate::failure::Failure;
use crate::messages::{self, escaped};
use crate::publish::{Publisher, Receivers};
use crate::view::keys::{Key, TuneKey, key};
use crate::view::plain;
use crate::view::screen;
use crate::view::state::CostUnit;
use crate::view::tuning::Tuning;
use crate::virtual_run::settings::Show;

/// Ticks from one plain line to the next.
const TICKS_A_LINE: u32 = 100;

/// Time between two frames of the screen.
const FRAME: Duration = Duration::from_millis(33);

/// What is watched, and how.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Where the records come from.
    pub origin: Origin,
    /// Seconds of the board.
    pub secs: Option<f64>,
    /// Where it is sent while it runs.
    pub receivers: Receivers,
    /// How it is shown.
    pub show: Show,
}

/// Watches the board. `interrupt` is set by a signal that asks for the end.
///
/// # Errors
/// The source cannot be opened or fails, its bytes are not of a board or of another version, or no frame came.
pub fn run(settings: &Settings, interrupt: &AtomicBool) -> Result<(), Failure> {
    let Settings { origin, receivers, show, .. } = settings;
    let mut connection = Connection::open(origin, *show == Show::Screen)?;
    // A board that is listened to does not say which robot it has.
    let publisher = Publisher::open(receivers, vec![SENSOR_JOINT], &RobotConfig::default_biped())?;
    let mut shown = Shown::titled(format!("footfall watch: {origin}"), publisher);
    shown.view.cost_unit = if origin.is_of_a_chip() { CostUnit::Cycles } else { CostUnit::Either };
    let watched = match show {
        Show::Screen => {
            shown.view.tuning = connection.requests().map(|_| Tuning::default());
            on_screen(settings, &mut connection, &mut shown, interrupt)
        }
        Show::Plain | Show::Json => in_lines(settings, &mut connection, &mut shown, interrupt),
    };
    shown.publisher.finish();
    watched?;
    if let Some(tuning) = &shown.view.tuning {
        let changed = tuning.changed();
        if !changed.is_empty() {
            messages::status(format_args!("changed, until the next reset of the board: {}", changed.join(" ")));
            messages::next(
                "keep speed, amplitudes and offsets",
                format!("footfall save generator.toml --set {} -o tuned.toml", changed.join(" --set ")),
            );
        }
    }
    if !shown.has_frames() {
        return Err(Failure::run(format!("{origin}: no frame came; {}", origin.to_check())));
    }
    Ok(())
}

fn is_over(settings: &Settings, shown: &Shown, interrupt: &AtomicBool) -> bool {
    interrupt.load(Ordering::Relaxed) || settings.secs.is_some_and(|secs| shown.seconds() >= secs)
}

/// Longest time without a new frame, beside the seconds that are asked for.
const PATIENCE: Duration = Duration::from_secs(5);

/// Ends a run of so many seconds when the board's time stands still for longer, whatever else comes: they cannot come any more.
struct Patience {
    longest: Option<Duration>,
    seconds: f64,
    since: Instant,
}

impl Patience {
    fn of(settings: &Settings) -> Self {
        let longest = settings.secs.and_then(|secs| Duration::try_from_secs_f64(secs).ok()?.checked_add(PATIENCE));
        Self { longest, seconds: 0.0, since: Instant::now() }
    }

    fn check(&mut self, settings: &Settings, shown: &Shown) -> Result<(), Failure> {
        if shown.seconds() > self.seconds {
            (self.seconds, self.since) = (shown.seconds(), Instant::now());
        }
        if self.longest.is_some_and(|longest| self.since.elapsed() > longest) {
            let Settings { origin, .. } = settings;
            return Err(Failure::run(format!("{origin}: silent; {}", origin.to_check())));
        }
        Ok(())
    }
}

fn in_lines(
    settings: &Settings,
    connection: &mut Connection<'_>,
    shown: &mut Shown,
    interrupt: &AtomicBool,
) -> Result<(), Failure> {
    let mut lines = Lines { as_json: settings.show == Show::Json, last: 0 };
    let (mut alarmed, mut patience) = (false, Patience::of(settings));
    while !is_over(settings, shown, interrupt) {
        match connection.next(Duration::from_millis(50))? {
            Received::Heard(all) => {
                for heard in all {
                    for news in shown.take(heard) {
                        match lines.print(&news, shown) {
                            Ok(()) => {}
                            // A closed pipe ends the run like Ctrl-C.
                            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
                            Err(error) => return Err(Failure::run(error)),
                        }
                    }
                }
            }
            Received::Again => {}
            Received::End => return Ok(()),
        }
        match (connection.alarm(), alarmed) {
            (Some(alarm), false) => messages::warning(format_args!("{}: {alarm}", settings.origin)),
            (None, true) => messages::status(format_args!("{}: records come again", settings.origin)),
            _ => {}
        }
        alarmed = connection.alarm().is_some();
        patience.check(settings, shown)?;
    }
    Ok(())
}

/// Lines of text or JSON.
struct Lines {
    as_json: bool,
    /// Number of the last plain line, by its tick.
    last: u32,
}

impl Lines {
    /// Data go to standard output; in plain text, messages go to standard error. As JSON, every frame is a line.
    fn print(&mut self, news: &News, shown: &Shown) -> io::Result<()> {
        let mut out = io::stdout().lock();
        match (news, self.as_json) {
            (News::Event(Event::Tick { .. }), true) => {
                writeln!(out, "{}", escaped(&plain::object(&shown.view).to_string()))?
            }
            (News::Event(Event::Tick { tick, .. }), false) => {
                let line = tick.tick / TICKS_A_LINE;
                if line == std::mem::replace(&mut self.last, line) {
                    return Ok(());
                }
                writeln!(out, "{}", escaped(&plain::line(&shown.view)))?;
            }
            (News::Event(event), true) => {
                let Some(object) = plain::event_object(event) else { return Ok(()) };
                writeln!(out, "{}", escaped(&object.to_string()))?;
            }
            (News::Event(event), false) => {
                if let Some(line) = plain::event_line(event) {
                    messages::status(line);
                }
                return Ok(());
            }
            (News::Answer(Answered { tick, number, outcome }), true) => {
                let object = json!({ "type": "answer", "number": number, "tick": tick, "outcome": outcome.name() });
                writeln!(out, "{object}")?;
            }
            (News::Answer(Answered { tick, number, outcome }), false) => {
                messages::status(format_args!("request {number}: {} at tick {tick}", outcome.name()));
                return Ok(());
            }
        }
        out.flush()
    }
}

fn on_screen(
    settings: &Settings,
    connection: &mut Connection<'_>,
    shown: &mut Shown,
    interrupt: &AtomicBool,
) -> Result<(), Failure> {
    let mut terminal =
        ratatui::try_init().map_err(|error| Failure::run(format!("the screen cannot be opened: {error}")))?;
    let (mut has_ended, mut patience) = (false, Patience::of(settings));
    let watched = loop {
        if is_over(settings, shown, interrupt) {
            break Ok(());
        }
        let drawn = Instant::now();
        let received = receive(connection, shown, drawn + FRAME, &mut has_ended);
        // The last of a source that has ended stays on the screen until a key.
        if let Err(failure) = received.and_then(|()| if has_ended { Ok(()) } else { patience.check(settings, shown) }) {
            break Err(failure);
        }
        shown.view.alarm = match has_ended {
            true => Some(format!("{} has ended; this is the last of it", settings.origin)),
            false => connection.alarm(),
        };
        if let Some(tuning) = &mut shown.view.tuning {
            tuning.wait(Instant::now());
        }
        match terminal.draw(|frame| screen::draw(frame, &shown.view)).and_then(|_| key()) {
            Ok(Some(Key::End)) => break Ok(()),
            Ok(Some(Key::Tune(key))) => tune(connection, shown, key),
            // The button is on the board.
            Ok(Some(Key::Button) | None) => {}
            Err(error) => break Err(Failure::run(error)),
        }
    };
    let restored = ratatui::try_restore().map_err(Failure::run);
    watched.and(restored)
}

/// Takes what comes until then.
fn receive(
    connection: &mut Connection<'_>,
    shown: &mut Shown,
    until: Instant,
    has_ended: &mut bool,
) -> Result<(), Failure> {
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(());
        }
        if *has_ended {
            std::thread::sleep(left);
            continue;
        }
        match connection.next(left)? {
            Received::Heard(all) => {
                for heard in all {
                    // What is new is in the view.
                    drop(shown.take(heard));
                }
            }
            Received::Again => shown.view.note("connected again".into()),
            Received::End => *has_ended = true,
        }
    }
}

/// Acts on a key that changes the board.
fn tune(connection: &mut Connection<'_>, shown: &mut Shown, key: TuneKey) {
    let Some(tuning) = &mut shown.view.tuning else { return };
    let Some(request) = tuning.press(key, Instant::now()) else { return };
    match connection.requests().map(|board| board.send(&request)) {
        Some(Ok(())) => {}
        Some(Err(error)) => tuning.not_sent(&error),
        None => tuning.not_sent(&"the connection is closed"),
    }
}
