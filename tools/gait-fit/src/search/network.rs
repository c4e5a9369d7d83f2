//! The thesis' network (eqs 13-16 of "Designing CPG for Biped Locomotion Control using Nonlinear Dynamical Theory", IIITA Allahabad)
//! for the searches: the 32 numbers of one individual, and its fourth-order Runge-Kutta step on [`Lanes`].
//!
//! ```text
//! a_i'' - alpha_i (1 - p_i a_i'^2) a_i' + mu_i^2 (a_i - a_i0) - d_i (a_i' - a_l') - c_i a_m' (a_m - a_m0) = 0
//! ```
//!
//! where l is the same joint of the other side and m the other joint of the same leg. Degrees and seconds.
//!
//! Same equations as `cpg_core::network::thesis`, but without its bounds on the states, so that a diverging individual is
//! detected. As in `cpg_core::math::second_order`, the time unit is half a step and the stages of displacement collapse into sums of accelerations
//! (Nystrom), which leaves 44 operations a step for each joint, seven for each of four accelerations and 16 for the stages.

use cpg_core::network::thesis::ThesisConfig;

use super::lanes::Lanes;

/// One joint of an individual.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Oscillator {
    /// alpha, 1/s.
    pub alpha: f64,
    /// p, (s/deg)^2.
    pub p: f64,
    /// mu, rad/s.
    pub mu: f64,
    /// a0, degrees.
    pub offset: f64,
    /// Gain of the difference link that acts on this joint, 1/s: k12, k21, k34, k43.
    pub difference: f64,
    /// Gain of the product link that acts on this joint, 1/(deg s): k13, k24, k31, k42.
    pub product: f64,
}

/// Displacement from the offset in degrees and velocity in deg/s of each joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NetworkState {
    /// a - a0.
    pub displacement: [f64; 4],
    /// a'.
    pub velocity: [f64; 4],
}

/// One individual: a network and the state it starts in.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Network {
    /// The joints.
    pub joints: [Oscillator; 4],
    /// The start.
    pub start: NetworkState,
}

impl Network {
    /// Velocity amplitude of each joint by harmonic balance, neighbours in antiphase: the start of `cpg_core::network::thesis`.
    #[must_use]
    pub fn cycle_velocity(&self) -> [f64; 4] {
        self.joints.map(|j| 2.0 * ((j.alpha + 2.0 * j.difference.max(0.0)) / (3.0 * j.alpha * j.p)).sqrt())
    }

    /// Starts on the cycle of harmonic balance, joint i ahead by `cycles[i]`, as `cpg_core::network::thesis` does.
    pub fn start_at(&mut self, cycles: [f64; 4]) {
        let velocity = self.cycle_velocity();
        for i in 0..4 {
            let angle = std::f64::consts::TAU * cycles[i];
            self.start.displacement[i] = velocity[i] / self.joints[i].mu * libm::cos(angle);
            self.start.velocity[i] = -velocity[i] * libm::sin(angle);
        }
    }

    /// The state after `steps` steps of `step_s` seconds in f64.
    ///
    /// ```
    /// use gait_fit::search::{Network, NetworkState, Oscillator};
    /// // Without growth and links each joint is a harmonic oscillator: after half a period it is on the other side.
    /// let joint = Oscillator { mu: std::f64::consts::TAU, ..Oscillator::default() };
    /// let start = NetworkState { displacement: [10.0; 4], velocity: [0.0; 4] };
    /// let state = Network { joints: [joint; 4], start }.run(1e-3, 500);
    /// assert!((state.displacement[0] + 10.0).abs() < 1e-6);
    /// ```
    #[must_use]
    pub fn run(&self, step_s: f64, steps: usize) -> NetworkState {
        let mut now = self.start;
        self.each_state(step_s, steps, |state| now = *state);
        now
    }

    /// Calls `see` with each of the `steps` states after the start.
    pub fn each_state(&self, step_s: f64, steps: usize, mut see: impl FnMut(&NetworkState)) {
        let plain = super::lanes::Plain;
        let field = Field::new(plain, &[self], step_s);
        let mut state = Pair::new(plain, &[self], step_s);
        for _ in 0..steps {
            state.step(plain, &field);
            see(&state.individual(plain, 0, step_s));
        }
    }
}

