//! Repairs a series of angles: resampling to equal time steps, bridges over gaps, detection of jumps, low-pass.
//!
//! *Resampling.* Time stamps of recorders jitter. Between two rows the value is a cubic with the slopes of the parabolas through each
//! row and its two neighbours. It reproduces a parabola exactly, and a knee in walking to 0.15 degrees at 100 rows a second with each
//! row up to a fifth of a step early or late.
//!
//! *Bridges.* A gap of length L is filled by the cubic with the values and slopes at both ends; each slope is that of a parabola
//! through [`EDGE_S`] of good samples. The error for a smooth curve is at most `L^4 / 384 max |x''''|`.
//!
//! *Jumps.* A leg has mass, so its angle cannot change direction much within 4 ms. The second difference at that scale,
//! `x(t - h) - 2 x(t) + x(t + h)`, is below 2 degrees in recorded walking and sprinting at 200 Hz and above, but 4 to 59 where
//! markers were swapped or lost. At low rates (h is at least one sample) real second differences grow with `h^2`, so
//! the limit also scales with the series' own typical one (median absolute deviation, which a few wrong samples hardly change).
//!
//! Units: degrees, seconds, samples of equal steps.

use crate::series::{median, quantile, runs};

/// Length of the good samples on each side of a gap from which the slope is taken, seconds.
pub const EDGE_S: f64 = 0.04;
/// Time step of the second difference that detects jumps, seconds.
pub const BEND_S: f64 = 0.004;
/// Standard deviation of a normal distribution divided by its median absolute deviation.
const MAD_TO_SD: f64 = 1.4826;

/// Thresholds of a jump; the fields are described at [`crate::Rules`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JumpRule {
    pub least_bend_deg: f64,
    pub usual_bends: f64,
    pub guard_s: f64,
    pub least_step_deg: f64,
    pub least_step_share: f64,
    pub longest_excursion_s: f64,
}

/// A jump in the samples `from..to`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jump {
    pub from: usize,
    pub to: usize,
    /// Lasting offset after it, degrees, if any.
    pub lasting_deg: Option<f64>,
}

/// Resamples rows of uneven times to the times `n / rate`; NaN where two rows are more than `hole_s` apart, and beyond both ends.
pub(crate) fn even(times: &[f64], values: &[f64], rate_hz: f64, samples: usize, hole_s: f64) -> Vec<f64> {
    let near = 1e-3 / rate_hz;
    let slope = |row: usize| {
        let joined = |a: usize, b: usize| times[b] - times[a] <= hole_s;
        let secant = |a: usize, b: usize| (values[b] - values[a]) / (times[b] - times[a]);
        let before = (row > 0 && joined(row - 1, row)).then(|| (secant(row - 1, row), times[row] - times[row - 1]));
        let after = (row + 1 < times.len() && joined(row, row + 1))
            .then(|| (secant(row, row + 1), times[row + 1] - times[row]));
        match (before, after) {
            (Some((s0, h0)), Some((s1, h1))) => (s0 * h1 + s1 * h0) / (h0 + h1),
            (Some((s, _)), None) | (None, Some((s, _))) => s,
            (None, None) => 0.0,
        }
    };
    let mut row = 0;
    (0..samples)
        .map(|n| {
            let time = n as f64 / rate_hz;
            while row + 1 < times.len() && times[row + 1] <= time + near {
                row += 1;
            }
            let Some(&here) = times.get(row) else { return f64::NAN };
            if (time - here).abs() <= near {
                return values[row];
            }
            match times.get(row + 1) {
                Some(&next) if time > here && next - here <= hole_s => {
                    let (h, u) = (next - here, (time - here) / (next - here));
                    hermite(values[row], values[row + 1], slope(row) * h, slope(row + 1) * h, u)
                }
                _ => f64::NAN,
            }
        })
        .collect()
}

