//! Corrects the angles of a follower by what its sensor shows beyond the phase: linear in the recent innovation, with gains over the phase.
//!
//! ```text
//! c_j -> f clamp( sum_i G_ji(phi) x_i, +-C ),   x = [ 1, m_1 .. m_6 ],   m_k' = (clamp(e, +-L) - m_k) / (tau_k T)
//! f = clamp( (4 - E / E_0) / 2, 0, 1 )
//! ```
//! | symbol | quantity |
//! |---|---|
//! | c_j | correction of joint j, rad, added to its template; it moves with bounded acceleration and lags behind its target by [`delay_ticks`] |
//! | phi | phase of the [phase lock](crate::entrainment::phase_lock) |
//! | e | its innovation, rad: the measured less the predicted angle of the measured joint |
//! | T | stride time of the template's person |
//! | m_k | low-passed innovation, rad, with the time constant tau_k T; tau_k = 0.01, 0.02, 0.04, 0.08, 0.16, 0.32 strides |
//! | L | largest innovation that is used: 0.35 rad (20 degrees) |
//! | G_ji | gain: a Fourier series of [`HARMONICS`] harmonics |
//! | C | [`LARGEST`] |
//! | E, E_0 | root mean square of e over about the last 0.4 s, and in the recording that the gains were learned from (the usual innovation) |
//!
//! A template at the person's phase has the mean stride. Each stride differs from it, and the recent innovation of the measured joint tells how the
//! others are about to differ: after one stride the slowest low-pass filter still has 4 % of it. The gains are learned from a recording
//! by least squares (`gait_fit::corrections`). The cadence is no input: in a recording it varies by about 1 %, and a gain that was learned from that
//! says nothing about a cadence that is 10 % higher.
//!
//! Corrections act in a near lock with good samples, and while the follower bridges missing samples in a lock; then the memories keep their values. In
//! any other state the target is 0. The factor f reduces them where the measured joint differs from its template by more than twice what is usual:
//! there they would be an extrapolation.

use core::f32::consts::TAU;

use joint_units::{Joint, Period, Phase, Radians};

use super::bounded_phase::BoundedNumber;
use crate::BuildError;
use crate::error::{Field, in_range};
use crate::math::braking::Braking;
use crate::math::trig::sin_cos;

/// Inputs x of a correction.
pub const INPUTS: usize = 1 + MEMORIES;
/// Harmonics of a gain.
pub const HARMONICS: usize = 5;
/// Coefficients of a gain: the mean, then cosine and sine of harmonic 1, of harmonic 2, ...
pub const TERMS: usize = 1 + 2 * HARMONICS;
/// Largest correction C, rad.
pub const LARGEST: f32 = 0.25;
/// Largest coefficient of a gain, in radians for each unit of the input.
pub const MAX_GAIN: f32 = 50.0;

/// Least root mean square of the innovation in a recording, rad.
const LEAST_INNOVATION: f32 = 1e-4;
/// Root mean square of the innovation, as a multiple of that in the recording, up to which a correction is whole, and from which on there is none.
const ALL_TO: f32 = 2.0;
const NONE_FROM: f32 = 4.0;
const MEMORIES: usize = 6;
/// Time constants tau_k, strides.
const MEMORY_STRIDES: [f32; MEMORIES] = [0.01, 0.02, 0.04, 0.08, 0.16, 0.32];
/// Largest innovation L that is used, rad: that of a person who walks.
const LARGEST_INNOVATION: f32 = 0.35;
/// Time constant of the correction, us: 10 ms.
const TIME_CONSTANT_US: u32 = 10_000;
/// Stiffness k of the correction, 1/s.
const STIFFNESS: f32 = 1e6 / TIME_CONSTANT_US as f32;
/// Longest control period, us: both poles of the correction lie at 2k, as those of the driven phase, and the step is stable up to 1/(2k).
pub(super) const LONGEST_PERIOD_US: u32 = TIME_CONSTANT_US / 2;
/// Largest acceleration of the correction, rad/s^2.
pub(super) const ACCELERATION: f32 = 200.0;

/// The gains of four joints.
#[derive(Clone, Copy, PartialEq)]
pub struct Corrections {
    /// Root mean square E_0 of the innovation in the recording, rad; 0.0001 to 1 where a gain is not 0.
    pub usual_innovation: Radians,
    /// Coefficients in rad for each unit of the input: of each joint in the order of [`Joint::ALL`], each input, each term; within
    /// ±[`MAX_GAIN`].
    pub gains: [[[f32; TERMS]; INPUTS]; Joint::COUNT],
}

/// Fields of each joint in a [`BuildError`]: the gains of the constant, and of each low-passed innovation.
const FIELDS: [[&str; INPUTS]; Joint::COUNT] = {
    macro_rules! fields {
        ($joint:literal) => {
            [
                concat!($joint, ".correction.constant"),
                concat!($joint, ".correction.innovation[0]"),
                concat!($joint, ".correction.innovation[1]"),
                concat!($joint, ".correction.innovation[2]"),
                concat!($joint, ".correction.innovation[3]"),
                concat!($joint, ".correction.innovation[4]"),
                concat!($joint, ".correction.innovation[5]"),
            ]
        };
    }
    [fields!("left_hip"), fields!("right_hip"), fields!("left_knee"), fields!("right_knee")]
};

/// As the Rust expression that makes it.
impl core::fmt::Debug for Corrections {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if *self == Self::NONE {
            return f.write_str("Corrections::NONE");
        }
        let Self { usual_innovation, gains } = self;
        f.debug_struct("Corrections").field("usual_innovation", usual_innovation).field("gains", gains).finish()
    }
}

impl Default for Corrections {
    fn default() -> Self {
        Self::NONE
    }
}

