//! Configuration of the whole loop, its default values, and the build that checks it.
//!
//! All fields are plain data in SI units. [`LoopConfig::build`] checks them and makes a [`JointLoop`] for one control period.

use crate::control::button::ButtonConfig;
use crate::control::monitor::MonitorConfig;
use crate::control::supply::Supply;
use crate::control::tick::{JointLoop, Stages};
use crate::control::trim::Trimmer;
use crate::error::LoopError;
use crate::motion::blend::BlendConfig;
use crate::motion::feedback::FeedbackConfig;
use crate::motion::start::Start;
use crate::setup::robot::{GateConfig, ServoConfig};
use crate::setup::robot_config::{Robot, RobotConfig};
use cpg_core::{Follow, Generator};
use hgod_adc::{Reference, Sensor};
use joint_units::{Joint, Period};

/// Configuration of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopConfig {
    /// Limits of the gate.
    pub gate: GateConfig,
    /// Servo map of each joint.
    pub servos: [ServoConfig; Joint::COUNT],
    /// Park pose and ramp times.
    pub blend: BlendConfig,
    /// Monitored conditions and their tolerances.
    pub monitor: MonitorConfig,
    /// Times of the button.
    pub button: ButtonConfig,
    /// Channel of the sensor whose angle a follower gets, counted from 0. On a channel without a sensor a follower gets no angle.
    pub gait_sensor: usize,
    /// Feedback of the joints' angles.
    pub feedback: FeedbackConfig,
    /// The chip's internal reference with the least supply: watched on every board, with or without sensors. `None` in a loop without a chip.
    pub supply: Option<Reference>,
}

impl LoopConfig {
    /// The default robot, see [`RobotConfig::default_biped`].
    #[must_use]
    pub const fn default_biped() -> Self {
        Self::of(&RobotConfig::default_biped())
    }

    /// The loop of a robot, with default ramp times and button, and the default monitor but for the robot's rules of a follower. Which channel has the
    /// sensor of a joint is not known yet.
    #[must_use]
    pub const fn of(robot: &RobotConfig) -> Self {
        Self {
            gate: robot.gate,
            servos: robot.servos,
            blend: robot.blend(),
            monitor: MonitorConfig { stand_s: robot.follower.disarm_after_stand_s, ..MonitorConfig::DEFAULT },
            button: ButtonConfig::DEFAULT,
            gait_sensor: 0,
            feedback: FeedbackConfig { share: robot.feedback, ..FeedbackConfig::NONE },
            supply: None,
        }
    }

    /// Checks every field and makes the loop for one control period, before its first tick. `sensors` has one entry a channel;
    /// `None` is a channel without a sensor.
    ///
    /// # Errors
    /// [`LoopError`] names the first field that is not allowed, its joint, and what is allowed.
    pub fn build<G: Generator<{ Joint::COUNT }> + Follow, const S: usize>(
        &self,
        period: Period,
        generator: G,
        sensors: [Option<Sensor>; S],
    ) -> Result<JointLoop<G, S>, LoopError> {
        let Robot { gate, servos, blend, parked } = Robot::build(&self.gate, &self.servos, &self.blend, period)?;
        let trimmer = Trimmer::build(servos, blend.park(), period)?;
        let monitor = self.monitor.build(period)?;
        let supply = self.supply.map(|reference| Supply::new(reference, period));
        let button = self.button.build(period)?;
        if self.monitor.sensor_required && sensors.iter().all(Option::is_none) {
            return Err(LoopError::NoSensor);
        }
        if generator.check().is_err() {
            return Err(LoopError::Generator);
        }
        let followed = generator.follow_status().map(|_| self.gait_sensor);
        let has_sensor = |channel| sensors.get(channel).is_some_and(Option::is_some);
        let feedback = self.feedback.build(period, has_sensor, followed)?;
        Ok(JointLoop::new(
            Stages {
                gate,
                servos,
                blend,
                start: Start::build(period)?,
                trimmer,
                monitor,
                supply,
                button,
                sensors,
                gait_sensor: self.gait_sensor,
                feedback,
            },
            generator,
            parked,
            period,
        ))
    }
}

impl Default for LoopConfig {
    fn default() -> Self {
        Self::default_biped()
    }
}
