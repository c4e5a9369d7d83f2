//! The gaits of persons: linear in the cadence, legs alike, refused beyond the recordings; start, sweep, change and stop without a jump.

use cpg_core::gait::family::{FamilyGait, FirstLeg, Member, SOURCES, STAND};
use cpg_core::gait::named::Gait;
use cpg_core::transition::JointLimits;
use cpg_core::waveform::shape::Shape;
use cpg_core::{BuildError, Field, Generator};
use joint_units::{Period, Phase};

const MS: Period = Period::MILLISECOND;
const WIDE: [JointLimits; 4] = [JointLimits::WIDEST; 4];

fn phases() -> impl Iterator<Item = Phase> {
    (0..200u32).map(|k| Phase(k.wrapping_mul(21_474_836)))
}

/// Angles in degrees at a phase.
fn pose(member: Member, cadence: f32, phase: Phase) -> [f32; 4] {
    let config = member.at_cadence(cadence).expect("in range");
    config.shapes.map(|shape| shape.at(phase).angle.to_degrees())
}

/// The angle at a quarter of the range is the mean of the ends, weighted 3 to 1; and both ends differ.
#[test]
fn every_angle_is_linear_in_the_cadence() {
    for member in Member::ALL {
        let (least, most) = member.cadences();
        let mut furthest = 0.0f32;
        for phase in phases() {
            let [a, b, quarter] = [least, most, 0.75 * least + 0.25 * most].map(|c| pose(member, c, phase));
            for joint in 0..4 {
                assert!((0.75 * a[joint] + 0.25 * b[joint] - quarter[joint]).abs() < 1e-3, "{}", member.name());
                furthest = furthest.max((a[joint] - b[joint]).abs());
            }
        }
        assert!(furthest > 3.0, "{}: {furthest}", member.name());
    }
}

#[test]
fn the_right_leg_is_the_left_one_half_a_stride_later() {
    for member in Member::ALL {
        for phase in phases() {
            let (now, later) =
                (pose(member, member.middle(), phase), pose(member, member.middle(), phase + Phase(1 << 31)));
            assert!((now[0] - later[1]).abs() < 1e-3 && (now[2] - later[3]).abs() < 1e-3, "{}", member.name());
        }
    }
}

#[test]
fn the_left_hip_is_most_flexed_at_phase_0() {
    for member in [Member::Walk, Member::RunUnscaled] {
        let hip = |phase| pose(member, member.middle(), phase)[0];
        let most = phases().map(hip).fold(f32::MIN, f32::max);
        assert!(most - hip(Phase(0)) < 0.01, "{}: {most}, {}", member.name(), hip(Phase(0)));
    }
}

#[test]
fn cadences_that_were_not_recorded_are_refused() {
    for member in Member::ALL {
        let (min, max) = member.cadences();
        for value in [min - 0.1, max + 0.1, 0.0, -110.0, 140.0] {
            let wanted = BuildError::OutOfRange { field: Field::of("cadence"), value, min, max };
            assert_eq!(member.at_cadence(value).map(|_| ()), Err(wanted), "{}", member.name());
            assert!(FamilyGait::build(member, value, WIDE, MS).is_err());
        }
        for value in [f32::NAN, f32::INFINITY] {
            assert!(matches!(member.at_cadence(value), Err(BuildError::NotFinite { .. })));
        }
        let gait = Gait::from_name(member.name()).expect("a named gait");
        assert_eq!(gait.cadences(), (min, max));
        for cadence in [min, max, member.middle()] {
            let built = gait.build(gait.speed_at(cadence).expect("in range"), MS).expect("in range");
            let direct = member.at_cadence(cadence).expect("in range").build(MS).expect("in range");
            let apart = built.angles().into_iter().zip(direct.angles()).map(|(a, b)| (a.0 - b.0).abs());
            assert!(apart.fold(0.0, f32::max) < 1e-5);
        }
        assert!(gait.speed_at(max + 1.0).unwrap_err().to_string().starts_with("cadence = "));
    }
}

/// Largest step of an angle beyond its rate, degrees; and the largest acceleration, rad/s^2.
struct Watch {
    before: ([f32; 4], [f32; 4]),
    acceleration: f32,
}

impl Watch {
    fn of(gait: &FamilyGait) -> Self {
        Self { before: (gait.angles().map(|a| a.0), gait.rates().map(|r| r.0)), acceleration: 0.0 }
    }

