//! A second look at the pulses, after the loop: inside the range of each joint, no faster than its rate, and from where the last pulses ended.
//!
//! The loop limits every angle, but its limits, its servo maps and its positions are variables, and a bit of any of them can change. This check has
//! limits of its own, made from the robot's parameters at the boot and kept apart from the loop. One changed bit in the loop or in the check does not
//! make a pulse outside of a joint's range, nor a motion faster than its rate, nor one that begins elsewhere: the outputs go off.
//!
//! A servo that was left outside of the range of its joint, by a trim, may begin there and come nearer.
//!
//! What it does not find: a wrong motion within range and rate, one that breaks the pose envelope or the acceleration.
//!
//! ```
//! use firmware_shared::pulse_check::PulseCheck;
//! use joint_loop::RobotConfig;
//! use joint_units::PulseMicros;
//! let mut check = PulseCheck::new(&RobotConfig::default_biped())?;
//! let (pose, park) = ([1500, 1500, 1100, 1900].map(PulseMicros), [1500, 1500, 1056, 1944].map(PulseMicros));
//! assert!(!check.allows(pose, false) && check.allows(park, false));
//! // 500 degrees a second of the default robot are 5.6 us in a tick.
//! let (soon, jump) = ([1505, 1500, 1056, 1944].map(PulseMicros), [1560, 1500, 1056, 1944].map(PulseMicros));
//! assert!(check.allows(soon, false) && !check.allows(jump, false));
//! # Ok::<(), joint_loop::LoopError>(())
//! ```

use joint_loop::motion::start::{KNOWN_S, STEP_S};
use joint_loop::{JointRange, LoopError, RobotConfig, ServoConfig};
use joint_units::{Joint, PulseMicros, RadPerSec};

/// Control periods a second.
const TICKS_HZ: f32 = 1000.0;
/// Steps of a microsecond.
const STEPS: i32 = 1 << 16;
/// How far a pulse may be ahead of the position that keeps the rate: two roundings to a microsecond, and the rounding of `f32`.
const AHEAD: u32 = (STEPS + STEPS / 16) as u32;
/// How far a motion may begin from where the last one ended, us: the rounding of the loop.
const BEGINS_US: u16 = 1;
/// Ticks for which the last pulses are known, and the difference that the loop's count of them may have.
const KNOWN_TICKS: u32 = (KNOWN_S * TICKS_HZ) as u32;
const KNOWN_SLACK: u32 = 5;

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
    /// Pulses of the park pose.
    parked: [PulseMicros; Joint::COUNT],
    /// The positions that follow the pulses at no more than the rate, steps; `None` without pulses.
    reached: Option<[i32; Joint::COUNT]>,
    /// The last pulses that were allowed.
    last: Option<[PulseMicros; Joint::COUNT]>,
    /// Ticks since then.
    silent: u32,
}

impl PulseCheck {
    /// Of a robot, before its first pulse.
    ///
    /// # Errors
    /// The first servo map that is not allowed.
    pub fn new(robot: &RobotConfig) -> Result<Self, LoopError> {
        let mut limits = [Limits { joint: (0, 0), servo: (0, 0), way: 0 }; Joint::COUNT];
        let mut parked = [PulseMicros(0); Joint::COUNT];
        let joints = Joint::ALL.into_iter().zip(&robot.servos).zip(robot.gate.range.iter().zip(&robot.gate.rate));
        let places = limits.iter_mut().zip(parked.iter_mut().zip(robot.park));
        for ((limits, (parked, park)), ((joint, servo), (range, rate))) in places.zip(joints) {
            *limits = Limits::new(joint, servo, range, *rate)?;
            *parked = servo.build(joint)?.pulse(park).ok_or(LoopError::Park)?;
        }
        Ok(Self { limits, parked, reached: None, last: None, silent: 0 })
    }

