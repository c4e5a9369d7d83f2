//! Learns the templates of a person from a recording, and the phase of every sample, offline.
//!
//! 1. The stride period ([`gait_trace::stride::period`]) over the window.
//! 2. A first phase: the measured joint demodulated at that period under a Hann window of two strides, without lag.
//! 3. Fourier series of every joint in that phase, by least squares over the window.
//! 4. The phase again: `phi += sum_j e_j S_j' / sum_j S_j'^2`, both sums under a Hann window of 0.6 strides; then 3 again, six times.
//!
//! The phase is 0 at the largest flexion of the left hip (without a left hip, of the measured joint). It uses later samples and all joints,
//! which a follower cannot: it is the reference for the follower, not its input.

use crate::fit::LEAST_RANGE_DEG;
use cpg_core::BuildError;
use cpg_core::entrainment::phase_lock::{TEMPLATE_HARMONICS, Template};
use cpg_core::waveform::shape::Shape;
use gait_trace::Recording;
use gait_trace::stride::period;
use joint_units::{Joint, Phase, Radians};
use std::f64::consts::TAU;
use std::ops::Range;

/// Sampling rate of the analysis; gait has no content above 20 Hz.
pub const RATE_HZ: f64 = 200.0;

/// Windows begin within this time: by then the person walks.
pub const SEARCH_S: f64 = 120.0;

/// Coefficients of a template: mean, cosines, sines.
const TERMS: usize = 1 + 2 * TEMPLATE_HARMONICS;

/// What was learned.
#[derive(Debug, Clone)]
pub struct Learned {
    /// Template of each joint of the recording.
    pub templates: [Option<Template>; Joint::COUNT],
    /// Mean stride of the window, s.
    pub stride_s: f64,
    /// The window of the templates: seconds from the first row.
    pub window_s: (f64, f64),
    /// Phase in cycles, unwrapped, at [`RATE_HZ`] from the first row of the recording on.
    pub phase: Vec<f64>,
}

impl Learned {
    /// Phase in cycles at a time since the first row, constant before and after the recording.
    #[must_use]
    pub fn phase_at(&self, time_s: f64) -> f64 {
        let place = (time_s * RATE_HZ).max(0.0);
        let last = self.phase.len() - 1;
        let n = (place as usize).min(last);
        let next = (n + 1).min(last);
        self.phase[n] + (self.phase[next] - self.phase[n]) * (place - n as f64).min(1.0)
    }

    /// Angular frequency at a time, averaged over half a stride to either side, rad/s.
    #[must_use]
    pub fn frequency_at(&self, time_s: f64) -> f64 {
        let half = 0.5 * self.stride_s;
        let end = (self.phase.len() - 1) as f64 / RATE_HZ;
        let (from, to) = ((time_s - half).max(0.0), (time_s + half).min(end));
        TAU * (self.phase_at(to) - self.phase_at(from)) / (to - from)
    }
}

impl Learned {
    /// Takes missing templates from another person. The phase then has that person's origin, at which the templates of the measured joint are
    /// most alike.
    ///
    /// # Errors
    /// None for learned templates; the core checks the shifted series.
    pub fn completed(mut self, other: &Self, sensor: Joint) -> Result<Self, BuildError> {
        let (Some(mine), Some(theirs)) = (self.templates[sensor as usize], other.templates[sensor as usize]) else {
            return Ok(self);
        };
        if self.templates.iter().all(Option::is_some) {
            return Ok(self);
        }
        let turn = lead(&mine, &theirs);
        for (template, other) in self.templates.iter_mut().zip(&other.templates) {
            *template = match template {
                Some(own) => Some(turned(own, turn)?),
                None => *other,
            };
        }
        self.phase.iter_mut().for_each(|phase| *phase -= turn);
        Ok(self)
    }

    /// Shifts the phase to the origin of another template of the measured joint.
    pub fn count_as(&mut self, template: &Template, sensor: Joint) {
        if let Some(mine) = &self.templates[sensor as usize] {
            let turn = lead(mine, template);
            self.phase.iter_mut().for_each(|phase| *phase -= turn);
        }
    }
}

/// The shift, in cycles, at which two templates are most alike: `mine(phi + shift)` and `theirs(phi)`.
fn lead(mine: &Template, theirs: &Template) -> f64 {
    let alike = |turn: usize| -> f64 {
        let by = turn as f64 / 1000.0;
        (0..100).map(|n| f64::from(n) / 100.0).map(|c| angle_deg(mine, c + by) * angle_deg(theirs, c)).sum()
    };
    (0..1000).max_by(|&a, &b| alike(a).total_cmp(&alike(b))).unwrap_or(0) as f64 / 1000.0
}

