//! Phase and shape: a generator of one phase and a periodic waveform (shape) for each joint.
//!
//! ```text
//! phi' = 1/T,   a_j = offset_j + mean_j + gain_j (S_j(phi + lead_j) - mean_j)
//! ```
//! phi is the gait phase in cycles, T the stride time in s, S_j the shape of joint j in rad and mean_j its mean; offset_j, gain_j and lead_j are its
//! [`Adjustment`].
//!
//! The phase is a fraction of 2^64 of a cycle with an integer step, so the period is exact: over 72 h at 1 kHz (2.6e8 ticks) the
//! rounding of the step adds up to less than 1e-10 cycles. The only remaining error is the template's. Changes of speed, gain, offset or
//! lead take effect at once, as a jump. [`crate::transition::Smooth::change`] makes them smooth, at any tick and also during another
//! change: angle and rate are then continuous, and the acceleration is at most that of the new motion plus the stated bound of the
//! transition, as below.
//!
//! A [`FourierShape`] of 6 harmonics follows the mean stride of a person within half a degree (least squares on real recordings), a
//! [`SplineShape`] has knots in place of harmonics.
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::waveform::shape::{Adjustment, FourierShape, PhaseShapeConfig};
//! use cpg_core::transition::{JointLimits, TransitionConfig};
//! use joint_units::{Period, Phase, Radians};
//! let hip = FourierShape::new(Radians(0.1), [0.35], [0.0])?;
//! let walk = PhaseShapeConfig { shapes: [hip; 2], stride_s: 1.1 }.build(Period::MILLISECOND)?;
//! let mut walk = TransitionConfig::default().build(walk, [JointLimits::WIDEST; 2], Period::MILLISECOND)?;
//! for _ in 0..400 {
//!     walk.step();
//! }
//! let before = (walk.angles()[0], walk.rates()[0]);
//! // Speed, amplitude, offset and lead of the left hip, all on one tick.
//! walk.change(|walk| {
//!     walk.set_stride(0.8)?;
//!     walk.adjust(0, Adjustment { gain: 1.5, offset: Radians(0.2), lead: Phase::from_cycles(0.1) })
//! })?;
//! let jump = (walk.angles()[0].0 - before.0.0, walk.rates()[0].0 - before.1.0);
//! assert!(jump.0.abs() < 1e-6 && jump.1.abs() < 1e-5, "{jump:?}");
//! // A second later it is the adjusted walk and nothing else.
//! for _ in 0..1000 {
//!     walk.step();
//! }
//! assert_eq!(walk.angles(), walk.generator().angles());
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::{all_in_range, in_range};
use crate::math::trig::sin_cos;
pub use crate::waveform::clock::STRIDE_RANGE_S;
use crate::waveform::clock::StrideClock;
use crate::{BuildError, Field, Generator, StateFault};

/// Largest absolute value of a coefficient, in radians: far beyond any anatomical joint.
pub const MAX_COEFFICIENT: f32 = 6.3;

/// Value of a shape and its slope.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ShapePoint {
    /// Radians.
    pub angle: f32,
    /// Radians per cycle.
    pub slope: f32,
}

/// A periodic function of the gait phase.
pub trait Shape {
    /// What all shapes of the type need of a phase: joints at one phase share it.
    type Basis;
    /// The basis at a phase.
    fn basis(phase: Phase) -> Self::Basis;
    /// Value and slope at the phase of a basis.
    fn at_basis(&self, basis: &Self::Basis) -> ShapePoint;
    /// Mean over the cycle in radians, which a gain does not change.
    fn mean(&self) -> f32;

    /// Value and slope at a phase.
    // Once in the image, not in each of the rare callers.
    #[inline(never)]
    fn at(&self, phase: Phase) -> ShapePoint {
        self.at_basis(&Self::basis(phase))
    }
}

/// Fourier series of H harmonics: `S(phi) = mean + sum_k cos_k cos(2 pi k phi) + sin_k sin(2 pi k phi)`, in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FourierShape<const H: usize> {
    mean: f32,
    cos: [f32; H],
    sin: [f32; H],
}

