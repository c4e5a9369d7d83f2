//! A board's serial port as lines: what its records say, without a copy of its loop.

use joint_loop::{RobotConfig, SENSOR_JOINT};
use serde_json::json;
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use wire::{Answered, Record};

use crate::board::run::{Counters, Event};
use crate::board::serial::{LinkError, Port, Records, is_other_version};
use crate::failure::Failure;
use crate::file::capture::rtt::Came;
use crate::live::{Live, Receivers};
use crate::messages;
use crate::view::plain;
use crate::view::state::View;

/// Ticks from one plain line to the next.
const TICKS_A_LINE: u32 = 100;

/// Shows a port until it is closed, so many seconds of the board have passed, or a signal asks for the end. As JSON, every frame is a line.
///
/// # Errors
/// The port cannot be opened or fails, its records are of another version, or none came.
pub(super) fn run(
    path: &Path,
    receivers: &Receivers,
    secs: Option<f64>,
    as_json: bool,
    interrupt: &AtomicBool,
) -> Result<(), Failure> {
    let place = path.display();
    let port =
        Port::open(path, false).map_err(|error| Failure::input(format!("{place}: cannot be opened: {error}")))?;
    // The port does not say which robot and which joints with sensors the board has: those of the default ones.
    let sensors = vec![SENSOR_JOINT];
    let live = Live::open(receivers, sensors.clone(), &RobotConfig::default_biped())?;
    let mut shown = Shown {
        live,
        view: View::titled(format!("footfall watch: {place}"), sensors),
        counters: Counters::default(),
        first: None,
        lines: 0,
        as_json,
    };
    let mut records = Records::default();
    while !interrupt.load(Ordering::Relaxed) && secs.is_none_or(|secs| shown.seconds() < secs) {
        let bytes = match port.next_within(Duration::from_millis(50)) {
            Came::Bytes(bytes) => bytes,
            Came::Nothing => continue,
            Came::End => break,
            Came::Broken(error) => return Err(Failure::run(format!("{place}: the port failed: {error}"))),
        };
        for record in records.push(&bytes) {
            if let (Err(error), true) = (&record, is_other_version(&record)) {
                return Err(Failure::run(format!("{place}: {error}")));
            }
            match shown.take(record) {
                Ok(()) => {}
                // A closed pipe ends the run like Ctrl-C.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                    shown.live.finish();
                    return Ok(());
                }
                Err(error) => return Err(Failure::run(error)),
            }
        }
    }
    shown.live.finish();
    if shown.first.is_none() {
        return Err(Failure::run(format!(
            "{place}: no frame came; check that the board runs and that this is its port, 2 Mbaud"
        )));
    }
    Ok(())
}

/// What was shown so far.
struct Shown {
    live: Live,
    view: View,
    counters: Counters,
    /// Tick of the first frame.
    first: Option<u32>,
    lines: u64,
    as_json: bool,
}

impl Shown {
    /// Seconds of the board since the first frame.
    fn seconds(&self) -> f64 {
        let last = self.view.last.as_ref().map(|frame| frame.tick);
        self.first.zip(last).map_or(0.0, |(first, last)| f64::from(last.wrapping_sub(first)) / 1000.0)
    }

    fn take(&mut self, record: Result<Record, LinkError>) -> io::Result<()> {
        let event = match record {
            Ok(Record::Frame(tick)) => {
                self.first.get_or_insert(tick.tick);
                self.live.frame(&tick);
                Event::Tick { t_s: f64::from(tick.tick) / 1000.0, tick }
            }
            Ok(Record::Boot(boot)) => {
                self.counters.shadow = boot.shadow;
                self.first = None;
                self.live.boot();
                Event::Booted { t_s: 0.0, cause: boot.reset.name().into() }
            }
            Ok(Record::Change(change)) => {
                self.counters.cause = change.cause;
                return Ok(());
            }
            Ok(Record::Cost(cost)) => Event::Cost(cost),
            Ok(Record::Environment(environment)) => Event::Environment(environment),
            Ok(Record::Answered(answer)) => return self.answer(&answer),
            Ok(Record::Inputs(_) | Record::Edge(_) | Record::Port(_) | Record::Refused(_)) => return Ok(()),
            Err(_) => {
                self.counters.malformed += 1;
                return Ok(());
            }
        };
        if let Event::Tick { t_s, tick } = &event {
            // What is at the pins is not known here; what was commanded is.
            let us = tick.pulses_us.map(|us| (us > 0).then_some(us.into()));
            self.view.take(&Event::Pulses { t_s: *t_s, us }, &self.counters);
        }
        self.view.take(&event, &self.counters);
        let Event::Tick { tick, .. } = event else { return Ok(()) };
        let mut out = io::stdout().lock();
        if self.as_json {
            writeln!(out, "{}", plain::object(&self.view))?;
        } else if u64::from(tick.tick / TICKS_A_LINE) != self.lines {
            self.lines = (tick.tick / TICKS_A_LINE).into();
            writeln!(out, "{}", plain::line(&self.view))?;
        }
        out.flush()
    }

    fn answer(&self, answer: &Answered) -> io::Result<()> {
        let Answered { tick, number, outcome } = answer;
        if self.as_json {
            let object = json!({ "type": "answer", "number": number, "tick": tick, "outcome": outcome.name() });
            return writeln!(io::stdout().lock(), "{object}");
        }
        messages::status(format_args!("request {number}: {} at tick {tick}", outcome.name()));
        Ok(())
    }
}
