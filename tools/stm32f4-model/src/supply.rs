//! Supply supervision: power-on, power-down and brown-out reset, the voltage detector, and the reset pin (RM0090 5.2.1 to 5.2.3, 6.1.1; data sheet
//! STM32F405/407, table "embedded reset and power control block characteristics"; typical values but for the brown-out reset).

use crate::reset::ResetCause;

/// Where a chip lies in the spread of the thresholds of the brown-out reset that the data sheet allows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum BrownOutThreshold {
    /// The lowest thresholds: falling 2.75 V at level 3, rising 2.85 V.
    Min,
    /// Typical ones: falling 2.83 V at level 3, rising 2.92 V.
    #[default]
    Typical,
    /// The highest ones: falling 2.88 V at level 3, rising 2.97 V.
    Max,
}

/// Falling and rising threshold of the brown-out reset by BOR_LEV of the option bytes, V: levels 3, 2 and 1 (VBOR3, VBOR2, VBOR1 of the data sheet), and
/// off, where only the power-down reset is left. Of each the minimum, the typical value and the maximum.
const RESET_V: [[(f64, f64); 3]; 4] = [
    [(2.75, 2.85), (2.83, 2.92), (2.88, 2.97)],
    [(2.44, 2.53), (2.50, 2.59), (2.56, 2.63)],
    [(2.13, 2.23), (2.19, 2.29), (2.24, 2.33)],
    [(PDR_V, 1.72); 3],
];
/// Below this supply the chip has no power, V.
const PDR_V: f64 = 1.68;
/// From the return of the supply to the end of the reset, s.
const TEMPORISATION_S: f64 = 1.5e-3;
/// Rising thresholds of the voltage detector by PWR_CR.PLS, V.
#[expect(clippy::approx_constant, reason = "3.14 V is a threshold")]
const DETECTOR_V: [f64; 8] = [2.14, 2.30, 2.45, 2.60, 2.76, 2.93, 3.03, 3.14];
/// Hysteresis of the voltage detector, V.
const DETECTOR_HYSTERESIS_V: f64 = 0.1;

/// The supply and the reset pin.
#[derive(Debug, Clone)]
pub(crate) struct Supply {
    volts: f64,
    threshold: BrownOutThreshold,
    /// The supply holds the chip in reset.
    is_low: bool,
    /// The reset pin is held low.
    pin_is_low: bool,
    /// The time at which a reset by the supply ends, s.
    released_at: f64,
    /// PVDO.
    detected: bool,
}

impl Supply {
    /// A supply that was switched on at time 0. The chip is held in reset until it is above the rising threshold of its level (5.2.2).
    pub(crate) fn new(volts: f64, threshold: BrownOutThreshold, bor_level: u8) -> Self {
        let is_low = volts < RESET_V[usize::from(bor_level & 3)][threshold as usize].1;
        Supply { volts, threshold, is_low, pin_is_low: false, released_at: f64::NEG_INFINITY, detected: false }
    }

    /// Sets the supply, V. Returns the reset that begins.
    pub(crate) fn set_volts(&mut self, volts: f64, bor_level: u8, seconds: f64) -> Option<ResetCause> {
        self.volts = volts;
        let (below, above) = RESET_V[usize::from(bor_level & 3)][self.threshold as usize];
        if !self.is_low && volts < below {
            self.is_low = true;
            return Some(if volts < PDR_V { ResetCause::PowerOn } else { ResetCause::BrownOut });
        }
        if self.is_low && volts < PDR_V {
            // A supply that falls on takes the power away too.
            return Some(ResetCause::PowerOn);
        }
        if self.is_low && volts >= above {
            self.is_low = false;
            self.released_at = seconds + TEMPORISATION_S;
        }
        None
    }

    /// Pulls the reset pin low, or releases it. Returns the reset that begins.
    pub(crate) fn pull_pin(&mut self, low: bool) -> Option<ResetCause> {
        let falls = low && !self.pin_is_low;
        self.pin_is_low = low;
        falls.then_some(ResetCause::Pin)
    }

