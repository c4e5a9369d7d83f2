//! Corrects a follower's phase and stride frequency by stride events beside the angle: peaks of the measured joint, or heel strikes of a foot switch.
//!
//! ```text
//! at an event:  phi := phi + g d,   w := w + g_w (2 pi k / T - w),   d = wrap(phi_event - phi)
//! ```
//! phi is the estimated phase, w its angular frequency in rad/s, phi_event the phase of the event in the stride, T the time since the previous
//! event in s and k the number of strides in T (1, or the nearest integer if strikes were missed); g and g_w are the gains below. An event
//! sooner than half a nominal stride after the previous one is ignored; one later than 2.5 nominal strides corrects the phase only
//! ([`StrideTimer`]).
//!
//! | source | phi_event | acts while | g | g_w |
//! |---|---|---|---|---|
//! | peak | where the template has fallen by a fifth of its range from the peak | seeking, while nothing is driven | 1 | 0.5 |
//! | foot switch | learned: circular mean of the last 8 strikes while locked | holding, once 4 strikes agree | 0.7 | 0.25 |
//!
//! **While locked, events have no effect**: a locked follower computes the same bits with and without a switch. The angle measures the phase in
//! every tick, an event once a stride, so little would be gained. Measured: a frequency gain of 0.5 would shorten the transition from strides of
//! 1.1 s to 0.9 s from 1.28 to 1.16 s (hip, median of 24 phases). The steady phase error of two recorded persons, 2.1 to 3.1 degrees of the
//! stride, would change by -0.06 to 0.24 degrees with it, by -0.24 with a phase gain of 0.5 and exact strikes, and by up to 0.43 with strikes
//! that jitter by 10 ms.
//!
//! **A switch is used only while its strikes agree.** Strikes less than 50 ms apart are one strike that bounces. A strike later than that but
//! sooner than half a nominal stride, or more than a tenth of a stride from the learned phase, clears the learned phase. All strikes of one
//! hold together change the phase by at most a tenth of a stride and the stride frequency by at most 5 %.
//!
//! **A peak is reported on the falling slope after it**, where the angle is steep, because the peak itself may be flat or double. With peaks,
//! recorded knees lock 0.14 and 0.42 s sooner (two persons, medians of 120 starts); hips do not.
//!
//! A switch may be on either foot and may have any constant delay, because phi_event is learned. It does not replace the angle: without an
//! angle the joints stand after [`FollowerConfig::freewheel_s`](super::FollowerConfig::freewheel_s), with or without a switch.

use core::f32::consts::TAU;

use joint_units::{Period, Phase, Radians};

use crate::entrainment::phase_lock::{PhaseLock, Template};
use crate::entrainment::stride_events::{Interval, PeakConfig, PeakDetector, StrideTimer};
use crate::error::in_range;
use crate::math::trig::{angle, sin_cos};
use crate::waveform::shape::Shape;
use crate::{BuildError, Field};

/// Source of stride events of a follower, beside the measured angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EventSource {
    /// No events: the angle only. The default.
    #[default]
    None,
    /// Peaks of the measured angle, used while phase and stride frequency are searched. The template must have one peak a stride. A knee locks sooner
    /// with peaks, a hip does not.
    Peak,
    /// A foot switch, reported by [`Follow::heel_strike`](crate::Follow::heel_strike). Used while the sensor has a fault, once the phase of four
    /// strikes agrees.
    FootSwitch,
}

impl EventSource {
    /// Every source.
    pub const ALL: [Self; 3] = [Self::None, Self::Peak, Self::FootSwitch];

    /// Name in generator files and on the command line: `none`, `peak`, `foot_switch`.
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

/// Allowed effect of an event, from the state of the follower.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// No effect.
    Ignored,
    /// Peaks set phase and stride frequency: these are unknown, and the joints stand.
    Finds,
    /// The phase of heel strikes is learned: the phase is known.
    Learns,
    /// Heel strikes correct phase and stride frequency: the angle is not valid.
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
    /// For peaks: `template.range` if the joint moves by less than 0.04 rad, `template.peaks` if it does not have one peak a stride.
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

    /// Sets the state to that before the first event.
    pub(super) const fn reset(&mut self) {
        match self {
            Self::None => {}
            Self::Peak(peaks) => *peaks = peaks.restarted(),
            Self::FootSwitch(switch) => *switch = switch.restarted(),
        }
    }

    /// Reports that the foot switch closed within this tick.
    pub(super) const fn strike(&mut self) {
        if let Self::FootSwitch(switch) = self {
            switch.struck = true;
        }
    }

