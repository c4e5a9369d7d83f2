//! R1 in fixed point, for chips without a floating-point unit: no floating-point operation in the step, products of 64 bits.
//!
//! The equations are those of [`crate::network::phase_coupled`], in time counted in radians of the natural cycle, tau = w t:
//!
//! ```text
//! du_i/dtau = v_i
//! dv_i/dtau = (d_i - 4/3 eps v_i^2) v_i - u_i + sum_j kap_ij ( cos_ij v_j - sin_ij u_j ),   d_i = eps - sum_j kap_ij
//! ```
//!
//! | quantity | type | why |
//! |---|---|---|
//! | u, v | [`I16F16`] | normalised: at most 3 |
//! | step h = w dt | [`I2F30`] | 0.0057 at 1 kHz. In 2^-16 it would have 374 steps: 0.09 percent of the frequency, 53 ms in a minute |
//! | h/6 | 2^-40 in 64 bits | the weight of the increments |
//! | eps, kap cos, kap sin | [`I8F24`] | gains between -24 and 5 |
//! | carry | 2^-56 | the part of an increment below 2^-16, added in the next tick |
//!
//! Classical Runge-Kutta; one rounding for each sum of products. After 60 s at 0.25 to 10 ms the gait is 0.01 ms of a stride of 1.1 s off
//! the solution in f64, its amplitude 5e-6 (`tests/fixed_point.rs`). With a floating-point unit, [`crate::network::phase_coupled`] is faster.
//!
//! Read-outs come twice: those of [`Generator`] convert to `f32`, which such a chip does in software; those in [`I16F16`], an angle in
//! units of 2^-16 rad, do not. The building blocks ([`crate::edge_reversal::obb`]) are integers already.
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::gait::default_walk::{default_config, default_walk};
//! use cpg_core::network::graph::Biped;
//! use joint_units::Period;
//! let mut fixed = default_config().build_fixed::<Biped>(Period::MILLISECOND)?;
//! let mut float = default_walk(Period::MILLISECOND)?;
//! for _ in 0..11_000 {
//!     fixed.step();
//!     float.step();
//! }
//! for (a, b) in fixed.angles().iter().zip(float.angles()) {
//!     assert!((a.degrees() - b.degrees()).abs() < 0.02);
//! }
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use core::marker::PhantomData;

use fixed::types::{I2F30, I8F24, I16F16};
use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::math::fixed_trig;
use crate::network::phase_coupled::RobustConfig;
use crate::{BOUND_FACTOR, BuildError, Field, Generator, Graph, OscillatorState, Rk4, StateFault};

/// Bound of a state, in 2^-16.
const LIMIT: i32 = (BOUND_FACTOR as i32) << 16;

/// Bound of a stage inside a step, in 2^-16: the cubic term of a stage at 8 is 1365, so no sum overflows. Only a state at its limit
/// reaches this.
const STAGE_LIMIT: i32 = 8 << 16;

/// Fraction bits of h/6, and of the carry beyond those of the state.
const SIXTH_BITS: u32 = 40;

/// A built network R1 in fixed point on the graph `G`: `N` joints, `E` links.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedRobust<G, const N: usize, const E: usize> {
    field: FixedField<G, N, E>,
    half_step: I2F30,
    step: I2F30,
    /// h/6 in 2^-40.
    sixth: i64,
    now: Numbers<N>,
    /// The part of the increments below the last place of `now`, in 2^-56.
    carry: Carry<N>,
    start: Numbers<N>,
    amplitudes: [I16F16; N],
    offsets: [I16F16; N],
    /// Amplitude times w, rad/s.
    speeds: [I16F16; N],
}

/// Displacement and velocity of each joint, in 2^-16.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Numbers<const N: usize> {
    u: [i32; N],
    v: [i32; N],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Carry<const N: usize> {
    u: [i64; N],
    v: [i64; N],
}

