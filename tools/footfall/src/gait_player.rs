//! Plays a default gait on the host core, with changes of gait and speed during the run, within the limits of the default robot.

use cpg_core::Generator;
use cpg_core::gait::family::{Member, START};
use cpg_core::gait::named::{DefaultGait, Gait};
use cpg_core::transition::{Smooth, TransitionConfig};
use joint_loop::GateConfig;
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

impl Change {
    /// Gait and speed after the change, and what to say about it.
    fn after(self, gait: Gait, speed: f32) -> Result<(Gait, f32, Option<String>), Failure> {
        Ok(match self {
            Change::To(next) => {
                let allowed = speed.min(largest_speed(next)).max(next.speeds().0);
                let said =
                    || format!("{} at speed {allowed:.3}, the nearest to {speed:.3} that it allows", next.name());
                (next, allowed, (allowed != speed).then(said))
            }
            Change::Speed(factor) => (gait, factor, None),
            Change::Cadence(cadence) => (gait, gait.speed_at(cadence).map_err(Failure::input)?, None),
            Change::Stop => (gait, speed, None),
        })
    }
}

/// Whether a gait is for robots with faster joints: it is played as it is.
const fn is_for_faster_joints(gait: Gait) -> bool {
    matches!(gait, Gait::Human(Member::RunUnscaled))
}

/// Builds a gait whose joints keep to the rate limits of the default robot.
fn allowed(gait: Gait, speed: f32) -> Result<DefaultGait, Failure> {
    let built = gait.build(speed, PERIOD).map_err(Failure::input)?;
    if !is_for_faster_joints(gait) {
        gait.allow_speed(speed, &GateConfig::default_biped().joint_limits()).map_err(Failure::input)?;
    }
    Ok(built)
}

/// The largest speed at which the joints of a gait keep to the rate limits of the default robot; the least one if they do at none.
#[must_use]
pub fn largest_speed(gait: Gait) -> f32 {
    let (slowest, fastest) = gait.speeds();
    if is_for_faster_joints(gait) {
        return fastest;
    }
    gait.largest_speed(&GateConfig::default_biped().joint_limits()).unwrap_or(slowest)
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
    notes: Vec<String>,
}

impl GaitPlayer {
    /// A gait at a speed, with changes at times in seconds.
    ///
    /// # Errors
    /// A speed, now or after one of the changes, is out of range, or a joint would exceed its rate limit.
    pub fn build(gait: Gait, speed: f32, mut changes: Vec<(f32, Change)>) -> Result<Self, Failure> {
        let built = allowed(gait, speed)?;
        // Of changes at one time the first comes first.
        changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut last, mut notes) = ((gait, speed), vec![]);
        for &(at, change) in &changes {
            let after = |(gait, speed)| {
                let (gait, speed, note) = change.after(gait, speed)?;
                allowed(gait, speed).map(|_| ((gait, speed), note))
            };
            let (next, note) = after(last).map_err(|failure| failure.at(format!("--switch at t={at}")))?;
            notes.extend(note.map(|note| format!("t={at}: {note}")));
            last = next;
        }
        changes.reverse();
        let limits = GateConfig::default_biped().joint_limits();
        let smooth = TransitionConfig::default().build(built, limits, PERIOD).map_err(Failure::run)?;
        Ok(Self { gait, speed, stopped: false, smooth, tick: 0, changes, notes })
    }

    /// Makes a change; returns what to say about it.
    ///
    /// # Errors
    /// The speed is out of range, or a joint would exceed its rate limit; the gait then goes on unchanged.
    pub fn change(&mut self, change: Change) -> Result<Option<String>, Failure> {
        if change == Change::Stop {
            self.smooth.stop(STAND).map_err(Failure::run)?;
            self.stopped = true;
            return Ok(None);
        }
        let (gait, speed, note) = change.after(self.gait, self.speed)?;
        let next = allowed(gait, speed)?;
        // A recorded gait starts from a stand where persons do.
        let phase = if self.stopped && matches!(gait, Gait::Human(_)) { START } else { self.smooth.phase() };
        (self.gait, self.speed, self.stopped) = (gait, speed, false);
        self.smooth.resume();
        self.smooth.change(|gait| *gait = next.aligned(phase, PERIOD));
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

    /// What the changes do that was not asked for, each with its time.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
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
