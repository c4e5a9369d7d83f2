//! Stride events that support the angle: peaks of the measured joint, or heel strikes of a foot switch.
//!
//! ```text
//! at an event:  phi := phi + g d,   w := w + g_w (2 pi k / T - w),   d = wrap(phi_event - phi)
//! ```
//! phi_event is the phase of the event, T the time since the last event and k the number of strides in it (one, or the nearest number
//! if strikes were missed). Intervals outside of 0.5 to 2.5 nominal strides are ignored ([`StrideTimer`]).
//!
//! | source | phi_event | acts while | g | g_w |
//! |---|---|---|---|---|
//! | peak | where the template has fallen by a fifth of its range from the peak | seeking, while nothing is driven | 1 | 0.5 |
//! | foot switch | learned: circular mean of the last 8 strikes while locked | holding, once 4 strikes agree | 0.7 | 0.25 |
//!
//! *In a lock no event acts*: a locked follower gives the same bits with and without a switch. The angle measures the phase a thousand
//! times a second, an event once a stride, so little is lost: a frequency gain of 0.5 would shorten the transition from strides of 1.1 s to
//! 0.9 s from 1.28 to 1.16 s (hip, median of 24 phases). The steady phase error of two recorded persons, 2.1 to 3.1 degrees, would change by
//! -0.06 to 0.24 with it, by -0.24 with a phase gain of 0.5 and strikes that are exact, by up to 0.43 with strikes that jitter by 10 ms.
//!
//! *A switch is used once its strikes agree, and ignored as soon as they do not*: strikes less than 50 ms apart count as one that bounces.
//! A strike after more than that but less than half a nominal stride, or more than a tenth of a stride from its predicted phase, clears the
//! learned phase. In one hold all strikes together move the phase by a tenth of a stride at most, and the cadence by a twentieth.
//!
//! *A peak is reported on the falling slope after it*, where the angle is steep; the peak itself may be flat or double. With peaks,
//! recorded knees lock 0.14 and 0.42 s sooner (two persons, medians of 120 starts), hips do not.
//!
//! A switch may be on either foot and late by any constant time, because phi_event is learned. It does not replace the angle: without an
//! angle the joints stop after the same 2 s.

use core::f32::consts::TAU;

use joint_units::{Period, Phase, Radians};

use crate::entrainment::phase_lock::{PhaseLock, Template};
use crate::entrainment::stride_events::{Interval, PeakConfig, PeakDetector, StrideTimer};
use crate::error::in_range;
use crate::math::trig::{angle, sin_cos};
use crate::waveform::shape::Shape;
use crate::{BuildError, Field};

/// Source of stride events beside the angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EventSource {
    /// None.
    #[default]
    None,
    /// Peaks of the measured angle; its template must have one a stride. A knee locks sooner with them, a hip does not.
    Peak,
    /// A foot switch, which corrects the phase while the sensor has a fault.
    FootSwitch,
}

impl EventSource {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::None, Self::Peak, Self::FootSwitch];

    /// A word for people and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Peak => "peak",
            Self::FootSwitch => "foot_switch",
        }
    }
}

/// Shortest and longest accepted interval, in nominal strides.
const INTERVALS: (f32, f32) = (0.5, 2.5);

/// Allowed effect of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// None.
    Ignored,
    /// Phase and cadence are unknown, and nothing is driven.
    Finds,
    /// The phase is known.
    Learns,
    /// The angle is not valid: the phase goes on by itself.
    Keeps,
}

/// The events of one source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Events {
    None,
    Peak(Peaks),
    FootSwitch(FootSwitch),
}

impl Events {
    /// # Errors
    /// For peaks: `template.range` (in radians) if the joint hardly moves, `template.peaks` if it does not have one peak a stride.
    pub(super) fn new(
        source: EventSource,
        template: &Template,
        lock: &PhaseLock,
        period: Period,
    ) -> Result<Self, BuildError> {
        let timer = StrideTimer::new(TAU / lock.nominal().0, INTERVALS, period);
        Ok(match source {
            EventSource::None => Self::None,
            EventSource::Peak => Self::Peak(Peaks::new(template, timer, period)?),
            EventSource::FootSwitch => Self::FootSwitch(FootSwitch::new(timer)),
        })
    }

