//! Newtypes for the quantities that Footfall's crates exchange.
//!
//! All values are SI: radians, seconds, volts. Degrees and milliseconds occur only where a person reads or writes.
//! Flexion is positive. The joint order is the same everywhere: left hip, right hip, left knee, right knee.
//!
//! ```
//! use joint_units::{Joint, Period, Phase, Radians};
//! let knee_flexion = Radians::from_degrees(60.0);
//! assert!((knee_flexion.0 - 1.047_197_6).abs() < 1e-6);
//! assert_eq!(Joint::ALL[2], Joint::LeftKnee);
//! assert_eq!(Period::MILLISECOND.seconds(), 1e-3);
//! // A phase wraps: a tenth of a cycle after 0.95 is 0.05.
//! let phase = Phase::from_cycles(0.95) + Phase::from_cycles(0.1);
//! assert!((phase.cycles() - 0.05).abs() < 1e-6);
//! ```
//!
//! | type | quantity | unit |
//! |---|---|---|
//! | [`AdcCode`] | raw count of a 12 bit converter | 0 to 4095 |
//! | [`Volts`] | electric potential | V |
//! | [`Celsius`] | temperature | degrees Celsius |
//! | [`Radians`], [`RadPerSec`], [`RadPerSec2`] | joint angle and its derivatives | rad, rad/s, rad/s^2 |
//! | [`Phase`] | position in the gait cycle, as a fraction of the cycle | 2^-32 of a cycle, wraps |
//! | [`PulseMicros`] | width of a servo pulse | us |
//! | [`Period`] | control period | whole us |
//! | [`Joint`] | index of a joint | - |
//!
//! # Glossary
//! - **sample**: what the converter measured for one tick; **code**: one raw count of it.
//! - **tick**: one call of the control loop, one [`Period`] after the one before.
//! - **stride**: one full gait cycle; **step**: half of it.
//! - **phase**: the position in the stride as a fraction of it, 0 to 1, see [`Phase`].
//! - **setpoint**: a joint angle after the limits of the control loop; **pulse**: the servo width made from it.
//!
//! # Features
//! - `defmt`: `defmt::Format` for every type. For a target that links a defmt logger; a host binary does not link with it.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod order;

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
    /// From degrees. One rounded multiplication, so host and board compute the same bits.
    #[must_use]
    pub const fn from_degrees(degrees: f32) -> Self {
        Self(degrees * (PI / 180.0))
    }

    /// In degrees. One rounded multiplication, so host and board compute the same bits.
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

/// Phase of the gait cycle in units of 2^-32 cycles. Sums wrap exactly, so no number of steps loses precision.
///
/// ```
/// use joint_units::Phase;
/// let (a, b) = (Phase::from_cycles(0.9), Phase::from_cycles(0.1));
/// assert!((a + b).cycles_after(Phase::ZERO).abs() < 1e-6);
/// // The difference is that of the shorter way round.
/// assert!((b.cycles_after(a) - 0.2).abs() < 1e-6);
/// assert!((a.cycles_after(b) + 0.2).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Phase(pub u32);

impl Phase {
    /// The start of the cycle.
    pub const ZERO: Phase = Phase(0);

    /// The sum without whole cycles: the operator `+`, for constant expressions.
    #[must_use]
    pub const fn wrapping_add(self, by: Phase) -> Phase {
        Phase(self.0.wrapping_add(by.0))
    }

    /// The difference without whole cycles, 0 to 1 cycle: the operator `-`, for constant expressions.
    #[must_use]
    pub const fn wrapping_sub(self, other: Phase) -> Phase {
        Phase(self.0.wrapping_sub(other.0))
    }

    /// How far `self` is after `other` by the shorter way round, in cycles: -0.5 to 0.5, negative if it is before.
    #[must_use]
    pub const fn cycles_after(self, other: Phase) -> f32 {
        self.counts_after(other) as f32 * (1.0 / 4_294_967_296.0)
    }

    /// How far `self` is after `other` by the shorter way round, in radians: -pi to pi, negative if it is before.
    #[must_use]
    pub const fn radians_after(self, other: Phase) -> Radians {
        Radians(self.counts_after(other) as f32 * (core::f32::consts::TAU / 4_294_967_296.0))
    }

    /// How far `self` is after `other` by the shorter way round, in counts of 2^-32 cycles: exact.
    #[must_use]
    pub const fn counts_after(self, other: Phase) -> i32 {
        // The upper half of the circle becomes the negative numbers.
        self.0.wrapping_sub(other.0) as i32
    }

