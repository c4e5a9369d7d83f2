//! The trait of every central pattern generator: one step a tick, and read-outs of its state.

use joint_units::{Phase, RadPerSec, Radians};

use crate::Field;

/// A central pattern generator of `N` joints at a fixed control period.
///
/// A generator is made by the `build(period)` of its own configuration, which validates it; the methods here cannot fail. A generator has no
/// clock: the caller calls [`Generator::step`] once every control period. All other methods but [`Generator::reset`] only read the state, so
/// they may be called in any number and order.
///
/// For a generator of your own: [`Generator::angles`] may jump, as nothing here limits them; `joint-loop` and [`crate::transition::Smooth`] do.
/// The README of `joint-loop` has a complete example.
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::catalogue;
/// use cpg_core::gait::named::Gait;
/// use joint_units::Period;
/// /// Ticks of the first full cycle of the gait phase, of any generator.
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

    /// Wanted joint angles now, flexion positive, in the order of the configuration (for four joints: [`joint_units::Joint::ALL`]). They are
    /// not limited to a joint's range or a servo's rate.
    fn angles(&self) -> [Radians; N];

    /// Time derivatives of [`Generator::angles`] now.
    fn rates(&self) -> [RadPerSec; N];

    /// Gait phase: the phase of the first joint, 0 where the joint is most flexed, increasing with time. A generator whose phase has another zero says
    /// so.
    fn phase(&self) -> Phase;

    /// Amplitude relative to the wanted limit cycle, 0 or above: near 1 on the cycle, 0 at rest. How much it varies within a stride
    /// depends on the generator; one without such a size returns 1.
    fn amplitude(&self) -> f32;

    /// Whether every state is finite and inside the bound that the generator states. After `Ok`, angles and rates must be finite.
    ///
    /// # Errors
    /// [`StateFault`] names the first state that is not.
    fn check(&self) -> Result<(), StateFault>;

    /// Returns to the state after `build`.
    fn reset(&mut self);
}

/// Which state of a generator is faulty, and how.
///
/// `state` is the name of the state in the generator's configuration or model: `velocity[2]` is the velocity of oscillator 2, `state[5]` is number 5
/// of a flow's states, all counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StateFault {
    /// The state is infinite or not a number. It stays so in further steps: call [`Generator::reset`].
    NotFinite {
        /// Which state.
        state: Field,
    },
    /// The state has reached its bound, to which every step limits it. Each generator documents its bounds.
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
