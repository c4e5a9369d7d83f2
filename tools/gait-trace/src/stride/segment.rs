//! Finds the stride period, the part with most movement, and one event per stride.
//!
//! The event is the upward crossing of the difference of the hips, left minus right, through the middle of its range. Legs are
//! half a stride apart, so the even harmonics cancel in the difference: the rest is close to a sine of twice the amplitude, and both
//! hips contribute to each event. Without two hips the difference of the knees is used; with a single joint, the joint itself, whose
//! swing crosses the middle of its range once upward and once downward. Legs that move together, as in hops, are added instead.
//!
//! The period is that of the part with most movement, or, where that part does not repeat, of the part that repeats best. Range and sign of
//! the legs are those of a part with most movement that repeats, so that other movement in the recording changes neither.
//!
//! A crossing counts if the signal was below the middle by [`HYSTERESIS`] of its half range before and reaches as far above after.

use crate::recording::{Channel, Quantity, Recording};
use crate::series::{correlation, median, quantile, runs, variance};
use crate::stride::period;
use joint_units::Joint;
use std::ops::Range;

/// Distance from the middle of its range that a signal must reach between two crossings, as a fraction of half the range.
pub const HYSTERESIS: f64 = 0.3;
/// Shortest and longest stride within a bout of walking, as fractions of the median stride.
pub const REGULAR: (f64, f64) = (0.7, 1.4);

/// If an event is within this many strides of an end of the recording, the bout extends to that end.
const EDGE: f64 = 1.6;
/// Length of the part with most movement in which the period is searched, seconds.
const ACTIVE_S: f64 = 8.0;
/// The same for slow strides.
const SLOW_ACTIVE_S: f64 = 24.0;
/// Least movement of a part that is searched because the part with most movement does not repeat, as a fraction of the movement of that one.
const ELSEWHERE: f64 = 0.05;
/// About the largest number of such parts.
const MOST_PARTS: usize = 500;
/// Correlation of left and right from which the legs move together.
const TOGETHER: f64 = 0.5;

pub(crate) type Joints<'a> = [Option<&'a [f64]>; Joint::COUNT];

/// Variances of the joints in some samples, summed.
fn activity(joints: &Joints<'_>, samples: &Range<usize>) -> f64 {
    joints.iter().flatten().filter_map(|x| x.get(samples.clone())).map(variance).sum()
}

/// First samples of parts of `length` samples `within` these, none of them `bad`, with the movement in each.
pub(crate) fn movements(
    joints: &Joints<'_>,
    bad: &[bool],
    within: &Range<usize>,
    length: usize,
    step: usize,
) -> Vec<(usize, f64)> {
    // Multiples of the step, and the first sample of each run: a run that is little longer than `length` may hold no multiple.
    let starts = runs(bad.len(), |n| !bad[n]).into_iter().flat_map(|(from, to)| {
        let (from, to) = (from.max(within.start), to.min(within.end));
        let last = (to + 1).saturating_sub(length);
        let multiples = (from.next_multiple_of(step.max(1))..last).step_by(step.max(1));
        std::iter::once(from).filter(move |&from| from < last).chain(multiples)
    });
    starts.map(|from| (from, activity(joints, &(from..from + length)))).collect()
}

/// The stride period of a recording, and the part that shows it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Periodic {
    pub(crate) period_s: f64,
    /// All samples where the part with most movement repeats.
    within: Range<usize>,
}

impl Periodic {
    /// All of so many samples, which repeat.
    pub(crate) const fn all(samples: usize, period_s: f64) -> Self {
        Self { period_s, within: 0..samples }
    }

