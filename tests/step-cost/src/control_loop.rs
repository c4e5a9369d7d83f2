//! Whole ticks of the control loop as the firmware builds it, on a recorded walk: the default robot with its default generator and sensor, and a follower
//! with four sensors. Both are armed by the button and walk.

use core::hint::black_box;

use cpg_core::entrainment::{Corrections, EventSource};
use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop_with};
use joint_loop::{
    Command, FollowConfig, Frame, GeneratorConfig, JointSensor, JointSensors, LoopConfig, RobotConfig, SENSORS,
    SERIES_HARMONICS, Sample, SeriesConfig, ShapeConfig,
};
use joint_units::{AdcCode, Joint, Radians, Volts};

use crate::recorded;

/// Ticks of the default robot, and of the follower.
const TICKS: [u32; 2] = [2000, 1000];
/// The button is held in these ticks; its release arms.
const HELD: core::ops::Range<u32> = 60..180;
/// The shortest hold that arms, and the ramp to the generator's angles, s: the shortest that are allowed, for a walk within the ticks.
const SHORTEST_S: (f32, f32) = (0.1, 0.5);
/// Factory's code of the internal reference, its code at 3.0 V, and the least supply.
const VREFINT_CAL: AdcCode = AdcCode(1501);
const VREFINT: AdcCode = AdcCode(1651);
const MIN_SUPPLY: Volts = Volts(2.7);

/// A tick of the default robot.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn loop_default_walk(joints: &mut BoardLoop, sample: &Sample<SENSORS>, command: &mut Command) {
    *command = joints.tick(sample);
}

/// A tick of the follower with its frame, which has the follower's status.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn loop_follower(
    joints: &mut BoardLoop,
    sample: &Sample<SENSORS>,
    command: &mut Command,
    frame: &mut Frame<SENSORS>,
) {
    *command = joints.tick(sample);
    *frame = joints.frame();
}

/// Both runs; `None` if a loop cannot be built or does not move at its end.
pub(crate) fn run() -> Option<()> {
    let robot = RobotConfig::default_biped();
    let default = Parameters::with_defaults(None, None, robot).ok()?;
    walk(&default, TICKS[0], |joints, sample, command| {
        black_box(loop_default_walk as extern "C" fn(&mut BoardLoop, &Sample<SENSORS>, &mut Command))(
            joints, sample, command,
        );
    })?;
    let sensor = |joint| JointSensor::uncalibrated(joint).ok();
    let [Some(a), Some(b), Some(c), Some(d)] = Joint::ALL.map(sensor) else { return None };
    let sensors = JointSensors::build([a, b, c, d]).ok()?;
    let follower = Parameters::with_defaults(Some(follower()), Some(sensors), robot).ok()?;
    let mut frame = None;
    walk(&follower, TICKS[1], |joints, sample, command| {
        let frame = frame.get_or_insert_with(|| joints.frame());
        type Tick = extern "C" fn(&mut BoardLoop, &Sample<SENSORS>, &mut Command, &mut Frame<SENSORS>);
        black_box(loop_follower as Tick)(joints, sample, command, frame);
    })
}

/// Ticks with the samples that the sensors give on the recorded walk.
fn walk(
    parameters: &Parameters,
    ticks: u32,
    mut tick: impl FnMut(&mut BoardLoop, &Sample<SENSORS>, &mut Command),
) -> Option<()> {
    let mut config = LoopConfig::of(&parameters.robot);
    (config.button.hold_least_s, config.blend.ramp_s) = SHORTEST_S;
    let mut joints = black_box(board_loop_with(&config, parameters, VREFINT_CAL, MIN_SUPPLY).ok()?);
    // For the codes of the samples; the loop has its own.
    let sensor = |sensor: &JointSensor| Some((sensor.joint, sensor.build(VREFINT_CAL, MIN_SUPPLY).ok()?));
    let sensors = parameters.sensors.channels().each_ref().map(|channel| channel.as_ref().and_then(sensor));
    let mut sample = Sample { vrefint: VREFINT, ..Sample::default() };
    let mut command = Command::OFF;
    for (number, pose) in (0..ticks).zip(recorded::poses()) {
        sample.button = HELD.contains(&number);
        for (code, (joint, sensor)) in sample.codes.iter_mut().zip(sensors.iter().flatten()) {
            let supply = sensor.reference().supply(VREFINT).ok()?;
            *code = sensor.code(pose[*joint as usize & 3], supply).ok()?;
        }
        tick(&mut joints, &sample, &mut command);
    }
    command.pulses.map(|_| ())
}

/// A follower of the left hip, with shapes of two harmonics.
fn follower() -> GeneratorConfig {
    let joint = |mean: f32, first: f32, second: f32| {
        let (mut cos, mut sin) = ([0.0; SERIES_HARMONICS], [0.0; SERIES_HARMONICS]);
        (cos[0], sin[1]) = (first, second);
        SeriesConfig { mean: Radians(mean), cos, sin }
    };
    let joints = [joint(0.1, 0.3, 0.05), joint(0.1, -0.3, 0.05), joint(0.5, 0.3, 0.1), joint(0.5, -0.3, 0.1)];
    GeneratorConfig::Follow(FollowConfig {
        sensor: Joint::LeftHip,
        events: EventSource::None,
        shape: ShapeConfig { stride_s: 1.1, joints },
        corrections: Corrections::NONE,
    })
}
