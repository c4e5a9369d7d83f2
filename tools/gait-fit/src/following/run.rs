//! Runs a follower over a recording tick by tick, and compares it with the recording.

use cpg_core::entrainment::phase_lock::Template;
use cpg_core::entrainment::{Follower, Lock, SensorFault};
use cpg_core::{BuildError, Follow, Generator};
use gait_trace::{NoChannel, Recording};
use joint_units::{Joint, Period, Radians};

use super::breaks::{self, FalseStop, Slip};
use super::learn::{Learned, angle_deg};
use super::tick::{TICKS_PER_S, Tick, phase_error_deg};

/// Plays a series of samples, one a tick.
pub fn run(follower: &mut Follower, samples: impl IntoIterator<Item = Option<f64>>) -> Vec<Tick> {
    let samples = samples.into_iter();
    samples
        .map(|sample| {
            follower.observe(sample.map(|degrees| Radians::from_degrees(degrees as f32)));
            follower.step();
            let angles = follower.angles().map(|angle| f64::from(angle.degrees()));
            let rates = follower.rates().map(|rate| f64::from(rate.0).to_degrees());
            Tick::of(follower, angles, rates)
        })
        .collect()
}

/// The samples of a joint's sensor at the control rate, degrees.
///
/// # Errors
/// The recording has no such channel.
pub fn samples(recording: &Recording, sensor: Joint) -> Result<Vec<f64>, NoChannel> {
    let channel = recording.of_joint(sensor)?;
    let start = recording.time_s()[0];
    let ticks = (recording.duration_s() * TICKS_PER_S) as usize;
    Ok((0..=ticks).map(|tick| recording.at(channel, start + tick as f64 / TICKS_PER_S)).collect())
}

/// Spans of a recording that were not measured, in seconds from its first row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Holes {
    /// Of the joint with the sensor: the follower gets no sample, as on a board with a bad sensor.
    pub sensor: Vec<(f64, f64)>,
    /// Of any joint: nothing is learned or compared.
    pub any: Vec<(f64, f64)>,
}

/// The samples, `None` where they were not measured.
#[must_use]
pub fn without(samples: Vec<f64>, holes: &[(f64, f64)]) -> Vec<Option<f64>> {
    let lost = |tick: usize| within(holes, tick as f64 / TICKS_PER_S);
    samples.into_iter().enumerate().map(|(tick, sample)| (!lost(tick)).then_some(sample)).collect()
}

/// Exclusive: both ends are rows.
pub(super) fn within(holes: &[(f64, f64)], time_s: f64) -> bool {
    holes.iter().any(|&(from, to)| from < time_s && time_s < to)
}

/// How well a follower follows the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Following {
    /// Start of the first second in which it was locked within 18 degrees of the person's phase, s.
    pub lock_s: Option<f64>,
    /// Root mean square difference of setpoints and recorded joints over the steady part, degrees; `None` for joints that were not recorded.
    pub steady_rmse_deg: [Option<f64>; Joint::COUNT],
    /// The same of the templates played with the phase of the recording, which uses later samples and all joints ([`Learned::phase`]):
    /// what a follower with these templates and a perfect phase would have.
    pub perfect_phase_rmse_deg: [Option<f64>; Joint::COUNT],
    /// The steady part: from 3 s after the lock, 15 s or later in recordings of 20 s and more, s.
    pub steady_s: Option<(f64, f64)>,
    /// Number of seconds in which it reported a lock with a phase error of 18 degrees or more.
    pub false_locks: u32,
    /// Spans in which it fades, stands or holds although the person moves on ([`breaks`]).
    pub false_stops: Vec<FalseStop>,
    /// Phase slips while it reports a lock and the person moves on ([`breaks`]).
    pub slips: Vec<Slip>,
    /// Sensor faults that it reported, with their ticks.
    pub holds: Vec<(usize, SensorFault)>,
    /// Mean cadence over the steady part, steps per minute.
    pub cadence_steps_per_min: Option<f64>,
    /// Standard deviation of the phase error over the steady part, degrees.
    pub phase_sd_deg: Option<f64>,
}

impl Following {
    /// RMSE of the setpoints over that with a perfect phase; `None` where either is missing, or the latter is 0.
    #[must_use]
    pub fn ratio(&self, joint: Joint) -> Option<f64> {
        let perfect = self.perfect_phase_rmse_deg[joint as usize].filter(|rmse| *rmse > 0.0)?;
        Some(self.steady_rmse_deg[joint as usize]? / perfect)
    }
}

/// A run of a follower over a recording.
#[derive(Debug, Clone)]
pub struct Entrainment {
    /// What was learned from the recording: its phase is the reference.
    pub learned: Learned,
    /// The templates of the follower.
    pub templates: [Template; Joint::COUNT],
    /// Source of the templates, in words.
    pub source: String,
    /// Every tick.
    pub ticks: Vec<Tick>,
    /// How well it follows.
    pub following: Following,
}

