//! Shared code of the loop's tests: a sensor, samples, scripts to each state, a generator with set angles.
#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part of this module")]

pub mod motion_limits;

use cpg_core::entrainment::{FollowStatus, Lock};
use cpg_core::gait::default_walk::{self, default_walk};
use cpg_core::{Follow, Generator, StateFault, Unguided};
use hgod_adc::{
    Calibration, CalibrationPoint, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, Sensor, SensorConfig,
};
use joint_loop::tuning::{Action, Request};
use joint_loop::{BoardFaults, Command, JointLoop, LoopConfig, Sample, SupervisorState};
use joint_units::{AdcCode, Joint, Period, Phase, RadPerSec, Radians, Volts};

/// The code of the internal reference at a supply of 3.3 V, for the sensor here.
pub const VREFINT: AdcCode = AdcCode(1501);
/// Two codes in the middle of the sensor's table; alternating codes are not stuck.
pub const GOOD: [AdcCode; 2] = [AdcCode(1800), AdcCode(1801)];
/// The code of an open wire.
pub const OPEN: AdcCode = AdcCode(3);

/// A goniometer whose voltage falls by 1 V for 60 degrees.
pub fn sensor() -> Sensor {
    let points = [(0.5, 120.0), (1.5, 60.0), (2.0, 30.0), (2.5, 0.0)]
        .map(|(volts, degrees)| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) });
    SensorConfig {
        reference: ReferenceConfig::stm32f4(VREFINT),
        calibration: Calibration::new(&points, Interpolation::Linear).expect("valid"),
        filter: FilterConfig::default(),
        health: HealthConfig::default(),
    }
    .build(Period::MILLISECOND)
    .expect("valid")
}

/// The default walk, which is no follower.
pub type Walk = Unguided<default_walk::Walk>;

/// A loop of the default walk with one sensor.
pub type Loop = JointLoop<Walk, 1>;

/// The default walk with one sensor, on a board whose supply is watched.
pub fn default_loop() -> JointLoop<Walk, 1> {
    let supply = Some(ReferenceConfig::stm32f4(VREFINT).build().expect("valid"));
    default_loop_with(&LoopConfig { supply, ..LoopConfig::default_biped() })
}

/// The default walk with one sensor and this configuration.
pub fn default_loop_with(config: &LoopConfig) -> JointLoop<Walk, 1> {
    let walk = Unguided(default_walk(Period::MILLISECOND).expect("valid"));
    config.build(Period::MILLISECOND, walk, [Some(sensor())]).expect("valid")
}

/// A good sample for each tick.
pub fn good(tick: u32) -> Sample<1> {
    Sample { codes: [GOOD[(tick & 1) as usize]], vrefint: VREFINT, ..Sample::default() }
}

/// Runs ticks with the same sample except for the sensor's code; returns the last command.
pub fn run<G: Generator<4> + Follow>(
    joints: &mut JointLoop<G, 1>,
    ticks: u32,
    sample: impl Fn(Sample<1>) -> Sample<1>,
) -> Command {
    let mut command = Command::OFF;
    for tick in 0..ticks {
        command = joints.tick(&sample(good(tick)));
    }
    command
}

/// Holds the button for 0.4 s and releases it, so that the last tick is the release: arms, or acknowledges a fault.
pub fn hold<G: Generator<4> + Follow>(joints: &mut JointLoop<G, 1>) -> Command {
    run(joints, 400, |sample| Sample { button: true, ..sample });
    run(joints, 20, |sample| sample)
}

/// Holds the button for 20 ticks, so that the last of them is the press.
pub fn press<G: Generator<4> + Follow>(joints: &mut JointLoop<G, 1>) -> Command {
    run(joints, 20, |sample| Sample { button: true, ..sample })
}

/// Ticks without a press and without a fault.
pub fn idle<G: Generator<4> + Follow>(joints: &mut JointLoop<G, 1>, ticks: u32) -> Command {
    run(joints, ticks, |sample| sample)
}

/// One tick with faults of the board.
pub fn fault<G: Generator<4> + Follow>(joints: &mut JointLoop<G, 1>, faults: BoardFaults) -> Command {
    run(joints, 1, |sample| Sample { faults, ..sample })
}

