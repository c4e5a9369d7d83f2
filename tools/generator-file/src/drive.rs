//! Whether a generator walks on a robot: it is run through the control loop of `joint-loop` on the host, limits and monitor included.
//!
//! The button arms it at each of [`STARTS`] phases of its stride. The first time is right after the boot: it walks the whole way from its own start
//! to its orbit, and 20 strides of it. The others are after its transients. It walks if, each time, the loop gets to its walking state and stays there, without fault or stop, at least one joint moves, and the limits leave each joint at
//! least half of its motion. A limit that acts is counted, and the difference that it makes is the error as driven.

use cpg_core::Generator;
use joint_loop::motion::feedback::FeedbackConfig;
use joint_loop::{Cause, JointLoop, LoopConfig, Sample, SupervisorState};
use joint_units::{Joint, Period};
use serde::Serialize;

use crate::file::GeneratorSet;
use crate::led::Led;
use crate::limits::{Excess, Limit, SETTLE_STRIDES, STILL_DEG, Way, measure};
use crate::subject::Subject;

/// Phases at which it is armed.
pub const STARTS: u32 = 4;
/// Least walking time of each start but the first, in strides and in seconds.
const WALKED: (f64, f64) = (20.0, 20.0);
/// Most ticks of each start but the first.
const MOST_TICKS: f64 = 300_000.0;
/// Ticks from the boot to the first hold of the button, and of the hold.
const BOOT: u32 = 100;
const HOLD: u32 = 400;
/// Ticks within which a ramp ends; it takes 2 s.
const RAMP: u32 = 5_000;
/// Most ticks before an arming, for slow generators.
const MOST_SETTLE_TICKS: f64 = 2e6;
/// Strides that are kept.
const KEPT: f64 = 3.2;
/// Largest part of a joint's motion that limits may take: RMS difference of setpoint and generator by the RMS of the generator's angle about its
/// mean. A runner's knee whose rate is limited loses 0.1; a knee of the wrong sign, which stays at an end of its range, loses 1 and more.
const MOST_LOST: f64 = 0.5;
/// A smaller difference is never too large, degrees RMS: a joint that hardly moves has nothing to lose.
const LITTLE_DEG: f64 = 1.0;

/// How a generator does on a robot.
#[derive(Debug, Clone, Serialize)]
pub struct Drive {
    /// Whether it walks.
    pub walks: bool,
    /// Why not.
    pub why_not: Option<String>,
    /// Ticks that it walked, over all starts.
    pub ticks: u32,
    /// Those in which a limit acted.
    pub limited_ticks: u32,
    /// The first of these, seconds after the arming; none if no limit acted.
    pub first_limited_s: Option<f64>,
    /// Root mean square difference of setpoint and generator while it walked, degrees, in the order of the joints.
    pub lost_deg: [f64; Joint::COUNT],
    /// The last strides: cycles of the generator's phase, and setpoints in degrees. Empty if it does not walk.
    #[serde(skip)]
    pub strides: Vec<(f64, [f64; Joint::COUNT])>,
}

impl Drive {
    /// The result in words, without the error as driven: `yes`, or `no:` and the reason.
    #[must_use]
    pub fn in_words(&self) -> String {
        match &self.why_not {
            Some(why) => format!("no: {why}"),
            None if self.limited_ticks == 0 => "yes, no limit acts".into(),
            None => format!("yes; limits act in {} of {} ticks", self.limited_ticks, self.ticks),
        }
    }
}

/// Runs the set of a generator file through the loop of a robot.
///
/// # Errors
/// It cannot be built; the text says why.
pub fn walks(set: &GeneratorSet, robot: &LoopConfig) -> Result<Drive, String> {
    let subject = Subject::Set(set.clone());
    drive(&subject, robot, &measure(&subject, &robot.gate)?.excesses)
}

