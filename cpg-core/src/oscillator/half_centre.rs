//! The half-centre: two equal cells, coupled so that one is active while the other rests.
//!
//! ```text
//! x_i' = f(x_i, y_i) + k (x_i - x_j),   y_i' = g(x_i, y_i),   i = 1, 2,  j the other
//! ```
//! Brown's half-centre (1911) is two groups of neurons that inhibit each other: flexor and extensor of a joint, or left and right leg. Here it is a
//! coupling for any cell of two variables whose first one, x, is its activity (the potential of a neuron): the difference link of the thesis'
//! eqs 13-16, which for k > 0 increases the difference of the two activities, so that antiphase is the attractor. The cells may be neurons or Hopf or
//! van der Pol oscillators. [`flexor_extensor`] models inhibition and fatigue explicitly: Matsuoka's pair of neurons on one joint.
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::oscillator::half_centre::flexor_extensor;
//! use joint_units::{Period, Radians};
//! let mut knee = flexor_extensor(1.1, Radians(0.5), Radians(0.3), Period::MILLISECOND)?;
//! let (mut low, mut high) = (f32::MAX, f32::MIN);
//! for _ in 0..1100 {
//!     knee.step();
//!     (low, high) = (low.min(knee.angles()[0].0), high.max(knee.angles()[0].0));
//! }
//! assert!((high - 0.8).abs() < 0.01 && (low + 0.2).abs() < 0.01, "{low} to {high}");
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::{Period, Radians};

use crate::error::in_range;
use crate::joints::linear::{PhasePlane, Readout, ReadoutConfig};
use crate::math::first_order::Flow;
use crate::oscillator::matsuoka::Matsuoka;
use crate::{BuildError, Field, Scalar};

/// Two cells `C`; the state is (x_1, y_1, x_2, y_2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfCentre<C, T = f32> {
    /// The model of each cell.
    pub cell: C,
    /// k, strength of the coupling, above 0.
    pub repulsion: T,
}

impl<T: Scalar, C: Flow<T, 2>> Flow<T, 4> for HalfCentre<C, T> {
    fn derivative(&self, &[x1, y1, x2, y2]: &[T; 4]) -> [T; 4] {
        let push = self.repulsion * (x1 - x2);
        let ([dx1, dy1], [dx2, dy2]) = (self.cell.derivative(&[x1, y1]), self.cell.derivative(&[x2, y2]));
        [dx1 + push, dy1, dx2 - push, dy2]
    }
}

/// One joint on Matsuoka's pair (Tr = 1, Ta = 12, a = b = 2.5): flexor and extensor inhibit each other, and each has fatigue. The angle is
/// `offset + gain (x_F - x_E)`, with the gain that gives the wanted amplitude, 0 to pi rad; `stride_s` is the period in s. The joint starts at its
/// greatest flexion.
///
/// # Errors
/// `amplitude` outside 0 to pi, else as [`ReadoutConfig::build`](crate::joints::linear::ReadoutConfig::build).
pub fn flexor_extensor(
    stride_s: f32,
    amplitude: Radians,
    offset: Radians,
    period: Period,
) -> Result<Readout<Matsuoka<2>, 4, 1>, BuildError> {
    in_range(amplitude.0, Field::of("amplitude"), 0.0, core::f32::consts::PI)?;
    let neurons = Matsuoka::standard([[0.0, 2.5], [2.5, 0.0]]);
    // The largest x_F - x_E on the cycle, which is where it starts.
    let gain = amplitude.0 / 1.566_197;
    let fatigue = 0.183_527;
    let config = ReadoutConfig {
        start: [0.590_258, -0.975_940, fatigue, 0.219_738],
        cycle: 29.581_81,
        stride_s,
        weights: [[gain, -gain, 0.0, 0.0]],
        offsets: [offset],
        plane: PhasePlane { x: 0, y: 2, centre: (-0.1845, fatigue), radius: (0.7972, 0.0981) },
        bound: 10.0,
    };
    config.build(neurons, period)
}