    /// Returns to the initial state.
    pub(super) const fn reset(&mut self) {
        match self {
            Self::None => {}
            Self::Peak(peaks) => *peaks = peaks.restarted(),
            Self::FootSwitch(switch) => *switch = switch.restarted(),
        }
    }

    /// The switch closed within this tick.
    pub(super) const fn strike(&mut self) {
        if let Self::FootSwitch(switch) = self {
            switch.struck = true;
        }
    }

    /// A hold begins at this frequency, rad/s.
    pub(super) const fn hold(&mut self, frequency: f32) {
        if let Self::FootSwitch(switch) = self {
            (switch.held, switch.moved) = (frequency, 0.0);
        }
    }

    /// Phase of the event; `None` without a source, and before the strikes of a switch agree.
    pub(super) fn phase(&self) -> Option<Phase> {
        match self {
            Self::None => None,
            Self::Peak(peaks) => Some(peaks.place),
            Self::FootSwitch(switch) => switch.learned_phase(),
        }
    }

    /// One tick, after the estimator's; the angle is `None` if it is not valid.
    pub(super) fn step(&mut self, lock: &mut PhaseLock, angle: Option<f32>, role: Role) {
        match self {
            Self::None => {}
            Self::Peak(peaks) => peaks.step(lock, angle, role),
            Self::FootSwitch(switch) => switch.step(lock, role),
        }
    }
}

fn turn(phase: Phase, radians: f32) -> Phase {
    phase + Phase::from_cycles(radians * (1.0 / TAU))
}

/// Peaks of the measured angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Peaks {
    fresh: PeakDetector,
    detector: PeakDetector,
    timer: StrideTimer,
    /// Phase at which the template has fallen by the threshold.
    place: Phase,
}

/// See the module.
const PEAK_GAIN: f32 = 1.0;
const PEAK_FREQUENCY_GAIN: f32 = 0.5;

impl Peaks {
    fn new(template: &Template, timer: StrideTimer, period: Period) -> Result<Self, BuildError> {
        let angles = |n: u32| template.at(Phase(n << 22)).angle;
        let (most, least) =
            (0..1024).map(angles).fold((f32::MIN, f32::MAX), |(most, least), y| (most.max(y), least.min(y)));
        let range = most - least;
        in_range(range, Field::of("template.range"), 0.04, 6.0)?;
        // Half of the range: the small wave of a knee in stance is no peak, but the peak of a sensor with the least gain is one.
        let fresh = PeakConfig { least: Radians(0.5 * range), ..PeakConfig::default() }.build(period)?;
        // Phase at which the detector itself reports it, in the second of two strides.
        let (mut detector, mut place, mut peaks) = (fresh, Phase(0), 0u8);
        for n in 0..2048 {
            if detector.step(Radians(angles(n))).is_some() && n >= 1024 {
                (place, peaks) = (Phase(n << 22), peaks.saturating_add(1));
            }
        }
        in_range(f32::from(peaks), Field::of("template.peaks"), 1.0, 1.0)?;
        Ok(Self { fresh, detector: fresh, timer, place })
    }

    const fn restarted(&self) -> Self {
        Self { detector: self.fresh, timer: self.timer.restarted(), ..*self }
    }

    fn step(&mut self, lock: &mut PhaseLock, angle: Option<f32>, role: Role) {
        self.timer.step();
        // An angle that is not a number only advances the time.
        if self.detector.step(Radians(angle.unwrap_or(f32::NAN))).is_none() {
            return;
        }
        let (interval, _) = self.timer.event(0.0);
        if role != Role::Finds || matches!(interval, Interval::TooShort(_)) {
            return;
        }
        if let Interval::Stride(interval) = interval {
            let frequency = lock.frequency().0;
            lock.set_frequency(frequency + PEAK_FREQUENCY_GAIN * (TAU / interval - frequency));
        }
        let off = self.place.radians_after(lock.phase()).0;
        lock.set_phase(turn(lock.phase(), PEAK_GAIN * off));
    }
}

