//! A published sensor curve: the rotary potentiometer Alps RK09K1130A70 on a joint's axis.
//!
//! The cubic was fitted to five potentiometers by the makers of an exoskeleton joint with sensors (ETH Zurich ERC, MIT licence). `a` is the 10 bit
//! code of the wiper, and `pivot` the angle of the shaft in degrees:
//! ```text
//! pivot = 0.2097 (a - 512) + 2.243e-6 (a - 512)^2 + 1.095e-7 (a - 512)^3
//! ```
//! A potentiometer divides its supply, so the angle is a function of the fraction a / 1023 and does not depend on the supply. The curve is meant for
//! tests and for use before a goniometer has its own calibration; a single potentiometer differs from it by an unknown amount.

use crate::point::CalibrationPoint;
use joint_units::{Radians, Volts};

/// Angle of the shaft at a fraction of the supply, 0 to 1; 0 degrees near the middle.
///
/// ```
/// use hgod_adc::rk09k;
/// assert!((rk09k::pivot(0.0).degrees() + 121.475).abs() < 1e-3);
/// assert!((rk09k::pivot(512.0 / 1023.0).degrees()).abs() < 1e-3);
/// ```
#[must_use]
pub const fn pivot(fraction: f32) -> Radians {
    let a = fraction * 1023.0 - 512.0;
    Radians::from_degrees(a * (0.2097 + a * (2.243e-6 + a * 1.095e-7)))
}

/// A calibration table of `N` points (2 to 32) at equal distances from the fraction `first` to the fraction `last` of the supply, each 0 to 1.
///
/// ```
/// use hgod_adc::{Calibration, Interpolation, rk09k};
/// use joint_units::Volts;
/// let table = rk09k::points::<17>(Volts(3.3), 0.26, 0.95);
/// let calibration = Calibration::new(&table, Interpolation::MonotoneCubic)?;
/// let (low, high) = calibration.span();
/// assert!(low.degrees() < -50.0 && high.degrees() > 100.0);
/// # Ok::<(), hgod_adc::CalibrationError>(())
/// ```
#[must_use]
pub fn points<const N: usize>(supply: Volts, first: f32, last: f32) -> [CalibrationPoint; N] {
    core::array::from_fn(|index| {
        let fraction = first + (last - first) * (index as f32 / (N as f32 - 1.0));
        CalibrationPoint { volts: Volts(supply.0 * fraction), angle: pivot(fraction) }
    })
}
