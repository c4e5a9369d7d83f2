//! The Rayleigh oscillator of the thesis, eqs 5-12 ("Designing CPG for Biped Locomotion Control using Nonlinear Dynamical
//! Theory", IIITA Allahabad; after Rayleigh, The Theory of Sound, 1877):
//!
//! ```text
//! a'' - alpha (1 - p a'^2) a' + mu^2 (a - a0) = 0
//! ```
//!
//! - a angle and a0 its offset, in degrees as in the thesis; alpha in 1/s; p in (s/deg)^2; mu in rad/s.
//! - Exact scaling: with eps = alpha/mu, X = mu sqrt(p) (a - a0) and tau = mu t it is X'' - eps (1 - X'^2) X' + X = 0, and
//!   sqrt(3) X' obeys the van der Pol equation of strength eps. So eps alone gives the shape; p scales the amplitude, mu also the
//!   time, and a0 only shifts.
//! - For small eps: amplitude 2/(sqrt(3 p) mu), velocity 2/sqrt(3 p), period 2 pi/mu (1 + eps^2/16). The thesis says that mu
//!   controls the frequency; that holds for alpha << mu only. At its own (alpha, p, mu) = (1, 1, 0.2) the period is 1.85 times
//!   2 pi/mu and the amplitude 2.19 times the small one. The velocity stays within 1.1 percent at any eps.
//! - [`OscillatorState`] is a - a0 in deg and a' in deg/s, held within [`BOUND_FACTOR`] times the small-eps values, the displacement (1 + eps)
//!   times that. [`crate::Generator::amplitude`] is relative to the small-eps values.

use joint_units::Period;

use crate::error::{allow_period, in_range};
use crate::math::second_order::{SecondOrder, longest_period};
use crate::network::second_order::{BOUND_FACTOR, OscillatorState, Oscillators, Terms};
use crate::{BuildError, Field, Integrator, Rk4, Scalar};

/// Parameters of one oscillator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayleighConfig<T = f32> {
    /// Negative damping at rest in 1/s, 1e-6 to 1000.
    pub alpha: T,
    /// Inverse square of the velocity at which the damping changes sign, in (s/deg)^2, 1e-12 to 1e6.
    pub p: T,
    /// Natural frequency in rad/s, 0.01 to 100.
    pub mu: T,
    /// Angle a0 about which it swings in deg, -360 to 360.
    pub offset: T,
}

/// A built Rayleigh oscillator.
pub type Rayleigh<T = f32, I = Rk4> = Oscillators<RayleighField<T>, 1, T, I>;

impl<T: Scalar> RayleighConfig<T> {
    /// Checks every value against its range, without the period.
    ///
    /// # Errors
    /// [`BuildError`] naming the first field that is not allowed.
    pub fn validate(&self) -> Result<(), BuildError> {
        self.validate_as(Field::of)
    }

