//! Simulates networks until they settle, from their start and after two disturbances, and records their states.
//!
//! A disturbance multiplies each state by 0.9 to 1.1, left and right differently. An orbit that exists only because left and right
//! start exactly opposite does not survive it.

use pulp::{Simd, WithSimd};

use super::batch::each_block;
use super::lanes::{Lanes, Singles, dispatch};
use super::network::{Field, Network, Pair, step};
use super::waveform::Sample;

/// Disturbances as factors of displacements and velocities. The first pass has none.
const DISTURBANCES: [[f64; 8]; 3] =
    [[1.0; 8], [1.1, 0.92, 0.9, 1.06, 0.95, 1.1, 1.04, 0.9], [0.93, 1.1, 1.1, 0.9, 1.08, 0.9, 0.91, 1.1]];

/// Durations of the simulation, in steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Durations {
    pub(crate) step: f64,
    pub(crate) first_wait: usize,
    pub(crate) wait: usize,
    pub(crate) steps_per_sample: usize,
    pub(crate) samples: usize,
}

/// Calls `judge` with the network that `decode` makes of each point and its three records; results in the order of the points.
pub(crate) fn settle<P: Sync, R: Send + Sync>(
    points: &[P],
    decode: impl Fn(&P) -> Network + Sync,
    durations: Durations,
    judge: impl Fn(&Network, &[Vec<Sample>; 3]) -> R + Sync,
) -> Vec<R> {
    let lists: Vec<Vec<R>> = each_block(points.len(), |block| {
        let block: Vec<Network> = points[block].iter().map(&decode).collect();
        let records = dispatch(Run { block: &block, durations });
        block.iter().zip(&records).map(|(network, records)| judge(network, records)).collect()
    });
    lists.into_iter().flatten().collect()
}

/// At most [`super::lanes::MOST_VECTORS`] vectors.
struct Run<'a> {
    block: &'a [Network],
    durations: Durations,
}

impl WithSimd for Run<'_> {
    type Output = Vec<[Vec<Sample>; 3]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let (l, durations) = (Singles(simd), self.durations);
        let block: Vec<&Network> = self.block.iter().collect();
        match block.len().div_ceil(Singles::<S>::INDIVIDUALS) {
            0 | 1 => passes::<_, 1>(l, &block, durations),
            2 => passes::<_, 2>(l, &block, durations),
            3 => passes::<_, 3>(l, &block, durations),
            4 => passes::<_, 4>(l, &block, durations),
            5 => passes::<_, 5>(l, &block, durations),
            6 => passes::<_, 6>(l, &block, durations),
            7 => passes::<_, 7>(l, &block, durations),
            _ => passes::<_, 8>(l, &block, durations),
        }
    }
}

#[inline(always)]
fn passes<L: Lanes, const G: usize>(l: L, block: &[&Network], durations: Durations) -> Vec<[Vec<Sample>; 3]> {
    let of = |g: usize| &block[g * L::INDIVIDUALS..block.len().min((g + 1) * L::INDIVIDUALS)];
    let fields: [Field<L::Vector>; G] = std::array::from_fn(|g| Field::new(l, of(g), durations.step));
    let mut states: [Pair<L::Vector>; G] = std::array::from_fn(|g| Pair::new(l, of(g), durations.step));
    // Velocity per half a step to displacement per sample.
    let per_sample = l.splat(2.0 * durations.steps_per_sample as f64);
    let empty = || std::array::from_fn(|_| Vec::with_capacity(durations.samples));
    let mut out: Vec<[Vec<Sample>; 3]> = (0..block.len()).map(|_| empty()).collect();
    for (pass, factors) in DISTURBANCES.iter().enumerate() {
        let of_displacements = l.each(|_, joint| factors[joint]);
        let of_velocities = l.each(|_, joint| factors[joint + 4]);
        for state in &mut states {
            state.x = l.mul(state.x, of_displacements);
            state.v = l.mul(state.v, of_velocities);
        }
        let wait = if pass == 0 { durations.first_wait } else { durations.wait };
        for _ in 0..wait {
            step(l, &mut states, &fields);
        }
        for _ in 0..durations.samples {
            for (state, out) in states.iter().zip(out.chunks_mut(L::INDIVIDUALS)) {
                let v = l.mul(state.v, per_sample);
                for (individual, out) in out.iter_mut().enumerate() {
                    let number = |i: usize| match i.checked_sub(4) {
                        None => l.at(state.x, individual, i),
                        Some(joint) => l.at(v, individual, joint),
                    };
                    out[pass].push(std::array::from_fn(|i| number(i) as f32));
                }
            }
            for _ in 0..durations.steps_per_sample {
                step(l, &mut states, &fields);
            }
        }
    }
    out
}
