//! Joint angles as weighted sums of the states of a flow.
//!
//! ```text
//! a_j = offset_j + sum_d weight_jd s_d,   s' = f(s) cycle / stride
//! ```
//! The flow's own time is scaled so that its cycle lasts one stride. [`Readout`] weighs all states for any number of joints;
//! [`LinearJoints`] weighs chosen states for hips and knees, and its gait phase begins where the left hip is most flexed. The weights come
//! from a linear least-squares fit to a recorded stride; those of [`crate::gait::catalogue`] are in [`crate::gait::fitted`].
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::joints::linear::{PhasePlane, ReadoutConfig};
//! use cpg_core::oscillator::hopf::Hopf;
//! use joint_units::{Period, Radians};
//! // A hip and a knee on the circle of a Hopf oscillator, the knee a quarter behind.
//! let flow = Hopf { gain: 8.0, square_radius: 1.0, frequency: core::f32::consts::TAU };
//! let config = ReadoutConfig {
//!     start: [1.0, 0.0],
//!     cycle: 1.0,
//!     stride_s: 1.2,
//!     weights: [[0.3, 0.0], [0.0, 0.4]],
//!     offsets: [Radians(0.1), Radians(0.5)],
//!     plane: PhasePlane { x: 0, y: 1, centre: (0.0, 0.0), radius: (1.0, 1.0) },
//!     bound: 5.0,
//! };
//! let mut walk = config.build(flow, Period::MILLISECOND)?;
//! for _ in 0..300 {
//!     walk.step();
//! }
//! assert!((walk.angles()[0].0 - 0.1).abs() < 1e-4 && (walk.angles()[1].0 - 0.9).abs() < 1e-4);
//! assert!((walk.phase().cycles() - 0.25).abs() < 1e-4);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::{all_in_range, allow_period, in_range};
use crate::joints::features::{Features, fill};
use crate::math::first_order::{Flow, rk4};
use crate::{BuildError, Field, Generator, Scalar, StateFault};

/// Read-out of a flow of D states for N joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadoutConfig<const D: usize, const N: usize> {
    /// The state on the limit cycle at which the gait begins: each within ±`bound`.
    pub start: [f32; D],
    /// Units of the model's time that one cycle takes; above 0.
    pub cycle: f32,
    /// Stride in seconds, 0.2 to 20.
    pub stride_s: f32,
    /// Weight of each state for each joint, in radians per unit of the state; up to ±100. Errors count them row by row.
    pub weights: [[f32; D]; N],
    /// Angle of each joint where all states are 0; up to ±100 rad, as the states' means count into it.
    pub offsets: [Radians; N],
    /// The two states that define the phase, and the centre of the cycle in their plane.
    pub plane: PhasePlane,
    /// Bound of the absolute value of every state; above 0.
    pub bound: f32,
}

/// A plane of two states for the read-out of phase and amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhasePlane {
    /// Index of the state along the first axis, where phase 0 lies.
    pub x: usize,
    /// Index of the state along the second axis.
    pub y: usize,
    /// Centre of the cycle.
    pub centre: (f32, f32),
    /// Mean distance from the centre along each axis; its sign turns the axis, so that every cycle runs anticlockwise.
    pub radius: (f32, f32),
}

/// A flow with its read-out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readout<F, const D: usize, const N: usize> {
    flow: F,
    config: ReadoutConfig<D, N>,
    /// Model time per tick and per second.
    per_tick: f32,
    per_second: f32,
    state: [f32; D],
}