impl<const H: usize> FourierShape<H> {
    /// From coefficients in radians.
    ///
    /// # Errors
    /// `mean`, `cos` or `sin` if one is not finite or beyond [`MAX_COEFFICIENT`].
    pub fn new(mean: Radians, cos: [f32; H], sin: [f32; H]) -> Result<Self, BuildError> {
        in_range(mean.0, Field::of("mean"), -MAX_COEFFICIENT, MAX_COEFFICIENT)?;
        all_in_range(cos, "cos", -MAX_COEFFICIENT, MAX_COEFFICIENT)?;
        all_in_range(sin, "sin", -MAX_COEFFICIENT, MAX_COEFFICIENT)?;
        Ok(Self { mean: mean.0, cos, sin })
    }

    /// Mean and the coefficients of cosine and sine.
    #[must_use]
    pub const fn coefficients(&self) -> (f32, &[f32; H], &[f32; H]) {
        (self.mean, &self.cos, &self.sin)
    }

    /// Value and slope at the phase of these harmonics, of which there are as many or more: the bits of [`Shape::at`].
    #[inline(always)]
    #[must_use]
    pub fn at_harmonics<const K: usize>(&self, harmonics: &Harmonics<K>) -> ShapePoint {
        let [point] = Self::points_at([self], harmonics);
        point
    }

    /// The same of several series at one phase: each harmonic is loaded once.
    #[inline(always)]
    #[must_use]
    pub fn points_at<const N: usize, const K: usize>(series: [&Self; N], harmonics: &Harmonics<K>) -> [ShapePoint; N] {
        const { assert!(K >= H, "a harmonic for each coefficient") };
        let mut points = series.map(|one| ShapePoint { angle: one.mean, slope: 0.0 });
        let mut order = core::f32::consts::TAU;
        for (k, &(s, c)) in harmonics.0.iter().take(H).enumerate() {
            for (point, one) in points.iter_mut().zip(series) {
                if let (Some(a), Some(b)) = (one.cos.get(k), one.sin.get(k)) {
                    point.angle += a * c + b * s;
                    point.slope += order * (b * c - a * s);
                }
            }
            order += core::f32::consts::TAU;
        }
        points
    }

    /// The series that is ahead of this one: its value at a phase is that of this one at the phase plus `by`, but for rounding.
    #[must_use]
    pub fn ahead(&self, by: Phase) -> Self {
        let mut ahead = *self;
        let turns = Harmonics::<H>::of(by).0;
        for ((a, b), (s, c)) in ahead.cos.iter_mut().zip(&mut ahead.sin).zip(turns) {
            (*a, *b) = (*a * c + *b * s, *b * c - *a * s);
        }
        ahead
    }
}

/// Sine and cosine of K harmonics of a phase, from the first on. Series at one phase share them: they are half of the work of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonics<const K: usize>([(f32, f32); K]);

impl<const K: usize> Harmonics<K> {
    /// Those of a phase.
    #[must_use]
    pub fn of(phase: Phase) -> Self {
        // One sine and cosine; the harmonics are computed by rotation.
        let (s1, c1) = sin_cos(phase);
        let (mut s, mut c) = (s1, c1);
        let mut harmonics = [(0.0, 0.0); K];
        for harmonic in &mut harmonics {
            *harmonic = (s, c);
            (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
        }
        Self(harmonics)
    }
}

impl<const H: usize> Shape for FourierShape<H> {
    type Basis = Harmonics<H>;

    fn basis(phase: Phase) -> Harmonics<H> {
        Harmonics::of(phase)
    }

    // Where the slope is not read, it is not computed.
    #[inline(always)]
    fn at_basis(&self, harmonics: &Harmonics<H>) -> ShapePoint {
        self.at_harmonics(harmonics)
    }

    fn mean(&self) -> f32 {
        self.mean
    }
}

/// Periodic cubic spline through K equally spaced knots, knot k at phase k/K; twice continuously differentiable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplineShape<const K: usize> {
    knots: [f32; K],
    /// Second derivative at each knot times h^2/6, h = 1/K.
    bend: [f32; K],
    mean: f32,
}