/// The vector field.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FixedField<G, const N: usize, const E: usize> {
    damping: [I8F24; N],
    /// 4/3 eps.
    cubic: I8F24,
    links: [Link; E],
    graph: PhantomData<G>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Link {
    /// kap cos(phi_i - phi_j).
    velocity: I8F24,
    /// kap sin(phi_i - phi_j).
    displacement: I8F24,
}

impl<const N: usize, const E: usize> RobustConfig<N, E> {
    /// Validates and folds the configuration for one control period, in fixed point. The network starts on its gait, joint 0 at
    /// phase 0, like that of [`RobustConfig::build`].
    ///
    /// # Errors
    /// [`BuildError`] naming the first field that is not allowed, or the longest period that is; both as in [`RobustConfig::build`].
    pub fn build_fixed<G: Graph<N, E>>(&self, period: Period) -> Result<FixedRobust<G, N, E>, BuildError> {
        let start = self.build::<G, Rk4>(period)?.state();
        let w = core::f32::consts::TAU / self.natural_period;
        let step: I2F30 = I2F30::checked_from_num(w * period.seconds()).unwrap_or(I2F30::ZERO);

        let mut sums = [self.nonlinearity; N];
        let mut links = [Link { velocity: I8F24::ZERO, displacement: I8F24::ZERO }; E];
        for ((link, kap), (i, j)) in links.iter_mut().zip(self.coupling).zip(G::EDGES) {
            let lead = |joint: usize| self.phases.get(joint).map_or(0, |phase| phase.0);
            let (sin, cos) = crate::math::trig::sin_cos(Phase(lead(i).wrapping_sub(lead(j))));
            *link = Link { velocity: gain(kap * cos), displacement: gain(kap * sin) };
            crate::network::graph::add(&mut sums, i, -kap);
            crate::network::graph::add(&mut sums, j, -kap);
        }
        let field = FixedField {
            damping: sums.map(gain),
            cubic: gain(self.nonlinearity * (4.0 / 3.0)),
            links,
            graph: PhantomData,
        };
        let start = Numbers {
            u: start.displacement.map(|u| number(u).to_bits()),
            v: start.velocity.map(|v| number(v).to_bits()),
        };
        Ok(FixedRobust {
            field,
            half_step: I2F30::from_bits(step.to_bits() >> 1),
            step,
            sixth: ((i64::from(step.to_bits()) << (SIXTH_BITS - 30)) + 3) / 6,
            now: start,
            carry: Carry { u: [0; N], v: [0; N] },
            start,
            amplitudes: self.amplitudes.map(|a| number(a.0)),
            offsets: self.offsets.map(|a| number(a.0)),
            speeds: self.amplitudes.map(|a| number(a.0 * w)),
        })
    }
}

/// The nearest fixed-point number; validated values are all in its range.
fn number(value: f32) -> I16F16 {
    I16F16::checked_from_num(value).unwrap_or(I16F16::ZERO)
}

fn gain(value: f32) -> I8F24 {
    I8F24::checked_from_num(value).unwrap_or(I8F24::ZERO)
}

/// A gain times a number in 2^-16, exact, in 2^-40.
fn times(gain: I8F24, number: i32) -> i64 {
    i64::from(gain.to_bits()).wrapping_mul(i64::from(number))
}

/// Removes `bits` fraction bits, rounded to nearest; limited to the bound of a stage.
fn rounded(sum: i64, bits: u32, limit: i32) -> i32 {
    let value = sum.wrapping_add(1 << (bits - 1)) >> bits;
    let limit = i64::from(limit);
    // The bounds are constants and in order.
    value.clamp(-limit, limit) as i32
}

