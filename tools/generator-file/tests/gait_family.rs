//! The gaits of persons on the default robot: walk and scaled run walk at every cadence and no limit acts; the run as recorded does so on a
//! robot that can.

use cpg_core::gait::family::{FamilyGait, FirstLeg, Member};
use cpg_core::waveform::shape::FourierShape;
use cpg_core::{Generator, StateFault, Unguided};
use generator_file::certificate::{CertificateStatus, certify};
use generator_file::drive::walks;
use generator_file::file::{Coefficients, GeneratorSet, ShapeJoint, ShapeSet};
use joint_loop::{JointLoop, LoopConfig, PoseSense, Sample, SupervisorState};
use joint_units::{Joint, Period, Phase, RadPerSec, RadPerSec2, Radians};

/// The member at a cadence as the set of a generator file.
fn set(member: Member, cadence: f32) -> GeneratorSet {
    let config = member.at_cadence(cadence).expect("in range");
    let joint = |shape: &FourierShape<6>| {
        let (mean, cos, sin) = shape.coefficients();
        let list = |numbers: &[f32; 6]| Coefficients::new(&numbers.map(f32::to_degrees)).expect("six harmonics");
        ShapeJoint { mean_deg: mean.to_degrees(), cos_deg: list(cos), sin_deg: list(sin) }
    };
    GeneratorSet::Shape(ShapeSet { stride_s: config.stride_s, joints: config.shapes.each_ref().map(joint) })
}

/// Cadences over the whole range of a member, two steps a minute apart, with both ends.
fn cadences(member: Member) -> Vec<f32> {
    let (least, most) = member.cadences();
    let count = ((most - least) / 2.0).ceil();
    (0..=count as u32).map(|n| (least + n as f32 / count * (most - least)).min(most)).collect()
}

/// The default robot with wider limits: a strong one, whose anatomy is the same.
fn strong_robot() -> LoopConfig {
    let mut robot = LoopConfig::default_biped();
    robot.gate.rate = [RadPerSec(Radians::from_degrees(900.0).0); 4];
    robot.gate.acceleration = [RadPerSec2(Radians::from_degrees(40_000.0).0); 4];
    for limit in robot.gate.pose.iter_mut().flatten().filter(|limit| limit.sense == PoseSense::Sum) {
        limit.most = Radians::from_degrees(180.0);
    }
    robot
}

#[test]
fn walk_and_scaled_run_walk_at_every_cadence_and_no_limit_acts() {
    let robot = LoopConfig::default_biped();
    for member in [Member::Walk, Member::Run] {
        for cadence in cadences(member) {
            let got = walks(&set(member, cadence), &robot).expect("built");
            assert!(got.walks && got.limited_ticks == 0, "{} at {cadence}: {}", member.name(), got.in_words());
        }
        let (least, most) = member.cadences();
        for cadence in [least, member.middle(), most] {
            let got = certify(&set(member, cadence), 1, &robot, &mut |_| ()).expect("built");
            assert!(
                got.accepted && got.excesses.is_empty(),
                "{} at {cadence}: {:?}",
                member.name(),
                got.refused_because
            );
        }
    }
}

#[test]
fn the_run_as_recorded_needs_a_strong_robot() {
    let (least, most) = Member::RunUnscaled.cadences();
    for cadence in [least, most] {
        let set = set(Member::RunUnscaled, cadence);
        let got = certify(&set, 1, &LoopConfig::default_biped(), &mut |_| ()).expect("built");
        println!("{cadence}: {:?}, {}", got.refused_because, got.drive.in_words());
        assert_eq!(got.status, CertificateStatus::BeyondLimits);
        assert!(got.excesses.iter().any(|excess| excess.of == "left_knee" && excess.value > excess.allowed));
        let got = walks(&set, &strong_robot()).expect("built");
        assert!(got.walks && got.limited_ticks == 0, "{cadence}: {}", got.in_words());
    }
}

/// Ticks until the loop is armed and walks.
const ARMED: u32 = 5_000;
/// Ticks of the changes of [`Course`] after that: start, run, walk, stop, start.
const CHANGES: [u32; 5] = [0, 24_000, 30_000, 34_000, 37_000];

/// A generator that stands, starts, sweeps over every cadence of the walk, runs, walks, stops, and starts again.
struct Course {
    gait: FamilyGait,
    tick: u32,
}

impl Generator<4> for Course {
    fn step(&mut self) {
        let (least, most) = Member::Walk.cadences();
        let [start, run, walk, stop, again] = CHANGES;
        if let Some(tick) = self.tick.checked_sub(ARMED) {
            match tick {
                _ if tick == start => self.gait.start(FirstLeg::Left),
                _ if tick == run => self.gait.change(Member::Run, Member::Run.cadences().0).expect("in range"),
                _ if tick == walk => self.gait.change(Member::Walk, most).expect("in range"),
                _ if tick == stop => self.gait.stop(),
                _ if tick == again => self.gait.start(FirstLeg::Right),
                2_000..22_000 => {
                    let part = (tick - 2_000) as f32 / 20_000.0;
                    self.gait.set_cadence((least + part * (most - least)).min(most)).expect("in range");
                }
                _ => {}
            }
        }
        self.gait.step();
        self.tick += 1;
    }

    fn angles(&self) -> [Radians; 4] {
        self.gait.angles()
    }

    fn rates(&self) -> [RadPerSec; 4] {
        self.gait.rates()
    }

    fn phase(&self) -> Phase {
        self.gait.phase()
    }

    fn amplitude(&self) -> f32 {
        self.gait.amplitude()
    }

    fn check(&self) -> Result<(), StateFault> {
        self.gait.check()
    }

    fn reset(&mut self) {
        self.gait.reset();
    }
}

/// In the loop of the default robot it never stops, and a limit acts at most within two seconds of a change of gait.
#[test]
fn a_whole_course_keeps_walking() {
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = false;
    let limits = config.gate.joint_limits();
    let gait =
        FamilyGait::build(Member::Walk, Member::Walk.cadences().0, limits, Period::MILLISECOND).expect("in range");
    let course = Unguided(Course { gait, tick: 0 });
    let mut joints: JointLoop<Unguided<Course>, 0> = config.build(Period::MILLISECOND, course, []).expect("built");
    let (mut furthest, mut limited) = ([0.0f32; Joint::COUNT], 0);
    for tick in 0..45_000u32 {
        joints.tick(&Sample { button: (100..500).contains(&tick), ..Sample::default() });
        let Some(tick) = tick.checked_sub(ARMED) else { continue };
        assert_eq!(joints.state(), SupervisorState::Walking, "at {tick} ms: {}", joints.frame().cause.name());
        if joints.frame().limited.any() {
            limited += 1;
            assert!(CHANGES.iter().any(|at| (*at..at + 2_000).contains(&tick)), "a limit acts at {tick} ms");
        }
        for (furthest, angle) in furthest.iter_mut().zip(joints.frame().setpoints) {
            *furthest = furthest.max(angle.degrees());
        }
    }
    assert_eq!(limited, 70, "ticks in which a limit acts");
    assert!(furthest[2] > 60.0 && furthest[0] > 20.0, "{furthest:?}");
}