impl<const K: usize> SplineShape<K> {
    /// Through these angles; 3 to 64 knots.
    ///
    /// # Errors
    /// `knots` if there are too few or too many, or one is not finite or beyond [`MAX_COEFFICIENT`].
    pub fn new(knots: [Radians; K]) -> Result<Self, BuildError> {
        in_range(K as f32, Field::of("knots"), 3.0, 64.0)?;
        let knots = knots.map(|k| k.0);
        all_in_range(knots, "knots", -MAX_COEFFICIENT, MAX_COEFFICIENT)?;
        // b_{k-1} + 4 b_k + b_{k+1} = y_{k-1} - 2 y_k + y_{k+1}, cyclic. The matrix is strongly diagonally dominant: Gauss-Seidel
        // shrinks the error at least by 2 a sweep, so 30 sweeps reach the rounding of f32.
        let mut bend = [0.0; K];
        for _ in 0..30 {
            for k in 0..K {
                let (before, after) = (neighbour(&bend, k, K - 1), neighbour(&bend, k, 1));
                let (y0, y1, y2) = (neighbour(&knots, k, K - 1), neighbour(&knots, k, 0), neighbour(&knots, k, 1));
                if let Some(b) = bend.get_mut(k) {
                    *b = (y0 - 2.0 * y1 + y2 - before - after) * 0.25;
                }
            }
        }
        // The mean of each piece is (y0 + y1)/2 - (b0 + b1)/4.
        let mean = knots.iter().zip(&bend).map(|(y, b)| y - 0.5 * b).sum::<f32>() / K as f32;
        Ok(Self { knots, bend, mean })
    }
}

/// The value `by` places on, around the ring.
fn neighbour<const K: usize>(ring: &[f32; K], k: usize, by: usize) -> f32 {
    let at = k + by;
    ring.get(if at >= K { at - K } else { at }).copied().unwrap_or(0.0)
}

impl<const K: usize> Shape for SplineShape<K> {
    type Basis = Phase;

    fn basis(phase: Phase) -> Phase {
        phase
    }

    #[inline(always)]
    fn at_basis(&self, phase: &Phase) -> ShapePoint {
        // Knot and fraction straight from the integer phase: exact.
        let scaled = u64::from(phase.0) * K as u64;
        let k = (scaled >> 32) as usize;
        let t = (scaled & 0xffff_ffff) as f32 * (1.0 / 4_294_967_296.0);
        let u = 1.0 - t;
        let (y0, y1) = (neighbour(&self.knots, k, 0), neighbour(&self.knots, k, 1));
        let (b0, b1) = (neighbour(&self.bend, k, 0), neighbour(&self.bend, k, 1));
        ShapePoint {
            angle: u * y0 + t * y1 + b0 * (u * u * u - u) + b1 * (t * t * t - t),
            slope: K as f32 * (y1 - y0 - b0 * (3.0 * u * u - 1.0) + b1 * (3.0 * t * t - 1.0)),
        }
    }

    fn mean(&self) -> f32 {
        self.mean
    }
}

/// Adjustment of the shape of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adjustment {
    /// Factor on the movement about the shape's mean; 0 to 2.
    pub gain: f32,
    /// Added to the angle; up to ±[`MAX_COEFFICIENT`].
    pub offset: Radians,
    /// Phase lead of this joint over the gait phase.
    pub lead: Phase,
}

impl Adjustment {
    pub(crate) fn validate(&self) -> Result<(), BuildError> {
        in_range(self.gain, Field::of("gain"), 0.0, 2.0)?;
        in_range(self.offset.0, Field::of("offset"), -MAX_COEFFICIENT, MAX_COEFFICIENT)
    }
}

impl Default for Adjustment {
    /// The unchanged shape: gain 1, offset 0, lead 0.
    fn default() -> Self {
        Self { gain: 1.0, offset: Radians(0.0), lead: Phase(0) }
    }
}

/// A generator of one phase and N shapes. Its amplitude is always 1, and its check never fails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseShape<S, const N: usize> {
    shapes: [S; N],
    adjustments: [Adjustment; N],
    clock: StrideClock,
}

/// Shapes and stride of a [`PhaseShape`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseShapeConfig<S, const N: usize> {
    /// The waveform of each joint.
    pub shapes: [S; N],
    /// Stride time in seconds, within [`STRIDE_RANGE_S`].
    pub stride_s: f32,
}

impl<S: Shape + Copy, const N: usize> PhaseShapeConfig<S, N> {
    /// Validates the configuration for a control period; the generator starts at phase 0.
    ///
    /// # Errors
    /// `stride_s` outside [`STRIDE_RANGE_S`].
    pub fn build(&self, period: Period) -> Result<PhaseShape<S, N>, BuildError> {
        Ok(PhaseShape {
            shapes: self.shapes,
            adjustments: [Adjustment::default(); N],
            clock: StrideClock::new(self.stride_s, period)?,
        })
    }
}

