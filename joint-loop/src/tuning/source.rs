//! The source of the angles: the board's own generator or a gait by name, each at the set speed, and the ramp from one to the other.

use cpg_core::gait::named::DefaultGait;
use cpg_core::{Follow, Generator, StateFault};
use joint_units::{Joint, Phase, Radians};

use crate::tuning::paced::Paced;

/// A gait by name, at its place between two steps.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Named {
    gait: DefaultGait,
    paced: Paced,
}

/// What moves the joints; `None` is the board's own generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Source {
    own: Paced,
    present: Option<Named>,
    /// What the ramp leads away from.
    left: Option<Option<Named>>,
    phase: Phase,
}

impl Source {
    /// The board's own generator.
    pub(crate) fn new(own: &impl Generator<{ Joint::COUNT }>) -> Self {
        Self { own: Paced::new(own), present: None, left: None, phase: own.phase() }
    }

    /// Changes to a gait at its start, or to the board's own generator. The ramp begins.
    pub(crate) fn change(&mut self, to: Option<DefaultGait>) {
        self.left = Some(self.present);
        self.present = to.map(|gait| Named { gait, paced: Paced::new(&gait) });
    }

    /// The ramp is complete.
    pub(crate) fn complete(&mut self) {
        self.left = None;
    }

    /// Advances all by a tick. Returns true at a phase boundary: the phase of what moves the joints passed zero.
    pub(crate) fn step<G: Generator<{ Joint::COUNT }> + Follow>(&mut self, own: &mut G, speed: f32) -> bool {
        // A follower is in the time of the person.
        self.own.step(own, if own.follow_status().is_some() { 1.0 } else { speed });
        for named in self.left.iter_mut().flatten().chain(&mut self.present) {
            named.paced.step(&mut named.gait, speed);
        }
        let phase = self.present.as_ref().map_or_else(|| own.phase(), |named| named.gait.phase());
        let before = core::mem::replace(&mut self.phase, phase);
        before.0.saturating_sub(phase.0) > u32::MAX / 2
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
        self.left.iter().flatten().chain(&self.present).try_for_each(|named| named.gait.check())
    }

    /// Everything at its start; the source stays.
    pub(crate) fn reset<G: Generator<{ Joint::COUNT }>>(&mut self, own: &mut G) {
        own.reset();
        self.own = Paced::new(own);
        self.left = None;
        if let Some(named) = &mut self.present {
            named.gait.reset();
            named.paced = Paced::new(&named.gait);
        }
    }
}