/// The constants of the equations, folded for a time unit c of half a step, for the individuals of one vector.
///
/// Aligned to a cache line, because the vectors themselves are not: without it the search is slower by 40 percent.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Field<V> {
    /// c (alpha + d).
    damping: V,
    /// alpha p / c.
    cubic: V,
    /// (c mu)^2.
    spring: V,
    /// c d.
    difference: V,
    /// c k of the product link.
    product: V,
    third: V,
    two_thirds: V,
}

impl<V: Copy> Field<V> {
    /// Places beyond the individuals repeat the last.
    #[inline(always)]
    pub fn new<L: Lanes<Vector = V>>(l: L, individuals: &[&Network], step_s: f64) -> Self {
        let c = 0.5 * step_s;
        let last = individuals.len() - 1;
        let each = |of: &dyn Fn(&Oscillator) -> f64| -> V {
            l.each(|individual, joint| of(&individuals[individual.min(last)].joints[joint]))
        };
        Self {
            damping: each(&|j| c * (j.alpha + j.difference)),
            cubic: each(&|j| j.alpha * j.p / c),
            spring: each(&|j| (c * j.mu) * (c * j.mu)),
            difference: each(&|j| c * j.difference),
            product: each(&|j| c * j.product),
            third: l.splat(1.0 / 3.0),
            two_thirds: l.splat(2.0 / 3.0),
        }
    }

    /// The constants that `cpg_core` folds for a step of 1 ms. Places beyond the networks repeat the last.
    #[inline(always)]
    pub(crate) fn as_core<L: Lanes<Vector = V>>(l: L, configs: &[&ThesisConfig<f64>]) -> Self {
        let last = configs.len() - 1;
        let each = |of: &dyn Fn(&ThesisConfig<f64>, usize) -> f64| -> V {
            l.each(|individual, joint| of(configs[individual.min(last)], joint))
        };
        // Links between left and right: (0, 1) and (2, 3), between hip and knee: (0, 2) and (1, 3).
        let difference =
            |config: &ThesisConfig<f64>, joint: usize| CORE_UNIT_S * config.difference[joint / 2][joint % 2];
        Self {
            damping: each(&|config, joint| CORE_UNIT_S * config.joints[joint].alpha + difference(config, joint)),
            cubic: each(&|config, joint| config.joints[joint].alpha * config.joints[joint].p / CORE_UNIT_S),
            spring: each(&|config, joint| {
                (CORE_UNIT_S * config.joints[joint].mu) * (CORE_UNIT_S * config.joints[joint].mu)
            }),
            difference: each(&difference),
            product: each(&|config, joint| CORE_UNIT_S * config.product[joint % 2][joint / 2]),
            third: l.splat(1.0 / 3.0),
            two_thirds: l.splat(2.0 / 3.0),
        }
    }
}

/// The time unit of `cpg_core` at a step of 1 ms, seconds: half a step.
pub(crate) const CORE_UNIT_S: f64 = 1000.0 / 2_000_000.0;

/// The accelerations of several vectors of individuals side by side.
#[inline(always)]
fn accelerations<L: Lanes, const G: usize>(
    l: L,
    fields: &[Field<L::Vector>; G],
    x: &[L::Vector; G],
    v: &[L::Vector; G],
) -> [L::Vector; G] {
    let mut a = *x;
    for g in 0..G {
        let (field, x, v) = (&fields[g], x[g], v[g]);
        let damping = l.sub_mul(field.damping, l.mul(v, v), field.cubic);
        let mut sum = l.sub_mul(l.mul(damping, v), x, field.spring);
        sum = l.sub_mul(sum, l.other_side(v), field.difference);
        a[g] = l.mul_add(l.other_joint(l.mul(v, x)), field.product, sum);
    }
    a
}

/// Displacement in degrees and velocity in degrees per half a step.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Pair<V> {
    /// Displacement from the offset, degrees.
    pub x: V,
    /// Velocity, degrees per half a step.
    pub v: V,
}