/// Runs a generator through the loop of a robot. `excesses` are the limits that its motion exceeds, to name the one that stops it.
pub(crate) fn drive(subject: &Subject, config: &LoopConfig, excesses: &[Excess]) -> Result<Drive, String> {
    let stride = subject.stride_guess_s() * 1e3;
    let walked = (WALKED.0 * stride).max(WALKED.1 * 1e3).min(MOST_TICKS) as u32;
    let whole_way = walked.max(Way::of(subject)?.ticks());
    let kept = (KEPT * stride).min(MOST_TICKS) as usize;
    let mut all = Drive {
        walks: true,
        why_not: None,
        ticks: 0,
        limited_ticks: 0,
        first_limited_s: None,
        lost_deg: [0.0; Joint::COUNT],
        strides: vec![],
    };
    let mut squares = [0.0f64; Joint::COUNT];
    let mut motions = [Motion::default(); Joint::COUNT];
    let mut unarmed = Unarmed::boot(subject, config)?;
    for start in 0..STARTS {
        // The first start is that of a board that has just booted; the others begin on the motion that is left after all transients.
        let walked = if start == 0 { whole_way } else { walked };
        let settled = if start == 0 { 0.0 } else { SETTLE_STRIDES * stride };
        let phase = f64::from(start) / f64::from(STARTS) * stride;
        let mut joints = unarmed.after(BOOT + (settled + phase).min(MOST_SETTLE_TICKS) as u32);
        // Ticks since the arming.
        let mut armed = None;
        for tick in 0..HOLD + RAMP {
            joints.tick(&Sample { button: tick < HOLD, ..Sample::default() });
            let is_arming = joints.state() == SupervisorState::Arming;
            armed = armed.or(is_arming.then_some(0)).map(|ticks| ticks + 1);
            // It walks, or the ramp was stopped.
            if armed.is_some() && !is_arming {
                break;
            }
        }
        let Some(armed) = armed else {
            all.walks = false;
            all.why_not = Some(format!("it does not arm, cause {}", joints.frame().cause.name()));
            break;
        };
        all.strides.clear();
        let (mut cycles, mut before) = (0.0, joints.generator().phase());
        for tick in 0..walked {
            if joints.state() != SupervisorState::Walking {
                let after_s = f64::from(armed + tick) * 1e-3;
                all.walks = false;
                all.why_not = Some(why_not(joints.frame().cause, after_s, excesses));
                break;
            }
            joints.tick(&Sample::default());
            let frame = joints.frame();
            let now = joints.generator().phase();
            cycles += f64::from(now.counts_after(before)) / 4_294_967_296.0;
            before = now;
            let set = frame.setpoints.map(|angle| f64::from(angle.0).to_degrees());
            let wanted = joints.generator().angles().map(|angle| f64::from(angle.0).to_degrees());
            for (((square, motion), set), wanted) in squares.iter_mut().zip(&mut motions).zip(set).zip(wanted) {
                *square += (set - wanted).powi(2);
                motion.add(wanted);
            }
            all.ticks += 1;
            if frame.limited.any() {
                all.limited_ticks += 1;
                all.first_limited_s.get_or_insert(f64::from(armed + tick + 1) * 1e-3);
            }
            if tick as usize + kept >= walked as usize {
                all.strides.push((cycles, set));
            }
        }
        if !all.walks {
            break;
        }
    }
    let ticks = f64::from(all.ticks.max(1));
    all.lost_deg = squares.map(|square| (square / ticks).sqrt());
    if all.walks {
        let motions = motions.map(|motion| motion.rms(ticks));
        all.why_not = nothing_moves(motions).or_else(|| too_much_lost(all.lost_deg, motions));
        all.walks = all.why_not.is_none();
    }
    if !all.walks {
        all.strides.clear();
    }
    Ok(all)
}

/// A loop that is not armed. The starts begin at later and later ticks of it, so that their transients are simulated once.
struct Unarmed {
    joints: JointLoop<Led, 0>,
    /// Since the boot.
    ticks: u32,
}

impl Unarmed {
    fn boot(subject: &Subject, config: &LoopConfig) -> Result<Self, String> {
        let mut config = *config;
        config.monitor.sensor_required = false;
        // Without a body there is no angle of a joint to feed back.
        config.feedback = FeedbackConfig::NONE;
        let led = subject.led(Period::MILLISECOND)?;
        let joints = config.build(Period::MILLISECOND, led, []).map_err(|error| error.to_string())?;
        Ok(Self { joints, ticks: 0 })
    }

