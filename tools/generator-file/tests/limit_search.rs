//! A search for generators that a certificate accepts and that a limit of the robot changes or stops.
//!
//! Random sets are judged by two programs that share nothing with the certificate's measurement: an integrator of the printed equations in f64, whose
//! angles, poses, rates and accelerations are compared with the limits, and the control loop of the board, armed right after the boot and once more at
//! a random time of the first minute, over 120 s of model time. A set with which either finds something must be refused.
//!
//! `cargo test -p generator-file --test limit_search -- --ignored --nocapture` judges `SETS` sets (10,000) from the seed `FIRST` (1,000) on.

#[path = "support/brute_force.rs"]
#[allow(dead_code)]
mod brute_force;

use brute_force::{Equations, Random, State};
use generator_file::certificate::{CertificateStatus, certify};
use generator_file::file::{GeneratorSet, PhaseCoupledJoint, PhaseCoupledSet, ThesisJoint, ThesisSet};
use generator_file::limits::excesses;
use generator_file::subject::Subject;
use joint_loop::{LoopConfig, Sample, SupervisorState};
use joint_units::Period;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Model time of both programs, s.
const SECONDS: f64 = 120.0;
/// Random starts of a full certificate: few, since the limits are what is searched.
const STARTS: u32 = 20;
/// How far the integrator in f64 must be beyond a limit to count: the certificate measures in f32.
const SURELY: Limits = Limits { angle_deg: 0.05, part: 0.01 };

/// How far it must be beyond a limit, whatever the rounding, to be seen by the certificate too.
const GRAZES: Limits = Limits { angle_deg: 0.5, part: 0.05 };
/// How much later than the integrator the certificate may find a limit exceeded, s.
const SAME_S: f64 = 2.0;
/// Change of a start, as a part, that is like the rounding of the certificate, which is in f32.
const ROUNDED: f64 = 1e-6;
/// Sets after which the counts are printed.
const AT_A_TIME: u64 = 250;
/// Starts that are changed by it.
const CHANGED: u32 = 6;

struct Limits {
    /// Of an angle or a pose, degrees.
    angle_deg: f64,
    /// Of a rate or an acceleration, as a part.
    part: f64,
}

/// The thesis' network with the size of a robot's motion: legs alike or not, links of either sign, damping that is often weak, and a start that is in
/// phase but for a little, in antiphase or anywhere.
fn thesis(random: &mut Random) -> ThesisSet {
    loop {
        let mu = TAU / random.log(0.6, 2.0);
        let alike = random.next() < 0.6;
        let alpha: [f64; 2] = std::array::from_fn(|_| mu * random.log(0.02, 1.0));
        let gains: [f64; 2] = std::array::from_fn(|_| {
            let size = mu * random.log(0.005, 0.5);
            if random.next() < -0.4 { -size } else { size }
        });
        let products: [f64; 2] = std::array::from_fn(|_| {
            if random.next() < -0.5 { 0.0 } else { random.next().signum() * random.log(1e-3, 0.3) }
        });
        let knee_mu = if random.next() < -0.5 { 2.0 * mu } else { mu };
        // Hips of 10 to 40 degrees about 0 to 15, knees of 10 to 60 about 20 to 60.
        let size = [random.from(10.0, 40.0), random.from(10.0, 60.0)];
        let offset = [random.from(0.0, 15.0), random.from(20.0, 60.0)];
        let apart = match (2.0 * (random.next() + 1.0)) as u32 {
            0 | 1 => random.log(1e-5, 10.0),
            2 => 180.0,
            _ => random.from(-180.0, 180.0),
        };
        let knee_lead = random.from(-180.0, 180.0);
        let joints = std::array::from_fn(|joint| {
            let kind = joint / 2;
            let (alpha, k) = (alpha[kind], gains[kind].max(0.0));
            let mu = [mu, knee_mu][kind] * if alike { 1.0 } else { 1.0 + 0.03 * random.next() };
            let p = 4.0 * (alpha + 2.0 * k) / (3.0 * alpha * (mu * size[kind]).powi(2));
            ThesisJoint {
                alpha_per_s: alpha as f32,
                p_s2_per_deg2: p as f32,
                mu_rad_per_s: mu as f32,
                offset_deg: offset[kind] as f32,
                start_phase_deg: ([0.0, knee_lead][kind] + if joint % 2 == 1 { apart } else { 0.0 }) as f32,
            }
        });
        let set = ThesisSet {
            difference_per_s: gains.map(|k| [k as f32; 2]),
            product_per_deg_s: [[products[0] as f32, products[1] as f32]; 2],
            joints,
        };
        if GeneratorSet::Thesis(set).check().is_ok() {
            return set;
        }
    }
}