impl<V: Copy> Pair<V> {
    /// The individuals' starts; places beyond them repeat the last.
    #[inline(always)]
    pub fn new<L: Lanes<Vector = V>>(l: L, individuals: &[&Network], step_s: f64) -> Self {
        let last = individuals.len() - 1;
        let start = |individual: usize| &individuals[individual.min(last)].start;
        Self {
            x: l.each(|individual, joint| start(individual).displacement[joint]),
            v: l.each(|individual, joint| 0.5 * step_s * start(individual).velocity[joint]),
        }
    }

    /// The state of one individual, in degrees and degrees per second.
    pub fn individual<L: Lanes<Vector = V>>(&self, l: L, individual: usize, step_s: f64) -> NetworkState {
        NetworkState {
            displacement: std::array::from_fn(|joint| l.at(self.x, individual, joint)),
            velocity: std::array::from_fn(|joint| l.at(self.v, individual, joint) / (0.5 * step_s)),
        }
    }

    /// One step, as [`step`] does it.
    #[inline(always)]
    pub fn step<L: Lanes<Vector = V>>(&mut self, l: L, field: &Field<V>) {
        step(l, std::array::from_mut(self), std::array::from_ref(field));
    }
}

/// One step of several vectors of individuals. In units of half a step, with k the acceleration at each stage:
///
/// ```text
/// stage 2: x + v, v + k1;   3: x + v + k1, v + k2;   4: x + 2 (v + k2), v + 2 k3
/// x <- x + 2 v + (k1 + k2 + k3) 2/3,   v <- v + (k1 + 2 k2 + 2 k3 + k4) / 3
/// ```
///
/// The vectors take turns operation by operation: a processor looks ahead by fewer instructions than a step has, so that of two steps one
/// behind the other it would find the second too late to fill the waits of the first.
#[inline(always)]
pub fn step<L: Lanes, const G: usize>(l: L, states: &mut [Pair<L::Vector>; G], fields: &[Field<L::Vector>; G]) {
    let x: [L::Vector; G] = std::array::from_fn(|g| states[g].x);
    let v: [L::Vector; G] = std::array::from_fn(|g| states[g].v);
    let k1 = accelerations(l, fields, &x, &v);
    let (mut x2, mut v2) = (x, v);
    for g in 0..G {
        x2[g] = l.add(x[g], v[g]);
        v2[g] = l.add(v[g], k1[g]);
    }
    let k2 = accelerations(l, fields, &x2, &v2);
    let (mut x3, mut v3) = (x, v);
    for g in 0..G {
        x3[g] = l.add(x2[g], k1[g]);
        v3[g] = l.add(v[g], k2[g]);
    }
    let k3 = accelerations(l, fields, &x3, &v3);
    let (mut x4, mut v4) = (x, v);
    for g in 0..G {
        x4[g] = l.plus_twice(x[g], v3[g]);
        v4[g] = l.plus_twice(v[g], k3[g]);
    }
    let k4 = accelerations(l, fields, &x4, &v4);
    for g in 0..G {
        let middle = l.add(k2[g], k3[g]);
        let first = l.add(k1[g], middle);
        let all = l.add(l.add(first, middle), k4[g]);
        states[g].x = l.mul_add(first, fields[g].two_thirds, l.plus_twice(x[g], v[g]));
        states[g].v = l.mul_add(all, fields[g].third, v[g]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Doubles, MOST_VECTORS, Plain, Singles, blocks, dispatch};
    use super::super::random::Random;
    use super::*;
    use proptest::prelude::*;
    use pulp::{Arch, Simd, WithSimd};

    /// Networks with different parameters near those of the thesis.
    fn networks(count: usize) -> Vec<Network> {
        let mut random = Random::new(2);
        let mut near = |x: f64| x * (0.9 + 0.2 * random.unit());
        let mut of = || {
            let mut network = Network::default();
            for joint in &mut network.joints {
                *joint = Oscillator {
                    alpha: near(0.2),
                    p: near(1.3),
                    mu: near(1.0),
                    offset: 0.0,
                    difference: near(0.1),
                    product: near(0.1),
                };
            }
            network.start_at([0.0, 0.5, 0.2, 0.7]);
            network
        };
        (0..count).map(|_| of()).collect()
    }

    const STEP: f64 = 0.03;

    /// The bits of all states of each individual after the steps, `G` vectors in turns.
    fn run<L: Lanes, const G: usize>(l: L, all: &[Network], steps: usize) -> Vec<[u64; 8]> {
        let mut out = vec![];
        for part in all.chunks(G * L::INDIVIDUALS) {
            let part: Vec<&Network> = part.iter().collect();
            // Of the last vectors some may be empty: they repeat the last individual.
            let of = |g: usize| {
                let from = (g * L::INDIVIDUALS).min(part.len() - 1);
                &part[from..part.len().min((g + 1) * L::INDIVIDUALS).max(from + 1)]
            };
            let fields: [Field<L::Vector>; G] = std::array::from_fn(|g| Field::new(l, of(g), STEP));
            let mut states: [Pair<L::Vector>; G] = std::array::from_fn(|g| Pair::new(l, of(g), STEP));
            for _ in 0..steps {
                step(l, &mut states, &fields);
            }
            for index in 0..part.len() {
                let (state, individual) = (&states[index / L::INDIVIDUALS], index % L::INDIVIDUALS);
                let one = |i: usize| {
                    if i < 4 { l.at(state.x, individual, i) } else { l.at(state.v, individual, i - 4) }
                };
                out.push(std::array::from_fn(|i| one(i).to_bits()));
            }
        }
        out
    }

    /// The equations of the head of this file for one individual in f32, joint by joint, in the order in which the vectors have them.
    fn plainly(network: &Network, steps: usize) -> [u64; 8] {
        let c = 0.5 * STEP;
        let fold = |of: &dyn Fn(&Oscillator) -> f64| network.joints.map(|joint| of(&joint) as f32);
        let damping = fold(&|j| c * (j.alpha + j.difference));
        let cubic = fold(&|j| j.alpha * j.p / c);
        let spring = fold(&|j| (c * j.mu) * (c * j.mu));
        let difference = fold(&|j| c * j.difference);
        let product = fold(&|j| c * j.product);
        let acceleration = |x: [f32; 4], v: [f32; 4]| -> [f32; 4] {
            std::array::from_fn(|i| {
                let (side, leg) = ([1, 0, 3, 2][i], [2, 3, 0, 1][i]);
                let damped = (-(v[i] * v[i])).mul_add(cubic[i], damping[i]);
                let mut sum = (-x[i]).mul_add(spring[i], damped * v[i]);
                sum = (-v[side]).mul_add(difference[i], sum);
                (v[leg] * x[leg]).mul_add(product[i], sum)
            })
        };
        let plus = |a: [f32; 4], b: [f32; 4]| -> [f32; 4] { std::array::from_fn(|i| a[i] + b[i]) };
        let plus_times =
            |a: [f32; 4], by: f32, b: [f32; 4]| -> [f32; 4] { std::array::from_fn(|i| by.mul_add(b[i], a[i])) };
        let mut x = network.start.displacement.map(|x| x as f32);
        let mut v = network.start.velocity.map(|v| (0.5 * STEP * v) as f32);
        for _ in 0..steps {
            let k1 = acceleration(x, v);
            let (x2, v2) = (plus(x, v), plus(v, k1));
            let k2 = acceleration(x2, v2);
            let (x3, v3) = (plus(x2, k1), plus(v, k2));
            let k3 = acceleration(x3, v3);
            let (x4, v4) = (plus_times(x, 2.0, v3), plus_times(v, 2.0, k3));
            let k4 = acceleration(x4, v4);
            let middle = plus(k2, k3);
            let first = plus(k1, middle);
            let all = plus(plus(first, middle), k4);
            x = plus_times(plus_times(x, 2.0, v), 2.0 / 3.0, first);
            v = plus_times(v, 1.0 / 3.0, all);
        }
        std::array::from_fn(|i| f64::from(if i < 4 { x[i] } else { v[i - 4] }).to_bits())
    }

    /// The states in vectors of f32, so many vectors in turns.
    struct Turns<'a> {
        all: &'a [Network],
        steps: usize,
        vectors: usize,
    }

    impl WithSimd for Turns<'_> {
        type Output = Vec<[u64; 8]>;

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let (l, all, steps) = (Singles(simd), self.all, self.steps);
            match self.vectors {
                1 => run::<_, 1>(l, all, steps),
                2 => run::<_, 2>(l, all, steps),
                3 => run::<_, 3>(l, all, steps),
                5 => run::<_, 5>(l, all, steps),
                _ => run::<_, 8>(l, all, steps),
            }
        }
    }

    /// In f64, where the vectors take turns or not.
    struct InDouble<'a>(&'a [Network]);

    impl WithSimd for InDouble<'_> {
        type Output = Vec<[u64; 8]>;

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let alone = run::<_, 1>(Doubles::<S, false>(simd), self.0, 400);
            assert_eq!(run::<_, 2>(Doubles::<S, false>(simd), self.0, 400), alone);
            alone
        }
    }

    #[test]
    fn in_f32_and_in_f64_it_is_the_same_motion() {
        let all = networks(96);
        let singles = dispatch(Turns { all: &all, steps: 400, vectors: 8 });
        let doubles = Arch::new().dispatch(InDouble(&all));
        let plain = run::<_, 1>(Plain, &all, 400);
        assert_eq!(run::<_, 2>(Plain, &all, 400), plain);
        // It moves by about 1.
        for ((single, double), plain) in singles.iter().zip(&doubles).zip(&plain) {
            for ((single, double), plain) in single.iter().zip(double).zip(plain) {
                let [single, double, plain] = [single, double, plain].map(|bits| f64::from_bits(*bits));
                assert!(plain.is_finite() && (single - plain).abs() < 1e-3, "{single} {plain}");
                assert!((double - plain).abs() < 1e-12, "{double} {plain}");
            }
        }
        // The individuals differ, or nothing was compared.
        assert!(plain[0] != plain[1] && plain.iter().flatten().any(|bits| f64::from_bits(*bits).abs() > 0.1));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Every individual has the bits of the plain equations, in vectors of this machine, whatever its place and its neighbours, also
        /// where a vector or the turns are not full.
        #[test]
        fn an_individual_in_a_vector_has_the_bits_of_one_alone(
            genes in prop::collection::vec(prop::array::uniform32(-1.0..1.0f64), 1..50),
            vectors in prop::sample::select(vec![1usize, 2, 3, 5, 8]),
        ) {
            let all: Vec<Network> = genes.iter().map(|g| {
                let joints = std::array::from_fn(|i| Oscillator {
                    alpha: 0.3 + 0.25 * g[i],
                    p: 1.0 + 0.5 * g[i + 4],
                    mu: 1.0 + 0.5 * g[i + 8],
                    offset: 0.0,
                    difference: 0.2 * g[i + 12],
                    product: 0.3 * g[i + 16],
                });
                let start = NetworkState {
                    displacement: std::array::from_fn(|i| 2.0 * g[i + 20]),
                    velocity: std::array::from_fn(|i| 2.0 * g[i + 24]),
                };
                Network { joints, start }
            }).collect();
            let got = dispatch(Turns { all: &all, steps: 60, vectors });
            prop_assert_eq!(got.len(), all.len());
            for (index, (got, network)) in got.iter().zip(&all).enumerate() {
                let want = plainly(network, 60);
                // What diverges is not compared: it has no cost.
                if want.iter().all(|bits| f64::from_bits(*bits).is_finite()) {
                    prop_assert_eq!(*got, want, "individual {} of {}", index, all.len());
                }
            }
        }
    }

    /// Every individual is in one block, in order, and the blocks are of whole vectors and few sizes.
    #[test]
    fn blocks_hold_every_individual_once() {
        for threads in [1, 2, 3, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for individuals in (0..200).chain([640, 1000]) {
                let all = pool.install(|| blocks(individuals));
                let ends: Vec<usize> = std::iter::once(0).chain(all.iter().map(|block| block.end)).collect();
                assert!(all.iter().zip(&ends).all(|(block, end)| block.start == *end && block.end > *end), "{all:?}");
                assert_eq!(ends.last(), Some(&individuals), "{all:?}");
                let sizes = all.iter().map(ExactSizeIterator::len);
                assert!(sizes.clone().max().unwrap_or(0) <= MOST_VECTORS * 4, "{all:?}");
            }
        }
    }
}