impl<const D: usize, const N: usize> ReadoutConfig<D, N> {
    /// Validates the configuration for a flow and a control period; the flow starts at the configured state.
    ///
    /// # Errors
    /// Names the field that is out of range; `PeriodTooLong` for fewer than 50 ticks a stride.
    pub fn build<F: Flow<f32, D>>(&self, flow: F, period: Period) -> Result<Readout<F, D, N>, BuildError> {
        in_range(self.bound, Field::of("bound"), 1e-6, 1e6)?;
        all_in_range(self.start, "start", -self.bound, self.bound)?;
        in_range(self.cycle, Field::of("cycle"), 1e-3, 1e6)?;
        in_range(self.stride_s, Field::of("stride_s"), 0.2, 20.0)?;
        all_in_range(self.weights.into_iter().flatten(), "weights", -100.0, 100.0)?;
        all_in_range(self.offsets.map(|o| o.0), "offsets", -100.0, 100.0)?;
        let PhasePlane { x, y, centre, radius } = self.plane;
        let last = D.saturating_sub(1) as f32;
        in_range(x as f32, Field::of("plane.x"), 0.0, last)?;
        in_range(y as f32, Field::of("plane.y"), 0.0, last)?;
        all_in_range([centre.0, centre.1], "plane.centre", -self.bound, self.bound)?;
        all_in_range([radius.0.abs(), radius.1.abs()], "plane.radius", 1e-6, self.bound)?;
        let max_micros = (self.stride_s * 1e6 / 50.0) as u32;
        allow_period(period, max_micros)?;
        let per_second = self.cycle / self.stride_s;
        let per_tick = per_second * period.seconds();
        Ok(Readout { flow, config: *self, per_tick, per_second, state: self.start })
    }
}

impl<F: Flow<f32, D>, const D: usize, const N: usize> Readout<F, D, N> {
    /// The model's current state.
    #[must_use]
    pub const fn state(&self) -> &[f32; D] {
        &self.state
    }

    /// The model, to change its inputs between two ticks.
    pub const fn flow_mut(&mut self) -> &mut F {
        &mut self.flow
    }

    /// Sets the model's state; values beyond the bound are limited to it.
    pub fn set_state(&mut self, state: [f32; D]) {
        self.state = state.map(|s| s.clamp_to(self.config.bound));
    }

    /// The point of the phase plane, scaled to a circle of about 1.
    fn point(&self) -> (f32, f32) {
        let PhasePlane { x, y, centre, radius } = self.config.plane;
        let at = |index: usize| self.state.get(index).copied().unwrap_or(0.0);
        ((at(x) - centre.0) / radius.0, (at(y) - centre.1) / radius.1)
    }
}

fn weighted<const D: usize>(weights: &[f32; D], values: &[f32; D]) -> f32 {
    weights.iter().zip(values).fold(0.0, |sum, (w, v)| sum + w * v)
}

impl<F: Flow<f32, D>, const D: usize, const N: usize> Generator<N> for Readout<F, D, N> {
    fn step(&mut self) {
        rk4(&self.flow, &mut self.state, self.per_tick);
        for state in &mut self.state {
            *state = state.clamp_to(self.config.bound);
        }
    }

    fn angles(&self) -> [Radians; N] {
        let mut angles = self.config.offsets;
        for (angle, weights) in angles.iter_mut().zip(&self.config.weights) {
            angle.0 += weighted(weights, &self.state);
        }
        angles
    }

    fn rates(&self) -> [RadPerSec; N] {
        let slope = self.flow.derivative(&self.state);
        let mut rates = [RadPerSec(0.0); N];
        for (rate, weights) in rates.iter_mut().zip(&self.config.weights) {
            rate.0 = self.per_second * weighted(weights, &slope);
        }
        rates
    }

    fn phase(&self) -> Phase {
        let (x, y) = self.point();
        crate::math::trig::angle(y, x)
    }

    fn amplitude(&self) -> f32 {
        let (x, y) = self.point();
        libm::sqrtf(x * x + y * y)
    }

    fn check(&self) -> Result<(), StateFault> {
        for (index, &state) in self.state.iter().enumerate() {
            if !state.is_finite() {
                return Err(StateFault::NotFinite { state: Field::at("state", index) });
            }
            if state.abs() >= self.config.bound {
                return Err(StateFault::OutOfBounds { state: Field::at("state", index) });
            }
        }
        Ok(())
    }

    fn reset(&mut self) {
        self.state = self.config.start;
    }
}

