//! Temperature of the die and supply of the converter, as means over what was sampled since they were last asked for.
//!
//! The sensor task adds once a tick, telemetry takes once a second. Half a code of a mean is 0.16 degrees, or 1 mV of the supply.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use hgod_adc::{DieTemperature, Reference, ReferenceConfig, SupplyFault};
use joint_units::{AdcCode, Celsius, Volts};

use crate::board::BOARD;

/// Sums of codes, and how many.
#[derive(Clone, Copy)]
struct Sums {
    vrefint: u32,
    temperature: u32,
    count: u32,
}

const NOTHING: Sums = Sums { vrefint: 0, temperature: 0, count: 0 };

static SUMS: Mutex<CriticalSectionRawMutex, Cell<Sums>> = Mutex::new(Cell::new(NOTHING));

/// Adds the codes of a tick.
pub(crate) fn add(vrefint: AdcCode, temperature: AdcCode) {
    SUMS.lock(|sums| {
        let so_far = sums.get();
        // A million ticks would have to go by unasked before a sum wraps.
        sums.set(Sums {
            vrefint: so_far.vrefint.wrapping_add(vrefint.0.into()),
            temperature: so_far.temperature.wrapping_add(temperature.0.into()),
            count: so_far.count.wrapping_add(1),
        });
    });
}

/// What turns the codes into degrees and volts.
pub(crate) struct Climate {
    /// `None` on a chip whose factory readings cannot be true.
    reference: Option<Reference>,
    die: Option<DieTemperature>,
}

impl Climate {
    pub(crate) fn new(vrefint_cal: AdcCode, [cal_30, cal_110]: [AdcCode; 2]) -> Self {
        let reference = ReferenceConfig { min_supply: BOARD.min_supply, ..ReferenceConfig::stm32f4(vrefint_cal) };
        Self { reference: reference.build().ok(), die: DieTemperature::build(cal_30, cal_110).ok() }
    }

    /// The means since the last call; "not a number" where there is nothing to tell.
    pub(crate) fn take(&self) -> (Celsius, Volts) {
        let sums = SUMS.lock(|sums| sums.replace(NOTHING));
        let mean = |sum: u32| {
            let rounded = sum.saturating_add(sums.count / 2).checked_div(sums.count).unwrap_or(0);
            // A mean of 16 bit codes has 16 bits.
            AdcCode(rounded as u16)
        };
        let supply = self.reference.map(|reference| reference.supply(mean(sums.vrefint)));
        let supply = match supply {
            Some(Ok(supply)) => supply.volts(),
            // Not good for a sample, but worth telling.
            Some(Err(SupplyFault::Low(volts) | SupplyFault::High(volts))) => volts,
            Some(Err(_)) | None => Volts(f32::NAN),
        };
        let die = self.die.map_or(Celsius(f32::NAN), |die| die.celsius(mean(sums.temperature), supply));
        (die, supply)
    }
}
