//! Extracts one cycle of an orbit from a record of its states and matches it to a recorded stride.
//!
//! The thesis' equations are invariant under a change of the time scale, of an offset, and of the scale of hips or knees as pairs (see
//! [`super::thesis`]). So period, offsets and the two scales are not searched: they follow from the cycle in closed form. The shift in
//! time follows from a correlation.

use gait_trace::stride::cycle::{Cycle, POINTS};

/// Points of a cycle during the search.
pub(crate) const COARSE: usize = 40;
/// Number of harmonics in the correlation.
const ORBIT_HARMONICS: usize = 8;

/// A state of the record: displacements, then velocities in displacement per sample.
pub(crate) type Sample = [f32; 8];

/// One closed cycle.
pub(crate) struct Orbit {
    /// Period in samples.
    pub(crate) samples: f64,
    /// Mean square distance of the end from the start, relative to each state's range.
    pub(crate) defect: f64,
    /// Displacements over the cycle.
    pub(crate) points: [[f64; COARSE]; 4],
}

/// The cycle that begins with the record and has at least `shortest` samples; `None` if there is none or a state is not finite.
#[inline(always)]
pub(crate) fn orbit(record: &[Sample], shortest: usize) -> Option<Orbit> {
    let mut scale = [0.0f64; 8];
    for (i, scale) in scale.iter_mut().enumerate() {
        let (mut low, mut high) = (f32::MAX, f32::MIN);
        for sample in record {
            (low, high) = (low.min(sample[i]), high.max(sample[i]));
            if !sample[i].is_finite() {
                return None;
            }
        }
        *scale = 1.0 / f64::from(high - low).max(1e-9);
    }
    let first = record[0].map(f64::from);
    let distance = |sample: &[f64; 8]| (0..8).map(|i| ((sample[i] - first[i]) * scale[i]).powi(2)).sum::<f64>() / 8.0;
    let distances: Vec<f64> = record[shortest..].iter().map(|s| distance(&s.map(f64::from))).collect();
    let least = distances.iter().copied().fold(f64::MAX, f64::min);
    // The first return, even if a later one is closer.
    let valley = |k: usize| distances[k] <= distances[k - 1] && distances[k] <= distances[k + 1];
    let found = (1..distances.len() - 1).find(|&k| valley(k) && distances[k] <= 4.0 * least + 3e-3)?;
    let mut samples = (shortest + found) as f64;
    for _ in 0..2 {
        let (at, velocity) = between(record, samples);
        let (mut along, mut square) = (0.0, 1e-30);
        for i in 0..4 {
            along += (first[i] - at[i]) * velocity[i] * scale[i] * scale[i];
            square += (velocity[i] * scale[i]).powi(2);
        }
        samples += (along / square).clamp(-1.0, 1.0);
    }
    let samples = samples.clamp(1.0, (record.len() - 1) as f64);
    let (end, end_velocity) = between(record, samples);
    let closed: [f64; 8] = std::array::from_fn(|i| if i < 4 { end[i] } else { end_velocity[i - 4] });
    let mut points = [[0.0; COARSE]; 4];
    for k in 0..COARSE {
        let (at, _) = between(record, samples * k as f64 / COARSE as f64);
        for (points, at) in points.iter_mut().zip(at) {
            points[k] = at;
        }
    }
    Some(Orbit { samples, defect: distance(&closed), points })
}

/// Displacements and velocities between two samples, by cubic Hermite interpolation.
#[inline(always)]
pub(crate) fn between(record: &[Sample], at: f64) -> ([f64; 4], [f64; 4]) {
    let k = (at as usize).min(record.len() - 2);
    let t = at - k as f64;
    let (a, b) = (&record[k], &record[k + 1]);
    let (mut x, mut v) = ([0.0; 4], [0.0; 4]);
    for i in 0..4 {
        let [xa, va, xb, vb] = [a[i], a[i + 4], b[i], b[i + 4]].map(f64::from);
        let (square, cube) = (3.0 * (xb - xa) - 2.0 * va - vb, 2.0 * (xa - xb) + va + vb);
        x[i] = xa + t * (va + t * (square + t * cube));
        v[i] = va + t * (2.0 * square + 3.0 * t * cube);
    }
    (x, v)
}

