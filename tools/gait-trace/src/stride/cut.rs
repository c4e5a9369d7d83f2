//! Cuts a recording into strides, with a reason for every part that is in none.
//!
//! 1. [`crate::stride::segment`] gives one event per stride. Runs of events at regular distance are bouts of walking; within a bout the
//!    phase is linear from event to event.
//! 2. All strides are cut at the same phase: of [`OFFSETS`] phases the one that gives most usable strides, and among equals the one whose
//!    strides close best. A recording of a single usable stride is cut where all joints close best in value and slope
//!    (measure in [`crate::stride::looped`]), of all places where they move; a normalised cycle is one stride.
//! 3. The cuts of [`FEWEST_TO_ALIGN`] strides or more are aligned: each is moved to where a quarter stride on both sides of it, in all
//!    joints, fits the median stride best (Gauss-Newton in the shift, each joint weighted by 1 / its variance). With the crossing of
//!    the hips alone, knees would appear 5 to 15 % more variable than they are.
//! 4. A stride is left out if it overlaps an unusable span, or if it is an outlier among [`FEWEST_TO_JUDGE`] or more: its shape differs
//!    from the median stride by more than [`OUTLIER`] times the median difference and [`OUTLIER_DEG`], or its length by more than
//!    [`OUTLIER_LENGTH`]. Outliers at the beginning of a bout count as starting up, at the end as stopping, in the middle as odd strides
//!    (up to [`MOST_ODD`]) or a turn (more). If the strides are of several movements (median distance above [`SEVERAL_DEG`]), they are compared
//!    with those where the period was found, before the alignment too.
//! 5. Everything that is in no kept stride is listed in [`Cuts::left_out`]; strides and list together cover the recording.
//!
//! Units inside: samples.

use crate::clean::condition::Conditioned;
use crate::finding::FindingKind;
use crate::series;
use crate::series::{between, median, range, variance};
use crate::stride::segment;
use crate::stride::segment::{Bout, Joints};
use crate::stride::spans::{Cuts, LeftOut, Span, StrideError, WhyLeftOut};
use joint_units::Joint;
use std::f64::consts::TAU;
use std::ops::Range;

/// Number of phases that are tried for the cuts.
pub const OFFSETS: usize = 50;
/// Fewest strides for which outliers are looked for.
pub const FEWEST_TO_JUDGE: usize = 4;
/// Smallest distance of an outlier from the median stride, as a multiple of the median distance.
pub const OUTLIER: f64 = 2.5;
/// Median distance from the median stride, degrees, above which the strides are those of several movements.
pub const SEVERAL_DEG: f64 = 8.0;
/// Smallest distance of an outlier, root mean square over joints and points, degrees.
pub const OUTLIER_DEG: f64 = 5.0;
/// Up to this many consecutive outliers are odd strides (a disturbance may extend into the next stride); more are a turn.
pub const MOST_ODD: usize = 2;
/// Smallest deviation of an outlier's length from the median stride, as a fraction of it.
pub const OUTLIER_LENGTH: f64 = 0.15;
/// Half a second in which no joint moves by more than this fraction of its range counts as standing.
pub const STANDING: f64 = 0.25;
/// Largest deviation of a single stride from the period, as a fraction.
pub const STRETCH: f64 = 0.08;
/// Least movement of a single stride, as a fraction of that of the part of its length with most movement.
pub const LEAST_MOVING: f64 = 0.5;
/// Fewest strides whose cuts are aligned to their median.
pub const FEWEST_TO_ALIGN: usize = 3;
/// Largest shift of a cut by the alignment, as a fraction of a stride.
pub const MOST_ALIGNED: f64 = 0.05;
/// Rounds of alignment.
const ALIGNMENTS: usize = 3;
/// Points of a stride while strides are compared.
const SHAPE: usize = 50;
/// Number of these points on each side of a cut that its alignment uses.
const WINDOW: i64 = 12;

