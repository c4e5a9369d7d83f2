//! What a boot says in its log: its record, what it refuses, and how it says that the run before ended.

use footfall::board::image::Image;
use footfall::board::telemetry::record_in;
use joint_loop::SupervisorState;
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
    /// Reads the bytes of a log, as hexadecimal digits.
    ///
    /// # Panics
    /// They are not those of this image.
    #[must_use]
    pub fn read(hex: &str, image: &Image) -> Self {
        let digits: Vec<u32> = hex.chars().map(|digit| digit.to_digit(16).expect("a digit")).collect();
        let bytes: Vec<u8> = digits.chunks_exact(2).map(|pair| (pair[0] << 4 | pair[1]) as u8).collect();
        let mut decoder = image.decoder();
        decoder.push(&bytes);
        let mut log = Self::default();
        while let Some(message) = decoder.message() {
            let text = message.expect("whole frames").text;
            match record_in(&text).map(|record| record.expect("a record")) {
                Some(Record::Boot(boot)) => log.boots.push(boot),
                Some(Record::Refused(one)) => log.refused.push(one.subject),
                Some(Record::Change(change)) => log.entered.push((change.state, change.tick)),
                Some(_) => {}
                None => log.crash = text.strip_prefix("last run ended by ").map(str::to_owned).or(log.crash),
            }
        }
        log
    }

    /// How the run before ended, in one word: by the program's own record, or else the cause of the reset. `None`: the boot did not say it.
    #[must_use]
    pub fn end(&self) -> Option<&str> {
        let boot = self.boots.first()?;
        Some(self.crash.as_deref().and_then(|crash| crash.split(' ').next()).unwrap_or_else(|| boot.reset.name()))
    }
}
