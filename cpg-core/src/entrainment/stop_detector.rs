//! What a joint does against what it was foretold to do: how a walker who stops is told from one who walks.

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

/// How much a joint moves against how much it is foretold to: what tells a walker who stops.
///
/// Mean absolute rates over a time constant; the measured angle is smoothed first, as differences of noise would be all there is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Activity {
    smooth: Option<f32>,
    measured: f32,
    /// Smoothed rate now.
    rate: f32,
    /// A little earlier in the stride, now, and a little later.
    foretold: [f32; 3],
    /// How long it has been idle, s.
    idle_for: f32,
    /// How long it has hardly moved at all, s.
    still_for: f32,
}

/// Time constants, s.
const SMOOTH_S: f32 = 0.025;
const ACTIVITY_S: f32 = 0.14;
/// Part of the foretold rate below which it stays behind.
const LAGS: f32 = 0.35;
/// Part of the usual rate below which not even a knee in stance is that walks.
const RESTS: f32 = 0.06;
/// Part of the usual rate below which it hardly moves, and for how long it does when it stands, s.
const STILL: f32 = 0.1;
/// See [`STILL`]; a stiff knee rests 0.4 s in stance.
const STILL_S: f32 = 0.6;
/// Part of the foretold movement below which it is idle.
const IDLE: f32 = 0.36;

impl Activity {
    pub(crate) const fn new() -> Self {
        Self { smooth: None, measured: 0.0, rate: 0.0, foretold: [0.0; 3], idle_for: 0.0, still_for: 0.0 }
    }

    /// One tick: the angle, the foretold rate, and the mean absolute rate of the template at the walker's cadence.
    pub(crate) fn step(&mut self, angle: f32, predicted_rates: [f32; 3], usual: f32, period_s: f32) {
        let before = self.smooth.unwrap_or(angle);
        let rate = (angle - before) / SMOOTH_S.max(period_s);
        self.smooth = Some(before + rate * period_s);
        self.rate = rate;
        let share = (period_s / ACTIVITY_S).min(1.0);
        self.measured += (rate.abs() - self.measured) * share;
        let mut least = f32::MAX;
        for (foretold, rate) in self.foretold.iter_mut().zip(predicted_rates) {
            *foretold += (rate.abs() - *foretold) * share;
            least = least.min(*foretold);
        }
        let idle = self.measured < IDLE * least && least > 0.35 * usual;
        self.idle_for = if idle || self.measured < RESTS * usual { self.idle_for + period_s } else { 0.0 };
        self.still_for = if self.measured < STILL * usual { self.still_for + period_s } else { 0.0 };
    }

    /// Whether the walker has stopped.
    pub(crate) fn has_stopped(&self) -> bool {
        self.idle_for > 0.03 || self.is_still()
    }

    /// Whether it stands, whatever it was foretold to do.
    pub(crate) fn is_still(&self) -> bool {
        self.still_for > STILL_S
    }

    /// Whether the joint stays behind while it is foretold to move at this rate, rad/s.
    pub(crate) fn lags(&self, foretold_rate: f32) -> bool {
        let along = if foretold_rate < 0.0 { -self.rate } else { self.rate };
        along < LAGS * foretold_rate.abs()
    }

    /// Mean absolute rate now, rad/s.
    pub(crate) const fn mean_rate(&self) -> f32 {
        self.measured
    }

    /// Whether it is idle now.
    pub(crate) const fn is_idle(&self) -> bool {
        self.idle_for > 0.0
    }

    /// Forgets what was foretold: what comes next is a new walk.
    pub(crate) const fn rest(&mut self) {
        self.idle_for = 0.0;
    }
}