impl Corrections {
    /// No corrections.
    pub const NONE: Self = Self { usual_innovation: Radians(0.0), gains: [[[0.0; TERMS]; INPUTS]; Joint::COUNT] };

    /// All gains are 0.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.gains.as_flattened().as_flattened().iter().all(|gain| *gain == 0.0)
    }

    pub(super) fn validate(&self) -> Result<(), BuildError> {
        let least = if self.is_none() { 0.0 } else { LEAST_INNOVATION };
        in_range(self.usual_innovation.0, Field::of("usual_innovation"), least, 1.0)?;
        for (name, terms) in FIELDS.as_flattened().iter().zip(self.gains.as_flattened()) {
            for (term, gain) in terms.iter().enumerate() {
                in_range(*gain, Field::at(name, term), -MAX_GAIN, MAX_GAIN)?;
            }
        }
        Ok(())
    }

    /// The target of each joint, rad.
    fn at(&self, inputs: &[f32; INPUTS], terms: &[f32; TERMS], innovation: f32) -> [f32; Joint::COUNT] {
        let times = innovation / self.usual_innovation.0.max(LEAST_INNOVATION);
        let factor = ((NONE_FROM - times) / (NONE_FROM - ALL_TO)).clamp(0.0, 1.0);
        let gain = |of: &[f32; TERMS]| of.iter().zip(terms).map(|(gain, term)| gain * term).sum::<f32>();
        self.gains.each_ref().map(|joint| {
            let sum: f32 = joint.iter().zip(inputs).map(|(of, input)| gain(of) * input).sum();
            factor * sum.clamp(-LARGEST, LARGEST)
        })
    }
}

/// Delay of a correction behind its target in periods: 1/k less one period, as the step uses the target of its end. Gains are learned for the angle
/// that the joint has by then. At 1 kHz it is 9 ms.
#[must_use]
pub const fn delay_ticks(period: Period) -> u32 {
    (TIME_CONSTANT_US / period.micros()).saturating_sub(1)
}

/// The terms of a gain at a phase: 1, then cosine and sine of each harmonic.
#[must_use]
pub fn terms(phase: Phase) -> [f32; TERMS] {
    let (s1, c1) = sin_cos(phase);
    let (mut s, mut c) = (s1, c1);
    let mut terms = [1.0; TERMS];
    for [cos, sin] in terms.as_rchunks_mut().1 {
        (*cos, *sin) = (c, s);
        (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
    }
    terms
}

/// The inputs of a correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Inputs {
    memories: [f32; MEMORIES],
    /// There are inputs: the last sample was good, in a near lock.
    is_active: bool,
    /// Part of the way to the innovation that a memory goes in a period.
    steps: [f32; MEMORIES],
}

impl Inputs {
    /// For strides at this angular frequency, rad/s.
    pub(super) fn new(nominal: f32, period: Period) -> Self {
        let stride_s = TAU / nominal;
        let steps = MEMORY_STRIDES.map(|strides| 1.0 - libm::expf(-period.seconds() / (strides * stride_s)));
        Self { memories: [0.0; MEMORIES], is_active: false, steps }
    }

    /// Takes the innovation (rad) of one period with a good sample in a near lock.
    pub(super) fn take(&mut self, innovation: f32) {
        let innovation = innovation.clamp(-LARGEST_INNOVATION, LARGEST_INNOVATION);
        for (memory, step) in self.memories.iter_mut().zip(&self.steps) {
            *memory += (innovation - *memory) * step;
        }
        self.is_active = true;
    }

    /// Forgets what was: there is no near lock, or no good sample.
    pub(super) fn forget(&mut self) {
        self.memories = [0.0; MEMORIES];
        self.is_active = false;
    }

    /// The inputs x; `None` if there are none.
    pub(super) fn values(&self) -> Option<[f32; INPUTS]> {
        let [a, b, c, d, e, f] = self.memories;
        self.is_active.then_some([1.0, a, b, c, d, e, f])
    }
}

/// The corrections of four joints, as they are now.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Corrected {
    pub(super) joints: [BoundedNumber; Joint::COUNT],
}

impl Corrected {
    /// One period towards the target of `gains`, which is 0 without inputs. `innovation` is its recent root mean square, rad.
    pub(super) fn step(&mut self, gains: &Corrections, inputs: &Inputs, innovation: f32, phase: Phase, period: Period) {
        let law = Braking { stiffness: STIFFNESS, acceleration: ACCELERATION, period_s: period.seconds() };
        let targets =
            inputs.values().map_or([0.0; Joint::COUNT], |inputs| gains.at(&inputs, &terms(phase), innovation));
        for (joint, target) in self.joints.iter_mut().zip(targets) {
            joint.approach(target, &law);
        }
    }
}

/// Upper bound of the rate of a correction, rad/s: the law brakes a distance of 2 C at most.
pub(super) fn fastest() -> f32 {
    libm::sqrtf(2.0 * LARGEST * ACCELERATION)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A target that moves at a constant rate: the distance from it is that rate times the delay.
    #[test]
    fn a_correction_lags_by_its_delay() {
        for micros in [250, 1000, 2000] {
            let period = Period::from_micros(micros).unwrap();
            let law = Braking { stiffness: STIFFNESS, acceleration: ACCELERATION, period_s: period.seconds() };
            let (mut joint, rate) = (BoundedNumber::default(), 0.1);
            let mut target = 0.0;
            for tick in 1..=(400_000 / micros) {
                target = rate * tick as f32 * period.seconds();
                joint.approach(target, &law);
            }
            let lag = (target - joint.value) / rate / period.seconds();
            assert!((lag - delay_ticks(period) as f32).abs() < 0.02, "{micros} us: {lag} periods");
        }
        assert_eq!(delay_ticks(Period::MILLISECOND), 9);
    }
}