/// The template shifted by a part of a cycle: `S(phi + cycles)`.
fn turned(template: &Template, cycles: f64) -> Result<Template, BuildError> {
    let (mean, cos, sin) = template.coefficients();
    let (mut c, mut s) = (*cos, *sin);
    for n in 0..TEMPLATE_HARMONICS {
        let (sn, cn) = (TAU * cycles * (n + 1) as f64).sin_cos();
        let (a, b) = (f64::from(cos[n]), f64::from(sin[n]));
        (c[n], s[n]) = ((a * cn + b * sn) as f32, (b * cn - a * sn) as f32);
    }
    Template::new(Radians(mean), c, s)
}

/// Why nothing can be learned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// The recording has no channel of the sensor's joint.
    #[error(transparent)]
    Channel(#[from] gait_trace::NoChannel),
    /// The recording cannot be resampled.
    #[error(transparent)]
    Rate(#[from] gait_trace::ResampleError),
    /// No stride period.
    #[error(
        "no stride period in {window_s:.1} s, so no template can be learned; allowed are two strides or more of steady walking"
    )]
    NoStride {
        /// Duration that was searched, s.
        window_s: f64,
    },
    /// The joint with the sensor does not move.
    #[error(
        "{joint} does not move (range {range_deg:.2} degrees), so its sensor shows no phase; allowed is --sensor with a joint that moves by {LEAST_RANGE_DEG} degree or more"
    )]
    Still {
        /// The joint.
        joint: &'static str,
        /// Its range, degrees.
        range_deg: f64,
    },
    /// The core refuses the series.
    #[error(transparent)]
    Template(#[from] BuildError),
}

/// Learns from a window of `window_s` seconds, and finds the phase of all rows. The window is the first one, or, if that has no period, the
/// most periodic one among those that begin within [`SEARCH_S`].
///
/// # Errors
/// See [`LearnError`].
pub fn learn(recording: &Recording, sensor: Joint, window_s: f64) -> Result<Learned, LearnError> {
    learn_without(recording, sensor, window_s, &[])
}

/// As [`learn`], without the given spans, in seconds from the first row, in which nothing was measured.
///
/// # Errors
/// See [`LearnError`].
pub fn learn_without(
    recording: &Recording,
    sensor: Joint,
    window_s: f64,
    left_out: &[(f64, f64)],
) -> Result<Learned, LearnError> {
    let even = recording.resample(RATE_HZ)?;
    let measured = even.of_joint(sensor)?.values().to_vec();
    let rows = measured.len();
    let known: Vec<bool> = (0..rows)
        .map(|row| row as f64 / RATE_HZ)
        .map(|time| !left_out.iter().any(|&(from, to)| (from..=to).contains(&time)))
        .collect();
    let moves = measured.iter().zip(&known).filter(|(_, known)| **known).map(|(angle, _)| *angle);
    let (least, most) = moves.fold((f64::MAX, f64::MIN), |(least, most), angle| (angle.min(least), angle.max(most)));
    if most - least < LEAST_RANGE_DEG {
        return Err(LearnError::Still { joint: sensor.name(), range_deg: (most - least).max(0.0) });
    }
    let (window, period_s) = window(&even, &known, window_s)
        .ok_or(LearnError::NoStride { window_s: rows.saturating_sub(1) as f64 / RATE_HZ })?;
    let joints: [Option<Vec<f64>>; Joint::COUNT] = Joint::ALL.map(|joint| {
        if joint == sensor {
            return Some(measured.clone());
        }
        even.channel(joint.name()).ok().map(|channel| channel.values().to_vec())
    });

    let mut phase = demodulated(&measured, period_s);
    let mut series = fitted(&joints, &phase, &window, &known);
    for _ in 0..6 {
        refine(&mut phase, &joints, &series, &known, period_s);
        series = fitted(&joints, &phase, &window, &known);
    }
    // Phase 0 is the largest flexion of the first joint.
    let first = if series[0].is_some() { 0 } else { sensor as usize };
    let top = series[first].as_ref().map_or(0.0, top);
    phase.iter_mut().for_each(|phase| *phase -= top);
    let whole = phase[0].floor();
    phase.iter_mut().for_each(|phase| *phase -= whole);
    let series = fitted(&joints, &phase, &window, &known);
    let mut templates = [None; Joint::COUNT];
    for (template, series) in templates.iter_mut().zip(&series) {
        *template = series.as_ref().map(template_of).transpose()?;
    }
    let strides = phase[window.end - 1] - phase[window.start];
    let seconds = |row: usize| row as f64 / RATE_HZ;
    let (from, to) = (seconds(window.start), seconds(window.end - 1));
    Ok(Learned { templates, stride_s: (to - from) / strides, window_s: (from, to), phase })
}