    /// Takes the last pulses of the run before the reset, as the loop does. A pulse beyond those of its servo counts as the nearest of them.
    pub fn start_from(&mut self, mut pulses: [PulseMicros; Joint::COUNT]) {
        for (pulse, limits) in pulses.iter_mut().zip(&self.limits) {
            pulse.0 = pulse.0.max(limits.servo.0).min(limits.servo.1);
        }
        (self.last, self.silent) = (Some(pulses), 0);
    }

    /// Whether the pulses of a tick may go to the servos; those that may not change nothing here. In a trim a servo may have all pulses of its own, of
    /// which those of its joint are a part.
    #[must_use]
    pub fn allows(&mut self, pulses: [PulseMicros; Joint::COUNT], trims: bool) -> bool {
        let goals = pulses.map(|pulse| i32::from(pulse.0) * STEPS);
        let (mut reached, mut all) = match self.reached {
            Some(reached) => (reached, true),
            None => (goals, self.begins(pulses)),
        };
        let mut is_inside = true;
        for ((limits, pulse), (reached, goal)) in self.limits.iter().zip(pulses).zip(reached.iter_mut().zip(goals)) {
            // Not `clamp`, which has a panic for limits in the wrong order.
            *reached += (goal - *reached).min(limits.way).max(-limits.way);
            all &= goal.abs_diff(*reached) <= AHEAD;
            is_inside &= pulse.0 >= limits.joint.0 && pulse.0 <= limits.joint.1;
        }
        if !is_inside {
            let last = self.last.unwrap_or(self.parked);
            let mut joints = self.limits.iter().zip(pulses.into_iter().zip(last));
            all &= joints.all(|(limits, (now, last))| {
                let is_of_servo = now.0 >= limits.servo.0 && now.0 <= limits.servo.1;
                is_of_servo && (trims || limits.excess(now) <= limits.excess(last))
            });
        }
        if all {
            (self.reached, self.last, self.silent) = (Some(reached), Some(pulses), 0);
        }
        all
    }

    /// Whether a motion may begin with these pulses.
    fn begins(&self, pulses: [PulseMicros; Joint::COUNT]) -> bool {
        let is_at = |there: [PulseMicros; Joint::COUNT]| {
            pulses.iter().zip(there).all(|(pulse, there)| pulse.0.abs_diff(there.0) <= BEGINS_US)
        };
        let is_known = self.last.is_some() && self.silent <= KNOWN_TICKS + KNOWN_SLACK;
        let is_unknown = self.last.is_none() || self.silent + KNOWN_SLACK >= KNOWN_TICKS;
        is_known && self.last.is_some_and(is_at) || is_unknown && is_at(self.parked)
    }

    /// The servos get no pulses, for so many ticks.
    pub fn rest(&mut self, elapsed: u32) {
        self.reached = None;
        self.silent = self.silent.saturating_add(elapsed).min(2 * KNOWN_TICKS);
    }
}

impl Limits {
    fn new(joint: Joint, servo: &ServoConfig, range: &JointRange, rate: RadPerSec) -> Result<Self, LoopError> {
        let map = servo.build(joint)?;
        let pulse = |angle| map.pulse(angle).map_or(0, |pulse| pulse.0);
        let (a, b) = (pulse(range.least), pulse(range.most));
        // At most 2000 us a radian and 17.5 rad a second: 35 us in a tick; and no less than a trim.
        let way = (rate.0 * servo.micros_per_radian).max(1.0 / STEP_S) / TICKS_HZ * STEPS as f32;
        Ok(Self {
            joint: (a.min(b), a.max(b)),
            servo: (servo.shortest.0, servo.longest.0),
            way: (way as i32).saturating_add(1),
        })
    }

