//! Hu's half-centre with a compensator and a joint: it oscillates at the resonance that the compensator gives the joint.
//!
//! ```text
//! neurons      Tr x_i' = -x_i - b v_i - a y_j + s - h max(0, +-th),   Ta v_i' = -v_i + y_i,   y_i = max(0, x_i)
//! compensator  torque = k (g (y_1 - y_2) - th) - d th'
//! joint        th'' = torque / inertia = w^2 (g (y_1 - y_2) - th) - 2 z w th'
//! ```
//! A proportional-derivative controller makes the joint a spring k with damping d about an angle that the neurons set; w = 2 pi f_n is
//! the resulting natural frequency, z the damping ratio, g the torque gain divided by k.
//!
//! The feedback is rectified and inhibits: the input of neuron 1, the flexor, is h max(0, th), that of neuron 2 h max(0, -th), each
//! subtracted from the tonic input. Of the six ways to feed an angle to two neurons (either sign; linear, or rectified to either side) only
//! this one gives the published frequencies; with the other sign the joint oscillates at half of its resonance or below. Without feedback
//! the pair oscillates at its own 1.121 Hz for any joint. With it, it oscillates at f_n from 1.2 to 2 Hz within 14 percent at
//! h = 1 or 3, and at 3 Hz only with h = 3; at h = 1 pair and joint do not lock there, see `tests/hu.rs`.
//!
//! Times in s, angles in rad. Sources: Matsuoka 1985 for the pair; Williamson 1998 for it on a joint; Hu, Williamson and Pratt for the
//! compensator.
//!
//! ```
//! use cpg_core::oscillator::hu::HuConfig;
//! let mut joint = HuConfig::<f32>::standard(1.5, 1.0).build(joint_units::Period::MILLISECOND)?;
//! let (mut upward, mut before) = (0, 0.0);
//! for tick in 0..60_000 {
//!     joint.step();
//!     // After ten seconds to settle, fifty of counting.
//!     upward += u32::from(tick >= 10_000 && before < 0.0 && joint.angle() >= 0.0);
//!     before = joint.angle();
//! }
//! assert!((f64::from(upward) / 50.0 - 1.576).abs() < 0.03, "{upward} cycles: the joint's 1.5 Hz, not the pair's 1.12");
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::Period;

use crate::error::{allow_period, in_range};
use crate::math::first_order::{Flow, rk4};
use crate::oscillator::matsuoka::Matsuoka;
use crate::{BuildError, Field, Scalar};

/// Pair, compensator and joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HuConfig<T = f32> {
    /// Rise time constant Tr in s, 0.01 to 10.
    pub rise: T,
    /// Adaptation time constant Ta in s, 0.01 to 100.
    pub adaptation: T,
    /// Strength b of the adaptation, 0 to 20.
    pub fatigue: T,
    /// Mutual inhibition a, 0 to 20.
    pub inhibition: T,
    /// Tonic input s, 0 to 20.
    pub tonic: T,
    /// Feedback h of the joint's angle into the neurons, per rad, 0 to 20.
    pub feedback: T,
    /// Natural frequency f_n that the compensator gives the joint, in Hz, 0.05 to 20.
    pub natural_hz: T,
    /// Damping ratio z that it gives the joint, 0.01 to 2.
    pub damping: T,
    /// Torque of the neurons as a part of the joint's stiffness, rad per unit of firing rate, 0 to 10.
    pub torque_gain: T,
}

impl<T: Scalar> HuConfig<T> {
    /// Tr = 0.1 s, Ta = 0.2 s, a = b = 2.5, s = 1; damping 0.1, torque gain 0.3.
    #[must_use]
    pub fn standard(natural_hz: T, feedback: T) -> Self {
        let of = T::ratio;
        Self {
            rise: of(1, 10),
            adaptation: of(2, 10),
            fatigue: of(5, 2),
            inhibition: of(5, 2),
            tonic: T::ONE,
            feedback,
            natural_hz,
            damping: of(1, 10),
            torque_gain: of(3, 10),
        }
    }

