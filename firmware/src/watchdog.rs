//! The independent watchdog: started once, never stopped, not frozen by a debugger. When to feed it is decided in
//! [`firmware::liveness`].
//!
//! By registers, because the HAL computes the time-out for the nominal 32 kHz only.

use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{DBGMCU, IWDG};
use firmware::liveness::{PRESCALER, RELOAD};

const _: () = assert!(PRESCALER == 4, "the divider that `start` writes");

/// Starts it. From here on something has to call [`feed`].
pub(crate) fn start() {
    // A halted core must not leave the servos with the last pulse for longer than a hang does. TIM1 keeps running for the same reason:
    // stopped, its pins would keep their level.
    DBGMCU.apb1fzr().modify(|w| w.set_iwdg(false));
    DBGMCU.apb2fzr().modify(|w| w.set_tim1(false));
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    IWDG.rlr().write(|w| w.set_rl(RELOAD));
    // The registers take up to five slow cycles each (RM0090 21.4.4): 0.6 ms at 17 kHz. The watchdog runs already, so this ends.
    while IWDG.sr().read().0 != 0 {}
    feed();
}

/// Puts off the bite.
pub(crate) fn feed() {
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}