    /// The samples that show the gait: of the first of these lengths for which there are any, those with most movement that repeats and
    /// none `bad`; where nothing of these lengths repeats, those with most movement.
    pub(crate) fn typical(
        &self,
        joints: &Joints<'_>,
        bad: &[bool],
        rate_hz: f64,
        lengths: impl Iterator<Item = usize>,
    ) -> Option<Range<usize>> {
        let period = self.period_s * rate_hz;
        let repeats = |samples: &Range<usize>| {
            let parts = joints.iter().flatten().filter_map(|x| x.get(samples.clone()));
            let varying: Vec<(&[f64], f64)> = parts.map(|x| (x, variance(x))).filter(|(_, v)| *v > 0.0).collect();
            period::likeness(&varying, period.round() as usize) >= period::LEAST_LIKENESS
        };
        let mut most: Option<Range<usize>> = None;
        for length in lengths {
            let mut parts = movements(joints, bad, &self.within, length, (period / 8.0) as usize);
            // Of equals the last one is first.
            parts.sort_by(|a, b| b.1.total_cmp(&a.1).then(b.0.cmp(&a.0)));
            let mut parts = parts.into_iter().map(|(from, _)| from..from + length).peekable();
            most = most.or(parts.peek().cloned());
            // A single stride does not repeat in itself.
            let found = parts.filter(|_| length as f64 > 1.9 * period).find(repeats);
            if found.is_some() {
                return found;
            }
        }
        most
    }
}

/// The stride period, if the joints are periodic, or each leg repeats the other half a stride later.
///
/// It is that of the part with most movement. Where that part does not repeat, as the exercises before a walk do not, another part that
/// clearly does is taken.
pub(crate) fn periodic(joints: &Joints<'_>, bad: &[bool], rate_hz: f64) -> Option<Periodic> {
    let all = |period_s| Some(Periodic::all(bad.len(), period_s));
    let most = stretch(joints, bad, rate_hz, ACTIVE_S)?;
    let usual = part(joints, &most, rate_hz)?;
    let found = period::find(&usual).map(|found| found.period_s).or_else(|| period_by_halves(&usual, rate_hz));
    if let Some(period_s) = found {
        return all(period_s);
    }
    let slow = period::find_slow(&part(joints, &stretch(joints, bad, rate_hz, SLOW_ACTIVE_S)?, rate_hz)?);
    let elsewhere = elsewhere(joints, bad, rate_hz, ELSEWHERE * activity(joints, &most));
    match (slow, elsewhere) {
        (Some(slow), Some((stride, _))) if slow.likeness >= stride.likeness => all(slow.period_s),
        (_, Some((stride, within))) => Some(Periodic { period_s: stride.period_s, within }),
        (slow, None) => all(slow?.period_s),
    }
}

/// The stride of the part that repeats best, of all parts of [`ACTIVE_S`] that move by `least` or more, and the part. Where none repeats,
/// parts of half that length are tried, and whole runs that are shorter.
fn elsewhere(joints: &Joints<'_>, bad: &[bool], rate_hz: f64, least: f64) -> Option<(period::Stride, Range<usize>)> {
    let runs = runs(bad.len(), |n| !bad[n]);
    [ACTIVE_S, 0.5 * ACTIVE_S].into_iter().find_map(|most_s| {
        let most = (most_s * rate_hz) as usize;
        let step = (most / 4).max(bad.len() / MOST_PARTS).max(1);
        let parts = runs.iter().flat_map(|&(from, to)| {
            let length = most.min(to - from);
            (from..to - length).step_by(step).chain([to - length]).map(move |from| from..from + length)
        });
        let strides = parts.filter(|samples| activity(joints, samples) >= least).filter_map(|samples| {
            let stride = period::find_surely(&part(joints, &samples, rate_hz)?)?;
            Some((stride, samples))
        });
        strides.max_by(|a, b| a.0.likeness.total_cmp(&b.0.likeness))
    })
}

/// The period of a movement that repeats too slowly for a stride, seconds.
pub(crate) fn too_slow_s(joints: &Joints<'_>, bad: &[bool], rate_hz: f64) -> Option<f64> {
    let samples = stretch(joints, bad, rate_hz, SLOW_ACTIVE_S)?;
    Some(period::find_too_slow(&part(joints, &samples, rate_hz)?)?.period_s)
}