    /// The loop so many ticks after the boot, not fewer than were asked for before.
    fn after(&mut self, ticks: u32) -> JointLoop<Led, 0> {
        while self.ticks < ticks {
            self.joints.tick(&Sample::default());
            self.ticks += 1;
        }
        self.joints.clone()
    }
}

/// Words, if each joint stands; the argument is the root mean square of each motion, degrees.
fn nothing_moves(motions: [f64; Joint::COUNT]) -> Option<String> {
    let still = STILL_DEG * std::f64::consts::FRAC_1_SQRT_2;
    motions.iter().all(|motion| *motion < still).then(|| "no joint moves".into())
}

/// Sums over the angles of one joint, degrees.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    sum: f64,
    squares: f64,
}

impl Motion {
    fn add(&mut self, angle: f64) {
        self.sum += angle;
        self.squares += angle * angle;
    }

    /// Root mean square about the mean of so many angles.
    fn rms(self, count: f64) -> f64 {
        (self.squares / count - (self.sum / count).powi(2)).max(0.0).sqrt()
    }
}

/// The joint that loses the largest part of its motion to the limits, if that is too large.
fn too_much_lost(lost: [f64; Joint::COUNT], motion: [f64; Joint::COUNT]) -> Option<String> {
    let joints = Joint::ALL.into_iter().zip(lost.into_iter().zip(motion));
    let beyond = joints.filter(|(_, (lost, motion))| *lost > LITTLE_DEG && *lost > MOST_LOST * motion);
    let (joint, (lost, motion)) = beyond.max_by(|(_, a), (_, b)| (a.0 / a.1).total_cmp(&(b.0 / b.1)))?;
    Some(format!(
        "limits take {lost:.1} degrees RMS from {}, which moves {motion:.1} degrees RMS: allowed is half of that",
        joint.name()
    ))
}