impl<G: Graph<N, E>, const N: usize, const E: usize> FixedField<G, N, E> {
    /// dv/dtau in 2^-16; the numbers are at most 8.
    fn acceleration(&self, at: &Numbers<N>) -> [i32; N] {
        let mut sums = [0i64; N];
        for (((sum, &u), &v), damping) in sums.iter_mut().zip(&at.u).zip(&at.v).zip(&self.damping) {
            let square = rounded(i64::from(v).wrapping_mul(i64::from(v)), 16, i32::MAX);
            let brake = rounded(times(self.cubic, square), 16, i32::MAX);
            *sum = times(I8F24::from_bits(damping.to_bits().wrapping_sub(brake)), v).wrapping_sub(i64::from(u) << 24);
        }
        for ((i, j), link) in G::EDGES.into_iter().zip(&self.links) {
            let of = |joint: usize| (get(&at.u, joint), get(&at.v, joint));
            let ((u_i, v_i), (u_j, v_j)) = (of(i), of(j));
            // For j the phase difference has the other sign: the cosine is the same, the sine changes sign.
            add(&mut sums, i, times(link.velocity, v_j).wrapping_sub(times(link.displacement, u_j)));
            add(&mut sums, j, times(link.velocity, v_i).wrapping_add(times(link.displacement, u_i)));
        }
        sums.map(|sum| rounded(sum, 24, i32::MAX))
    }
}

fn get<const N: usize>(values: &[i32; N], i: usize) -> i32 {
    values.get(i).copied().unwrap_or(0)
}

fn add<const N: usize>(sums: &mut [i64; N], i: usize, amount: i64) {
    if let Some(sum) = sums.get_mut(i) {
        *sum = sum.wrapping_add(amount);
    }
}

/// The numbers a step `h` along the slopes, rounded.
fn along<const N: usize>(from: &[i32; N], slopes: &[i32; N], h: I2F30) -> [i32; N] {
    let mut out = *from;
    for (out, &slope) in out.iter_mut().zip(slopes) {
        let move_30 = i64::from(h.to_bits()).wrapping_mul(i64::from(slope));
        *out = rounded((i64::from(*out) << 30).wrapping_add(move_30), 30, STAGE_LIMIT);
    }
    out
}

/// Adds h/6 (k1 + 2 k2 + 2 k3 + k4) and keeps the part below the last place. A number at its bound loses its carry.
fn accumulate<const N: usize>(now: &mut [i32; N], carry: &mut [i64; N], sixth: i64, stages: [&[i32; N]; 4]) {
    let [k1, k2, k3, k4] = stages;
    let slopes = k1.iter().zip(k2).zip(k3.iter().zip(k4));
    for ((now, carry), ((&k1, &k2), (&k3, &k4))) in now.iter_mut().zip(carry).zip(slopes) {
        let [k1, k2, k3, k4] = [k1, k2, k3, k4].map(i64::from);
        let sum = k1 + k4 + 2 * (k2 + k3);
        let total = (i64::from(*now) << SIXTH_BITS).wrapping_add(*carry).wrapping_add(sixth.wrapping_mul(sum));
        let whole = total >> SIXTH_BITS;
        let held = whole.clamp(-i64::from(LIMIT), i64::from(LIMIT));
        *now = held as i32;
        *carry = if held == whole { total - (whole << SIXTH_BITS) } else { 0 };
    }
}

impl<G: Graph<N, E>, const N: usize, const E: usize> FixedRobust<G, N, E> {
    /// The current normalised state, see [`crate::network::phase_coupled`].
    #[must_use]
    pub fn state(&self) -> OscillatorState<N, I16F16> {
        OscillatorState { displacement: self.now.u.map(I16F16::from_bits), velocity: self.now.v.map(I16F16::from_bits) }
    }

    /// Sets the state; [`Generator::reset`] still returns to the built one.
    ///
    /// # Errors
    /// [`StateFault`] if a value is not inside the bound [`BOUND_FACTOR`]; the state is then unchanged.
    pub fn set_state(&mut self, state: &OscillatorState<N, I16F16>) -> Result<(), StateFault> {
        let next = Numbers { u: state.displacement.map(I16F16::to_bits), v: state.velocity.map(I16F16::to_bits) };
        inside(&next)?;
        self.now = next;
        self.carry = Carry { u: [0; N], v: [0; N] };
        Ok(())
    }

