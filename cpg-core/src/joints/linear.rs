//! Four joints on the states of any flow, with a gait phase that begins where the left hip is most flexed.
//!
//! ```text
//! a_j = offset_j + sum_m weight_jm s_m,   s' = f(s) cycle / stride
//! ```
//! [`crate::joints::readout`] on chosen states of a model, for hips and knees. Which states, and the weights, are what a fit to a walker gives;
//! those of the walkers in [`crate::gait::catalogue`] are fitted to the mean stride of `natural-walk` in [`crate::gait::named`].
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::gait::catalogue;
//! // Two Morris-Lecar neurons, one a leg, walk within 3.2 degrees of a person; most flexed at phase 0.
//! let mut walk = catalogue::morris_lecar(joint_units::Period::MILLISECOND)?;
//! assert!(walk.phase().cycles() < 0.001 || walk.phase().cycles() > 0.999);
//! let start = walk.angles();
//! for _ in 0..1100 {
//!     walk.step();
//! }
//! assert!(walk.angles().iter().zip(start).all(|(after, before)| (after.0 - before.0).abs() < 0.01));
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::in_range;
use crate::joints::features::{Features, fill};
use crate::joints::readout::{PhasePlane, Readout, ReadoutConfig};
use crate::math::first_order::Flow;
use crate::{BuildError, Field, Generator, StateFault};

/// How a flow of D states drives hips and knees through M of them.
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
    /// Where phase and amplitude are read.
    pub plane: PhasePlane,
    /// Phase of the gait where the phase of the plane is 0.
    pub lead: Phase,
    /// No state may exceed this in size; above 0.
    pub bound: f32,
}

/// A model that walks on four joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearJoints<F, const D: usize, const M: usize> {
    readout: Readout<F, D, 4>,
    states: [usize; M],
    lead: Phase,
}

impl<F: Flow<f32, D>, const D: usize, const M: usize> LinearJoints<F, D, M> {
    /// Starts at the configured state.
    ///
    /// # Errors
    /// `states` for an index beyond the model's; else as [`Readout::build`].
    pub fn build(flow: F, config: &LinearJointsConfig<D, M>, period: Period) -> Result<Self, BuildError> {
        let last = D.saturating_sub(1) as f32;
        let mut weights = [[0.0; D]; 4];
        for (all, chosen) in weights.iter_mut().zip(&config.weights) {
            for (place, (&state, &weight)) in config.states.iter().zip(chosen).enumerate() {
                in_range(state as f32, Field::at("states", place), 0.0, last)?;
                if let Some(w) = all.get_mut(state) {
                    *w += weight;
                }
            }
        }
        let readout = ReadoutConfig {
            start: config.start,
            cycle: config.cycle,
            stride_s: config.stride_s,
            weights,
            offsets: config.offsets,
            plane: config.plane,
            bound: config.bound,
        };
        Ok(Self { readout: Readout::build(flow, readout, period)?, states: config.states, lead: config.lead })
    }

    /// The model's state now.
    #[must_use]
    pub const fn state(&self) -> &[f32; D] {
        self.readout.state()
    }

    /// Places the model in a state; values beyond the bound are held at it.
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

    /// Grows steadily on the cycle, but as evenly in time as the model does: a relaxation oscillator lingers and leaps.
    fn phase(&self) -> Phase {
        Phase(self.readout.phase().0.wrapping_add(self.lead.0))
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
