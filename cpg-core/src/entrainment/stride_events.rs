//! Estimates phase and stride frequency from one event a stride: a heel strike (foot switch) or a peak of a joint's angle.
//!
//! ```text
//! between events:  phi' = w
//! at an event:     phi := phi + g d,   w := w + g_w (2 pi / T - w),   d = wrap(phi_event - phi)
//! ```
//! phi is the gait phase (rad here, a [`Phase`] in the code), w its angular frequency in rad/s, phi_event the phase of the event in the
//! stride, T the time since the previous event in s, g and g_w the gains; wrap maps to -pi..pi.
//!
//! The interval T decides how an event is used: shorter than the shortest stride, and the event is ignored (a bounce of the switch); longer
//! than the longest, and strides were missed, so that only phase is corrected and not the stride frequency. With g = g_w = 1 two exact events give
//! phase and stride frequency exactly.
//!
//! [`StrideEvents`] is a complete estimator that uses events only. A [`Follower`](crate::entrainment::Follower) uses an angle and, with
//! [`EventSource`](crate::entrainment::EventSource), events beside it; the rules for intervals are the same.
//!
//! [`PeakDetector`] finds the peaks of an angle: it reports a peak once the angle has fallen by a fraction of the peak's height, and returns
//! the time since the peak.

use core::f32::consts::TAU;

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::in_range;
use crate::{BuildError, Field};

/// Parameters of [`StrideEvents`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrideEventConfig {
    /// Nominal stride time: the estimate before the second event, s; 0.3 to 5, default 1.1.
    pub stride_s: f32,
    /// Phase of the event in the stride, phi_event; default 0.
    pub phase: Phase,
    /// Gain g: fraction of the phase difference that an event corrects; 0.05 to 1, default 1.
    pub phase_gain: f32,
    /// Gain g_w: fraction of the frequency difference that an event corrects; 0 to 1, default 0.5.
    pub frequency_gain: f32,
    /// Shortest and longest interval that counts as one stride, in nominal strides; 0.1 to 1 and 1 to 10, default 0.5 and 2.5.
    pub intervals: (f32, f32),
}

impl Default for StrideEventConfig {
    /// The default of each field.
    fn default() -> Self {
        Self { stride_s: 1.1, phase: Phase(0), phase_gain: 1.0, frequency_gain: 0.5, intervals: (0.5, 2.5) }
    }
}

impl StrideEventConfig {
    /// Validates the configuration; the estimate begins at phase 0 with the nominal stride frequency.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range. Any period is allowed.
    pub fn build(self, period: Period) -> Result<StrideEvents, BuildError> {
        in_range(self.stride_s, Field::of("stride_s"), 0.3, 5.0)?;
        in_range(self.phase_gain, Field::of("phase_gain"), 0.05, 1.0)?;
        in_range(self.frequency_gain, Field::of("frequency_gain"), 0.0, 1.0)?;
        in_range(self.intervals.0, Field::at("intervals", 0), 0.1, 1.0)?;
        in_range(self.intervals.1, Field::at("intervals", 1), 1.0, 10.0)?;
        Ok(StrideEvents {
            config: self,
            period_s: period.seconds(),
            phase: Phase(0),
            frequency: TAU / self.stride_s,
            timer: StrideTimer::new(self.stride_s, self.intervals, period),
        })
    }
}

/// Measures the time from one event to the next and classifies it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StrideTimer {
    period_s: f32,
    /// Shortest and longest stride, s.
    least: f32,
    most: f32,
    /// Time since the last event, s; `None` before the first.
    since: Option<f32>,
}

/// Class of the time between two events, with that time in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Interval {
    /// First event, or the interval is longer than the longest stride: events were missed.
    None,
    /// Shorter than the shortest stride: the event is ignored, and the previous one remains the last.
    TooShort(f32),
    /// One stride.
    Stride(f32),
}