impl<S: Shape, const N: usize> PhaseShape<S, N> {
    /// Sets the stride time in seconds, to the microsecond.
    ///
    /// # Errors
    /// `stride_s` outside [`STRIDE_RANGE_S`]; the old one then stays.
    pub fn set_stride(&mut self, stride_s: f32) -> Result<(), BuildError> {
        self.clock.set_stride(stride_s)
    }

    /// Sets gain, offset and lead of a joint; joints that do not exist are ignored.
    ///
    /// # Errors
    /// `gain` or `offset` out of range; the old adjustment then stays.
    pub fn adjust(&mut self, joint: usize, adjustment: Adjustment) -> Result<(), BuildError> {
        adjustment.validate()?;
        if let Some(place) = self.adjustments.get_mut(joint) {
            *place = adjustment;
        }
        Ok(())
    }

    /// Sets the phase.
    pub const fn set_phase(&mut self, phase: Phase) {
        self.clock.set_phase(phase);
    }

    /// Replaces the shapes; phase, stride and adjustments stay.
    pub fn set_shapes(&mut self, shapes: [S; N]) {
        self.shapes = shapes;
    }

    /// The shapes.
    #[must_use]
    pub const fn shapes(&self) -> &[S; N] {
        &self.shapes
    }

    /// A number of each joint, of its shape's point, its shape's mean and its adjustment.
    fn each(&self, read: impl Fn(ShapePoint, f32, &Adjustment) -> f32) -> [f32; N] {
        // Joints without a lead, which are most, have one phase.
        let phase = self.phase();
        let shared = S::basis(phase);
        let mut out = [0.0; N];
        for ((out, shape), adjustment) in out.iter_mut().zip(&self.shapes).zip(&self.adjustments) {
            let point =
                if adjustment.lead == Phase(0) { shape.at_basis(&shared) } else { shape.at(phase + adjustment.lead) };
            *out = read(point, shape.mean(), adjustment);
        }
        out
    }
}

impl<S: Shape, const N: usize> Generator<N> for PhaseShape<S, N> {
    fn step(&mut self) {
        self.clock.tick();
    }

    // Not inlined: a choice among generators would save and restore the registers that this needs for each of them.
    #[inline(never)]
    fn angles(&self) -> [Radians; N] {
        self.each(|point, mean, adjustment| adjustment.offset.0 + mean + adjustment.gain * (point.angle - mean))
            .map(Radians)
    }

    fn rates(&self) -> [RadPerSec; N] {
        let cycles_per_second = self.clock.frequency();
        self.each(|point, _, adjustment| adjustment.gain * point.slope * cycles_per_second).map(RadPerSec)
    }

    fn phase(&self) -> Phase {
        self.clock.phase()
    }

    fn amplitude(&self) -> f32 {
        1.0
    }

    fn check(&self) -> Result<(), StateFault> {
        Ok(())
    }

