//! The independent watchdog: started once, never stopped by the program, and from the arming on running on while a debugger halts the core.
//! [`firmware_shared::liveness`] decides when to reload it.
//!
//! Its clock is measured by [`crate::stopwatch`].
//!
//! Written by registers, because the HAL computes the time-out for the nominal 32 kHz only.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{DBGMCU, IWDG};
use firmware_shared::liveness::{PRESCALER, RELOAD};
use firmware_shared::pacing::since;

use crate::removed::{Protection, lacks};
use crate::stopwatch;

const _: () = assert!(PRESCALER == 4, "the divider that `start` writes");

/// Longest wait for the registers, us: that of a clock of 1 kHz.
const UPDATE_TIMEOUT_US: u32 = 10_000;

/// A servo may get pulses.
static RUNS_ON: AtomicBool = AtomicBool::new(false);

/// Whether watchdog and timers stand still while a debugger halts the core (RM0090 38.16.4 and 38.16.5): the triggers of the ticks, both clocks of the
/// program, and the servo frames, which keep their distance from the ticks.
fn write_freeze(is_frozen: bool) {
    DBGMCU.apb1fzr().modify(|w| {
        w.set_iwdg(is_frozen);
        w.set_tim2(is_frozen);
        w.set_tim4(is_frozen);
        w.set_tim5(is_frozen);
    });
    DBGMCU.apb2fzr().modify(|w| w.set_tim1(is_frozen));
}

/// Lets watchdog and timers run on while a debugger halts the core: from before the outputs go on. A halted core must not leave the last pulse on the
/// servos for longer than a hang does; if TIM1 stopped, its pins would keep their level. A halt between this call and the first pulse finds the outputs off
/// or without a width, and the watchdog running: the board is reset as from a halt in a walk.
pub(crate) fn run_while_halted() {
    RUNS_ON.store(true, Ordering::Relaxed);
    write_freeze(false);
    // The write has arrived before the next one to a timer.
    cortex_m::asm::dsb();
}

/// Stops watchdog and timers with a halted core, after the outputs are off: a probe that halts the core to attach or to read disturbs nothing then. The pins
/// of TIM1 are low without its counter.
pub(crate) fn stop_while_halted() {
    RUNS_ON.store(false, Ordering::Relaxed);
    write_freeze(true);
}

/// Starts the watchdog: from here on [`feed`] must be called in time.
pub(crate) fn start() {
    stop_while_halted();
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    IWDG.rlr().write(|w| w.set_rl(RELOAD));
    // The registers take up to five slow cycles each (RM0090 21.4.4): 0.6 ms at 17 kHz. With a clock that stands still they are never ready.
    let begun = stopwatch::now_us();
    while IWDG.sr().read().0 != 0 && since(stopwatch::now_us(), begun) < UPDATE_TIMEOUT_US {}
    feed();
}

/// Reloads the watchdog. A debugger may have changed the bits that stop it since the last time.
pub(crate) fn feed() {
    // No tick may switch the outputs on between the read of the state and the write.
    if !lacks(Protection::FreezeBits) {
        cortex_m::interrupt::free(|_| write_freeze(!RUNS_ON.load(Ordering::Relaxed)));
    }
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}
