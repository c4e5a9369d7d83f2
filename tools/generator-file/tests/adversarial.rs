//! Generators that a certificate must not accept, each with the word that it gets; beside them some that look alike and are accepted.
//!
//! Every one goes through the text of a generator file.

use generator_file::certificate::{Certificate, CertificateStatus, certify};
use generator_file::file::{
    Coefficients, GeneratorFile, GeneratorSet, PhaseCoupledSet, Provenance, ShapeJoint, ShapeSet, ThesisJoint,
    ThesisSet,
};
use joint_loop::LoopConfig;

use CertificateStatus::{Accepted, BeyondLimits, DoesNotContract, DoesNotOscillate, JointsDoNotMove, QuasiPeriodic};

/// The default walk, changed.
fn walk(change: impl Fn(&mut PhaseCoupledSet)) -> GeneratorSet {
    let GeneratorSet::PhaseCoupled(mut set) = GeneratorFile::default_of("phase-coupled").unwrap().set else {
        panic!("R1")
    };
    change(&mut set);
    GeneratorSet::PhaseCoupled(set)
}

/// The thesis' network, set S, changed.
fn thesis(change: impl Fn(&mut ThesisSet)) -> GeneratorSet {
    let GeneratorSet::Thesis(mut set) = GeneratorFile::default_of("thesis").unwrap().set else { panic!("the thesis") };
    change(&mut set);
    GeneratorSet::Thesis(set)
}

/// Amplitude, mean and lead of each joint.
fn shape(joints: [(f32, f32, f32); 4], stride_s: f32) -> GeneratorSet {
    let joints = joints.map(|(amplitude, mean_deg, lead)| {
        let (sin, cos) = lead.to_radians().sin_cos();
        let of = |x: f32| Coefficients::new(&[x]).expect("one");
        ShapeJoint { mean_deg, cos_deg: of(amplitude * cos), sin_deg: of(-amplitude * sin) }
    });
    GeneratorSet::Shape(ShapeSet { stride_s, joints })
}

/// A shape inside all limits.
const INSIDE: [(f32, f32, f32); 4] = [(20.0, 5.0, 0.0), (20.0, 5.0, 180.0), (25.0, 30.0, 80.0), (25.0, 30.0, 260.0)];

fn with(joint: usize, (amplitude, mean, lead): (f32, f32, f32)) -> [(f32, f32, f32); 4] {
    let mut joints = INSIDE;
    joints[joint] = (amplitude, mean, lead);
    joints
}