    fn reset(&mut self) {
        self.clock.set_phase(Phase(0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::TAU;

    /// A series of fewer harmonics among more of them, and its own: both by the rotation, written here once more.
    #[test]
    fn shared_harmonics_leave_every_bit() {
        let shape = FourierShape::new(Radians(0.3), [0.4, -0.07, 0.02], [-0.3, 0.05, 0.011]).expect("in range");
        for phase in phases().map(|phase| Phase(phase.0 ^ 0x5A5)) {
            let (s1, c1) = sin_cos(phase);
            let (mut s, mut c, mut order) = (s1, c1, TAU);
            let (mut angle, mut slope) = (0.3_f32, 0.0_f32);
            for (a, b) in [(0.4, -0.3), (-0.07, 0.05), (0.02, 0.011)] {
                angle += a * c + b * s;
                slope += order * (b * c - a * s);
                order += TAU;
                (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
            }
            for point in [shape.at(phase), shape.at_harmonics(&Harmonics::<8>::of(phase))] {
                assert_eq!([point.angle, point.slope].map(f32::to_bits), [angle, slope].map(f32::to_bits), "{phase:?}");
            }
        }
    }

    #[test]
    fn a_series_that_is_ahead_is_the_series_later() {
        let cos = [0.3, -0.2, 0.1, 0.05, -0.04, 0.03, 0.02, -0.01];
        let sin = [-0.1, 0.2, -0.05, 0.04, 0.03, -0.02, 0.01, 0.01];
        let shape = FourierShape::new(Radians(0.2), cos, sin).expect("in range");
        for by in [0, 1 << 20, 171_798_692, u32::MAX - 171_798_691, 1 << 31, 1_234_567_890].map(Phase) {
            let ahead = shape.ahead(by);
            for phase in phases() {
                let (found, wanted) = (ahead.at(phase), shape.at(phase + by));
                assert!((found.angle - wanted.angle).abs() < 4e-6, "{by:?} after {phase:?}");
                assert!((found.slope - wanted.slope).abs() < 1e-4, "{by:?} after {phase:?}");
            }
        }
    }

    /// Joints without a lead share a basis; each angle and rate has the bits of its own series.
    #[test]
    fn joints_at_one_phase_have_the_bits_of_their_own_series() {
        let knee = FourierShape::new(Radians(0.4), [-0.2, 0.05, 0.03], [0.3, -0.07, 0.0]).expect("in range");
        let shapes = [hip(), knee, hip(), knee];
        let mut generator = PhaseShapeConfig { shapes, stride_s: 0.9 }.build(Period::MILLISECOND).expect("in range");
        let leads = [Phase(0), Phase(0), Phase(1 << 31), Phase(12_345_678)];
        for (joint, lead) in leads.into_iter().enumerate() {
            let adjustment = Adjustment { gain: 1.0 - 0.1 * joint as f32, offset: Radians(0.01), lead };
            generator.adjust(joint, adjustment).expect("in range");
        }
        let bits = |numbers: [f32; 2]| numbers.map(f32::to_bits);
        for _ in 0..2000 {
            generator.step();
            let (angles, rates) = (generator.angles(), generator.rates());
            for (joint, (shape, lead)) in shapes.iter().zip(leads).enumerate() {
                let (point, gain) = (shape.at(generator.phase() + lead), 1.0 - 0.1 * joint as f32);
                let angle = 0.01 + shape.mean() + gain * (point.angle - shape.mean());
                let rate = gain * point.slope * generator.clock.frequency();
                assert_eq!(bits([angles[joint].0, rates[joint].0]), bits([angle, rate]), "joint {joint}");
            }
        }
    }

    fn phases() -> impl Iterator<Item = Phase> {
        (0..1000u32).map(|i| Phase(i.wrapping_mul(4_294_967)))
    }

    fn hip() -> FourierShape<3> {
        FourierShape::new(Radians(0.1), [0.3, -0.05, 0.01], [0.1, 0.07, -0.02]).unwrap()
    }

    /// Against the series summed in f64, value and slope, for eight harmonics of the size of a joint's.
    #[test]
    fn fourier_equals_its_series() {
        let cos = [0.3, -0.2, 0.1, 0.05, -0.04, 0.03, 0.02, -0.01];
        let sin = [-0.1, 0.2, -0.05, 0.04, 0.03, -0.02, 0.01, 0.01];
        let shape = FourierShape::new(Radians(0.2), cos, sin).unwrap();
        for phase in phases() {
            let turn = core::f64::consts::TAU * f64::from(phase.0) / 4_294_967_296.0;
            let (mut angle, mut slope) = (f64::from(0.2f32), 0.0);
            for (i, (a, b)) in cos.into_iter().zip(sin).enumerate() {
                let (k, a, b) = ((i + 1) as f64, f64::from(a), f64::from(b));
                angle += a * (k * turn).cos() + b * (k * turn).sin();
                slope += core::f64::consts::TAU * k * (b * (k * turn).cos() - a * (k * turn).sin());
            }
            let point = shape.at(phase);
            assert!((f64::from(point.angle) - angle).abs() < 2e-6, "{phase:?}");
            assert!((f64::from(point.slope) - slope).abs() < 5e-5, "{phase:?}");
        }
    }

    #[test]
    fn spline_passes_its_knots_and_is_smooth_across_them() {
        let knots: [Radians; 10] = core::array::from_fn(|k| Radians((k as f32 * 1.7).sin()));
        let spline = SplineShape::new(knots).unwrap();
        for (k, knot) in knots.iter().enumerate() {
            let at = (k as u64 * (1 << 32)).div_ceil(10) as u32;
            assert!((spline.at(Phase(at)).angle - knot.0).abs() < 1e-5);
            let (before, after) = (spline.at(Phase(at.wrapping_sub(40_000))), spline.at(Phase(at + 40_000)));
            assert!((before.angle - after.angle).abs() < 1e-3);
            assert!((before.slope - after.slope).abs() < 2e-2, "slope jumps at knot {k}");
        }
    }

    /// A spline through many knots of a sine reproduces it: value, slope and mean.
    #[test]
    fn spline_reproduces_a_sine() {
        let spline =
            SplineShape::new(core::array::from_fn::<_, 32, _>(|k| Radians(0.5 + (TAU * k as f32 / 32.0).sin())));
        let spline = spline.unwrap();
        for phase in phases() {
            let turn = TAU * phase.cycles();
            let point = spline.at(phase);
            assert!((point.angle - 0.5 - turn.sin()).abs() < 2e-5);
            assert!((point.slope - TAU * turn.cos()).abs() < 5e-3);
        }
        assert!((spline.mean() - 0.5).abs() < 1e-6);
    }

    #[test]
    fn slope_is_the_derivative() {
        let shape = hip();
        for phase in phases() {
            let h = Phase(1 << 22);
            let (a, b) = (shape.at(phase - h), shape.at(phase + h));
            let difference = (b.angle - a.angle) * (1u64 << 32) as f32 / (2 * h.0) as f32;
            assert!((difference - shape.at(phase).slope).abs() < 2e-3);
        }
    }

    /// 72 h at 1 kHz: the strides that pass are those of the exact period, to 1e-9 of a cycle.
    #[test]
    fn the_period_is_exact_for_days() {
        let generator = PhaseShapeConfig { shapes: [hip(); 1], stride_s: 1.1 }.build(Period::MILLISECOND).unwrap();
        let ticks: u128 = 72 * 3600 * 1000;
        let cycles = (u128::from(generator.clock.step()) * ticks) as f64 / 2f64.powi(64);
        assert!((cycles - 72.0 * 3600.0 / 1.1).abs() < 1e-9 * cycles, "{cycles}");
        assert!((cycles - 72.0 * 3600.0 / 1.1).abs() < 1e-9 * 72.0 * 3600.0);
    }

    #[test]
    fn rates_are_derivatives_and_adjustments_apply() {
        let mut generator = PhaseShapeConfig { shapes: [hip(); 2], stride_s: 1.0 }.build(Period::MILLISECOND).unwrap();
        let lead = Phase(1 << 30);
        generator.adjust(1, Adjustment { gain: 0.5, offset: Radians(0.2), lead }).unwrap();
        for _ in 0..1000 {
            let (before, rates) = (generator.angles(), generator.rates());
            let quarter_on = hip().at(generator.phase() + lead).angle;
            assert!((before[1].0 - (0.2 + 0.1 + 0.5 * (quarter_on - 0.1))).abs() < 1e-6);
            generator.step();
            let after = generator.angles();
            for joint in 0..2 {
                let mean_rate = 0.5 * (rates[joint].0 + generator.rates()[joint].0);
                assert!(((after[joint].0 - before[joint].0) / 1e-3 - mean_rate).abs() < 2e-3);
            }
        }
    }

    #[test]
    fn bad_fields_are_named() {
        let name = |result: Result<_, BuildError>| result.map(|_: FourierShape<1>| ()).unwrap_err().to_string();
        assert!(name(FourierShape::new(Radians(f32::NAN), [0.0], [0.0])).contains("mean"));
        assert!(name(FourierShape::new(Radians(0.0), [7.0], [0.0])).contains("cos"));
        assert!(name(FourierShape::new(Radians(0.0), [0.0], [f32::INFINITY])).contains("sin"));
        assert!(SplineShape::new([Radians(0.0); 2]).unwrap_err().to_string().contains("knots"));
        let mut generator = PhaseShapeConfig { shapes: [hip()], stride_s: 1.0 }.build(Period::MILLISECOND).unwrap();
        let before = generator;
        for stride in [0.0, -1.0, f32::NAN, 21.0] {
            assert!(generator.set_stride(stride).unwrap_err().to_string().contains("stride_s"));
        }
        let bad = Adjustment { gain: -1.0, ..Adjustment::default() };
        assert!(generator.adjust(0, bad).unwrap_err().to_string().contains("gain"));
        assert_eq!(generator, before);
    }
}
