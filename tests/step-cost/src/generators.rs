//! Counted generators: every generator of the catalogue [`cpg_core::walkers`], and a few variants. The step of each is a function with its
//! own symbol, not generic and not inlined, for a disassembly (`llvm-objdump -d --disassemble-symbols=step_robust`).

use core::fmt::Write as _;
use core::hint::black_box;

use cpg_core::adaptive_fourier::AdaptiveWalk;
use cpg_core::bank_walk::BankWalk;
use cpg_core::fitzhugh_nagumo::FitzHughNagumo;
use cpg_core::fixed_point::FixedRobust;
use cpg_core::fixed_shape::FixedPhaseShape;
use cpg_core::golubitsky::LegNetwork;
use cpg_core::graph::Biped;
use cpg_core::hexapod_walk::{HexapodWalk, HexapodWalkConfig};
use cpg_core::hopf::{AdaptiveHopf, Hopf};
use cpg_core::joint_walker::JointWalker;
use cpg_core::matsuoka::Matsuoka;
use cpg_core::morris_lecar::MorrisLecar;
use cpg_core::obb_walk::ObbWalk;
use cpg_core::shape::{FourierShape, PhaseShape, SplineShape};
use cpg_core::terman_wang::TermanWang;
use cpg_core::thesis::Thesis;
use cpg_core::transition::{Smooth, TransitionConfig};
use cpg_core::van_der_pol::VanDerPol;
use cpg_core::walkers::{self, HalfCentreWalker};
use cpg_core::walking::{Walk, default_config};
use cpg_core::{BuildError, Generator};
use joint_units::{Period, Phase, RadPerSec2, Radians};

use crate::count::{self, Function, InstructionCount, count};
use crate::semihosting::{TextLine, exit};

/// For each generator: its name, the function that builds it, its type, and the symbols of a step and of a step with its angles.
macro_rules! generators {
    ($($name:literal $build:path, $type:ty, $step:ident $tick:ident;)*) => {
        $(
            #[unsafe(no_mangle)]
            #[inline(never)]
            extern "C" fn $step(generator: &mut $type) {
                generator.step();
            }

            #[unsafe(no_mangle)]
            #[inline(never)]
            extern "C" fn $tick(generator: &mut $type) {
                generator.step();
                black_box(generator.angles());
            }
        )*

        /// Counts all generators; false if one cannot be built or has an invalid state afterwards.
        fn count_all() -> bool {
            let mut valid = true;
            $(valid &= count_one($name, $build(Period::MILLISECOND).ok(), $step, $tick);)*
            valid
        }
    };
}

generators! {
    "robust" walkers::robust, Walk, step_robust tick_robust;
    "thesis" walkers::thesis, Thesis, step_thesis tick_thesis;
    "van-der-pol" walkers::van_der_pol, HalfCentreWalker<VanDerPol, 2>, step_van_der_pol tick_van_der_pol;
    "hopf" walkers::hopf, HalfCentreWalker<Hopf, 2>, step_hopf tick_hopf;
    "adaptive-hopf" walkers::adaptive_hopf, JointWalker<AdaptiveHopf, 3, 2>, step_adaptive_hopf tick_adaptive_hopf;
    "matsuoka" walkers::matsuoka, JointWalker<Matsuoka<4>, 8, 8>, step_matsuoka tick_matsuoka;
    "half-centre" walkers::half_centre, JointWalker<Matsuoka<4>, 8, 4>, step_half_centre tick_half_centre;
    "fitzhugh-nagumo" walkers::fitzhugh_nagumo, HalfCentreWalker<FitzHughNagumo, 4>, step_fitzhugh_nagumo tick_fitzhugh_nagumo;
    "morris-lecar" walkers::morris_lecar, HalfCentreWalker<MorrisLecar, 4>, step_morris_lecar tick_morris_lecar;
    "terman-wang" walkers::terman_wang, HalfCentreWalker<TermanWang, 4>, step_terman_wang tick_terman_wang;
    "golubitsky" walkers::golubitsky, JointWalker<LegNetwork, 8, 2>, step_golubitsky tick_golubitsky;
    "obb" walkers::obb, ObbWalk, step_obb tick_obb;
    "programmable" walkers::programmable, BankWalk<4>, step_programmable tick_programmable;
    "adaptive-fourier" walkers::adaptive_fourier, AdaptiveWalk<6, 4>, step_adaptive_fourier tick_adaptive_fourier;
    "fourier" walkers::fourier, PhaseShape<FourierShape<6>, 4>, step_fourier tick_fourier;
    "spline" walkers::spline, PhaseShape<SplineShape<12>, 4>, step_spline tick_spline;
    // Variants of the generators above, and one with other joints.
    "+robust-fixed-point" robust_fixed, FixedRobust<Biped, 4, 4>, step_robust_fixed tick_robust_fixed;
    "+fourier-fixed-point" fourier_fixed, FixedPhaseShape<6, 4>, step_fourier_fixed tick_fourier_fixed;
    "+robust-smooth" robust_smooth, Smooth<Walk, 4>, step_robust_smooth tick_robust_smooth;
    "+hexapod-walk" hexapod_walk, HexapodWalk, step_hexapod_walk tick_hexapod_walk;
}

fn robust_fixed(period: Period) -> Result<FixedRobust<Biped, 4, 4>, BuildError> {
    default_config().build_fixed(period)
}

fn fourier_fixed(period: Period) -> Result<FixedPhaseShape<6, 4>, BuildError> {
    FixedPhaseShape::build(walkers::fourier(period)?.shapes(), [Phase(0); 4], walkers::STRIDE_S, period)
}

/// A smoothed generator in a change that never ends, so that every step computes the offsets.
fn robust_smooth(period: Period) -> Result<Smooth<Walk, 4>, BuildError> {
    let config = TransitionConfig { acceleration: RadPerSec2(0.1), settling_s: 60.0 };
    let mut smooth = Smooth::build(walkers::robust(period)?, config, period)?;
    smooth.stop([Radians(0.5); 4]);
    smooth.resume();
    smooth.change(|walk| (0..250).for_each(|_| walk.step()));
    Ok(smooth)
}

fn hexapod_walk(period: Period) -> Result<HexapodWalk, BuildError> {
    HexapodWalk::build(5, HexapodWalkConfig::default(), period)
}

/// Entry point: the start-up code calls it after reset.
#[unsafe(no_mangle)]
extern "C" fn after_reset() -> ! {
    count::begin();
    exit(u32::from(!count_all()))
}

fn count_one<G: Generator<N>, const N: usize>(
    name: &str,
    built: Option<G>,
    step: Function<G>,
    tick: Function<G>,
) -> bool {
    // The compiler must not use the values of the configuration.
    let Some(mut generator) = built.map(black_box) else { return false };
    let step = count(&mut generator, step);
    let tick = count(&mut generator, tick);
    print_line(name, step, tick) && generator.check().is_ok()
}

fn print_line(name: &str, step: InstructionCount, tick: InstructionCount) -> bool {
    let mut line = TextLine::new();
    let InstructionCount { least, sum, most } = step;
    let written = write!(line, "{name} {least} {sum} {most} {} {} {}", tick.least, tick.sum, tick.most);
    line.print();
    written.is_ok()
}
