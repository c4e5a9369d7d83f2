//! Parameters of the loop: what may be set, what it means, what is allowed, and the shipped defaults with their reasons.
//!
//! Everything is plain data in SI units; [`LoopConfig::build`] checks all of it and folds it to machine numbers for one period.
//! [`anatomy`] bounds what any parameter can ask for.

use crate::control::tick::Stages;
use crate::error::inside;
use crate::{BlendConfig, Direction, Gate, JointLoop, LoopError, MonitorConfig, ServoConfig};
use cpg_core::{Follow, Generator};
use hgod_adc::Sensor;
use joint_units::{Joint, Period, RadPerSec, RadPerSec2, Radians};

/// How many pairwise pose limits the gate can hold.
pub const POSE_LIMITS: usize = 6;

/// Hard limits of the body. They are constants in the program: no parameter, from flash or anywhere else, reaches beyond them.
pub mod anatomy {
    use super::JointRange;
    use joint_units::{Joint, RadPerSec, RadPerSec2, Radians};

    /// Hip: 30 degrees of extension to 120 of flexion, the passive range of a healthy adult.
    pub const HIP: JointRange = JointRange { least: Radians::from_degrees(-30.0), most: Radians::from_degrees(120.0) };
    /// Knee: 5 degrees of hyperextension to 140 of flexion.
    pub const KNEE: JointRange = JointRange { least: Radians::from_degrees(-5.0), most: Radians::from_degrees(140.0) };
    /// Fastest joint motion, 1000 degrees per second: above the swing of a running knee.
    pub const RATE: RadPerSec = RadPerSec(Radians::from_degrees(1_000.0).0);
    /// Largest joint acceleration, 60000 degrees per second squared.
    pub const ACCELERATION: RadPerSec2 = RadPerSec2(Radians::from_degrees(60_000.0).0);

    /// The range of one joint.
    #[must_use]
    pub const fn range(joint: Joint) -> JointRange {
        match joint {
            Joint::LeftHip | Joint::RightHip => HIP,
            Joint::LeftKnee | Joint::RightKnee => KNEE,
        }
    }
}

/// Angles that a joint may take, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRange {
    /// Furthest extension. rad, within [`anatomy::range`].
    pub least: Radians,
    /// Furthest flexion. rad, within [`anatomy::range`], above `least`.
    pub most: Radians,
}

/// Which combination of two joints a [`PoseLimit`] bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PoseSense {
    /// `first + second`: both flexed together.
    Sum,
    /// `first - second`: the first ahead of the second.
    Difference,
}

/// One edge of the pose envelope: a bound on two joints together, where each alone would be within its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseLimit {
    /// The one joint.
    pub first: Joint,
    /// The other joint, not the same.
    pub second: Joint,
    /// How they combine.
    pub sense: PoseSense,
    /// Most that the combination may be. rad, -4.5 to 4.5.
    pub most: Radians,
}

impl PoseLimit {
    /// What is bounded, for a pose.
    #[must_use]
    pub fn of(&self, pose: &[Radians; Joint::COUNT]) -> Radians {
        let (first, second) = (pose[self.first as usize & 3].0, pose[self.second as usize & 3].0);
        match self.sense {
            PoseSense::Sum => Radians(first + second),
            PoseSense::Difference => Radians(first - second),
        }
    }
}

/// What the gate lets pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateConfig {
    /// Range of each joint, within [`anatomy`] and within what its servo can be told.
    pub range: [JointRange; Joint::COUNT],
    /// The pose envelope: all of these hold at every tick.
    pub pose: [Option<PoseLimit>; POSE_LIMITS],
    /// Fastest setpoint motion. rad/s, above 0, at most [`anatomy::RATE`].
    pub rate: RadPerSec,
    /// Largest setpoint acceleration. rad/s^2, above 0, at most [`anatomy::ACCELERATION`]; so large that braking from `rate`
    /// takes at most 90 degrees, and, at the given period, above the gate's resolution of 8 steps of 2^-28 rad a tick squared.
    pub acceleration: RadPerSec2,
}

/// Everything that can be set about the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopConfig {
    /// What the gate lets pass.
    pub gate: GateConfig,
    /// How angles become pulses, a servo a joint.
    pub servos: [ServoConfig; Joint::COUNT],
    /// Park pose, and how long ramps take.
    pub blend: BlendConfig,
    /// What is watched, and how much of it is tolerated.
    pub monitor: MonitorConfig,
    /// Channel of the sensor that the generator listens to, counted from 0. Where none is worn there, it hears nothing.
    pub gait_sensor: usize,
}

