//! Every walker of [`cpg_core::gait::catalogue`], each with a step of its own that is neither generic nor inlined: a symbol to count, and to look
//! at in a disassembly (`llvm-objdump -d --disassemble-symbols=step_robust`).

use core::fmt::Write as _;
use core::hint::black_box;

use cpg_core::gait::catalogue;
use cpg_core::gait::catalogue::HalfCentreJoints;
use cpg_core::gait::default_walk::{Walk, default_config};
use cpg_core::joints::from_hopf_bank::BankWalk;
use cpg_core::joints::hexapod_legs::{HexapodWalk, HexapodWalkConfig};
use cpg_core::joints::linear::LinearJoints;
use cpg_core::joints::swing_stance::ObbWalk;
use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled_fixed::FixedRobust;
use cpg_core::network::symmetric_cells::LegNetwork;
use cpg_core::network::thesis::Thesis;
use cpg_core::oscillator::fitzhugh_nagumo::FitzHughNagumo;
use cpg_core::oscillator::hopf::{AdaptiveHopf, Hopf};
use cpg_core::oscillator::matsuoka::Matsuoka;
use cpg_core::oscillator::morris_lecar::MorrisLecar;
use cpg_core::oscillator::terman_wang::TermanWang;
use cpg_core::oscillator::van_der_pol::VanDerPol;
use cpg_core::transition::{Smooth, TransitionConfig};
use cpg_core::waveform::adaptive_fourier::AdaptiveWalk;
use cpg_core::waveform::fixed::FixedPhaseShape;
use cpg_core::waveform::shape::{FourierShape, PhaseShape, SplineShape};
use cpg_core::{BuildError, Generator};
use joint_units::{Period, Phase, RadPerSec2, Radians};

use crate::count::{self, Count, Function, count};
use crate::semihosting::{Line, exit};

/// For each walker its name, the function that builds it, its type, and the symbols of a step, and of a step with the angles.
macro_rules! walkers {
    ($($name:literal $build:path, $type:ty, $step:ident $tick:ident;)*) => {
        $(
            #[unsafe(no_mangle)]
            #[inline(never)]
            extern "C" fn $step(walker: &mut $type) {
                walker.step();
            }

            #[unsafe(no_mangle)]
            #[inline(never)]
            extern "C" fn $tick(walker: &mut $type) {
                walker.step();
                black_box(walker.angles());
            }
        )*

        /// Counts them all; false if one cannot be built or is not sound afterwards.
        fn all() -> bool {
            let mut sound = true;
            $(sound &= one($name, $build(Period::MILLISECOND).ok(), $step, $tick);)*
            sound
        }
    };
}

walkers! {
    "robust" catalogue::robust, Walk, step_robust tick_robust;
    "thesis" catalogue::thesis, Thesis, step_thesis tick_thesis;
    "van-der-pol" catalogue::van_der_pol, HalfCentreJoints<VanDerPol, 2>, step_van_der_pol tick_van_der_pol;
    "hopf" catalogue::hopf, HalfCentreJoints<Hopf, 2>, step_hopf tick_hopf;
    "adaptive-hopf" catalogue::adaptive_hopf, LinearJoints<AdaptiveHopf, 3, 2>, step_adaptive_hopf tick_adaptive_hopf;
    "matsuoka" catalogue::matsuoka, LinearJoints<Matsuoka<4>, 8, 8>, step_matsuoka tick_matsuoka;
    "half-centre" catalogue::half_centre, LinearJoints<Matsuoka<4>, 8, 4>, step_half_centre tick_half_centre;
    "fitzhugh-nagumo" catalogue::fitzhugh_nagumo, HalfCentreJoints<FitzHughNagumo, 4>, step_fitzhugh_nagumo tick_fitzhugh_nagumo;
    "morris-lecar" catalogue::morris_lecar, HalfCentreJoints<MorrisLecar, 4>, step_morris_lecar tick_morris_lecar;
    "terman-wang" catalogue::terman_wang, HalfCentreJoints<TermanWang, 4>, step_terman_wang tick_terman_wang;
    "golubitsky" catalogue::golubitsky, LinearJoints<LegNetwork, 8, 2>, step_golubitsky tick_golubitsky;
    "obb" catalogue::obb, ObbWalk, step_obb tick_obb;
    "programmable" catalogue::programmable, BankWalk<4>, step_programmable tick_programmable;
    "adaptive-fourier" catalogue::adaptive_fourier, AdaptiveWalk<6, 4>, step_adaptive_fourier tick_adaptive_fourier;
    "fourier" catalogue::fourier, PhaseShape<FourierShape<6>, 4>, step_fourier tick_fourier;
    "spline" catalogue::spline, PhaseShape<SplineShape<12>, 4>, step_spline tick_spline;
    // What is no model of its own, or not of four joints.
    "+robust-fixed-point" robust_fixed, FixedRobust<Biped, 4, 4>, step_robust_fixed tick_robust_fixed;
    "+fourier-fixed-point" fourier_fixed, FixedPhaseShape<6, 4>, step_fourier_fixed tick_fourier_fixed;
    "+robust-smooth" robust_smooth, Smooth<Walk, 4>, step_robust_smooth tick_robust_smooth;
    "+hexapod-walk" hexapod_walk, HexapodWalk, step_hexapod_walk tick_hexapod_walk;
}

fn robust_fixed(period: Period) -> Result<FixedRobust<Biped, 4, 4>, BuildError> {
    default_config().build_fixed(period)
}

fn fourier_fixed(period: Period) -> Result<FixedPhaseShape<6, 4>, BuildError> {
    FixedPhaseShape::build(catalogue::fourier(period)?.shapes(), [Phase(0); 4], catalogue::STRIDE_S, period)
}

/// In the middle of a change that never ends: the offsets are led, not idle.
fn robust_smooth(period: Period) -> Result<Smooth<Walk, 4>, BuildError> {
    let config = TransitionConfig { acceleration: RadPerSec2(0.1), settling_s: 60.0 };
    let mut smooth = Smooth::build(catalogue::robust(period)?, config, period)?;
    smooth.stop([Radians(0.5); 4]);
    smooth.resume();
    smooth.change(|walk| (0..250).for_each(|_| walk.step()));
    Ok(smooth)
}

fn hexapod_walk(period: Period) -> Result<HexapodWalk, BuildError> {
    HexapodWalk::build(5, HexapodWalkConfig::default(), period)
}

/// Called after reset.
#[unsafe(no_mangle)]
extern "C" fn after_reset() -> ! {
    count::begin();
    exit(u32::from(!all()))
}

fn one<G: Generator<N>, const N: usize>(name: &str, built: Option<G>, step: Function<G>, tick: Function<G>) -> bool {
    // Nothing may be computed from the values that happen to be used here.
    let Some(mut walker) = built.map(black_box) else { return false };
    let step = count(&mut walker, step);
    let tick = count(&mut walker, tick);
    tell(name, step, tick) && walker.check().is_ok()
}

fn tell(name: &str, step: Count, tick: Count) -> bool {
    let mut line = Line::new();
    let Count { least, sum, most } = step;
    let told = write!(line, "{name} {least} {sum} {most} {} {} {}", tick.least, tick.sum, tick.most);
    line.tell();
    told.is_ok()
}