/// A recorded stride with its harmonics.
pub(crate) struct Stride {
    mean: [f64; 4],
    /// Variance of the hips and of the knees, each summed over left and right.
    power: [f64; 2],
    /// Cosine and sine coefficients of each joint.
    harmonics: [[[f64; 2]; ORBIT_HARMONICS]; 4],
}

/// The transformation of an orbit that fits a stride best.
pub(crate) struct Match {
    /// Root mean square error over all joints, degrees.
    pub(crate) rmse_deg: f64,
    /// Fraction of the orbit's cycle at the start of the stride.
    pub(crate) shift: f64,
    /// Degrees per displacement: hips, knees.
    pub(crate) scale: [f64; 2],
    /// Degrees at displacement 0.
    pub(crate) offset: [f64; 4],
}

/// Sine and cosine of `k` parts of a turn divided into `n`.
fn circle(k: usize, n: usize) -> (f64, f64) {
    let angle = std::f64::consts::TAU * (k % n) as f64 / n as f64;
    (libm::sin(angle), libm::cos(angle))
}

/// Mean, variance and harmonics of a closed cycle.
#[inline(always)]
fn analyse<const N: usize>(points: &[f64; N], turns: &Turns<N>) -> (f64, f64, [[f64; 2]; ORBIT_HARMONICS]) {
    let mean = points.iter().sum::<f64>() / N as f64;
    let power = points.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / N as f64;
    // The harmonics take turns, so that no sum waits for itself.
    let (mut c, mut s) = ([0.0; ORBIT_HARMONICS], [0.0; ORBIT_HARMONICS]);
    for (x, (sin, cos)) in points.iter().zip(turns.sin.iter().zip(&turns.cos)) {
        for h in 0..ORBIT_HARMONICS {
            c[h] += x * cos[h] * 2.0 / N as f64;
            s[h] += x * sin[h] * 2.0 / N as f64;
        }
    }
    (mean, power, std::array::from_fn(|h| [c[h], s[h]]))
}

impl Stride {
    pub(crate) fn new(target: &Cycle) -> Self {
        let turns = Turns::<POINTS>::new();
        let joints = target.0.each_ref().map(|points| analyse(points, &turns));
        Self {
            mean: joints.map(|(mean, ..)| mean),
            power: [joints[0].1 + joints[1].1, joints[2].1 + joints[3].1],
            harmonics: joints.map(|(.., harmonics)| harmonics),
        }
    }

    /// The shift, scales and offsets with the smallest error.
    #[inline(always)]
    pub(crate) fn best_match(&self, orbit: &[[f64; COARSE]; 4], turns: &Turns<COARSE>) -> Match {
        // No closure: what it does would be compiled for every processor, with its narrowest vectors.
        let [a, b, c, d] = orbit;
        let joints = [analyse(a, turns), analyse(b, turns), analyse(c, turns), analyse(d, turns)];
        let power = [joints[0].1 + joints[1].1, joints[2].1 + joints[3].1];
        // Product of conjugate target and orbit harmonics, summed over each pair.
        let mut products = [[[0.0; 2]; ORBIT_HARMONICS]; 2];
        for (joint, (_, _, own)) in joints.iter().enumerate() {
            for (h, product) in products[joint / 2].iter_mut().enumerate() {
                let ([c, s], [tc, ts]) = (own[h], self.harmonics[joint][h]);
                product[0] += 0.5 * (tc * c + ts * s);
                product[1] += 0.5 * (tc * s - ts * c);
            }
        }
        // All shifts of the grid take turns, so that no sum waits for itself.
        let mut on_grid = [0.0; COARSE];
        for (pair, products) in products.iter().enumerate() {
            for ((sin, cos), error) in turns.sin.iter().zip(&turns.cos).zip(&mut on_grid) {
                *error += self.power[pair] - correlation(products, sin, cos).powi(2) / power[pair].max(1e-12);
            }
        }
        let k = (0..COARSE).min_by(|&a, &b| on_grid[a].total_cmp(&on_grid[b])).unwrap_or(0);
        let (before, here, after) = (on_grid[(k + COARSE - 1) % COARSE], on_grid[k], on_grid[(k + 1) % COARSE]);
        let bend = before - 2.0 * here + after;
        let part = if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        let shift = (k as f64 + part) / COARSE as f64;
        let turn = |h: usize| {
            let angle = std::f64::consts::TAU * (shift * (h + 1) as f64);
            (libm::sin(angle), libm::cos(angle))
        };
        let turn: [(f64, f64); ORBIT_HARMONICS] = std::array::from_fn(turn);
        let best = products
            .each_ref()
            .map(|products| correlation(products, &turn.map(|(sin, _)| sin), &turn.map(|(_, cos)| cos)));
        let error = |pair: usize| self.power[pair] - best[pair].powi(2) / power[pair].max(1e-12);
        let scale = [0, 1].map(|pair| best[pair] / power[pair].max(1e-12));
        Match {
            rmse_deg: ((error(0) + error(1)) / 4.0).max(0.0).sqrt(),
            shift: shift.rem_euclid(1.0),
            scale,
            offset: std::array::from_fn(|joint| self.mean[joint] - scale[joint / 2] * joints[joint].0),
        }
    }
}