/// The rows of the window, and their stride period.
fn window(even: &Recording, known: &[bool], window_s: f64) -> Option<(Range<usize>, f64)> {
    let (rows, length, second) = (known.len(), (window_s * RATE_HZ) as usize + 1, RATE_HZ as usize);
    let at = |start: usize| {
        let window = start..rows.min(start + length);
        let found = period::find(&part(even, &window)?)?;
        // A constant signal would be periodic, too.
        let holes = known[window.clone()].iter().filter(|known| !**known).count();
        let long = window.len() as f64 >= 1.5 * found.period_s * RATE_HZ && 2 * window.len() >= length.min(rows);
        let enough = long && 4 * holes <= window.len();
        enough.then_some((window, found))
    };
    let first = at(0);
    let best = || {
        let starts = (second..rows.min((SEARCH_S * RATE_HZ) as usize)).step_by(second);
        starts.filter_map(at).max_by(|(_, one), (_, two)| one.likeness.total_cmp(&two.likeness))
    };
    first.or_else(best).map(|(window, found)| (window, found.period_s))
}

/// Some rows of a recording.
fn part(even: &Recording, rows: &Range<usize>) -> Option<Recording> {
    let channels = even.channels().iter();
    let channels =
        channels.map(|c| gait_trace::Channel::new(c.name(), c.quantity(), c.values()[rows.clone()].to_vec())).collect();
    Recording::build(even.time_s()[rows.clone()].to_vec(), channels).ok()
}

/// A Hann window of `half` rows to either side.
fn hann(half: usize) -> Vec<f64> {
    (0..=2 * half).map(|n| 0.5 - 0.5 * (TAU * (n + 1) as f64 / (2 * half + 2) as f64).cos()).collect()
}

/// Sum of `values` under a window around each row, within the recording.
fn smoothed(values: &[f64], window: &[f64]) -> Vec<f64> {
    let half = window.len() / 2;
    (0..values.len())
        .map(|row| {
            let (from, to) = (row.saturating_sub(half), (row + half).min(values.len() - 1));
            let skipped = from + half - row;
            values[from..=to].iter().zip(&window[skipped..]).map(|(value, weight)| value * weight).sum()
        })
        .collect()
}

fn demodulated(values: &[f64], period_s: f64) -> Vec<f64> {
    let window = hann((period_s * RATE_HZ) as usize);
    let ones = smoothed(&vec![1.0; values.len()], &window);
    let mean: Vec<f64> = smoothed(values, &window).iter().zip(&ones).map(|(sum, weight)| sum / weight).collect();
    let cycles = |row: usize| row as f64 / (RATE_HZ * period_s);
    let part = |of: fn(f64) -> f64| -> Vec<f64> {
        let turned = values.iter().zip(&mean).enumerate();
        smoothed(&turned.map(|(row, (v, m))| (v - m) * of(TAU * cycles(row))).collect::<Vec<_>>(), &window)
    };
    // Of A cos(w t + a): the cosine part is A/2 cos a, the sine part -A/2 sin a.
    let (cos, sin) = (part(f64::cos), part(f64::sin));
    let mut before = 0.0;
    let angles = cos.iter().zip(&sin).enumerate();
    angles
        .map(|(row, (&c, &s))| {
            let lead: f64 = (-s).atan2(c) / TAU;
            before = lead + (before - lead).round();
            before + cycles(row)
        })
        .collect()
}

fn basis(phase: f64) -> [f64; TERMS] {
    let mut terms = [1.0; TERMS];
    for n in 0..TEMPLATE_HARMONICS {
        let (sin, cos) = (TAU * phase * (n + 1) as f64).sin_cos();
        (terms[1 + 2 * n], terms[2 + 2 * n]) = (cos, sin);
    }
    terms
}

type Series = [f64; TERMS];

/// Least squares of each joint over the measured rows of the window.
fn fitted(
    joints: &[Option<Vec<f64>>; Joint::COUNT],
    phase: &[f64],
    window: &Range<usize>,
    known: &[bool],
) -> [Option<Series>; Joint::COUNT] {
    let rows = window.clone().filter(|&row| known[row]);
    let rows: Vec<(usize, Series)> = rows.map(|row| (row, basis(phase[row]))).collect();
    let mut normal = [[0.0; TERMS]; TERMS];
    for (_, row) in &rows {
        for (i, a) in row.iter().enumerate() {
            for (j, b) in row.iter().enumerate() {
                normal[i][j] += a * b;
            }
        }
    }
    std::array::from_fn(|joint| {
        joints[joint].as_ref().map(|values| {
            let mut right = [0.0; TERMS];
            for (row, terms) in &rows {
                for (sum, term) in right.iter_mut().zip(terms) {
                    *sum += term * values[*row];
                }
            }
            solved(normal, right)
        })
    })
}

