//! Detects a stop by comparing measured with predicted motion.

/// Mean square of the innovation against that of the amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Innovation {
    square: f32,
}

/// Time constant of the mean, s.
const INNOVATION_S: f32 = 0.4;

impl Innovation {
    pub(crate) const fn new() -> Self {
        Self { square: 0.0 }
    }

    pub(crate) fn step(&mut self, innovation: f32, period_s: f32) {
        self.square += (innovation * innovation - self.square) * (period_s / INNOVATION_S).min(1.0);
    }

    /// Root mean square, radians.
    pub(crate) fn root(&self) -> f32 {
        libm::sqrtf(self.square)
    }
}

/// Mean absolute rate of the measured joint and of its prediction.
///
/// The measured angle is smoothed before it is differentiated: else the rate would be that of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Activity {
    smooth: Option<f32>,
    measured: f32,
    /// Smoothed rate now.
    rate: f32,
    /// A little earlier in the stride, now, and a little later.
    predicted: [f32; 3],
    /// How long it has been idle, s.
    idle_for: f32,
    /// How long it has hardly moved at all, s.
    still_for: f32,
}

/// Time constant of the smoothed angle, s.
const SMOOTH_S: f32 = 0.025;
/// Time constant of the mean rates, s.
const ACTIVITY_S: f32 = 0.14;
/// Fraction of the predicted rate below which the joint lags.
const LAG_RATE_FRACTION: f32 = 0.35;
/// Fraction of the template's mean rate below which the joint counts as stationary: a knee in stance moves faster.
const STOP_RATE_FRACTION: f32 = 0.06;
/// Fraction of the template's mean rate below which the joint is still.
const STILL_RATE_FRACTION: f32 = 0.1;
/// How long a joint must be still to stand, s: a stiff knee is still for 0.4 s in stance.
const STILL_S: f32 = 0.6;
/// Fraction of the predicted rate below which the joint is idle.
const IDLE_RATE_FRACTION: f32 = 0.36;

impl Activity {
    pub(crate) const fn new() -> Self {
        Self { smooth: None, measured: 0.0, rate: 0.0, predicted: [0.0; 3], idle_for: 0.0, still_for: 0.0 }
    }

    /// One tick: the angle, the predicted rates, and the template's mean absolute rate at the person's cadence, rad/s.
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
            least = least.min(*predicted);
        }
        let idle = self.measured < IDLE_RATE_FRACTION * least && least > 0.35 * usual;
        self.idle_for = if idle || self.measured < STOP_RATE_FRACTION * usual { self.idle_for + period_s } else { 0.0 };
        self.still_for = if self.measured < STILL_RATE_FRACTION * usual { self.still_for + period_s } else { 0.0 };
    }

    /// Whether the person has stopped.
    pub(crate) fn has_stopped(&self) -> bool {
        self.idle_for > 0.03 || self.is_still()
    }

    /// Whether the joint stands, whatever the prediction.
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

    /// Whether it is idle now.
    pub(crate) const fn is_idle(&self) -> bool {
        self.idle_for > 0.0
    }

    /// Starts the idle time again.
    pub(crate) const fn rest(&mut self) {
        self.idle_for = 0.0;
    }
}
