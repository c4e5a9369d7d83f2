//! What a boot says: its record, what it refuses, and in its log how the run before ended.

use footfall::board::image::Image;
use footfall::board::transport::{Heard, Transport};
use joint_loop::SupervisorState;
use serde_json::Value;
use wire::{Boot, Record, Subject};

/// A log from a reset on.
#[derive(Debug, Default)]
pub struct BootLog {
    /// Boot records: one, if the board got so far.
    pub boots: Vec<Boot>,
    /// What the boot refuses.
    pub refused: Vec<Subject>,
    /// The program's own record of how the run before ended, after the words `last run ended by`; `None`: it has none.
    pub crash: Option<String>,
    /// States of the supervisor that were entered, each with its tick.
    pub entered: Vec<(SupervisorState, u32)>,
}

impl BootLog {
    /// Reads the bytes of the two RTT channels, as a list of hexadecimal digits: the log for people and the records.
    ///
    /// # Panics
    /// They are not of this image.
    #[must_use]
    pub fn read(channels: &Value, image: &Image) -> Self {
        let bytes = |channel: usize| -> Vec<u8> {
            let hex = channels[channel].as_str().expect("text").chars();
            let digits: Vec<u32> = hex.map(|digit| digit.to_digit(16).expect("a digit")).collect();
            digits.chunks_exact(2).map(|pair| (pair[0] << 4 | pair[1]) as u8).collect()
        };
        let mut decoder = image.decoder();
        decoder.push(&bytes(0));
        let mut log = Self::default();
        while let Some(message) = decoder.message() {
            let text = message.expect("whole frames").text;
            log.crash = text.strip_prefix("last run ended by ").map(str::to_owned).or(log.crash);
        }
        let pushed = Transport::default().push(&bytes(1), |heard| match heard {
            Heard::Record(Record::Boot(boot)) => log.boots.push(boot),
            Heard::Record(Record::Refused(one)) => log.refused.push(one.subject),
            Heard::Record(Record::Change(change)) => log.entered.push((change.state, change.tick)),
            Heard::Record(_) => {}
            Heard::Damaged => panic!("a damaged frame"),
        });
        pushed.expect("records");
        log
    }

    /// How the run before ended, in one word: by the program's own record, or else the cause of the reset. `None`: the boot did not say it.
    #[must_use]
    pub fn end(&self) -> Option<&str> {
        let boot = self.boots.first()?;
        Some(self.crash.as_deref().and_then(|crash| crash.split(' ').next()).unwrap_or_else(|| boot.reset.name()))
    }
}
