//! Conditions the joints of a file for fitting: equal time steps, no gaps, no jumps, flexion positive.
//!
//! The steps, in this order. Each uses thresholds of [`Rules`] and reports what it did, or what is doubtful, as a [`Finding`] with times:
//!
//! 1. *Time.* Rows that repeat the values of a slower sensor in blocks are left out, and so are those of one column, between
//!    whose values a cubic is put. Rows with the same time as the row before are dropped; a decreasing time is an error that names the row, and so are rows of
//!    two recordings, steps that are too long for seconds and a gap that is longer than the rest. Times at which messages were received are put at equal steps, if the rows fit
//!    them. An axis from 0
//!    to 1 (or 0 to 100 in at most `MOST_PERCENT_ROWS` rows) whose joints end at their start values is a normalised cycle. The rate
//!    follows from the mean of the typical steps. If a time stamp is more than a hundredth of a step off the even grid, the joints are
//!    resampled ([`crate::clean::repair`]).
//! 2. *Gaps.* A step of more than 1.5 median steps, or a value that is not a number, is a gap: bridged up to
//!    [`Rules::longest_bridge_s`], unusable if longer. How much of a recording is unusable does not matter, only what is left: the cut
//!    into strides ([`crate::stride::cut`](mod@crate::stride::cut)) decides whether it holds one.
//!    An angle that was folded at 0 or 180 degrees is an error, or a warning where the folded part is small.
//!    A joint that stays at an end of its range in stride after stride is reported as clipped.
//! 3. *Jumps* faster than a leg can move are bridged, or unusable if longer than [`Rules::longest_jump_s`]. At a lasting step the samples
//!    are unusable.
//! 4. *Units.* If the joints move faster than a leg can, the times are not in the unit that they are read in, which is an error. If no joint moves by [`Rules::least_range_deg`], the values are probably radians and are refused. A unit that only the values
//!    imply is refused if the joints then move too little for a gait. So are a left and a right joint with the same numbers.
//!    Curves of a cycle whose legs are in phase each count from their own contact: they are moved if [`Rules::own_cycles`] says so, else refused.
//! 5. *Low-pass*, if [`Rules::low_pass`] requests one.
//! 6. *Convention*: signs and exchanged columns ([`crate::clean::convention`]). What is beyond the bounds of a person then is an error
//!    ([`crate::clean::anatomy`]).
//!
//! 7. *One leg.* With [`Rules::mirror`] the missing leg is made from the other one.
//!
//! Times are counted from the file's first row; [`Conditioned::start_s`] is that row's time in the file.

use crate::clean::anatomy;
use crate::clean::clipped::clipped;
use crate::clean::clock::Clock;
use crate::clean::condition_error::ConditionError;
use crate::clean::convention::{self, Convention};
use crate::clean::folded::{self, Folded};
use crate::clean::held;
use crate::clean::knee_sign::AmbiguousKnees;
use crate::clean::other_leg;
use crate::clean::repair;
use crate::clean::repair::JumpRule;
use crate::clean::rules::{FEWEST_ROWS, LowPass, MOST_CUT_OFF, RUNNING_HZ, RUNNING_STRIDE_S, Rules, WALKING_HZ};
use crate::clean::same_leg;
use crate::clean::too_fast;
use crate::clean::unit_doubt;
use crate::finding::{Done, Finding, FindingKind};
use crate::raw::{RawJoints, SignBasis, SignSource};
use crate::recording::{Channel, Quantity, Recording};
use crate::series::{range, runs};
use crate::stride::segment;
use joint_units::Joint;

/// More bridged gaps of one joint are reported together.
const MOST_GAPS: usize = 5;

/// Joints ready for fitting.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditioned {
    /// The joints that the file has, named by [`Joint::name`], in the order of [`Joint::ALL`]; equal steps from time 0.
    pub recording: Recording,
    /// Defects found, and what was done about each.
    pub findings: Vec<Finding>,
    /// Samples per second (per cycle if [`Self::normalised_cycle`]).
    pub rate_hz: f64,
    /// Spans that must not be fitted, seconds, in order and separate. The recording has a straight line there.
    pub unusable: Vec<(f64, f64)>,
    /// Whether the recording is one cycle. Its times are 0 to 1, or to [`Rules::stride_s`] seconds if that is given.
    pub normalised_cycle: bool,
    /// Time of the first row in the file, seconds.
    pub start_s: f64,
    /// Samples `from..to` that the file does not have, per joint: the recording has made-up values there, a cubic or a straight line.
    pub missing: [Vec<(usize, usize)>; Joint::COUNT],
    /// What it rests on that flexion is positive, per joint; `None` for one that the recording does not have.
    pub signs: [Option<SignBasis>; Joint::COUNT],
    /// Whether hip and knee of the left and the right leg are in the file's column of the other one.
    pub exchanged: [bool; 2],
}

