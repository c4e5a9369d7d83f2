//! N second-order oscillators with one vector field: state, step and read-outs that all such models share.
//!
//! A model supplies its vector field ([`SecondOrder`]) and the units of its numbers (`Terms`); this makes it a [`Generator`].
//!
//! Every state is limited to a bound after every step: outside of its region of stability an explicit method doubles its error in a few
//! ticks; at the bound the model's own damping brings the state back. A state that is not a number is left as it is, so that
//! [`Generator::check`] finds it.

use core::marker::PhantomData;

use joint_units::{Phase, RadPerSec, Radians};

use crate::math::second_order::SecondOrder;
use crate::{Field, Generator, Integrator, Rk4, Scalar, StateFault};

/// Bound of a state, as a multiple of the closed-form amplitude of the limit cycle.
pub const BOUND_FACTOR: f32 = 3.0;

/// Displacement and velocity of each joint, in the units of the model (see its module).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OscillatorState<const N: usize, T = f32> {
    /// Displacement from the offset.
    pub displacement: [T; N],
    /// Velocity.
    pub velocity: [T; N],
}

/// Units of the numbers of a model.
pub(crate) struct Terms<const N: usize, T> {
    /// Time unit of the integrator, in s.
    pub(crate) unit: T,
    /// The model's velocity, per displacement in one time unit.
    pub(crate) velocity: [T; N],
    /// Radians per displacement.
    pub(crate) radians: [T; N],
    /// Angle at displacement 0, in rad.
    pub(crate) offsets: [T; N],
    /// Amplitudes on the limit cycle, as far as a closed form gives them.
    pub(crate) cycle: OscillatorState<N, T>,
    /// Bound of each state.
    pub(crate) limit: OscillatorState<N, T>,
}

/// `N` oscillators under the vector field `F`, computed in `T`, advanced by `I`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillators<F, const N: usize, T = f32, I = Rk4> {
    field: F,
    /// Displacement x, and v, displacement per time unit of the integrator.
    now: Pair<N, T>,
    start: Pair<N, T>,
    limit: Pair<N, T>,
    /// The model's velocity per v, and back.
    velocity: [T; N],
    per_velocity: [T; N],
    /// Parts of the limit cycle's amplitude, per x and per v.
    parts: Pair<N, T>,
    /// rad per x, rad/s per v.
    radians: Pair<N, T>,
    offsets: [T; N],
    per_joint: T,
    method: PhantomData<I>,
}

/// One number for x and one for v of each joint.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pair<const N: usize, T> {
    x: [T; N],
    v: [T; N],
}

impl<F, const N: usize, T: Scalar, I> Oscillators<F, N, T, I> {
    /// `field` is folded for the time unit in `terms`.
    pub(crate) fn new(field: F, start: &OscillatorState<N, T>, terms: &Terms<N, T>) -> Self {
        let inverse = |a: [T; N]| a.map(|a| T::ONE / a);
        let per_velocity = inverse(terms.velocity);
        let inside =
            |state: &OscillatorState<N, T>| Pair { x: state.displacement, v: product(&state.velocity, &per_velocity) };
        let start = inside(start);
        let cycle = inside(&terms.cycle);
        Self {
            field,
            now: start,
            start,
            limit: inside(&terms.limit),
            velocity: terms.velocity,
            per_velocity,
            parts: Pair { x: inverse(cycle.x), v: inverse(cycle.v) },
            radians: Pair { x: terms.radians, v: terms.radians.map(|r| r / terms.unit) },
            offsets: terms.offsets,
            per_joint: T::ratio(1, N as u32),
            method: PhantomData,
        }
    }

    /// The current state, in the units of the model.
    #[must_use]
    pub fn state(&self) -> OscillatorState<N, T> {
        OscillatorState { displacement: self.now.x, velocity: product(&self.now.v, &self.velocity) }
    }

    /// The current state as the integrator has it: velocities are displacements per time unit, of which a control period has
    /// [`Integrator::UNITS`].
    #[must_use]
    pub fn state_per_unit(&self) -> OscillatorState<N, T> {
        OscillatorState { displacement: self.now.x, velocity: self.now.v }
    }

    /// The bound of each state, in the units of the model.
    #[must_use]
    pub fn limit(&self) -> OscillatorState<N, T> {
        OscillatorState { displacement: self.limit.x, velocity: product(&self.limit.v, &self.velocity) }
    }

    /// Sets the state; [`Generator::reset`] still returns to the built one.
    ///
    /// # Errors
    /// [`StateFault`] if a value is not finite or not inside its bound; the state is then unchanged.
    pub fn set_state(&mut self, state: &OscillatorState<N, T>) -> Result<(), StateFault> {
        let next = Pair { x: state.displacement, v: product(&state.velocity, &self.per_velocity) };
        self.inside(&next)?;
        self.now = next;
        Ok(())
    }