/// Finds the strides from the joints that the recording has; a single knee is enough.
///
/// # Errors
/// The recording is not periodic, or no complete stride can be used.
///
/// ```
/// use gait_trace::{Rules, condition};
/// use gait_trace::{RawJoint, RawJoints};
/// use gait_trace::stride::cut;
/// // Two seconds of standing, then five strides of 1.2 s.
/// let knee = |t: f64| {
///     let p = std::f64::consts::TAU * (t - 2.0).clamp(0.0, 6.0) / 1.2;
///     24.0 - 20.0 * p.cos() + 14.0 * (2.0 * p - 3.0).cos()
/// };
/// let time_s: Vec<f64> = (0..800).map(|n| f64::from(n) * 0.01).collect();
/// let angle_deg = time_s.iter().map(|&t| knee(t)).collect();
/// let joints = [None, None, Some(RawJoint::degrees("knee", angle_deg)), None];
/// let raw = RawJoints { file: "knee.csv".into(), format: String::new(), time_s, received: false, joints, notes: vec![], doubts: vec![] };
/// let walk = cut::cut(&condition(&raw, &Rules::default())?)?;
/// assert_eq!(walk.spans.len(), 4);
/// assert_eq!(walk.left_out[0].to_string(), "0.00 s to 1.86 s left out: standing");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn cut(conditioned: &Conditioned) -> Result<Cuts, StrideError> {
    let rate = conditioned.rate_hz;
    let joints: Joints<'_> = Joint::ALL.map(|joint| conditioned.joint(joint));
    let duration_s = conditioned.recording.duration_s();
    if conditioned.normalised_cycle {
        if !conditioned.unusable.is_empty() {
            let part = |&(from_s, to_s): &(f64, f64)| LeftOut { from_s, to_s, why: WhyLeftOut::Gap }.to_string();
            let parts: Vec<String> = conditioned.unusable.iter().map(part).collect();
            return Err(StrideError::NoStride { period_s: duration_s, parts: parts.join("; ") });
        }
        let spans = vec![Span { start_s: 0.0, end_s: duration_s }];
        return Ok(Cuts { spans, left_out: Vec::new() });
    }
    let samples = conditioned.recording.time_s().len();
    let mut unusable = vec![None; samples];
    let samples_of =
        |from: f64, to: f64| (from * rate).round() as usize..=((to * rate).round() as usize).min(samples - 1);
    let mut in_gap = vec![false; samples];
    for finding in conditioned.findings.iter().filter(|finding| finding.what == FindingKind::Gap) {
        in_gap[samples_of(finding.from_s, finding.to_s)].fill(true);
    }
    for &(from, to) in &conditioned.unusable {
        let span = samples_of(from, to);
        let why = if in_gap[span.clone()].contains(&true) { WhyLeftOut::Gap } else { WhyLeftOut::Glitch };
        unusable[span].fill(Some(why));
    }
    let bad: Vec<bool> = unusable.iter().map(Option::is_some).collect();
    let longest = series::runs(samples, |n| !bad[n]).iter().map(|(from, to)| to - from - 1).max();
    let no_period = || StrideError::NoPeriod { duration_s: longest.unwrap_or(0) as f64 / rate };
    let periodic = segment::periodic(&joints, &bad, rate).ok_or_else(|| {
        let too_slow = segment::too_slow_s(&joints, &bad, rate);
        too_slow.map_or_else(no_period, |period_s| StrideError::TooSlow { period_s })
    })?;
    let period_s = periodic.period_s;
    let period = period_s * rate;
    let lengths = [3.0, 2.0, 1.0].into_iter().map(|strides| (strides * period) as usize);
    let typical = periodic.typical(&joints, &bad, rate, lengths).unwrap_or(0..samples);
    let signal = segment::event_signal(&joints, &typical).ok_or_else(no_period)?;
    let mut events = segment::crossings(&signal, &signal[typical.clone()]);
    // In a long gap of one joint the signal is made of the others alone, so that its crossings are at another phase.
    let long_gaps: Vec<(usize, usize)> =
        series::runs(samples, |n| bad[n]).into_iter().filter(|(from, to)| (to - from) as f64 > 0.5 * period).collect();
    events.retain(|&event| !long_gaps.iter().any(|&(from, to)| event >= from as f64 && event < to as f64));
    if events.is_empty() {
        // A single stride that begins at the crossing: any place can be the anchor.
        events.push(typical.start as f64);
    }
    let bouts = segment::bouts(&events, period, samples);
    let mut strides = choose(&bouts, &joints, &bad);
    let why = |stride: &Stride| {
        let (from, to) = (stride.from.ceil() as usize, stride.to.floor() as usize);
        unusable[from..=to.min(samples - 1)].iter().copied().flatten().next()
    };
    strides.iter_mut().for_each(|stride| stride.why = why(stride));
    // Before the alignment, which is to their median.
    if are_several(&strides, &joints) {
        judge(&mut strides, &joints, &bouts, samples, &typical);
    }
    let joined: Vec<bool> = strides.windows(2).map(|pair| (pair[0].to - pair[1].from).abs() < 1e-6).collect();
    let unaligned = strides.clone();
    align(&mut strides, &joints, &bad);
    // A stride that is left out ends where the next one, which was aligned, begins.
    for (n, _) in joined.iter().enumerate().filter(|(_, joined)| **joined) {
        match (strides[n].why, strides[n + 1].why) {
            (Some(_), None) => strides[n].to = strides[n + 1].from,
            (None, Some(_)) => strides[n + 1].from = strides[n].to,
            _ => {}
        }
    }
    strides.iter_mut().filter(|stride| stride.why.is_none()).for_each(|stride| stride.why = why(stride));
    let count = |strides: &[Stride]| strides.iter().filter(|stride| stride.why.is_none()).count();
    // In a block of few strides the alignment may move the outer ones into the gaps.
    if count(&strides) < FEWEST_TO_ALIGN.min(count(&unaligned)) {
        strides = unaligned;
    }
    let usable = count(&strides);
    if usable <= 1 {
        let span = single(&joints, period, rate, &unusable).map(|span| Stride::new(0, span));
        if span.is_some() || strides.len() <= 1 {
            strides = span.into_iter().collect();
        }
    }
    judge(&mut strides, &joints, &bouts, samples, &typical);

    let span = |stride: &Stride| Span { start_s: stride.from / rate, end_s: stride.to / rate };
    let spans: Vec<Span> = strides.iter().filter(|stride| stride.why.is_none()).map(span).collect();
    let left_out = rest(&strides, &joints, &unusable, period, rate);
    if spans.is_empty() {
        let parts: Vec<String> = left_out.iter().map(LeftOut::to_string).collect();
        return Err(StrideError::NoStride { period_s, parts: parts.join("; ") });
    }
    Ok(Cuts { spans, left_out })
}

