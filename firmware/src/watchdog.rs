//! The independent watchdog: started once, never stopped, and running on while a debugger halts the core. [`firmware_shared::liveness`] decides
//! when to reload it.
//!
//! Its clock is measured by [`crate::stopwatch`].
//!
//! Written by registers, because the HAL computes the time-out for the nominal 32 kHz only.

use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{DBGMCU, IWDG};
use firmware_shared::liveness::{PRESCALER, RELOAD};
use firmware_shared::pacing::since;

use crate::stopwatch;

const _: () = assert!(PRESCALER == 4, "the divider that `start` writes");

/// Longest wait for the registers, us: that of a clock of 1 kHz.
const UPDATE_TIMEOUT_US: u32 = 10_000;

/// Keeps the watchdog and TIM1 running while a debugger halts the core. A halted core must not leave the last pulse on the servos for longer than
/// a hang does; if TIM1 stopped, its pins would keep their level.
fn run_while_halted() {
    DBGMCU.apb1fzr().modify(|w| w.set_iwdg(false));
    DBGMCU.apb2fzr().modify(|w| w.set_tim1(false));
}

/// Starts the watchdog: from here on [`feed`] must be called in time.
pub(crate) fn start() {
    run_while_halted();
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    IWDG.rlr().write(|w| w.set_rl(RELOAD));
    // The registers take up to five slow cycles each (RM0090 21.4.4): 0.6 ms at 17 kHz. With a clock that stands still they are never ready.
    let begun = stopwatch::now_us();
    while IWDG.sr().read().0 != 0 && since(stopwatch::now_us(), begun) < UPDATE_TIMEOUT_US {}
    feed();
}

/// Reloads the watchdog. A debugger may have set the bits that stop it since the last time.
pub(crate) fn feed() {
    run_while_halted();
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}
