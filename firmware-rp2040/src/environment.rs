//! Mean of the die temperature over the samples since the last read. This chip cannot measure its supply.
//!
//! The control task adds once a tick, telemetry reads once a second.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use joint_units::AdcCode;

/// Sum of codes, and their number.
static SUMS: Mutex<CriticalSectionRawMutex, Cell<(u32, u32)>> = Mutex::new(Cell::new((0, 0)));

/// Adds the codes of a tick.
pub(crate) fn add(_reference: AdcCode, temperature: AdcCode) {
    SUMS.lock(|sums| {
        let (sum, count) = sums.get();
        sums.set((sum.wrapping_add(temperature.0.into()), count.wrapping_add(1)));
    });
}

/// Converts the codes to degrees.
pub(crate) struct Environment;

impl Environment {
    /// The mean since the last call, without the other conditions.
    pub(crate) fn take(&self) -> wire::Environment {
        let (sum, count) = SUMS.lock(|sums| sums.replace((0, 0)));
        // 27 degrees at 0.706 V, -1.721 mV a degree (RP2040 datasheet, 4.9.5), at a supply of 3.3 V.
        let die_c = (count > 0).then(|| 27.0 - (sum as f32 / count as f32 * (3.3 / 4095.0) - 0.706) / 0.001_721);
        wire::Environment { die_c, supply_v: None, watchdog_hz: None, debugger: false, warnings: wire::Warnings::NONE }
    }
}