impl StrideTimer {
    /// A timer before its first event. `intervals` are the shortest and longest stride, in nominal strides.
    pub(crate) const fn new(stride_s: f32, intervals: (f32, f32), period: Period) -> Self {
        let (least, most) = (intervals.0 * stride_s, intervals.1 * stride_s);
        Self { period_s: period.seconds(), least, most, since: None }
    }

    /// The same timer before its first event.
    pub(crate) const fn restarted(&self) -> Self {
        Self { since: None, ..*self }
    }

    /// Advances by one control period.
    pub(crate) fn step(&mut self) {
        // Beyond the longest stride the exact time is not needed, so it is limited.
        self.since = self.since.map(|since| (since + self.period_s).min(2.0 * self.most));
    }

    /// An event that happened `ago_s` seconds before now. `ago_s` is limited to 0 to the shortest stride, and 0 if it is not finite. Returns
    /// the class of the interval, and the limited `ago_s`.
    pub(crate) fn event(&mut self, ago_s: f32) -> (Interval, f32) {
        let ago = if ago_s.is_finite() { ago_s.max(0.0).min(self.least) } else { 0.0 };
        let interval = match self.since.map(|since| since - ago) {
            Some(interval) if interval < self.least => return (Interval::TooShort(interval), ago),
            Some(interval) if interval <= self.most => Interval::Stride(interval),
            _ => Interval::None,
        };
        self.since = Some(ago);
        (interval, ago)
    }
}

/// Estimator of phase and stride frequency from events only. Call [`StrideEvents::step`] once a tick, and [`StrideEvents::event`] after it in a tick
/// with an event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrideEvents {
    config: StrideEventConfig,
    period_s: f32,
    phase: Phase,
    /// rad/s.
    frequency: f32,
    timer: StrideTimer,
}

/// Effect of an event on the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Taken {
    /// Phase and stride frequency were corrected.
    Stride,
    /// Only the phase was corrected: the first event, or the first after missed strides.
    PhaseOnly,
    /// None: sooner after the previous event than the shortest stride.
    TooSoon,
}

impl StrideEvents {
    /// Advances by one control period.
    pub fn step(&mut self) {
        self.phase += Phase::from_cycles(self.frequency * self.period_s * (1.0 / TAU));
        self.timer.step();
    }

    /// Corrects phase and stride frequency with an event that happened `ago_s` seconds before now. `ago_s` is limited to 0 to the shortest stride, and
    /// counts as 0 if it is not finite.
    ///
    /// ```
    /// use cpg_core::entrainment::stride_events::{StrideEventConfig, Taken};
    /// use joint_units::Period;
    /// let mut events = StrideEventConfig::default().build(Period::MILLISECOND)?;
    /// assert_eq!(events.event(0.0), Taken::PhaseOnly);
    /// for _ in 0..1000 { events.step(); }
    /// assert_eq!(events.event(0.0), Taken::Stride); // a stride of 1 s, nominal is 1.1
    /// assert!((events.frequency().0 - 0.5 * (1.0 / 1.1 + 1.0) * core::f32::consts::TAU).abs() < 1e-3);
    /// # Ok::<(), cpg_core::BuildError>(())
    /// ```
    pub fn event(&mut self, ago_s: f32) -> Taken {
        let (interval, ago) = self.timer.event(ago_s);
        let taken = match interval {
            Interval::TooShort(_) => return Taken::TooSoon,
            Interval::Stride(interval) => {
                self.frequency += self.config.frequency_gain * (TAU / interval - self.frequency);
                Taken::Stride
            }
            Interval::None => Taken::PhaseOnly,
        };
        let now = self.config.phase + Phase::from_cycles(ago * self.frequency * (1.0 / TAU));
        self.phase += Phase::from_cycles(self.config.phase_gain * now.cycles_after(self.phase));
        taken
    }

    /// Estimated gait phase.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// Estimated angular frequency of the stride, w: 2 pi / stride time.
    #[must_use]
    pub const fn frequency(&self) -> RadPerSec {
        RadPerSec(self.frequency)
    }
}

