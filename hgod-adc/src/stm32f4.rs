//! Data and formulas of the STM32F4's converter: supply, internal voltage reference and temperature sensor.
//!
//! This is the only module of the crate that is about one chip. For another chip write the [`ReferenceConfig`] from its data sheet yourself; all
//! of its fields are public.
//!
//! | what | value | source |
//! |---|---|---|
//! | supply VDDA | 1.8 to 3.6 V | data sheets of the STM32F407, STM32F411 and STM32F446, "General operating conditions" |
//! | internal reference VREFINT | 1.18 to 1.24 V | the same, "Embedded internal reference voltage" |
//! | supply at the factory's three readings | 3.3 V | the same, "calibration values" |
//! | temperature sensor | 0.76 V at 25 degrees, 2.5 mV a degree | the same, "Temperature sensor characteristics" |
//!
//! # Temperature of the die
//! ```text
//! T = 30 + (code VDDA / 3.3 - cal_30) (110 - 30) / (cal_110 - cal_30)
//! ```
//! T in degrees Celsius, VDDA in volts, `code` that of the temperature sensor; `cal_30` and `cal_110` are the factory's codes at VDDA = 3.3 V, at 30
//! and 110 degrees (data sheets, "Temperature sensor calibration values"). Half a code is about 0.16 degrees. The die is warmer than the air around it, because the chip heats itself.

pub(crate) mod limits;

use crate::code::{Excitation, ReferenceConfig};
use crate::range::{RangeError, within};
use joint_units::{AdcCode, Celsius, Volts};

pub use limits::{MAX_SUPPLY, MIN_SUPPLY, REFERENCE_VOLTS, SUPPLY_AT_CAL};

impl ReferenceConfig {
    /// The configuration for a sensor with its own supply on a pin of this chip, without a divider. `vrefint_cal` is the factory's code of the
    /// internal reference at 3.3 V, which the chip has in its system memory (data sheet, "Embedded internal reference voltage"). Samples at a
    /// supply below 3.0 V are not good.
    #[must_use]
    pub const fn stm32f4(vrefint_cal: AdcCode) -> Self {
        Self {
            divider: 1.0,
            vrefint_cal,
            vdda_at_cal: SUPPLY_AT_CAL,
            min_supply: Volts(3.0),
            excitation: Excitation::Own,
        }
    }
}

/// Temperatures of the two readings.
const COOL: f32 = 30.0;
const HOT: f32 = 110.0;

/// Volts that a reading at 30 degrees may imply: 0.76 at 25 degrees in the data sheets, and a margin.
const VOLTS_AT_30: (f32, f32) = (0.6, 0.95);
/// Slope in volts per degree that the two readings may imply: 2.5 mV in the data sheets, and a quarter.
const SLOPE: (f32, f32) = (1.9e-3, 3.1e-3);

/// Conversion of the temperature sensor's codes to degrees Celsius, from the checked factory readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DieTemperature {
    cal_30: f32,
    degrees_per_code: f32,
}

impl DieTemperature {
    /// From the factory's codes at 30 and at 110 degrees.
    ///
    /// # Errors
    /// A reading out of range: erased, unreadable, or the two exchanged.
    ///
    /// ```
    /// use hgod_adc::stm32f4::DieTemperature;
    /// use joint_units::{AdcCode, Volts};
    /// let die = DieTemperature::build(AdcCode(941), AdcCode(1202))?;
    /// // At 3.0 V the code is a tenth greater than at 3.3 V.
    /// assert!((die.celsius(AdcCode(1035), Volts(3.0)).0 - 30.0).abs() < 0.2);
    /// let erased = DieTemperature::build(AdcCode(0xFFFF), AdcCode(0xFFFF)).unwrap_err();
    /// assert_eq!(erased.to_string(), "temperature.cal_30 = 65535: allowed is 745 to 1178");
    /// # Ok::<(), hgod_adc::RangeError>(())
    /// ```
    pub fn build(cal_30: AdcCode, cal_110: AdcCode) -> Result<Self, RangeError> {
        let codes_per_volt = f32::from(AdcCode::MAX.0) / SUPPLY_AT_CAL.0;
        let codes = |volts: f32| volts * codes_per_volt;
        let between = |field, code: AdcCode, least: f32, most: f32| {
            within(field, f32::from(code.0), libm::ceilf(least), libm::floorf(most))
        };
        let cool = between("temperature.cal_30", cal_30, codes(VOLTS_AT_30.0), codes(VOLTS_AT_30.1))?;
        let at_110 = |slope: f32| cool + codes(slope * (HOT - COOL));
        let hot = between("temperature.cal_110", cal_110, at_110(SLOPE.0), at_110(SLOPE.1))?;
        Ok(Self { cal_30: cool, degrees_per_code: (HOT - COOL) / (hot - cool) })
    }

    /// The temperature for a code of the sensor, converted at a supply.
    #[must_use]
    pub fn celsius(&self, code: AdcCode, supply: Volts) -> Celsius {
        let at_cal = f32::from(code.0) * supply.0 / SUPPLY_AT_CAL.0;
        Celsius(COOL + (at_cal - self.cal_30) * self.degrees_per_code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sensor of the data sheets: 0.76 V at 25 degrees, 2.5 mV a degree.
    fn code(celsius: f32, supply: f32) -> AdcCode {
        AdcCode(((0.76 + 0.0025 * (celsius - 25.0)) / supply * 4095.0).round() as u16)
    }

    #[test]
    fn the_temperature_comes_back_at_any_supply() {
        let die = DieTemperature::build(code(30.0, 3.3), code(110.0, 3.3)).unwrap();
        for supply in [2.7, 3.0, 3.3, 3.6] {
            for celsius in -40..=125 {
                let celsius = celsius as f32;
                let got = die.celsius(code(celsius, supply), Volts(supply)).0;
                // Half a code each of the reading and of the two factory values.
                assert!((got - celsius).abs() < 0.5, "{celsius} at {supply} V: {got}");
            }
        }
    }

    #[test]
    fn impossible_factory_values_are_refused_by_name() {
        for (cal_30, cal_110, field) in [
            (0, 1202, "temperature.cal_30"),
            (0xFFFF, 0xFFFF, "temperature.cal_30"),
            (1202, 941, "temperature.cal_30"),
            (941, 941, "temperature.cal_110"),
            (941, 0xFFFF, "temperature.cal_110"),
        ] {
            assert_eq!(DieTemperature::build(AdcCode(cal_30), AdcCode(cal_110)).unwrap_err().field, field);
        }
    }
}
