//! The cost of a search: the distance of the joints' angles from a target over time.
//!
//! ```text
//! J = mean over joints and samples of  w1 e^2 + w2 (de/dt)^2 + w3 (integral of e dt)^2,     e = recorded angle - network's angle
//! ```
//!
//! The thesis' own fitness F = c1 e + c2 de/dt + c3 integral of e dt is *signed*: its mean decreases without bound when the network is
//! above the recording, and errors of opposite sign cancel. [`Objective::Signed`] only demonstrates this; do not use it for a fit.

use gait_fit::search::Network;

/// The cost to minimise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Objective {
    /// J with the weights w1, w2 in s^2, w3 in 1/s^2.
    Squared([f64; 3]),
    /// Mean of F with the weights c1, c2 in s, c3 in 1/s, as the thesis prints it.
    Signed([f64; 3]),
}

impl Objective {
    /// Mean square error of the angle alone: the root of J is then the root mean square error in degrees.
    pub const ANGLE: Objective = Objective::Squared([1.0, 0.0, 0.0]);

    /// The cost; +infinity if a term is not finite, so that a diverged individual is the worst and the cost is never NaN.
    #[must_use]
    pub fn cost(&self, errors: &Errors) -> f64 {
        let (weights, terms) = match self {
            Objective::Squared(weights) => (weights, [errors.square, errors.rate_square, errors.integral_square]),
            Objective::Signed(weights) => (weights, [errors.signed, errors.rate_signed, errors.integral_signed]),
        };
        let cost: f64 = weights.iter().zip(terms).filter(|(w, _)| **w != 0.0).map(|(w, t)| w * t).sum();
        if cost.is_finite() { cost } else { f64::INFINITY }
    }
}

/// Means over joints and samples of the error, its rate and its integral. All but `square` are 0 if the objective does not need them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// e^2, deg^2.
    pub square: f64,
    /// (de/dt)^2, (deg/s)^2.
    pub rate_square: f64,
    /// (integral of e dt)^2, (deg s)^2.
    pub integral_square: f64,
    /// e, deg.
    pub signed: f64,
    /// de/dt, deg/s.
    pub rate_signed: f64,
    /// Integral of e dt, deg s.
    pub integral_signed: f64,
}

impl Errors {
    /// Root mean square error over all joints, degrees; +infinity for a diverged individual.
    #[must_use]
    pub fn rmse_deg(&self) -> f64 {
        let rmse = self.square.sqrt();
        if rmse.is_finite() { rmse } else { f64::INFINITY }
    }
}

/// Target angles and rates; sample k is at the time (k + 1) `sample_s`.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Seconds between samples.
    pub sample_s: f64,
    /// Degrees.
    pub angles: Vec<[f64; 4]>,
    /// Degrees per second.
    pub rates: Vec<[f64; 4]>,
}

impl Target {
    /// The motion of a network over `seconds`, integrated in f64 at 1 ms, with a sample every `sample_ms` milliseconds.
    #[must_use]
    pub fn of_network(network: &Network, seconds: f64, sample_ms: usize) -> Self {
        let (mut angles, mut rates) = (vec![], vec![]);
        let mut millisecond = 0;
        network.each_state(1e-3, (seconds * 1e3).round() as usize, |state| {
            millisecond += 1;
            if millisecond % sample_ms == 0 {
                angles.push(std::array::from_fn(|i| state.displacement[i] + network.joints[i].offset));
                rates.push(state.velocity);
            }
        });
        Self { sample_s: sample_ms as f64 * 1e-3, angles, rates }
    }
}
