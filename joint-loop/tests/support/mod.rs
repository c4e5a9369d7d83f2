//! What the tests of the loop share: a sensor, a body of samples, a generator that does what it is told.
#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part of this module")]

use cpg_core::entrainment::FollowStatus;
use cpg_core::gait::default_walk::{self, default_walk};
use cpg_core::{Follow, Generator, StateFault, Unguided};
use hgod_adc::{
    Calibration, CalibrationPoint, FilterConfig, HealthConfig, Interpolation, ReferenceConfig, Sensor, SensorConfig,
};
use joint_loop::{BoardFaults, Command, JointLoop, LoopConfig, Sample, SupervisorState};
use joint_units::{AdcCode, Period, Phase, RadPerSec, Radians, Volts};

/// The code of the internal reference at a supply of 3.3 V, for the sensor here.
pub const VREFINT: AdcCode = AdcCode(1501);
/// A code in the middle of the sensor's table, and one that changes just enough not to be stuck.
pub const GOOD: [AdcCode; 2] = [AdcCode(1800), AdcCode(1801)];
/// A code that says the wire is open.
pub const OPEN: AdcCode = AdcCode(3);

/// A goniometer that falls by 1 V for 60 degrees.
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

/// The default walk, which follows nobody.
pub type Walk = Unguided<default_walk::Walk>;

/// The default walk with one sensor.
pub fn walker() -> JointLoop<Walk, 1> {
    walker_with(&LoopConfig::default_biped())
}

/// The default walk with one sensor, configured.
pub fn walker_with(config: &LoopConfig) -> JointLoop<Walk, 1> {
    let walk = Unguided(default_walk(Period::MILLISECOND).expect("valid"));
    config.build(Period::MILLISECOND, walk, [Some(sensor())]).expect("valid")
}

/// A good sample, tick after tick.
pub fn good(tick: u32) -> Sample<1> {
    Sample { codes: [GOOD[(tick & 1) as usize]], vrefint: VREFINT, ..Sample::default() }
}

/// Runs ticks that all get the same sample, but for the sensor's least bit; gives the last command.
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

/// Holds the button for 20 ticks, so that the last of them is the press.
pub fn press<G: Generator<4> + Follow>(joints: &mut JointLoop<G, 1>) -> Command {
    run(joints, 20, |sample| Sample { button: true, ..sample })
}

/// Nothing pressed, nothing wrong.
pub fn idle<G: Generator<4> + Follow>(joints: &mut JointLoop<G, 1>, ticks: u32) -> Command {
    run(joints, ticks, |sample| sample)
}

/// One tick with faults of the board.
pub fn fault<G: Generator<4> + Follow>(joints: &mut JointLoop<G, 1>, faults: BoardFaults) -> Command {
    run(joints, 1, |sample| Sample { faults, ..sample })
}

/// What the board says on the way from boot to a state.
pub fn script(state: SupervisorState) -> Vec<Sample<1>> {
    let idle = |ticks| vec![Sample { button: false, ..good(0) }; ticks];
    let press = || vec![Sample { button: true, ..good(0) }; 20];
    let clock = Sample { faults: BoardFaults::CLOCK, ..good(0) };
    let mut script = match state {
        SupervisorState::Boot => vec![],
        SupervisorState::Disarmed => idle(100),
        SupervisorState::Arming => [idle(100), press(), idle(700)].concat(),
        SupervisorState::Walking => [idle(100), press(), idle(2_700)].concat(),
        SupervisorState::Stopping => [idle(100), press(), idle(2_700), press(), idle(300)].concat(),
        SupervisorState::Fault => [idle(100), vec![clock]].concat(),
    };
    for (tick, sample) in (0..).zip(&mut script) {
        sample.codes = good(tick).codes;
    }
    script
}

/// Takes a fresh loop to a state, by what the board can say.
pub fn reach<G: Generator<4> + Follow + Clone>(fresh: &JointLoop<G, 1>, state: SupervisorState) -> JointLoop<G, 1> {
    let mut joints = fresh.clone();
    for sample in script(state) {
        joints.tick(&sample);
    }
    assert_eq!(joints.state(), state);
    joints
}

/// A generator that holds what a test puts into it.
#[derive(Debug, Clone)]
pub struct Puppet {
    pub angles: [Radians; 4],
    pub health: Result<(), StateFault>,
    /// From which step on the health is reported; before, all is well.
    pub from_step: u32,
    pub steps: u32,
    pub resets: u32,
    /// From this step on, this joint has this angle, and nothing is said about it.
    pub lie: Option<(u32, usize, f32)>,
}

impl Puppet {
    pub fn at(degrees: [f32; 4]) -> Self {
        Self {
            angles: degrees.map(Radians::from_degrees),
            health: Ok(()),
            from_step: 0,
            steps: 0,
            resets: 0,
            lie: None,
        }
    }
}

impl Generator<4> for Puppet {
    fn step(&mut self) {
        self.steps += 1;
    }

    fn angles(&self) -> [Radians; 4] {
        let mut angles = self.angles;
        if let Some((from, joint, angle)) = self.lie
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
    fn observe(&mut self, _: Option<Radians>) {}

    fn heel_strike(&mut self) {}

    fn follow_status(&self) -> Option<FollowStatus> {
        None
    }
}

/// A puppet with one sensor, configured by default.
pub fn puppet(puppet: Puppet) -> JointLoop<Puppet, 1> {
    LoopConfig::default_biped().build(Period::MILLISECOND, puppet, [Some(sensor())]).expect("valid")
}
