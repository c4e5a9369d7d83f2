//! Means of the die temperature and the converter's supply over the samples since the last read.
//!
//! The control task adds once a tick, telemetry reads once a second. Half a code of a mean is 0.16 degrees, or 1 mV of the supply.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, RawMutex};
use firmware::board::BOARD;
use hgod_adc::stm32f4::DieTemperature;
use hgod_adc::{Reference, ReferenceConfig, SupplyFault};
use joint_units::AdcCode;

/// Sum of the codes of the internal reference.
static REFERENCES: AtomicU32 = AtomicU32::new(0);
/// Sum of the codes of the temperature sensor.
static TEMPERATURES: AtomicU32 = AtomicU32::new(0);
/// How many codes are in each sum.
static COUNT: AtomicU32 = AtomicU32::new(0);

/// Adds the codes of a tick. Only the tick adds, and a read holds it off: load and store need not be one.
pub(crate) fn add(reference: AdcCode, temperature: AdcCode) {
    // A sum wraps only after a million ticks without a read.
    let add = |sum: &AtomicU32, more: u32| sum.store(sum.load(Ordering::Relaxed).wrapping_add(more), Ordering::Relaxed);
    add(&REFERENCES, reference.0.into());
    add(&TEMPERATURES, temperature.0.into());
    add(&COUNT, 1);
}

/// Converts the codes to degrees and volts.
pub(crate) struct Environment {
    /// `None` if the chip's factory code is implausible.
    reference: Option<Reference>,
    die: Option<DieTemperature>,
}

impl Environment {
    pub(crate) fn new(reference_cal: AdcCode, [cal_30, cal_110]: [AdcCode; 2]) -> Self {
        let reference = ReferenceConfig { min_supply: BOARD.min_supply, ..ReferenceConfig::stm32f4(reference_cal) };
        Self { reference: reference.build().ok(), die: DieTemperature::build(cal_30, cal_110).ok() }
    }

    /// The means since the last call, without the other conditions.
    pub(crate) fn take(&self) -> wire::Environment {
        // No tick adds between the three.
        let [references, temperatures, count] = CriticalSectionRawMutex::INIT
            .lock(|| [&REFERENCES, &TEMPERATURES, &COUNT].map(|sum| sum.swap(0, Ordering::Relaxed)));
        let mean = |sum: u32| {
            let rounded = sum.saturating_add(count / 2).checked_div(count).unwrap_or(0);
            // A mean of 16 bit codes has 16 bits.
            AdcCode(rounded as u16)
        };
        let supply = self.reference.and_then(|reference| match reference.supply(mean(references)) {
            Ok(supply) => Some(supply.volts()),
            // Out of range for a sample, but reported.
            Err(SupplyFault::Low { supply: volts, .. } | SupplyFault::High(volts)) => Some(volts),
            Err(_) => None,
        });
        let die = self.die.zip(supply).map(|(die, supply)| die.celsius(mean(temperatures), supply));
        wire::Environment {
            die_c: die.map(|die| die.0),
            supply_v: supply.map(|supply| supply.0),
            watchdog_hz: None,
            debugger: false,
            warnings: wire::Warnings::NONE,
        }
    }
}