/// A stride under examination; places in samples.
#[derive(Debug, Clone)]
struct Stride {
    bout: usize,
    from: f64,
    to: f64,
    why: Option<WhyLeftOut>,
}

impl Stride {
    const fn new(bout: usize, (from, to): (f64, f64)) -> Self {
        Self { bout, from, to, why: None }
    }
}

/// Step 2 of the module. Strides with a `bad` sample do not count.
fn choose(bouts: &[Bout], joints: &Joints<'_>, bad: &[bool]) -> Vec<Stride> {
    let mut best: (usize, f64, Vec<Stride>) = (0, f64::INFINITY, Vec::new());
    // Number of bad samples before each sample.
    let before: Vec<usize> = std::iter::once(0)
        .chain(bad.iter().scan(0, |sum, &bad| {
            *sum += usize::from(bad);
            Some(*sum)
        }))
        .collect();
    let is_usable = |stride: &&Stride| {
        let (from, to) = (stride.from.ceil() as usize, (stride.to.floor() as usize + 1).min(bad.len()));
        before[from.min(to)] == before[to]
    };
    for offset in 0..OFFSETS {
        let mut strides: Vec<Stride> = Vec::new();
        for (index, bout) in bouts.iter().enumerate() {
            for pair in bout.cuts(offset as f64 / OFFSETS as f64).windows(2) {
                if strides.last().is_none_or(|last| last.to <= pair[0] + 1e-6) {
                    strides.push(Stride::new(index, (pair[0], pair[1])));
                }
            }
        }
        let open = |x: &[f64], stride: &Stride| (between(x, stride.to) - between(x, stride.from)).abs();
        let usable: Vec<&Stride> = strides.iter().filter(is_usable).collect();
        let closure: f64 = joints.iter().flatten().map(|x| median(usable.iter().map(|s| open(x, s)))).sum();
        let count = usable.len();
        if count > best.0 || (count == best.0 && closure < best.1) {
            best = (count, closure, strides);
        }
    }
    best.2
}

