//! Gait error of a generator: the error of the best linear read-out of its state over several strides.
//!
//! ```text
//! a_j(k + s mod P) = c_j0 + sum_m c_jm f_m(k),   k = 0 .. n P,   c by least squares, s the best common shift
//! ```
//! P points are a stride of the person, n P those of n strides of the generator: over one stride alone a slow change of the state, which
//! does not repeat, would count as a part of the waveform. Features are centred and scaled to a mean square of 1.
//!
//! A nearly sinusoidal state contains any waveform with an amplitude of about a percent, and weights of hundreds would amplify it. The
//! state of a real leg is not so exact. The weights are therefore optimal for features with noise of [`NOISE`] of their size (a ridge of
//! its square), and the error that this noise adds is reported separately.

use nalgebra::{DMatrix, DVector};

/// Assumed noise of each feature, divided by its root mean square.
pub const NOISE: f64 = 0.01;

/// Root mean square errors over the stride, left and right together, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaitError {
    /// Of the hips.
    pub hip_deg: f64,
    /// Of the knees.
    pub knee_deg: f64,
}

/// The best linear read-out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readout {
    /// Its error without noise.
    pub error: GaitError,
    /// Root mean square, over the joints, of the error that [`NOISE`] on each feature adds, degrees.
    pub noise_deg: f64,
}

impl GaitError {
    /// From the mean squares of the four joints.
    fn of([left_hip, right_hip, left_knee, right_knee]: [f64; 4]) -> Self {
        let both = |a: f64, b: f64| (0.5 * (a + b)).max(0.0).sqrt();
        Self { hip_deg: both(left_hip, right_hip), knee_deg: both(left_knee, right_knee) }
    }
}

/// The error of the joint angles as they are, degrees, at the best common shift in time. `wanted` is one stride, `angles` whole strides.
#[must_use]
pub fn as_built(angles: &[Vec<f64>; 4], wanted: &[Vec<f64>; 4]) -> GaitError {
    let points = wanted[0].len();
    let squares = |shift: usize| {
        std::array::from_fn(|joint| {
            let found = angles[joint].iter().enumerate();
            let squares = found.map(|(k, a)| (a - wanted[joint][(k + shift) % points]).powi(2));
            squares.sum::<f64>() / angles[joint].len() as f64
        })
    };
    let all = |joints: &[f64; 4]| joints.iter().sum::<f64>();
    let least = (0..points).map(squares).min_by(|a, b| all(a).total_cmp(&all(b)));
    GaitError::of(least.unwrap_or([f64::NAN; 4]))
}

/// The error of the best linear read-out. `features[m][k]` is feature m at point k; `wanted` is one stride, the features whole strides.
///
/// ```
/// use generator_file::gait_error::readout;
/// let wave = |lead: f64, order: f64| -> Vec<f64> {
///     (0..200).map(|k| ((f64::from(k) / 200.0 + lead) * order * std::f64::consts::TAU).cos()).collect()
/// };
/// // Cosine and sine make a cosine of any lead, but not one of twice the frequency: that stays as it is, 1/sqrt(2).
/// let features = [wave(0.0, 1.0), wave(0.25, 1.0)];
/// let error = readout(&features, &[wave(0.1, 1.0), wave(0.6, 1.0), wave(0.0, 2.0), wave(0.1, 2.0)]).error;
/// assert!(error.hip_deg < 1e-3 && (error.knee_deg - 0.5f64.sqrt()).abs() < 1e-3);
/// ```
#[must_use]
pub fn readout(features: &[Vec<f64>], wanted: &[Vec<f64>; 4]) -> Readout {
    let points = wanted[0].len();
    let columns: Vec<Vec<f64>> = features.iter().filter_map(|feature| scaled(feature)).collect();
    let wanted = wanted.each_ref().map(|joint| {
        let mean = joint.iter().sum::<f64>() / points as f64;
        joint.iter().map(|a| a - mean).collect::<Vec<f64>>()
    });
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
    // The target repeats, so only the mean of a feature over the strides matters.
    let folded: Vec<Vec<f64>> = columns
        .iter()
        .map(|column| {
            let strides = column.len() / points;
            let at = |k: usize| (0..strides).map(|stride| column[stride * points + k]).sum::<f64>() / strides as f64;
            (0..points).map(at).collect()
        })
        .collect();
    let n = columns.len();
    let ridge = NOISE * NOISE;
    let gram = DMatrix::from_fn(n, n, |i, j| dot(&columns[i], &columns[j]) + if i == j { ridge } else { 0.0 });
    let Some(gram) = gram.cholesky() else {
        // No features: the mean alone.
        return Readout { error: GaitError::of(wanted.map(|joint| dot(&joint, &joint))), noise_deg: 0.0 };
    };
    // For each joint the mean square of error and noise together, and that of the noise.
    let squares = |shift: usize| {
        wanted.each_ref().map(|joint| {
            let (early, late) = joint.split_at(shift);
            let shifted: Vec<f64> = late.iter().chain(early).copied().collect();
            let right = DVector::from_fn(n, |i, _| dot(&shifted, &folded[i]));
            let weights = gram.solve(&right);
            // |a - F c|^2 + ridge |c|^2 is least where (F F + ridge) c = F a; it is then a a - c F a.
            (dot(joint, joint) - weights.dot(&right), ridge * weights.dot(&weights))
        })
    };
    let both = |joints: &[(f64, f64); 4]| joints.iter().map(|joint| joint.0).sum::<f64>();
    let least = (0..points).map(squares).min_by(|a, b| both(a).total_cmp(&both(b)));
    let joints = least.unwrap_or([(f64::NAN, f64::NAN); 4]);
    let noise = joints.iter().map(|joint| joint.1).sum::<f64>() / 4.0;
    Readout { error: GaitError::of(joints.map(|(both, noise)| both - noise)), noise_deg: noise.sqrt() }
}

