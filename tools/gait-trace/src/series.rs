//! Functions on a series of equal time steps: interpolation, runs of samples, simple statistics.

use crate::recording::Channel;

/// The value at a place between samples, by the cubic through the four samples around it; constant beyond the ends. `place` is in
/// samples.
#[must_use]
pub(crate) fn between(x: &[f64], place: f64) -> f64 {
    let last = x.len().saturating_sub(1);
    let Some(&end) = x.last() else { return f64::NAN };
    if place <= 0.0 {
        return x[0];
    }
    if place >= last as f64 {
        return end;
    }
    let i = place as usize;
    let u = place - i as f64;
    let (x0, x1) = (x[i], x[i + 1]);
    // At an end the parabola is extrapolated for the missing sample.
    let before = if i > 0 {
        x[i - 1]
    } else if last >= 2 {
        3.0 * x0 - 3.0 * x1 + x[2]
    } else {
        2.0 * x0 - x1
    };
    let after = if i + 2 <= last { x[i + 2] } else { 3.0 * x1 - 3.0 * x0 + before };
    let (u1, u2, u3) = (u + 1.0, u - 1.0, u - 2.0);
    -before * u * u2 * u3 / 6.0 + x0 * u1 * u2 * u3 / 2.0 - x1 * u1 * u * u3 / 2.0 + after * u1 * u * u2 / 6.0
}

/// Runs of samples for which `is` holds, as `from..to`.
pub(crate) fn runs(samples: usize, is: impl Fn(usize) -> bool) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for n in (0..samples).filter(|&n| is(n)) {
        match runs.last_mut() {
            Some((_, to)) if *to == n => *to = n + 1,
            _ => runs.push((n, n + 1)),
        }
    }
    runs
}

/// The median; 0 for no values.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
}

/// The upper median, which is one of the values; 0 for no values.
#[must_use]
pub fn upper_median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Root mean square; 0 for no values.
#[must_use]
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The quantile at a fraction of 0 to 1, linear between values; 0 for no values.
pub(crate) fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    let place = share * values.len().saturating_sub(1) as f64;
    let (low, part) = (place as usize, place.fract());
    if low >= values.len() {
        return 0.0;
    }
    // In order up to there; the next value is the least of the others.
    let (_, &mut a, above) = values.select_nth_unstable_by(low, f64::total_cmp);
    above.iter().copied().min_by(f64::total_cmp).map_or(a, |b| a + (b - a) * part)
}

/// Largest minus smallest value; 0 for no values.
pub(crate) fn range(x: &[f64]) -> f64 {
    let (least, most) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| (a.min(x), b.max(x)));
    if most > least { most - least } else { 0.0 }
}

/// The channels that vary, each with its variance.
pub(crate) fn varying(channels: &[Channel]) -> Vec<(&[f64], f64)> {
    let all = channels.iter().map(|channel| (channel.values(), variance(channel.values())));
    all.filter(|(_, variance)| *variance > 0.0).collect()
}

/// Mean square distance from the mean.
pub(crate) fn variance(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    x.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / x.len() as f64
}

/// Correlation of two series of equal length; not a number if one does not vary.
pub(crate) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (a0, b0) = (mean(a), mean(b));
    let (aa, bb, ab) = a.iter().zip(b).fold((0.0, 0.0, 0.0), |(aa, bb, ab), (a, b)| {
        let (a, b) = (a - a0, b - b0);
        (aa + a * a, bb + b * b, ab + a * b)
    });
    ab / (aa * bb).sqrt()
}