/// The samples of up to `most_s` seconds with most movement and without a bad one.
fn stretch(joints: &Joints<'_>, bad: &[bool], rate_hz: f64, most_s: f64) -> Option<Range<usize>> {
    let longest = runs(bad.len(), |n| !bad[n]).iter().map(|(from, to)| to - from).max()?;
    let length = longest.min((most_s * rate_hz) as usize);
    let step = if length < longest { (rate_hz / 4.0) as usize } else { 1 };
    let parts = movements(joints, bad, &(0..bad.len()), length, step);
    let (from, _) = parts.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(from..from + length)
}

/// Some samples as a recording of their own.
fn part(joints: &Joints<'_>, samples: &Range<usize>, rate_hz: f64) -> Option<Recording> {
    let parts = joints.map(|joint| joint.and_then(|x| x.get(samples.clone())));
    let channels = Joint::ALL.into_iter().zip(parts);
    let channels =
        channels.filter_map(|(joint, x)| x.map(|x| Channel::new(joint.name(), Quantity::Angle, x.to_vec()))).collect();
    let times = (0..samples.len()).map(|n| n as f64 / rate_hz).collect();
    Recording::build(times, channels).ok()
}

/// The period T at which each leg most resembles the other T / 2 later; for recordings of little more than one stride.
fn period_by_halves(recording: &Recording, rate_hz: f64) -> Option<f64> {
    let joints = Joint::ALL.map(|joint| recording.channel(joint.name()).ok().map(Channel::values));
    let pairs: Vec<[&[f64]; 2]> =
        [0, 2].into_iter().filter_map(|left| Some([joints[left]?, joints[left + 1]?])).collect();
    let samples = pairs.first()?[0].len();
    let overlap = (period::OVERLAP_S * rate_hz) as usize;
    let unlike = |half: usize| -> f64 {
        let one = |a: &[f64], b: &[f64]| {
            let n = (samples - half) as f64;
            let (late, early) = (&a[half..], &b[..samples - half]);
            let offset = late.iter().zip(early).map(|(x, y)| x - y).sum::<f64>() / n;
            let squares: f64 = late.iter().zip(early).map(|(x, y)| (x - y - offset).powi(2)).sum();
            squares / n / (variance(a) + variance(b))
        };
        pairs.iter().map(|[a, b]| 0.5 * (one(a, b) + one(b, a))).sum::<f64>() / pairs.len() as f64
    };
    let first = (0.5 * period::SHORTEST_S * rate_hz) as usize;
    let last = ((0.5 * period::USUAL_S * rate_hz) as usize).min(samples.checked_sub(overlap)?).min(samples / 2 + 1);
    let r: Vec<f64> = (first..=last.max(first)).map(|half| 1.0 - unlike(half)).collect();
    let peak = (1..r.len().saturating_sub(1))
        .filter(|&i| r[i] > r[i - 1] && r[i] >= r[i + 1] && r[i] >= period::LEAST_LIKENESS)
        .max_by(|&a, &b| r[a].total_cmp(&r[b]))?;
    Some(2.0 * (first + peak) as f64 / rate_hz)
}

/// The signal with one upward crossing per stride of a gait that these samples show.
pub(crate) fn event_signal(joints: &Joints<'_>, typical: &Range<usize>) -> Option<Vec<f64>> {
    let difference = |a: &[f64], b: &[f64]| {
        // Of legs that move together the difference is noise; their sum crosses its middle once a stride.
        let sign = if correlation(&a[typical.clone()], &b[typical.clone()]) > TOGETHER { 1.0 } else { -1.0 };
        a.iter().zip(b).map(|(a, b)| a + sign * b).collect()
    };
    match joints {
        [Some(left), Some(right), ..] | [_, _, Some(left), Some(right)] => Some(difference(left, right)),
        [Some(x), ..] | [_, Some(x), ..] | [_, _, Some(x), _] | [_, _, _, Some(x)] => Some(x.to_vec()),
        [None, None, None, None] => None,
    }
}