    /// Time until which the chip is held in reset, s; infinity: until the supply or the pin changes.
    pub(crate) fn held_until(&self) -> f64 {
        if self.is_low || self.pin_is_low { f64::INFINITY } else { self.released_at }
    }

    /// Output of the voltage detector with threshold PLS; it changes at a threshold with hysteresis (5.2.3).
    pub(crate) fn detect(&mut self, enabled: bool, pls: u32) -> bool {
        let rising = DETECTOR_V[(pls & 7) as usize];
        let threshold = if self.detected { rising } else { rising - DETECTOR_HYSTERESIS_V };
        self.detected = enabled && self.volts < threshold;
        self.detected
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_brown_out_reset_has_the_threshold_of_its_level() {
        // 5.2.2 and the data sheet: 2.83, 2.50, 2.19 V; off, only the power-down reset at 1.68 V.
        for (level, below, above) in [(0, 2.82, 2.84), (1, 2.49, 2.51), (2, 2.18, 2.20)] {
            let mut supply = Supply::new(3.0, BrownOutThreshold::Typical, 3);
            assert_eq!(supply.set_volts(above, level, 1.0), None);
            assert_eq!(supply.set_volts(below, level, 2.0), Some(ResetCause::BrownOut));
            assert_eq!(supply.set_volts(above, level, 3.0), None);
            assert_eq!(supply.held_until(), f64::INFINITY, "hysteresis of 100 mV");
            assert_eq!(supply.set_volts(3.0, level, 4.0), None);
            assert!((supply.held_until() - 4.0015).abs() < 1e-9);
        }
        let mut off = Supply::new(3.0, BrownOutThreshold::Typical, 3);
        assert_eq!(off.set_volts(1.7, 3, 1.0), None);
        assert_eq!(off.set_volts(1.6, 3, 1.0), Some(ResetCause::PowerOn));
    }

    #[test]
    fn the_thresholds_have_the_spread_of_the_data_sheet() {
        // VBOR3: falling 2.75, 2.83, 2.88 V; rising 2.85, 2.92, 2.97 V.
        use BrownOutThreshold::{Max, Min, Typical};
        for (threshold, falling, rising) in [(Min, 2.75, 2.85), (Typical, 2.83, 2.92), (Max, 2.88, 2.97)] {
            let starts = |volts| Supply::new(volts, threshold, 0).held_until() < 0.0;
            assert!(starts(rising) && !starts(rising - 0.01), "{threshold:?}: a power-on needs the rising threshold");
            let mut supply = Supply::new(3.0, threshold, 0);
            assert_eq!(supply.set_volts(falling, 0, 1.0), None);
            assert_eq!(supply.set_volts(falling - 0.01, 0, 1.0), Some(ResetCause::BrownOut));
        }
    }

    #[test]
    fn a_supply_that_falls_on_is_a_power_on() {
        let mut supply = Supply::new(3.0, BrownOutThreshold::Typical, 3);
        assert_eq!(supply.set_volts(2.5, 0, 1.0), Some(ResetCause::BrownOut));
        assert_eq!(supply.set_volts(0.0, 0, 1.1), Some(ResetCause::PowerOn));
    }

    #[test]
    fn the_pin_holds_the_chip_in_reset_while_it_is_low() {
        let mut supply = Supply::new(3.0, BrownOutThreshold::Typical, 3);
        assert_eq!(supply.pull_pin(true), Some(ResetCause::Pin));
        assert_eq!((supply.pull_pin(true), supply.held_until()), (None, f64::INFINITY));
        assert_eq!((supply.pull_pin(false), supply.held_until()), (None, f64::NEG_INFINITY));
    }

    #[test]
    fn the_voltage_detector_has_a_hysteresis() {
        // 5.2.3, PLS 101: 2.93 V rising, 0.1 V of hysteresis.
        let mut supply = Supply::new(3.0, BrownOutThreshold::Typical, 3);
        let mut at = |volts| {
            supply.set_volts(volts, 3, 0.0);
            supply.detect(true, 5)
        };
        assert_eq!([3.0, 2.9, 2.82, 2.9, 2.94].map(&mut at), [false, false, true, true, false]);
        assert!(!Supply::new(2.0, BrownOutThreshold::Typical, 3).detect(false, 5));
    }
}