/// Step 3 of the module: aligns the cuts of the usable strides in all joints. A `bad` sample says nothing of a cut beside it.
fn align(strides: &mut [Stride], joints: &Joints<'_>, bad: &[bool]) {
    let mut strides: Vec<&mut Stride> = strides.iter_mut().filter(|stride| stride.why.is_none()).collect();
    if strides.len() < FEWEST_TO_ALIGN {
        return;
    }
    let joints: Vec<&[f64]> = joints.iter().flatten().copied().collect();
    let weights: Vec<f64> = joints.iter().map(|x| 1.0 / variance(x).max(1e-9)).collect();
    let last = joints.first().map_or(0, |x| x.len() - 1) as f64;
    let is_sound = |place: f64| !bad[place.floor() as usize] && !bad[place.ceil() as usize];
    let usual = median(strides.iter().map(|stride| stride.to - stride.from));
    let first: Vec<(f64, f64)> = strides.iter().map(|stride| (stride.from, stride.to)).collect();
    for _ in 0..ALIGNMENTS {
        // The median stride, and its slope per cycle.
        let at = |x: &[f64], stride: &Stride, k: usize| {
            between(x, stride.from + (stride.to - stride.from) * k as f64 / SHAPE as f64)
        };
        let typical: Vec<Vec<f64>> = joints
            .iter()
            .map(|x| (0..SHAPE).map(|k| median(strides.iter().map(|stride| at(x, stride, k)))).collect())
            .collect();
        // Delay of the recording around a place against the typical stride, in samples.
        let delay = |place: f64, before: f64, after: f64| -> f64 {
            let (mut along, mut steep) = (0.0, 0.0);
            for ((x, typical), weight) in joints.iter().zip(&typical).zip(&weights) {
                let window: Vec<(f64, f64)> = (-WINDOW..=WINDOW)
                    .map(|k| (k, k as f64 / SHAPE as f64))
                    .map(|(k, part)| (k, place + part * if k < 0 { before } else { after }))
                    .filter(|(_, place)| (0.0..=last).contains(place) && is_sound(*place))
                    .map(|(k, place)| {
                        let of = |k: i64| typical[k.rem_euclid(SHAPE as i64) as usize];
                        (between(x, place) - of(k), 0.5 * SHAPE as f64 * (of(k + 1) - of(k - 1)) / usual)
                    })
                    .collect();
                // A constant offset of a joint does not count as delay.
                let n = window.len().max(1) as f64;
                let (off, slope) = window.iter().fold((0.0, 0.0), |(a, b), (e, s)| (a + e / n, b + s / n));
                along += weight * window.iter().map(|(e, s)| (e - off) * (s - slope)).sum::<f64>();
                steep += weight * window.iter().map(|(_, s)| (s - slope).powi(2)).sum::<f64>();
            }
            if steep > 0.0 { -along / steep } else { 0.0 }
        };
        let lengths: Vec<f64> = strides.iter().map(|stride| stride.to - stride.from).collect();
        let mut moved: Vec<(f64, f64)> = Vec::with_capacity(strides.len());
        for (i, stride) in strides.iter().enumerate() {
            let joined = |a: usize, b: usize| (first[a].1 - first[b].0).abs() < 1e-6;
            let before = if i > 0 && joined(i - 1, i) { lengths[i - 1] } else { lengths[i] };
            let after = if i + 1 < strides.len() && joined(i, i + 1) { lengths[i + 1] } else { lengths[i] };
            let most = MOST_ALIGNED * usual;
            let near = |place: f64, start: f64| place.clamp(start - most, start + most).clamp(0.0, last);
            let from = near(stride.from + delay(stride.from, before, lengths[i]), first[i].0);
            let to = near(stride.to + delay(stride.to, lengths[i], after), first[i].1);
            moved.push((from, to));
        }
        for (stride, (from, to)) in strides.iter_mut().zip(moved) {
            (stride.from, stride.to) = (from, to);
        }
    }
}