/// Places, in samples, of the upward crossings of `signal` through the middle of the range of `typical`.
pub(crate) fn crossings(signal: &[f64], typical: &[f64]) -> Vec<f64> {
    let (low, high) = (quantile(typical.iter().copied(), 0.05), quantile(typical.iter().copied(), 0.95));
    let (middle, reach) = (0.5 * (low + high), 0.5 * HYSTERESIS * (high - low));
    let mut places = Vec::new();
    let mut was_low = false;
    let mut crossing = None;
    for (n, pair) in signal.windows(2).enumerate() {
        let (here, next) = (pair[0] - middle, pair[1] - middle);
        if here < -reach {
            was_low = true;
        }
        if here <= 0.0 && next > 0.0 {
            crossing = Some(n as f64 - here / (next - here));
        }
        // The last crossing before the signal is clearly above counts.
        if next > reach && was_low {
            places.extend(crossing.take());
            was_low = false;
        }
    }
    places
}

/// A bout of uninterrupted walking: its events, and the places to which it may extend, in samples.
#[derive(Debug, Clone)]
pub(crate) struct Bout {
    pub events: Vec<f64>,
    pub from: f64,
    pub to: f64,
    /// Median distance of the events; the period of the recording if there is only one event.
    pub period: f64,
}

impl Bout {
    /// The place `phase` strides after the first event.
    pub(crate) fn place(&self, phase: f64) -> f64 {
        let last = self.events.len() - 1;
        let k = phase.floor().clamp(0.0, last.saturating_sub(1) as f64) as usize;
        let length = match self.events.get(k + 1) {
            // Beyond the events the period of the bout is a better estimate than its last stride.
            Some(next) if phase >= 0.0 && phase <= last as f64 => next - self.events[k],
            _ => self.period,
        };
        let anchor = if phase > last as f64 { last } else { k };
        self.events[anchor] + (phase - anchor as f64) * length
    }

    /// The cuts at the fraction `offset` of each stride.
    pub(crate) fn cuts(&self, offset: f64) -> Vec<f64> {
        let strides = self.events.len() as i64 + 2;
        let places = (-2..strides).map(|k| self.place(k as f64 + offset));
        // A cut outside by a rounding error counts as at the edge.
        places.filter(|place| *place >= self.from - 1e-6 && *place <= self.to + 1e-6).collect()
    }
}

/// Groups the events into bouts of regular strides.
pub(crate) fn bouts(events: &[f64], period: f64, samples: usize) -> Vec<Bout> {
    let regular = |length: f64| length >= REGULAR.0 * period && length <= REGULAR.1 * period;
    let mut groups: Vec<Vec<f64>> = Vec::new();
    for &event in events {
        match groups.last_mut() {
            Some(group) if group.last().is_some_and(|last| regular(event - last)) => group.push(event),
            _ => groups.push(vec![event]),
        }
    }
    let alone = groups.len() == 1;
    groups.retain(|group| group.len() > 1 || alone);
    let end = (samples - 1) as f64;
    let edges: Vec<(f64, f64)> = groups.iter().filter_map(|g| Some((*g.first()?, *g.last()?))).collect();
    let reach = |group: usize| {
        let before = group.checked_sub(1).map_or(0.0, |before| edges[before].1);
        let after = edges.get(group + 1).map_or(end, |after| after.0);
        // Up to the end of the recording if a crossing beyond it may be missing, else one stride.
        let (first, last) = edges[group];
        let from = if first < EDGE * period { 0.0 } else { first - period };
        let to = if end - last < EDGE * period { end } else { last + period };
        (from.max(before), to.min(after))
    };
    let reaches: Vec<(f64, f64)> = (0..groups.len()).map(reach).collect();
    let bout = |(events, (from, to)): (Vec<f64>, (f64, f64))| {
        let period = match events.len() {
            1 => period,
            _ => median(events.windows(2).map(|pair| pair[1] - pair[0])),
        };
        Bout { events, from, to, period }
    };
    groups.into_iter().zip(reaches).map(bout).collect()
}
