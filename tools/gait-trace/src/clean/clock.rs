//! Evaluates the time column: rows to keep, nominal rate, and resampling of the joints to equal time steps.

use crate::clean::condition_error::{ConditionError, LONGEST_GAP_S};
use crate::clean::received::{self, Delays};
use crate::clean::repair;
use crate::clean::resample::MAX_SAMPLES;
use crate::clean::rules::{FEWEST_ROWS, MOST_PERCENT_ROWS, Rules};
use crate::clean::two_recordings;
use crate::finding::{Done, Finding, FindingKind};
use crate::format::time_step;
use crate::raw::RawJoints;
use crate::series::{quantile, range, runs, upper_median};
use joint_units::Joint;

/// The evaluated time column.
pub(crate) struct Clock {
    /// Rows that are kept.
    rows: Vec<usize>,
    /// Their times from the first row.
    times: Vec<f64>,
    pub(crate) rate_hz: f64,
    pub(crate) samples: usize,
    /// The rows already have equal time steps.
    is_even: bool,
    /// Rows farther apart than this have a gap in between, in seconds.
    hole_s: f64,
    pub(crate) start_s: f64,
    pub(crate) normalised_cycle: bool,
    pub(crate) findings: Vec<Finding>,
}

impl Clock {
    pub(crate) fn of(raw: &RawJoints, rules: &Rules) -> Result<Self, ConditionError> {
        let file = || raw.file.clone();
        if raw.joints.iter().flatten().next().is_none() {
            return Err(ConditionError::NoJoints { file: file() });
        }
        for joint in Joint::ALL {
            if let Some(column) = &raw.joints[joint as usize]
                && column.angle_deg.len() != raw.time_s.len()
            {
                let (found, wanted) = (column.angle_deg.len(), raw.time_s.len());
                return Err(ConditionError::Length { file: file(), joint, found, wanted });
            }
        }
        let mut rows: Vec<usize> = Vec::with_capacity(raw.time_s.len());
        let mut repeated: Vec<usize> = Vec::new();
        let first = raw.time_s.first().copied().unwrap_or_default();
        for (index, &value) in raw.time_s.iter().enumerate() {
            let row = index + 1;
            if !value.is_finite() {
                return Err(ConditionError::TimeNotFinite { file: file(), row, value });
            }
            let before = rows.last().map_or(f64::NEG_INFINITY, |&before| raw.time_s[before]);
            if value < before {
                // A recording that begins again where the one above it did.
                let begins_again = before > first && value - first < 0.1 * (before - first);
                return Err(ConditionError::TimeOrder { file: file(), row, value, before, begins_again });
            }
            if value == before { repeated.push(index) } else { rows.push(index) }
        }
        if rows.len() < FEWEST_ROWS {
            return Err(ConditionError::TooFewRows { file: file(), rows: rows.len() });
        }
        if let Some(why) = two_recordings::of(raw, &rows, &repeated) {
            return Err(ConditionError::SeveralRecordings { file: file(), why });
        }
        let start_s = raw.time_s[rows[0]];
        let mut times: Vec<f64> = rows.iter().map(|&row| raw.time_s[row] - start_s).collect();
        let cycle = Cycle::of(raw, &rows, rules);
        if let (Cycle::None, Some(_)) = (&cycle, rules.stride_s) {
            let (start, end) = (start_s, raw.time_s[rows[rows.len() - 1]]);
            return Err(ConditionError::NoCycle { file: file(), start, end });
        }
        let normalised_cycle = match cycle {
            Cycle::Whole { length } => {
                let scale = rules.stride_s.unwrap_or(1.0);
                times.iter_mut().for_each(|time| *time = *time / length * scale);
                true
            }
            _ => false,
        };

        let delays = raw.received.then(|| received::put_at_equal_steps(&mut times));
        // Computed where they are used: a long recording has millions.
        let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
        let median = upper_median(steps());
        if let (Cycle::Open { length, apart_deg }, true) = (&cycle, median >= time_step::MAX_STEP_S) {
            let (length, apart_deg) = (*length, *apart_deg);
            return Err(ConditionError::OpenCycle { file: file(), length, apart_deg });
        }
        if median >= time_step::MAX_STEP_S && matches!(cycle, Cycle::None) {
            let (likely, heading) = time_step::likely_unit(median);
            return Err(ConditionError::TimeStep { file: file(), step_s: median, likely, heading });
        }
        let end_s = times[times.len() - 1];
        let longest = steps().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((n, gap_s)) = longest.filter(|(_, gap)| *gap > LONGEST_GAP_S.max(end_s - *gap)) {
            let (row, value) = (rows[n + 1] + 1, raw.time_s[rows[n + 1]]);
            return Err(ConditionError::TimeGap { file: file(), row, value, gap_s, rest_s: end_s - gap_s });
        }
        let usual = || steps().filter(|step| *step > 0.5 * median && *step <= 1.5 * median);
        let step = usual().sum::<f64>() / usual().count() as f64;
        let rate_hz = 1.0 / step;
        let samples = (end_s * rate_hz + 0.01).floor();
        // An infinite rate gives NaN samples, which are too many as well.
        if samples.is_nan() || samples >= MAX_SAMPLES as f64 {
            return Err(ConditionError::TooLong { file: file(), duration_s: end_s, rate_hz });
        }
        let samples = samples as usize + 1;
        let is_even = samples == times.len()
            && times.iter().enumerate().all(|(n, time)| (time - n as f64 * step).abs() <= 0.01 * step);

        let mut findings = Vec::new();
        let all = |from_s, to_s, what, done| Finding { from_s, to_s, joint: None, what, done };
        let kind = match (cycle, rules.stride_s) {
            (Cycle::Whole { .. }, None) => Some(FindingKind::NormalisedCycle),
            (Cycle::Whole { .. }, Some(stride_s)) => Some(FindingKind::CycleOf { stride_s }),
            (Cycle::Open { length, apart_deg }, _) => Some(FindingKind::CycleOrSeconds { length, apart_deg }),
            (Cycle::None, _) => None,
        };
        findings.extend(kind.map(|kind| all(0.0, end_s, kind, Done::Reported)));
        if let (Some(&first), Some(&last)) = (repeated.first(), repeated.last()) {
            let kind = FindingKind::RepeatedTimes { rows: repeated.len(), of: raw.time_s.len() };
            findings.push(all(raw.time_s[first] - start_s, raw.time_s[last] - start_s, kind, Done::LeftOut));
        }
        if let Some(Delays { share, are_clear }) = delays {
            let done = if are_clear && share > rules.jitter_share { Done::Resampled } else { Done::Reported };
            findings.push(all(0.0, end_s, FindingKind::ReceivedTimes { share }, done));
        }
        let share = quantile(steps().filter(|s| *s <= 1.5 * median).map(|s| (s / median - 1.0).abs()), 0.95);
        if share > rules.jitter_share {
            findings.push(all(0.0, end_s, FindingKind::UnevenTimes { share }, Done::Resampled));
        }
        let hole_s = 1.5 * median;
        Ok(Self { rows, times, rate_hz, samples, is_even, hole_s, start_s, normalised_cycle, findings })
    }

