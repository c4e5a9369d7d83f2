//! The Morris-Lecar neuron: a calcium and a potassium conductance, in mV, ms, uF/cm^2, mS/cm^2 and uA/cm^2.
//!
//! ```text
//! C V' = I - gCa m(V) (V - VCa) - gK n (V - VK) - gL (V - VL),   n' = phi (n_inf(V) - n) cosh((V - V3) / (2 V4))
//! m(V) = (1 + tanh((V - V1)/V2)) / 2,   n_inf(V) = (1 + tanh((V - V3)/V4)) / 2
//! ```
//! Source: Morris and Lecar 1981; the constants are the set in which firing begins by a Hopf bifurcation (Rinzel and Ermentrout).
//!
//! ```
//! use cpg_core::math::first_order::rk4;
//! use cpg_core::oscillator::morris_lecar::MorrisLecar;
//! let (neuron, mut state, mut highest) = (MorrisLecar { current: 100.0 }, [-20.0, 0.3], -100.0f32);
//! // Half a second, and then a quarter.
//! for tick in 0..15_000 {
//!     rk4(&neuron, &mut state, 0.05);
//!     highest = if tick < 10_000 { state[0] } else { highest.max(state[0]) };
//! }
//! assert!((highest - 33.3258).abs() < 0.01, "{highest} mV");
//! ```

use crate::math::first_order::{Flow, Hyperbolic};

/// The neuron with its standard constants; the state is (V in mV, n).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MorrisLecar<T = f32> {
    /// Input current I in uA/cm^2; fires from about 94 to 212.
    pub current: T,
}

impl<T: Hyperbolic> Flow<T, 2> for MorrisLecar<T> {
    fn derivative(&self, &[v, n]: &[T; 2]) -> [T; 2] {
        let constant = |value: f32| T::from_f32(value);
        let half = T::ratio(1, 2);
        let gate = |at: f32, width: f32| half * (T::ONE + ((v - constant(at)) / constant(width)).tanh());
        // V1 = -1.2, V2 = 18, V3 = 2, V4 = 30 mV; C = 20, gCa = 4.4, gK = 8, gL = 2; VCa = 120, VK = -84, VL = -60; phi = 0.04.
        let calcium = T::ratio(44, 10)
            * half
            * (T::ONE + ((v + T::ratio(12, 10)) / constant(18.0)).tanh())
            * (v - constant(120.0));
        let potassium = constant(8.0) * n * (v + constant(84.0));
        let leak = constant(2.0) * (v + constant(60.0));
        let pace = T::ratio(4, 100) * ((v - constant(2.0)) / constant(60.0)).cosh();
        [(self.current - calcium - potassium - leak) * T::ratio(1, 20), pace * (gate(2.0, 30.0) - n)]
    }
}
