//! Moments of a run that a script waits for: calls of functions, changes of the outputs, boots.

use std::io::Write;

use anyhow::Result;

use super::BoardRun;
use crate::inject::Injection;
use crate::pulses::{OutputChange, TimedOutputChange};
use crate::script::{On, Script, Watcher};

impl<W: Write> BoardRun<'_, W> {
    /// Adds the events of a script.
    ///
    /// # Errors
    /// The image lacks a function that the script names.
    pub(crate) fn follow(&mut self, script: &Script) -> Result<()> {
        let (watcher, timed) = Watcher::new(script, self.image)?;
        self.watcher = watcher;
        self.injections.extend(timed);
        Ok(())
    }

    /// Takes changes of the outputs, and the watched function that was reached.
    pub(super) fn note_moments(&mut self, changes: &[TimedOutputChange], reached: Option<u32>) {
        if !self.watcher.is_waiting() {
            return;
        }
        for change in changes {
            let on = match change.change {
                OutputChange::Armed(true) => On::Armed,
                OutputChange::Armed(false) => On::Disarmed,
                OutputChange::Rail(true) => On::RailOn,
                OutputChange::Rail(false) => On::RailOff,
                OutputChange::High(_) => continue,
            };
            let due = self.watcher.shown(on, change.seconds);
            self.inject_later(due);
        }
        if let Some(address) = reached {
            let seconds = self.cpu.machine().seconds();
            let due = self.watcher.called(address, seconds);
            self.inject_later(due);
            // Watched once: the next call is to be seen too.
            if self.watcher.functions().contains(&address) {
                self.cpu.machine().watched.push(address);
            }
        }
    }

    /// Takes a boot, after which nothing is watched.
    pub(super) fn note_boot(&mut self) {
        if !self.watcher.is_waiting() {
            return;
        }
        let seconds = self.cpu.machine().seconds();
        let due = self.watcher.shown(On::Boot, seconds);
        self.inject_later(due);
        let functions = self.watcher.functions();
        self.cpu.machine().watched.extend(functions);
    }

    fn inject_later(&mut self, due: Vec<Injection>) {
        if !due.is_empty() {
            self.injections.extend(due);
            self.schedule_stop();
        }
    }
}
