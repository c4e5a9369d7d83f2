//! What the tests measure with: a second integrator, crossings between steps, random starts. Each test file uses a part of it.
#![allow(dead_code)]

use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled::{Robust, RobustConfig};
use cpg_core::{Generator, Integrator, OscillatorState};
use joint_units::{Period, Phase, Radians};

/// The textbook Runge-Kutta method on a first-order system in its own units: shares nothing with the crate but the idea.
pub(crate) fn rk4<const D: usize>(f: &impl Fn(&[f64; D]) -> [f64; D], y: &[f64; D], h: f64) -> [f64; D] {
    let at = |k: &[f64; D], s: f64| core::array::from_fn(|i| y[i] + s * k[i]);
    let k1 = f(y);
    let k2 = f(&at(&k1, h / 2.0));
    let k3 = f(&at(&k2, h / 2.0));
    let k4 = f(&at(&k3, h));
    core::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

pub(crate) fn micros(micros: u32) -> Period {
    Period::from_micros(micros).expect("a period inside its range")
}

/// Upward zero crossings of a sampled displacement, placed between the samples by the cubic that fits value and slope at both ends.
pub(crate) struct Crossings {
    h: f64,
    tick: u64,
    last: Option<(f64, f64)>,
    pub(crate) times: Vec<f64>,
}

impl Crossings {
    pub(crate) fn new(h: f64) -> Self {
        Self { h, tick: 0, last: None, times: Vec::new() }
    }

    /// The next sample: displacement and its rate per second.
    pub(crate) fn sample(&mut self, x: f64, rate: f64) {
        if let Some((x0, rate0)) = self.last
            && x0 < 0.0
            && x >= 0.0
        {
            let part = zero(x0, x, rate0 * self.h, rate * self.h);
            self.times.push((self.tick as f64 - 1.0 + part) * self.h);
        }
        self.last = Some((x, rate));
        self.tick += 1;
    }

    /// Mean time between the last `n + 1` crossings.
    pub(crate) fn period(&self, n: usize) -> f64 {
        let last = self.times.len() - 1;
        (self.times[last] - self.times[last - n]) / n as f64
    }
}

/// Where in 0..1 the Hermite cubic with these values and slopes is zero.
fn zero(a: f64, b: f64, da: f64, db: f64) -> f64 {
    let value = |s: f64| {
        let r = 1.0 - s;
        a * r * r * (1.0 + 2.0 * s) + b * s * s * (3.0 - 2.0 * s) + da * s * r * r - db * s * s * r
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if value(middle) < 0.0 { low = middle } else { high = middle }
    }
    low
}

/// splitmix64: enough for random starts, and the same everywhere.
pub(crate) struct Random(pub u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform between -`limit` and `limit`.
    pub(crate) fn within(&mut self, limit: f64) -> f64 {
        ((self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0) * limit
    }

    pub(crate) fn state(&mut self, limit: f64) -> OscillatorState<4, f64> {
        OscillatorState {
            displacement: core::array::from_fn(|_| self.within(limit)),
            velocity: core::array::from_fn(|_| self.within(limit)),
        }
    }
}

pub(crate) fn single(state: &OscillatorState<4, f64>) -> OscillatorState<4> {
    OscillatorState { displacement: state.displacement.map(|x| x as f32), velocity: state.velocity.map(|v| v as f32) }
}

/// Distance from `a` to `b` on the circle in degrees, -180 to 180.
pub(crate) fn apart(a: f64, b: f64) -> f64 {
    (a - b + 540.0).rem_euclid(360.0) - 180.0
}

/// Phase in degrees of each joint of a normalised state.
pub(crate) fn phases(state: &OscillatorState<4, f64>) -> [f64; 4] {
    core::array::from_fn(|i| (-state.velocity[i]).atan2(state.displacement[i]).to_degrees())
}

pub(crate) type R1<I> = Robust<Biped, 4, 4, f64, I>;

pub(crate) const W: f64 = core::f64::consts::TAU / 1.1;

/// R1 at w = 2 pi / 1.1 with the walking phases, amplitude 1 rad and no offset: normalised states.
pub(crate) fn r1_config(eps: f64, kap: f64) -> RobustConfig<4, 4, f64> {
    RobustConfig {
        natural_period: 1.1,
        nonlinearity: eps,
        coupling: [kap; 4],
        phases: [0u64, 180, 260, 80].map(|degrees| Phase((((degrees << 32) + 180) / 360) as u32)),
        amplitudes: [Radians(1.0); 4],
        offsets: [Radians(0.0); 4],
    }
}

pub(crate) fn r1_single(eps: f32, kap: f32) -> RobustConfig<4, 4> {
    let RobustConfig { phases, amplitudes, offsets, .. } = r1_config(0.5, 0.5);
    RobustConfig { natural_period: 1.1, nonlinearity: eps, coupling: [kap; 4], phases, amplitudes, offsets }
}

pub(crate) fn r1<I: Integrator>(eps: f64, kap: f64, period: Period) -> R1<I> {
    r1_config(eps, kap).build(period).expect("a valid configuration")
}

pub(crate) fn run<const N: usize>(generator: &mut impl Generator<N>, steps: u64) {
    for _ in 0..steps {
        generator.step();
    }
}
