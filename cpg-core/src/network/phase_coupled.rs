//! R1: the robust network of Rayleigh oscillators, in normalised states, with links that carry the phase of the gait.
//!
//! Topology and oscillators are those of the thesis' network ("Designing CPG for Biped Locomotion Control using Nonlinear Dynamical
//! Theory", IIITA Allahabad; see [`crate::network::thesis`]); the links are different. With u = (a - a0)/A and v = a'/(w A) for each joint:
//!
//! ```text
//! u_i' = w v_i
//! v_i' = w [ eps (1 - 4/3 v_i^2) v_i - u_i  +  sum_j kap_ij ( cos(phi_i - phi_j) v_j - sin(phi_i - phi_j) u_j - v_i ) ]
//! ```
//!
//! a Rayleigh oscillator with alpha = eps w, p = 4/(3 w^2 A^2) and mu = w, whose links push each joint towards its neighbour's
//! motion, rotated by the wanted phase difference. On the wanted gait they vanish (except for the third harmonic), so they do not
//! change the amplitude; they are linear, so they do not diverge; and they hold every phase, also between hip and knee.
//!
//! - a, a0, A: angle, offset and amplitude in rad; w = 2 pi / natural period, in rad/s; phi: phase, as a part of the cycle.
//! - eps: how fast the amplitude returns, per radian of the cycle. The limit cycle is longer than the natural period by about
//!   eps^2/16: by a factor of 1.014033 at eps = kap = 0.5.
//! - [`OscillatorState`] is normalised: displacement u and velocity v. Both are held within [`BOUND_FACTOR`]; the limit cycle reaches 1.0 to 1.1.
//!   `build` refuses a period at which explicit integration could diverge inside of that.
//!
//! ```
//! use cpg_core::{Generator, OscillatorState};
//! use cpg_core::gait::default_walk::default_config;
//! use cpg_core::network::graph::Biped;
//! use cpg_core::network::phase_coupled::Robust;
//! use joint_units::Period;
//! let mut walk: Robust<Biped, 4, 4> = default_config().build(Period::MILLISECOND)?;
//! // Nearly at rest, and out of phase.
//! walk.set_state(&OscillatorState { displacement: [0.1, 0.0, 0.0, 0.0], velocity: [0.0, 0.1, -0.1, 0.05] }).expect("inside the bound");
//! for _ in 0..10_000 {
//!     walk.step();
//! }
//! let OscillatorState { displacement: u, velocity: v } = walk.state();
//! assert!((walk.amplitude() - 1.0).abs() < 0.05);
//! assert!((u[0] + u[1]).abs() < 1e-3 && (v[2] + v[3]).abs() < 1e-3, "left against right");
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use core::marker::PhantomData;

use joint_units::{Period, Phase, Radians};

use crate::error::{all_in_range, allow_period, in_range};
use crate::math::second_order::{SecondOrder, longest_period};
use crate::network::graph::{add, value};
use crate::network::second_order::{BOUND_FACTOR, OscillatorState, Oscillators, Terms};
use crate::{BuildError, Field, Graph, Integrator, Rk4, Scalar};

/// Steepest damping inside the bound, per eps: minus the derivative of (1 - 4/3 v^2) v at v = BOUND_FACTOR.
const STEEPEST: f32 = 4.0 * BOUND_FACTOR * BOUND_FACTOR - 1.0;

/// Configuration of a network R1: `N` joints, `E` links.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustConfig<const N: usize, const E: usize, T = f32> {
    /// Period 2 pi / w of the linear part in s, 0.1 to 100; the stride is longer, see the [module](self).
    pub natural_period: T,
    /// Strength eps with which the amplitude returns, 0.01 to 2.
    pub nonlinearity: T,
    /// Strength kap of each link, both ways, in the order of the graph's edges, 0 to 2.
    pub coupling: [T; E],
    /// Wanted phase lead of each joint: joint i is most flexed when the gait phase is minus this.
    pub phases: [Phase; N],
    /// Amplitude A of each joint, 0 to pi rad.
    pub amplitudes: [Radians; N],
    /// Offset a0 of each joint, -pi to pi rad.
    pub offsets: [Radians; N],
}

/// A built network R1 on the graph `G`: `N` joints, `E` links, numbers `T`, integrator `I`.
pub type Robust<G, const N: usize, const E: usize, T = f32, I = Rk4> = Oscillators<RobustField<G, N, E, T>, N, T, I>;

impl<const N: usize, const E: usize, T: Scalar> RobustConfig<N, E, T> {
    /// Checks every value against its range, without the period.
    ///
    /// # Errors
    /// [`BuildError`] with the first field that is not allowed.
    pub fn validate(&self) -> Result<(), BuildError> {
        in_range(self.natural_period, Field::of("natural_period"), 0.1, 100.0)?;
        in_range(self.nonlinearity, Field::of("nonlinearity"), 0.01, 2.0)?;
        all_in_range(self.coupling, "coupling", 0.0, 2.0)?;
        let pi = core::f32::consts::PI;
        all_in_range(self.amplitudes.map(|a| a.0), "amplitudes", 0.0, pi)?;
        all_in_range(self.offsets.map(|a| a.0), "offsets", -pi, pi)
    }

