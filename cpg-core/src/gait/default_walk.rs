//! The default walk: four joints on R1, stable from every start inside its bounds.
//!
//! Left hip, right hip, left knee, right knee at phases 0, 180, 80, -100 degrees: a knee leads its hip by 80 degrees, as the fundamentals
//! of recorded persons do (the other way round, 100 degrees behind, it would bend in stance). Turning both knees by half a stride is a
//! symmetry of R1, so nothing else depends on it. Amplitudes 20 and 30 degrees about offsets of 5 and 30; eps = kap = 0.5; a stride of
//! 1.1 s. On the limit cycle:
//!
//! - the angles overshoot their amplitudes by 3.9 percent, and [`Generator::amplitude`] reads 1.00 to 1.05;
//! - [`Generator::phase`] leads and lags a phase that is even in time by 2.5 degrees;
//! - it starts within 4 percent of the amplitude of the cycle.

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::network::graph::Biped;
use crate::network::phase_coupled::{Robust, RobustConfig};
use crate::network::second_order::OscillatorState;
use crate::{BuildError, Generator, StateFault};

/// Hips and knees on R1 in `f32`, integrated by Runge-Kutta.
///
/// A type of its own rather than a name for [`Robust`], so that its step is compiled here, once, at this crate's level of
/// optimisation: a generic one is compiled wherever it is used, and the firmware around it is optimised for size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk {
    network: Robust<Biped, 4, 4>,
}

impl Walk {
    /// The normalised state now, see [`crate::network::phase_coupled`].
    #[must_use]
    pub fn state(&self) -> OscillatorState<4> {
        self.network.state()
    }

    /// Sets the state; [`Generator::reset`] still returns to the built one.
    ///
    /// # Errors
    /// [`StateFault`] if a value is not finite or not inside the bound; the state is then unchanged.
    pub fn set_state(&mut self, state: &OscillatorState<4>) -> Result<(), StateFault> {
        self.network.set_state(state)
    }
}

impl Generator<4> for Walk {
    fn step(&mut self) {
        self.network.step();
    }

    fn angles(&self) -> [Radians; 4] {
        self.network.angles()
    }

    fn rates(&self) -> [RadPerSec; 4] {
        self.network.rates()
    }

    fn phase(&self) -> Phase {
        self.network.phase()
    }

    fn amplitude(&self) -> f32 {
        self.network.amplitude()
    }

    fn check(&self) -> Result<(), StateFault> {
        self.network.check()
    }

    fn reset(&mut self) {
        self.network.reset();
    }
}

/// Stride time of [`default_walk`] in s.
pub const STRIDE_SECONDS: f32 = 1.1;

/// How much longer than its natural period the network's limit cycle is at eps = kap = 0.5.
const PERIOD_FACTOR: f32 = 1.014_033;

/// Configuration of [`default_walk`].
#[must_use]
pub const fn default_config() -> RobustConfig<4, 4> {
    let hip = Radians::from_degrees(20.0);
    let knee = Radians::from_degrees(30.0);
    RobustConfig {
        natural_period: STRIDE_SECONDS / PERIOD_FACTOR,
        nonlinearity: 0.5,
        coupling: [0.5; 4],
        phases: [degrees(0), degrees(180), degrees(80), degrees(260)],
        amplitudes: [hip, hip, knee, knee],
        offsets: [
            Radians::from_degrees(5.0),
            Radians::from_degrees(5.0),
            Radians::from_degrees(30.0),
            Radians::from_degrees(30.0),
        ],
    }
}

/// The default walk at a control period.
///
/// # Errors
/// [`BuildError::PeriodTooLong`] above 17.2 ms.
///
/// ```
/// use cpg_core::Generator;
/// use cpg_core::gait::default_walk::default_walk;
/// use joint_units::Period;
/// let mut walk = default_walk(Period::MILLISECOND)?;
/// for _ in 0..550 {
///     walk.step();
/// }
/// // Half a stride later the hips have changed places.
/// let [left, right, ..] = walk.angles().map(|angle| angle.degrees());
/// assert!((left + 15.0).abs() < 1.0 && (right - 25.0).abs() < 1.0, "{left} {right}");
/// # Ok::<(), cpg_core::BuildError>(())
/// ```
pub fn default_walk(period: Period) -> Result<Walk, BuildError> {
    Ok(Walk { network: default_config().build(period)? })
}

/// The nearest phase to whole degrees.
const fn degrees(degrees: u64) -> Phase {
    Phase((((degrees << 32) + 180) / 360) as u32)
}
