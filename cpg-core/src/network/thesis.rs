//! The network of the thesis, eqs 13-16 ("Designing CPG for Biped Locomotion Control using Nonlinear Dynamical Theory", IIITA
//! Allahabad): Rayleigh oscillators with two kinds of link, here on any two graphs.
//!
//! ```text
//! a_i'' - alpha_i (1 - p_i a_i'^2) a_i' + mu_i^2 (a_i - a_i0)
//!       - sum over difference links  k_ij (a_i' - a_j')
//!       - sum over product links     k_ij a_j' (a_j - a_j0)      = 0
//! ```
//!
//! In the thesis the difference links run between left and right, the product links from hip to knee and back; joints 1 to 4 there
//! are left hip, right hip, left knee, right knee, as here. Its Table 1 is [`TABLE_1`]; what it leaves out (p, mu, offsets, start) is
//! taken from its source (de Pina Filho, Dutra, Raptopoulos, Biol. Cybern. 92, 2005): p by harmonic balance, mu the
//! stride frequency or twice it, offsets the mean joint angles. Units as in [`crate::oscillator::rayleigh`]: degrees and seconds.
//!
//! Properties of the equations, which differ from those that the thesis states:
//! - A difference link has the sign that *drives* differences: antiphase is the attractor, and its negative damping is alpha + 2 k
//!   instead of alpha. Amplitudes grow by sqrt(1 + 2 k/alpha), with Table 1 by 17.0, 14.2, 7.5 and 7.5; [`harmonic_balance_p`] is
//!   the p that leaves a wanted amplitude.
//! - Left and right lock. **Hip and knee do not**: the product terms act in second order, and the phase between them never stops slipping.
//! - It is not bounded: a product link is a negative spring while k a_j' > mu^2. Velocities are held below that, see [`OscillatorState`]'s
//!   bound in [`Oscillators::limit`], and `build` refuses a gain at which the limit cycle itself would come there.
//!
//! For walking use [`crate::network::phase_coupled`].
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::network::thesis::{Thesis, ThesisConfig, harmonic_balance_p};
//! use joint_units::Period;
//! // p of the left hip of set S: k12 = 0.2010 makes its amplitude 17 times that of the oscillator alone.
//! let p = harmonic_balance_p(0.0014f64, 0.2010, core::f64::consts::TAU / 1.1, 20.0);
//! assert!((p - 0.029_438_266_8).abs() < 1e-9, "{p}");
//! let mut walk: Thesis = ThesisConfig::set_s().build(Period::MILLISECOND)?;
//! let mut highest = 0.0f32;
//! for _ in 0..5000 {
//!     walk.step();
//!     highest = highest.max(walk.angles()[0].degrees());
//! }
//! assert!((highest - 25.0).abs() < 0.3, "{highest}: 20 degrees about 5");
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use core::marker::PhantomData;

use joint_units::{Period, Phase};

use crate::error::{allow_period, in_range};
use crate::math::second_order::SecondOrder;
use crate::network::graph::{HipKnee, LeftRight, add, value};
use crate::network::second_order::{OscillatorState, Oscillators, Terms};
use crate::oscillator::rayleigh::{Folded, RayleighConfig, radians_per_degree};
use crate::{BuildError, Field, Graph, Integrator, Rk4, Scalar};

/// Table 1 of the thesis in units of 0.0001, so that it is exact in every number type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Table1 {
    /// k12 = k21, between the hips, in 1/s.
    pub k12: u32,
    /// k13 = k31, left hip and knee, in 1/(deg s).
    pub k13: u32,
    /// k24 = k42, right hip and knee, in 1/(deg s).
    pub k24: u32,
    /// k34 = k43, between the knees, in 1/s.
    pub k34: u32,
    /// alpha of left hip, right hip, left knee, right knee, in 1/s.
    pub alpha: [u32; 4],
}

/// Table 1 of the thesis.
pub const TABLE_1: Table1 = Table1 { k12: 2010, k13: 125, k24: 129, k34: 3012, alpha: [14, 20, 108, 108] };

/// Configuration of a network of the thesis' kind: `N` joints, `D` difference links and `P` product links.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkConfig<const N: usize, const D: usize, const P: usize, T = f32> {
    /// The oscillators.
    pub joints: [RayleighConfig<T>; N],
    /// Gains of each difference link (i, j): k_ij, which acts on i, and k_ji, which acts on j, in 1/s, -10 to 10.
    pub difference: [[T; 2]; D],
    /// Gains of each product link (i, j): k_ij, which acts on i, and k_ji, which acts on j, in 1/(deg s), -10 to 10 and no more
    /// than leaves the springs positive on the limit cycle.
    pub product: [[T; 2]; P],
    /// Phase lead at which each joint starts. The network itself only keeps the phase of left against right.
    pub phases: [Phase; N],
}

/// Configuration of the thesis' own four joints.
pub type ThesisConfig<T = f32> = NetworkConfig<4, 2, 2, T>;

/// A built network on the difference graph `GD` and the product graph `GP`.
pub type Network<GD, GP, const N: usize, const D: usize, const P: usize, T = f32, I = Rk4> =
    Oscillators<NetworkField<GD, GP, N, D, P, T>, N, T, I>;