    /// A column at equal time steps that has values in some rows only, usually one in `block`, with NaN in gaps; and the samples between these
    /// values.
    pub(crate) fn even_of(&self, rows: &[usize], block: usize, column: &[f64]) -> (Vec<f64>, Vec<(usize, usize)>) {
        let kept = self.rows.iter().zip(&self.times).filter(|(row, _)| rows.binary_search(row).is_ok());
        let (values, times): (Vec<f64>, Vec<f64>) = kept.map(|(&row, &time)| (column[row], time)).unzip();
        let mut is_between = vec![true; self.samples];
        for time in &times {
            if let Some(sample) = is_between.get_mut((time * self.rate_hz).round() as usize) {
                *sample = false;
            }
        }
        let even = repair::even(&times, &values, self.rate_hz, self.samples, block as f64 * self.hole_s);
        (even, runs(self.samples, |n| is_between[n]))
    }

    /// A column at equal time steps; NaN in gaps.
    pub(crate) fn even(&self, column: &[f64]) -> Vec<f64> {
        if self.is_even {
            return self.rows.iter().map(|&row| if column[row].is_finite() { column[row] } else { f64::NAN }).collect();
        }
        let known = self.rows.iter().zip(&self.times).filter(|(row, _)| column[**row].is_finite());
        let (values, times): (Vec<f64>, Vec<f64>) = known.map(|(&row, &time)| (column[row], time)).unzip();
        repair::even(&times, &values, self.rate_hz, self.samples, self.hole_s)
    }
}