/// The stride of a recording that has only one: where the joints close best, of all places where they move. Standing closes better.
fn single(joints: &Joints<'_>, period: f64, rate: f64, bad: &[Option<WhyLeftOut>]) -> Option<(f64, f64)> {
    let samples = bad.len();
    let shortest = (period * (1.0 - STRETCH)).ceil() as usize;
    let longest = ((period * (1.0 + STRETCH)).floor() as usize).min(samples - 1);
    let reach = ((0.02 * rate).round() as usize).max(1);
    let slope = |x: &[f64], at: usize| {
        let (from, to) = (at.saturating_sub(reach), (at + reach).min(samples - 1));
        (x[to] - x[from]) / (to - from) as f64
    };
    let variances = joints.map(|joint| joint.map_or(1.0, |x| variance(x).max(1e-9)));
    let is_bad: Vec<bool> = bad.iter().map(Option::is_some).collect();
    let movements = segment::movements(joints, &is_bad, &(0..samples), shortest, 1);
    let least = LEAST_MOVING * movements.iter().map(|(_, movement)| *movement).fold(0.0, f64::max);
    let mut moves = vec![false; samples];
    movements.iter().for_each(|&(from, movement)| moves[from] = movement >= least);
    let mut best: Option<(f64, usize, usize)> = None;
    for length in shortest..=longest {
        for from in 0..samples - length {
            let to = from + length;
            let cost: f64 = joints
                .iter()
                .zip(&variances)
                .filter_map(|(joint, variance)| joint.map(|x| (x, variance)))
                .map(|(x, variance)| {
                    let (step, bend) = (x[to] - x[from], (slope(x, to) - slope(x, from)) * period / TAU);
                    (step * step + bend * bend) / variance
                })
                .sum();
            let is_usable = || moves[from] && !is_bad[from..=to].contains(&true);
            if best.is_none_or(|(least, ..)| cost < least) && is_usable() {
                best = Some((cost, from, to));
            }
        }
    }
    let (_, from, to) = best?;
    // One Newton step places the end between samples, where the difference is smallest.
    let (along, steep) = joints.iter().zip(&variances).filter_map(|(joint, v)| joint.map(|x| (x, v))).fold(
        (0.0, 1e-12),
        |(along, steep), (x, variance)| {
            let slope = slope(x, to);
            (along + (x[to] - x[from]) * slope / variance, steep + slope * slope / variance)
        },
    );
    let end = (to as f64 - (along / steep).clamp(-0.5, 0.5)).min((samples - 1) as f64);
    Some((from as f64, end))
}

/// Distance of each stride from the median of those `of` these places, root mean square over joints and points, degrees; and their median length.
fn compared(strides: &[&Stride], of: &[usize], joints: &Joints<'_>) -> (Vec<f64>, f64) {
    let joints: Vec<&[f64]> = joints.iter().flatten().copied().collect();
    let shape = |stride: &&Stride| -> Vec<f64> {
        let place = |k: usize| stride.from + (stride.to - stride.from) * k as f64 / SHAPE as f64;
        joints.iter().flat_map(|x| (0..SHAPE).map(move |k| between(x, place(k)))).collect()
    };
    let shapes: Vec<Vec<f64>> = strides.iter().map(shape).collect();
    let typical: Vec<f64> =
        (0..SHAPE * joints.len()).map(|k| median(of.iter().map(|&place| shapes[place][k]))).collect();
    let distance = |shape: &Vec<f64>| {
        let squares: f64 = shape.iter().zip(&typical).map(|(a, b)| (a - b).powi(2)).sum();
        (squares / typical.len() as f64).sqrt()
    };
    let usual = median(of.iter().map(|&place| strides[place].to - strides[place].from));
    (shapes.iter().map(distance).collect(), usual)
}

/// Whether the usable strides are of several movements.
fn are_several(strides: &[Stride], joints: &Joints<'_>) -> bool {
    let usable: Vec<&Stride> = strides.iter().filter(|stride| stride.why.is_none()).collect();
    let all: Vec<usize> = (0..usable.len()).collect();
    all.len() >= FEWEST_TO_JUDGE && median(compared(&usable, &all, joints).0) > SEVERAL_DEG
}

/// Step 4 of the module: outliers. Strides of several movements are compared with those of the `typical` samples, others with all.
fn judge(strides: &mut [Stride], joints: &Joints<'_>, bouts: &[Bout], samples: usize, typical: &Range<usize>) {
    let sound: Vec<usize> = (0..strides.len()).filter(|&i| strides[i].why.is_none()).collect();
    if sound.len() < FEWEST_TO_JUDGE {
        return;
    }
    let those: Vec<&Stride> = sound.iter().map(|&i| &strides[i]).collect();
    let is_typical = |stride: &Stride| stride.from < typical.end as f64 && stride.to > typical.start as f64;
    let mut of: Vec<usize> = (0..sound.len()).collect();
    if are_several(strides, joints) && those.iter().any(|stride| is_typical(stride)) {
        of.retain(|&place| is_typical(those[place]));
    }
    let (distances, usual) = compared(&those, &of, joints);
    let limit = OUTLIER_DEG.max(OUTLIER * median(of.iter().map(|&place| distances[place])));
    let length = |stride: &Stride| stride.to - stride.from;
    let odd: Vec<bool> = those
        .iter()
        .zip(&distances)
        .map(|(stride, distance)| *distance > limit || (length(stride) - usual).abs() > OUTLIER_LENGTH * usual)
        .collect();
    for (from, to) in series::runs(sound.len(), |n| odd[n]) {
        for n in from..to {
            let bout = strides[sound[n]].bout;
            let same = |n: usize| strides[sound[n]].bout == bout;
            let starts = (0..n).filter(|&m| same(m)).all(|m| odd[m]) && bouts[bout].from > 0.5 * usual;
            let ends = (n + 1..sound.len()).filter(|&m| same(m)).all(|m| odd[m])
                && bouts[bout].to < (samples - 1) as f64 - 0.5 * usual;
            strides[sound[n]].why = Some(match (starts, ends) {
                (true, false) => WhyLeftOut::StartUp,
                (false, true) => WhyLeftOut::Stop,
                _ if to - from <= MOST_ODD => WhyLeftOut::Odd,
                _ => WhyLeftOut::Turn,
            });
        }
    }
}

