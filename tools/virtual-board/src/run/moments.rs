//! Moments of a run that a script waits for: calls of functions, changes of the outputs, boots.

use std::io::Write;

use anyhow::{Result, ensure};

use super::BoardRun;
use crate::inject::Injection;
use crate::pulses::{OutputChange, TimedOutputChange};
use crate::report;
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

    /// Adds an event in the words of a script, without its moment, at a time, s.
    ///
    /// # Errors
    /// It is no event, or the image lacks a function that it names.
    pub(super) fn inject_now(&mut self, event: &str, seconds: f64) -> Result<()> {
        let script = Script::parse(&format!("event = [{{ at_s = {seconds:?}, inject = {event} }}]"))?;
        let (_, due) = Watcher::new(&script, self.image)?;
        self.inject_later(due);
        Ok(())
    }

    /// What scripts and options ask for and the run that ends now did not show, in words.
    pub(super) fn missed_events(&self) -> Vec<String> {
        let end = self.now_s();
        let words = |one: &Injection| {
            let of = one.line.map(|line| format!("line {line}")).or(one.option.map(str::to_owned))?;
            let (name, at) = (&one.symbol, report::seconds(one.at));
            if one.is_pending() {
                Some(format!("`{name}` ({of}): it was due at {at} s, and the run ended at {end} s"))
            } else if one.was_without_effect() {
                Some(format!("`{name}` ({of}): nothing called the function from {at} s on"))
            } else {
                None
            }
        };
        self.watcher.missed().map(str::to_owned).chain(self.injections.iter().filter_map(words)).collect()
    }

    /// Refuses the injection that is due now if another one of the script holds the same thing, and one of the two has an end.
    ///
    /// # Errors
    /// Both, and what they hold.
    pub(super) fn check_overlap(&self, n: usize) -> Result<()> {
        let (one, seconds) = (&self.injections[n], self.now_s());
        let (Some(line), Some(target)) = (one.line, one.kind.target()) else { return Ok(()) };
        for other in &self.injections {
            let holds = other.holds() && other.kind.target().as_ref() == Some(&target);
            let (name, at) = (&one.symbol, &other.symbol);
            ensure!(
                !(holds && (one.will_end() || other.will_end())),
                "the events `{name}` (line {line}) and `{at}` (line {}) overlap on {target} at {seconds} s: the end of one would end the other; \
                 move or shorten one of them",
                other.line.unwrap_or_default()
            );
        }
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