    /// Wanted joint angles now, in units of 2^-16 rad. No floating point.
    #[must_use]
    pub fn fixed_angles(&self) -> [I16F16; N] {
        let mut angles = self.offsets;
        for ((angle, &u), &amplitude) in angles.iter_mut().zip(&self.now.u).zip(&self.amplitudes) {
            *angle = angle.wrapping_add(product(amplitude, u));
        }
        angles
    }

    /// Their time derivatives now, in units of 2^-16 rad/s. No floating point.
    #[must_use]
    pub fn fixed_rates(&self) -> [I16F16; N] {
        let mut rates = self.speeds;
        for (rate, &v) in rates.iter_mut().zip(&self.now.v) {
            *rate = product(*rate, v);
        }
        rates
    }
}

/// A number times one in 2^-16, rounded.
fn product(a: I16F16, b: i32) -> I16F16 {
    I16F16::from_bits(rounded(i64::from(a.to_bits()).wrapping_mul(i64::from(b)), 16, i32::MAX))
}

fn inside<const N: usize>(state: &Numbers<N>) -> Result<(), StateFault> {
    for (name, values) in [("displacement", &state.u), ("velocity", &state.v)] {
        if let Some(index) = values.iter().position(|value| value.unsigned_abs() >= LIMIT as u32) {
            return Err(StateFault::OutOfBounds { state: Field::at(name, index) });
        }
    }
    Ok(())
}

impl<G: Graph<N, E>, const N: usize, const E: usize> Generator<N> for FixedRobust<G, N, E> {
    fn step(&mut self) {
        let (now, field, half) = (self.now, &self.field, self.half_step);
        let stage = |u_slope: &[i32; N], v_slope: &[i32; N], h: I2F30| Numbers {
            u: along(&now.u, u_slope, h),
            v: along(&now.v, v_slope, h),
        };
        let k1 = field.acceleration(&now);
        let second = stage(&now.v, &k1, half);
        let k2 = field.acceleration(&second);
        let third = stage(&second.v, &k2, half);
        let k3 = field.acceleration(&third);
        let fourth = stage(&third.v, &k3, self.step);
        let k4 = field.acceleration(&fourth);
        let velocities = [&now.v, &second.v, &third.v, &fourth.v];
        accumulate(&mut self.now.u, &mut self.carry.u, self.sixth, velocities);
        accumulate(&mut self.now.v, &mut self.carry.v, self.sixth, [&k1, &k2, &k3, &k4]);
    }

    fn angles(&self) -> [Radians; N] {
        self.fixed_angles().map(|angle| Radians(angle.to_num()))
    }

    fn rates(&self) -> [RadPerSec; N] {
        self.fixed_rates().map(|rate| RadPerSec(rate.to_num()))
    }

    /// No floating point.
    fn phase(&self) -> Phase {
        let (u, v) = (self.now.u.first(), self.now.v.first());
        match (u, v) {
            (Some(&u), Some(&v)) => fixed_trig::angle(I16F16::from_bits(v.wrapping_neg()), I16F16::from_bits(u)),
            _ => Phase(0),
        }
    }

    fn amplitude(&self) -> f32 {
        let square = |x: &i32| i64::from(*x).wrapping_mul(i64::from(*x)) as f32 * (1.0 / 4_294_967_296.0);
        let sum: f32 = self.now.u.iter().chain(&self.now.v).map(square).sum();
        libm::sqrtf(sum / N as f32)
    }

    fn check(&self) -> Result<(), StateFault> {
        inside(&self.now)
    }

    fn reset(&mut self) {
        self.now = self.start;
        self.carry = Carry { u: [0; N], v: [0; N] };
    }
}
