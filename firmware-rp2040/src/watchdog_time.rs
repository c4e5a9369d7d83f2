//! The time-out of the watchdog, and its measurement as the loop wants it.
//!
//! The chip's watchdog counts microseconds that are made from the crystal, so unlike that of the other family it has no oscillator of its own: a
//! crystal that stops takes the watchdog with it. What can be wrong is the divider that makes the microseconds, or the factor 2 of an erratum.
//! So the board measures how fast the watchdog's counter falls, by the core's clock, and gives the loop the frequency that the other family's
//! watchdog needs for the same time-out: the loop's limits ([`joint_loop::control::watchdog_clock`]) are limits of the time-out.

use firmware_shared::liveness::{PRESCALER, RELOAD};
use joint_loop::WatchdogHz;

/// From a reload to the reset, us: as the other family's watchdog at its nominal frequency.
pub const TIMEOUT_US: u32 = firmware_shared::liveness::timeout_us(32_000);

/// The counter falls by two in a microsecond (erratum RP2040-E1).
pub const COUNTS_A_US: u32 = 2;

/// The frequency of the other family's watchdog that has the same time-out, from the counts that fell in a time measured by the core's clock.
///
/// ```
/// use firmware_rp2040::watchdog_time::equivalent;
/// assert_eq!(equivalent(2_000, 1_000).0, 32_000);
/// // Without the factor of the erratum the time-out would be 40 ms, which the loop does not allow.
/// assert_eq!(equivalent(1_000, 1_000).0, 16_000);
/// assert!(equivalent(2_000, 1_000).is_allowed() && !equivalent(1_000, 1_000).is_allowed());
/// assert_eq!(equivalent(0, 1_000).0, 0);
/// assert_eq!(equivalent(5, 0).0, 0);
/// ```
#[must_use]
pub const fn equivalent(counts: u32, us: u32) -> WatchdogHz {
    // The whole count is TIMEOUT_US * COUNTS_A_US; at this rate it lasts that number times us / counts microseconds.
    let whole = TIMEOUT_US as u64 * COUNTS_A_US as u64 * us as u64;
    let cycles = (RELOAD as u64 + 1) * PRESCALER as u64 * 1_000_000;
    match (cycles * counts as u64).checked_div(whole) {
        Some(hz) if hz < u32::MAX as u64 => WatchdogHz(hz as u32),
        _ => WatchdogHz(0),
    }
}
