//! Simulates networks of `cpg_core` in f64 side by side, one a lane, with the bits that each has alone.

use cpg_core::OscillatorState;
use cpg_core::network::thesis::{Thesis, ThesisConfig};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{Doubles, Lanes};
use super::network::{CORE_UNIT_S, Field, Pair, step};

/// States of a network.
pub(crate) type States = Vec<OscillatorState<4, f64>>;

/// Part of a bound within which the rounding of the comparison does not matter.
const SURELY: f64 = 1.0 - 1e-9;

/// A network at a step of 1 ms, with the numbers that it was built of.
#[derive(Clone)]
pub(crate) struct Built {
    pub(crate) config: ThesisConfig<f64>,
    pub(crate) net: Thesis<f64>,
}

/// Advances each network by `steps` and `recorded` steps; its state before each of the latter, and after them. `None` for a network that comes
/// to a bound, where `cpg_core` holds it.
pub(crate) fn side_by_side(all: &[Built], steps: usize, recorded: usize) -> Vec<Option<States>> {
    // On all cores at once.
    let share = all.len().div_ceil(rayon::current_num_threads()).max(1);
    all.par_chunks(share).flat_map_iter(|part| Arch::new().dispatch(Run { part, steps, recorded })).collect()
}

struct Run<'a> {
    part: &'a [Built],
    steps: usize,
    recorded: usize,
}

impl WithSimd for Run<'_> {
    type Output = Vec<Option<States>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        // No closure: what it does would be compiled for every processor, and be slow.
        let mut all = Vec::with_capacity(self.part.len());
        for part in self.part.chunks(Doubles::<S, true>::INDIVIDUALS) {
            all.extend(vector(Doubles::<S, true>(simd), part, self.steps, self.recorded));
        }
        all
    }
}

/// One step; `largest` is the largest size of each state so far.
#[inline(always)]
fn advance<S: Simd>(
    l: Doubles<S, true>,
    state: &mut [Pair<[S::f64s; 4]>; 1],
    field: &[Field<[S::f64s; 4]>; 1],
    largest: &mut Pair<[S::f64s; 4]>,
) {
    step(l, state, field);
    largest.x = l.greater_size(largest.x, state[0].x);
    largest.v = l.greater_size(largest.v, state[0].v);
}

/// As many networks as a vector has lanes, or fewer.
#[inline(always)]
fn vector<S: Simd>(l: Doubles<S, true>, part: &[Built], steps: usize, recorded: usize) -> Vec<Option<States>> {
    let last = part.len() - 1;
    let configs: Vec<&ThesisConfig<f64>> = part.iter().map(|built| &built.config).collect();
    let starts: Vec<OscillatorState<4, f64>> = part.iter().map(|built| built.net.state_per_unit()).collect();
    let field = [Field::as_core(l, &configs)];
    let mut state = [Pair {
        x: l.each(|one, joint| starts[one.min(last)].displacement[joint]),
        v: l.each(|one, joint| starts[one.min(last)].velocity[joint]),
    }];
    let mut largest = Pair { x: l.splat(0.0), v: l.splat(0.0) };
    for _ in 0..steps {
        advance(l, &mut state, &field, &mut largest);
    }
    let mut states: Vec<States> = part.iter().map(|_| Vec::with_capacity(recorded + 1)).collect();
    let mut keep = |state: &Pair<_>| {
        for (one, states) in states.iter_mut().enumerate() {
            states.push(OscillatorState {
                displacement: std::array::from_fn(|joint| l.at(state.x, one, joint)),
                velocity: std::array::from_fn(|joint| l.at(state.v, one, joint) * (1.0 / CORE_UNIT_S)),
            });
        }
    };
    keep(&state[0]);
    for _ in 0..recorded {
        advance(l, &mut state, &field, &mut largest);
        keep(&state[0]);
    }
    // A state that is not a number stays so.
    let is_inside = |one: usize| {
        let limit = part[one].net.limit();
        (0..4).all(|joint| {
            let is_number = (l.at(state[0].x, one, joint) + l.at(state[0].v, one, joint)).is_finite();
            is_number
                && l.at(largest.x, one, joint) < SURELY * limit.displacement[joint]
                && l.at(largest.v, one, joint) / CORE_UNIT_S < SURELY * limit.velocity[joint]
        })
    };
    states.into_iter().enumerate().map(|(one, states)| is_inside(one).then_some(states)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::network::graph::{HipKnee, LeftRight};
    use cpg_core::{Generator, Rk4};
    use joint_units::{Period, Phase};
    use proptest::prelude::*;

    fn built(genes: [f64; 20]) -> Option<Built> {
        let mut config = ThesisConfig::<f64>::set_s();
        for (i, joint) in config.joints.iter_mut().enumerate() {
            joint.alpha = 0.2 + 2.0 * genes[i];
            joint.mu *= 0.7 + 0.6 * genes[i + 4];
            let k = genes[i + 8];
            config.difference[i / 2][i % 2] = k;
            joint.p = cpg_core::network::thesis::harmonic_balance_p(joint.alpha, k, joint.mu, 25.0);
            config.product[i % 2][i / 2] = 0.2 * (genes[i + 12] - 0.5);
            config.phases[i] = Phase::from_cycles(genes[i + 16] as f32);
        }
        let net = config.build::<LeftRight, HipKnee, Rk4>(Period::MILLISECOND).ok()?;
        Some(Built { config, net })
    }

    /// The same by the core; `None` if it comes to a bound.
    fn alone(one: &Built, steps: usize, recorded: usize) -> Option<States> {
        let mut net = one.net;
        for _ in 0..steps {
            net.step();
            net.check().ok()?;
        }
        let mut states = vec![net.state()];
        for _ in 0..recorded {
            net.step();
            net.check().ok()?;
            states.push(net.state());
        }
        Some(states)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// Every network has the bits of the core, in any place of a vector, and only one that comes to a bound is left out.
        #[test]
        fn networks_side_by_side_have_the_bits_of_the_core(
            genes in prop::collection::vec(prop::array::uniform20(0.0..1.0f64), 1..20), steps in 0usize..3000,
        ) {
            let all: Vec<Built> = genes.into_iter().filter_map(built).collect();
            let got = side_by_side(&all, steps, 50);
            prop_assert_eq!(got.len(), all.len());
            for (one, got) in all.iter().zip(got) {
                prop_assert_eq!(got, alone(one, steps, 50));
            }
        }
    }

    /// Most networks of that test are inside their bounds, or it would compare nothing; one that starts beyond what it holds comes to a bound.
    #[test]
    fn most_networks_are_inside_and_one_at_its_bound_is_left_out() {
        let mut random = super::super::random::Random::new(3);
        let all: Vec<Built> = (0..40).filter_map(|_| built(std::array::from_fn(|_| random.unit()))).collect();
        let inside = side_by_side(&all, 3000, 10).iter().flatten().count();
        assert!(all.len() > 20 && 2 * inside > all.len(), "{inside} of {}", all.len());
        let mut wild = all[0].clone();
        wild.config.joints[2].mu *= 0.05;
        assert_eq!(side_by_side(&[all[0].clone(), wild, all[1].clone()], 3000, 10)[1], None);
    }
}