    /// Validates and folds the configuration. Neuron 1 starts at 0.1, all else at rest.
    ///
    /// # Errors
    /// [`BuildError`] naming the first field that is not allowed; [`BuildError::PeriodTooLong`] above a fifth of the rise time, a
    /// fifth of the adaptation time, or a fortieth of the natural period.
    pub fn build(&self, period: Period) -> Result<Hu<T>, BuildError> {
        in_range(self.rise, Field::of("rise"), 0.01, 10.0)?;
        in_range(self.adaptation, Field::of("adaptation"), 0.01, 100.0)?;
        for (value, name) in [
            (self.fatigue, "fatigue"),
            (self.inhibition, "inhibition"),
            (self.tonic, "tonic"),
            (self.feedback, "feedback"),
        ] {
            in_range(value, Field::of(name), 0.0, 20.0)?;
        }
        in_range(self.natural_hz, Field::of("natural_hz"), 0.05, 20.0)?;
        in_range(self.damping, Field::of("damping"), 0.01, 2.0)?;
        in_range(self.torque_gain, Field::of("torque_gain"), 0.0, 10.0)?;
        let fastest =
            (self.rise.to_f32() * 0.2).min(self.adaptation.to_f32() * 0.2).min(0.025 / self.natural_hz.to_f32());
        let max_micros = (fastest * 1e6) as u32;
        allow_period(period, max_micros)?;

        let neurons = Matsuoka {
            rise: self.rise,
            adaptation: self.adaptation,
            fatigue: self.fatigue,
            tonic: self.tonic,
            inhibition: [[T::ZERO, self.inhibition], [self.inhibition, T::ZERO]],
            input: [T::ZERO; 2],
        };
        let w = T::TAU * self.natural_hz;
        let limb = Limb {
            neurons,
            feedback: self.feedback,
            spring: w * w,
            damper: w * self.damping + w * self.damping,
            drive: self.torque_gain,
        };
        let mut start = [T::ZERO; 6];
        start[0] = T::ratio(1, 10);
        Ok(Hu { limb, dt: T::ratio(period.micros(), 1_000_000), start, state: start })
    }
}

/// The vector field: x1, x2, v1, v2, th, th'.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Limb<T> {
    neurons: Matsuoka<2, T>,
    feedback: T,
    spring: T,
    damper: T,
    drive: T,
}

impl<T: Scalar> Flow<T, 6> for Limb<T> {
    fn derivative(&self, &[x1, x2, v1, v2, angle, rate]: &[T; 6]) -> [T; 6] {
        let pair = [x1, x2, v1, v2];
        let input = [-(self.feedback * rectified(angle)), -(self.feedback * rectified(-angle))];
        let neurons = Matsuoka { input, ..self.neurons };
        let [y1, y2] = neurons.rates(&pair);
        let [dx1, dx2, dv1, dv2] = neurons.derivative(&pair);
        [dx1, dx2, dv1, dv2, rate, self.spring * (self.drive * (y1 - y2) - angle) - self.damper * rate]
    }
}

fn rectified<T: Scalar>(value: T) -> T {
    if value > T::ZERO { value } else { T::ZERO }
}

/// The pair and its joint at a fixed period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hu<T = f32> {
    limb: Limb<T>,
    dt: T,
    start: [T; 6],
    /// x1, x2, v1, v2, th, th'.
    state: [T; 6],
}

impl<T: Scalar> Hu<T> {
    /// Advances by one control period.
    pub fn step(&mut self) {
        rk4(&self.limb, &mut self.state, self.dt);
    }

    /// Potentials of the two neurons.
    #[must_use]
    pub fn potentials(&self) -> [T; 2] {
        let [x1, x2, ..] = self.state;
        [x1, x2]
    }

    /// Firing rates of the two neurons.
    #[must_use]
    pub fn rates(&self) -> [T; 2] {
        self.potentials().map(rectified)
    }

    /// Angle of the joint in rad.
    #[must_use]
    pub fn angle(&self) -> T {
        self.state[4]
    }

    /// Rate of the joint in rad/s.
    #[must_use]
    pub fn rate(&self) -> T {
        self.state[5]
    }

    /// Returns to the built state.
    pub fn reset(&mut self) {
        self.state = self.start;
    }
}
