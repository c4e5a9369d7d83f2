//! Plays a default gait on the host core, with changes of gait and speed during the run, within the limits of the default robot.

pub mod asked_speed;

use cpg_core::Generator;
use cpg_core::gait::family::{STAND, START};
use cpg_core::gait::named::{DefaultGait, Gait};
use cpg_core::transition::{Smooth, TransitionConfig};
use joint_loop::GateConfig;
use joint_units::Period;

use crate::failure::Failure;
use asked_speed::AskedSpeed;

/// A change of the gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// To another gait, at the speed that was asked for or the nearest that it allows. It also starts the walk from a stand.
    To(Gait),
    /// To another speed; in a stand it is kept for the next start.
    Speed(AskedSpeed),
    /// To a stand.
    Stop,
    /// From a stand to the gait.
    Start,
}

/// Whether the gait is walked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// The gait is walked.
    Walking,
    /// On the way to the stand.
    Stopping,
    /// At rest in the pose of the stand.
    Standing,
}

impl State {
    /// The state in one word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Walking => "walking",
            Self::Stopping => "stopping",
            Self::Standing => "standing",
        }
    }
}

const PERIOD: Period = Period::MILLISECOND;

/// What is played.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Playing {
    gait: Gait,
    /// The speed that was asked for.
    asked: AskedSpeed,
    /// The same, or the nearest that the gait allows.
    speed: AskedSpeed,
    stopped: bool,
}

impl Playing {
    /// What is played after a change, and what to say about it.
    fn after(self, change: Change) -> Result<(Self, Option<String>), Failure> {
        Ok(match change {
            Change::To(gait) => {
                let (name, asked, speed) = (gait.name(), self.asked, self.asked.nearest(gait));
                let note = if speed != asked {
                    Some(format!("{name} at {speed}, the nearest to {} that it allows", asked.number()))
                } else {
                    (self.speed != asked).then(|| format!("{name} at {speed} again, as asked for before"))
                };
                (Self { gait, speed, stopped: false, ..self }, note)
            }
            Change::Speed(asked) => {
                asked.allow(self.gait)?;
                let note = || format!("{asked} is kept for the next start");
                (Self { asked, speed: asked, ..self }, self.stopped.then(note))
            }
            Change::Stop => {
                let note = || "`stop` changes nothing, as it is stopped already".into();
                (Self { stopped: true, ..self }, self.stopped.then(note))
            }
            Change::Start => {
                let note = || "`start` changes nothing, as it walks already".into();
                (Self { stopped: false, ..self }, (!self.stopped).then(note))
            }
        })
    }

    fn build(&self) -> Result<DefaultGait, Failure> {
        self.gait.build(self.speed.allow(self.gait)?, PERIOD).map_err(Failure::input)
    }
}

/// A gait that is being played; every change is smooth.
pub struct GaitPlayer {
    playing: Playing,
    smooth: Smooth<DefaultGait, 4>,
    tick: u32,
    /// Pending changes with their times in seconds, the next one last.
    changes: Vec<(f32, Change)>,
    notes: Vec<String>,
}

impl GaitPlayer {
    /// A gait at a speed, with changes at times in seconds.
    ///
    /// # Errors
    /// A speed, now or after one of the changes, is out of range, or a joint would exceed its rate limit.
    pub fn build(gait: Gait, speed: AskedSpeed, mut changes: Vec<(f32, Change)>) -> Result<Self, Failure> {
        let playing = Playing { gait, asked: speed, speed, stopped: false };
        let built = playing.build()?;
        // Of changes at one time the first comes first.
        changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut last, mut notes) = (playing, vec![]);
        for &(at, change) in &changes {
            let (next, note) = last.after(change).map_err(|failure| failure.at(format!("--switch at t={at}")))?;
            notes.extend(note.map(|note| format!("t={at}: {note}")));
            last = next;
        }
        changes.reverse();
        let limits = GateConfig::default_biped().joint_limits();
        let smooth = TransitionConfig::default().build(built, limits, PERIOD).map_err(Failure::run)?;
        Ok(Self { playing, smooth, tick: 0, changes, notes })
    }

    /// Makes a change; returns what to say about it.
    ///
    /// # Errors
    /// The speed is out of range, or a joint would exceed its rate limit; the gait then goes on unchanged.
    pub fn change(&mut self, change: Change) -> Result<Option<String>, Failure> {
        let (next, note) = self.playing.after(change)?;
        let was_stopped = self.playing.stopped;
        if next.stopped && !was_stopped {
            self.smooth.stop(STAND).map_err(Failure::run)?;
        } else if !next.stopped && (was_stopped || next != self.playing) {
            let built = next.build()?;
            // A recorded gait starts from a stand where persons do.
            let phase = if was_stopped && matches!(next.gait, Gait::Human(_)) { START } else { self.smooth.phase() };
            self.smooth.resume();
            self.smooth.change(|gait| *gait = built.aligned(phase, PERIOD));
        }
        self.playing = next;
        Ok(note)
    }

    /// Makes the changes that are due at this tick.
    ///
    /// # Errors
    /// As [`GaitPlayer::change`].
    pub fn make_due_changes(&mut self) -> Result<(), Failure> {
        while let Some((_, change)) = self.changes.pop_if(|(at, _)| (*at * 1e3) as u32 <= self.tick) {
            self.change(change)?;
        }
        Ok(())
    }

    /// Steps by a millisecond.
    pub fn step(&mut self) {
        self.smooth.step();
        self.tick = self.tick.saturating_add(1);
    }

    /// The gait; in a stand that of the next start.
    #[must_use]
    pub const fn gait(&self) -> Gait {
        self.playing.gait
    }

    /// The speed, as a factor on the gait's own cadence; in a stand that of the next start.
    #[must_use]
    pub const fn speed(&self) -> f32 {
        self.playing.speed.factor(self.playing.gait)
    }

    /// The cadence, steps a minute; in a stand that of the next start.
    #[must_use]
    pub const fn cadence(&self) -> f32 {
        self.playing.speed.cadence(self.playing.gait)
    }

    /// What the changes do that was not asked for, each with its time.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Whether the gait is walked.
    #[must_use]
    pub fn state(&self) -> State {
        match (self.playing.stopped, self.smooth.is_changing()) {
            (false, _) => State::Walking,
            (true, true) => State::Stopping,
            (true, false) => State::Standing,
        }
    }

    /// The motion.
    #[must_use]
    pub const fn motion(&self) -> &Smooth<DefaultGait, 4> {
        &self.smooth
    }

    /// Steps so far, milliseconds.
    #[must_use]
    pub const fn tick(&self) -> u32 {
        self.tick
    }

    /// Time so far, seconds.
    #[must_use]
    pub fn t_s(&self) -> f64 {
        f64::from(self.tick) * 1e-3
    }
}