/// R1 with the size of a robot's motion.
fn phase_coupled(random: &mut Random) -> PhaseCoupledSet {
    let same = random.next() < 0.0;
    let first = random.log(0.01, 2.0) as f32;
    let coupling = std::array::from_fn(|_| if same { first } else { random.log(0.01, 2.0) as f32 });
    let is_walk = random.next() < 0.5;
    let size = [random.from(10.0, 38.0), random.from(10.0, 60.0)];
    let offset = [random.from(0.0, 15.0), random.from(20.0, 60.0)];
    let walk = [0.0, 180.0, 80.0, -100.0];
    PhaseCoupledSet {
        natural_period_s: random.log(0.3, 3.0) as f32,
        nonlinearity: random.log(0.02, 2.0) as f32,
        coupling,
        joints: std::array::from_fn(|joint| PhaseCoupledJoint {
            amplitude_deg: size[joint / 2] as f32,
            offset_deg: offset[joint / 2] as f32,
            phase_deg: if is_walk { walk[joint] } else { random.from(-180.0, 180.0) as f32 },
        }),
    }
}

/// A set, its equations with their start, and amplitude and offset of each joint, degrees.
struct Drawn {
    set: GeneratorSet,
    equations: Equations,
    start: State,
    joints: [(f64, f64); 4],
}

fn drawn(seed: u64) -> Drawn {
    let mut random = Random(0x11_4175 + 7919 * seed);
    // Two of three are the thesis' network, whose way to its orbit is the longer one.
    if seed.is_multiple_of(3) {
        let set = phase_coupled(&mut random);
        let (equations, start) = Equations::phase_coupled(&set);
        let joints = set.joints.map(|joint| (f64::from(joint.amplitude_deg), f64::from(joint.offset_deg)));
        Drawn { set: GeneratorSet::PhaseCoupled(set), equations, start, joints }
    } else {
        let set = thesis(&mut random);
        let (equations, start) = Equations::thesis(&set);
        let joints = set.joints.map(|joint| (1.0, f64::from(joint.offset_deg)));
        Drawn { set: GeneratorSet::Thesis(set), equations, start, joints }
    }
}

/// The second derivative of a displacement, from the slope of all states.
fn curvature(equations: &Equations, slope: &State, joint: usize) -> f64 {
    match equations {
        // The velocity is that of the displacement by w.
        Equations::PhaseCoupled { w, .. } => w * slope[joint + 4],
        Equations::Thesis { .. } => slope[joint + 4],
    }
}

