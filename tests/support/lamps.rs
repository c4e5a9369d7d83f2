//! What the lamps of a board show in a run on the virtual board.

use std::path::Path;

use firmware::board::{Board as Table, Pin};
use firmware_shared::lamp::{Lamp, Shown};

use crate::board::{Board, Ran};
use crate::recordings::default_volts_file;

/// Whether each lamp is lit, at each millisecond of a run.
#[derive(Debug)]
pub struct Lamps {
    table: &'static Table,
    lit: Vec<(Pin, Vec<bool>)>,
}

impl Lamps {
    /// Runs a board, with its table, for so many seconds on the default volts with these options.
    ///
    /// # Panics
    /// The board cannot be run.
    #[must_use]
    pub fn of_run(table: &'static Table, board: &Board, secs: f64, options: &[&str]) -> (Self, Ran) {
        let folder = tempfile::tempdir().expect("a folder");
        let pins: Vec<Pin> = table.led_pulses.into_iter().chain(table.led_fault).collect();
        let file = |pin: Pin| folder.path().join(format!("{pin}.csv"));
        let mut all = vec!["--secs".to_owned(), secs.to_string(), "--loop".into()];
        all.extend(["--volts".into(), default_volts_file().display().to_string()]);
        for &pin in &pins {
            all.extend(["--record-edges".into(), format!("{pin}={}", file(pin).display())]);
        }
        all.extend(options.iter().map(|option| (*option).to_owned()));
        let ran = board.run(&all);
        let lit = |pin| levels(&file(pin), secs).into_iter().map(|level| level == table.lamps_lit).collect();
        (Self { table, lit: pins.into_iter().map(|pin| (pin, lit(pin))).collect() }, ran)
    }

    /// From `from_ms` to the end the lamps show this, with the pattern's beginning anywhere.
    ///
    /// # Panics
    /// They do not.
    pub fn assert_shown(&self, shown: Shown, from_ms: usize) {
        // Without a lamp of faults the other one shows them.
        let shows = |lamp| match lamp {
            Lamp::Pulses => self.table.led_pulses,
            Lamp::Fault => self.table.led_fault.or(self.table.led_pulses),
        };
        let is_shown = |begin: u32| {
            self.lit.iter().all(|(pin, lit)| {
                let seen = &lit[from_ms..];
                let is_wanted = |ms: usize| shown.lit(begin + ms as u32).and_then(shows) == Some(*pin);
                // A change may be seen a millisecond early or late.
                let is_near = |ms: usize| (ms.saturating_sub(1)..=ms + 1).any(|near| is_wanted(near) == seen[ms]);
                (0..seen.len()).all(is_near)
            })
        };
        assert!(self.lit[0].1.len() > from_ms + 2_500, "{shown:?}: too short to see a pattern");
        assert!((0..3_200).any(is_shown), "{shown:?} is not what the lamps show");
        let used = self.lit.iter().filter(|(_, lit)| lit[from_ms..].contains(&true)).count();
        assert_eq!(used, 1, "{shown:?}: one lamp shows it");
    }
}

/// The level of a pin in the middle of each millisecond, from its edges.
fn levels(file: &Path, secs: f64) -> Vec<bool> {
    let text = std::fs::read_to_string(file).expect("recorded");
    let mut edges = text.lines().skip(1).map(|line| line.split_once(',').expect("two columns")).peekable();
    let mut level = false;
    let at = |ms: usize| (ms as f64 + 0.5) * 1e-3;
    let mut after = |ms: usize| {
        while let Some((_, new)) = edges.next_if(|(t_s, _)| t_s.parse::<f64>().expect("a time") <= at(ms)) {
            level = new == "1";
        }
        level
    };
    (0..(secs * 1e3) as usize).map(&mut after).collect()
}
