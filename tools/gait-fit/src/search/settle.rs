//! Simulates networks until they settle, from their start and after two disturbances, and records their states.
//!
//! A disturbance multiplies each state by 0.9 to 1.1, left and right differently. An orbit that exists only because left and right
//! start exactly opposite does not survive it.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{Lanes, Singles};
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

/// Calls `judge` with the three records of each network; results in the order of the networks.
pub(crate) fn settle<R: Send>(
    networks: &[Network],
    durations: Durations,
    judge: impl Fn(&Network, &[Vec<Sample>; 3]) -> R + Sync + Send,
) -> Vec<R> {
    // Smaller chunks if there would be only one otherwise.
    let chunk = if networks.len() < 64 { 16 } else { 32 };
    let lists: Vec<Vec<R>> = networks
        .par_chunks(chunk)
        .map(|chunk| {
            let records = Arch::new().dispatch(Run { chunk, durations });
            chunk.iter().zip(&records).map(|(network, records)| judge(network, records)).collect()
        })
        .collect();
    lists.into_iter().flatten().collect()
}

struct Run<'a> {
    chunk: &'a [Network],
    durations: Durations,
}

impl WithSimd for Run<'_> {
    type Output = Vec<[Vec<Sample>; 3]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let l = Singles(simd);
        let width = Singles::<S>::WIDTH;
        let mut out: Self::Output = Vec::new();
        for part in self.chunk.chunks(2 * width) {
            let part: Vec<&Network> = part.iter().collect();
            if part.len() > width {
                out.extend(passes::<_, 2>(l, &part, self.durations));
            } else {
                out.extend(passes::<_, 1>(l, &part, self.durations));
            }
        }
        out
    }
}

#[inline(always)]
fn passes<L: Lanes, const G: usize>(l: L, part: &[&Network], durations: Durations) -> Vec<[Vec<Sample>; 3]> {
    let of = |g: usize| &part[g * L::WIDTH..part.len().min((g + 1) * L::WIDTH)];
    let fields: [Field<L::Vector>; G] = std::array::from_fn(|g| Field::new(l, of(g), durations.step));
    let mut states: [Pair<L::Vector>; G] = std::array::from_fn(|g| Pair::new(l, of(g), durations.step));
    // Velocity per half a step to displacement per sample.
    let per_sample = l.splat(L::scalar(2.0 * durations.steps_per_sample as f64));
    let empty = || std::array::from_fn(|_| Vec::with_capacity(durations.samples));
    let mut out: Vec<[Vec<Sample>; 3]> = (0..part.len()).map(|_| empty()).collect();
    for (pass, factors) in DISTURBANCES.iter().enumerate() {
        for state in &mut states {
            for joint in 0..4 {
                state.x[joint] = l.mul(state.x[joint], l.splat(L::scalar(factors[joint])));
                state.v[joint] = l.mul(state.v[joint], l.splat(L::scalar(factors[joint + 4])));
            }
        }
        let wait = if pass == 0 { durations.first_wait } else { durations.wait };
        for _ in 0..wait {
            step(l, &mut states, &fields);
        }
        for _ in 0..durations.samples {
            for (g, state) in states.iter().enumerate() {
                let v = state.v.map(|v| l.mul(v, per_sample));
                let lanes = out[g * L::WIDTH..].iter_mut().take(L::WIDTH);
                for (lane, out) in lanes.enumerate() {
                    let one = |i: usize| if i < 4 { l.lane(state.x[i], lane) } else { l.lane(v[i - 4], lane) };
                    out[pass].push(std::array::from_fn(|i| one(i) as f32));
                }
            }
            for _ in 0..durations.steps_per_sample {
                step(l, &mut states, &fields);
            }
        }
    }
    out
}
