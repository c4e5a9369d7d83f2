//! Converts codes to volts, and volts to codes for simulations.
//!
//! The converter measures a ratio: `code = 4095 V_pin / VDDA`, rounded, where VDDA is its supply. VDDA falls under the load of the servos, so it is
//! measured with every sample through the chip's internal voltage reference, whose code at a known supply the factory stored in the chip. Full
//! scale is 2^12 - 1:
//! ```text
//! VDDA     = vdda_at_cal vrefint_cal / vrefint
//! V_sensor = divider VDDA code / 4095
//! ```
//! `vrefint` is the code of the internal reference now, `vrefint_cal` that of the factory at the supply `vdda_at_cal`, `divider` the volts at the
//! sensor for one volt at the pin. Units: volts. Valid supply: [`ReferenceConfig::min_supply`] to [`MAX_SUPPLY`]; anything else is a [`SupplyFault`].

use crate::range::{RangeError, within};
use crate::stm32f4::limits::{MAX_SUPPLY, MIN_SUPPLY, REFERENCE_VOLTS};
use core::fmt;
use joint_units::{AdcCode, Volts};

const FULL_SCALE: f32 = AdcCode::MAX.0 as f32;

/// The error of an invalid [`ReferenceConfig`].
pub type ReferenceError = RangeError;

/// Supply of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Excitation {
    /// A supply of its own, independent of the converter's: the volts are corrected by the measured supply of the converter.
    Own,
    /// The converter's supply, as with a potentiometer between VDDA and ground. The code then does not depend on the supply, and nothing is
    /// corrected: volts are computed for this fixed supply, that of the calibration (1.8 to 3.6 V).
    Converter(Volts),
}

/// How the converter's input is wired and referenced.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReferenceConfig {
    /// Volts at the sensor for one volt at the pin: 1 without a divider, 2 for two equal resistors, below 1 for an amplifier; 0.05 to 20.
    pub divider: f32,
    /// Code of the internal reference as measured by the factory; it must mean a reference of 1.1 to 1.3 V.
    pub vrefint_cal: AdcCode,
    /// Supply at which the factory measured it; 1.8 to 3.6 V.
    pub vdda_at_cal: Volts,
    /// Lowest supply at which a sample can be good; 1.8 to 3.6 V.
    pub min_supply: Volts,
    /// Source of the sensor's supply.
    pub excitation: Excitation,
}

impl ReferenceConfig {
    /// Checks every field.
    ///
    /// # Errors
    /// [`RangeError`] names the field that is out of range, and the range.
    ///
    /// ```
    /// use hgod_adc::ReferenceConfig;
    /// use joint_units::AdcCode;
    /// let erased = ReferenceConfig::stm32f4(AdcCode(0xFFFF)).build().unwrap_err();
    /// assert_eq!(erased.field, "reference.vrefint_cal");
    /// assert_eq!(erased.to_string(), "reference.vrefint_cal = 65535: allowed is 1365 to 1613");
    /// ```
    pub fn build(&self) -> Result<Reference, ReferenceError> {
        let supply = |field, volts: Volts| within(field, volts.0, MIN_SUPPLY.0, MAX_SUPPLY.0);
        let divider = within("reference.divider", self.divider, 0.05, 20.0)?;
        let at_cal = supply("reference.vdda_at_cal", self.vdda_at_cal)?;
        let lowest = libm::ceilf(REFERENCE_VOLTS.0.0 / at_cal * FULL_SCALE);
        let highest = libm::floorf(REFERENCE_VOLTS.1.0 / at_cal * FULL_SCALE);
        let cal = within("reference.vrefint_cal", f32::from(self.vrefint_cal.0), lowest, highest)?;
        let min_supply = supply("reference.min_supply", self.min_supply)?;
        let nominal = match self.excitation {
            Excitation::Own => None,
            Excitation::Converter(at) => Some(Supply(supply("reference.excitation", at)?)),
        };
        Ok(Reference { divider, supply_codes: at_cal * cal, min_supply, at_cal: Supply(at_cal), nominal })
    }
}

/// A supply of the converter, measured or stated, in its working range: never 0.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Supply(f32);

impl Supply {
    /// A known supply, for simulations: 1.8 to 3.6 V.
    ///
    /// # Errors
    /// [`RangeError`] for other values.
    pub fn new(volts: Volts) -> Result<Self, RangeError> {
        within("supply", volts.0, MIN_SUPPLY.0, MAX_SUPPLY.0).map(Self)
    }

    /// In volts.
    #[must_use]
    pub const fn volts(self) -> Volts {
        Volts(self.0)
    }
}