impl Conditioned {
    /// The joint in whose column the file has this one: itself, unless hip and knee were exchanged.
    #[must_use]
    pub fn column_of(&self, joint: Joint) -> Joint {
        if self.exchanged[joint as usize % 2] { of_other_part(joint) } else { joint }
    }

    /// The values of a joint in degrees, if the recording has it.
    #[must_use]
    pub fn joint(&self, joint: Joint) -> Option<&[f64]> {
        self.recording.channel(joint.name()).ok().map(Channel::values)
    }
}

/// Conditions a recording in the steps that the module's documentation lists.
///
/// # Errors
/// Times decrease, are not finite or not in seconds, the rows are of several recordings, there are too few rows, the unit is wrong or
/// unclear, a joint has hardly any usable value, or the sign of the knees does not follow from their angles.
///
/// ```
/// use gait_trace::{Done, FindingKind, Rules, condition};
/// use gait_trace::{RawJoint, RawJoints};
/// use joint_units::Joint;
/// // Three strides of a knee with extension positive and a marker swap of 12 degrees at 1.5 s.
/// let knee = |t: f64| {
///     let p = std::f64::consts::TAU * t / 1.1;
///     24.0 + 20.0 * p.cos() + 14.0 * (2.0 * p + 0.3).cos()
/// };
/// let time_s: Vec<f64> = (0..330).map(|n| f64::from(n) * 0.01).collect();
/// let mut angle_deg: Vec<f64> = time_s.iter().map(|&t| -knee(t)).collect();
/// angle_deg[150] -= 12.0;
/// let left_knee = RawJoint::degrees("knee_angle_l", angle_deg);
/// let raw = RawJoints {
///     file: "walk.mot".into(), format: String::new(), time_s, received: false, joints: [None, None, Some(left_knee), None], notes: vec![], doubts: vec![],
/// };
/// let done = condition(&raw, &Rules::default())?;
/// let said: Vec<String> = done.findings.iter().map(|finding| finding.to_string()).collect();
/// assert_eq!(said, [
///     "left knee, 1.450 s to 1.550 s: a jump of 12.0 deg, faster than a leg can move; replaced by a cubic",
///     "left knee: extension is positive in the file (-57.7 to -3.8 deg: too far for flexion of a knee); the sign was changed",
/// ]);
/// let value = done.joint(Joint::LeftKnee).unwrap()[150];
/// assert!((value - knee(1.5)).abs() < 0.5);
/// # Ok::<(), gait_trace::ConditionError>(())
/// ```
pub fn condition(raw: &RawJoints, rules: &Rules) -> Result<Conditioned, ConditionError> {
    let held = held::released(raw);
    if held.is_some() {
        // Its errors name rows of the file.
        Clock::of(raw, rules)?;
    }
    let raw = held.as_ref().map_or(raw, |(kept, _)| kept);
    let clock = Clock::of(raw, rules)?;
    let (rate_hz, samples) = (clock.rate_hz, clock.samples);
    let mut findings = clock.findings.clone();
    findings.extend(raw.doubts.iter().map(|doubt| Finding {
        from_s: 0.0,
        to_s: (samples - 1) as f64 / rate_hz,
        joint: None,
        what: FindingKind::Guess(*doubt),
        done: Done::Reported,
    }));
    let seconds = |n: usize| n as f64 / rate_hz;
    if let Some((_, block)) = held {
        let what = FindingKind::Held { block, rate_hz };
        findings.push(Finding { from_s: 0.0, to_s: seconds(samples - 1), joint: None, what, done: Done::LeftOut });
    }
    let mut joints: [Option<Vec<f64>>; Joint::COUNT] = Default::default();
    let mut unusable = vec![false; samples];
    let mut gaps: [Vec<(usize, usize)>; Joint::COUNT] = Default::default();
    let mut made_up: [Option<Vec<(usize, usize)>>; Joint::COUNT] = Default::default();
    let most_bridged = rules.longest_bridge_s * rate_hz + 1e-6;

    let jump_rule = JumpRule {
        least_bend_deg: rules.jump_bend_deg,
        usual_bends: rules.jump_usual_bends,
        guard_s: rules.jump_guard_s,
        least_step_deg: rules.step_deg,
        least_step_share: rules.step_share,
        longest_excursion_s: rules.longest_excursion_s,
    };
    let (mut jumps, mut clips): (Vec<Finding>, Vec<Finding>) = (Vec::new(), Vec::new());
    for joint in Joint::ALL {
        let Some(column) = &raw.joints[joint as usize] else { continue };
        let mut bad = vec![false; samples];
        let slow = held::column(&column.angle_deg);
        let mut x = match &slow {
            None => clock.even(&column.angle_deg),
            Some(slow) => {
                let (even, between) = clock.even_of(&slow.rows, slow.block, &column.angle_deg);
                made_up[joint as usize] = Some(between);
                findings.push(slow.finding(joint, seconds(samples - 1)));
                even
            }
        };
        if let Some(Folded { at_deg, corners, span, deg, .. }) = folded::folded(joint, &x, rate_hz) {
            let (from_s, to_s) = (seconds(span.0), seconds(span.1));
            if deg > folded::SMALL_DEG {
                let file = raw.file.clone();
                return Err(ConditionError::Folded { file, joint, at_deg, corners, from_s, to_s });
            }
            let what = FindingKind::Folded { at_deg, deg };
            findings.push(Finding { from_s, to_s, joint: Some(joint), what, done: Done::Reported });
        }
        for (from, to) in runs(samples, |n| !x[n].is_finite()) {
            // A gap between samples 3 and 7 is 4 steps long, although 3 samples are missing.
            let open = from == 0 || to == samples;
            let long = open || (to - from + 1) as f64 > most_bridged;
            repair::bridge(&mut x, from, to, rate_hz, long);
            if long {
                bad[from..to].fill(true);
            }
            gaps[joint as usize].push((from, to));
        }
        // Where a clipped joint reaches and leaves the end of its range, the angle bends sharply and has not jumped.
        let mut unexamined = bad.clone();
        for (clip, held) in clipped(joint, &x, &gaps[joint as usize], rate_hz) {
            clips.push(clip);
            held.iter().for_each(|&(from, to)| unexamined[from..to].fill(true));
        }
        for jump in repair::jumps(&x, &unexamined, rate_hz, &jump_rule) {
            let (from, to) = (jump.from, jump.to);
            let before = x[from..to].to_vec();
            let long = (to - from + 1) as f64 > rules.longest_jump_s * rate_hz + 1e-6 || from == 0 || to == samples;
            let kind = match jump.lasting_deg {
                Some(deg) => FindingKind::Step { deg },
                None => {
                    repair::bridge(&mut x, from, to, rate_hz, long);
                    let off = before.iter().zip(&x[from..to]).map(|(a, b)| (a - b).abs());
                    FindingKind::Jump { deg: off.fold(0.0, f64::max) }
                }
            };
            let left_out = long || jump.lasting_deg.is_some();
            if left_out {
                bad[from..to].fill(true);
            }
            let done = if left_out { Done::LeftOut } else { Done::Bridged };
            let (from_s, to_s) = (seconds(from.saturating_sub(1)), seconds(to.min(samples - 1)));
            jumps.push(Finding { from_s, to_s, joint: Some(joint), what: kind, done });
        }
        let values = bad.iter().filter(|bad| !**bad).count();
        if values < FEWEST_ROWS {
            return Err(ConditionError::TooFewValues { file: raw.file.clone(), joint, values });
        }
        for (all, bad) in unusable.iter_mut().zip(bad) {
            *all |= bad;
        }
        joints[joint as usize] = Some(x);
    }
    findings.extend(gap_findings(&gaps, &joints, samples, rate_hz, most_bridged));
    findings.extend(jumps.into_iter().chain(clips));
    let widest = joints.iter().flatten().map(|x| range(x)).fold(0.0, f64::max);
    if widest < rules.least_range_deg {
        let (file, least) = (raw.file.clone(), rules.least_range_deg);
        return Err(ConditionError::Radians { file, range: widest, least });
    }
    unit_doubt::check(raw, &joints, &unusable)?;
    if !clock.normalised_cycle {
        too_fast::check(raw, &joints, &unusable, rate_hz)?;
    }
    // Of curves of one cycle that is said below, with what to do.
    let same = if clock.normalised_cycle { None } else { same_leg::of(&joints, &gaps) };
    if let Some(left) = same {
        return Err(ConditionError::SameLeg { file: raw.file.clone(), left });
    }
    for (gaps, made_up) in gaps.iter_mut().zip(made_up) {
        *gaps = made_up.unwrap_or_else(|| std::mem::take(gaps));
    }
    let end_s = seconds(samples - 1);
    let cut_off = match rules.low_pass {
        _ if clock.normalised_cycle => None,
        LowPass::Off => None,
        LowPass::At(hz) => Some(hz),
        LowPass::Customary => {
            let legs = joints.each_ref().map(|joint| joint.as_deref());
            let periodic = segment::periodic(&legs, &unusable, rate_hz);
            periodic.map(|found| if found.period_s < RUNNING_STRIDE_S { RUNNING_HZ } else { WALKING_HZ })
        }
    };
    if let Some(hz) = cut_off {
        let most = MOST_CUT_OFF * rate_hz;
        if !(hz > 0.0 && hz < most) {
            return Err(ConditionError::LowPass { file: raw.file.clone(), hz, most });
        }
        joints.iter_mut().flatten().for_each(|x| repair::low_pass(x, rate_hz, hz));
        let what = FindingKind::Unfiltered;
        findings.push(Finding { from_s: 0.0, to_s: end_s, joint: None, what, done: Done::Smoothed { hz } });
    }
    if rules.own_cycles {
        let refused = |why| ConditionError::NoOwnCycles { file: raw.file.clone(), why };
        if !clock.normalised_cycle {
            return Err(refused("the time is not that of a cycle"));
        }
        let right = joints.iter_mut().skip(1).step_by(2).flatten();
        right.for_each(|x| *x = other_leg::half_a_cycle_later(x));
        if other_leg::in_phase(&joints).is_some() {
            return Err(refused("the legs are half a cycle apart as they are"));
        }
        findings.push(Finding {
            from_s: 0.0,
            to_s: end_s,
            joint: None,
            what: FindingKind::OwnCycles,
            done: Done::Reported,
        });
    } else if clock.normalised_cycle
        && let Some(part) = other_leg::in_phase(&joints)
    {
        return Err(ConditionError::LegsInPhase { file: raw.file.clone(), part });
    }
    let sources = raw.joints.each_ref().map(|joint| joint.as_ref().map_or(SignSource::Unknown, |joint| joint.sign));
    let convention = convention::apply(&mut joints, &unusable, rate_hz, clock.normalised_cycle, sources, rules);
    let convention = convention.map_err(|AmbiguousKnees { least_deg, most_deg, is_interior }| {
        let file = raw.file.clone();
        match is_interior {
            true => ConditionError::InteriorKnees { file, least_deg, most_deg },
            false => ConditionError::KneeSign { file, least_deg, most_deg },
        }
    })?;
    for hip in (0..2).filter(|&leg| convention.exchanged[leg]) {
        gaps.swap(hip, hip + 2);
        // What was found before is of the same values, which now are those of the other joint.
        for joint in findings.iter_mut().filter_map(|finding| finding.joint.as_mut()) {
            if *joint as usize % 2 == hip {
                *joint = of_other_part(*joint);
            }
        }
    }
    let doubts = anatomy::check(&joints, &unusable).map_err(|impossible| {
        let is_hip = matches!(impossible.joint, Joint::LeftHip | Joint::RightHip);
        let named = if is_hip { rules.hip_sign } else { rules.knee_sign };
        ConditionError::Impossible { file: raw.file.clone(), impossible, named }
    })?;
    let Convention { findings: convention, mut signs, exchanged } = convention;
    findings.extend(convention.into_iter().chain(doubts).map(|(joint, what, done)| Finding {
        from_s: 0.0,
        to_s: end_s,
        joint,
        what,
        done,
    }));

    if rules.mirror {
        let half = other_leg::half_a_stride(&joints, &unusable, rate_hz, clock.normalised_cycle);
        let mirrored = other_leg::mirror(&mut joints, &mut unusable, half);
        let half_s = match mirrored {
            Ok(half) => half as f64 / rate_hz,
            Err(why) => return Err(ConditionError::NoMirror { file: raw.file.clone(), why }),
        };
        for joint in Joint::ALL {
            if signs[joint as usize].is_some() || joints[joint as usize].is_none() {
                continue;
            }
            signs[joint as usize] = signs[joint as usize ^ 1];
            let what = FindingKind::Mirrored { half_s };
            findings.push(Finding { from_s: 0.0, to_s: end_s, joint: Some(joint), what, done: Done::Reported });
        }
    }

    let times = (0..samples).map(seconds).collect();
    let channels = Joint::ALL.into_iter().zip(joints);
    let channels = channels
        .filter_map(|(joint, values)| values.map(|values| Channel::new(joint.name(), Quantity::Angle, values)))
        .collect();
    let recording =
        Recording::build(times, channels).map_err(|source| ConditionError::Table { file: raw.file.clone(), source })?;
    let unusable = runs(samples, |n| unusable[n]);
    let unusable = unusable
        .into_iter()
        .map(|(from, to)| (seconds(from.saturating_sub(1)), seconds(to.min(samples - 1))))
        .collect();
    let (normalised_cycle, start_s) = (clock.normalised_cycle, clock.start_s);
    let missing = gaps;
    Ok(Conditioned { recording, findings, rate_hz, unusable, normalised_cycle, start_s, missing, signs, exchanged })
}

