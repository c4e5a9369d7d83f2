//! Every generator: build with any configuration and period, then everything that a tick calls.

use core::hint::black_box;

use cpg_core::adaptive_fourier::{AdaptiveFourier, AdaptiveFourierConfig};
use cpg_core::graph::Biped;
use cpg_core::hexapod::Hexapod;
use cpg_core::hexapod_walk::{HexapodWalk, HexapodWalkConfig};
use cpg_core::obb::{Obb, Reversibilities};
use cpg_core::programmable::{ProgrammableConfig, ProgrammableCpg};
use cpg_core::rayleigh::{Rayleigh, RayleighConfig};
use cpg_core::robust::Robust;
use cpg_core::shape::{FourierShape, PhaseShape, SplineShape};
use cpg_core::thesis::{Thesis, ThesisConfig};
use cpg_core::transition::{Smooth, TransitionConfig};
use cpg_core::walking::{Walk, default_config, default_walk};
use cpg_core::{BuildError, Generator, SemiImplicitEuler};
use joint_units::{Period, Radians};

pub(crate) fn prove(period: Period) {
    run(default_walk(period));
    run::<4, Robust<Biped, 4, 4>>(black_box(default_config()).build(period));
    run::<4, Robust<Biped, 4, 4, f32, SemiImplicitEuler>>(black_box(default_config()).build(period));
    let rayleigh: RayleighConfig = black_box(RayleighConfig { alpha: 0.2, p: 5.0, mu: 1.0, offset: 10.0 });
    run::<1, Rayleigh>(rayleigh.build(period));
    run::<4, Thesis>(black_box(ThesisConfig::set_s()).build(period));
    run(HexapodWalk::build(black_box(5), black_box(HexapodWalkConfig::default()), period));
    shapes(period);
    changes(period);
    integers();
    learners(period);
}

fn run<const N: usize, G: Generator<N>>(built: Result<G, BuildError>) {
    let Ok(generator) = built else { return };
    let mut generator = black_box(generator);
    generator.step();
    let _ =
        black_box((generator.angles(), generator.rates(), generator.phase(), generator.amplitude(), generator.check()));
    generator.reset();
    black_box(&generator);
}

fn shapes(period: Period) {
    let angle = || black_box(Radians(0.1));
    let stride_s = black_box(1.1);
    if let Ok(shape) = FourierShape::<3>::build(angle(), black_box([0.1; 3]), black_box([0.1; 3])) {
        run(PhaseShape::build([shape; 4], stride_s, period));
    }
    if let Ok(shape) = SplineShape::<8>::build(black_box([Radians(0.1); 8])) {
        run(PhaseShape::build([shape; 4], stride_s, period));
    }
}

fn changes(period: Period) {
    let Ok(walk) = default_walk(period) else { return };
    let Ok(smooth) = Smooth::<Walk, 4>::build(walk, black_box(TransitionConfig::default()), period) else { return };
    let mut smooth = black_box(smooth);
    smooth.change(|walk| walk.reset());
    smooth.stop(black_box([Radians(0.0); 4]));
    smooth.step();
    smooth.resume();
    run(Ok(smooth));
}

fn integers() {
    if let Ok(reversibilities) = Reversibilities::build(black_box(1), black_box(2)) {
        let mut obb = black_box(Obb::new(reversibilities));
        black_box(obb.step());
        black_box(obb.potentials());
    }
    if let Ok(hexapod) = Hexapod::build(black_box(3)) {
        let mut hexapod = black_box(hexapod);
        black_box(hexapod.step());
        let _ = black_box(hexapod.set_reversibility(black_box(1)));
        black_box(&hexapod);
    }
}

fn learners(period: Period) {
    if let Ok(learner) = AdaptiveFourier::<5>::build(black_box(AdaptiveFourierConfig::default()), period) {
        let mut learner = black_box(learner);
        black_box(learner.learn(black_box(0.1)));
        learner.play();
        black_box((learner.value(), learner.phase(), learner.frequency_hz()));
    }
    let config = black_box(ProgrammableConfig::<4>::harmonics_of(0.9));
    if let Ok(learner) = ProgrammableCpg::build(&config, period) {
        let mut learner = black_box(learner);
        black_box(learner.learn(black_box(0.1)));
        learner.play();
        black_box(learner.value());
    }
}