    /// How far a pulse is outside of the joint's range, us.
    fn excess(&self, pulse: PulseMicros) -> u16 {
        self.joint.0.saturating_sub(pulse.0).max(pulse.0.saturating_sub(self.joint.1))
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

    /// A motion that has begun at the park pose, with a servo moved to a pulse at the rate of a trim, or as far as allowed.
    fn moved(check: &mut PulseCheck, joint: usize, to: PulseMicros, trims: bool) -> bool {
        let mut at = check.last.unwrap_or(check.parked);
        while at[joint] != to {
            at[joint].0 = if at[joint] < to { at[joint].0 + 1 } else { at[joint].0 - 1 };
            for _ in 0..10 {
                if !check.allows(at, trims) {
                    return false;
                }
            }
        }
        true
    }

    #[test]
    fn both_ends_of_each_range_are_allowed_and_nothing_beyond() {
        for joint in 0..4 {
            let range = RobotConfig::default_biped().gate.range[joint];
            for (end, beyond) in [(range.least, -0.2), (range.most, 0.2)] {
                let pulse = |degrees| {
                    let mut pose = [0.0, 0.0, 10.0, 10.0];
                    pose[joint] = degrees;
                    pulses(pose)[joint]
                };
                let (end, beyond) = (pulse(end.degrees()), pulse(end.degrees() + beyond));
                assert!(moved(&mut check(), joint, end, false), "{joint} {end:?}");
                assert!(!moved(&mut check(), joint, beyond, false), "{joint} {beyond:?}");
                assert!(moved(&mut check(), joint, beyond, true), "{joint} {beyond:?} in a trim");
            }
            assert!(!moved(&mut check(), joint, PulseMicros(2_501), true));
        }
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
                    let mut pose = PARK;
                    pose[joint] += if way < 40.0 { way } else { 80.0 - way };
                    all &= check.allows(pulses(pose), false);
                }
                assert_eq!(all, allowed, "{joint} at {share}");
            }
        }
    }

    /// Of the default robot, degrees.
    const PARK: [f32; 4] = [0.0, 0.0, 5.0, 5.0];

    #[test]
    fn a_motion_begins_where_the_last_one_ended_for_a_minute_and_then_at_the_park_pose() {
        let there = [1.0, 0.0, 5.0, 5.0];
        let moved = || {
            let mut check = check();
            for tenths in 0..=10 {
                assert!(check.allows(pulses([0.1 * tenths as f32, 0.0, 5.0, 5.0]), false));
            }
            check
        };
        for elapsed in [1, 59_990] {
            let mut check = moved();
            check.rest(elapsed);
            assert!(!check.allows(pulses(PARK), false) && check.allows(pulses(there), false), "{elapsed}");
        }
        let mut late = moved();
        (0..600).for_each(|_| late.rest(200));
        assert!(!late.allows(pulses(there), false) && late.allows(pulses(PARK), false));
        // Not known before the first pulse, unless the boot found it.
        let mut booted = check();
        assert!(!booted.allows(pulses(there), false));
        booted.start_from(pulses(there));
        assert!(!booted.allows(pulses(PARK), false) && booted.allows(pulses(there), false));
        // What is refused changes nothing.
        let mut refused = moved();
        assert!(!refused.allows(pulses([40.0, 0.0, 5.0, 5.0]), false) && refused.allows(pulses(there), false));
    }

    #[test]
    fn a_servo_outside_of_its_joints_range_may_only_come_nearer() {
        for (joint, far) in [(0, 2_400), (1, 2_400), (2, 2_450), (3, 550)] {
            let mut check = check();
            assert!(moved(&mut check, joint, PulseMicros(far), true));
            check.rest(1_000);
            let left = check.last.expect("known");
            let mut further = left;
            further[joint].0 = if far > 1_500 { far + 1 } else { far - 1 };
            assert!(!check.allows(further, false), "{further:?}");
            assert!(check.allows(left, false));
            assert!(moved(&mut check, joint, PulseMicros(1_500), false));
            assert!(!moved(&mut check, joint, PulseMicros(far), false), "not out again");
        }
    }
}