/// Parameters of a [`PeakDetector`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakConfig {
    /// Least height of a peak above the trough before it; 0.02 to 3 rad, default 15 degrees.
    pub least: Radians,
    /// Fall from the peak after which it is reported, as a fraction of its height; 0.05 to 0.9, default 0.2.
    pub fall: f32,
}

impl Default for PeakConfig {
    /// The default of each field.
    fn default() -> Self {
        Self { least: Radians::from_degrees(15.0), fall: 0.2 }
    }
}

impl PeakConfig {
    /// Validates the configuration and builds a detector that has seen no angle.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range. Any period is allowed.
    pub fn build(self, period: Period) -> Result<PeakDetector, BuildError> {
        in_range(self.least.0, Field::of("least"), 0.02, 3.0)?;
        in_range(self.fall, Field::of("fall"), 0.05, 0.9)?;
        Ok(PeakDetector { config: self, period_s: period.seconds(), range: None, since_top: 0.0, reported: false })
    }
}

/// Detects the peaks of an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakDetector {
    config: PeakConfig,
    period_s: f32,
    /// The trough before the present rise and the greatest angle since, rad; `None` before the first angle.
    range: Option<(f32, f32)>,
    /// Time since that greatest angle, s.
    since_top: f32,
    /// The peak has been reported; the detector waits for the next rise.
    reported: bool,
}

