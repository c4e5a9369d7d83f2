//! The contract of every central pattern generator: one step a tick, then read-outs that change nothing.

use joint_units::{Phase, RadPerSec, Radians};

/// A central pattern generator of `N` joints at a fixed control period.
///
/// A generator is made by the `build(period)` of its own configuration, which validates it; from then on nothing can fail.
/// It takes no clock: the caller calls `step` once a tick. Read-outs change nothing, and may be left out.
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::catalogue;
/// use cpg_core::gait::named::Gait;
/// use joint_units::Period;
/// /// Ticks of the first full cycle of the gait phase, of whatever walks.
/// fn stride(mut walk: impl Generator<4>) -> u32 {
///     let mut wrapped = None;
///     for tick in 0..5000 {
///         let before = walk.phase();
///         walk.step();
///         if walk.phase().0 < before.0 {
///             match wrapped {
///                 None => wrapped = Some(tick),
///                 Some(first) => return tick - first,
///             }
///         }
///     }
///     0
/// }
/// assert!((1099..=1101).contains(&stride(catalogue::robust(Period::MILLISECOND)?)));
/// assert!((1099..=1101).contains(&stride(catalogue::matsuoka(Period::MILLISECOND)?)));
/// assert_eq!(stride(Gait::NaturalWalk.build(1.0, Period::MILLISECOND)?), 1084);
/// # Ok::<(), cpg_core::BuildError>(())
/// ```
pub trait Generator<const N: usize> {
    /// Advances by one control period.
    fn step(&mut self);

    /// Wanted joint angles now, in the order of the configuration (for four joints: [`joint_units::Joint::ALL`]).
    fn angles(&self) -> [Radians; N];

    /// Time derivatives of [`Generator::angles`] now.
    fn rates(&self) -> [RadPerSec; N];

    /// Gait phase of the first joint: grows with time, 0 where that joint is most flexed.
    fn phase(&self) -> Phase;

    /// Amplitude relative to that of the wanted limit cycle: near 1 on it, 0 at rest. Each generator states its own ripple.
    fn amplitude(&self) -> f32;

    /// Whether every state is finite and inside the bound that the generator states.
    ///
    /// # Errors
    /// [`StateFault`] for the first joint that is not.
    fn check(&self) -> Result<(), StateFault>;

    /// Back to the state it was built with.
    fn reset(&mut self);

    /// What the gait sensor says for the coming step; `None` where it is not to be believed. A generator that follows nobody does not
    /// listen.
    fn sense(&mut self, angle: Option<Radians>) {
        let _ = angle;
    }

    /// A foot switch closed within the coming step: the heel of the leg that it is worn on has struck. A generator that follows nobody
    /// does not listen.
    fn heel_strike(&mut self) {}

    /// How it stands with the walker that it follows; `None` of a generator that follows nobody.
    fn following(&self) -> Option<crate::entrainment::FollowStatus> {
        None
    }
}

/// What is wrong with the state of a generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StateFault {
    /// A state of this joint (counted from 0) is infinite or not a number. No number of steps mends that: `reset`.
    NotFinite {
        /// Index of the joint.
        joint: usize,
    },
    /// A state of this joint (counted from 0) has reached its bound and is held there.
    OutOfBounds {
        /// Index of the joint.
        joint: usize,
    },
}

impl core::fmt::Display for StateFault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotFinite { joint } => write!(f, "the state of joint {joint} is not a finite number"),
            Self::OutOfBounds { joint } => write!(f, "the state of joint {joint} is at its bound"),
        }
    }
}

impl core::error::Error for StateFault {}
