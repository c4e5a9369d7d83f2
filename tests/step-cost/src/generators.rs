//! The generators whose steps are counted: every generator of the catalogue [`cpg_core::gait::catalogue`], and a few variants. The step of each is a function with its
//! own symbol, not generic and not inlined, for a disassembly (`llvm-objdump -d --disassemble-symbols=step_robust`).

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
use cpg_core::transition::{JointLimits, Smooth, TransitionConfig};
use cpg_core::waveform::adaptive_fourier::AdaptiveWalk;
use cpg_core::waveform::fixed::{FixedPhaseShape, FixedPhaseShapeConfig};
use cpg_core::waveform::shape::{FourierShape, PhaseShape, SplineShape};
use cpg_core::{BuildError, Generator};
use joint_units::{Period, Phase, RadPerSec, RadPerSec2, Radians};

/// A function on a generator.
pub(crate) type Function<G> = extern "C" fn(&mut G);

/// Receives every generator in turn.
pub(crate) trait Visitor {
    /// A generator with its name, its step, and its step with angles; false if it has an invalid state afterwards.
    fn generator<G: Generator<N>, const N: usize>(
        &mut self,
        name: &str,
        generator: G,
        step: Function<G>,
        tick: Function<G>,
    ) -> bool;
}

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

        /// Passes all generators on; false if one cannot be built or has an invalid state afterwards.
        pub(crate) fn visit(visitor: &mut impl Visitor) -> bool {
            let mut valid = true;
            // The compiler must not use the values of the configuration.
            $(valid &= match $build(Period::MILLISECOND).map(black_box) {
                Ok(generator) => visitor.generator($name, generator, $step, $tick),
                Err(_) => false,
            };)*
            valid
        }
    };
}

generators! {
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
    FixedPhaseShapeConfig {
        shapes: *catalogue::fourier(period)?.shapes(),
        leads: [Phase(0); 4],
        stride_s: catalogue::STRIDE_S,
    }
    .build(period)
}

/// A smoothed generator in a change that never ends, so slow that every step computes the offsets and limits every joint.
fn robust_smooth(period: Period) -> Result<Smooth<Walk, 4>, BuildError> {
    let config = TransitionConfig { acceleration: RadPerSec2(0.1), settling_s: 60.0 };
    let limits =
        JointLimits { least: Radians(-0.6), most: Radians(2.0), rate: RadPerSec(8.7), acceleration: RadPerSec2(349.0) };
    let mut smooth = config.build(catalogue::robust(period)?, [limits; 4], period)?;
    smooth.stop([Radians(0.5); 4])?;
    smooth.resume();
    smooth.change(|walk| (0..250).for_each(|_| walk.step()));
    Ok(smooth)
}

fn hexapod_walk(period: Period) -> Result<HexapodWalk, BuildError> {
    HexapodWalkConfig { reversibility: 5, ..HexapodWalkConfig::default() }.build(period)
}