    /// Reports that a hold begins, at this frequency in rad/s.
    pub(super) const fn hold(&mut self, frequency: f32) {
        if let Self::FootSwitch(switch) = self {
            (switch.held, switch.moved) = (frequency, 0.0);
        }
    }

    /// Phase of the event in the stride; `None` without a source, and for a switch until its strikes agree.
    pub(super) fn phase(&self) -> Option<Phase> {
        match self {
            Self::None => None,
            Self::Peak(peaks) => Some(peaks.place),
            Self::FootSwitch(switch) => switch.learned_phase(),
        }
    }

    /// Advances by one tick, after the estimator. The angle in rad is `None` if it is not valid.
    pub(super) fn step(&mut self, lock: &mut PhaseLock, angle: Option<f32>, role: Role) {
        match self {
            Self::None => {}
            Self::Peak(peaks) => peaks.step(lock, angle, role),
            Self::FootSwitch(switch) => switch.step(lock, role),
        }
    }
}

/// The phase advanced by an angle in radians.
fn turn(phase: Phase, radians: f32) -> Phase {
    phase + Phase::from_cycles(radians * (1.0 / TAU))
}

/// Peaks of the measured angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Peaks {
    /// The detector in its initial state, for a restart.
    fresh: PeakDetector,
    detector: PeakDetector,
    timer: StrideTimer,
    /// Phase of the template at which the detector reports its peak.
    place: Phase,
}

/// Gains g and g_w of peaks, see the table of the module.
const PEAK_GAIN: f32 = 1.0;
const PEAK_FREQUENCY_GAIN: f32 = 0.5;

impl Peaks {
    fn new(template: &Template, timer: StrideTimer, period: Period) -> Result<Self, BuildError> {
        let angles = |n: u32| template.at(Phase(n << 22)).angle;
        let (most, least) =
            (0..1024).map(angles).fold((f32::MIN, f32::MAX), |(most, least), y| (most.max(y), least.min(y)));
        let range = most - least;
        in_range(range, Field::of("template.range"), 0.04, 6.0)?;
        // Half of the range: above the small wave of a knee in stance, and below the peak of a sensor with the least allowed gain of 0.5.
        let fresh = PeakConfig { least: Radians(0.5 * range), ..PeakConfig::default() }.build(period)?;
        // The phase at which the same detector reports the template's peak, in the second of two strides.
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
        // The detector ignores an angle that is not a number and counts the time on.
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
    /// Circular mean: mean of cosine and of sine of the phase at the strikes, and the number of strikes in it.
    mean: (f32, f32),
    strikes: u8,
    /// Frequency at the start of the hold, rad/s, and the change of phase by strikes since then, rad.
    held: f32,
    moved: f32,
}

/// Gains g and g_w of heel strikes, see the table of the module.
const STRIKE_GAIN: f32 = 0.7;
const STRIKE_FREQUENCY_GAIN: f32 = 0.25;
/// Time below which two strikes count as one that bounces, s.
const BOUNCE_S: f32 = 0.05;
/// Number of strikes that have to agree, and number of strikes in the mean.
const ENOUGH: u8 = 4;
const MEAN_OVER: u8 = 8;
/// Least squared length of the circular mean at which the strikes agree: a standard deviation of about 14 degrees.
const AGREE: f32 = 0.94;
/// Largest distance of a strike from the learned phase, and largest change of phase by all strikes of a hold, rad: a tenth of a stride.
const WITHIN: f32 = 0.1 * TAU;
/// Largest relative change of the stride frequency by all strikes of a hold.
const CADENCE: f32 = 0.05;

impl FootSwitch {
    const fn new(timer: StrideTimer) -> Self {
        Self { timer, struck: false, mean: (0.0, 0.0), strikes: 0, held: 0.0, moved: 0.0 }
    }

    const fn restarted(&self) -> Self {
        Self::new(self.timer.restarted())
    }

    /// Mean phase of the strikes; `None` if there are fewer than four or they do not agree.
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
            // While the phase is searched it is not known, and the steps of a standing person are no strides.
            return;
        }
        match interval {
            Interval::TooShort(interval) if interval < BOUNCE_S => {}
            Interval::TooShort(_) => self.strikes = 0,
            Interval::None => self.strike(lock, role, None),
            Interval::Stride(interval) => self.strike(lock, role, Some(interval)),
        }
    }

    /// A strike that is no bounce: learns its phase, or corrects phase and stride frequency. `interval` is the time of one or two strides, s.
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
