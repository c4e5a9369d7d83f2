//! The trait of a generator that follows a person: it observes one joint sensor, and optionally a foot switch.

use joint_units::{Phase, RadPerSec, Radians};

use crate::entrainment::FollowStatus;
use crate::{Generator, StateFault};

/// A generator that can be given measurements of a person.
///
/// Call [`Follow::observe`] and [`Follow::heel_strike`] before the [`Generator::step`] that they belong to. A generator that follows
/// nobody does not implement this trait; where it is required (an application that chooses its generator at run time), wrap it in
/// [`Unguided`].
///
/// ```
/// use cpg_core::{Follow, Generator, Unguided};
/// use cpg_core::gait::default_walk::default_walk;
/// use joint_units::{Period, Radians};
/// fn tick<G: Generator<4> + Follow>(generator: &mut G, measured: Option<Radians>) {
///     generator.observe(measured);
///     generator.step();
/// }
/// let mut walk = Unguided(default_walk(Period::MILLISECOND)?);
/// tick(&mut walk, Some(Radians(0.1)));
/// assert_eq!(walk.follow_status(), None);
/// # Ok::<(), cpg_core::BuildError>(())
/// ```
pub trait Follow {
    /// Sets the measured angle for the next step, flexion positive; `None` if the sample is not valid. A step without a call before it counts
    /// as one with `None`.
    fn observe(&mut self, angle: Option<Radians>);

    /// Reports a heel strike for the next step: the foot switch closed since the previous step. Ignored by a follower without a foot switch.
    fn heel_strike(&mut self);

    /// State of the tracking; `None` if the generator follows nobody. A generator has one always or never.
    fn follow_status(&self) -> Option<FollowStatus>;
}

/// A generator that follows nobody, where a [`Follow`] is required: measurements have no effect on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unguided<G>(
    /// The generator.
    pub G,
);

impl<G> Follow for Unguided<G> {
    fn observe(&mut self, _: Option<Radians>) {}

    fn heel_strike(&mut self) {}

    fn follow_status(&self) -> Option<FollowStatus> {
        None
    }
}

impl<G: Generator<N>, const N: usize> Generator<N> for Unguided<G> {
    fn step(&mut self) {
        self.0.step();
    }

    fn angles(&self) -> [Radians; N] {
        self.0.angles()
    }

    fn rates(&self) -> [RadPerSec; N] {
        self.0.rates()
    }

    fn phase(&self) -> Phase {
        self.0.phase()
    }

    fn amplitude(&self) -> f32 {
        self.0.amplitude()
    }

    fn check(&self) -> Result<(), StateFault> {
        self.0.check()
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}
