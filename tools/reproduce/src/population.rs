//! Simulates many networks at once: one individual per SIMD lane, two vectors in parallel on each core, on all cores.
//!
//! The step has about eight independent chains of operations, and a fused multiply-add takes four cycles on each of two units: one
//! vector cannot keep them busy, two nearly do.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::objective::{Errors, Target};
use gait_fit::search::Network;
use gait_fit::search::lanes::{Doubles, Lanes, Plain, Singles};
use gait_fit::search::network::{Field, Pair, step};

/// Vectors in parallel.
const VECTORS: usize = 2;

/// The integration steps between two samples of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Integration steps in each sample interval.
    pub steps_per_sample: usize,
}

impl Grid {
    /// One step per sample: 5 ms for a target with a sample every 5 ms.
    pub const SEARCH: Grid = Grid { steps_per_sample: 1 };
    /// Five steps per sample: 1 ms for the same target.
    pub const FINE: Grid = Grid { steps_per_sample: 5 };
}

/// Errors of each network against the target, in f32 lanes; `all` also computes rates and integrals.
///
/// ```
/// use gait_fit::search::Network;
/// use reproduce::{Grid, Target, errors, set_s};
/// let set_s = set_s();
/// let target = Target::of_network(&set_s, 5.0, 5);
/// let [same, other] = errors(&[set_s, Network { joints: [Default::default(); 4], ..set_s }], &target, Grid::SEARCH, false)[..] else {
///     panic!("one result per network")
/// };
/// assert!(same.rmse_deg() < 1e-3);
/// assert!(other.rmse_deg() > 100.0);
/// ```
#[must_use]
pub fn errors(networks: &[Network], target: &Target, grid: Grid, all: bool) -> Vec<Errors> {
    let lists = chunks(networks, |chunk| Arch::new().dispatch(Score { chunk, target, grid, all }));
    lists.into_iter().flatten().collect()
}

/// Errors of one network in f64: the reference for the champion of a search.
#[must_use]
pub fn reference_errors(network: &Network, target: &Target, grid: Grid) -> Errors {
    let list = score(Plain, &[network], target, grid, true);
    list[0]
}

/// Angles of each network at every sample of the target, in f64 lanes; empty for a network that diverged.
#[must_use]
pub fn angles(networks: &[Network], target: &Target, grid: Grid) -> Vec<Vec<[f64; 4]>> {
    let lists = chunks(networks, |chunk| Arch::new().dispatch(Record { chunk, target, grid }));
    lists.into_iter().flatten().collect()
}

/// Splits a population over the cores. The results are in the order of the networks.
fn chunks<R: Send>(networks: &[Network], run: impl Fn(&[Network]) -> R + Sync + Send) -> Vec<R> {
    // The widest vectors of any machine, so that the split does not depend on the machine.
    networks.par_chunks(16 * VECTORS).map(run).collect()
}

struct Score<'a> {
    chunk: &'a [Network],
    target: &'a Target,
    grid: Grid,
    all: bool,
}

impl WithSimd for Score<'_> {
    type Output = Vec<Errors>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<Errors> {
        let l = Singles(simd);
        let mut out = Vec::with_capacity(self.chunk.len());
        for part in self.chunk.chunks(Singles::<S>::WIDTH * VECTORS) {
            let part: Vec<&Network> = part.iter().collect();
            out.extend(score(l, &part, self.target, self.grid, self.all));
        }
        out
    }
}

/// One or two vectors.
#[inline(always)]
fn score<L: Lanes>(l: L, part: &[&Network], target: &Target, grid: Grid, all: bool) -> Vec<Errors> {
    match (part.len() > L::WIDTH, all) {
        (false, false) => score_vectors::<L, 1, false>(l, part, target, grid),
        (false, true) => score_vectors::<L, 1, true>(l, part, target, grid),
        (true, false) => score_vectors::<L, VECTORS, false>(l, part, target, grid),
        (true, true) => score_vectors::<L, VECTORS, true>(l, part, target, grid),
    }
}

