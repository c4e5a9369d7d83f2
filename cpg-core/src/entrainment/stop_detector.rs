//! Detects a stop of the person by comparing the measured rate of the joint with the predicted one.
//!
//! Two rules, both on mean absolute rates (low-passed over 0.14 s):
//! - *idle*: the joint moves at less than 0.36 of the rate predicted for it, while the prediction is a real motion; or at less than 0.06 of its
//!   usual rate. After 0.03 s the person has stopped. To allow for a person who is a little early or late, the least prediction of three
//!   phases counts, and a joint whose rate at this moment is 0.3 of its usual rate or more is not idle: the mean rate of a knee that swings
//!   late is low until 0.1 s after the swing has begun.
//! - *still*: the joint moves at less than 0.1 of its usual rate for 0.6 s, whatever the prediction.
//!
//! The usual rate is the mean absolute rate of the template at the estimated stride frequency.

use joint_units::order::lesser;

/// Running mean square of the innovation: measured minus predicted angle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Innovation {
    square: f32,
    /// Of the square: it is asked more than once a tick.
    root: f32,
}

/// Time constant of that mean, s.
const INNOVATION_S: f32 = 0.4;

impl Innovation {
    pub(crate) const fn new() -> Self {
        Self { square: 0.0, root: 0.0 }
    }

    /// Takes the innovation of one tick, rad.
    pub(crate) fn step(&mut self, innovation: f32, period_s: f32) {
        self.square += (innovation * innovation - self.square) * (period_s / INNOVATION_S).min(1.0);
        self.root = libm::sqrtf(self.square);
    }

    /// Root mean square, radians.
    pub(crate) const fn root(&self) -> f32 {
        self.root
    }
}

/// Mean absolute rates of the measured joint and of its prediction, and the rules above.
///
/// The measured angle is low-passed before it is differentiated, because the rate of its noise would be larger than its own.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Activity {
    /// Low-passed angle, rad; `None` before the first sample.
    smooth: Option<f32>,
    /// Mean absolute rate of the joint, rad/s.
    measured: f32,
    /// Low-passed rate now, rad/s.
    rate: f32,
    /// Mean absolute predicted rate, rad/s: a little earlier in the stride, at the estimated phase, and a little later.
    predicted: [f32; 3],
    /// Time for which the joint has been idle, s.
    idle_for: f32,
    /// Time for which the joint has been still, s.
    still_for: f32,
}

/// Time constant of the low-passed angle, s.
const SMOOTH_S: f32 = 0.025;
/// Time constant of the mean rates, s.
const ACTIVITY_S: f32 = 0.14;
/// Fraction of the predicted rate below which the joint lags.
const LAG_RATE_FRACTION: f32 = 0.35;
/// Fraction of the usual rate below which the joint is idle whatever the prediction: a knee in stance moves faster.
const STOP_RATE_FRACTION: f32 = 0.06;
/// Fraction of the usual rate below which the joint is still.
const STILL_RATE_FRACTION: f32 = 0.1;
/// Time for which a joint must be still to count as stopped, s: a stiff knee is still for 0.4 s in stance.
const STILL_S: f32 = 0.6;
/// Fraction of the usual rate from which on a joint moves on, however slow it has been.
const MOVING_RATE_FRACTION: f32 = 0.3;
/// Fraction of the predicted rate below which the joint is idle.
const IDLE_RATE_FRACTION: f32 = 0.36;

impl Activity {
    pub(crate) const fn new() -> Self {
        Self { smooth: None, measured: 0.0, rate: 0.0, predicted: [0.0; 3], idle_for: 0.0, still_for: 0.0 }
    }

    /// Takes the angle of one tick (rad), the predicted rates at the three phases (rad/s), and the usual rate (rad/s).
    pub(crate) fn step(&mut self, angle: f32, predicted_rates: [f32; 3], usual: f32, period_s: f32) {
        let before = self.smooth.unwrap_or(angle);
        let rate = (angle - before) / SMOOTH_S.max(period_s);
        self.smooth = Some(before + rate * period_s);
        self.rate = rate;
        let share = (period_s / ACTIVITY_S).min(1.0);
        self.measured += (rate.abs() - self.measured) * share;
        let mut least = f32::MAX;
        for (predicted, rate) in self.predicted.iter_mut().zip(predicted_rates) {
            *predicted += (rate.abs() - *predicted) * share;
            least = lesser(*predicted, least);
        }
        let slow = rate.abs() < MOVING_RATE_FRACTION * usual;
        let idle = slow && self.measured < IDLE_RATE_FRACTION * least && least > 0.35 * usual;
        self.idle_for = if idle || self.measured < STOP_RATE_FRACTION * usual { self.idle_for + period_s } else { 0.0 };
        self.still_for = if self.measured < STILL_RATE_FRACTION * usual { self.still_for + period_s } else { 0.0 };
    }

    /// Whether the person has stopped: the joint is idle for 0.03 s, or still for 0.6 s.
    pub(crate) fn has_stopped(&self) -> bool {
        self.idle_for > 0.03 || self.is_still()
    }

    /// Whether the joint has been still for 0.6 s.
    pub(crate) fn is_still(&self) -> bool {
        self.still_for > STILL_S
    }

    /// Whether the joint lags behind this predicted rate, rad/s.
    pub(crate) fn lags(&self, predicted_rate: f32) -> bool {
        let along = if predicted_rate < 0.0 { -self.rate } else { self.rate };
        along < LAG_RATE_FRACTION * predicted_rate.abs()
    }

    /// Mean absolute rate now, rad/s.
    pub(crate) const fn mean_rate(&self) -> f32 {
        self.measured
    }

    /// Whether the joint is idle now.
    pub(crate) const fn is_idle(&self) -> bool {
        self.idle_for > 0.0
    }

    /// Sets the idle time to 0.
    pub(crate) const fn rest(&mut self) {
        self.idle_for = 0.0;
    }
}