/// The thesis' own network.
pub type Thesis<T = f32, I = Rk4> = Network<LeftRight, HipKnee, 4, 2, 2, T, I>;

/// The p in (s/deg)^2 that gives an oscillator the amplitude `degrees` in a network where each neighbour of its difference links
/// moves in antiphase: p = 4 (alpha + 2 k) / (3 alpha mu^2 A^2), k the sum of its gains. With k = 0: of the isolated oscillator.
#[must_use]
pub fn harmonic_balance_p<T: Scalar>(alpha: T, k: T, mu: T, degrees: T) -> T {
    let velocity = mu * degrees;
    T::ratio(4, 1) * (alpha + k + k) / (T::ratio(3, 1) * alpha * velocity * velocity)
}

impl<T: Scalar> ThesisConfig<T> {
    /// Set S: Table 1, all four joints at a stride of 1.1 s, hips 20 degrees about 5, knees 30 about 30.
    #[must_use]
    pub fn set_s() -> Self {
        Self::table_1(T::ONE)
    }

    /// Set D: as set S with the knees at twice the stride frequency. Their product links then pull the knees in phase, their
    /// difference link in antiphase, and the latter is stronger: they settle a quarter of a stride apart, which is no gait.
    #[must_use]
    pub fn set_d() -> Self {
        Self::table_1(T::ratio(2, 1))
    }

    fn table_1(knee_frequency: T) -> Self {
        let e4 = |n| T::ratio(n, 10_000);
        let Table1 { k12, k13, k24, k34, alpha: [left_hip, right_hip, left_knee, right_knee] } = TABLE_1;
        let w = T::TAU / T::ratio(11, 10);
        let joint = |alpha, k, mu, degrees, offset| {
            let alpha = e4(alpha);
            RayleighConfig { alpha, p: harmonic_balance_p(alpha, e4(k), mu, degrees), mu, offset }
        };
        let hip = |alpha| joint(alpha, k12, w, T::ratio(20, 1), T::ratio(5, 1));
        let knee = |alpha| joint(alpha, k34, w * knee_frequency, T::ratio(30, 1), T::ratio(30, 1));
        Self {
            joints: [hip(left_hip), hip(right_hip), knee(left_knee), knee(right_knee)],
            difference: [[e4(k12); 2], [e4(k34); 2]],
            product: [[e4(k13); 2], [e4(k24); 2]],
            phases: [0.0, 0.5, -100.0 / 360.0, 80.0 / 360.0].map(Phase::from_cycles),
        }
    }
}

impl<const N: usize, const D: usize, const P: usize, T: Scalar> NetworkConfig<N, D, P, T> {
    /// Checks every value against its range, without the period.
    ///
    /// # Errors
    /// [`BuildError`] with the first field that is not allowed.
    pub fn validate<GD: Graph<N, D>, GP: Graph<N, P>>(&self) -> Result<(), BuildError> {
        for (index, joint) in self.joints.iter().enumerate() {
            joint.validate_as(|name| Field::at(name, index))?;
        }
        for (index, gains) in self.difference.iter().enumerate() {
            gains.iter().try_for_each(|&k| in_range(k, Field::at("difference", index), -10.0, 10.0))?;
        }
        let velocity = self.cycle(&self.growth::<GD>()).velocity;
        for (link, (i, j, k)) in directed(GP::EDGES, self.product).enumerate() {
            let most = (self.stiffness(i) / value(&velocity, j)).to_f32().min(10.0);
            in_range(k, Field::at("product", link / 2), -most, most)?;
        }
        Ok(())
    }

    /// Validates and folds the configuration for one control period. The network starts on the cycle that harmonic balance gives, at
    /// the configured phases.
    ///
    /// # Errors
    /// [`BuildError`] with the first field that is not allowed, or the longest allowed period.
    pub fn build<GD: Graph<N, D>, GP: Graph<N, P>, I: Integrator>(
        &self,
        period: Period,
    ) -> Result<Network<GD, GP, N, D, P, T, I>, BuildError> {
        let ((), ()) = (GD::VALID, GP::VALID);
        self.validate::<GD, GP>()?;
        let growth = self.growth::<GD>();
        let mut links = [T::ZERO; N];
        for (i, _, k) in directed(GD::EDGES, self.difference) {
            add(&mut links, i, size(k));
        }
        let joints = self.joints.iter().zip(growth).zip(links);
        let longest = joints.map(|((joint, growth), links)| joint.longest_period::<I>(growth, links));
        allow_period(period, longest.min().unwrap_or(Period::MAX_MICROS))?;
        let unit = T::ratio(period.micros(), 1_000_000 * I::UNITS);
        let cycle = self.cycle(&growth);
        let start = self.start(&cycle);
        let terms = Terms {
            unit,
            velocity: [T::ONE / unit; N],
            radians: [radians_per_degree(); N],
            offsets: self.joints.map(|joint| joint.offset * radians_per_degree()),
            limit: self.limit::<GP>(&growth),
            cycle,
        };
        Ok(Oscillators::new(self.field(unit), &start, &terms))
    }