/// The individuals of one vector.
fn of_vector<'a, 'b>(part: &'b [&'a Network], vector: usize, width: usize) -> &'b [&'a Network] {
    &part[vector * width..part.len().min((vector + 1) * width)]
}

#[inline(always)]
fn score_vectors<L: Lanes, const G: usize, const ALL: bool>(
    l: L,
    part: &[&Network],
    target: &Target,
    grid: Grid,
) -> Vec<Errors> {
    let step_s = target.sample_s / grid.steps_per_sample as f64;
    let fields: [Field<L::Vector>; G] = std::array::from_fn(|g| Field::new(l, of_vector(part, g, L::WIDTH), step_s));
    let mut states: [Pair<L::Vector>; G] = std::array::from_fn(|g| Pair::new(l, of_vector(part, g, L::WIDTH), step_s));
    let offsets: [[L::Vector; 4]; G] = std::array::from_fn(|g| {
        let individuals = of_vector(part, g, L::WIDTH);
        std::array::from_fn(|joint| l.each(|lane| individuals[lane.min(individuals.len() - 1)].joints[joint].offset))
    });
    let (sample, per_second) = (l.splat(L::scalar(target.sample_s)), l.splat(L::scalar(2.0 / step_s)));
    let zero = l.splat(L::scalar(0.0));
    let mut sums = [[zero; 6]; G];
    let mut integrals = [[zero; 4]; G];
    for (angles, rates) in target.angles.iter().zip(&target.rates) {
        for _ in 0..grid.steps_per_sample {
            step(l, &mut states, &fields);
        }
        let angles = angles.map(|a| l.splat(L::scalar(a)));
        let rates = rates.map(|a| l.splat(L::scalar(a)));
        for g in 0..G {
            let sum = &mut sums[g];
            for joint in 0..4 {
                let e = l.sub(l.sub(angles[joint], offsets[g][joint]), states[g].x[joint]);
                sum[0] = l.mul_add(e, e, sum[0]);
                if ALL {
                    let rate = l.sub_mul(rates[joint], states[g].v[joint], per_second);
                    let integral = l.mul_add(e, sample, integrals[g][joint]);
                    integrals[g][joint] = integral;
                    sum[1] = l.mul_add(rate, rate, sum[1]);
                    sum[2] = l.mul_add(integral, integral, sum[2]);
                    sum[3] = l.add(sum[3], e);
                    sum[4] = l.add(sum[4], rate);
                    sum[5] = l.add(sum[5], integral);
                }
            }
        }
    }
    let count = 4.0 * target.angles.len() as f64;
    let one = |index: usize| {
        let mean = sums[index / L::WIDTH].map(|sum| l.lane(sum, index % L::WIDTH) / count);
        let [square, rate_square, integral_square, signed, rate_signed, integral_signed] = mean;
        Errors { square, rate_square, integral_square, signed, rate_signed, integral_signed }
    };
    (0..part.len()).map(one).collect()
}

struct Record<'a> {
    chunk: &'a [Network],
    target: &'a Target,
    grid: Grid,
}

impl WithSimd for Record<'_> {
    type Output = Vec<Vec<[f64; 4]>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let l = Doubles(simd);
        let step_s = self.target.sample_s / self.grid.steps_per_sample as f64;
        let mut all = vec![vec![]; self.chunk.len()];
        for (out, part) in all.chunks_mut(Doubles::<S>::WIDTH).zip(self.chunk.chunks(Doubles::<S>::WIDTH)) {
            let part: Vec<&Network> = part.iter().collect();
            let field = Field::new(l, &part, step_s);
            let mut state = Pair::new(l, &part, step_s);
            for _ in &self.target.angles {
                for _ in 0..self.grid.steps_per_sample {
                    state.step(l, &field);
                }
                for (lane, (out, network)) in out.iter_mut().zip(&part).enumerate() {
                    out.push(std::array::from_fn(|i| l.lane(state.x[i], lane) + network.joints[i].offset));
                }
            }
            for out in out {
                if out.iter().flatten().any(|a: &f64| !a.is_finite()) {
                    out.clear();
                }
            }
        }
        all
    }
}
