//! Simulates many networks at once: the joints of some individuals in each SIMD vector, several vectors in turns on each core, on all
//! cores.
//!
//! The operations of a step wait for each other, and a fused multiply-add takes four cycles on each of two units: one vector cannot keep
//! them busy, five or more nearly do.

use pulp::{Arch, Simd, WithSimd};

use crate::objective::{Errors, Target};
use gait_fit::search::lanes::{Doubles, Lanes, Plain, Singles, dispatch};
use gait_fit::search::network::{Field, Pair, step};
use gait_fit::search::{Network, batch};

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
    let lists = each_block(networks, |block| dispatch(Score { block, target, grid, all }));
    lists.into_iter().flatten().collect()
}

/// Errors of one network in f64: the reference for the champion of a search.
#[must_use]
pub fn reference_errors(network: &Network, target: &Target, grid: Grid) -> Errors {
    let list = score::<_, 1, true>(Plain, &[network], target, grid);
    list[0]
}

/// Angles of each network at every sample of the target, in f64 lanes; empty for a network that diverged.
#[must_use]
pub fn angles(networks: &[Network], target: &Target, grid: Grid) -> Vec<Vec<[f64; 4]>> {
    let lists = each_block(networks, |block| Arch::new().dispatch(Record { block, target, grid }));
    lists.into_iter().flatten().collect()
}

/// Splits a population over the cores. The results are in the order of the networks.
fn each_block<R: Send + Sync>(networks: &[Network], run: impl Fn(&[Network]) -> R + Sync) -> Vec<R> {
    batch::each_block(networks.len(), |block| run(&networks[block]))
}

/// Errors of the networks of a block.
struct Score<'a> {
    block: &'a [Network],
    target: &'a Target,
    grid: Grid,
    all: bool,
}

impl WithSimd for Score<'_> {
    type Output = Vec<Errors>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<Errors> {
        if self.all { self.vectors::<_, true>(Singles(simd)) } else { self.vectors::<_, false>(Singles(simd)) }
    }
}

impl Score<'_> {
    #[inline(always)]
    fn vectors<L: Lanes, const ALL: bool>(self, l: L) -> Vec<Errors> {
        let Self { target, grid, .. } = self;
        let block: Vec<&Network> = self.block.iter().collect();
        match block.len().div_ceil(L::INDIVIDUALS) {
            0 | 1 => score::<_, 1, ALL>(l, &block, target, grid),
            2 => score::<_, 2, ALL>(l, &block, target, grid),
            3 => score::<_, 3, ALL>(l, &block, target, grid),
            4 => score::<_, 4, ALL>(l, &block, target, grid),
            5 => score::<_, 5, ALL>(l, &block, target, grid),
            6 => score::<_, 6, ALL>(l, &block, target, grid),
            7 => score::<_, 7, ALL>(l, &block, target, grid),
            _ => score::<_, 8, ALL>(l, &block, target, grid),
        }
    }
}

/// Vectors whose numbers of one joint fill one vector.
const TOGETHER: usize = 4;
/// Vectors of one joint of the most vectors that take turns.
const SUMS: usize = 2;

/// Errors of so many individuals as `G` vectors hold, or fewer.
#[inline(always)]
fn score<L: Lanes, const G: usize, const ALL: bool>(
    l: L,
    block: &[&Network],
    target: &Target,
    grid: Grid,
) -> Vec<Errors> {
    let step_s = target.sample_s / grid.steps_per_sample as f64;
    let of = |g: usize| &block[g * L::INDIVIDUALS..block.len().min((g + 1) * L::INDIVIDUALS)];
    let fields: [Field<L::Vector>; G] = std::array::from_fn(|g| Field::new(l, of(g), step_s));
    let mut states: [Pair<L::Vector>; G] = std::array::from_fn(|g| Pair::new(l, of(g), step_s));
    // The sums add the joints one after the other, so that they are those of an individual alone.
    let by_joint = |sum: usize, of: &dyn Fn(usize) -> L::Vector| -> [L::Vector; 4] {
        l.by_joint(std::array::from_fn(|vector| of((sum * TOGETHER + vector).min(G - 1))))
    };
    let sums_used = G.div_ceil(TOGETHER);
    let offset = |g: usize| {
        let individuals = of(g);
        l.each(|i, joint| individuals[i.min(individuals.len() - 1)].joints[joint].offset)
    };
    let offsets: [[L::Vector; 4]; SUMS] = std::array::from_fn(|sum| by_joint(sum, &offset));
    let (sample, per_second) = (l.splat(target.sample_s), l.splat(2.0 / step_s));
    let mut sums = [[l.splat(0.0); 6]; SUMS];
    let mut integrals = [[l.splat(0.0); 4]; SUMS];
    for (angles, rates) in target.angles.iter().zip(&target.rates) {
        for _ in 0..grid.steps_per_sample {
            step(l, &mut states, &fields);
        }
        let angles = angles.map(|a| l.splat(a));
        let rates = rates.map(|a| l.splat(a));
        for index in 0..sums_used {
            let x = by_joint(index, &|g| states[g].x);
            let v = by_joint(index, &|g| states[g].v);
            let sum = &mut sums[index];
            for joint in 0..4 {
                let e = l.sub(l.sub(angles[joint], offsets[index][joint]), x[joint]);
                sum[0] = l.mul_add(e, e, sum[0]);
                if ALL {
                    let rate = l.sub_mul(rates[joint], v[joint], per_second);
                    let integral = l.mul_add(e, sample, integrals[index][joint]);
                    integrals[index][joint] = integral;
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
    let together = TOGETHER * L::INDIVIDUALS;
    let one = |index: usize| {
        let mean = sums[index / together].map(|sum| l.of_joint(sum, index % together) / count);
        let [square, rate_square, integral_square, signed, rate_signed, integral_signed] = mean;
        Errors { square, rate_square, integral_square, signed, rate_signed, integral_signed }
    };
    (0..block.len()).map(one).collect()
}

/// Angles of the networks of a block.
struct Record<'a> {
    block: &'a [Network],
    target: &'a Target,
    grid: Grid,
}

impl WithSimd for Record<'_> {
    type Output = Vec<Vec<[f64; 4]>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let l = Doubles::<S, false>(simd);
        let step_s = self.target.sample_s / self.grid.steps_per_sample as f64;
        let mut all = vec![vec![]; self.block.len()];
        let individuals = Doubles::<S, false>::INDIVIDUALS;
        for (out, part) in all.chunks_mut(individuals).zip(self.block.chunks(individuals)) {
            let part: Vec<&Network> = part.iter().collect();
            let field = Field::new(l, &part, step_s);
            let mut state = Pair::new(l, &part, step_s);
            for _ in &self.target.angles {
                for _ in 0..self.grid.steps_per_sample {
                    state.step(l, &field);
                }
                for (individual, (out, network)) in out.iter_mut().zip(&part).enumerate() {
                    out.push(std::array::from_fn(|i| l.at(state.x, individual, i) + network.joints[i].offset));
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
