//! Corrections of a follower in its file and in its certificate: what is refused, by which words, and what the certificate says of them.

use cpg_core::entrainment::correction::{INPUTS, TERMS};
use cpg_core::entrainment::{Corrections, EventSource};
use generator_file::certificate::{Certificate, CertificateStatus, certify};
use generator_file::file::{
    Coefficients, CorrectionsSet, FollowSet, GeneratorFile, GeneratorSet, Provenance, ShapeJoint, ShapeSet,
};
use generator_file::robot_file::RobotFile;
use joint_loop::LoopConfig;
use joint_units::{Joint, Radians};

/// A follower of a left hip with these gains.
fn follower(corrections: Corrections) -> FollowSet {
    let coefficients = |numbers: &[f32]| Coefficients::new(numbers).expect("1 to 8");
    let joint = |mean_deg, size: f32, lead: f32| {
        let turn = std::f32::consts::TAU * lead;
        ShapeJoint {
            mean_deg,
            cos_deg: coefficients(&[size * turn.cos(), 0.2 * size * (2.0 * turn).cos()]),
            sin_deg: coefficients(&[-size * turn.sin(), -0.2 * size * (2.0 * turn).sin()]),
        }
    };
    let joints = [joint(10.0, 20.0, 0.0), joint(10.0, 20.0, 0.5), joint(24.0, 18.0, 0.25), joint(24.0, 18.0, 0.75)];
    let sensor = Joint::LeftHip;
    let corrections = CorrectionsSet::of(&corrections, sensor);
    FollowSet { sensor, events: EventSource::None, shape: ShapeSet { stride_s: 1.1, joints }, corrections }
}

/// Gains of the two knees: the constant in degrees, and the same gain for each low-passed innovation.
fn gains(constant_deg: f32, innovation: f32) -> Corrections {
    let mut corrections = Corrections { usual_innovation: Radians::from_degrees(1.0), ..Corrections::NONE };
    for joint in [Joint::LeftKnee, Joint::RightKnee] {
        let gains = &mut corrections.gains[joint as usize];
        gains[0][0] = constant_deg.to_radians();
        gains.iter_mut().skip(1).for_each(|gain| gain[0] = innovation);
    }
    corrections
}

fn text(set: FollowSet) -> String {
    GeneratorFile { provenance: Provenance::default(), set: GeneratorSet::Follow(set) }.to_toml()
}

#[test]
fn corrections_make_an_exact_round_trip() {
    let mut all = gains(1.0, 0.5);
    all.gains.as_flattened_mut().as_flattened_mut().iter_mut().zip(1_u16..).for_each(|(gain, n)| {
        *gain = f32::from(n) * 0.013;
    });
    let set = follower(all);
    let read = GeneratorFile::parse("x.toml", &text(set.clone())).expect("a good file");
    assert_eq!(read.set, GeneratorSet::Follow(set));
}

/// Each wrong value of the table is named with its line, its place and what is allowed.
#[test]
fn wrong_corrections_are_refused_by_name_and_line() {
    let good = text(follower(gains(1.0, 0.5)));
    GeneratorFile::parse("x.toml", &good).expect("a good file");
    let table = "[follow.corrections.left_knee]";
    let row = |key: &str| {
        let rest = &good[good.find(table).unwrap()..];
        rest.lines().find(|line| line.starts_with(key)).unwrap().to_owned()
    };
    let (constant, innovation) = (row("constant_deg"), row("innovation"));
    let lists: Vec<&str> =
        innovation.trim_start_matches("innovation = [[").trim_end_matches("]]").split("], [").collect();
    assert_eq!((lists.len(), lists[5].split(", ").count()), (INPUTS - 1, TERMS));
    let with = |lists: &[String]| format!("innovation = [[{}]]", lists.join("], ["));
    let owned = || lists.iter().map(|&list| list.to_owned()).collect::<Vec<_>>();
    let last = |value: &str| {
        let mut lists = owned();
        lists[5] = lists[5].rsplit_once(", ").unwrap().0.to_owned() + ", " + value;
        with(&lists)
    };
    let mut short = owned();
    short[2] = short[2].rsplit_once(", ").unwrap().0.to_owned();
    let key = "field `follow.corrections.left_knee.";
    for (from, to, words) in [
        (&innovation, last("51.0"), format!("{key}innovation[5][10]`: is 51.0; allowed is a number from -50 to 50")),
        (&innovation, last("nan"), format!("{key}innovation[5][10]`: is nan; allowed is a finite number")),
        (&innovation, last("1e40"), format!("{key}innovation[5][10]`: is 1e40; allowed is a finite number")),
        (&innovation, last("\"x\""), format!("{key}innovation[5][10]`: is the text \"x\"")),
        (&innovation, with(&owned()[..5]), "is a list of 5; allowed is a list of 6 lists of 11 numbers".into()),
        (
            &innovation,
            with(&[owned(), owned()].concat()),
            format!("{key}innovation`: is a list of 12; allowed is a list of 6 lists of 11 numbers"),
        ),
        (&innovation, with(&short), "is a list of 10; allowed is a list of 11 numbers".into()),
        (
            &constant,
            constant.replace(" = [", " = [3000.0, "),
            "is a list of 12; allowed is a list of 11 numbers".into(),
        ),
        (&constant, format!("{constant}\nfrequency_deg = [1.0]"), format!("{key}frequency_deg`: unknown field")),
    ] {
        let (before, after) = good.split_at(good.find(table).unwrap());
        let broken = before.to_owned() + &after.replacen(from.as_str(), &to, 1);
        let line = 1
            + before.lines().count()
            + after[..after.find(from.as_str()).unwrap()].matches('\n').count()
            + to.matches('\n').count();
        let error = GeneratorFile::parse("x.toml", &broken).expect_err(&to).to_string();
        assert!(error.contains(&words), "{words}: {error}");
        assert!(error.starts_with(&format!("x.toml:{line}: ")), "line {line}: {error}");
    }
}