/// The correlation of a pair of joints at a shift, of which the sines and cosines are those of each harmonic.
#[inline(always)]
fn correlation(
    products: &[[f64; 2]; ORBIT_HARMONICS],
    sin: &[f64; ORBIT_HARMONICS],
    cos: &[f64; ORBIT_HARMONICS],
) -> f64 {
    let term = |h: usize| products[h][0] * cos[h] + products[h][1] * sin[h];
    (0..ORBIT_HARMONICS).map(term).sum::<f64>().max(0.0)
}

/// Sines and cosines of each harmonic at each of `N` equal parts of a cycle.
pub(crate) struct Turns<const N: usize> {
    sin: [[f64; ORBIT_HARMONICS]; N],
    cos: [[f64; ORBIT_HARMONICS]; N],
}

impl<const N: usize> Turns<N> {
    pub(crate) fn new() -> Self {
        let of = |k: usize| -> [(f64, f64); ORBIT_HARMONICS] { std::array::from_fn(|h| circle(k * (h + 1), N)) };
        Self {
            sin: std::array::from_fn(|k| of(k).map(|(sin, _)| sin)),
            cos: std::array::from_fn(|k| of(k).map(|(_, cos)| cos)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record of known harmonics whose period is not a whole number of samples.
    fn record(period: f64) -> Vec<Sample> {
        let w = std::f64::consts::TAU / period;
        (0..100)
            .map(|k| {
                let x = |joint: usize| {
                    let phase = w * k as f64 + joint as f64;
                    (phase.sin() + 0.3 * (2.0 * phase).cos(), w * (phase.cos() - 0.6 * (2.0 * phase).sin()))
                };
                std::array::from_fn(|i| if i < 4 { x(i).0 as f32 } else { x(i - 4).1 as f32 })
            })
            .collect()
    }

    #[test]
    fn a_cycle_matches_a_scaled_and_shifted_copy() {
        let found = orbit(&record(53.37), 25).expect("a cycle");
        assert!((found.samples - 53.37).abs() < 2e-3, "{}", found.samples);
        assert!(found.defect < 1e-8);
        let wave = |phase: f64| phase.sin() + 0.3 * (2.0 * phase).cos();
        let (scale, offset, shift) = ([20.0, 31.0], [5.0, 6.0, 30.0, 28.0], 0.3137);
        let target = Cycle(std::array::from_fn(|joint| {
            std::array::from_fn(|k| {
                let phase = std::f64::consts::TAU * (k as f64 / POINTS as f64 + shift) + joint as f64;
                offset[joint] + scale[joint / 2] * wave(phase)
            })
        }));
        let got = Stride::new(&target).best_match(&found.points, &Turns::new());
        assert!(got.rmse_deg < 0.05, "{}", got.rmse_deg);
        assert!((got.shift - shift).abs() < 1e-3, "{}", got.shift);
        assert!((got.scale[0] - 20.0).abs() < 0.02 && (got.scale[1] - 31.0).abs() < 0.03, "{:?}", got.scale);
        assert!(got.offset.iter().zip(offset).all(|(a, b)| (a - b).abs() < 0.02), "{:?}", got.offset);
    }

    #[test]
    fn a_diverged_record_has_no_cycle() {
        let mut broken = record(50.0);
        broken[70][2] = f32::NAN;
        assert!(orbit(&broken, 25).is_none());
    }
}