impl LoopConfig {
    /// The shipped default: a biped of two hips and two knees on hobby servos with 180 degrees of travel.
    ///
    /// Ranges hold the default walk (hips -16 to 26, knees -2 to 62 degrees) with room for larger steps; 500 deg/s is what a
    /// standard hobby servo does without load (60 degrees in 0.12 s), and 20000 deg/s^2 stops it within 6.3 degrees. A servo
    /// pulse of 1500 us is the middle of its travel: a hip at 0, a knee at 45 degrees. The right side is mounted mirrored.
    #[must_use]
    pub const fn default_biped() -> Self {
        const fn deg(least: f32, most: f32) -> JointRange {
            JointRange { least: Radians::from_degrees(least), most: Radians::from_degrees(most) }
        }
        const fn pose(first: Joint, second: Joint, sense: PoseSense, most: f32) -> Option<PoseLimit> {
            Some(PoseLimit { first, second, sense, most: Radians::from_degrees(most) })
        }
        use Joint::{LeftHip, LeftKnee, RightHip, RightKnee};
        Self {
            gate: GateConfig {
                range: [deg(-30.0, 60.0), deg(-30.0, 60.0), deg(-2.0, 120.0), deg(-2.0, 120.0)],
                pose: [
                    // Both knees far bent: the stance leg collapses.
                    pose(LeftKnee, RightKnee, PoseSense::Sum, 150.0),
                    // Thighs too far apart: beyond any stride.
                    pose(LeftHip, RightHip, PoseSense::Difference, 75.0),
                    pose(RightHip, LeftHip, PoseSense::Difference, 75.0),
                    // Heel into the seat: a knee far bent behind an extended hip.
                    pose(LeftKnee, LeftHip, PoseSense::Difference, 125.0),
                    pose(RightKnee, RightHip, PoseSense::Difference, 125.0),
                    None,
                ],
                rate: RadPerSec(Radians::from_degrees(500.0).0),
                acceleration: RadPerSec2(Radians::from_degrees(20_000.0).0),
            },
            servos: [
                ServoConfig::hobby(Radians(0.0), Direction::Forward),
                ServoConfig::hobby(Radians(0.0), Direction::Mirrored),
                ServoConfig::hobby(Radians::from_degrees(45.0), Direction::Forward),
                ServoConfig::hobby(Radians::from_degrees(45.0), Direction::Mirrored),
            ],
            blend: BlendConfig::DEFAULT,
            monitor: MonitorConfig::DEFAULT,
            gait_sensor: 0,
        }
    }

    /// Checks everything and makes the loop, before its first tick, for one control period. `sensors` are the channels; `None` where
    /// no sensor is worn.
    ///
    /// # Errors
    /// The first rule that the configuration breaks, with the field, the joint, and what is allowed.
    pub fn build<G: Generator<{ Joint::COUNT }> + Follow, const S: usize>(
        &self,
        period: Period,
        generator: G,
        sensors: [Option<Sensor>; S],
    ) -> Result<JointLoop<G, S>, LoopError> {
        let gate = Gate::build(&self.gate, period)?;
        let [left_hip, right_hip, left_knee, right_knee] = &self.servos;
        let servos = [
            left_hip.build(Joint::LeftHip)?,
            right_hip.build(Joint::RightHip)?,
            left_knee.build(Joint::LeftKnee)?,
            right_knee.build(Joint::RightKnee)?,
        ];
        for ((joint, map), range) in Joint::ALL.into_iter().zip(&servos).zip(&self.gate.range) {
            map.reaches(joint, range)?;
        }
        let blend = self.blend.build(period, &self.gate)?;
        let monitor = self.monitor.build(period)?;
        let button = self.monitor.button(period)?;
        if self.monitor.sensor_required && sensors.iter().all(Option::is_none) {
            return Err(LoopError::NoSensor);
        }
        if generator.check().is_err() {
            return Err(LoopError::Generator);
        }
        let parked = gate.rest(blend.park()).ok_or(LoopError::Park)?;
        Ok(JointLoop::new(
            Stages { gate, servos, blend, monitor, button, sensors, gait_sensor: self.gait_sensor },
            generator,
            parked,
        ))
    }
}

impl Default for LoopConfig {
    fn default() -> Self {
        Self::default_biped()
    }
}

/// `seconds` in whole periods, to the nearest, one at least; refused outside `least..=most` seconds.
pub(crate) fn ticks(
    field: &'static str,
    seconds: f32,
    least: f32,
    most: f32,
    period: Period,
) -> Result<u32, LoopError> {
    let seconds = inside(field, None, seconds, least, most, "s")?;
    Ok(((seconds / period.seconds() + 0.5) as u32).max(1))
}
