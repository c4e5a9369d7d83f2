//! A whole robot: limits of the joints, servo maps, park pose and least supply, and the build that checks them against each other.

use crate::error::{LoopError, inside};
use crate::motion::blend::{Blend, BlendConfig};
use crate::motion::feedback::FeedbackConfig;
use crate::motion::gate::{Gate, GateState};
use crate::motion::servo::ServoMap;
use crate::setup::robot::{DEFAULT_PARK, GateConfig, ServoConfig};
use hgod_adc::stm32f4::{MAX_SUPPLY, MIN_SUPPLY};
use joint_units::{Joint, Period, Radians, Volts};

/// A robot. The host writes it to the board as a robot record, see [`crate::store::robot_record`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotConfig {
    /// Range, rate and acceleration of each joint, and the pose limits between joints.
    pub gate: GateConfig,
    /// Servo map of each joint.
    pub servos: [ServoConfig; Joint::COUNT],
    /// Pose at the start and at the end of a motion. rad, inside the gate's range and pose envelope.
    pub park: [Radians; Joint::COUNT],
    /// Supply below which no sample is good. V, 1.8 to 3.6.
    pub min_supply: Volts,
    /// When a follower stops by itself.
    pub follower: FollowerRules,
    /// Feedback of each joint: the share of its distance to the last setpoint that is added to its next target. No unit, -0.8 to 0.8; see
    /// [`crate::motion::feedback`].
    pub feedback: [f32; Joint::COUNT],
    /// Whether a board whose brown-out reset is off does not arm. Otherwise it warns.
    pub require_brown_out_reset: bool,
}

/// When a follower stops by itself: whoever wears or watches the robot is there, or the outputs go off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowerRules {
    /// Time without a stride of the person after which the outputs go off. s, 1 to 60.
    pub disarm_after_stand_s: f32,
    /// Whether it walks again by itself when its sensor is good again after more than [`crate::FOLLOWER_LOST_MS`], as long as the person has not stood for
    /// longer than the time above. Else that takes a hold of the button.
    pub walks_again_after_lost_sensor: bool,
}

impl FollowerRules {
    /// 10 s, longer than a stand before a step or at a door; a hold of the button after a lost sensor.
    pub const DEFAULT: Self = Self { disarm_after_stand_s: 10.0, walks_again_after_lost_sensor: false };
    /// Least and most of [`FollowerRules::disarm_after_stand_s`], s.
    pub const STAND_S: (f32, f32) = (1.0, 60.0);
}

impl RobotConfig {
    /// The default robot: two hips and two knees on hobby servos with 180 degrees of travel, see [`GateConfig::default_biped`]
    /// and [`ServoConfig::default_biped`]; 2.7 V, which a supply of 3.3 V behind a diode keeps to; no feedback.
    #[must_use]
    pub const fn default_biped() -> Self {
        Self {
            gate: GateConfig::default_biped(),
            servos: ServoConfig::default_biped(),
            park: DEFAULT_PARK,
            min_supply: Volts(2.7),
            follower: FollowerRules::DEFAULT,
            feedback: FeedbackConfig::NONE.share,
            require_brown_out_reset: false,
        }
    }

    /// Checks every field and makes the stages between generator and servos.
    ///
    /// ```
    /// use joint_loop::RobotConfig;
    /// use joint_units::{Joint, Period, PulseMicros, Radians};
    /// let mut config = RobotConfig::default_biped();
    /// config.servos[Joint::LeftHip as usize].neutral = PulseMicros(1_400);
    /// let robot = config.build(Period::MILLISECOND)?;
    /// // 636.62 us/rad: 90 degrees are 1000 us.
    /// let hip = &robot.servos[Joint::LeftHip as usize];
    /// assert_eq!(hip.pulse(Radians::from_degrees(9.0)), Some(PulseMicros(1_500)));
    ///
    /// config.park[Joint::LeftKnee as usize] = Radians::from_degrees(121.0);
    /// let error = config.build(Period::MILLISECOND).unwrap_err().to_string();
    /// assert_eq!(error, "blend.park[left_knee] is 121 deg; allowed are -2 to 120 deg");
    /// # Ok::<(), joint_loop::LoopError>(())
    /// ```
    ///
    /// # Errors
    /// [`LoopError`] names the first field that is not allowed, its joint, and what is allowed.
    pub fn build(&self, period: Period) -> Result<Robot, LoopError> {
        inside("robot.min_supply", None, self.min_supply.0, MIN_SUPPLY.0, MAX_SUPPLY.0, "V")?;
        let (least, most) = FollowerRules::STAND_S;
        inside("follower.disarm_after_stand_s", None, self.follower.disarm_after_stand_s, least, most, "s")?;
        FeedbackConfig::check_shares(&self.feedback)?;
        Robot::build(&self.gate, &self.servos, &self.blend(), period)
    }