    /// Phase in cycles, 0 to 1 (1 itself only by rounding to `f32`).
    #[must_use]
    pub const fn cycles(self) -> f32 {
        self.0 as f32 * (1.0 / 4_294_967_296.0)
    }

    /// From cycles, between -2^63 and 2^63: whole cycles are dropped, and -0.25 gives 0.75. NaN gives phase 0.
    #[must_use]
    pub const fn from_cycles(cycles: f32) -> Self {
        // The cast saturates, so keep to one cycle first: `as i64` is exact for every f32 below 2^63. Within a cycle nothing is dropped, and casts
        // of 32 bits do the same, each in one instruction where those of 64 bits are calls.
        let fraction = if cycles > -1.0 && cycles < 1.0 { cycles } else { cycles - (cycles as i64) as f32 };
        let counts = fraction * 4_294_967_296.0;
        Self(if counts < 0.0 { 0_u32.wrapping_sub((-counts) as u32) } else { counts as u32 })
    }
}

impl core::ops::Add for Phase {
    type Output = Phase;

    fn add(self, by: Phase) -> Phase {
        self.wrapping_add(by)
    }
}

impl core::ops::AddAssign for Phase {
    fn add_assign(&mut self, by: Phase) {
        *self = self.wrapping_add(by);
    }
}

impl core::ops::Sub for Phase {
    type Output = Phase;

    fn sub(self, other: Phase) -> Phase {
        self.wrapping_sub(other)
    }
}

/// Width of one servo pulse in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PulseMicros(pub u16);

/// The control period in whole microseconds, so that time is counted in integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Period {
    micros: u32,
}

impl Period {
    /// The period of the board's control loop, 1 kHz.
    pub const MILLISECOND: Period = Period { micros: 1000 };

    /// Longest accepted period in microseconds.
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

/// One of the four joints; the number is its index in every array over the joints.
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
    /// Number of joints of a biped with hips and knees.
    pub const COUNT: usize = 4;

    /// All joints in order.
    pub const ALL: [Joint; Joint::COUNT] = [Joint::LeftHip, Joint::RightHip, Joint::LeftKnee, Joint::RightKnee];

    /// Name in recordings, files and messages: `left_hip`, `right_hip`, `left_knee`, `right_knee`.
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

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phase_wraps_exactly() {
        let step = Phase(0x1234_5677);
        let mut phase = Phase(0);
        for _ in 0..1 << 16 {
            phase += step;
        }
        assert_eq!(phase.0, 0x1234_5677_u32.wrapping_mul(1 << 16));
        assert_eq!(phase - phase, Phase::ZERO);
    }

    #[test]
    fn differences_take_the_shorter_way() {
        let quarter = Phase(1 << 30);
        for start in [0, 1, 0x4000_0000, 0x8000_0000, 0xffff_ffff] {
            let start = Phase(start);
            let end = start + quarter;
            assert_eq!((end.counts_after(start), start.counts_after(end)), (1 << 30, -(1 << 30)));
            assert_eq!((end.cycles_after(start), start.cycles_after(end)), (0.25, -0.25));
            assert_eq!(end.radians_after(start).0, core::f32::consts::FRAC_PI_2);
            assert_eq!((start - quarter).cycles_after(start), -0.25);
        }
    }

    #[test]
    fn phase_from_cycles_keeps_the_fraction_of_either_sign() {
        for (cycles, want) in [(0.25, 1 << 30), (1.25, 1 << 30), (-0.75, 1 << 30), (-3.0, 0), (0.0, 0), (f32::NAN, 0)] {
            assert_eq!(Phase::from_cycles(cycles).0, want, "{cycles}");
        }
        assert_eq!(Phase(3 << 30).cycles(), 0.75);
    }

    /// Over all exponents and both signs, within a cycle and beyond: the fraction of a cycle, cut towards 0, by integers of 64 bits.
    #[test]
    fn phase_from_cycles_is_the_same_by_wider_integers() {
        for bits in (0..=u32::MAX).step_by(4_999) {
            let cycles = f32::from_bits(bits);
            if cycles.abs() < 9.2e18 {
                let fraction = f64::from(cycles) % 1.0;
                let counts = (fraction * 4_294_967_296.0).trunc() as i64 as u32;
                assert_eq!(Phase::from_cycles(cycles).0, counts, "{cycles}");
            }
        }
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
