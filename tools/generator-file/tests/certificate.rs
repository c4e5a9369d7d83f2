//! Certificates of known generators: the numbers of the literature, and the words of those that are not accepted.

use cpg_core::entrainment::EventSource;
use generator_file::certificate::{Certificate, CertificateStatus, certify, certify_subject};
use generator_file::entrainment::STRENGTHS;
use generator_file::file::{Coefficients, FollowSet, GeneratorFile, GeneratorSet, ShapeJoint, ShapeSet};
use generator_file::network_certificate::certify_network;
use generator_file::network_file::NetworkFile;
use generator_file::subject::Subject;
use joint_loop::LoopConfig;
use joint_units::Joint;

fn coefficients(numbers: &[f32]) -> Coefficients {
    Coefficients::new(numbers).expect("1 to 8")
}

fn certificate(set: &GeneratorSet, starts: u32) -> Certificate {
    certify(set, starts, &LoopConfig::default_biped(), &mut |_| ()).expect("built")
}

fn default_set(name: &str) -> GeneratorSet {
    GeneratorFile::default_of(name).expect("a default").set
}

/// The default walk: the numbers that the literature table of R1 at eps = kap = 0.5 gives.
#[test]
fn the_default_walk_is_accepted_and_walks() {
    let got = certificate(&default_set("phase-coupled"), 200);
    assert_eq!((got.status, got.accepted, got.returns.oscillates), (CertificateStatus::Accepted, true, true));
    assert_eq!((got.returns.converged, got.returns.starts, got.returns.diverged), (200, 200, 0));
    assert!(got.returns.kicks == 16 * 16 + 48 && got.returns.kicks_lost.is_empty());
    assert!((got.returns.period_s - 1.1).abs() < 1e-4, "{}", got.returns.period_s);
    assert!((got.returns.multipliers[0] - 0.054).abs() < 0.001, "{:?}", got.returns.multipliers);
    assert_eq!(got.returns.multipliers.len(), 7);
    assert!(
        got.returns.settling_s.is_some_and(|settling| (0.3..2.5).contains(&settling)),
        "{:?}",
        got.returns.settling_s
    );
    assert!(got.joints.iter().all(|joint| joint.inside_gate) && got.excesses.is_empty());
    assert!((got.joints[0].amplitude_deg - 20.8).abs() < 0.2 && (got.joints[3].amplitude_deg - 31.2).abs() < 0.2);
    assert!(got.largest_step_ms >= 10.0);
    assert!(got.drive.walks && got.drive.limited_ticks == 0);
}

/// The table of the page is what the certificates have.
#[test]
fn the_page_has_the_numbers_of_the_certificates() {
    const PAGE: &str = include_str!("../../../docs/generators.md");
    let (walk, thesis) = (certificate(&default_set("phase-coupled"), 1000), certificate(&default_set("thesis"), 20));
    let back = &walk.returns;
    assert_eq!((walk.status, thesis.status), (CertificateStatus::Accepted, CertificateStatus::QuasiPeriodic));
    for row in [
        format!("| motion | periodic, {:.4} s | quasi-periodic |", back.period_s),
        format!("| largest non-trivial Floquet multiplier | {:.3} | no orbit |", back.multipliers[0]),
        format!("| kicks that come back | {} of {} | |", back.kicks - back.kicks_lost.len() as u32, back.kicks),
        format!("| settling after a kick of half an amplitude, the worst | {:.2} s | |", back.settling_s.unwrap()),
        format!("| random starts that arrive | {} of {} | |", back.converged, back.starts),
        format!("| walks | {} | {} |", walk.drive.in_words(), thesis.drive.in_words()),
        "| status | `accepted` | `quasi_periodic` |".into(),
    ] {
        assert!(PAGE.contains(&row), "{row}");
    }
}