/// Mean 0 and mean square 1; none for a constant.
fn scaled(feature: &[f64]) -> Option<Vec<f64>> {
    let mean = feature.iter().sum::<f64>() / feature.len() as f64;
    let size = (feature.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / feature.len() as f64).sqrt();
    (size > 1e-9).then(|| feature.iter().map(|f| (f - mean) / size).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(lead: f64, orders: &[(f64, f64)]) -> Vec<f64> {
        let at = |k: usize| std::f64::consts::TAU * (k as f64 / 200.0 + lead);
        (0..200).map(|k| orders.iter().map(|(order, size)| size * (order * at(k)).cos()).sum()).collect()
    }

    /// The error is the part of the target that is orthogonal to the features; scale and offset have no effect.
    #[test]
    fn the_error_is_what_the_features_lack() {
        let wanted = [0.0, 0.5, 0.2, 0.7].map(|lead| wave(lead, &[(1.0, 20.0), (2.0, 3.0), (3.0, 1.0)]));
        let harmonics = |n: u32| -> Vec<Vec<f64>> {
            let pair = |k: u32| [0.0, 0.25 / f64::from(k)].map(|lead| wave(lead, &[(f64::from(k), 7.0)]));
            (1..=n).flat_map(pair).map(|f| f.iter().map(|x| x + 5.0).collect()).collect()
        };
        let left = [(3.0f64.powi(2) + 1.0).sqrt(), 1.0, 0.0].map(|size: f64| size / 2f64.sqrt());
        for (n, left) in (1..).zip(left) {
            let got = readout(&harmonics(n), &wanted).error;
            assert!((got.hip_deg - left).abs() < 2e-3 && (got.knee_deg - left).abs() < 2e-3, "{n}: {got:?}, {left}");
        }
        // A repeated feature and a constant one have no effect.
        let mut features = harmonics(2);
        features.extend([features[0].clone(), vec![4.0; 200]]);
        assert!((readout(&features, &wanted).error.hip_deg - left[1]).abs() < 2e-3);
        assert!((readout(&[], &wanted).error.hip_deg - (410.0f64 / 2.0).sqrt()).abs() < 1e-9);
    }

    /// A small harmonic can be read out, but then noise adds a large error.
    #[test]
    fn noise_shows_that_a_harmonic_is_too_small() {
        let wanted = [0.0, 0.5, 0.2, 0.7].map(|lead| wave(lead, &[(1.0, 20.0), (2.0, 3.0)]));
        let both = |size: f64| {
            let pair = |order: f64| [0.0, 0.25 / order].map(|lead| wave(lead, &[(1.0, 1.0), (order, size)]));
            let sum: Vec<Vec<f64>> = pair(1.0).into_iter().chain(pair(2.0)).collect();
            readout(&sum, &wanted)
        };
        let (clear, trace) = (both(1.0), both(0.02));
        assert!(clear.error.hip_deg < 0.05 && clear.noise_deg < 0.4, "{clear:?}");
        assert!(trace.error.hip_deg > 0.2 && trace.noise_deg > 3.0 * clear.noise_deg, "{trace:?}");
    }

    /// Over several strides the read-out is the same, but a feature that does not repeat is of no use.
    #[test]
    fn a_feature_that_does_not_repeat_is_of_no_use() {
        let wanted = [0.0, 0.5, 0.2, 0.7].map(|lead| wave(lead, &[(1.0, 20.0), (2.0, 3.0)]));
        let mut features = [0.0, 0.25].map(|lead| wave(lead, &[(1.0, 1.0)]).repeat(10)).to_vec();
        let left = 3.0 / 2f64.sqrt();
        assert!((readout(&features, &wanted).error.hip_deg - left).abs() < 2e-3);
        let ten_strides = (0..2000).map(|k| (std::f64::consts::TAU * (2.1 * f64::from(k) / 200.0)).cos());
        features.push(ten_strides.collect());
        assert!((readout(&features, &wanted).error.hip_deg - left).abs() < 0.02, "{:?}", readout(&features, &wanted));
    }

    #[test]
    fn a_generator_of_one_harmonic_needs_the_right_shift() {
        // One feature cannot make another phase; the common shift can.
        let wanted = [0.3, 0.8, 0.3, 0.8].map(|lead| wave(lead, &[(1.0, 10.0)]));
        assert!(readout(&[wave(0.0, &[(1.0, 1.0)])], &wanted).error.hip_deg < 1e-3);
        let late = [0.1, 0.6, 0.1, 0.6].map(|lead| wave(lead, &[(1.0, 10.0)]));
        assert!(as_built(&late, &wanted).knee_deg < 1e-9);
        let other = [0.1, 0.6, 0.1, 0.6].map(|lead| wave(lead, &[(1.0, 13.0)]));
        assert!((as_built(&other, &wanted).hip_deg - 3.0 / 2f64.sqrt()).abs() < 1e-9);
    }
}
