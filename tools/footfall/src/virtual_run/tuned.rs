//! The serial port of a virtual board whose parameters the keys of the live screen change.

use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};
use wire::Record;

use crate::board::run::Event;
use crate::board::serial::Port;
use crate::board::transport::{Heard, Transport};
use crate::file::capture::rtt::Came;
use crate::view::keys::TuneKey;
use crate::view::state::View;
use crate::view::tuning::Tuning;

/// The port, once the board has named it.
#[derive(Default)]
pub(super) struct Tuned {
    open: Option<(Port, Transport)>,
}

impl Tuned {
    /// The board names its port, or starts.
    pub(super) fn account(&mut self, event: &Event, view: &mut View) {
        match event {
            Event::Remark { kind, text } if kind == "serial" => match opened(text) {
                Ok(port) => {
                    self.open = Some((port, Transport::default()));
                    let mut tuning = Tuning::default();
                    tuning.booted();
                    view.tuning = Some(tuning);
                }
                Err(why) => view.note(format!("its serial port cannot be opened: {why}")),
            },
            Event::Booted { .. } => {
                if let Some(tuning) = &mut view.tuning {
                    tuning.booted();
                }
            }
            _ => {}
        }
    }

    /// Takes what has come. A board whose port nobody reads waits.
    pub(super) fn receive(&mut self, view: &mut View) {
        let (Some((port, transport)), Some(tuning)) = (&mut self.open, &mut view.tuning) else { return };
        while let Came::Bytes(bytes) = port.next_within(Duration::ZERO) {
            let taken = transport.push(&bytes, |heard| match heard {
                Heard::Record(Record::Answered(answer)) => tuning.take(&answer),
                Heard::Record(Record::Settings(settings)) => tuning.reported(settings.values),
                _ => {}
            });
            if let Err(error) = taken {
                tuning.not_sent(&error);
            }
        }
        tuning.wait(Instant::now());
    }

    /// Acts on a key.
    pub(super) fn press(&mut self, key: TuneKey, view: &mut View) {
        let (Some((port, _)), Some(tuning)) = (&mut self.open, &mut view.tuning) else { return };
        if let Some(request) = tuning.press(key, Instant::now())
            && let Err(error) = port.send(&request)
        {
            tuning.not_sent(&error);
        }
    }
}

/// The port that a line of the board names.
fn opened(line: &str) -> Result<Port, String> {
    let object: Value = serde_json::from_str(line).map_err(|error| error.to_string())?;
    let name = object["port"].as_str().ok_or("the board names none")?;
    Port::open(Path::new(name), true).map_err(|error| format!("{name}: {error}"))
}