/// Largest Floquet multiplier without the trivial one.
#[test]
fn six_and_eight_joints_return_to_their_orbit() {
    let largest = |name: &str| {
        let set = NetworkFile::default_of(name).unwrap().set;
        certify_network(&set, 20, &mut |_| ()).unwrap().returns.multipliers[0]
    };
    assert_eq!(["six-joints", "eight-joints"].map(|name| format!("{:.2}", largest(name))), ["0.18", "0.37"]);
}

/// The thesis' network at Table 1 never repeats: it may run, and it is not accepted.
#[test]
fn the_thesis_network_is_quasi_periodic() {
    for name in ["thesis", "thesis-double"] {
        let got = certificate(&default_set(name), 50);
        assert_eq!((got.status, got.accepted), (CertificateStatus::QuasiPeriodic, false), "{name}");
        assert!(
            got.returns.oscillates
                && got.returns.quasi_periodic
                && got.returns.multipliers.is_empty()
                && got.returns.period_s.is_nan()
        );
        assert!(got.drive.walks, "{:?}", got.drive);
        let because = got.refused_because.unwrap();
        assert_eq!(because, "quasi-periodic: the phases of its joints drift");
    }
}

/// The only state is a phase: there is nothing to kick, and it follows any stride in its range.
#[test]
fn a_shape_is_accepted_and_reports_its_input() {
    let joint = ShapeJoint { mean_deg: 20.0, cos_deg: coefficients(&[20.0]), sin_deg: coefficients(&[0.0]) };
    let joints = std::array::from_fn(|_| joint.clone());
    let got = certificate(&GeneratorSet::Shape(ShapeSet { stride_s: 1.1, joints }), 10);
    assert!(got.accepted && (got.returns.starts, got.returns.kicks) == (0, 0) && got.entrainment.is_empty(), "{got:?}");
    assert_eq!(got.following, None);
    assert_eq!(got.entrainment_hz, Some([0.05, 5.0]));
    assert!(got.entrainment_by.contains("0.050 to 5.000 Hz"), "{}", got.entrainment_by);
}

/// A follower is measured while it follows its own person; one that does not lock is refused.
#[test]
fn a_follower_is_certified_on_its_person() {
    let set = |cos_deg: Vec<f32>| {
        let sin_deg = coefficients(&vec![0.0; cos_deg.len()]);
        let joint = ShapeJoint { mean_deg: 26.0, sin_deg, cos_deg: coefficients(&cos_deg) };
        let shape = ShapeSet { stride_s: 1.1, joints: std::array::from_fn(|_| joint.clone()) };
        GeneratorSet::Follow(FollowSet { sensor: Joint::LeftHip, events: EventSource::None, shape, corrections: None })
    };
    let got = certificate(&set(vec![20.0, -4.0]), 10);
    let found = got.following.clone().expect("a follower");
    assert!(got.accepted && found.late == 0 && got.entrainment_by.contains("sensor on left_hip"), "{got:?}");
    assert_eq!(got.entrainment_hz, found.lock_range.map(|range| range.map(|ratio| ratio / got.returns.period_s)));
    assert!((got.joints[0].amplitude_deg - 20.0).abs() < 0.5, "{:?}", got.joints);
    assert!((1.0..=4.2).contains(&got.largest_step_ms), "{} ms", got.largest_step_ms);
    let got = certificate(&set(vec![1.0, 20.0]), 10);
    assert_eq!((got.status, got.accepted), (CertificateStatus::DoesNotLock, false));
    let because = got.refused_because.unwrap();
    assert!(because.starts_with("it does not lock on its person from every start: "), "{because}");
}

/// Settling at its worst phase, for short and for long strides: in strides it is the same.
#[test]
fn settling_scales_with_the_stride() {
    let settling = |period_s: f32| {
        let GeneratorSet::PhaseCoupled(mut set) = default_set("phase-coupled") else { panic!("R1") };
        set.natural_period_s *= period_s / 1.1;
        let got = certificate(&GeneratorSet::PhaseCoupled(set), 20);
        assert!(
            (got.returns.period_s / f64::from(period_s) - 1.0).abs() < 1e-3,
            "{period_s}: {}",
            got.returns.period_s
        );
        assert!(got.returns.kicks_lost.is_empty() && got.returns.converged == 20, "{period_s}");
        got.returns.settling_s.expect("it settles") / got.returns.period_s
    };
    let known = settling(1.1);
    for period_s in [0.2, 0.315, 0.33, 3.0] {
        let got = settling(period_s);
        assert!((got - known).abs() < 0.06, "{period_s}: {got} strides, {known}");
    }
}

