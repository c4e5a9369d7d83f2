//! Watches a run for the moments of a script, and makes injections of its events.

use anyhow::{Context as _, Result};

use super::event::Event;
use super::target::check_overlaps;
use super::{Moment, On, Script};
use crate::inject::{Injection, InjectionKind};
use crate::loader::ProgramImage;

/// What an event waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Awaited {
    /// A call of the function at an address.
    Call(u32),
    On(On),
}

/// An event whose moment has not come.
#[derive(Debug)]
struct Pending {
    awaited: Awaited,
    /// How many times are left.
    left: u32,
    /// Its injections, with times from the moment on.
    injections: Vec<Injection>,
    /// What is said of it if its moment does not come.
    words: String,
}

/// The events of a script whose moments are not times.
#[derive(Debug, Default)]
pub(crate) struct Watcher {
    pending: Vec<Pending>,
}

impl Watcher {
    /// Makes injections of the events that have a time, and waits for the moments of the others.
    ///
    /// # Errors
    /// The image lacks a function that the script names.
    pub(crate) fn new(script: &Script, image: &ProgramImage) -> Result<(Self, Vec<Injection>)> {
        let (mut watcher, mut timed) = (Watcher::default(), Vec::new());
        let wiring = image.board.wiring();
        let kind = |event: &Event| -> Result<InjectionKind> {
            let kind = InjectionKind::of(&event.inject, image)?;
            kind.check_pin(&wiring)?;
            Ok(kind)
        };
        let kinds = script.events.iter().map(|event| kind(event).with_context(|| format!("the event {event}")));
        let kinds: Vec<InjectionKind> = kinds.collect::<Result<_>>()?;
        check_overlaps(script, &kinds)?;
        for (event, kind) in script.events.iter().zip(&kinds) {
            let (awaited, left) = match &event.moment {
                Moment::At(seconds) => {
                    timed.extend(injections(event, kind, *seconds));
                    continue;
                }
                Moment::Call(function, count) => {
                    let found = image.find_function(function).with_context(|| format!("the event {event}"))?;
                    (Awaited::Call(found), *count)
                }
                Moment::On(on, count) => (Awaited::On(*on), *count),
            };
            let words = format!("{event}: its moment did not come: {}", event.moment);
            watcher.pending.push(Pending { awaited, left, injections: injections(event, kind, 0.0).collect(), words });
        }
        Ok((watcher, timed))
    }

    /// Addresses of the functions whose calls it waits for, each once.
    pub(crate) fn functions(&self) -> Vec<u32> {
        let mut all: Vec<u32> = self
            .pending
            .iter()
            .filter_map(|one| match one.awaited {
                Awaited::Call(address) => Some(address),
                Awaited::On(_) => None,
            })
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Takes the call of a function at a time, s. Returns the injections that it leads to.
    pub(crate) fn called(&mut self, address: u32, seconds: f64) -> Vec<Injection> {
        self.seen(Awaited::Call(address), seconds)
    }

    /// Takes what a run shows at a time, s. Returns the injections that it leads to.
    pub(crate) fn shown(&mut self, on: On, seconds: f64) -> Vec<Injection> {
        self.seen(Awaited::On(on), seconds)
    }

    fn seen(&mut self, seen: Awaited, seconds: f64) -> Vec<Injection> {
        let mut due = Vec::new();
        self.pending.retain_mut(|one| {
            if one.awaited != seen {
                return true;
            }
            one.left -= 1;
            if one.left == 0 {
                due.extend(one.injections.drain(..).map(|injection| injection.later(seconds)));
            }
            one.left > 0
        });
        due
    }

    /// The events whose moment has not come, in words.
    pub(crate) fn missed(&self) -> impl Iterator<Item = &str> {
        self.pending.iter().map(|one| one.words.as_str())
    }

    /// True while it waits for a moment.
    pub(crate) fn is_waiting(&self) -> bool {
        !self.pending.is_empty()
    }
}

/// The injections of an event whose moment is at a time, s.
fn injections(event: &Event, kind: &InjectionKind, seconds: f64) -> impl Iterator<Item = Injection> {
    let Event { name, line, after_s, phase_us, every_s, times, for_s, .. } = event.clone();
    let kind = kind.clone();
    (0..times).map(move |n| {
        let at = seconds + after_s + f64::from(n) * every_s;
        Injection::new(kind.clone(), name.clone(), at).lasting(for_s).in_phase(phase_us).in_line(line)
    })
}