/// Strikes of a heel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FootSwitch {
    timer: StrideTimer,
    /// The switch closed within this tick.
    struck: bool,
    /// Mean of cosine and sine of the phase at the strikes, and their number.
    mean: (f32, f32),
    strikes: u8,
    /// Frequency at the start of the hold, rad/s, and the change of phase by strikes since then, rad.
    held: f32,
    moved: f32,
}

/// See the module.
const STRIKE_GAIN: f32 = 0.7;
const STRIKE_FREQUENCY_GAIN: f32 = 0.25;
/// Strikes less than this apart count as one, s.
const BOUNCE_S: f32 = 0.05;
/// Number of strikes that have to agree, and number of strikes in the mean.
const ENOUGH: u8 = 4;
const MEAN_OVER: u8 = 8;
/// Least square of the length of the mean at which they agree: a spread of 14 degrees.
const AGREE: f32 = 0.94;
/// Largest distance of a strike from its learned phase, and largest change of phase by all strikes of a hold: a tenth of a stride.
const WITHIN: f32 = 0.1 * TAU;
/// Largest relative change of the cadence by all strikes of a hold.
const CADENCE: f32 = 0.05;

impl FootSwitch {
    const fn new(timer: StrideTimer) -> Self {
        Self { timer, struck: false, mean: (0.0, 0.0), strikes: 0, held: 0.0, moved: 0.0 }
    }

    const fn restarted(&self) -> Self {
        Self::new(self.timer.restarted())
    }

    /// Phase of the strikes, if they agree.
    fn learned_phase(&self) -> Option<Phase> {
        let (cos, sin) = self.mean;
        (self.strikes >= ENOUGH && cos * cos + sin * sin >= AGREE).then(|| angle(sin, cos))
    }

    fn step(&mut self, lock: &mut PhaseLock, role: Role) {
        self.timer.step();
        if !core::mem::take(&mut self.struck) {
            return;
        }
        let interval = self.timer.event(0.0).0;
        if !matches!(role, Role::Learns | Role::Keeps) {
            // While seeking the phase is not known, and a person who stands may step on the spot.
            return;
        }
        match interval {
            Interval::TooShort(interval) if interval < BOUNCE_S => {}
            Interval::TooShort(_) => self.strikes = 0,
            Interval::None => self.strike(lock, role, None),
            Interval::Stride(interval) => self.strike(lock, role, Some(interval)),
        }
    }

    fn strike(&mut self, lock: &mut PhaseLock, role: Role, interval: Option<f32>) {
        let phase = lock.phase();
        let (cos, sin) = self.mean;
        if self.strikes > 0 && angle(sin, cos).radians_after(phase).0.abs() > WITHIN {
            self.strikes = 0;
        }
        if role == Role::Learns {
            self.strikes = (self.strikes + 1).min(MEAN_OVER);
            let share = 1.0 / f32::from(self.strikes);
            let (s, c) = sin_cos(phase);
            self.mean = if self.strikes == 1 { (c, s) } else { (cos + (c - cos) * share, sin + (s - sin) * share) };
        } else if let Some(place) = self.learned_phase() {
            if let Some(interval) = interval {
                let frequency = lock.frequency().0;
                let strides = ((interval * frequency * (1.0 / TAU) + 0.5) as u32).max(1);
                let measured = TAU * strides as f32 / interval;
                let frequency = frequency + STRIKE_FREQUENCY_GAIN * (measured - frequency);
                let (least, most) = (self.held * (1.0 - CADENCE), self.held * (1.0 + CADENCE));
                lock.set_frequency(frequency.max(least).min(most));
            }
            let moved = (self.moved + STRIKE_GAIN * place.radians_after(phase).0).clamp(-WITHIN, WITHIN);
            lock.set_phase(turn(phase, moved - self.moved));
            self.moved = moved;
        }
    }
}