/// Why a reading of the internal reference gives no supply.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SupplyFault {
    /// The code is 0 or beyond 12 bit: the channel was not converted.
    NoReading(AdcCode),
    /// Lower than [`ReferenceConfig::min_supply`].
    Low {
        /// What was measured.
        supply: Volts,
        /// The least that is allowed.
        least: Volts,
    },
    /// Higher than [`MAX_SUPPLY`]: the code of the reference is implausibly small.
    High(Volts),
}

impl fmt::Display for SupplyFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoReading(code) => {
                write!(f, "code {} of the internal reference: allowed is 1 to {}", code.0, AdcCode::MAX.0)
            }
            Self::Low { supply, least } => {
                write!(f, "supply of {} V: allowed is {} V or more (reference.min_supply)", supply.0, least.0)
            }
            Self::High(volts) => write!(f, "supply of {} V: allowed is up to {} V", volts.0, MAX_SUPPLY.0),
        }
    }
}

impl core::error::Error for SupplyFault {}

/// A checked [`ReferenceConfig`]: converts codes to volts.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reference {
    divider: f32,
    /// vdda_at_cal vrefint_cal, in volts times codes.
    supply_codes: f32,
    min_supply: f32,
    at_cal: Supply,
    /// The supply of the calibration if the sensor uses the converter's supply.
    nominal: Option<Supply>,
}

impl Reference {
    /// The converter's supply, from the code of the internal reference.
    ///
    /// # Errors
    /// [`SupplyFault`]: no reading, too low, or implausibly high.
    ///
    /// ```
    /// use hgod_adc::{ReferenceConfig, SupplyFault};
    /// use joint_units::AdcCode;
    /// let reference = ReferenceConfig::stm32f4(AdcCode(1501)).build()?;
    /// assert!((reference.supply(AdcCode(1579))?.volts().0 - 3.137).abs() < 1e-3);
    /// assert_eq!(reference.supply(AdcCode(0)), Err(SupplyFault::NoReading(AdcCode(0))));
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn supply(&self, vrefint: AdcCode) -> Result<Supply, SupplyFault> {
        if vrefint.0 == 0 || vrefint > AdcCode::MAX {
            return Err(SupplyFault::NoReading(vrefint));
        }
        let volts = self.supply_codes / f32::from(vrefint.0);
        if volts >= self.min_supply && volts <= MAX_SUPPLY.0 {
            return Ok(Supply(volts));
        }
        if volts < self.min_supply {
            Err(SupplyFault::Low { supply: Volts(volts), least: Volts(self.min_supply) })
        } else {
            Err(SupplyFault::High(Volts(volts)))
        }
    }

    /// Volts at the sensor for a code. A code beyond 12 bit counts as full scale.
    ///
    /// The volts are the centre of the code's interval, so they are off by at most half a code: `divider supply / 8190`.
    #[must_use]
    pub fn volts(&self, code: AdcCode, supply: Supply) -> Volts {
        let ratio = f32::from(code.min(AdcCode::MAX).0) / FULL_SCALE;
        Volts(ratio * self.nominal.unwrap_or(supply).0 * self.divider)
    }

    /// The code that the converter would read for volts at the sensor: the inverse of [`Reference::volts`], for simulations.
    ///
    /// Rounds to the nearest code. Volts below ground read 0 and volts above the supply 4095, as at a real pin within its
    /// ratings; "not a number" reads 0.
    ///
    /// ```
    /// use hgod_adc::{ReferenceConfig, Supply};
    /// use joint_units::{AdcCode, Volts};
    /// let reference = ReferenceConfig { divider: 2.0, ..ReferenceConfig::stm32f4(AdcCode(1501)) }.build()?;
    /// let supply = Supply::new(Volts(3.3))?;
    /// assert_eq!(reference.code(Volts(3.3), supply), AdcCode(2048));
    /// assert_eq!(reference.code(Volts(9.0), supply), AdcCode::MAX);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    #[must_use]
    pub fn code(&self, volts: Volts, supply: Supply) -> AdcCode {
        let ratio = volts.0 / (self.nominal.unwrap_or(supply).0 * self.divider);
        round_to_code(ratio * FULL_SCALE)
    }

    /// The code that the internal reference would read at a supply: the inverse of [`Reference::supply`], for simulations.
    #[must_use]
    pub fn vrefint(&self, supply: Supply) -> AdcCode {
        round_to_code(self.supply_codes / supply.0)
    }

    /// The supply at which the factory measured the internal reference.
    #[must_use]
    pub const fn supply_at_cal(&self) -> Supply {
        self.at_cal
    }

    /// The least and greatest supply at which a sample can be good.
    pub(crate) const fn supplies(&self) -> (Supply, Supply) {
        (Supply(self.min_supply), Supply(MAX_SUPPLY.0))
    }
}

/// Nearest code, ties away from zero. The cast saturates at 0 and turns "not a number" into 0.
fn round_to_code(code: f32) -> AdcCode {
    AdcCode((code + 0.5) as u16).min(AdcCode::MAX)
}