/// Two half-centres of Matsuoka's neurons, left and right leg: neurons 0 and 2 are flexor and extensor of the left leg, 3 and 1 of the right. Each
/// inhibits its antagonist and the corresponding neuron of the other leg with 1.25, so that the flexor of a leg is active together with the extensor
/// of the other.
#[must_use]
pub fn legs() -> Matsuoka<4> {
    let (own, other) = (0.0, 1.25);
    Matsuoka::standard([
        [own, own, other, other],
        [own, own, other, other],
        [other, other, own, own],
        [other, other, own, own],
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Generator;

    /// The stated amplitude, flexor and extensor in turn, each the more active one for half of the stride.
    #[test]
    fn flexor_and_extensor_take_turns() {
        let mut joint = flexor_extensor(0.8, Radians(0.4), Radians(0.1), Period::MILLISECOND).unwrap();
        assert!((joint.angles()[0].0 - 0.5).abs() < 1e-4 && joint.phase().0.wrapping_add(1 << 16) < 1 << 17);
        let (mut low, mut high, mut flexor) = (f32::MAX, f32::MIN, 0);
        for _ in 0..8000 {
            joint.step();
            let [x_flexor, x_extensor, ..] = *joint.state();
            flexor += u32::from(x_flexor > x_extensor);
            let angle = joint.angles()[0].0;
            (low, high) = (low.min(angle), high.max(angle));
        }
        assert!((high - 0.5).abs() < 1e-3 && (low + 0.3).abs() < 1e-3, "{low} to {high}");
        assert!((3990..=4010).contains(&flexor), "{flexor}");
        assert!(flexor_extensor(0.8, Radians(4.0), Radians(0.0), Period::MILLISECOND).is_err());
    }

    /// From random starts the halves of every cell go apart: half a cycle on, each is where the other was.
    #[test]
    fn alike_cells_alternate() {
        fn alternates<C: Flow<f64, 2>>(cell: C, repulsion: f64, cycle: f64, starts: [[f64; 4]; 3]) {
            let pair = HalfCentre { cell, repulsion };
            let steps = 1000;
            for mut state in starts {
                for _ in 0..200 * steps {
                    crate::math::first_order::rk4(&pair, &mut state, cycle / f64::from(steps));
                }
                let before = state;
                for _ in 0..steps / 2 {
                    crate::math::first_order::rk4(&pair, &mut state, cycle / f64::from(steps));
                }
                let [a, b, c, d] = before;
                let off = state.iter().zip([c, d, a, b]).map(|(s, swapped)| (s - swapped).abs() / (1.0 + s.abs()));
                let off = off.fold(0.0, f64::max);
                assert!(off < 0.01, "{before:?} to {state:?}");
            }
        }
        let starts = [[1.0, 0.1, 0.9, 0.2], [-1.0, 0.5, 1.2, 0.3], [0.3, 0.0, 0.31, 0.0]];
        alternates(crate::oscillator::fitzhugh_nagumo::FitzHughNagumo::standard(0.5), 0.04, 39.125_718, starts);
        alternates(crate::oscillator::van_der_pol::VanDerPol { mu: 1.0 }, 0.02, 7.045_957, starts);
        let frequency = core::f64::consts::TAU;
        alternates(crate::oscillator::hopf::Hopf { gain: 8.0, square_radius: 1.0, frequency }, 0.5, 1.003_181, starts);
        let starts = [[-20.0, 0.1, 10.0, 0.3], [0.0, 0.2, 1.0, 0.2], [30.0, 0.4, -40.0, 0.2]];
        alternates(crate::oscillator::morris_lecar::MorrisLecar { current: 100.0 }, 0.005, 83.747_11, starts);
        let starts = [[1.0, 2.0, -1.5, 0.9], [1.0, 5.0, 1.1, 5.0], [-1.5, 6.0, -1.4, 3.0]];
        alternates(crate::oscillator::terman_wang::TermanWang::standard(3.0), 0.3, 89.813_006, starts);
    }
}
