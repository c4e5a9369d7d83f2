//! Data of a robot: joint ranges, pose limits, rate limits, servo maps, park pose.
//!
//! Plain data in SI units. The gate, the blend and the servo map check it when they are built. [`anatomy`] bounds every
//! configuration.

use cpg_core::transition::JointLimits;
use joint_units::{Joint, PulseMicros, RadPerSec, RadPerSec2, Radians};

/// Number of pose limits that the gate can hold.
pub const POSE_LIMITS: usize = 6;

/// Hips at 0, knees at 5 degrees: a standing leg, off the knee's end stop.
pub const DEFAULT_PARK: [Radians; Joint::COUNT] =
    [Radians(0.0), Radians(0.0), Radians::from_degrees(5.0), Radians::from_degrees(5.0)];

/// Shortest pulse that a servo may get.
pub(crate) const SHORTEST: PulseMicros = PulseMicros(500);
/// Longest pulse that a servo may get.
pub(crate) const LONGEST: PulseMicros = PulseMicros(2_500);

/// Hard limits of human joints. They are constants of the program: no parameter, from flash or elsewhere, can exceed them.
pub mod anatomy {
    use super::JointRange;
    use joint_units::{Joint, RadPerSec, RadPerSec2, Radians};

    /// Hip: 30 degrees of extension to 120 of flexion, the passive range of a healthy adult.
    pub const HIP: JointRange = JointRange { least: Radians::from_degrees(-30.0), most: Radians::from_degrees(120.0) };
    /// Knee: 5 degrees of hyperextension to 140 of flexion.
    pub const KNEE: JointRange = JointRange { least: Radians::from_degrees(-5.0), most: Radians::from_degrees(140.0) };
    /// Highest joint rate, 1000 degrees per second: above the swing of a running knee.
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

/// Angles that a joint may have, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRange {
    /// Furthest extension. rad, within [`anatomy::range`].
    pub least: Radians,
    /// Furthest flexion. rad, within [`anatomy::range`], above `least`.
    pub most: Radians,
}

/// Combination of two joints that a [`PoseLimit`] bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PoseSense {
    /// `first + second`: both joints flexed.
    Sum,
    /// `first - second`: the first joint ahead of the second.
    Difference,
}

impl PoseSense {
    /// Both, in the order of the robot record.
    pub const ALL: [Self; 2] = [Self::Sum, Self::Difference];
}

/// One edge of the pose envelope: a bound on two joints together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseLimit {
    /// First joint.
    pub first: Joint,
    /// Second joint, different from the first.
    pub second: Joint,
    /// How the two angles are combined.
    pub sense: PoseSense,
    /// Largest allowed value of the combination. rad, -4.5 to 4.5.
    pub most: Radians,
}

impl PoseLimit {
    /// Value of the combination in a pose.
    #[must_use]
    pub fn of(&self, pose: &[Radians; Joint::COUNT]) -> Radians {
        let (first, second) = (pose[self.first as usize & 3].0, pose[self.second as usize & 3].0);
        match self.sense {
            PoseSense::Sum => Radians(first + second),
            PoseSense::Difference => Radians(first - second),
        }
    }
}

/// Limits of the gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateConfig {
    /// Range of each joint, within [`anatomy`] and within the reach of its servo.
    pub range: [JointRange; Joint::COUNT],
    /// Pose envelope: all of these limits hold at every tick.
    pub pose: [Option<PoseLimit>; POSE_LIMITS],
    /// Highest setpoint rate of each joint. rad/s, above 0, at most [`anatomy::RATE`].
    pub rate: [RadPerSec; Joint::COUNT],
    /// Largest setpoint acceleration of each joint. rad/s^2, above 0, at most [`anatomy::ACCELERATION`]. It must stop the joint from its
    /// `rate` within 90 degrees, and be at least 8 steps of 2^-28 rad per tick squared, the gate's resolution at the given period.
    pub acceleration: [RadPerSec2; Joint::COUNT],
}