/// The first limit of the default robot that the motion is surely beyond, and when; the limits are those of its page, in degrees.
fn integrated(drawn: &Drawn, start: State, surely: &Limits) -> Option<Found> {
    let beyond = |value: f64, most: f64| value > most + surely.angle_deg;
    let mut s = start;
    for tick in 1..=(SECONDS * 1e3) as u32 {
        drawn.equations.run(&mut s, 1e-3, 1);
        let d = drawn.equations.slope(&s);
        let angle: [f64; 4] = std::array::from_fn(|j| drawn.joints[j].1 + drawn.joints[j].0 * s[j]);
        let rate: [f64; 4] = std::array::from_fn(|j| drawn.joints[j].0 * d[j]);
        let acceleration: [f64; 4] = std::array::from_fn(|j| drawn.joints[j].0 * curvature(&drawn.equations, &d, j));
        let range = |j: usize| if j < 2 { (-30.0, 60.0) } else { (-2.0, 120.0) };
        let joint = (0..4).find(|&j| beyond(angle[j], range(j).1) || beyond(-angle[j], -range(j).0));
        let fast = (0..4).find(|&j| {
            rate[j].abs() > 500.0 * (1.0 + surely.part) || acceleration[j].abs() > 20_000.0 * (1.0 + surely.part)
        });
        let poses = [
            (angle[2] + angle[3], 150.0),
            ((angle[0] - angle[1]).abs(), 75.0),
            (angle[2] - angle[0], 125.0),
            (angle[3] - angle[1], 125.0),
        ];
        let pose = poses.iter().position(|&(value, most)| beyond(value, most));
        if joint.or(fast).or(pose).is_some() {
            return Some(Found {
                seconds: f64::from(tick) * 1e-3,
                stops: false,
                what: format!("joint {joint:?}, fast {fast:?}, pose {pose:?}: {angle:.2?}"),
            });
        }
    }
    None
}

/// What a limit does to the setpoints of the board's loop, or how it stops. It is armed after so many ticks.
fn looped(set: &GeneratorSet, armed: u32) -> Option<Found> {
    let mut config = LoopConfig::default_biped();
    config.monitor.sensor_required = false;
    let generator = set.build(Period::MILLISECOND).expect("checked");
    let mut board = config.build(Period::MILLISECOND, generator, []).expect("built");
    let (mut walked, mut limited) = (false, None);
    for tick in 0..(SECONDS * 1e3) as u32 {
        let button = (armed..armed + 400).contains(&tick);
        board.tick(&Sample { button, ..Sample::default() });
        let walks = board.state() == SupervisorState::Walking;
        // The ramp ends in the pose of the generator.
        walked |= walks;
        let frame = board.frame();
        let found = |stops| Found {
            seconds: f64::from(tick) * 1e-3,
            stops,
            what: format!("armed at {armed}: {:?}, cause {:?}", frame.state, frame.cause),
        };
        if walked && !walks {
            return Some(found(true));
        }
        if walked && frame.limited.any() && limited.is_none() {
            limited = Some(found(false));
        }
    }
    let never = || Found { seconds: SECONDS, stops: true, what: format!("armed at {armed}: {:?}", board.cause()) };
    limited.or_else(|| (!walked).then(never))
}

/// What a judge found.
#[derive(Debug)]
struct Found {
    /// When, after the start.
    seconds: f64,
    /// The board stops.
    stops: bool,
    what: String,
}

#[derive(Debug, Default)]
struct Counts {
    sets: u64,
    /// With which the integrator or the loop finds something.
    noticed: u64,
    /// With which the integrator finds something that its own rounding decides: the board, which is in f32, need not have it.
    border: u64,
    /// Of those that are noticed, that the certificate refuses for a limit.
    refused: u64,
    /// Of these, in which only the way to the orbit exceeds a limit.
    on_the_way: u64,
    /// That the certificate accepts.
    accepted: u64,
    false_acceptances: Vec<String>,
}