/// The knee of the leg of a hip, and the other way round.
fn of_other_part(joint: Joint) -> Joint {
    Joint::ALL[(joint as usize + 2) % Joint::COUNT]
}

/// The findings of the gaps; a gap that all joints share gives one finding.
fn gap_findings(
    gaps: &[Vec<(usize, usize)>; Joint::COUNT],
    joints: &[Option<Vec<f64>>; Joint::COUNT],
    samples: usize,
    rate_hz: f64,
    most_bridged: f64,
) -> Vec<Finding> {
    let there: Vec<Joint> = Joint::ALL.into_iter().filter(|joint| joints[*joint as usize].is_some()).collect();
    let of = |joint: &Joint| &gaps[*joint as usize];
    // Gaps are sorted by time.
    let shared =
        |gap: &(usize, usize)| there.len() > 1 && there.iter().all(|joint| of(joint).binary_search(gap).is_ok());
    let mut findings: Vec<Finding> = Vec::new();
    for joint in &there {
        for gap @ &(from, to) in of(joint) {
            let shared = shared(gap);
            if shared && joint != &there[0] {
                continue;
            }
            let (from_s, to_s) = (from.saturating_sub(1) as f64 / rate_hz, to.min(samples - 1) as f64 / rate_hz);
            let long = from == 0 || to == samples || (to - from + 1) as f64 > most_bridged;
            let done = if long { Done::LeftOut } else { Done::Bridged };
            let joint = (!shared).then_some(*joint);
            findings.push(Finding { from_s, to_s, joint, what: FindingKind::Gap, done });
        }
    }
    few(findings)
}

/// At most [`MOST_GAPS`] findings of bridged gaps for each joint, or one for all of them. Those that are left out stay: each is a span.
fn few(findings: Vec<Finding>) -> Vec<Finding> {
    let (bridged, mut all): (Vec<_>, Vec<_>) = findings.into_iter().partition(|finding| finding.done == Done::Bridged);
    for joint in Joint::ALL.into_iter().map(Some).chain([None]) {
        let same: Vec<Finding> = bridged.iter().filter(|finding| finding.joint == joint).copied().collect();
        if same.len() <= MOST_GAPS {
            all.extend(same);
            continue;
        }
        let longest_s = same.iter().map(|gap| gap.to_s - gap.from_s).fold(0.0, f64::max);
        let to_s = same.iter().map(|gap| gap.to_s).fold(0.0, f64::max);
        all.push(Finding { to_s, what: FindingKind::Gaps { count: same.len(), longest_s }, ..same[0] });
    }
    all.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    all
}