    /// Validates and folds the configuration for one control period. The network starts on its gait, joint 0 at phase 0.
    ///
    /// # Errors
    /// [`BuildError`] with the first field that is not allowed, or the longest allowed period.
    pub fn build<G: Graph<N, E>, I: Integrator>(&self, period: Period) -> Result<Robust<G, N, E, T, I>, BuildError> {
        let () = G::VALID;
        self.validate()?;

        let w = T::TAU / self.natural_period;
        let mut decay = [T::from_f32(STEEPEST) * self.nonlinearity; N];
        for (kap, (i, j)) in self.coupling.into_iter().zip(G::EDGES) {
            // The joint's own part of the link, and as much again if its neighbour moves against the link.
            add(&mut decay, i, kap + kap);
            add(&mut decay, j, kap + kap);
        }
        let longest = decay.map(|decay| longest_period::<T, I>(w, decay * w));
        allow_period(period, longest.into_iter().min().unwrap_or(Period::MAX_MICROS))?;

        // c turns v into displacement per time unit of the integrator.
        let unit = T::ratio(period.micros(), 1_000_000 * I::UNITS);
        let c = w * unit;
        let limit = T::from_f32(BOUND_FACTOR);
        let terms = Terms {
            unit,
            velocity: [T::ONE / c; N],
            radians: self.amplitudes.map(|a| T::from_f32(a.0)),
            offsets: self.offsets.map(|a| T::from_f32(a.0)),
            cycle: OscillatorState { displacement: [T::ONE; N], velocity: [T::ONE; N] },
            limit: OscillatorState { displacement: [limit; N], velocity: [limit; N] },
        };
        Ok(Oscillators::new(self.field(c), &start_on_gait(&self.phases, self.nonlinearity), &terms))
    }

    /// The vector field for velocities in displacement per time unit, c v.
    fn field<G: Graph<N, E>>(&self, c: T) -> RobustField<G, N, E, T> {
        let mut damping = [c * self.nonlinearity; N];
        let mut links = [Link { velocity: T::ZERO, displacement: T::ZERO }; E];
        for ((link, kap), (i, j)) in links.iter_mut().zip(self.coupling).zip(G::EDGES) {
            let lead = phase(&self.phases, i).0.wrapping_sub(phase(&self.phases, j).0);
            let (sin, cos) = T::sin_cos(Phase(lead));
            *link = Link { velocity: c * kap * cos, displacement: c * c * kap * sin };
            add(&mut damping, i, -(c * kap));
            add(&mut damping, j, -(c * kap));
        }
        let cubic = T::ratio(4, 3) * self.nonlinearity / c;
        RobustField { spring: c * c, cubic, damping, links, graph: PhantomData }
    }
}

/// The vector field of R1 with its constants folded for one time unit of the integrator; c is w times that unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustField<G, const N: usize, const E: usize, T = f32> {
    /// c^2.
    spring: T,
    /// 4/3 eps / c.
    cubic: T,
    /// c (eps - sum of kap over the links of the joint).
    damping: [T; N],
    links: [Link<T>; E],
    graph: PhantomData<G>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Link<T> {
    /// c kap cos(phi_i - phi_j).
    velocity: T,
    /// c^2 kap sin(phi_i - phi_j).
    displacement: T,
}

impl<G: Graph<N, E>, const N: usize, const E: usize, T: Scalar> SecondOrder<T, N> for RobustField<G, N, E, T> {
    fn acceleration(&self, x: &[T; N], v: &[T; N]) -> [T; N] {
        let mut a = self.damping;
        for ((a, &x), &v) in a.iter_mut().zip(x).zip(v) {
            *a = (*a - v * v * self.cubic) * v - x * self.spring;
        }
        for ((i, j), link) in G::EDGES.into_iter().zip(&self.links) {
            // For j the phase difference has the other sign: the cosine is the same, the sine changes sign.
            add(&mut a, i, value(v, j) * link.velocity - value(x, j) * link.displacement);
            add(&mut a, j, value(v, i) * link.velocity + value(x, i) * link.displacement);
        }
        a
    }
}

/// The state at gait phase 0, to first order in eps. Lindstedt's expansion of the single oscillator gives
/// u = cos t + eps (sin 3t / 24 - sin t / 8), where the term in sin t is free and chosen so that v = 0 at t = 0.
fn start_on_gait<const N: usize, T: Scalar>(phases: &[Phase; N], eps: T) -> OscillatorState<N, T> {
    let mut state = OscillatorState { displacement: [T::ZERO; N], velocity: [T::ZERO; N] };
    let first = phase(phases, 0).0;
    for ((u, v), at) in state.displacement.iter_mut().zip(&mut state.velocity).zip(phases) {
        let at = at.0.wrapping_sub(first);
        let (sin, cos) = T::sin_cos(Phase(at));
        let (sin3, cos3) = T::sin_cos(Phase(at.wrapping_mul(3)));
        *u = cos + eps * (sin3 * T::ratio(1, 24) - sin * T::ratio(1, 8));
        *v = -sin + eps * (cos3 - cos) * T::ratio(1, 8);
    }
    state
}

fn phase<const N: usize>(phases: &[Phase; N], i: usize) -> Phase {
    phases.get(i).copied().unwrap_or(Phase(0))
}