impl PeakDetector {
    /// Advances by one control period, with the angle at its end. Returns the time since the peak in s, once for each peak, in the tick in
    /// which it is found. An angle that is not finite is ignored, the time counts on.
    ///
    /// ```
    /// use cpg_core::entrainment::stride_events::PeakConfig;
    /// use joint_units::{Period, Radians};
    /// let mut detector = PeakConfig::default().build(Period::MILLISECOND)?;
    /// // A joint that swings by 0.5 rad about 0.5, one cycle in 1 s: its peak is at 500 ms.
    /// let angle = |tick: u32| Radians(0.5 - 0.5 * (tick as f32 * 1e-3 * core::f32::consts::TAU).cos());
    /// let found = (0..1000).find_map(|tick| detector.step(angle(tick)).map(|ago_s| (tick, ago_s)));
    /// let (tick, ago_s) = found.expect("one peak");
    /// assert!((tick as f32 * 1e-3 - ago_s - 0.5).abs() < 2e-3);
    /// # Ok::<(), cpg_core::BuildError>(())
    /// ```
    pub fn step(&mut self, angle: Radians) -> Option<f32> {
        let y = angle.0;
        self.since_top += self.period_s;
        if !y.is_finite() {
            return None;
        }
        let (trough, top) = self.range.unwrap_or((y, y));
        if self.reported {
            // The trough follows the falling angle, until the angle has risen from it by `fall` times `least`.
            let trough = trough.min(y);
            self.reported = y - trough < self.config.fall * self.config.least.0;
            self.range = Some((trough, y));
            self.since_top = 0.0;
            return None;
        }
        if y >= top {
            self.range = Some((trough, y));
            self.since_top = 0.0;
            return None;
        }
        if y < trough {
            // Lower than the trough: the rise was too small for a peak, and this angle is the new trough.
            self.range = Some((y, y));
            self.since_top = 0.0;
            return None;
        }
        self.range = Some((trough, top));
        let height = top - trough;
        if height >= self.config.least.0 && top - y >= self.config.fall * height {
            self.reported = true;
            self.range = Some((y, y));
            return Some(self.since_top);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two events without noise are enough to lock, from any frequency and phase.
    #[test]
    fn two_events_lock() {
        let config = StrideEventConfig { frequency_gain: 1.0, ..StrideEventConfig::default() };
        for mismatch in [0.6, 0.8, 1.2, 1.4] {
            for start in 0..50u32 {
                let mut events =
                    StrideEventConfig { stride_s: 1.1 * mismatch, ..config }.build(Period::MILLISECOND).unwrap();
                let mut count = 0;
                for tick in 1..6000u32 {
                    events.step();
                    if (tick + 22 * start) % 1100 == 0 {
                        events.event(0.0);
                        count += 1;
                    }
                    if count >= 2 {
                        let person = ((tick + 22 * start) % 1100) as f32 / 1100.0;
                        assert!(events.phase().cycles_after(Phase::from_cycles(person)).abs() < 0.005);
                        assert!((events.frequency().0 * 1.1 / TAU - 1.0).abs() < 0.002);
                    }
                }
                assert!(count >= 4);
            }
        }
    }

    #[test]
    fn bounces_and_missed_steps_are_no_strides() {
        let mut events = StrideEventConfig::default().build(Period::MILLISECOND).unwrap();
        let nominal = events.frequency();
        let after = |events: &mut StrideEvents, ticks: u32| {
            (0..ticks).for_each(|_| events.step());
            events.event(0.0)
        };
        assert_eq!(after(&mut events, 10), Taken::PhaseOnly);
        assert_eq!(after(&mut events, 540), Taken::TooSoon);
        assert_eq!(after(&mut events, 560), Taken::Stride);
        assert!((events.frequency().0 - nominal.0).abs() < 0.01);
        assert_eq!(after(&mut events, 2800), Taken::PhaseOnly);
        assert!((events.frequency().0 - nominal.0).abs() < 0.01);
        assert!((events.phase().0 as i32).unsigned_abs() < 2000);
        assert_eq!(after(&mut events, 1_000_000), Taken::PhaseOnly);
    }

    /// Peaks of a knee of two harmonics with noise: one a stride, at the top; the small bump of stance is none.
    #[test]
    fn peaks_are_the_tops() {
        let mut peaks = PeakConfig::default().build(Period::MILLISECOND).unwrap();
        let mut seed = 3u32;
        let (mut peaks_found, mut worst) = (0, 0.0f32);
        for tick in 0..20_000u32 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = ((seed >> 8) as f32 / 16_777_216.0 - 0.5) * 0.02;
            let turn = TAU * (tick % 1000) as f32 * 1e-3;
            let knee = 0.45 - 0.35 * turn.cos() - 0.2 * (2.0 * turn).cos() + noise;
            if let Some(ago) = peaks.step(Radians(knee)) {
                // The top is at half a stride, but for what the harmonics do: 0.45 + 0.35 - 0.2; tops at cos = -0.35/0.8.
                let at = (tick % 1000) as f32 * 1e-3 - ago;
                let top = 0.321;
                worst = worst.max((at - top).abs().min((at - (1.0 - top)).abs()));
                peaks_found += 1;
            }
        }
        assert!((19..=21).contains(&peaks_found), "{peaks_found} peaks in 20 strides");
        assert!(worst < 0.03, "{worst} s off");
    }

    #[test]
    fn what_is_not_finite_does_nothing_and_bad_fields_are_named() {
        let mut peaks = PeakConfig::default().build(Period::MILLISECOND).unwrap();
        assert_eq!(peaks.step(Radians(f32::NAN)), None);
        let mut events = StrideEventConfig::default().build(Period::MILLISECOND).unwrap();
        events.event(f32::NAN);
        assert!(events.frequency().0.is_finite());
        let error = |config: StrideEventConfig| config.build(Period::MILLISECOND).unwrap_err().to_string();
        let good = StrideEventConfig::default();
        assert!(error(StrideEventConfig { stride_s: 0.0, ..good }).contains("stride_s"));
        assert!(error(StrideEventConfig { phase_gain: 2.0, ..good }).contains("phase_gain"));
        assert!(error(StrideEventConfig { frequency_gain: f32::NAN, ..good }).contains("frequency_gain"));
        assert!(error(StrideEventConfig { intervals: (0.5, 0.9), ..good }).contains("intervals[1]"));
        let error = |config: PeakConfig| config.build(Period::MILLISECOND).unwrap_err().to_string();
        assert!(error(PeakConfig { least: Radians(0.0), fall: 0.2 }).contains("least"));
        assert!(error(PeakConfig { least: Radians(0.3), fall: 1.0 }).contains("fall"));
    }
}