impl GateConfig {
    /// Limits of the default robot.
    ///
    /// The ranges hold the default walk (hips -16 to 26, knees -2 to 62 degrees) with a margin for larger steps. A standard
    /// hobby servo reaches 500 deg/s without load (60 degrees in 0.12 s); 20000 deg/s^2 stops it within 6.3 degrees.
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
            range: [deg(-30.0, 60.0), deg(-30.0, 60.0), deg(-2.0, 120.0), deg(-2.0, 120.0)],
            pose: [
                // Both knees far bent: the stance leg collapses.
                pose(LeftKnee, RightKnee, PoseSense::Sum, 150.0),
                // Thighs too far apart: beyond any stride.
                pose(LeftHip, RightHip, PoseSense::Difference, 75.0),
                pose(RightHip, LeftHip, PoseSense::Difference, 75.0),
                // A far bent knee behind an extended hip: the heel would hit the back of the thigh.
                pose(LeftKnee, LeftHip, PoseSense::Difference, 125.0),
                pose(RightKnee, RightHip, PoseSense::Difference, 125.0),
                None,
            ],
            rate: [RadPerSec(Radians::from_degrees(500.0).0); Joint::COUNT],
            acceleration: [RadPerSec2(Radians::from_degrees(20_000.0).0); Joint::COUNT],
        }
    }

    /// The limits of each joint, for a smooth change of the generator. The pose envelope, which is of two joints, is the gate's alone.
    #[must_use]
    pub fn joint_limits(&self) -> [JointLimits; Joint::COUNT] {
        let ([a, b, c, d], rate, acceleration) = (self.range, self.rate, self.acceleration);
        let limits = |JointRange { least, most }, rate, acceleration| JointLimits { least, most, rate, acceleration };
        [
            limits(a, rate[0], acceleration[0]),
            limits(b, rate[1], acceleration[1]),
            limits(c, rate[2], acceleration[2]),
            limits(d, rate[3], acceleration[3]),
        ]
    }
}

/// Whether flexion makes the pulse longer or shorter. Servos of the left and the right leg are mounted as mirror images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Flexion makes the pulse longer.
    Forward,
    /// Flexion makes the pulse shorter.
    Mirrored,
}

impl Direction {
    /// Both, in the order of the robot record.
    pub const ALL: [Self; 2] = [Self::Forward, Self::Mirrored];
}

/// Servo map of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoConfig {
    /// Pulse of the neutral position. us, within `shortest..=longest`.
    pub neutral: PulseMicros,
    /// Joint angle at the neutral pulse. rad, -180 to 180 degrees.
    pub angle_at_neutral: Radians,
    /// Pulse change for one radian. us/rad, 100 to 2000; 636.62 for 1000 us in 90 degrees.
    pub micros_per_radian: f32,
    /// Direction in which the servo is mounted.
    pub direction: Direction,
    /// Shortest allowed pulse. us, 500 to 2500.
    pub shortest: PulseMicros,
    /// Longest allowed pulse. us, 500 to 2500, above `shortest`.
    pub longest: PulseMicros,
}

impl ServoConfig {
    /// A hobby servo that turns 180 degrees for 500 to 2500 us.
    #[must_use]
    pub const fn hobby(angle_at_neutral: Radians, direction: Direction) -> Self {
        Self {
            neutral: PulseMicros(1_500),
            angle_at_neutral,
            micros_per_radian: 636.62,
            direction,
            shortest: SHORTEST,
            longest: LONGEST,
        }
    }

    /// Servos of the default robot, in joint order.
    ///
    /// A pulse of 1500 us is the middle of the travel: a hip at 0, a knee at 45 degrees. The right side is mirrored.
    #[must_use]
    pub const fn default_biped() -> [Self; Joint::COUNT] {
        [
            Self::hobby(Radians(0.0), Direction::Forward),
            Self::hobby(Radians(0.0), Direction::Mirrored),
            Self::hobby(Radians::from_degrees(45.0), Direction::Forward),
            Self::hobby(Radians::from_degrees(45.0), Direction::Mirrored),
        ]
    }
}
