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
//! (Nystrom), which leaves 164 operations a step, 28 for each of four accelerations and 13 a joint for the stages.

use super::lanes::Lanes;

/// Left to right of hips and knees: the neighbour of the difference link.
const OTHER_SIDE: [usize; 4] = [1, 0, 3, 2];
/// Hip to knee and back: the neighbour of the product link.
const SAME_LEG: [usize; 4] = [2, 3, 0, 1];

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
            see(&state.lane(plain, 0, step_s));
        }
    }
}

/// The constants of the equations, folded for a time unit c of half a step, for one individual a lane.
///
/// Aligned to a cache line, because the vectors themselves are not: without it the search is slower by 40 percent.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Field<V> {
    /// c (alpha + d).
    damping: [V; 4],
    /// alpha p / c.
    cubic: [V; 4],
    /// (c mu)^2.
    spring: [V; 4],
    /// c d.
    difference: [V; 4],
    /// c k of the product link.
    product: [V; 4],
    third: V,
    two_thirds: V,
    two: V,
}

impl<V: Copy> Field<V> {
    /// Lanes beyond the individuals repeat the last.
    #[inline(always)]
    pub fn new<L: Lanes<Vector = V>>(l: L, individuals: &[&Network], step_s: f64) -> Self {
        let c = 0.5 * step_s;
        let last = individuals.len() - 1;
        let each = |of: &dyn Fn(&Oscillator) -> f64| -> [V; 4] {
            std::array::from_fn(|joint| l.each(|lane| of(&individuals[lane.min(last)].joints[joint])))
        };
        Self {
            damping: each(&|j| c * (j.alpha + j.difference)),
            cubic: each(&|j| j.alpha * j.p / c),
            spring: each(&|j| (c * j.mu) * (c * j.mu)),
            difference: each(&|j| c * j.difference),
            product: each(&|j| c * j.product),
            third: l.splat(L::scalar(1.0 / 3.0)),
            two_thirds: l.splat(L::scalar(2.0 / 3.0)),
            two: l.splat(L::scalar(2.0)),
        }
    }
}

/// The acceleration of each joint, for several vectors of individuals side by side.
#[inline(always)]
fn accelerations<L: Lanes, const G: usize>(
    l: L,
    fields: &[Field<L::Vector>; G],
    x: &[[L::Vector; 4]; G],
    v: &[[L::Vector; 4]; G],
) -> [[L::Vector; 4]; G] {
    let mut a = *x;
    for i in 0..4 {
        for g in 0..G {
            let (field, x, v) = (&fields[g], &x[g], &v[g]);
            let damping = l.sub_mul(field.damping[i], l.mul(v[i], v[i]), field.cubic[i]);
            let mut sum = l.sub_mul(l.mul(damping, v[i]), x[i], field.spring[i]);
            sum = l.sub_mul(sum, v[OTHER_SIDE[i]], field.difference[i]);
            let m = SAME_LEG[i];
            a[g][i] = l.mul_add(l.mul(v[m], x[m]), field.product[i], sum);
        }
    }
    a
}

/// Displacement in degrees and velocity in degrees per half a step.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Pair<V> {
    /// Displacement from the offset, degrees.
    pub x: [V; 4],
    /// Velocity, degrees per half a step.
    pub v: [V; 4],
}

impl<V: Copy> Pair<V> {
    /// The individuals' starts; lanes beyond them repeat the last.
    #[inline(always)]
    pub fn new<L: Lanes<Vector = V>>(l: L, individuals: &[&Network], step_s: f64) -> Self {
        let last = individuals.len() - 1;
        let start = |lane: usize| &individuals[lane.min(last)].start;
        Self {
            x: std::array::from_fn(|i| l.each(|lane| start(lane).displacement[i])),
            v: std::array::from_fn(|i| l.each(|lane| 0.5 * step_s * start(lane).velocity[i])),
        }
    }

