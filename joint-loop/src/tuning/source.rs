//! The source of the angles: the board's own generator or a gait by name, each at the set speed, and the ramp from one to the other.

use cpg_core::gait::named::DefaultGait;
use cpg_core::{Generator, StateFault};
use joint_units::{Joint, Phase, Radians};

use crate::tuning::paced::Paced;

/// A gait by name, at its place between two steps.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Named {
    gait: DefaultGait,
    paced: Paced,
}

/// The source of the angles; without a gait by name it is the board's own generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Source {
    own: Paced,
    present: Option<Named>,
    /// The source that the ramp leaves.
    left: Option<Option<Named>>,
    /// Phases of the source, in the last tick and in the one before.
    phases: [Phase; 2],
}

impl Source {
    /// The board's own generator.
    pub(crate) fn new(own: &impl Generator<{ Joint::COUNT }>) -> Self {
        Self { own: Paced::START, present: None, left: None, phases: [own.phase(); 2] }
    }

    /// Changes to a gait at its start, or to the board's own generator. The ramp begins.
    pub(crate) fn change(&mut self, to: Option<DefaultGait>) {
        self.left = Some(self.present);
        self.present = to.map(|gait| Named { gait, paced: Paced::START });
    }

    /// The ramp is complete.
    pub(crate) fn complete(&mut self) {
        self.left = None;
    }

    /// Advances all by a tick; `follows`: the board's own generator is a follower, which is in the time of the person. Whether every state is finite and
    /// inside its bound afterwards, as [`Source::check`] says.
    pub(crate) fn step<G: Generator<{ Joint::COUNT }>>(&mut self, own: &mut G, follows: bool, speed: f32) -> bool {
        let mut sound = self.own.step(own, if follows { 1.0 } else { speed });
        if let Some(Some(named)) = &mut self.left {
            sound &= named.paced.step(&mut named.gait, speed);
        }
        if let Some(named) = &mut self.present {
            sound &= named.paced.step(&mut named.gait, speed);
        }
        let phase = self.present.as_ref().map_or_else(|| own.phase(), |named| named.gait.phase());
        self.phases = [phase, self.phases[0]];
        sound
    }

    /// Whether the last tick was a phase boundary: the phase of the source passed zero.
    pub(crate) fn is_at_boundary(&self) -> bool {
        let [now, before] = self.phases;
        before.0.saturating_sub(now.0) > u32::MAX / 2
    }

    /// The angles; `weight` is the share of the new source while a ramp leads from one to the other.
    pub(crate) fn angles<G: Generator<{ Joint::COUNT }>>(&self, own: &G, weight: f32) -> [Radians; Joint::COUNT] {
        let of = |named: &Option<Named>| match named {
            None => self.own.angles(own),
            Some(named) => named.paced.angles(&named.gait),
        };
        let mut angles = of(&self.present);
        if let Some(left) = &self.left {
            for (angle, left) in angles.iter_mut().zip(of(left)) {
                angle.0 = left.0 + (angle.0 - left.0) * weight;
            }
        }
        angles
    }

    /// Whether every state is finite and inside its bound.
    pub(crate) fn check<G: Generator<{ Joint::COUNT }>>(&self, own: &G) -> Result<(), StateFault> {
        own.check()?;
        if let Some(Some(left)) = &self.left {
            left.gait.check()?;
        }
        self.present.as_ref().map_or(Ok(()), |named| named.gait.check())
    }

    /// Everything at its start; the source stays.
    pub(crate) fn reset<G: Generator<{ Joint::COUNT }>>(&mut self, own: &mut G) {
        own.reset();
        self.own = Paced::START;
        self.left = None;
        if let Some(named) = &mut self.present {
            named.gait.reset();
            named.paced = Paced::START;
        }
    }
}