/// Whether the time axis is a fraction of a cycle.
#[derive(Clone, Copy)]
enum Cycle {
    /// It is: one cycle, of this length of the axis.
    Whole { length: f64 },
    /// It has the length of one, but the ends differ.
    Open { length: f64, apart_deg: f64 },
    /// It is not.
    None,
}

impl Cycle {
    fn of(raw: &RawJoints, rows: &[usize], rules: &Rules) -> Self {
        let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else { return Self::None };
        let (start, end) = (raw.time_s[first], raw.time_s[last]);
        let is = |length: f64| start.abs() < 1e-3 * length && (end - length).abs() < 1e-3 * length;
        let length = if is(1.0) {
            1.0
        } else if is(100.0) && rows.len() <= MOST_PERCENT_ROWS {
            100.0
        } else {
            return Self::None;
        };
        if rules.stride_s.is_some() {
            return Self::Whole { length };
        }
        if repeats(raw, rows, length) {
            return Self::None;
        }
        let mut apart_deg = 0.0_f64;
        let mut closes = true;
        for column in raw.joints.iter().flatten() {
            let known: Vec<f64> = column.angle_deg.iter().copied().filter(|x| x.is_finite()).collect();
            let off = (column.angle_deg[last] - column.angle_deg[first]).abs();
            closes &= off <= rules.cycle_end_deg.max(rules.cycle_end_share * range(&known));
            apart_deg = apart_deg.max(off);
        }
        if closes { Self::Whole { length } } else { Self::Open { length, apart_deg } }
    }
}

/// Most whole cycles that a time from 0 to 1 s can hold.
const MOST_CYCLES: usize = 4;
/// Rows a part of the table apart are the same phase of several cycles if nine in ten differ by less than this share of the range. Rows of one
/// gait cycle differ by more than half of it; the steps of the rows, and strides that differ, make up to 0.14.
const SAME_SHARE: f64 = 0.3;

/// Whether every joint goes through several equal cycles from the first to the last row: the times are seconds then, of a fast gait.
fn repeats(raw: &RawJoints, rows: &[usize], length: f64) -> bool {
    let times: Vec<f64> = rows.iter().map(|&row| raw.time_s[row]).collect();
    let joints: Vec<&[f64]> = raw.joints.iter().flatten().map(|joint| joint.angle_deg.as_slice()).collect();
    let in_parts = |parts: usize| {
        let lag = length / parts as f64;
        let same = |column: &&[f64]| {
            let known: Vec<f64> = rows.iter().map(|&row| column[row]).filter(|x| x.is_finite()).collect();
            let apart = rows.iter().zip(&times).filter_map(|(&row, time)| {
                let later = times.partition_point(|other| *other < time + lag - 1e-6);
                let other = column[*rows.get(later)?];
                Some((column[row] - other).abs()).filter(|apart| apart.is_finite())
            });
            let range = range(&known);
            range > 0.0 && quantile(apart, 0.9) < SAME_SHARE * range
        };
        joints.iter().all(same)
    };
    !joints.is_empty() && (2..=MOST_CYCLES).any(in_parts)
}
