//! A waveform at an input pin: a list of edges, or a frequency with a duty.

use anyhow::{Result, ensure};
use serde::Deserialize;
use stm32f4_model::Pin;

use crate::pin_name::PinName;

/// A waveform in a script: its times count from the moment at which it begins.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wave {
    /// The pin.
    pub(crate) pin: PinName,
    /// Level at the beginning.
    #[serde(default = "high")]
    first: bool,
    /// The level changes at these times, ms.
    #[serde(default)]
    edges_ms: Vec<f64>,
    /// Frequency, Hz.
    hz: Option<f64>,
    /// Part of the period with the first level; half without it.
    duty: Option<f64>,
}

const fn high() -> bool {
    true
}

impl Wave {
    /// A level of a pin, without an edge.
    pub(crate) const fn level(pin: Pin, high: bool) -> Self {
        Wave { pin: PinName(pin), first: high, edges_ms: Vec::new(), hz: None, duty: None }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// One is not allowed: which, and what is.
    pub(crate) fn check(&self) -> Result<()> {
        ensure!(
            self.hz.is_some() == self.edges_ms.is_empty(),
            "a wave has {} edges and {} frequency; allowed is one of edges_ms or hz",
            self.edges_ms.len(),
            if self.hz.is_some() { "a" } else { "no" }
        );
        ensure!(
            self.edges_ms.iter().all(|ms| *ms >= 0.0 && ms.is_finite())
                && self.edges_ms.windows(2).all(|pair| pair[0] < pair[1]),
            "edges_ms is {}; allowed are times from 0 on that increase",
            self.edges_ms.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
        );
        if let Some(hz) = self.hz {
            ensure!((0.01..=1e5).contains(&hz), "hz is {hz}; allowed are 0.01 to 1e5");
        }
        ensure!(self.duty.is_none() || self.hz.is_some(), "duty needs hz; remove it, or give hz instead of edges_ms");
        if let Some(duty) = self.duty {
            ensure!(duty > 0.0 && duty < 1.0, "duty is {duty}; allowed is more than 0 and less than 1");
        }
        Ok(())
    }
}

/// Part of a period by which an edge may be too early: the time of an edge is rounded.
const ROUNDING: f64 = 1e-6;

/// A waveform that has begun.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Waveform {
    wave: Wave,
    /// Time of its beginning, s.
    from: f64,
}

impl Waveform {
    /// A waveform from a time on, s.
    pub(crate) const fn from(wave: Wave, from: f64) -> Self {
        Waveform { wave, from }
    }

    /// Its level at a time, s.
    pub(crate) fn at(&self, seconds: f64) -> bool {
        let since = seconds - self.from;
        let changes = match self.wave.hz {
            Some(hz) => (since * hz + ROUNDING).rem_euclid(1.0) >= self.duty(),
            None => self.edges_until(since) % 2 == 1,
        };
        self.wave.first != changes
    }

    /// Its next edge after a time, s; `None`: no more.
    pub(crate) fn next_edge(&self, seconds: f64) -> Option<f64> {
        let since = (seconds - self.from).max(0.0);
        let next = match self.wave.hz {
            Some(hz) => {
                let now = since * hz + ROUNDING;
                let period = now.floor();
                let places = [period + self.duty(), period + 1.0];
                places.into_iter().find(|place| *place > now)? / hz
            }
            None => *self.wave.edges_ms.get(self.edges_until(since))? * 1e-3,
        };
        Some(self.from + next)
    }

    fn duty(&self) -> f64 {
        self.wave.duty.unwrap_or(0.5)
    }

    /// Number of edges up to a time after the beginning, s.
    fn edges_until(&self, since: f64) -> usize {
        self.wave.edges_ms.partition_point(|ms| *ms * 1e-3 <= since + 1e-12)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIN: Pin = crate::modelled_board::ModelledBoard::F4Discovery.wiring().button;

    #[test]
    fn edges_change_the_level() {
        let wave = Wave { edges_ms: vec![0.0, 5.0, 9.0], ..Wave::level(PIN, true) };
        assert!(wave.check().is_ok());
        let wave = Waveform::from(wave, 2.0);
        assert_eq!(
            [2.0, 2.004, 2.005, 2.008, 2.009, 9.0].map(|t| wave.at(t)),
            [false, false, true, true, false, false]
        );
        assert_eq!(wave.next_edge(2.0), Some(2.005));
        assert_eq!((wave.next_edge(2.006), wave.next_edge(2.009)), (Some(2.009), None));
    }

    #[test]
    fn a_frequency_has_its_duty_and_each_edge_comes() {
        let wave = Wave { hz: Some(40.0), duty: Some(0.2), ..Wave::level(PIN, true) };
        assert!(wave.check().is_ok());
        let wave = Waveform::from(wave, 1.0);
        assert_eq!([1.0, 1.004, 1.0051, 1.02, 1.0251].map(|t| wave.at(t)), [true, true, false, false, true]);
        let (mut t, mut edges, mut level) = (1.0, 0, wave.at(1.0));
        while t < 3.0 {
            t = wave.next_edge(t).unwrap();
            assert_ne!(wave.at(t), level, "an edge at {t}");
            level = !level;
            edges += 1;
        }
        assert!((160..=162).contains(&edges), "{edges}");
    }

    #[test]
    fn a_constant_level_has_no_edge() {
        let level = Waveform::from(Wave::level(PIN, false), 1.0);
        assert_eq!((level.at(1.0), level.at(7.0), level.next_edge(1.0)), (false, false, None));
    }

    #[test]
    fn what_is_not_allowed_is_named() {
        for (wave, words) in [
            (Wave { hz: Some(1.0), edges_ms: vec![1.0], ..Wave::level(PIN, true) }, "one of edges_ms or hz"),
            (Wave { edges_ms: vec![2.0, 1.0], ..Wave::level(PIN, true) }, "that increase"),
            (Wave { hz: Some(0.0), ..Wave::level(PIN, true) }, "0.01 to 1e5"),
            (Wave { hz: Some(9.0), duty: Some(1.0), ..Wave::level(PIN, true) }, "less than 1"),
            (Wave { duty: Some(0.5), edges_ms: vec![1.0], ..Wave::level(PIN, true) }, "duty needs hz"),
        ] {
            let error = wave.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
