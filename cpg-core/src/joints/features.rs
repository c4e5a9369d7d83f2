//! Features: the state of a generator as a few smooth numbers, for linear read-outs.
//!
//! ```text
//! a_j = c_j0 + sum_m c_jm f_m
//! ```
//! The error of the best c (least squares over a recorded stride) compares the waveforms of all models on one scale. Features are
//! once continuously differentiable in time, so that every such read-out is a joint angle without jumps. Some are nearly linearly
//! dependent (the joints of R1 are nearly sinusoids): solve with a ridge of 1e-3 of their variance, over ten strides or more. With a smaller
//! ridge, large weights amplify small components, such as the second harmonic in the thesis' network.
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::gait::default_walk::{Walk, default_walk};
//! use cpg_core::joints::features::Features;
//! let walk = default_walk(joint_units::Period::MILLISECOND)?;
//! let mut features = [0.0; Walk::COUNT];
//! walk.features(&mut features);
//! assert_eq!(Walk::COUNT, 8);
//! // The left hip starts most flexed, the right one most extended.
//! assert!((features[0] - 1.0).abs() < 0.04 && (features[1] + 1.0).abs() < 0.04);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::Phase;

use crate::gait::default_walk::Walk;
use crate::math::trig::sin_cos;
use crate::waveform::shape::{FourierShape, PhaseShape, Shape, SplineShape};
use crate::{Generator, Oscillators, Scalar};
use joint_units::Radians;

/// A generator whose state can be read out linearly.
pub trait Features {
    /// Number of features.
    const COUNT: usize;

    /// Writes the current features; a shorter slice gets the first ones, elements beyond [`Features::COUNT`] are unchanged.
    fn features(&self, out: &mut [f32]);
}

/// Copies as many as fit.
pub(crate) fn fill(out: &mut [f32], values: impl IntoIterator<Item = f32>) {
    for (place, value) in out.iter_mut().zip(values) {
        *place = value;
    }
}

/// Displacement of each joint, then velocity of each, in the model's units.
impl<F, const N: usize, T: Scalar, I> Features for Oscillators<F, N, T, I> {
    const COUNT: usize = 2 * N;

    fn features(&self, out: &mut [f32]) {
        let state = self.state();
        fill(out, state.displacement.into_iter().chain(state.velocity).map(Scalar::to_f32));
    }
}

/// As those of [`Oscillators`].
impl Features for Walk {
    const COUNT: usize = 8;

    fn features(&self, out: &mut [f32]) {
        let state = self.state();
        fill(out, state.displacement.into_iter().chain(state.velocity));
    }
}

/// cos phi, sin phi, cos 2 phi, sin 2 phi ... up to harmonic H, of the gait phase.
impl<const H: usize, const N: usize> Features for PhaseShape<FourierShape<H>, N> {
    const COUNT: usize = 2 * H;

    fn features(&self, out: &mut [f32]) {
        fill(out, harmonics(self.phase(), H as u32));
    }
}

/// Cosine and sine of each harmonic.
pub(crate) fn harmonics(phase: Phase, count: u32) -> impl Iterator<Item = f32> {
    (1..=count).flat_map(move |order| {
        let (sin, cos) = sin_cos(Phase(phase.0.wrapping_mul(order)));
        [cos, sin]
    })
}

/// The periodic spline that is 1 at one knot and 0 at the others, for each knot but the last: the K of them add up to 1.
impl<const K: usize, const N: usize> Features for PhaseShape<SplineShape<K>, N> {
    const COUNT: usize = K - 1;

    fn features(&self, out: &mut [f32]) {
        let mut knots = [Radians(0.0); K];
        if let Some(first) = knots.first_mut() {
            first.0 = 1.0;
        }
        let Ok(cardinal) = SplineShape::new(knots) else { return };
        let phase = self.phase().0;
        let at = |knot: usize| ((knot as u64) << 32).checked_div(K as u64).unwrap_or(0) as u32;
        fill(out, (0..Self::COUNT).map(|knot| cardinal.at(Phase(phase.wrapping_sub(at(knot)))).angle));
    }
}
