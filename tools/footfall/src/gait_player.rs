//! Plays a default gait on the host core, with changes of gait and speed during the run.

use cpg_core::Generator;
use cpg_core::gait::family::START;
use cpg_core::gait::named::{DefaultGait, Gait};
use cpg_core::transition::{Smooth, TransitionConfig};
use joint_units::{Period, Radians};

use crate::failure::Failure;

/// A change of the gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// To another gait, at the speed now or the nearest that it allows.
    To(Gait),
    /// To another speed, as a factor on the gait's own cadence.
    Speed(f32),
    /// To another cadence, steps a minute.
    Cadence(f32),
    /// To a stand.
    Stop,
}

/// The pose of a stop: legs straight, knees at 5 degrees.
const STAND: [Radians; 4] = [Radians(0.0), Radians(0.0), Radians::from_degrees(5.0), Radians::from_degrees(5.0)];

const PERIOD: Period = Period::MILLISECOND;

/// A gait that is being played; every change is smooth.
pub struct GaitPlayer {
    gait: Gait,
    speed: f32,
    stopped: bool,
    smooth: Smooth<DefaultGait, 4>,
    tick: u32,
    /// Pending changes with their times in seconds, the next one last.
    changes: Vec<(f32, Change)>,
}

impl GaitPlayer {
    /// A gait at a speed, with changes at times in seconds.
    ///
    /// # Errors
    /// The speed is out of range.
    pub fn build(gait: Gait, speed: f32, mut changes: Vec<(f32, Change)>) -> Result<Self, Failure> {
        changes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let built = gait.build(speed, PERIOD).map_err(Failure::input)?;
        let smooth = TransitionConfig::default().build(built, PERIOD).map_err(Failure::run)?;
        Ok(Self { gait, speed, stopped: false, smooth, tick: 0, changes })
    }

    /// Makes a change.
    ///
    /// # Errors
    /// The speed is out of range; the gait then goes on unchanged.
    pub fn change(&mut self, change: Change) -> Result<(), Failure> {
        let (gait, speed) = match change {
            Change::To(next) => (next, self.speed.clamp(next.speeds().0, next.speeds().1)),
            Change::Speed(factor) => (self.gait, factor),
            Change::Cadence(cadence) => (self.gait, self.gait.speed_at(cadence).map_err(Failure::input)?),
            Change::Stop => {
                self.smooth.stop(STAND);
                self.stopped = true;
                return Ok(());
            }
        };
        let next = gait.build(speed, PERIOD).map_err(Failure::input)?;
        // A recorded gait starts from a stand where persons do.
        let phase = if self.stopped && matches!(gait, Gait::Human(_)) { START } else { self.smooth.phase() };
        (self.gait, self.speed, self.stopped) = (gait, speed, false);
        self.smooth.resume();
        self.smooth.change(|gait| *gait = next.aligned(phase, PERIOD));
        Ok(())
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

    /// The gait.
    #[must_use]
    pub const fn gait(&self) -> Gait {
        self.gait
    }

    /// The speed, as a factor on the gait's own cadence.
    #[must_use]
    pub const fn speed(&self) -> f32 {
        self.speed
    }

    /// The cadence, steps a minute.
    #[must_use]
    pub const fn cadence(&self) -> f32 {
        self.speed * 120.0 / self.gait.stride_s()
    }

    /// Standing, or on the way to the stand.
    #[must_use]
    pub const fn is_stopped(&self) -> bool {
        self.stopped
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
