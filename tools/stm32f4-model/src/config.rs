//! Configuration of the modelled chip: crystal, supply, factory calibration, temperature. A program cannot change it.

use crate::chip::Chip;
use crate::supply::BrownOutThreshold;

/// Properties of the chip and of its board. `Default` is the STM32F4 Discovery: working 8 MHz crystal, 32 kHz LSI, VDD and VDDA 3.0 V, option bytes as
/// delivered.
#[derive(Debug, Clone, PartialEq)]
pub struct SocConfig {
    /// The chip.
    pub chip: Chip,
    /// Frequency of the HSE crystal, Hz. 4 to 26 MHz; 8 MHz on the Discovery board, 25 MHz on a Black Pill.
    pub hse_hz: u32,
    /// False: the crystal does not start, and HSERDY stays 0.
    pub hse_ready: bool,
    /// True where a 32 768 Hz crystal is fitted (the Discovery board has none).
    pub lse_ready: bool,
    /// Frequency of the internal low speed oscillator at power-on, Hz: 32 000 nominal, 17 000 to 47 000 by the data sheet, 0 for one that does not
    /// oscillate. Clocks the watchdog; [`crate::Soc::set_lsi`] changes it.
    pub lsi_hz: f64,
    /// Supply of the chip at power-on, V. On the Discovery board, powered by 5 V USB through a Schottky diode and a regulator: 3.0 V.
    pub vdd: f64,
    /// Where the thresholds of the brown-out reset lie in their spread.
    pub brown_out_threshold: BrownOutThreshold,
    /// Analogue supply and ADC reference, V; [`crate::Plant::vdda`] may override it. On the Discovery board, powered by 5 V USB: 3.0 V.
    pub vdda: f64,
    /// Internal reference voltage, V: 1.21 typical, 1.18 to 1.24 by the data sheet.
    pub vrefint: f64,
    /// Voltage at VBAT, V; channel 18 of ADC1 measures half of it, or a quarter on the F411.
    pub vbat: f64,
    /// Temperature of the die, degrees Celsius; channel 16 of ADC1 (18 on the F411) measures 0.76 V + 2.5 mV/K (T - 25).
    pub die_celsius: f64,
    /// VREFINT_CAL at 0x1FFF7A2A, 0 to 4095; `None`: the ideal value at VDDA = 3.3 V, round(vrefint / 3.3 * 4095).
    pub vrefint_cal: Option<u16>,
    /// The 96 bit unique identifier at 0x1FFF7A10.
    pub unique_id: [u32; 3],
    /// BOR_LEV of the option bytes: 0 is the highest level of the brown-out reset, 3 is off, as delivered.
    pub bor_level: u8,
}

impl Default for SocConfig {
    fn default() -> Self {
        SocConfig {
            chip: Chip::F407,
            hse_hz: 8_000_000,
            hse_ready: true,
            lse_ready: false,
            lsi_hz: 32_000.0,
            vdd: 3.0,
            brown_out_threshold: BrownOutThreshold::Typical,
            vdda: 3.0,
            vrefint: 1.21,
            vbat: 3.0,
            die_celsius: 25.0,
            vrefint_cal: None,
            unique_id: [0x0035_0027, 0x3133_510C, 0x3437_3439],
            bor_level: 3,
        }
    }
}

impl SocConfig {
    /// A Black Pill: STM32F411CE, 25 MHz crystal, a 32 768 Hz crystal, VDD and VDDA 3.3 V; the rest as in the default.
    #[must_use]
    pub fn black_pill() -> Self {
        SocConfig {
            chip: Chip::F411,
            hse_hz: 25_000_000,
            lse_ready: true,
            vdd: 3.3,
            vdda: 3.3,
            vbat: 3.3,
            ..SocConfig::default()
        }
    }

    /// VREFINT_CAL as the program reads it, 0 to 4095.
    #[must_use]
    pub fn vrefint_cal(&self) -> u16 {
        self.vrefint_cal.unwrap_or_else(|| (self.vrefint / 3.3 * 4095.0).round() as u16)
    }
}