    /// Park pose of the robot, and default ramp times.
    pub(crate) const fn blend(&self) -> BlendConfig {
        BlendConfig { park: self.park, ..BlendConfig::DEFAULT }
    }

    /// Supply below which no sample is good on a board: its own least supply where that is higher.
    #[must_use]
    pub fn min_supply_on(&self, board: Volts) -> Volts {
        if self.min_supply.0 > board.0 { self.min_supply } else { board }
    }
}

impl Default for RobotConfig {
    fn default() -> Self {
        Self::default_biped()
    }
}

/// The checked stages of a robot, from target angles to pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robot {
    /// Limits of every setpoint.
    pub gate: Gate,
    /// Servo map of each joint.
    pub servos: [ServoMap; Joint::COUNT],
    /// Ramps from and to the park pose.
    pub blend: Blend,
    /// At rest in the park pose.
    pub parked: GateState,
}

impl Robot {
    pub(crate) fn build(
        gate_config: &GateConfig,
        servos: &[ServoConfig; Joint::COUNT],
        blend: &BlendConfig,
        period: Period,
    ) -> Result<Self, LoopError> {
        let gate = Gate::build(gate_config, period)?;
        let [left_hip, right_hip, left_knee, right_knee] = servos;
        let servos = [
            left_hip.build(Joint::LeftHip)?,
            right_hip.build(Joint::RightHip)?,
            left_knee.build(Joint::LeftKnee)?,
            right_knee.build(Joint::RightKnee)?,
        ];
        for ((joint, map), range) in Joint::ALL.into_iter().zip(&servos).zip(&gate_config.range) {
            map.reaches(joint, range)?;
        }
        let blend = blend.build(period, gate_config)?;
        let parked = gate.rest(blend.park()).ok_or(LoopError::Park)?;
        Ok(Self { gate, servos, blend, parked })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::robot::Direction;
    use joint_units::PulseMicros;
    use proptest::prelude::*;

    #[test]
    fn the_least_supply_is_that_of_the_board_or_a_higher_one() {
        let robot = |volts| RobotConfig { min_supply: Volts(volts), ..RobotConfig::default_biped() };
        let cases = [(2.7, 2.7, 2.7), (2.7, 3.0, 3.0), (3.1, 3.0, 3.1), (1.8, 2.7, 2.7)];
        for (of_robot, of_board, want) in cases {
            assert_eq!(robot(of_robot).min_supply_on(Volts(of_board)), Volts(want));
        }
        for (volts, words) in [
            (1.7, "robot.min_supply is 1.7 V; allowed are 1.8 to 3.6 V"),
            (3.7, "robot.min_supply is 3.7 V"),
            (f32::NAN, "robot.min_supply is not a finite number"),
        ] {
            let error = robot(volts).build(Period::MILLISECOND).expect_err(words).to_string();
            assert!(error.starts_with(words), "{error}");
        }
    }

    proptest! {
        /// Pulses of a robot with other servos, against the formula in whole numbers and double precision.
        #[test]
        fn pulses_are_those_of_the_arithmetic(
            neutral in prop::array::uniform4(1_400_u16..=1_600), scale in prop::array::uniform4(300.0_f32..610.0),
            mirrored in prop::array::uniform4(any::<bool>()), at_deg in prop::array::uniform4(-20.0_f32..20.0),
            share in prop::array::uniform4(0.0_f32..1.0),
        ) {
            let mut config = RobotConfig::default_biped();
            for joint in 0..4 {
                let servo = &mut config.servos[joint];
                servo.neutral = PulseMicros(neutral[joint]);
                servo.micros_per_radian = scale[joint];
                servo.direction = if mirrored[joint] { Direction::Mirrored } else { Direction::Forward };
                servo.angle_at_neutral = Radians::from_degrees(at_deg[joint] + if joint < 2 { 15.0 } else { 59.0 });
            }
            let robot = config.build(Period::MILLISECOND).expect("allowed");
            for joint in 0..4 {
                let (range, servo) = (config.gate.range[joint], &config.servos[joint]);
                let angle = Radians(range.least.0 + share[joint] * (range.most.0 - range.least.0));
                let turned = f64::from(scale[joint]) * (f64::from(angle.0) - f64::from(servo.angle_at_neutral.0));
                let micros = f64::from(neutral[joint]) + if mirrored[joint] { -turned } else { turned };
                let pulse = f64::from(robot.servos[joint].pulse(angle).expect("finite").0);
                // Half a microsecond of rounding, and that of single precision.
                prop_assert!((pulse - micros).abs() <= 0.502, "joint {}: {} us, by the formula {}", joint, pulse, micros);
            }
        }
    }
}
