//! Finds the stride period, the part with most movement, and one event per stride.
//!
//! The event is the upward crossing of the difference of the hips, left minus right, through the middle of its range. Legs are
//! half a stride apart, so the even harmonics cancel in the difference: the rest is close to a sine of twice the amplitude, and both
//! hips contribute to each event. Without two hips the difference of the knees is used; with a single joint, the joint itself, whose
//! swing crosses the middle of its range once upward and once downward. Legs that move together, as in hops, are added instead.
//!
//! A crossing counts if the signal was below the middle by [`HYSTERESIS`] of its half range before and reaches as far above after.

use crate::recording::{Channel, Quantity, Recording};
use crate::series::{correlation, median, quantile, runs, variance};
use crate::stride::period;
use joint_units::Joint;

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
/// Correlation of left and right from which the legs move together.
const TOGETHER: f64 = 0.5;

pub(crate) type Joints<'a> = [Option<&'a [f64]>; Joint::COUNT];

/// First sample of the `length` consecutive samples, none of them `bad`, in which the joints move most (variance, summed over
/// joints).
pub(crate) fn most_active(joints: &Joints<'_>, bad: &[bool], length: usize, step: usize) -> Option<usize> {
    let activity =
        |from: usize| -> f64 { joints.iter().flatten().filter_map(|x| x.get(from..from + length)).map(variance).sum() };
    let starts = (0..(bad.len() + 1).saturating_sub(length)).step_by(step.max(1));
    starts
        .filter(|&from| !bad[from..from + length].contains(&true))
        .map(|from| (from, activity(from)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(from, _)| from)
}

/// The stride period in seconds, if the joints are periodic, or each leg repeats the other half a stride later.
pub(crate) fn period_s(joints: &Joints<'_>, bad: &[bool], rate_hz: f64) -> Option<f64> {
    let usual = stretch(joints, bad, rate_hz, ACTIVE_S)?;
    let found = period::find(&usual).map(|found| found.period_s).or_else(|| period_by_halves(&usual, rate_hz));
    found.or_else(|| Some(period::find_slow(&stretch(joints, bad, rate_hz, SLOW_ACTIVE_S)?)?.period_s))
}

/// The period of a movement that repeats too slowly for a stride, seconds.
pub(crate) fn too_slow_s(joints: &Joints<'_>, bad: &[bool], rate_hz: f64) -> Option<f64> {
    Some(period::find_too_slow(&stretch(joints, bad, rate_hz, SLOW_ACTIVE_S)?)?.period_s)
}

/// The part of up to `most_s` seconds with most movement and without a bad sample.
fn stretch(joints: &Joints<'_>, bad: &[bool], rate_hz: f64, most_s: f64) -> Option<Recording> {
    let longest = runs(bad.len(), |n| !bad[n]).iter().map(|(from, to)| to - from).max()?;
    let length = longest.min((most_s * rate_hz) as usize);
    let from = most_active(joints, bad, length, if length < longest { (rate_hz / 4.0) as usize } else { 1 })?;
    let stretch = joints.map(|joint| joint.and_then(|x| x.get(from..from + length)));
    let channels = Joint::ALL.into_iter().zip(stretch);
    let channels =
        channels.filter_map(|(joint, x)| x.map(|x| Channel::new(joint.name(), Quantity::Angle, x.to_vec()))).collect();
    let times = (0..length).map(|n| n as f64 / rate_hz).collect();
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

/// The signal with one upward crossing per stride.
pub(crate) fn event_signal(joints: &Joints<'_>) -> Option<Vec<f64>> {
    let difference = |a: &[f64], b: &[f64]| {
        // Of legs that move together the difference is noise; their sum crosses its middle once a stride.
        let sign = if correlation(a, b) > TOGETHER { 1.0 } else { -1.0 };
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
