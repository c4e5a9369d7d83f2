//! Every model as a generator of four joints, by name, all at a stride of 1.1 s.
//!
//! Each function builds a generator for a control period; it implements [`Generator`] and [`Features`]. A [`Visitor`] receives all of them, for
//! example to make a table. The numbers are in [`crate::gait::fitted`].
//!
//! | name | model | structure | error, degrees |
//! |---|---|---|---|
//! | `robust` | R1, [`crate::network::phase_coupled`] | four coupled oscillators, one a joint | 9.17 |
//! | `thesis` | Rayleigh, Table 1, set S, [`crate::network::thesis`] | four coupled oscillators, one a joint | (4.00) |
//! | `van-der-pol` | [`crate::oscillator::van_der_pol`] | a half-centre of two oscillators, one a leg | 9.70 |
//! | `hopf` | [`crate::oscillator::hopf`] | the same | 9.58 |
//! | `adaptive-hopf` | [`crate::oscillator::hopf`] | one oscillator that takes on the frequency of its input | 9.64 |
//! | `matsuoka` | [`crate::oscillator::matsuoka`], all-to-all | four neurons, a quarter of a stride apart | 1.26 |
//! | `half-centre` | [`crate::oscillator::matsuoka`], two pairs | flexor and extensor of either leg | 4.57 |
//! | `fitzhugh-nagumo` | [`crate::oscillator::fitzhugh_nagumo`] | a half-centre of two neurons, one a leg | 4.71 |
//! | `morris-lecar` | [`crate::oscillator::morris_lecar`] | the same | 3.16 |
//! | `terman-wang` | [`crate::oscillator::terman_wang`] | the same | 6.50 |
//! | `golubitsky` | [`crate::network::symmetric_cells`], walk | four symmetric cells, two a leg | 9.64 |
//! | `obb` | [`crate::joints::swing_stance`] | integers, with profiles of swing and stance | 2.76 |
//! | `programmable` | [`crate::joints::from_hopf_bank`] | a bank of four Hopf oscillators | 0.92 |
//! | `adaptive-fourier` | [`crate::waveform::adaptive_fourier`] | one phase and six harmonics a joint, which can learn on | 0.02 |
//! | `fourier` | [`crate::waveform::shape`] | one phase, six harmonics a joint | 0.02 |
//! | `spline` | [`crate::waveform::shape`] | one phase, twelve knots a joint | 0.25 |
//!
//! The error is that of the best linear read-out of the features: root mean square over four joints and ten strides, against the mean
//! stride of a healthy adult (`natural-walk` in [`crate::gait::named`]) at the best common shift in time, with a ridge of 1e-3 of each
//! feature's variance. It measures the waveforms of a model; six harmonics describe the stride itself. The value for `thesis` depends
//! strongly on the ridge (1.97 with 1e-6; all others change by less than 0.03): it comes from large weights on a small second harmonic,
//! and changes with the slip of hip against knee. All generators but `robust`, `thesis`, `obb` and `spline`, which have profiles of their
//! own, are built with that read-out.
//!
//! Kuo's pendulum ([`crate::oscillator::kuo`]) is left out: its impulses make the rate jump, which the rate of a joint angle must not.
//!
//! ```
//! use cpg_core::{BuildError, Generator};
//! use cpg_core::gait::catalogue;
//! use cpg_core::gait::catalogue::Visitor;
//! use cpg_core::joints::features::Features;
//! use joint_units::Period;
//! struct Names(Vec<&'static str>);
//! impl Visitor for Names {
//!     fn generator<G: Generator<4> + Features + Clone>(&mut self, name: &'static str, built: Result<G, BuildError>) {
//!         let mut walk = built.expect("every generator runs at 1 ms");
//!         walk.step();
//!         assert!(G::COUNT >= 2);
//!         self.0.push(name);
//!     }
//! }
//! let mut names = Names(vec![]);
//! catalogue::each(Period::MILLISECOND, &mut names);
//! assert_eq!(names.0.len(), 16);
//! ```

use joint_units::{Period, Phase, Radians};

use crate::error::allow_period;
use crate::gait::default_walk::{STRIDE_SECONDS, Walk, default_walk};
use crate::gait::fitted;
use crate::gait::named::natural_shapes;
use crate::joints::features::Features;
use crate::joints::from_hopf_bank::{BankWalk, BankWalkConfig};
use crate::joints::linear::LinearJoints;
use crate::joints::swing_stance::{ObbWalk, ObbWalkConfig};
use crate::network::symmetric_cells::{LegGait, LegNetwork};
use crate::network::thesis::{Thesis, ThesisConfig};
use crate::oscillator::fitzhugh_nagumo::FitzHughNagumo;
use crate::oscillator::half_centre;
use crate::oscillator::half_centre::HalfCentre;
use crate::oscillator::hopf::{AdaptiveHopf, Hopf};
use crate::oscillator::matsuoka::Matsuoka;
use crate::oscillator::morris_lecar::MorrisLecar;
use crate::oscillator::terman_wang::TermanWang;
use crate::oscillator::van_der_pol::VanDerPol;
use crate::waveform::adaptive_fourier::{AdaptiveFourierConfig, AdaptiveWalk, AdaptiveWalkConfig};
use crate::waveform::shape::{FourierShape, PhaseShape, PhaseShapeConfig, Shape, SplineShape};
use crate::{BuildError, Generator};