    /// The state of one individual, in degrees and degrees per second.
    pub fn lane<L: Lanes<Vector = V>>(&self, l: L, lane: usize, step_s: f64) -> NetworkState {
        NetworkState {
            displacement: self.x.map(|x| l.lane(x, lane)),
            velocity: self.v.map(|v| l.lane(v, lane) / (0.5 * step_s)),
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
    let x: [[L::Vector; 4]; G] = std::array::from_fn(|g| states[g].x);
    let v: [[L::Vector; 4]; G] = std::array::from_fn(|g| states[g].v);
    let k1 = accelerations(l, fields, &x, &v);
    let (mut x2, mut v2) = (x, v);
    for i in 0..4 {
        for g in 0..G {
            x2[g][i] = l.add(x[g][i], v[g][i]);
            v2[g][i] = l.add(v[g][i], k1[g][i]);
        }
    }
    let k2 = accelerations(l, fields, &x2, &v2);
    let (mut x3, mut v3) = (x, v);
    for i in 0..4 {
        for g in 0..G {
            x3[g][i] = l.add(x2[g][i], k1[g][i]);
            v3[g][i] = l.add(v[g][i], k2[g][i]);
        }
    }
    let k3 = accelerations(l, fields, &x3, &v3);
    let (mut x4, mut v4) = (x, v);
    for i in 0..4 {
        for g in 0..G {
            x4[g][i] = l.mul_add(fields[g].two, v3[g][i], x[g][i]);
            v4[g][i] = l.mul_add(fields[g].two, k3[g][i], v[g][i]);
        }
    }
    let k4 = accelerations(l, fields, &x4, &v4);
    for i in 0..4 {
        for g in 0..G {
            let middle = l.add(k2[g][i], k3[g][i]);
            let first = l.add(k1[g][i], middle);
            let all = l.add(l.add(first, middle), k4[g][i]);
            let moved = l.mul_add(fields[g].two, v[g][i], x[g][i]);
            states[g].x[i] = l.mul_add(first, fields[g].two_thirds, moved);
            states[g].v[i] = l.mul_add(all, fields[g].third, v[g][i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Doubles, Plain, Singles};
    use super::super::random::Random;
    use super::*;
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

    const STEPS: usize = 400;
    const STEP: f64 = 0.03;

    /// The bits of all states of each individual after the steps, `G` vectors in turns.
    fn run<L: Lanes, const G: usize>(l: L, all: &[Network]) -> Vec<[u64; 8]> {
        let mut out = vec![];
        for part in all.chunks(G * L::WIDTH) {
            let part: Vec<&Network> = part.iter().collect();
            let of = |g: usize| &part[g * L::WIDTH..(g + 1) * L::WIDTH];
            let fields: [Field<L::Vector>; G] = std::array::from_fn(|g| Field::new(l, of(g), STEP));
            let mut states: [Pair<L::Vector>; G] = std::array::from_fn(|g| Pair::new(l, of(g), STEP));
            for _ in 0..STEPS {
                step(l, &mut states, &fields);
            }
            for state in &states {
                for lane in 0..L::WIDTH {
                    let one = |i: usize| if i < 4 { l.lane(state.x[i], lane) } else { l.lane(state.v[i - 4], lane) };
                    out.push(std::array::from_fn(|i| one(i).to_bits()));
                }
            }
        }
        out
    }

    /// Vectors of this machine that take turns have the bits of vectors one after the other, in f32 and in f64.
    struct InTurns;

    impl WithSimd for InTurns {
        type Output = Vec<[u64; 8]>;

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let all = networks(96);
            let singles = run::<_, 1>(Singles(simd), &all);
            assert_eq!(run::<_, 2>(Singles(simd), &all), singles);
            assert_eq!(run::<_, 3>(Singles(simd), &all), singles);
            assert_eq!(run::<_, 2>(Doubles(simd), &all), run::<_, 1>(Doubles(simd), &all));
            singles
        }
    }

    #[test]
    fn vectors_in_turns_have_the_bits_of_single_ones() {
        let in_lanes = Arch::new().dispatch(InTurns);
        let all = networks(96);
        let plain = run::<_, 1>(Plain, &all);
        assert_eq!(run::<_, 2>(Plain, &all), plain);
        // In f32 and in f64 it is the same motion, which moves by about 1.
        for (single, plain) in in_lanes.iter().zip(&plain) {
            for (a, b) in single.iter().zip(plain) {
                let (a, b) = (f64::from_bits(*a), f64::from_bits(*b));
                assert!(b.is_finite() && (a - b).abs() < 1e-3, "{a} {b}");
            }
        }
        // The individuals differ, or nothing was compared.
        assert!(plain[0] != plain[1] && plain.iter().flatten().any(|bits| f64::from_bits(*bits).abs() > 0.1));
    }
}