/// Read-out of M of the D states of a flow for hips and knees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearJointsConfig<const D: usize, const M: usize> {
    /// A state on the limit cycle, where the gait phase is 0; each within ±`bound`.
    pub start: [f32; D],
    /// Units of the model's time that one cycle takes; above 0.
    pub cycle: f32,
    /// Stride in seconds, 0.2 to 20.
    pub stride_s: f32,
    /// Indices of the states that are read out: the [`Features`].
    pub states: [usize; M],
    /// Weight of each of these for each joint, in radians per unit of the state; up to ±100.
    pub weights: [[f32; M]; 4],
    /// Angle of each joint where all states are 0; up to ±100 rad, as the states' means count into it.
    pub offsets: [Radians; 4],
    /// The plane from which phase and amplitude are read.
    pub plane: PhasePlane,
    /// Phase of the gait where the phase of the plane is 0.
    pub lead: Phase,
    /// Bound of the absolute value of every state; above 0.
    pub bound: f32,
}

/// A flow with its read-out for four joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearJoints<F, const D: usize, const M: usize> {
    readout: Readout<F, D, 4>,
    states: [usize; M],
    lead: Phase,
}

impl<const D: usize, const M: usize> LinearJointsConfig<D, M> {
    /// Validates the configuration for a flow and a control period; the flow starts at the configured state.
    ///
    /// # Errors
    /// `states` for an index beyond the flow's states; else as [`ReadoutConfig::build`].
    pub fn build<F: Flow<f32, D>>(&self, flow: F, period: Period) -> Result<LinearJoints<F, D, M>, BuildError> {
        let last = D.saturating_sub(1) as f32;
        let mut weights = [[0.0; D]; 4];
        for (all, chosen) in weights.iter_mut().zip(&self.weights) {
            for (place, (&state, &weight)) in self.states.iter().zip(chosen).enumerate() {
                in_range(state as f32, Field::at("states", place), 0.0, last)?;
                if let Some(w) = all.get_mut(state) {
                    *w += weight;
                }
            }
        }
        let readout = ReadoutConfig {
            start: self.start,
            cycle: self.cycle,
            stride_s: self.stride_s,
            weights,
            offsets: self.offsets,
            plane: self.plane,
            bound: self.bound,
        };
        Ok(LinearJoints { readout: readout.build(flow, period)?, states: self.states, lead: self.lead })
    }
}

impl<F: Flow<f32, D>, const D: usize, const M: usize> LinearJoints<F, D, M> {
    /// The model's current state.
    #[must_use]
    pub const fn state(&self) -> &[f32; D] {
        self.readout.state()
    }

    /// Sets the model's state; values beyond the bound are limited to it.
    pub fn set_state(&mut self, state: [f32; D]) {
        self.readout.set_state(state);
    }

    /// The model, to change its inputs between two ticks.
    pub const fn flow_mut(&mut self) -> &mut F {
        self.readout.flow_mut()
    }
}

impl<F: Flow<f32, D>, const D: usize, const M: usize> Generator<4> for LinearJoints<F, D, M> {
    fn step(&mut self) {
        self.readout.step();
    }

    fn angles(&self) -> [Radians; 4] {
        self.readout.angles()
    }

    fn rates(&self) -> [RadPerSec; 4] {
        self.readout.rates()
    }

    /// Grows steadily on the cycle, but as evenly in time as the model does: a relaxation oscillator has slow and fast parts.
    fn phase(&self) -> Phase {
        self.readout.phase() + self.lead
    }

    fn amplitude(&self) -> f32 {
        self.readout.amplitude()
    }

    fn check(&self) -> Result<(), StateFault> {
        self.readout.check()
    }

    fn reset(&mut self) {
        self.readout.reset();
    }
}

/// The chosen states.
impl<F: Flow<f32, D>, const D: usize, const M: usize> Features for LinearJoints<F, D, M> {
    const COUNT: usize = M;

