//! A second look at the pulses, after the loop: inside the range of each joint, and no faster than its rate.
//!
//! The loop limits every angle, but its limits, its servo maps and its positions are variables, and a bit of any of them can change. This check has
//! limits of its own, made from the robot's parameters at the boot and kept apart from the loop. One changed bit in the loop or in the check does not
//! make a pulse outside of a joint's range, nor a motion faster than its rate: the outputs go off.
//!
//! What it does not find: a wrong motion within range and rate, one that breaks the pose envelope or the acceleration, and where a motion begins, as it
//! knows no position before the first pulse.
//!
//! ```
//! use firmware_shared::pulse_check::PulseCheck;
//! use joint_loop::RobotConfig;
//! use joint_units::PulseMicros;
//! let mut check = PulseCheck::new(&RobotConfig::default_biped())?;
//! let pose = [1500, 1500, 1100, 1900].map(PulseMicros);
//! assert!(check.allows(pose, false));
//! // 500 degrees a second of the default robot are 5.6 us in a tick.
//! let (soon, jump) = ([1505, 1500, 1100, 1900].map(PulseMicros), [1560, 1500, 1100, 1900].map(PulseMicros));
//! assert!(check.allows(soon, false) && !check.allows(jump, false));
//! # Ok::<(), joint_loop::LoopError>(())
//! ```

use core::hint::cold_path;

use joint_loop::{JointRange, LoopError, RobotConfig, ServoConfig};
use joint_units::{Joint, PulseMicros, RadPerSec};

/// Control periods a second.
const TICKS_HZ: f32 = 1000.0;
/// Steps of a microsecond.
const STEPS: i32 = 1 << 16;
/// How far a pulse may be ahead of the position that keeps the rate: two roundings to a microsecond, and the rounding of `f32`.
const AHEAD: u32 = (STEPS + STEPS / 16) as u32;

/// Limits of one servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Limits {
    /// Pulses of the joint's range, the shorter one first, us.
    joint: (u16, u16),
    /// Pulses of the servo, us.
    servo: (u16, u16),
    /// Way in a tick at the joint's rate, steps.
    way: i32,
}

/// The limits, and where the servos are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PulseCheck {
    limits: [Limits; Joint::COUNT],
    /// The positions that follow the pulses at no more than the rate, steps; `None` without pulses.
    reached: Option<[i32; Joint::COUNT]>,
}

impl PulseCheck {
    /// Of a robot, before its first pulse.
    ///
    /// # Errors
    /// The first servo map that is not allowed.
    pub fn new(robot: &RobotConfig) -> Result<Self, LoopError> {
        let mut limits = [Limits { joint: (0, 0), servo: (0, 0), way: 0 }; Joint::COUNT];
        let joints = Joint::ALL.into_iter().zip(&robot.servos).zip(robot.gate.range.iter().zip(&robot.gate.rate));
        for (limits, ((joint, servo), (range, rate))) in limits.iter_mut().zip(joints) {
            *limits = Limits::new(joint, servo, range, *rate)?;
        }
        Ok(Self { limits, reached: None })
    }

    /// Whether the pulses of a tick may go to the servos; those that may not change nothing here. In a trim a servo may have all pulses of its own, of
    /// which those of its joint are a part.
    #[must_use]
    pub fn allows(&mut self, pulses: [PulseMicros; Joint::COUNT], trims: bool) -> bool {
        let goals = pulses.map(|pulse| i32::from(pulse.0) * STEPS);
        let mut reached = self.reached.unwrap_or(goals);
        let mut all = true;
        for ((limits, pulse), (reached, goal)) in self.limits.iter().zip(pulses).zip(reached.iter_mut().zip(goals)) {
            let (shortest, longest) = if trims { limits.servo } else { limits.joint };
            // Not `clamp`, which has a panic for limits in the wrong order.
            *reached += (goal - *reached).min(limits.way).max(-limits.way);
            all &= pulse.0 >= shortest && pulse.0 <= longest && goal.abs_diff(*reached) <= AHEAD;
        }
        if all {
            self.reached = Some(reached);
        } else {
            cold_path();
        }
        all
    }

    /// The servos get no pulses: the next ones may be anywhere in the range.
    pub fn forget(&mut self) {
        self.reached = None;
    }
}

impl Limits {
    fn new(joint: Joint, servo: &ServoConfig, range: &JointRange, rate: RadPerSec) -> Result<Self, LoopError> {
        let map = servo.build(joint)?;
        let pulse = |angle| map.pulse(angle).map_or(0, |pulse| pulse.0);
        let (a, b) = (pulse(range.least), pulse(range.most));
        // At most 2000 us a radian and 17.5 rad a second: 35 us in a tick.
        let way = rate.0 * servo.micros_per_radian / TICKS_HZ * STEPS as f32;
        Ok(Self {
            joint: (a.min(b), a.max(b)),
            servo: (servo.shortest.0, servo.longest.0),
            way: (way as i32).saturating_add(1),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use joint_units::Radians;

    fn check() -> PulseCheck {
        PulseCheck::new(&RobotConfig::default_biped()).unwrap()
    }

    /// Pulses of the default robot's pose, degrees.
    fn pulses(degrees: [f32; 4]) -> [PulseMicros; 4] {
        let mut pulses = [PulseMicros(0); 4];
        for (index, (joint, servo)) in Joint::ALL.into_iter().zip(&RobotConfig::default_biped().servos).enumerate() {
            pulses[index] = servo.build(joint).unwrap().pulse(Radians::from_degrees(degrees[index])).unwrap();
        }
        pulses
    }

    #[test]
    fn both_ends_of_each_range_are_allowed_and_nothing_beyond() {
        for joint in 0..4 {
            let range = RobotConfig::default_biped().gate.range[joint];
            for (end, beyond) in [(range.least, -0.2), (range.most, 0.2)] {
                let mut pose = [0.0, 0.0, 10.0, 10.0];
                pose[joint] = end.degrees();
                assert!(check().allows(pulses(pose), false), "{joint} {pose:?}");
                pose[joint] += beyond;
                assert!(!check().allows(pulses(pose), false), "{joint} {pose:?}");
                assert!(check().allows(pulses(pose), true), "{joint} {pose:?} in a trim");
            }
        }
        let mut wide = [1500; 4].map(PulseMicros);
        wide[2] = PulseMicros(2501);
        assert!(!check().allows(wide, true));
    }

    #[test]
    fn the_rate_is_allowed_for_ever_and_two_per_cent_more_is_not() {
        for (share, allowed) in [(1.0, true), (1.02, false)] {
            for joint in 0..4 {
                let mut check = check();
                let mut all = true;
                // 40 degrees up and down; 0.5 degrees a tick is the rate.
                for tick in 0..8_000 {
                    let way = tick as f32 * 0.5 * share % 80.0;
                    let mut pose = [0.0, 0.0, 10.0, 10.0];
                    pose[joint] += if way < 40.0 { way } else { 80.0 - way };
                    all &= check.allows(pulses(pose), false);
                }
                assert_eq!(all, allowed, "{joint} at {share}");
            }
        }
    }

    #[test]
    fn a_jump_is_refused_until_the_pulses_have_been_off() {
        let mut check = check();
        assert!(check.allows(pulses([0.0; 4]), false));
        for _ in 0..100 {
            assert!(!check.allows(pulses([10.0, 0.0, 0.0, 0.0]), false));
        }
        // Where it was, it may be again.
        assert!(check.allows(pulses([0.0; 4]), false));
        check.forget();
        assert!(check.allows(pulses([10.0, 0.0, 0.0, 0.0]), false));
    }
}
