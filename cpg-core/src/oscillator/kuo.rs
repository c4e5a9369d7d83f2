//! Kuo's pendulum: an oscillation driven by a clock, by the sensor, or by an observer that combines both.
//!
//! A limb that swings as a damped pendulum gets an impulse at each extreme, which keeps its amplitude. In units of its natural frequency:
//!
//! ```text
//! limb       th'' + 2 z th' + th = -J sgn(th) at each extreme (plus disturbance)
//! observer   x' = v + L1 e,   v' = -x - 2 z v + L2 e (plus the same impulses),   e = measured th - x
//! ```
//!
//! The impulses are given at the extremes of the observer. Its gains select one of three kinds of control (A. D. Kuo, "The
//! relative roles of feedforward and feedback in the control of rhythmic movements", Motor Control 6, 2002):
//!
//! | [`Drive`] | the observer | disturbance of the limb | noise of the sensor | sensor lost |
//! |---|---|---|---|---|
//! | feed-forward | L = 0: a clock | decays by the limb's own damping | no effect | no effect |
//! | feedback | replaced by the measurement | corrected at once | false triggers | the oscillation stops |
//! | hybrid | L in between | corrected in about 1/L | averaged over about 1/L | must be detected, see below |
//!
//! With both kinds of noise there is a best L between 0 and infinity. A failed sensor that is still used is worse than none: the observer
//! then tracks a constant angle, and the limb's amplitude falls to 0.57 at L = 0.5. Every [`Measurement`] therefore has a validity;
//! one that is not valid sets L to 0 for the tick, and the observer runs on as a clock.
//!
//! Angles are in units of the caller's choice (the model is linear), times in 1/(natural angular frequency).
//!
//! ```
//! use cpg_core::oscillator::kuo::{Drive, KuoConfig, Measurement, Pendulum};
//! let cycle = Pendulum::<f32>::new(0.1)?.cycle(1.0);
//! assert!((cycle.impulse - 0.887_899_5).abs() < 1e-5 && (cycle.half_period - 2.383_610).abs() < 1e-5);
//! // A clock needs no sensor: an impulse every half period, for a hundred time units.
//! let mut clock = KuoConfig::<f32> { damping: 0.1, amplitude: 1.0, drive: Drive::FeedForward }.build(0.01)?;
//! let lost = Measurement { angle: 0.0, rate: 0.0, valid: false };
//! let kicks = (0..10_000).filter(|_| clock.step(&lost).is_some()).count();
//! assert_eq!(kicks, 41);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use crate::error::in_range;
use crate::math::first_order::{Flow, rk4};
use crate::{BuildError, Field, Scalar};

/// Shortest and longest tick in the model's time.
pub const TICK_RANGE: (f32, f32) = (1e-5, 0.05);

/// Largest gain of the observer.
pub const MAX_GAIN: f32 = 100.0;

/// Largest product of gain and tick: the observer then stays far inside the region where integration is stable.
pub const MAX_GAIN_TICK: f32 = 0.5;

/// The damped pendulum between impulses; its state is angle and rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pendulum<T = f32> {
    damping: T,
}

/// An impulse inside a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kick<T = f32> {
    /// Time since the start of the tick.
    pub at: T,
    /// Change of the rate.
    pub impulse: T,
}

/// The limit cycle of a pendulum with an impulse at each extreme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle<T = f32> {
    /// Impulse J that keeps the amplitude.
    pub impulse: T,
    /// Time from one extreme to the next.
    pub half_period: T,
}

impl<T: Scalar> Flow<T, 2> for Pendulum<T> {
    fn derivative(&self, &[angle, rate]: &[T; 2]) -> [T; 2] {
        [rate, -angle - (self.damping + self.damping) * rate]
    }
}

impl<T: Scalar> Pendulum<T> {
    /// Of damping ratio `damping`, 0.01 to 0.5.
    ///
    /// # Errors
    /// `damping` out of range.
    pub fn new(damping: T) -> Result<Self, BuildError> {
        in_range(damping, Field::of("damping"), 0.01, 0.5)?;
        Ok(Self { damping })
    }

    /// The cycle of one amplitude.
    #[must_use]
    pub fn cycle(&self, amplitude: T) -> Cycle<T> {
        // Backwards from rest at -1 to where the angle is 1: there the rate is what an impulse has to give to one at rest. The damped
        // swing takes less than pi, so it is over after 315 steps of 0.01.
        let (mut state, mut elapsed) = ([-T::ONE, T::ZERO], T::ZERO);
        let step = T::ratio(1, 100);
        for _ in 0..400 {
            let mut next = state;
            rk4(self, &mut next, -step);
            if next[0] >= T::ONE {
                break;
            }
            (state, elapsed) = (next, elapsed + step);
        }
        let mut rest = step * T::ratio(1, 2);
        let mut end = state;
        for _ in 0..6 {
            end = state;
            rk4(self, &mut end, -rest);
            // Backwards in time the angle grows at minus the rate, which the damping keeps well below zero.
            rest += (end[0] - T::ONE) / end[1];
        }
        Cycle { impulse: -end[1] * amplitude, half_period: elapsed + rest }
    }

    /// One tick of the limb itself.
    pub fn advance(&self, state: &mut [T; 2], dt: T, kick: Option<&Kick<T>>) {
        let Some(kick) = kick else { return rk4(self, state, dt) };
        rk4(self, state, kick.at);
        let [_, rate] = state;
        *rate += kick.impulse;
        rk4(self, state, dt - kick.at);
    }
}

/// A measurement of the limb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement<T = f32> {
    /// Angle.
    pub angle: T,
    /// Rate; only [`Drive::Feedback`] reads it.
    pub rate: T,
    /// Whether angle and rate are valid: `false` sets the observer's gain to 0 for this tick.
    pub valid: bool,
}