    fn features(&self, out: &mut [f32]) {
        let state = self.state();
        fill(out, self.states.iter().map(|&index| state.get(index).copied().unwrap_or(0.0)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::symmetric_cells::{LegGait, LegNetwork};
    use crate::oscillator::hopf::Hopf;

    fn config() -> ReadoutConfig<2, 2> {
        ReadoutConfig {
            start: [1.0, 0.0],
            cycle: 1.0,
            stride_s: 1.1,
            weights: [[0.3, 0.0], [0.1, 0.2]],
            offsets: [Radians(0.1), Radians(0.5)],
            plane: PhasePlane { x: 0, y: 1, centre: (0.0, 0.0), radius: (1.0, 1.0) },
            bound: 10.0,
        }
    }

    fn circle() -> Hopf {
        Hopf { gain: 8.0, square_radius: 1.0, frequency: core::f32::consts::TAU }
    }

    /// The Hopf circle read out is the sinusoid of the weights, for a minute, phase and rate too.
    #[test]
    fn a_circle_reads_out_as_its_sinusoids() {
        let mut walk = config().build(circle(), Period::MILLISECOND).unwrap();
        for tick in 0..60_000u32 {
            let cycles = f64::from(tick) * 1e-3 / f64::from(1.1f32);
            let (sin, cos) = (core::f64::consts::TAU * cycles).sin_cos();
            let angles = walk.angles();
            assert!((f64::from(angles[0].0) - 0.1 - 0.3 * cos).abs() < 1e-3, "tick {tick}");
            assert!((f64::from(angles[1].0) - 0.5 - 0.1 * cos - 0.2 * sin).abs() < 1e-3);
            let rate = -0.3 * sin * core::f64::consts::TAU / 1.1;
            assert!((f64::from(walk.rates()[0].0) - rate).abs() < 6e-3);
            assert!((walk.amplitude() - 1.0).abs() < 1e-4);
            let off = (f64::from(walk.phase().cycles()) - cycles + 0.5).rem_euclid(1.0) - 0.5;
            assert!(off.abs() < 1e-3);
            walk.step();
        }
    }

    /// The walk of the four cells on hips and knees: the legs half a stride apart.
    #[test]
    fn a_network_of_cells_walks() {
        let mut weights = [[0.0; 8]; 4];
        for (joint, row) in weights.iter_mut().enumerate() {
            row[2 * joint] = 0.25;
        }
        let start = [1.378_4, 0.0, -1.378_4, 0.0, -1.378_4, 0.0, 1.378_4, 0.0];
        let plane = PhasePlane { x: 0, y: 1, centre: (0.0, 0.0), radius: (1.378_4, 1.378_4) };
        let config =
            ReadoutConfig { start, cycle: 1.0, stride_s: 1.1, weights, offsets: [Radians(0.0); 4], plane, bound: 10.0 };
        let mut walk = config.build(LegNetwork::of(LegGait::Walk), Period::MILLISECOND).unwrap();
        for _ in 0..5000 {
            walk.step();
            let [left, right, ..] = walk.angles();
            assert!((left.0 + right.0).abs() < 1e-4, "the hips are in antiphase");
        }
        assert!(walk.check().is_ok());
    }

    #[test]
    fn a_broken_state_is_found_and_bad_fields_are_named() {
        let mut walk = config().build(circle(), Period::MILLISECOND).unwrap();
        walk.set_state([f32::NAN, 0.0]);
        assert_eq!(walk.check(), Err(StateFault::NotFinite { state: Field::at("state", 0) }));
        walk.set_state([1.0, 11.0]);
        assert_eq!(walk.check(), Err(StateFault::OutOfBounds { state: Field::at("state", 1) }));
        walk.reset();
        assert_eq!(walk.check(), Ok(()));
        type Break = fn(&mut ReadoutConfig<2, 2>);
        let broken: [(Break, &str); 6] = [
            (|c| c.start[1] = f32::NAN, "start[1]"),
            (|c| c.cycle = 0.0, "cycle"),
            (|c| c.stride_s = 21.0, "stride_s"),
            (|c| c.weights[1][0] = 101.0, "weights[2]"),
            (|c| c.plane.y = 2, "plane.y"),
            (|c| c.plane.radius.0 = 0.0, "plane.radius"),
        ];
        for (broken, name) in broken {
            let mut config = config();
            broken(&mut config);
            let error = config.build(circle(), Period::MILLISECOND).unwrap_err().to_string();
            assert!(error.contains(name), "{error} does not name {name}");
        }
        let error = config().build(circle(), Period::from_micros(50_000).unwrap()).unwrap_err();
        assert_eq!(error, BuildError::PeriodTooLong { micros: 50_000, max_micros: 22_000 });
    }
}
