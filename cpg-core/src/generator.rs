//! The contract of every central pattern generator: one step a tick, then read-outs that change nothing.

use joint_units::{Phase, RadPerSec, Radians};

use crate::Field;

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
    /// [`StateFault`] naming the first state that is not.
    fn check(&self) -> Result<(), StateFault>;

    /// Back to the state it was built with.
    fn reset(&mut self);
}

/// Which state of a generator is faulty, and how.
///
/// `state` names it as the generator's configuration or model does: `velocity[2]` is the velocity of oscillator 2, `state[5]` is number 5
/// of a flow's states, all counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StateFault {
    /// The state is infinite or not a number. Further steps do not mend it: call [`Generator::reset`].
    NotFinite {
        /// Which state.
        state: Field,
    },
    /// The state is at its bound and held there. Each generator documents its bounds.
    OutOfBounds {
        /// Which state.
        state: Field,
    },
}

impl core::fmt::Display for StateFault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotFinite { state } => write!(f, "state {state} is not a finite number; reset the generator"),
            Self::OutOfBounds { state } => write!(f, "state {state} is at its bound; reset the generator"),
        }
    }
}

impl core::error::Error for StateFault {}
