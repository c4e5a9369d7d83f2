//! The dictionary: one newtype for every quantity that passes a door between two crates, and nothing else.
//!
//! Inside, everything is SI (radians, seconds, volts); degrees and milliseconds appear only where a person reads or writes.
//! Flexion is positive. The joint order is the same everywhere: left hip, right hip, left knee, right knee.
//!
//! ```
//! use joint_units::{Joint, Period, Radians};
//! let knee_flexion = Radians::from_degrees(60.0);
//! assert!((knee_flexion.0 - 1.047_197_6).abs() < 1e-6);
//! assert_eq!(Joint::ALL[2], Joint::LeftKnee);
//! assert_eq!(Period::MILLISECOND.seconds(), 1e-3);
//! ```
//!
//! # Glossary
//! - **sample**: what the converter delivered for one tick; **code**: one raw count of it.
//! - **tick**: one call of the control loop, one [`Period`] after the last.
//! - **phase**: the fraction of the gait cycle that has passed, see [`Phase`].
//! - **setpoint**: the angle that a joint is asked to take; **command**: what the servo is told after the gate.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

use core::f32::consts::PI;

/// A raw count of the 12 bit converter, right aligned: 0 to [`AdcCode::MAX`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AdcCode(pub u16);

impl AdcCode {
    /// Full scale of a 12 bit conversion.
    pub const MAX: AdcCode = AdcCode(4095);
}

/// Electric potential in volts.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Volts(pub f32);

/// Temperature in degrees Celsius.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Celsius(pub f32);

/// Joint angle in radians, flexion positive.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Radians(pub f32);

impl Radians {
    /// From degrees: one rounding, so host and board agree bit for bit.
    #[must_use]
    pub const fn from_degrees(degrees: f32) -> Self {
        Self(degrees * (PI / 180.0))
    }

    /// In degrees, for people: one rounding, so host and board agree bit for bit.
    #[must_use]
    pub const fn degrees(self) -> f32 {
        self.0 * (180.0 / PI)
    }
}

/// Angular velocity in radians per second, flexion positive.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RadPerSec(pub f32);

/// Angular acceleration in radians per second squared, flexion positive.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RadPerSec2(pub f32);

/// Phase of the gait cycle as a fraction of 2^32: it wraps exactly, and no sum of steps ever loses precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Phase(pub u32);

impl Phase {
    /// Phase in cycles, 0 to 1 (1 itself only by rounding to `f32`).
    #[must_use]
    pub const fn cycles(self) -> f32 {
        self.0 as f32 * (1.0 / 4_294_967_296.0)
    }

    /// From cycles; any finite value, whole cycles drop out. Not a number gives phase 0.
    #[must_use]
    pub const fn from_cycles(cycles: f32) -> Self {
        // The cast saturates, so keep to one cycle first: `as i64` is exact for every f32 below 2^63.
        let fraction = cycles - (cycles as i64) as f32;
        Self(((fraction * 4_294_967_296.0) as i64) as u32)
    }
}

/// Width of one servo pulse in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PulseMicros(pub u16);

/// The control period: whole microseconds, so that ticks can be counted in integers for days.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Period {
    micros: u32,
}

impl Period {
    /// The period of the board's control loop, 1 kHz.
    pub const MILLISECOND: Period = Period { micros: 1000 };

    /// Longest period that is accepted, in microseconds.
    pub const MAX_MICROS: u32 = 100_000;

    /// From whole microseconds: 1 to [`Period::MAX_MICROS`], else `None`.
    #[must_use]
    pub const fn from_micros(micros: u32) -> Option<Self> {
        if micros == 0 || micros > Self::MAX_MICROS { None } else { Some(Self { micros }) }
    }

    /// In microseconds.
    #[must_use]
    pub const fn micros(self) -> u32 {
        self.micros
    }

    /// In seconds, correctly rounded.
    #[must_use]
    pub const fn seconds(self) -> f32 {
        // The quotient of two exactly represented integers is rounded once.
        self.micros as f32 / 1_000_000.0
    }
}

/// A joint, in the order that every array of four follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Joint {
    /// Left hip.
    LeftHip = 0,
    /// Right hip.
    RightHip = 1,
    /// Left knee.
    LeftKnee = 2,
    /// Right knee.
    RightKnee = 3,
}

impl Joint {
    /// How many joints a biped of hips and knees has.
    pub const COUNT: usize = 4;

    /// All joints in order.
    pub const ALL: [Joint; Joint::COUNT] = [Joint::LeftHip, Joint::RightHip, Joint::LeftKnee, Joint::RightKnee];

    /// Name as in the columns of a recording: `left_hip`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Joint::LeftHip => "left_hip",
            Joint::RightHip => "right_hip",
            Joint::LeftKnee => "left_knee",
            Joint::RightKnee => "right_knee",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phase_wraps_exactly() {
        let step = Phase(0x1234_5677);
        let mut phase = Phase(0);
        for _ in 0..1 << 16 {
            phase = Phase(phase.0.wrapping_add(step.0));
        }
        assert_eq!(phase.0, 0x1234_5677_u32.wrapping_mul(1 << 16));
    }

    #[test]
    fn phase_from_cycles_keeps_the_fraction_of_either_sign() {
        for (cycles, want) in [(0.25, 1 << 30), (1.25, 1 << 30), (-0.75, 1 << 30), (-3.0, 0), (0.0, 0), (f32::NAN, 0)] {
            assert_eq!(Phase::from_cycles(cycles).0, want, "{cycles}");
        }
        assert_eq!(Phase(3 << 30).cycles(), 0.75);
    }

    #[test]
    fn period_is_correctly_rounded_and_bounded() {
        assert_eq!(Period::MILLISECOND.seconds(), 1e-3);
        assert_eq!(Period::from_micros(333).map(Period::seconds), Some(333e-6));
        assert_eq!(Period::from_micros(0), None);
        assert_eq!(Period::from_micros(Period::MAX_MICROS + 1), None);
    }

    #[test]
    fn joints_index_their_own_place() {
        for (index, joint) in Joint::ALL.into_iter().enumerate() {
            assert_eq!(joint as usize, index);
        }
    }
}