/// Gauss elimination with pivoting; the matrix is that of sines over whole strides, nearly diagonal.
fn solved(mut matrix: [[f64; TERMS]; TERMS], mut right: Series) -> Series {
    for column in 0..TERMS {
        let pivot = (column..TERMS).max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs()));
        let pivot = pivot.unwrap_or(column);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let leading = matrix[column];
        for row in column + 1..TERMS {
            let factor = matrix[row][column] / leading[column];
            for (value, lead) in matrix[row].iter_mut().zip(leading) {
                *value -= factor * lead;
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..TERMS).rev() {
        let rest: f64 = (row + 1..TERMS).map(|k| matrix[row][k] * right[k]).sum();
        right[row] = (right[row] - rest) / matrix[row][row];
    }
    right
}

/// Value and slope per cycle.
fn at(series: &Series, phase: f64) -> (f64, f64) {
    let terms = basis(phase);
    let mut point = (series[0], 0.0);
    for n in 0..TEMPLATE_HARMONICS {
        let (a, b, cos, sin) = (series[1 + 2 * n], series[2 + 2 * n], terms[1 + 2 * n], terms[2 + 2 * n]);
        point.0 += a * cos + b * sin;
        point.1 += TAU * (n + 1) as f64 * (b * cos - a * sin);
    }
    point
}

fn refine(phase: &mut [f64], joints: &[Option<Vec<f64>>], series: &[Option<Series>], known: &[bool], period_s: f64) {
    let window = hann((0.3 * period_s * RATE_HZ) as usize);
    let (mut pull, mut weight) = (vec![0.0; phase.len()], vec![0.0; phase.len()]);
    for (values, series) in joints.iter().zip(series) {
        let (Some(values), Some(series)) = (values, series) else { continue };
        for (row, (value, &phase)) in values.iter().zip(phase.iter()).enumerate().filter(|(row, _)| known[*row]) {
            let (angle, slope) = at(series, phase);
            pull[row] += (value - angle) * slope;
            weight[row] += slope * slope;
        }
    }
    let (pull, weight) = (smoothed(&pull, &window), smoothed(&weight, &window));
    for (phase, (pull, weight)) in phase.iter_mut().zip(pull.iter().zip(&weight)) {
        *phase += (pull / weight.max(1e-9)).clamp(-0.05, 0.05);
    }
}

/// Where a series is largest, in cycles.
fn top(series: &Series) -> f64 {
    let best = (0..2000).max_by(|&a, &b| at(series, a as f64 / 2e3).0.total_cmp(&at(series, b as f64 / 2e3).0));
    best.unwrap_or(0) as f64 / 2e3
}

fn template_of(series: &Series) -> Result<Template, BuildError> {
    let part = |from: usize| std::array::from_fn(|n| series[from + 2 * n].to_radians() as f32);
    Template::new(Radians(series[0].to_radians() as f32), part(1), part(2))
}