    /// [`RayleighConfig::validate`] with another way to name the fields.
    pub(crate) fn validate_as(&self, field: impl Fn(&'static str) -> Field) -> Result<(), BuildError> {
        in_range(self.alpha, field("alpha"), 1e-6, 1000.0)?;
        in_range(self.p, field("p"), 1e-12, 1e6)?;
        in_range(self.mu, field("mu"), 0.01, 100.0)?;
        in_range(self.offset, field("offset"), -360.0, 360.0)
    }

    /// Validates and folds the configuration for one control period. It starts at its greatest displacement.
    ///
    /// # Errors
    /// [`BuildError`] naming the first field that is not allowed, or the longest period that is.
    ///
    /// ```
    /// use cpg_core::Generator;
    /// use cpg_core::oscillator::rayleigh::{Rayleigh, RayleighConfig};
    /// use joint_units::Period;
    /// let config = RayleighConfig { alpha: 0.2, p: 5.0, mu: 1.0, offset: 10.0 };
    /// let mut oscillator: Rayleigh = config.build(Period::MILLISECOND)?;
    /// let (mut least, mut most) = (f32::MAX, f32::MIN);
    /// for _ in 0..60_000 {
    ///     oscillator.step();
    ///     let [angle] = oscillator.angles().map(|angle| angle.degrees());
    ///     (least, most) = (least.min(angle), most.max(angle));
    /// }
    /// assert!((most - 10.518).abs() < 1e-3 && (least - 9.482).abs() < 1e-3);
    /// # Ok::<(), cpg_core::BuildError>(())
    /// ```
    pub fn build<I: Integrator>(&self, period: Period) -> Result<Rayleigh<T, I>, BuildError> {
        self.validate()?;
        allow_period(period, self.longest_period::<I>(self.alpha, T::ZERO))?;
        let unit = T::ratio(period.micros(), 1_000_000 * I::UNITS);
        let cycle = self.cycle(self.alpha);
        let limit = self.limit(self.alpha);
        let terms = Terms {
            unit,
            velocity: [T::ONE / unit],
            radians: [radians_per_degree()],
            offsets: [self.offset * radians_per_degree()],
            cycle: OscillatorState { displacement: [cycle.0], velocity: [cycle.1] },
            limit: OscillatorState { displacement: [limit.0], velocity: [limit.1] },
        };
        let start = OscillatorState { displacement: [cycle.0], velocity: [T::ZERO] };
        Ok(Oscillators::new(RayleighField(self.fold(unit)), &start, &terms))
    }

    /// Amplitude of displacement and velocity by harmonic balance, where `growth` is the whole negative damping at rest.
    pub(crate) fn cycle(&self, growth: T) -> (T, T) {
        let velocity = T::ratio(2, 1) * (growth / (T::ratio(3, 1) * self.alpha * self.p)).sqrt();
        (velocity / self.mu, velocity)
    }

    /// Bounds of displacement and velocity.
    pub(crate) fn limit(&self, growth: T) -> (T, T) {
        let (displacement, velocity) = self.cycle(growth);
        let headroom = T::from_f32(BOUND_FACTOR);
        (headroom * displacement * (T::ONE + growth / self.mu), headroom * velocity)
    }

    /// Longest control period in microseconds that is neither too coarse nor diverges inside the limit; `links` is the sum of the
    /// gains' sizes.
    pub(crate) fn longest_period<I: Integrator>(&self, growth: T, links: T) -> u32 {
        // Minus the derivative of alpha (1 - p z^2) z at the limit of z, BOUND_FACTOR times the cycle's; a link can add twice its gain.
        let steepest = T::from_f32(4.0 * BOUND_FACTOR * BOUND_FACTOR) * growth - self.alpha + links + links;
        longest_period::<T, I>(self.mu, steepest)
    }

    /// The constants of the equation in a time unit of `c` seconds, in which velocity is c a' and acceleration c^2 a''.
    pub(crate) fn fold(&self, c: T) -> Folded<T> {
        Folded { damping: c * self.alpha, cubic: self.alpha * self.p / c, spring: c * self.mu * (c * self.mu) }
    }
}

/// One oscillator's constants for one time unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Folded<T> {
    /// c alpha.
    pub(crate) damping: T,
    /// alpha p / c.
    pub(crate) cubic: T,
    /// (c mu)^2.
    pub(crate) spring: T,
}

impl<T: Scalar> Folded<T> {
    /// The oscillator's own acceleration, without any link.
    pub(crate) fn acceleration(&self, x: T, v: T) -> T {
        (self.damping - v * v * self.cubic) * v - x * self.spring
    }
}

/// The vector field of the isolated oscillator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayleighField<T = f32>(Folded<T>);

impl<T: Scalar> SecondOrder<T, 1> for RayleighField<T> {
    fn acceleration(&self, &[x]: &[T; 1], &[v]: &[T; 1]) -> [T; 1] {
        [self.0.acceleration(x, v)]
    }
}

pub(crate) fn radians_per_degree<T: Scalar>() -> T {
    T::TAU / T::ratio(360, 1)
}