/// Step 5 of the module: the parts of the recording that are in no kept stride.
fn rest(
    strides: &[Stride],
    joints: &Joints<'_>,
    unusable: &[Option<WhyLeftOut>],
    period: f64,
    rate: f64,
) -> Vec<LeftOut> {
    // One label per step from sample n to n + 1.
    let steps = unusable.len() - 1;
    // `None` for a step that no stride covers, else the stride's reason, which is `None` for a kept stride.
    let mut covered: Vec<Option<Option<WhyLeftOut>>> = vec![None; steps];
    for stride in strides {
        let step = |place: f64| ((place - 0.5).ceil().max(0.0) as usize).min(steps);
        covered[step(stride.from)..step(stride.to)].fill(Some(stride.why));
    }
    let kept = |n: usize| covered[n] == Some(None);
    let first = strides.iter().find(|s| s.why.is_none()).map_or(f64::INFINITY, |s| s.from);
    let last = strides.iter().rev().find(|s| s.why.is_none()).map_or(f64::NEG_INFINITY, |s| s.to);
    let ranges = joints
        .map(|joint| joint.map_or(0.0, |x| series::quantile(x.to_vec(), 0.95) - series::quantile(x.to_vec(), 0.05)));
    let half = (0.25 * rate).round() as usize;
    let stands = |n: usize| {
        let (from, to) = (n.saturating_sub(half), (n + half).min(steps));
        joints
            .iter()
            .zip(&ranges)
            .filter_map(|(j, r)| j.map(|x| (x, r)))
            .all(|(x, r)| range(&x[from..=to]) < STANDING * r)
    };
    let known = |n: usize| match covered[n].flatten() {
        // A stride at the start of a bout may begin with standing.
        Some(WhyLeftOut::StartUp | WhyLeftOut::Stop) if stands(n) => Some(WhyLeftOut::Standing),
        why => why.or(unusable[n]).or(unusable[n + 1]),
    };
    let mut labels: Vec<Option<WhyLeftOut>> = (0..steps).map(|n| if kept(n) { None } else { known(n) }).collect();
    let open: Vec<bool> = (0..steps).map(|n| !kept(n) && labels[n].is_none()).collect();
    for (from, to) in series::runs(steps, |n| open[n]) {
        let still: Vec<bool> = (from..to).map(stands).collect();
        for (a, b) in series::runs(to - from, |n| still[n]) {
            labels[from + a..from + b].fill(Some(WhyLeftOut::Standing));
        }
        for (a, b) in series::runs(to - from, |n| !still[n]) {
            let (a, b) = (from + a, from + b);
            let whole = (a, b) == (from, to);
            let at_edge = a == 0 || b == steps;
            let short = (b - a) as f64 <= 1.05 * period;
            let why = if whole && short && (at_edge || (a as f64 > first && (b as f64) < last)) {
                WhyLeftOut::Partial
            } else if (a as f64) < first {
                WhyLeftOut::StartUp
            } else if b as f64 > last {
                WhyLeftOut::Stop
            } else {
                WhyLeftOut::Turn
            };
            labels[a..b].fill(Some(why));
        }
    }
    let mut parts: Vec<(usize, usize, WhyLeftOut)> = Vec::new();
    for (n, label) in labels.iter().enumerate() {
        let Some(why) = *label else { continue };
        match parts.last_mut() {
            Some((_, to, same)) if *to == n && *same == why => *to = n + 1,
            _ => parts.push((n, n + 1, why)),
        }
    }
    parts
        .into_iter()
        .map(|(from, to, why)| LeftOut { from_s: from as f64 / rate, to_s: to as f64 / rate, why })
        .collect()
}