/// Source of the timing of the impulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive<T = f32> {
    /// A clock: the observer with no gain.
    FeedForward,
    /// The measured limb itself.
    Feedback,
    /// The observer.
    Hybrid {
        /// Gains of the angle error on the angle (L1) and on the rate (L2), 0 to [`MAX_GAIN`].
        gain: [T; 2],
    },
}

/// Configuration of the control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KuoConfig<T = f32> {
    /// Damping ratio z of the limb, 0.01 to 0.5.
    pub damping: T,
    /// Wanted amplitude, 0.001 to 1000.
    pub amplitude: T,
    /// Source of the timing.
    pub drive: Drive<T>,
}

/// The control at a fixed tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kuo<T = f32> {
    observer: Observer<T>,
    feedback: bool,
    impulse: T,
    dt: T,
    start: [T; 2],
    /// Angle and rate of the observer.
    estimate: [T; 2],
}

impl<T: Scalar> KuoConfig<T> {
    /// Validates the configuration for a tick of `dt` in the model's time. The observer starts just after an impulse at the positive
    /// extreme.
    ///
    /// # Errors
    /// [`BuildError`] naming the first field that is not allowed.
    pub fn build(&self, dt: T) -> Result<Kuo<T>, BuildError> {
        let limb = Pendulum::new(self.damping)?;
        in_range(self.amplitude, Field::of("amplitude"), 0.001, 1000.0)?;
        in_range(dt, Field::of("dt"), TICK_RANGE.0, TICK_RANGE.1)?;
        let gain = match self.drive {
            Drive::Hybrid { gain } => gain,
            Drive::FeedForward | Drive::Feedback => [T::ZERO; 2],
        };
        let max = (MAX_GAIN_TICK / dt.to_f32()).min(MAX_GAIN);
        crate::error::all_in_range(gain, "gain", 0.0, max)?;
        let impulse = limb.cycle(self.amplitude).impulse;
        let start = [self.amplitude, -impulse];
        let observer = Observer { limb, gain, pull: [T::ZERO; 2] };
        let feedback = matches!(self.drive, Drive::Feedback);
        Ok(Kuo { observer, feedback, impulse, dt, start, estimate: start })
    }
}

/// The observer: the pendulum with a correction by the measured angle. The correction is that of the error at the start of the tick, so
/// that an observer that agrees with the limb still agrees with it at the next measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Observer<T> {
    limb: Pendulum<T>,
    gain: [T; 2],
    /// Gain times error, in this tick.
    pull: [T; 2],
}

impl<T: Scalar> Flow<T, 2> for Observer<T> {
    fn derivative(&self, state: &[T; 2]) -> [T; 2] {
        let [rate, acceleration] = self.limb.derivative(state);
        [rate + self.pull[0], acceleration + self.pull[1]]
    }
}

impl<T: Scalar> Kuo<T> {
    /// One tick, from the measurement at its start. Returns the impulse inside this tick, if there is one.
    pub fn step(&mut self, measured: &Measurement<T>) -> Option<Kick<T>> {
        // A measurement that is not a number is ignored.
        let valid = measured.valid && measured.angle.is_finite() && measured.rate.is_finite();
        let start = match (self.feedback, valid) {
            (true, true) => [measured.angle, measured.rate],
            // Without a measurement there is no oscillation.
            (true, false) => [T::ZERO; 2],
            (false, _) => self.estimate,
        };
        let dt = self.dt;
        let error = if valid && !self.feedback { measured.angle - start[0] } else { T::ZERO };
        self.observer.pull = self.observer.gain.map(|gain| gain * error);

        let mut end = start;
        rk4(&self.observer, &mut end, dt);
        // A noisy measurement can pass the extreme between two ticks.
        let at = if is_extreme(start[0], self.estimate[1], start[1]) {
            Some(T::ZERO)
        } else {
            is_extreme(end[0], start[1], end[1]).then(|| self.extreme(&start, &end))
        };
        let kick = at.map(|at| Kick { at, impulse: if start[0] > T::ZERO { -self.impulse } else { self.impulse } });
        if let Some(kick) = &kick {
            end = start;
            rk4(&self.observer, &mut end, kick.at);
            end[1] += kick.impulse;
            rk4(&self.observer, &mut end, dt - kick.at);
        }
        self.estimate = end;
        kick
    }

    /// Time in the tick at which the rate is 0: secant, then two steps of Newton's method.
    fn extreme(&self, start: &[T; 2], end: &[T; 2]) -> T {
        let mut at = self.dt * start[1] / (start[1] - end[1]);
        for _ in 0..2 {
            let mut there = *start;
            rk4(&self.observer, &mut there, at);
            let slope = self.observer.derivative(&there)[1];
            let next = at - there[1] / slope;
            if next >= T::ZERO && next <= self.dt {
                at = next;
            }
        }
        at
    }

    /// The impulse J.
    #[must_use]
    pub fn impulse(&self) -> T {
        self.impulse
    }

    /// Angle and rate of the limb as the control estimates them.
    #[must_use]
    pub fn estimate(&self) -> [T; 2] {
        self.estimate
    }

    /// Returns to the built state.
    pub fn reset(&mut self) {
        self.estimate = self.start;
    }
}

/// Whether a rate that goes from `before` to `after` turns back from an extreme on the side of `angle`.
fn is_extreme<T: Scalar>(angle: T, before: T, after: T) -> bool {
    let zero = T::ZERO;
    (angle > zero && before > zero && after <= zero) || (angle < zero && before < zero && after >= zero)
}