    fn step(&mut self, gait: &mut FamilyGait) {
        gait.step();
        let now = (gait.angles().map(|a| a.0), gait.rates().map(|r| r.0));
        for joint in 0..4 {
            let step = (now.0[joint] - self.before.0[joint]) * 1e3;
            let rate = 0.5 * (now.1[joint] + self.before.1[joint]);
            assert!((step - rate).abs() < 2e-2, "joint {joint}: {step} rad/s in a tick, rate {rate}");
            self.acceleration = self.acceleration.max((now.1[joint] - self.before.1[joint]).abs() * 1e3);
        }
        self.before = now;
    }
}

/// A stand, a start with either leg, a sweep over all cadences and back, a run, a walk, a stop, a start within the stop.
#[test]
fn a_whole_course_has_no_jump() {
    for first in [FirstLeg::Left, FirstLeg::Right] {
        let (least, most) = Member::Walk.cadences();
        let mut gait = FamilyGait::build(Member::Walk, least, WIDE, MS).unwrap();
        let mut watch = Watch::of(&gait);
        (0..500).for_each(|_| watch.step(&mut gait));
        assert!(gait.is_standing() && gait.angles() == STAND);
        gait.start(first);
        for tick in 0..8_000u16 {
            let part = 1.0 - (1.0 - f32::from(tick) / 4_000.0).abs();
            gait.set_cadence((least + part * (most - least)).clamp(least, most)).unwrap();
            watch.step(&mut gait);
        }
        gait.set_cadence(most).unwrap();
        gait.change(Member::Run, Member::Run.cadences().0).unwrap();
        (0..2_000).for_each(|_| watch.step(&mut gait));
        gait.change(Member::RunUnscaled, Member::Run.middle()).unwrap();
        (0..2_000).for_each(|_| watch.step(&mut gait));
        gait.change(Member::Walk, most).unwrap();
        (0..1_234).for_each(|_| watch.step(&mut gait));
        gait.stop();
        (0..300).for_each(|_| watch.step(&mut gait));
        gait.start(FirstLeg::Right);
        (0..1_000).for_each(|_| watch.step(&mut gait));
        assert!(!gait.is_standing());
        gait.stop();
        // Half a stride at most, and then the transition.
        (0..2_500).for_each(|_| watch.step(&mut gait));
        assert!(gait.is_standing() && gait.angles() == STAND && gait.rates().iter().all(|rate| rate.0 == 0.0));
        // That of the run by itself and the stated one of a change.
        assert!(watch.acceleration < 400.0, "{}", watch.acceleration);
    }
}

/// At a start the leg that swings first bends its knee far; the other one does so a step later.
#[test]
fn the_first_leg_swings_first() {
    for (first, knee) in [(FirstLeg::Left, 2), (FirstLeg::Right, 3)] {
        let mut gait = FamilyGait::build(Member::Walk, 120.0, WIDE, MS).unwrap();
        gait.start(first);
        let reached = |gait: &mut FamilyGait| {
            (0..1_500).find_map(|_| {
                gait.step();
                (2..4).find(|&joint| gait.angles()[joint].degrees() > 45.0)
            })
        };
        assert_eq!(reached(&mut gait), Some(knee));
    }
}

/// A cadence that is refused changes nothing.
#[test]
fn a_refused_change_leaves_the_gait_as_it_was() {
    let mut gait = FamilyGait::build(Member::Walk, 110.0, WIDE, MS).unwrap();
    gait.start(FirstLeg::Left);
    (0..700).for_each(|_| gait.step());
    let before = gait.clone();
    assert!(gait.set_cadence(150.0).is_err() && gait.change(Member::Run, 120.0).is_err());
    assert!(gait.set_cadence(f32::NAN).is_err());
    assert_eq!(gait, before);
    gait.reset();
    assert!(gait.is_standing() && gait.angles() == STAND);
}

/// Names, and nothing that the licence forbids.
#[test]
fn the_sources_are_named() {
    for (n, source) in SOURCES.iter().enumerate() {
        assert!(source.sha256.len() == 64 && source.sha256.bytes().all(|digit| digit.is_ascii_hexdigit()));
        assert!(["Apache-2.0", "BSD-2-Clause", "CC BY 4.0"].contains(&source.licence), "{}", source.name);
        assert!(SOURCES[..n].iter().all(|other| other.name != source.name && other.sha256 != source.sha256));
        assert!(source.member != Member::Run && !source.name.starts_with("gaitprint"));
    }
}