/// Stride of every generator here in seconds.
pub const STRIDE_S: f32 = STRIDE_SECONDS;

/// Receives every generator in turn.
pub trait Visitor {
    /// One generator, its name in the table, and the result of its build.
    fn generator<G: Generator<4> + Features + Clone>(&mut self, name: &'static str, built: Result<G, BuildError>);
}

/// Passes every generator to the visitor, in the order of the table.
pub fn each(period: Period, visitor: &mut impl Visitor) {
    visitor.generator("robust", robust(period));
    visitor.generator("thesis", thesis(period));
    visitor.generator("van-der-pol", van_der_pol(period));
    visitor.generator("hopf", hopf(period));
    visitor.generator("adaptive-hopf", adaptive_hopf(period));
    visitor.generator("matsuoka", matsuoka(period));
    visitor.generator("half-centre", half_centre(period));
    visitor.generator("fitzhugh-nagumo", fitzhugh_nagumo(period));
    visitor.generator("morris-lecar", morris_lecar(period));
    visitor.generator("terman-wang", terman_wang(period));
    visitor.generator("golubitsky", golubitsky(period));
    visitor.generator("obb", obb(period));
    visitor.generator("programmable", programmable(period));
    visitor.generator("adaptive-fourier", adaptive_fourier(period));
    visitor.generator("fourier", fourier(period));
    visitor.generator("spline", spline(period));
}

/// A half-centre of two cells `C`, one a leg, read out through M of its states.
pub type HalfCentreJoints<C, const M: usize> = LinearJoints<HalfCentre<C>, 4, M>;

/// R1, the default walk.
///
/// # Errors
/// [`BuildError::PeriodTooLong`] above 17.2 ms.
pub fn robust(period: Period) -> Result<Walk, BuildError> {
    default_walk(period)
}

/// The thesis' network: Table 1, set S.
///
/// # Errors
/// [`BuildError::PeriodTooLong`].
pub fn thesis(period: Period) -> Result<Thesis, BuildError> {
    ThesisConfig::set_s().build(period)
}

/// Two van der Pol oscillators, mu = 1, k = 0.02.
///
/// # Errors
/// [`BuildError::PeriodTooLong`] above 22 ms.
pub fn van_der_pol(period: Period) -> Result<HalfCentreJoints<VanDerPol, 2>, BuildError> {
    fitted::VAN_DER_POL.build(HalfCentre { cell: VanDerPol { mu: 1.0 }, repulsion: 0.02 }, period)
}

/// Two Hopf oscillators, g = 8, m = 1, k = 0.5.
///
/// # Errors
/// As [`van_der_pol`].
pub fn hopf(period: Period) -> Result<HalfCentreJoints<Hopf, 2>, BuildError> {
    let cell = Hopf { gain: 8.0, square_radius: 1.0, frequency: core::f32::consts::TAU };
    fitted::HOPF.build(HalfCentre { cell, repulsion: 0.5 }, period)
}

/// One adaptive Hopf oscillator that runs free, g = 8, m = 1, eps = 0.9: give it an input through [`LinearJoints::flow_mut`] and it
/// takes on its frequency, in units of one cycle a stride.
///
/// # Errors
/// As [`van_der_pol`].
pub fn adaptive_hopf(period: Period) -> Result<LinearJoints<AdaptiveHopf, 3, 2>, BuildError> {
    fitted::ADAPTIVE_HOPF.build(AdaptiveHopf { gain: 8.0, square_radius: 1.0, learning: 0.9, input: 0.0 }, period)
}

/// Four Matsuoka neurons, each inhibited by all others with 2: they fire one after the other, a quarter of a stride apart, 0 against 1
/// and 2 against 3 as the joints of left and right.
///
/// # Errors
/// As [`van_der_pol`].
pub fn matsuoka(period: Period) -> Result<LinearJoints<Matsuoka<4>, 8, 8>, BuildError> {
    let mut inhibition = [[2.0; 4]; 4];
    for (neuron, row) in inhibition.iter_mut().enumerate() {
        if let Some(own) = row.get_mut(neuron) {
            *own = 0.0;
        }
    }
    fitted::MATSUOKA.build(Matsuoka::standard(inhibition), period)
}

/// Two half-centres of Matsuoka's neurons, one a leg, linked muscle to muscle: [`half_centre::legs`]. Read out are potential and
/// fatigue of the two flexors.
///
/// # Errors
/// As [`van_der_pol`].
pub fn half_centre(period: Period) -> Result<LinearJoints<Matsuoka<4>, 8, 4>, BuildError> {
    fitted::HALF_CENTRE.build(half_centre::legs(), period)
}

/// Two FitzHugh-Nagumo neurons, I = 0.5, k = 0.04.
///
/// # Errors
/// As [`van_der_pol`].
pub fn fitzhugh_nagumo(period: Period) -> Result<HalfCentreJoints<FitzHughNagumo, 4>, BuildError> {
    fitted::FITZHUGH_NAGUMO.build(HalfCentre { cell: FitzHughNagumo::standard(0.5), repulsion: 0.04 }, period)
}

/// Two Morris-Lecar neurons, I = 100, k = 0.005.
///
/// # Errors
/// As [`van_der_pol`].
pub fn morris_lecar(period: Period) -> Result<HalfCentreJoints<MorrisLecar, 4>, BuildError> {
    fitted::MORRIS_LECAR.build(HalfCentre { cell: MorrisLecar { current: 100.0 }, repulsion: 0.005 }, period)
}

/// Two Terman-Wang oscillators, I = 3, k = 0.3. Their jumps take a millisecond, with up to 15 000 rad/s^2 at the joints: limit the acceleration before
/// a servo.
///
/// # Errors
/// [`BuildError::PeriodTooLong`] above 2 ms.
pub fn terman_wang(period: Period) -> Result<HalfCentreJoints<TermanWang, 4>, BuildError> {
    allow_period(period, 2000)?;
    fitted::TERMAN_WANG.build(HalfCentre { cell: TermanWang::standard(3.0), repulsion: 0.3 }, period)
}

/// The walk of Golubitsky's four cells, read out through the first; the others have the same motion, half a stride or a whole one later.
///
/// # Errors
/// As [`van_der_pol`].
pub fn golubitsky(period: Period) -> Result<LinearJoints<LegNetwork, 8, 2>, BuildError> {
    fitted::GOLUBITSKY.build(LegNetwork::of(LegGait::Walk), period)
}

/// One building block, both legs alike.
///
/// # Errors
/// [`BuildError::PeriodTooLong`] above 68.75 ms.
pub fn obb(period: Period) -> Result<ObbWalk, BuildError> {
    ObbWalkConfig { stride_s: STRIDE_S, ..ObbWalkConfig::default() }.build(period)
}

/// Four Hopf oscillators at the first four harmonics of the stride.
///
/// # Errors
/// [`BuildError::PeriodTooLong`] above 5.5 ms.
pub fn programmable(period: Period) -> Result<BankWalk<4>, BuildError> {
    let radians = |degrees: f32| Radians::from_degrees(degrees).0;
    let config = BankWalkConfig {
        stride_s: STRIDE_S,
        start: fitted::PROGRAMMABLE_START,
        weights: fitted::PROGRAMMABLE_WEIGHTS.map(|row| row.map(|pair| pair.map(radians))),
        offsets: fitted::MEANS.map(Radians::from_degrees),
    };
    config.build(period)
}

/// Six harmonics a joint that begin with the mean stride of `natural-walk`, as if it had been learned.
///
/// # Errors
/// None for any period.
pub fn adaptive_fourier(period: Period) -> Result<AdaptiveWalk<6, 4>, BuildError> {
    let config = AdaptiveFourierConfig { frequency_hz: 1.0 / STRIDE_S, ..AdaptiveFourierConfig::default() };
    Ok(AdaptiveWalkConfig { learner: config, unit: 0.5 }.build(period)?.taught(&natural_shapes()?))
}

/// One phase and six harmonics a joint: the mean stride of `natural-walk` itself.
///
/// # Errors
/// None for any period.
pub fn fourier(period: Period) -> Result<PhaseShape<FourierShape<6>, 4>, BuildError> {
    PhaseShapeConfig { shapes: natural_shapes()?, stride_s: STRIDE_S }.build(period)
}

/// One phase and a periodic spline of twelve knots a joint, through the mean stride of `natural-walk`.
///
/// # Errors
/// None for any period.
pub fn spline(period: Period) -> Result<PhaseShape<SplineShape<12>, 4>, BuildError> {
    let spline = |shape: &FourierShape<6>| {
        let mut knots = [Radians(0.0); 12];
        for (knot, place) in (0u64..).zip(&mut knots) {
            place.0 = shape.at(Phase(((knot << 32) / 12) as u32)).angle;
        }
        SplineShape::new(knots)
    };
    let [a, b, c, d] = natural_shapes()?;
    PhaseShapeConfig { shapes: [spline(&a)?, spline(&b)?, spline(&c)?, spline(&d)?], stride_s: STRIDE_S }.build(period)
}