/// Judges one set.
fn judged(seed: u64) -> Counts {
    let drawn = drawn(seed);
    let robot = LoopConfig::default_biped();
    let mut random = Random(seed ^ 0xa4_44ed);
    let later = random.from(100.0, 60_000.0) as u32;
    let beyond = excesses(&Subject::Set(drawn.set.clone()), &robot.gate).expect("built");
    let first_s = beyond.iter().map(|excess| excess.first_s).fold(f64::INFINITY, f64::min);
    let only_way = !beyond.is_empty() && beyond.iter().all(|excess| !excess.on_orbit);
    let mut by_integral = integrated(&drawn, drawn.start, &SURELY);
    let is_late = |found: &Found| first_s > found.seconds + SAME_S;
    let mut border = 0;
    if by_integral.as_ref().is_some_and(is_late) {
        // An escape from a motion that repels: rounding decides when, and by a little how far it goes.
        let mut changed = || drawn.start.map(|x| x + ROUNDED * random.next() * x.abs().max(1e-3));
        let again: Vec<Option<Found>> = (0..CHANGED).map(|_| integrated(&drawn, changed(), &GRAZES)).collect();
        let surely = again.iter().flatten().all(is_late) && again.iter().all(Option::is_some);
        assert!(
            !surely || beyond.is_empty(),
            "{seed}: {by_integral:?}, {again:?}; certificate {first_s} s, {beyond:?}"
        );
        if !surely {
            (by_integral, border) = (None, 1);
        }
    }
    let boot = looped(&drawn.set, 100);
    let stops = boot.as_ref().is_some_and(|found| found.stops);
    let found = by_integral.or(boot).or_else(|| looped(&drawn.set, later));
    let mut counts = Counts { sets: 1, noticed: u64::from(found.is_some()), border, ..Counts::default() };
    counts.on_the_way = u64::from(only_way);
    // A full certificate where the limits do not decide, where only the way exceeds one, and of one in twenty of the others.
    if !beyond.is_empty() && !only_way && !seed.is_multiple_of(20) {
        counts.refused = u64::from(found.is_some());
        return counts;
    }
    let certificate = certify(&drawn.set, STARTS, &robot, &mut |_| ()).expect("built");
    counts.accepted = u64::from(certificate.accepted);
    if only_way {
        println!("{seed}: {}; walks {}", beyond[0], certificate.drive.in_words());
    }
    let has = |status: CertificateStatus| certificate.reasons.iter().any(|(reason, _)| *reason == status);
    let oscillates = certificate.status != CertificateStatus::DoesNotOscillate;
    assert!(beyond.is_empty() || !oscillates || has(CertificateStatus::BeyondLimits), "{seed}: {certificate:?}");
    assert!(!certificate.accepted || certificate.drive.limited_ticks == 0, "{seed}: {certificate:?}");
    assert_eq!(has(CertificateStatus::DoesNotWalk), !certificate.drive.walks, "{seed}: {certificate:?}");
    assert!(!stops || !certificate.drive.walks, "{seed}: {found:?}; {certificate:?}");
    if let Some(found) = found {
        counts.refused = u64::from(!certificate.accepted);
        if certificate.accepted {
            counts.false_acceptances.push(format!(
                "{seed}: {} at {:.3} s; {}",
                found.what,
                found.seconds,
                certificate.drive.in_words()
            ));
        }
    }
    counts
}

fn search(first: u64, sets: u64) -> Counts {
    let sum = |mut a: Counts, mut b: Counts| {
        a.false_acceptances.append(&mut b.false_acceptances);
        Counts {
            sets: a.sets + b.sets,
            noticed: a.noticed + b.noticed,
            border: a.border + b.border,
            refused: a.refused + b.refused,
            on_the_way: a.on_the_way + b.on_the_way,
            accepted: a.accepted + b.accepted,
            ..a
        }
    };
    let mut counts = Counts::default();
    for from in (first..first + sets).step_by(AT_A_TIME as usize) {
        let these = from..(from + AT_A_TIME).min(first + sets);
        counts = sum(counts, these.into_par_iter().map(judged).reduce(Counts::default, sum));
        println!("{counts:?}");
    }
    counts
}

#[test]
fn no_set_that_a_limit_changes_is_accepted() {
    let counts = search(0, 60);
    assert!(counts.false_acceptances.is_empty(), "{counts:#?}");
    assert!(counts.accepted >= 2 && counts.noticed >= 10 && counts.on_the_way >= 2, "{counts:#?}");
}

#[test]
#[ignore = "takes minutes; run with --ignored"]
fn a_long_search_finds_no_set_that_a_limit_changes_and_is_accepted() {
    let of = |name: &str, otherwise: u64| std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(otherwise);
    let counts = search(of("FIRST", 1_000), of("SETS", 10_000));
    assert!(counts.false_acceptances.is_empty(), "{counts:#?}");
}