/// The stronger the link, the wider the range, at both ends; it begins at the generator's own frequency.
#[test]
fn the_range_of_the_default_walk_is_a_tongue() {
    let got = certificate(&default_set("phase-coupled"), 1);
    assert_eq!(got.entrainment.len(), STRENGTHS.len());
    let mut inner = [1.0, 1.0];
    for (tongue, strength) in got.entrainment.iter().zip(STRENGTHS) {
        let (low, high) = (tongue.low.unwrap(), tongue.high.unwrap());
        assert!(tongue.strength == strength && low < inner[0] - 0.003 && high > inner[1] + 0.003, "{tongue:?}");
        assert!((tongue.low_hz.unwrap() * got.returns.period_s - low).abs() < 1e-9);
        inner = [low, high];
    }
    assert_eq!(got.entrainment_hz, got.entrainment.last().unwrap().range_hz());
}

/// Without links between the joints a master moves the first one alone: no frequency locks all of them.
#[test]
fn a_master_has_to_lock_every_joint() {
    let GeneratorSet::PhaseCoupled(mut set) = default_set("phase-coupled") else { panic!("R1") };
    set.coupling = [0.0; 4];
    let got = certificate(&GeneratorSet::PhaseCoupled(set), 1);
    let off =
        got.entrainment.iter().all(|tongue| tongue.low.unwrap_or(1.0) > 0.999 && tongue.high.unwrap_or(1.0) < 1.001);
    assert!(off && got.entrainment.len() == STRENGTHS.len(), "{:?}", got.entrainment);
}

/// Every name gives a certificate. Those that are not accepted have the word that their equations give them: the gallops, the skip and
/// the four neurons have other stable motions beside their own.
#[test]
fn every_default_gait_and_model_is_certified() {
    let refused = [
        ("thesis", CertificateStatus::QuasiPeriodic),
        ("thesis-double", CertificateStatus::QuasiPeriodic),
        ("gallop-walk", CertificateStatus::KicksDoNotReturn),
        ("gallop-run", CertificateStatus::KicksDoNotReturn),
        ("skip", CertificateStatus::KicksDoNotReturn),
        ("van-der-pol", CertificateStatus::BeyondLimits),
        ("adaptive-hopf", CertificateStatus::DoesNotContract),
        ("matsuoka", CertificateStatus::KicksDoNotReturn),
        ("fitzhugh-nagumo", CertificateStatus::BeyondLimits),
        ("morris-lecar", CertificateStatus::BeyondLimits),
        ("terman-wang", CertificateStatus::BeyondLimits),
        ("human-run-unscaled", CertificateStatus::BeyondLimits),
    ];
    let names = Subject::names();
    assert_eq!(names.len(), 30);
    for (name, _) in names {
        let subject = Subject::named(name).expect(name);
        let got = certify_subject(&subject, 40, &LoopConfig::default_biped(), &mut |_| ()).expect(name);
        println!(
            "{name:<18} {:?} {:.4} s, multiplier {:?}, {} of {}, kicks lost {} of {}, settling {:?}, walks {}; {:?}",
            got.status,
            got.returns.period_s,
            got.returns.multipliers.first(),
            got.returns.converged,
            got.returns.starts,
            got.returns.kicks_lost.len(),
            got.returns.kicks,
            got.returns.settling_s,
            got.drive.in_words(),
            got.refused_because,
        );
        let word = refused.iter().find(|entry| entry.0 == name).map_or(CertificateStatus::Accepted, |entry| entry.1);
        assert_eq!(got.status, word, "{name}");
        assert!(got.drive.walks, "{name}");
    }
}