/// The cubic with the given values and slopes (per unit of `u`) at `u` = 0 and 1.
fn hermite(x0: f64, x1: f64, s0: f64, s1: f64, u: f64) -> f64 {
    let v = 1.0 - u;
    x0 * v * v * (1.0 + 2.0 * u) + x1 * u * u * (3.0 - 2.0 * u) + s0 * u * v * v - s1 * u * u * v
}

/// Slope per sample at `at`, from the parabola through the good samples that begin there and go in direction `step`.
fn edge_slope(x: &[f64], at: usize, step: isize, rate_hz: f64) -> f64 {
    let wanted = ((EDGE_S * rate_hz).round() as usize).max(2) + 1;
    let mut edge: Vec<f64> = Vec::with_capacity(wanted);
    let mut index = Some(at);
    while let Some(value) = index.and_then(|i| x.get(i)).filter(|value| value.is_finite() && edge.len() < wanted) {
        edge.push(*value);
        index = index.and_then(|i| i.checked_add_signed(step));
    }
    let direction = step as f64;
    match edge.len() {
        0 | 1 => 0.0,
        2 => (edge[1] - edge[0]) * direction,
        n => {
            // Least squares of a + b u + c u^2 at u = 0 .. n-1; b by the orthogonal polynomials on that grid.
            let m = (n - 1) as f64 / 2.0;
            let mean_square = (0..n).map(|u| (u as f64 - m).powi(2)).sum::<f64>() / n as f64;
            let (mut linear, mut linear_norm, mut bent, mut bent_norm) = (0.0, 0.0, 0.0, 0.0);
            for (u, value) in edge.iter().enumerate() {
                let p1 = u as f64 - m;
                let p2 = p1 * p1 - mean_square;
                linear += value * p1;
                linear_norm += p1 * p1;
                bent += value * p2;
                bent_norm += p2 * p2;
            }
            (linear / linear_norm - 2.0 * m * bent / bent_norm) * direction
        }
    }
}

/// Fills `from..to` with a cubic, or with a straight line if the gap is `long`; at an end of the series the nearest value is held.
pub(crate) fn bridge(x: &mut [f64], from: usize, to: usize, rate_hz: f64, long: bool) {
    let left = from.checked_sub(1).filter(|&i| x[i].is_finite());
    let right = Some(to).filter(|&i| i < x.len() && x[i].is_finite());
    match (left, right) {
        (Some(l), Some(r)) => {
            let span = (r - l) as f64;
            let (x0, x1) = (x[l], x[r]);
            let (s0, s1) = if long {
                (x1 - x0, x1 - x0)
            } else {
                (edge_slope(x, l, -1, rate_hz) * span, edge_slope(x, r, 1, rate_hz) * span)
            };
            for (n, value) in x.iter_mut().enumerate().take(to).skip(from) {
                *value = hermite(x0, x1, s0, s1, (n - l) as f64 / span);
            }
        }
        (Some(l), None) => hold(x, l, from, to),
        (None, Some(r)) => hold(x, r, from, to),
        (None, None) => {}
    }
}

fn hold(x: &mut [f64], source: usize, from: usize, to: usize) {
    let value = x[source];
    x[from..to].fill(value);
}

