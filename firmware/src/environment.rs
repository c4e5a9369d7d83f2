//! Means of the die temperature and the converter's supply over the samples since the last read.
//!
//! The control task adds once a tick, telemetry reads once a second. Half a code of a mean is 0.16 degrees, or 1 mV of the supply.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use firmware::board::BOARD;
use hgod_adc::stm32f4::DieTemperature;
use hgod_adc::{Reference, ReferenceConfig, SupplyFault};
use joint_units::AdcCode;

/// Sums of codes, and their number.
#[derive(Clone, Copy)]
struct Sums {
    reference: u32,
    temperature: u32,
    count: u32,
}

const NOTHING: Sums = Sums { reference: 0, temperature: 0, count: 0 };

static SUMS: Mutex<CriticalSectionRawMutex, Cell<Sums>> = Mutex::new(Cell::new(NOTHING));

/// Adds the codes of a tick.
pub(crate) fn add(reference: AdcCode, temperature: AdcCode) {
    SUMS.lock(|sums| {
        let so_far = sums.get();
        // A sum wraps only after a million ticks without a read.
        sums.set(Sums {
            reference: so_far.reference.wrapping_add(reference.0.into()),
            temperature: so_far.temperature.wrapping_add(temperature.0.into()),
            count: so_far.count.wrapping_add(1),
        });
    });
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
        let sums = SUMS.lock(|sums| sums.replace(NOTHING));
        let mean = |sum: u32| {
            let rounded = sum.saturating_add(sums.count / 2).checked_div(sums.count).unwrap_or(0);
            // A mean of 16 bit codes has 16 bits.
            AdcCode(rounded as u16)
        };
        let supply = self.reference.and_then(|reference| match reference.supply(mean(sums.reference)) {
            Ok(supply) => Some(supply.volts()),
            // Out of range for a sample, but reported.
            Err(SupplyFault::Low { supply: volts, .. } | SupplyFault::High(volts)) => Some(volts),
            Err(_) => None,
        });
        let die = self.die.zip(supply).map(|(die, supply)| die.celsius(mean(sums.temperature), supply));
        wire::Environment {
            die_c: die.map(|die| die.0),
            supply_v: supply.map(|supply| supply.0),
            watchdog_hz: None,
            debugger: false,
        }
    }
}
