//! The conventions of `docs/fitting.md` are those of the code.

use cpg_core::Generator;
use cpg_core::gait::family::Member;

use joint_loop::{DEFAULT_PARK, Direction, JointRange, LoopConfig, anatomy};
use joint_units::{Joint, Period, Phase};

const PAGE: &str = include_str!("../../../docs/fitting.md");

fn has(text: &str) {
    assert!(PAGE.replace('\n', " ").contains(text), "docs/fitting.md does not have `{text}`");
}

#[test]
fn ranges_and_servos_are_those_of_the_code() {
    let robot = LoopConfig::default_biped();
    let degrees = |range: JointRange| format!("{:.0} to {:.0}", range.least.degrees(), range.most.degrees());
    for (name, joints) in [("hip", [Joint::LeftHip, Joint::RightHip]), ("knee", [Joint::LeftKnee, Joint::RightKnee])] {
        let [left, right] = joints.map(|joint| (robot.gate.range[joint as usize], robot.servos[joint as usize]));
        assert_eq!(left.0, right.0);
        let at_1500 = left.1.angle_at_neutral.degrees();
        assert_eq!(
            (left.1.neutral.0, left.1.direction, right.1.direction),
            (1500, Direction::Forward, Direction::Mirrored)
        );
        assert!((1000.0 / left.1.micros_per_radian.to_radians() - 90.0).abs() < 0.01);
        has(&format!("| {name} | {} | {} | {at_1500:.0} |", degrees(anatomy::range(joints[0])), degrees(left.0)));
    }
    let [hip, _, knee, _] = DEFAULT_PARK.map(|angle| angle.degrees());
    has(&format!("In the park pose the hips are at {hip:.0} and the knees at {knee:.0} degrees"));
}

#[test]
fn the_order_of_the_joints_is_that_of_the_code() {
    let names = Joint::ALL.map(|joint| format!("`{}`", joint.name())).join(", ");
    has(&names);
}

/// Phase 0 is where the left hip is most flexed: of the walk of persons, at the middle of its cadences.
#[test]
fn the_left_hip_is_most_flexed_at_phase_0() {
    let mut walk = Member::Walk.at_cadence(Member::Walk.middle()).unwrap().build(Period::MILLISECOND).unwrap();
    let mut most = (f32::MIN, Phase::ZERO);
    for _ in 0..1_200 {
        let hip = walk.angles()[Joint::LeftHip as usize].degrees();
        if hip > most.0 {
            most = (hip, walk.phase());
        }
        walk.step();
    }
    assert!(most.1.cycles_after(Phase::ZERO).abs() < 0.005, "{most:?}");
    has("Phase 0 is where the left hip is most flexed");
}