/// Certified from the text of its file.
fn certified(set: &GeneratorSet) -> Certificate {
    let text = GeneratorFile { provenance: Provenance::default(), set: set.clone() }.to_toml();
    let file = GeneratorFile::parse("generator.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    certify(&file.set, 200, &LoopConfig::default_biped(), &mut |_| ()).expect("built")
}

/// Name, set, word, words of the reason, and whether it walks.
type Case = (&'static str, GeneratorSet, CertificateStatus, &'static str, bool);

fn cases() -> Vec<Case> {
    let couple = |coupling: [f32; 4]| walk(move |set| set.coupling = coupling);
    vec![
        ("the default walk", walk(|_| ()), Accepted, "", true),
        (
            "slow to gain its amplitude, strong links",
            walk(|s| (s.nonlinearity, s.coupling) = (0.01, [2.0; 4])),
            DoesNotContract,
            "0.9683",
            true,
        ),
        ("slow, and fast enough", walk(|s| (s.nonlinearity, s.coupling) = (0.02, [2.0; 4])), Accepted, "", true),
        (
            "a stride of 0.315 s",
            walk(|s| {
                s.natural_period_s = 0.315 / 1.014;
                s.joints.iter_mut().for_each(|j| j.amplitude_deg *= 0.15);
            }),
            Accepted,
            "",
            true,
        ),
        ("no links of the legs", couple([0.5, 0.5, 0.0, 0.0]), DoesNotContract, "1.0000", true),
        ("no links at all", couple([0.0; 4]), DoesNotContract, "1.0000", true),
        ("a right knee without links", couple([0.5, 0.0, 0.5, 0.0]), QuasiPeriodic, "drift", true),
        ("links of 2e-4", couple([2e-4; 4]), DoesNotContract, "0.99", true),
        ("links of 0.004", couple([0.004; 4]), DoesNotContract, "0.9", true),
        ("one leg linked too weakly to lock", couple([0.5, 0.0, 0.5, 0.002]), QuasiPeriodic, "drift", true),
        ("set S", thesis(|_| ()), QuasiPeriodic, "drift", true),
        ("set D", GeneratorFile::default_of("thesis-double").unwrap().set, QuasiPeriodic, "drift", true),
        ("set S without product links", thesis(|s| s.product_per_deg_s = [[0.0; 2]; 2]), QuasiPeriodic, "drift", true),
        (
            "set S with a knee that is 3 % slow",
            thesis(|s| s.joints[3].mu_rad_per_s *= 0.97),
            QuasiPeriodic,
            "drift",
            true,
        ),
        (
            "links that pull into phase, and a start in antiphase",
            thesis(|s| {
                s.product_per_deg_s = [[0.0; 2]; 2];
                s.difference_per_s = [[-0.1; 2]; 2];
                let hip = s.joints[0];
                s.joints = s.joints.map(|joint| ThesisJoint { start_phase_deg: joint.start_phase_deg, ..hip });
                s.joints.iter_mut().for_each(|joint| (joint.alpha_per_s, joint.p_s2_per_deg2) = (0.3, 1e-4));
            }),
            DoesNotContract,
            "multiplier",
            true,
        ),
        (
            "links that damp its antiphase away",
            thesis(|s| {
                s.product_per_deg_s = [[0.0; 2]; 2];
                s.difference_per_s = [[-0.3; 2]; 2];
                let hip = s.joints[0];
                s.joints = s.joints.map(|joint| ThesisJoint { start_phase_deg: joint.start_phase_deg, ..hip });
                s.joints.iter_mut().for_each(|joint| joint.alpha_per_s = 1e-4);
            }),
            DoesNotOscillate,
            "",
            false,
        ),
        // It starts with both hips in phase and takes a hundred strides to part them by more than the robot allows.
        (
            "hips that part slowly",
            thesis(|s| {
                s.difference_per_s = [[0.047_147_36; 2], [0.170_557_15; 2]];
                s.product_per_deg_s = [[0.137_596_75, 0.043_310_95]; 2];
                let joint = |p, mu, offset, start| ThesisJoint {
                    alpha_per_s: 1.889_652_1,
                    p_s2_per_deg2: p,
                    mu_rad_per_s: mu,
                    offset_deg: offset,
                    start_phase_deg: start,
                };
                let (hip, knee) = ((2.681_591e-5, 5.711_986_6, 12.0), (5.970_643_5e-5, 5.798_783_4, 32.0));
                s.joints = [(hip, 0.0), (hip, 0.002), (knee, 100.0), (knee, 100.002)]
                    .map(|((p, mu, offset), start)| joint(p, mu, offset, start));
            }),
            BeyondLimits,
            "% of the stride, from 12",
            false,
        ),
        (
            "no amplitudes",
            walk(|s| s.joints.iter_mut().for_each(|j| j.amplitude_deg = 0.0)),
            JointsDoNotMove,
            "left_hip 0.0000, right_hip 0.0000",
            false,
        ),
        ("one knee without amplitude", walk(|s| s.joints[3].amplitude_deg = 0.0), JointsDoNotMove, "right_knee", true),
        ("a shape that stands", shape([(0.0, 5.0, 0.0); 4], 1.1), JointsDoNotMove, "left_hip", false),
        (
            "knees from -40 to 80 degrees",
            walk(|s| {
                for knee in &mut s.joints[2..] {
                    (knee.amplitude_deg, knee.offset_deg) = (57.7, 20.0);
                }
            }),
            BeyondLimits,
            "left_knee -",
            true,
        ),
        (
            "a hip beyond its range",
            shape(with(0, (30.0, 35.0, 0.0)), 1.1),
            BeyondLimits,
            "left_hip 65.0 > 60 degrees at 0 %",
            true,
        ),
        (
            "hips too far apart",
            shape([(40.0, 15.0, 0.0), (40.0, 15.0, 180.0), INSIDE[2], INSIDE[3]], 1.1),
            BeyondLimits,
            "left_hip - right_hip 80.0 > 75 degrees at 0 %",
            false,
        ),
        (
            "both knees bent",
            shape([INSIDE[0], INSIDE[1], (40.0, 60.0, 80.0), (40.0, 60.0, 80.0)], 1.1),
            BeyondLimits,
            "left_knee + right_knee 200.0 > 150",
            false,
        ),
        (
            "a knee behind an extended hip",
            shape([(28.0, 0.0, 0.0), (10.0, 0.0, 180.0), (50.0, 65.0, 180.0), (10.0, 20.0, 0.0)], 2.0),
            BeyondLimits,
            "left_knee - left_hip 143.0 > 125 degrees at 50 %",
            false,
        ),
        (
            "knees of the wrong sign",
            walk(|s| s.joints[2..].iter_mut().for_each(|knee| knee.offset_deg *= -1.0)),
            BeyondLimits,
            "left_knee -",
            false,
        ),
        ("faster than a servo", shape(INSIDE, 0.25), BeyondLimits, "deg/s at", false),
        ("a shape inside all limits", shape(INSIDE, 1.1), Accepted, "", true),
    ]
}

#[test]
fn every_adversarial_file_gets_its_word() {
    let mut wrong = vec![];
    let all = cases();
    assert!(all.len() >= 20);
    for (name, set, status, why, walks) in all {
        let got = certified(&set);
        let because = got.refused_because.clone().unwrap_or_default();
        println!("{name:<42} {:?} walks {}: {because}", got.status, got.drive.in_words());
        let right = got.status == status && got.accepted == (status == Accepted) && because.contains(why);
        if !right || got.drive.walks != walks {
            wrong.push(format!("{name}: {:?}, {because}, walks {}", got.status, got.drive.in_words()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A verdict is one: what does not walk, or what a limit changes, is not accepted, and a reason says so.
#[test]
fn an_accepted_generator_walks_and_no_limit_acts() {
    for (name, set, ..) in cases() {
        let got = certified(&set);
        let because = got.refused_because.clone().unwrap_or_default();
        let has = |status: CertificateStatus| got.reasons.iter().any(|(reason, _)| *reason == status);
        assert_eq!(got.accepted, got.reasons.is_empty(), "{name}");
        assert_eq!(!got.drive.walks, has(CertificateStatus::DoesNotWalk), "{name}: {because}");
        assert!(got.drive.walks || because.contains("it does not walk on the robot: "), "{name}: {because}");
        assert!(!got.accepted || (got.excesses.is_empty() && got.drive.limited_ticks == 0), "{name}: {got:?}");
    }
    // Only the loop knows that it does not walk: the button is held for a shorter time than what arms.
    let mut robot = LoopConfig::default_biped();
    robot.button.hold_least_s = 1.0;
    let got = certify(&walk(|_| ()), 20, &robot, &mut |_| ()).expect("built");
    assert_eq!((got.status, got.accepted), (CertificateStatus::DoesNotWalk, false), "{:?}", got.refused_because);
    assert!(got.refused_because.is_some_and(|why| why.starts_with("it does not walk on the robot: it does not arm")));
}