fn why_not(cause: Cause, after_s: f64, excesses: &[Excess]) -> String {
    let pose = excesses.iter().filter(|excess| excess.limit == Limit::Pose);
    let furthest = pose.max_by(|a, b| (a.value - a.allowed).total_cmp(&(b.value - b.allowed)));
    match (cause, furthest) {
        (Cause::Pose, Some(excess)) => format!("it stops {after_s:.1} s after arming, cause pose: {excess}"),
        _ => format!("it stops {after_s:.1} s after arming, cause {}", cause.name()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{Coefficients, FollowSet, GeneratorFile, ShapeJoint, ShapeSet};
    use cpg_core::entrainment::EventSource;
    use proptest::prelude::*;

    fn driven(set: &GeneratorSet) -> Drive {
        walks(set, &LoopConfig::default_biped()).unwrap()
    }

    fn default_walk() -> crate::file::PhaseCoupledSet {
        let GeneratorSet::PhaseCoupled(set) = GeneratorFile::default_of("phase-coupled").unwrap().set else {
            panic!("R1")
        };
        set
    }

    /// Every subject that has a name, and a follower.
    fn subjects() -> Vec<Subject> {
        let series = |numbers: [f32; 2]| Coefficients::new(&numbers).expect("1 to 8");
        let joint = |size| ShapeJoint { mean_deg: 10.0, cos_deg: series([size, 3.0]), sin_deg: series([0.0, 2.0]) };
        let shape = ShapeSet { stride_s: 1.1, joints: [20.0, -20.0, 10.0, -10.0].map(joint) };
        let follower = FollowSet { sensor: Joint::LeftHip, events: EventSource::None, shape, corrections: None };
        let named = Subject::names().into_iter().filter_map(|(name, _)| Subject::named(name));
        named.chain([Subject::Set(GeneratorSet::Follow(follower))]).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// A start that takes over the ticks of the starts before it goes on as one from its own boot, tick by tick.
        #[test]
        fn a_start_goes_on_as_one_from_its_own_boot(
            which in 0..subjects().len(), first in 0u32..3000, more in 0u32..3000, walked in 0usize..1500,
        ) {
            let subject = &subjects()[which];
            let boot = || Unarmed::boot(subject, &LoopConfig::default_biped()).unwrap();
            let mut shared = boot();
            let mut before = shared.after(first);
            for _ in 0..HOLD {
                before.tick(&Sample { button: true, ..Sample::default() });
            }
            let (mut got, mut want) = (shared.after(first + more), boot());
            for _ in 0..first + more {
                want.joints.tick(&Sample::default());
            }
            for tick in 0..HOLD as usize + walked {
                let sample = Sample { button: tick < HOLD as usize, ..Sample::default() };
                got.tick(&sample);
                want.joints.tick(&sample);
                prop_assert_eq!(got.frame(), want.joints.frame(), "{} at {}", subject.kind(), tick);
                prop_assert_eq!(got.generator().phase(), want.joints.generator().phase());
                prop_assert_eq!(got.generator().angles(), want.joints.generator().angles());
            }
        }
    }

    /// The default walk: the setpoints are the generator's angles in every tick.
    #[test]
    fn the_default_walk_walks_without_a_limit() {
        let got = driven(&GeneratorSet::PhaseCoupled(default_walk()));
        assert!(got.walks && got.limited_ticks == 0 && got.lost_deg == [0.0; 4], "{got:?}");
        assert!(got.ticks > 4 * 20_000, "{got:?}");
        let cycles = got.strides[got.strides.len() - 1].0 - got.strides[0].0;
        assert!((3.0..3.4).contains(&cycles), "{cycles}");
    }

    #[test]
    fn feedback_of_the_robot_is_left_out() {
        let mut robot = LoopConfig::default_biped();
        robot.feedback.share = [0.0, 0.0, 0.3, 0.3];
        let set = GeneratorSet::PhaseCoupled(default_walk());
        let [with, without] = [robot, LoopConfig::default_biped()].map(|robot| format!("{:?}", walks(&set, &robot)));
        assert_eq!(with, without);
        assert!(with.contains("walks: true"), "{with}");
    }

    /// Hips 45 degrees each way: 90 degrees apart, where 75 are allowed. A knee that is 3 degrees too far is limited, and walks.
    #[test]
    fn a_pose_stops_it_and_a_range_only_limits_it() {
        let mut wide = default_walk();
        for hip in &mut wide.joints[..2] {
            (hip.amplitude_deg, hip.offset_deg) = (40.0, 15.0);
        }
        let got = driven(&GeneratorSet::PhaseCoupled(wide));
        assert!(!got.walks && got.strides.is_empty());
        let why = got.why_not.unwrap();
        assert!(
            why.starts_with("it stops 1.")
                && why.contains("left_hip")
                && why.contains("> 75 degrees at")
                && why.ends_with("% of the stride"),
            "{why}"
        );

        let mut low = default_walk();
        low.joints[2].offset_deg -= 3.0;
        let got = driven(&GeneratorSet::PhaseCoupled(low));
        assert!(got.walks && got.limited_ticks > 1_000, "{got:?}");
        assert!((0.1..2.0).contains(&got.lost_deg[2]) && got.lost_deg[0] == 0.0, "{:?}", got.lost_deg);
        assert!(got.in_words().starts_with("yes; limits act in "), "{}", got.in_words());
    }

    /// A knee of the wrong sign stays at the end of its range. The loop goes on; the person's gait is lost.
    #[test]
    fn a_knee_of_the_wrong_sign_does_not_walk() {
        let mut wrong = default_walk();
        wrong.joints[2].offset_deg *= -1.0;
        let got = driven(&GeneratorSet::PhaseCoupled(wrong));
        assert!(!got.walks && got.limited_ticks > got.ticks / 2, "{got:?}");
        let why = got.why_not.unwrap();
        assert!(why.contains("degrees RMS from left_knee") && why.ends_with("allowed is half of that"), "{why}");
    }
}