    /// Whether every state is inside its bound; the error names the first that is not.
    fn inside(&self, state: &Pair<N, T>) -> Result<(), StateFault> {
        let oscillators = state.x.iter().zip(&state.v).zip(self.limit.x.iter().zip(&self.limit.v));
        for (index, ((&x, &v), (&limit_x, &limit_v))) in oscillators.enumerate() {
            for (name, value, limit) in [("displacement", x, limit_x), ("velocity", v, limit_v)] {
                if value.is_within(limit) {
                    continue;
                }
                let state = Field::at(name, index);
                return Err(match value.is_finite() {
                    true => StateFault::OutOfBounds { state },
                    false => StateFault::NotFinite { state },
                });
            }
        }
        Ok(())
    }
}

impl<F: SecondOrder<T, N>, const N: usize, T: Scalar, I: Integrator> Generator<N> for Oscillators<F, N, T, I> {
    fn step(&mut self) {
        I::advance(&self.field, &mut self.now.x, &mut self.now.v);
        hold(&mut self.now.x, &self.limit.x);
        hold(&mut self.now.v, &self.limit.v);
    }

    fn angles(&self) -> [Radians; N] {
        let mut angles = [Radians(0.0); N];
        let moves = product(&self.now.x, &self.radians.x);
        for ((angle, x), &offset) in angles.iter_mut().zip(moves).zip(&self.offsets) {
            *angle = Radians((offset + x).to_f32());
        }
        angles
    }

    fn rates(&self) -> [RadPerSec; N] {
        product(&self.now.v, &self.radians.v).map(|v| RadPerSec(v.to_f32()))
    }

    fn phase(&self) -> Phase {
        let first = |pair: &Pair<N, T>| Some((*pair.x.first()?, *pair.v.first()?));
        match (first(&self.now), first(&self.parts)) {
            (Some((x, v)), Some((part_x, part_v))) => T::angle(-(v * part_v), x * part_x),
            _ => Phase(0),
        }
    }

    fn amplitude(&self) -> f32 {
        let (x, v) = (product(&self.now.x, &self.parts.x), product(&self.now.v, &self.parts.v));
        let squares = x.into_iter().zip(v).fold(T::ZERO, |sum, (x, v)| sum + (x * x + v * v));
        (squares * self.per_joint).sqrt().to_f32()
    }

    fn check(&self) -> Result<(), StateFault> {
        self.inside(&self.now)
    }

    fn reset(&mut self) {
        self.now = self.start;
    }
}

fn product<T: Scalar, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    let mut out = *a;
    for (out, &b) in out.iter_mut().zip(b) {
        *out = *out * b;
    }
    out
}

fn hold<T: Scalar, const N: usize>(values: &mut [T; N], limits: &[T; N]) {
    for (value, &limit) in values.iter_mut().zip(limits) {
        *value = value.clamp_to(limit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait::default_walk::default_config;
    use crate::network::graph::Biped;
    use crate::network::phase_coupled::Robust;
    use joint_units::Period;

    fn net() -> Robust<Biped, 4, 4> {
        default_config().build(Period::MILLISECOND).expect("the default walk")
    }

    #[test]
    fn not_a_number_is_found_and_only_reset_mends_it() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut net = net();
            net.now.v[1] = bad;
            assert_eq!(net.check(), Err(StateFault::NotFinite { state: Field::at("velocity", 1) }), "{bad}");
        }
        let mut net = net();
        net.now.x[3] = f32::NAN;
        for _ in 0..10 {
            net.step();
            assert!(matches!(net.check(), Err(StateFault::NotFinite { .. })));
        }
        net.reset();
        assert_eq!(net.check(), Ok(()));
    }

    #[test]
    fn a_corrupted_state_is_held_at_its_bound() {
        for bad in [50.0_f32, -1e3] {
            let mut net = net();
            net.now.x[0] = bad;
            net.step();
            assert!(net.now.x.iter().all(|x| x.abs() <= 3.0), "{bad}: {:?}", net.now.x);
            assert_eq!(net.check(), Err(StateFault::OutOfBounds { state: Field::at("displacement", 0) }), "{bad}");
            for _ in 0..10_000 {
                net.step();
            }
            assert_eq!(net.check(), Ok(()), "{bad}");
            assert!((net.amplitude() - 1.0).abs() < 0.05, "{bad}");
        }
        // So large that its cube overflows: the bound does not limit that, but the check finds it.
        let mut net = net();
        net.now.x[0] = -1e30;
        net.step();
        assert!(net.check().is_err());
    }
}