/// Gains are for the sensor that they were learned with.
#[test]
fn corrections_for_another_sensor_are_refused() {
    let good = text(follower(gains(1.0, 0.5)));
    let refused = |text: &str| GeneratorFile::parse("x.toml", text).expect_err("refused").to_string();
    let moved = good.replacen("sensor = \"left_hip\"", "sensor = \"right_hip\"", 1);
    let error = refused(&moved);
    let wanted = "field `follow.corrections.sensor`: is the text \"left_hip\"; allowed is \"right_hip\", the `sensor` of the follower";
    assert!(error.contains(wanted) && error.contains("footfall fit --follow right_hip"), "{error}");
    let place = moved.find("[follow.corrections]").unwrap();
    let line = 2 + moved[..place].matches('\n').count();
    assert!(error.starts_with(&format!("x.toml:{line}: ")), "line {line}: {error}");
    // Both changed: a person may know that both hips are alike.
    GeneratorFile::parse("x.toml", &good.replace("sensor = \"left_hip\"", "sensor = \"right_hip\"")).expect("good");
    let error = refused(&good.replacen("[follow.corrections]\nsensor = \"left_hip\"\n", "[follow.corrections]\n", 1));
    assert!(error.contains("field `follow.corrections.sensor`: is missing"), "{error}");
}

fn certificate(corrections: Corrections) -> Certificate {
    let set = GeneratorSet::Follow(follower(corrections));
    certify(&set, 20, &LoopConfig::of(&RobotFile::default_biped().robot), &mut |_| ()).expect("measured")
}

/// The certificate has the size of the corrections at twice the usual innovation, and refuses gains whose corrections are at their bound.
#[test]
fn a_certificate_says_what_corrections_do() {
    let none = certificate(Corrections::NONE);
    assert!(none.accepted && none.corrections.is_none(), "{:?}", none.refused_because);

    let small = certificate(gains(0.5, 0.1));
    let found = small.corrections.clone().expect("corrections");
    assert!(small.accepted && small.refused_as_follower().is_none(), "{:?}", small.refused_because);
    let names: Vec<&str> = found.joints.iter().map(|joint| joint.name).collect();
    assert_eq!(names, ["left_knee", "right_knee"]);
    assert!((found.bound_deg - 14.32).abs() < 0.01 && (1.5..2.6).contains(&found.innovation_deg), "{found:?}");
    for joint in &found.joints {
        // 0.5 degrees, and a tenth of each of six low-passed innovations.
        assert!((0.5..1.5).contains(&joint.rms_deg) && joint.largest_deg < 5.0 && joint.inside_range, "{joint:?}");
        assert_eq!(joint.at_bound, 0.0);
    }

    // A knee that is bent by 9 degrees or more is stretched beyond the end of its range.
    let low = certificate(gains(-13.0, 0.0));
    let joint = low.corrections.clone().expect("corrections").joints[0].clone();
    assert!(!joint.inside_range && joint.least_deg < -2.0 && (11.0..13.0).contains(&joint.rms_deg), "{joint:?}");

    for corrections in [gains(0.0, 50.0), gains(30.0, 0.0)] {
        let large = certificate(corrections);
        assert_eq!((large.status, large.accepted), (CertificateStatus::CorrectionsAtBound, false));
        let because = large.refused_because.unwrap();
        assert!(because.contains("the correction of left_knee is at its bound of 14.3 degrees in "), "{because}");
    }
    // A usual innovation that nobody has: it is measured with what the lock allows.
    let strange = Corrections { usual_innovation: Radians(1.0), ..gains(0.0, 50.0) };
    assert_eq!(certificate(strange).status, CertificateStatus::CorrectionsAtBound);
}
