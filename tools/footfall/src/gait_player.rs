//! Plays a default gait on the host core, with changes of gait and speed during the run, within the limits of the default robot.

use cpg_core::Generator;
use cpg_core::gait::named::{DefaultGait, Gait, SPEEDS};
use cpg_core::transition::{Smooth, TransitionConfig};
use joint_loop::GateConfig;
use joint_units::{Period, Radians};

use crate::failure::Failure;

/// A change of the gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// To another gait.
    To(Gait),
    /// To another speed, as a factor on the gait's own cadence.
    Speed(f32),
    /// To a stand.
    Stop,
}

impl Change {
    /// Gait and speed after the change.
    const fn after(self, (gait, speed): (Gait, f32)) -> (Gait, f32) {
        match self {
            Change::To(next) => (next, speed),
            Change::Speed(factor) => (gait, factor),
            Change::Stop => (gait, speed),
        }
    }
}

/// Builds a gait whose joints keep to the rate limits of the default robot.
fn allowed(gait: Gait, speed: f32) -> Result<DefaultGait, Failure> {
    let built = gait.build(speed, PERIOD).map_err(Failure::input)?;
    gait.allow_speed(speed, &GateConfig::default_biped().joint_limits()).map_err(Failure::input)?;
    Ok(built)
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
    /// A speed, now or after one of the changes, is out of range, or a joint would exceed its rate limit.
    pub fn build(gait: Gait, speed: f32, mut changes: Vec<(f32, Change)>) -> Result<Self, Failure> {
        changes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let built = allowed(gait, speed)?;
        let mut last = (gait, speed);
        for (at, change) in changes.iter().rev() {
            last = change.after(last);
            allowed(last.0, last.1).map_err(|failure| failure.at(format!("--switch at t={at}")))?;
        }
        let limits = GateConfig::default_biped().joint_limits();
        let smooth = TransitionConfig::default().build(built, limits, PERIOD).map_err(Failure::run)?;
        Ok(Self { gait, speed, stopped: false, smooth, tick: 0, changes })
    }

    /// Makes a change.
    ///
    /// # Errors
    /// The speed is out of range, or a joint would exceed its rate limit; the gait then goes on unchanged.
    pub fn change(&mut self, change: Change) -> Result<(), Failure> {
        if change == Change::Stop {
            self.smooth.stop(STAND).map_err(Failure::run)?;
            self.stopped = true;
            return Ok(());
        }
        let (gait, speed) = change.after((self.gait, self.speed));
        let next = allowed(gait, speed)?;
        (self.gait, self.speed, self.stopped) = (gait, speed, false);
        self.smooth.resume();
        self.smooth.change(|gait| *gait = next.aligned(gait.phase(), PERIOD));
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

    /// The largest speed at which the joints of a gait keep to the rate limits.
    #[must_use]
    pub fn largest_speed(&self, gait: Gait) -> f32 {
        gait.largest_speed(self.smooth.limits()).unwrap_or(SPEEDS.0)
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