/// Zero-lag low-pass of fourth order: a Butterworth filter of second order, forwards and backwards, with its cut-off raised so that
/// both passes together attenuate by 3 dB at `cut_hz`. The ends are extended by point reflection.
pub(crate) fn low_pass(x: &mut [f64], rate_hz: f64, cut_hz: f64) {
    let twice = (2f64.sqrt() - 1.0).powf(0.25);
    let warped = (std::f64::consts::PI * cut_hz / (rate_hz * twice)).tan();
    let a0 = 1.0 + 2f64.sqrt() * warped + warped * warped;
    let b = warped * warped / a0;
    let (a1, a2) = (2.0 * (warped * warped - 1.0) / a0, (1.0 - 2f64.sqrt() * warped + warped * warped) / a0);
    let reach = ((2.0 * rate_hz / cut_hz) as usize).min(x.len() - 1);
    let (first, last) = (x[0], x[x.len() - 1]);
    let before = (1..=reach).rev().map(|n| 2.0 * first - x[n]);
    let after = (1..=reach).map(|n| 2.0 * last - x[x.len() - 1 - n]);
    let mut long: Vec<f64> = before.chain(x.iter().copied()).chain(after).collect();
    for _ in 0..2 {
        let start = long[0];
        let (mut x1, mut x2, mut y1, mut y2) = (start, start, start, start);
        for value in &mut long {
            let y = b * (*value + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
            (x2, x1, y2, y1) = (x1, *value, y1, y);
            *value = y;
        }
        long.reverse();
    }
    x.copy_from_slice(&long[reach..reach + x.len()]);
}

/// The jumps of a series without NaN, in order and separate. Samples that are `filled` are not examined.
pub(crate) fn jumps(x: &[f64], filled: &[bool], rate_hz: f64, rule: &JumpRule) -> Vec<Jump> {
    let h = ((BEND_S * rate_hz).round() as usize).max(1);
    let guard = ((rule.guard_s * rate_hz).round() as usize).max(1);
    if x.len() < 4 * h + 1 {
        return Vec::new();
    }
    let bends: Vec<f64> = x.windows(2 * h + 1).map(|w| w[0] - 2.0 * w[h] + w[2 * h]).collect();
    let middle = median(bends.iter().copied());
    let usual = MAD_TO_SD * median(bends.iter().map(|bend| (bend - middle).abs()));
    let limit = rule.least_bend_deg.max(rule.usual_bends * usual);
    let real = |n: usize| filled.get(n - h..=n + h).is_some_and(|near| !near.contains(&true));
    let sharp = |n: usize| n >= h && bends.get(n - h).is_some_and(|bend| bend.abs() > limit) && real(n);

    // A window with its guards, and the samples with a large second difference in it.
    let mut clusters: Vec<[(usize, usize); 2]> = Vec::new();
    for (first, end) in runs(x.len(), sharp) {
        let (from, to) = (first.saturating_sub(guard), (end + guard).min(x.len()));
        match clusters.last_mut() {
            Some([window, core]) if window.1 >= from => (window.1, core.1) = (to, end),
            _ => clusters.push([(from, to), (first, end)]),
        }
    }
    let spread = quantile(x.to_vec(), 0.95) - quantile(x.to_vec(), 0.05);
    let least_step = rule.least_step_deg.max(rule.least_step_share * spread);
    // The lasting offset of a jump: measured across the sharp samples, in which the leg itself hardly moves, and not reversed within
    // the guards, as it is when a marker drifts away and jumps back.
    let lasting = |&[window, core]: &[(usize, usize); 2]| {
        let (left, right) = (window.0.checked_sub(1)?, window.1);
        if right >= x.len() {
            return None;
        }
        let slope = 0.5 * (edge_slope(x, left, -1, rate_hz) + edge_slope(x, right, 1, rate_hz));
        let across = |from: usize, to: usize| x[to] - x[from] - slope * (to - from) as f64;
        let (sharp, whole) = (across(core.0 - h, (core.1 - 1 + h).min(x.len() - 1)), across(left, right));
        // A step has a second difference of its height; a spike has one too, but no lasting offset.
        let bend =
            bends[core.0 - h..(core.1 - h).min(bends.len())].iter().fold(0.0_f64, |most, bend| most.max(bend.abs()));
        (sharp.abs() > least_step.max(0.5 * bend) && whole * sharp.signum() > 0.5 * sharp.abs()).then_some(sharp)
    };
    let mut jumps: Vec<Jump> = Vec::new();
    for cluster in &clusters {
        let step = lasting(cluster);
        let [(from, to), _] = *cluster;
        // A step and its reversal: everything in between is displaced.
        if let (Some(back), Some(last)) = (step, jumps.last_mut())
            && let Some(there) = last.lasting_deg
            && (there + back).abs() < 0.5 * there.abs().max(back.abs())
            && (from - last.to) as f64 <= rule.longest_excursion_s * rate_hz
        {
            last.to = to;
            last.lasting_deg = None;
            continue;
        }
        jumps.push(Jump { from, to, lasting_deg: step });
    }
    jumps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series::between;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    proptest! {
        /// Interpolation reproduces a cubic, and a bridge a parabola.
        #[test]
        fn cubics_and_parabolas_are_reproduced(c in prop::array::uniform4(-2.0_f64..2.0), place in 0.0_f64..30.0) {
            let curve = |n: f64| c[0] + n * (c[1] + 0.1 * n * (c[2] + 0.05 * n * c[3]));
            let x: Vec<f64> = (0..31).map(|n| curve(f64::from(n))).collect();
            let inside = place.clamp(1.0, 29.0);
            prop_assert!((between(&x, inside) - curve(inside)).abs() < 1e-9);

            let parabola: Vec<f64> = (0..31).map(|n| c[0] + f64::from(n) * (c[1] + 0.1 * f64::from(n) * c[2])).collect();
            let mut holed = parabola.clone();
            holed[12..18].fill(f64::NAN);
            bridge(&mut holed, 12, 18, 100.0, false);
            for (a, b) in parabola.iter().zip(&holed) {
                prop_assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
        }

        /// Rows of uneven times are resampled to the curve at equal steps.
        #[test]
        fn uneven_rows_are_resampled_to_the_curve(jitter in prop::collection::vec(-0.3_f64..0.3, 120)) {
            let curve = |t: f64| 30.0 * (TAU * t / 1.1).sin() + 12.0 * (2.0 * TAU * t / 1.1).cos();
            let times: Vec<f64> = jitter.iter().enumerate().map(|(n, j)| 0.01 * (n as f64 + if n == 0 { 0.0 } else { *j })).collect();
            let values: Vec<f64> = times.iter().map(|&t| curve(t)).collect();
            let out = even(&times, &values, 100.0, 119, 0.03);
            for (n, value) in out.iter().enumerate() {
                prop_assert!((value - curve(n as f64 * 0.01)).abs() < 0.05, "{n}: {value}");
            }
        }
    }

    /// Butterworth's gain, twice over: `1 / (1 + (f/fc)^4)` with both passes 3 dB at the cut-off; no lag.
    #[test]
    fn the_low_pass_has_3_db_at_its_cut_off_and_no_lag() {
        let corner = 6.0 / (2f64.sqrt() - 1.0).powf(0.25);
        for hertz in [1.0, 3.0, 6.0, 12.0, 24.0] {
            let wave = |n: usize| (TAU * hertz * n as f64 / 500.0).sin();
            let mut x: Vec<f64> = (0..2000).map(wave).collect();
            low_pass(&mut x, 500.0, 6.0);
            let middle = 500..1500;
            let gain = 2.0 / 1000.0 * middle.clone().map(|n| x[n] * wave(n)).sum::<f64>();
            let wanted = 1.0 / (1.0 + (hertz / corner).powi(4));
            assert!((gain - wanted).abs() < 0.01, "{hertz}: {gain}, not {wanted}");
            let off = middle.map(|n| (x[n] - gain * wave(n)).abs()).fold(0.0, f64::max);
            assert!(off < 1e-3, "{hertz}: {off}");
        }
        let mut level = vec![7.0; 300];
        low_pass(&mut level, 100.0, 6.0);
        assert!(level.iter().all(|x| (x - 7.0).abs() < 1e-9));
    }

    #[test]
    fn gaps_stay_gaps() {
        let times = [0.0, 0.01, 0.02, 0.06, 0.07];
        let out = even(&times, &[0.0, 1.0, 2.0, 6.0, 7.0], 100.0, 9, 0.015);
        let known: Vec<bool> = out.iter().map(|x| x.is_finite()).collect();
        assert_eq!(known, [true, true, true, false, false, false, true, true, false]);
    }
}
