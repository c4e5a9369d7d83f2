//! Nanoseconds a step of each generator on this machine: `cargo run -p cpg-core --profile host --example step_cost`.
//!
//! The best of several runs, since other work on the machine can only add to it. What a step costs on the board is another question.

use std::hint::black_box;
use std::time::Instant;

use cpg_core::gait::default_walk::{default_config, default_walk};
use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled::Robust;
use cpg_core::network::thesis::{Thesis, ThesisConfig};
use cpg_core::oscillator::rayleigh::{Rayleigh, RayleighConfig};
use cpg_core::{BuildError, Generator, SemiImplicitEuler};
use joint_units::Period;

const STEPS: u32 = 1_000_000;

fn cost<const N: usize>(name: &str, mut generator: impl Generator<N>) {
    let best = (0..9).map(|_| {
        let start = Instant::now();
        for _ in 0..STEPS {
            black_box(&mut generator).step();
        }
        start.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS)
    });
    println!("{name:<28} {:6.1} ns", best.fold(f64::MAX, f64::min));
}

fn read_outs(name: &str, walk: &impl Generator<4>) {
    let best = (0..9).map(|_| {
        let start = Instant::now();
        for _ in 0..STEPS {
            let walk = black_box(walk);
            black_box((walk.angles(), walk.rates(), walk.phase(), walk.amplitude(), walk.check().is_ok()));
        }
        start.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS)
    });
    println!("{name:<28} {:6.1} ns", best.fold(f64::MAX, f64::min));
}

fn main() -> Result<(), BuildError> {
    let period = Period::MILLISECOND;
    let euler: Robust<Biped, 4, 4, f32, SemiImplicitEuler> = default_config().build(period)?;
    let thesis: Thesis = ThesisConfig::set_s().build(period)?;
    let rayleigh: Rayleigh = RayleighConfig { alpha: 1.0, p: 5.0, mu: 1.0, offset: 0.0 }.build(period)?;
    cost("walk: R1, Runge-Kutta", default_walk(period)?);
    cost("R1, semi-implicit Euler", euler);
    cost("thesis, Runge-Kutta", thesis);
    cost("Rayleigh, Runge-Kutta", rayleigh);
    read_outs("walk: all read-outs", &default_walk(period)?);
    Ok(())
}