    /// Negative damping of each joint at rest when every neighbour that drives it moves in antiphase: alpha + 2 k.
    fn growth<GD: Graph<N, D>>(&self) -> [T; N] {
        let mut growth = self.joints.map(|joint| joint.alpha);
        for (i, _, k) in directed(GD::EDGES, self.difference).filter(|&(.., k)| k > T::ZERO) {
            add(&mut growth, i, k + k);
        }
        growth
    }

    fn cycle(&self, growth: &[T; N]) -> OscillatorState<N, T> {
        self.each_joint(growth, RayleighConfig::cycle)
    }

    /// Bounds: a margin above the cycle, and below the velocity at which a product link makes a spring negative.
    fn limit<GP: Graph<N, P>>(&self, growth: &[T; N]) -> OscillatorState<N, T> {
        let mut limit = self.each_joint(growth, RayleighConfig::limit);
        for (i, j, k) in directed(GP::EDGES, self.product).filter(|&(.., k)| k != T::ZERO) {
            let runaway = self.stiffness(i) / size(k);
            if let Some(velocity) = limit.velocity.get_mut(j) {
                *velocity = velocity.clamp_to(runaway);
            }
        }
        limit
    }

    /// The cycle at the configured phases.
    fn start(&self, cycle: &OscillatorState<N, T>) -> OscillatorState<N, T> {
        let mut start = *cycle;
        for ((x, v), &phase) in start.displacement.iter_mut().zip(&mut start.velocity).zip(&self.phases) {
            let (sin, cos) = T::sin_cos(phase);
            (*x, *v) = (*x * cos, -(*v * sin));
        }
        start
    }

    /// The field in a time unit of `c` seconds.
    fn field<GD: Graph<N, D>, GP: Graph<N, P>>(&self, c: T) -> NetworkField<GD, GP, N, D, P, T> {
        let mut own = self.joints.map(|joint| joint.fold(c));
        for (i, _, k) in directed(GD::EDGES, self.difference) {
            if let Some(own) = own.get_mut(i) {
                own.damping += c * k;
            }
        }
        let scale = |gains: [T; 2]| gains.map(|k| c * k);
        let (difference, product) = (self.difference.map(scale), self.product.map(scale));
        NetworkField { own, difference, product, graphs: PhantomData }
    }

    /// mu^2 of a joint.
    fn stiffness(&self, joint: usize) -> T {
        self.joints.get(joint).map_or(T::ZERO, |joint| joint.mu * joint.mu)
    }

    fn each_joint(&self, growth: &[T; N], f: impl Fn(&RayleighConfig<T>, T) -> (T, T)) -> OscillatorState<N, T> {
        let mut state = OscillatorState { displacement: [T::ZERO; N], velocity: [T::ZERO; N] };
        let out = state.displacement.iter_mut().zip(&mut state.velocity);
        for ((x, v), (joint, &growth)) in out.zip(self.joints.iter().zip(growth)) {
            (*x, *v) = f(joint, growth);
        }
        state
    }
}

/// Each link twice, as (i, j, k): k weighs what j does to i.
fn directed<const E: usize, T>(
    edges: [(usize, usize); E],
    gains: [[T; 2]; E],
) -> impl Iterator<Item = (usize, usize, T)> {
    edges.into_iter().zip(gains).flat_map(|((i, j), [on_i, on_j])| [(i, j, on_i), (j, i, on_j)])
}

fn size<T: Scalar>(k: T) -> T {
    if k < T::ZERO { -k } else { k }
}

/// The vector field of the network with its constants folded for one time unit of the integrator, c seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkField<GD, GP, const N: usize, const D: usize, const P: usize, T = f32> {
    /// The oscillators; their damping holds the near half of every difference link, c k_ij a_i'.
    own: [Folded<T>; N],
    /// c k_ij and c k_ji.
    difference: [[T; 2]; D],
    /// c k_ij and c k_ji.
    product: [[T; 2]; P],
    graphs: PhantomData<(GD, GP)>,
}

impl<GD: Graph<N, D>, GP: Graph<N, P>, const N: usize, const D: usize, const P: usize, T: Scalar> SecondOrder<T, N>
    for NetworkField<GD, GP, N, D, P, T>
{
    fn acceleration(&self, x: &[T; N], v: &[T; N]) -> [T; N] {
        let mut a = *x;
        for ((a, own), &v) in a.iter_mut().zip(&self.own).zip(v) {
            *a = own.acceleration(*a, v);
        }
        for ((i, j), &[on_i, on_j]) in GD::EDGES.into_iter().zip(&self.difference) {
            add(&mut a, i, -(value(v, j) * on_i));
            add(&mut a, j, -(value(v, i) * on_j));
        }
        for ((i, j), &[on_i, on_j]) in GP::EDGES.into_iter().zip(&self.product) {
            add(&mut a, i, value(v, j) * value(x, j) * on_i);
            add(&mut a, j, value(v, i) * value(x, i) * on_j);
        }
        a
    }
}
