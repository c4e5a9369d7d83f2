//! Takes requests, stages settings, and leads the motion to them.

use cpg_core::Generator;
use cpg_core::gait::named::DefaultGait;
use joint_units::{Joint, Period, Radians};

use crate::motion::ramp::ramp;
use crate::tuning::effect::Effect;
use crate::tuning::parameter::Parameter;
use crate::tuning::request::{Action, Answer, Outcome, Request};
use crate::tuning::settings::Settings;
use crate::tuning::source::Source;

/// Time in which a change is complete, s.
pub const RAMP_S: f32 = 1.0;
/// Longest time that a change waits for a phase boundary, s: longer than a stride at half speed.
pub const LONGEST_WAIT_S: f32 = 4.0;

/// What is fixed: period and park pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Robot {
    pub(crate) period: Period,
    pub(crate) park: [Radians; Joint::COUNT],
}

/// Settings that wait for a phase boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Staged {
    settings: Settings,
    /// The gait, built; `None` if it stays or is the board's own.
    gait: Option<DefaultGait>,
    /// Number of the last request in it.
    number: u16,
    /// Ticks since the first request.
    waited: u32,
}

/// State of the changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tuner {
    ramp_ticks: u32,
    longest_wait: u32,
    robot: Robot,
    /// In effect; the end of the ramp.
    settings: Settings,
    /// Before the last change; the start of the ramp.
    before: Option<Settings>,
    /// Ticks since the last change took effect; `None` once it is complete.
    ramp: Option<u32>,
    staged: Option<Staged>,
    answers: [Option<Answer>; 2],
    /// That of the settings, and where the ramp began.
    effect: Effect,
    was: Effect,
}

impl Tuner {
    pub(crate) fn new(robot: Robot) -> Self {
        let ticks = |seconds: f32| (seconds / robot.period.seconds() + 0.5) as u32;
        Self {
            ramp_ticks: ticks(RAMP_S),
            longest_wait: ticks(LONGEST_WAIT_S),
            robot,
            settings: Settings::default(),
            before: None,
            ramp: None,
            staged: None,
            answers: [None; 2],
            effect: Effect::of(&Settings::default()),
            was: Effect::of(&Settings::default()),
        }
    }

    /// The settings in effect.
    pub(crate) const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Answers of the last tick.
    pub(crate) fn answers(&self) -> impl Iterator<Item = Answer> + use<> {
        self.answers.into_iter().flatten()
    }

    /// Begins a tick: there is no answer yet.
    pub(crate) fn begin(&mut self) {
        self.answers = [None; 2];
    }

    /// Answers the request of a tick.
    pub(crate) fn answer(&mut self, answer: Answer) {
        self.answers = [Some(answer), None];
    }

    /// Takes a request that changes settings; the others are as good as in effect.
    pub(crate) fn take(&mut self, Request { number, action }: Request, follows: bool) -> Outcome {
        match action {
            Action::Stop | Action::Trim { .. } | Action::Jog { .. } => Outcome::InEffect,
            Action::Undo if self.staged.take().is_some() => Outcome::InEffect,
            Action::Undo => match self.before {
                None => Outcome::NothingToUndo,
                Some(before) => self.stage(before, number),
            },
            Action::Set { parameter, thousandths } => {
                let base = self.staged.map_or(self.settings, |staged| staged.settings);
                match parameter {
                    Parameter::Follow if !follows => Outcome::NotAFollower,
                    Parameter::Speed if follows && base.gait().is_none() => Outcome::FollowsAPerson,
                    _ => match base.with(parameter, thousandths) {
                        Ok(settings) => self.stage(settings, number),
                        Err(refused) => refused,
                    },
                }
            }
        }
    }

    /// Stages settings; a gait that they name is built here, so that the tick of the effect costs no more than another.
    fn stage(&mut self, settings: Settings, number: u16) -> Outcome {
        let waited = self.staged.map_or(0, |staged| staged.waited);
        let gait = match settings.gait().filter(|_| settings.gait() != self.settings.gait()) {
            None => None,
            Some(gait) => match gait.build(1.0, self.robot.period) {
                Ok(gait) => Some(gait),
                Err(_) => return Outcome::GaitNotPossible,
            },
        };
        self.staged = Some(Staged { settings, gait, number, waited });
        Outcome::Staged
    }

    /// Advances the ramp, and brings what is staged into effect where it may.
    fn advance(&mut self, source: &mut Source, tick: u32, moving: bool) {
        if let Some(ticks) = self.ramp {
            self.ramp = Some(ticks.saturating_add(1)).filter(|ticks| moving && *ticks < self.ramp_ticks);
        }
        if self.ramp.is_none() {
            source.complete();
        }
        let Some(staged) = &mut self.staged else { return };
        staged.waited = staged.waited.saturating_add(1);
        let due = self.ramp.is_none() && (source.is_at_boundary() || staged.waited > self.longest_wait);
        if moving && !due {
            return;
        }
        let Staged { settings, gait, number, .. } = *staged;
        self.staged = None;
        if settings.gait() != self.settings.gait() {
            source.change(gait);
        }
        self.before = Some(core::mem::replace(&mut self.settings, settings));
        self.was = core::mem::replace(&mut self.effect, Effect::of(&settings));
        if moving {
            self.ramp = Some(0);
        } else {
            source.complete();
        }
        let effect = Some(Answer { tick, number, outcome: Outcome::InEffect });
        match &mut self.answers {
            [first @ None, _] => *first = effect,
            [_, second] => *second = effect,
        }
    }

    /// Advances the source by a tick, at the present speed; `follows`: the board's own generator is a follower. Whether every state is finite and inside
    /// its bound afterwards.
    pub(crate) fn step<G: Generator<{ Joint::COUNT }>>(
        &mut self,
        source: &mut Source,
        own: &mut G,
        follows: bool,
        tick: u32,
        moving: bool,
    ) -> bool {
        self.advance(source, tick, moving);
        let speed = if self.ramp.is_some() { self.present(self.weight()).speed } else { self.effect.speed };
        source.step(own, follows, speed)
    }

    /// The angles with amplitudes and offsets; with the default settings those of the generator, bit for bit.
    pub(crate) fn angles<G: Generator<{ Joint::COUNT }>>(&self, source: &Source, own: &G) -> [Radians; Joint::COUNT] {
        let weight = self.weight();
        let angles = source.angles(own, weight);
        if self.ramp.is_some() {
            self.present(weight).on(angles, &self.robot.park)
        } else if self.effect.is_none {
            angles
        } else {
            self.effect.on(angles, &self.robot.park)
        }
    }

    /// Effect of the settings during the ramp.
    fn present(&self, weight: f32) -> Effect {
        self.was.towards(&self.effect, weight)
    }

    /// Share of the present settings.
    fn weight(&self) -> f32 {
        match self.ramp {
            None => 1.0,
            elapsed => ramp(elapsed, self.ramp_ticks),
        }
    }
}