/// Samples that lead from boot to a state.
pub fn script(state: SupervisorState) -> Vec<Sample<1>> {
    let idle = |ticks| vec![Sample { button: false, ..good(0) }; ticks];
    let held = |ticks| vec![Sample { button: true, ..good(0) }; ticks];
    let hold = || [held(400), idle(20)].concat();
    let clock = Sample { faults: BoardFaults::CLOCK, ..good(0) };
    let action = Action::Trim { joint: Joint::LeftKnee };
    let trim = Sample { request: Some(Request { number: 1, action }), ..good(0) };
    let mut script = match state {
        SupervisorState::Boot => vec![],
        SupervisorState::Disarmed => idle(100),
        SupervisorState::Arming => [idle(100), hold(), idle(700)].concat(),
        SupervisorState::Walking => [idle(100), hold(), idle(2_700)].concat(),
        SupervisorState::Stopping => [idle(100), hold(), idle(2_700), held(20), idle(300)].concat(),
        SupervisorState::Fault => [idle(100), vec![clock]].concat(),
        SupervisorState::TrimReady => [idle(100), vec![trim]].concat(),
        SupervisorState::Trimming => [idle(100), vec![trim], hold(), idle(700)].concat(),
    };
    for (tick, sample) in (0..).zip(&mut script) {
        sample.codes = good(tick).codes;
    }
    script
}

/// Runs a new loop to a state by samples.
pub fn reach<G: Generator<4> + Follow + Clone>(fresh: &JointLoop<G, 1>, state: SupervisorState) -> JointLoop<G, 1> {
    let mut joints = fresh.clone();
    for sample in script(state) {
        joints.tick(&sample);
    }
    assert_eq!(joints.state(), state);
    joints
}

/// A generator with the angles and the health that a test sets.
#[derive(Debug, Clone)]
pub struct Puppet {
    pub angles: [Radians; 4],
    pub health: Result<(), StateFault>,
    /// Step from which the health is reported; before, it is good.
    pub from_step: u32,
    pub steps: u32,
    pub resets: u32,
    /// From this step on, this joint has this angle, without a failed check.
    pub unchecked: Option<(u32, usize, f32)>,
    /// The state of a follower; `None`: it follows nobody.
    pub follows: Option<Lock>,
    /// The last angle that it observed; `None`: there was no good one.
    pub observed: Option<Radians>,
    /// Heel strikes so far.
    pub strikes: u32,
}

impl Puppet {
    pub fn at(degrees: [f32; 4]) -> Self {
        Self {
            angles: degrees.map(Radians::from_degrees),
            health: Ok(()),
            from_step: 0,
            steps: 0,
            resets: 0,
            unchecked: None,
            follows: None,
            observed: None,
            strikes: 0,
        }
    }
}

impl Generator<4> for Puppet {
    fn step(&mut self) {
        self.steps += 1;
    }

    fn angles(&self) -> [Radians; 4] {
        let mut angles = self.angles;
        if let Some((from, joint, angle)) = self.unchecked
            && self.steps >= from
        {
            angles[joint] = Radians(angle);
        }
        angles
    }

    fn rates(&self) -> [RadPerSec; 4] {
        [RadPerSec(0.0); 4]
    }

    fn phase(&self) -> Phase {
        Phase(0)
    }

    fn amplitude(&self) -> f32 {
        1.0
    }

    fn check(&self) -> Result<(), StateFault> {
        if self.steps < self.from_step { Ok(()) } else { self.health }
    }

    fn reset(&mut self) {
        self.resets += 1;
        (self.health, self.from_step, self.steps) = (Ok(()), 0, 0);
    }
}

impl Follow for Puppet {
    fn observe(&mut self, angle: Option<Radians>) {
        self.observed = angle;
    }

    fn heel_strike(&mut self) {
        self.strikes += 1;
    }

    fn follow_status(&self) -> Option<FollowStatus> {
        let status =
            |state| FollowStatus { state, fault: None, phase_error: Radians(0.0), stride_s: 1.1, confidence: 0.0 };
        self.follows.map(status)
    }
}

/// A loop with a puppet, one sensor and the default configuration.
pub fn puppet(puppet: Puppet) -> JointLoop<Puppet, 1> {
    LoopConfig::default_biped().build(Period::MILLISECOND, puppet, [Some(sensor())]).expect("valid")
}