/// Compares a run of the learned templates with the recording.
#[must_use]
pub fn judge(ticks: &[Tick], recording: &Recording, sensor: Joint, learned: &Learned) -> Following {
    judge_without(ticks, recording, sensor, learned, &learned.templates, &[])
}

/// As [`judge`], with the templates that the follower has, without the given spans of the recording.
#[must_use]
pub fn judge_without(
    ticks: &[Tick],
    recording: &Recording,
    sensor: Joint,
    learned: &Learned,
    templates: &[Option<Template>; Joint::COUNT],
    holes: &[(f64, f64)],
) -> Following {
    let time = |tick: usize| tick as f64 / TICKS_PER_S;
    let known = |tick: usize| !within(holes, time(tick));
    let errors: Vec<f64> =
        ticks.iter().enumerate().map(|(n, tick)| phase_error_deg(tick, learned.phase_at(time(n)))).collect();
    let second = TICKS_PER_S as usize;
    let (mut right_for, mut wrong_for, mut lock, mut false_locks) = (0, 0, None, 0);
    for (n, (tick, error)) in ticks.iter().zip(&errors).enumerate() {
        let locked = tick.state == Lock::Locked && known(n);
        right_for = if locked && error.abs() < 18.0 { right_for + 1 } else { 0 };
        wrong_for = if locked && error.abs() >= 18.0 { wrong_for + 1 } else { 0 };
        if right_for == second && lock.is_none() {
            lock = Some(time(n + 1 - second));
        }
        false_locks += u32::from(wrong_for == second);
    }
    let holds = ticks.windows(2).enumerate().filter_map(|(n, pair)| {
        let entered = pair[1].state == Lock::Holding && pair[0].state != Lock::Holding;
        entered.then_some(()).and(pair[1].fault).map(|fault| (n + 1, fault))
    });
    let holds = holds.collect();

    let moves_on = templates[sensor as usize].as_ref().map_or_else(Vec::new, |template| {
        breaks::moves_on(&breaks::Person { recording, sensor, learned, template, holes })
    });
    let end = time(ticks.len());
    let steady = lock.map(|lock| if end >= 20.0 { (lock + 3.0).max(15.0) } else { lock + 3.0 });
    let steady = steady.filter(|&from| from + 0.5 < end).map(|from| (from, end));
    let mut following = Following {
        lock_s: lock,
        steady_rmse_deg: [None; Joint::COUNT],
        perfect_phase_rmse_deg: [None; Joint::COUNT],
        steady_s: steady,
        false_locks,
        false_stops: breaks::false_stops(ticks, &moves_on),
        slips: breaks::slips(ticks, learned, &moves_on),
        holds,
        cadence_steps_per_min: None,
        phase_sd_deg: None,
    };
    let Some((from, _)) = steady else { return following };
    let first = (from * TICKS_PER_S) as usize;
    let rows: Vec<usize> = (first..ticks.len()).filter(|&tick| known(tick)).collect();
    if rows.is_empty() {
        return following;
    }
    let count = rows.len() as f64;
    let start = recording.time_s()[0];
    for joint in Joint::ALL {
        let channel = if joint == sensor { recording.of_joint(joint) } else { recording.channel(joint.name()) };
        let Ok(channel) = channel else { continue };
        let rmse = |angle: &dyn Fn(usize) -> f64| {
            let square = |&n: &usize| (angle(n) - recording.at(channel, start + time(n))).powi(2);
            (rows.iter().map(square).sum::<f64>() / count).sqrt()
        };
        following.steady_rmse_deg[joint as usize] = Some(rmse(&|n| ticks[n].angles[joint as usize]));
        following.perfect_phase_rmse_deg[joint as usize] =
            templates[joint as usize].map(|template| rmse(&|n| angle_deg(&template, learned.phase_at(time(n)))));
    }
    let mean = rows.iter().map(|&n| errors[n]).sum::<f64>() / count;
    let variance = rows.iter().map(|&n| (errors[n] - mean).powi(2)).sum::<f64>() / count;
    following.phase_sd_deg = Some(variance.sqrt());
    let turning = rows.iter().map(|&n| ticks[n].frequency).sum::<f64>() / count;
    following.cadence_steps_per_min = Some(turning / std::f64::consts::TAU * 120.0);
    following
}

/// A follower of a person, with the sensor on this joint.
///
/// # Errors
/// Names the field that is out of range.
pub fn follower(templates: [Template; Joint::COUNT], sensor: Joint, stride_s: f64) -> Result<Follower, BuildError> {
    let mut config = cpg_core::entrainment::FollowerConfig::default();
    config.lock.stride_s = stride_s as f32;
    config.build(templates, sensor, Period::MILLISECOND)
}