/// The angle of a template at a phase in cycles, degrees.
#[must_use]
pub fn angle_deg(template: &Template, cycles: f64) -> f64 {
    f64::from(template.at(Phase::from_cycles(cycles.rem_euclid(1.0) as f32)).angle).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait_trace::{Channel, Quantity};

    /// A person whose stride time varies by a tenth: phase and templates are found.
    #[test]
    fn a_wandering_phase_comes_back() {
        let cycles = |t: f64| t / 1.1 + 0.05 * (0.9 * t).sin();
        let hip = |c: f64| 5.0 + 20.0 * (TAU * c).cos() + 3.0 * (2.0 * TAU * c).sin();
        let knee = |c: f64| 25.0 - 20.0 * (TAU * c + 0.5).cos() + 9.0 * (2.0 * TAU * c).cos();
        let times: Vec<f64> = (0..6000).map(|n| f64::from(n) * 0.005).collect();
        let channel = |name: &str, of: &dyn Fn(f64) -> f64| {
            Channel::new(name, Quantity::Angle, times.iter().map(|&t| of(cycles(t))).collect())
        };
        let channels = vec![channel("left_hip", &hip), channel("left_knee", &knee)];
        let recording = Recording::build(times.clone(), channels).unwrap();
        let learned = learn(&recording, Joint::LeftHip, 12.0).unwrap();
        assert!(learned.templates[1].is_none() && learned.templates[3].is_none());
        let first = learned.phase_at(15.0) - cycles(15.0);
        for &t in times.iter().filter(|&&t| (1.0..29.0).contains(&t)) {
            assert!((learned.phase_at(t) - cycles(t) - first).abs() < 0.004, "{t} s");
            let template = learned.templates[2].unwrap();
            assert!((angle_deg(&template, learned.phase_at(t)) - knee(cycles(t))).abs() < 1.0, "{t} s");
        }
        let template = learned.templates[0].unwrap();
        assert!((0..100).all(|n| angle_deg(&template, f64::from(n) / 100.0) <= angle_deg(&template, 0.0) + 0.01));
    }

    /// A recording of one knee gets the other joints of a complete one, at the same phase.
    #[test]
    fn a_knee_alone_is_completed_in_phase() {
        let times: Vec<f64> = (0..3000).map(|n| f64::from(n) * 0.005).collect();
        let hip = |c: f64| 5.0 + 20.0 * (TAU * c).cos();
        let knee = |c: f64| 30.0 - 20.0 * (TAU * c + 0.5).cos() + 12.0 * (2.0 * TAU * c).cos();
        let channel = |name: &str, period: f64, of: &dyn Fn(f64) -> f64| {
            Channel::new(name, Quantity::Angle, times.iter().map(|t| of(t / period + 0.3)).collect())
        };
        let whole = vec![channel("left_hip", 1.1, &hip), channel("left_knee", 1.1, &knee)];
        let whole = learn(&Recording::build(times.clone(), whole).unwrap(), Joint::LeftKnee, 12.0).unwrap();
        let alone = vec![channel("knee", 1.3, &|c| 10.0 + 0.8 * knee(c))];
        let alone = learn(&Recording::build(times.clone(), alone).unwrap(), Joint::LeftKnee, 12.0).unwrap();
        let alone = alone.completed(&whole, Joint::LeftKnee).unwrap();
        let own = alone.templates[2].unwrap();
        for n in 0..50 {
            let c = f64::from(n) / 50.0;
            assert!((angle_deg(&own, c) - 10.0 - 0.8 * angle_deg(&whole.templates[2].unwrap(), c)).abs() < 1.0);
        }
        assert_eq!(alone.templates[0], whole.templates[0]);
        let t = 7.3;
        assert!((angle_deg(&own, alone.phase_at(t)) - 10.0 - 0.8 * knee(t / 1.3 + 0.3)).abs() < 1.0);
    }

    /// Ten seconds of standing, then a walk with a gap of two seconds: the templates are of the walk alone.
    #[test]
    fn standing_and_what_was_not_measured_teach_nothing() {
        let times: Vec<f64> = (0..8000).map(|n| f64::from(n) * 0.005).collect();
        let cycles = |t: f64| ((t - 10.0) / 1.2).max(0.0);
        let lost = (15.0, 17.0);
        let hip = |t: f64| 5.0 + 20.0 * (TAU * cycles(t)).cos() + 3.0 * (2.0 * TAU * cycles(t)).sin();
        let values = times.iter().map(|&t| if (lost.0..lost.1).contains(&t) { 60.0 } else { hip(t) }).collect();
        let recording =
            Recording::build(times.clone(), vec![Channel::new("left_hip", Quantity::Angle, values)]).unwrap();
        let learned = learn_without(&recording, Joint::LeftHip, 12.0, &[lost]).unwrap();
        assert!(learned.window_s.0 >= 9.0 && (learned.stride_s - 1.2).abs() < 0.01, "{:?}", learned.window_s);
        let template = learned.templates[0].unwrap();
        for t in [13.3, 14.4, 18.5, 25.0, 33.3] {
            let off = angle_deg(&template, learned.phase_at(t)) - hip(t);
            assert!(off.abs() < 0.5, "{t} s: {off}");
        }
    }

    #[test]
    fn what_does_not_walk_is_refused() {
        let times: Vec<f64> = (0..2000).map(|n| f64::from(n) * 0.005).collect();
        let noise = times.iter().map(|t| (t * t * 7.0).sin() * 3.0).collect();
        let recording = Recording::build(times, vec![Channel::new("left_hip", Quantity::Angle, noise)]).unwrap();
        let error = learn(&recording, Joint::LeftHip, 12.0).unwrap_err();
        assert!(error.to_string().contains("no stride period in 10.0 s"), "{error}");
    }
}
