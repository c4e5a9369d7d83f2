//! Hardware time: TIM5 as 32 bits of free-running microseconds, and the core's cycle counter for short spans.
//!
//! TIM5 and the trigger timer TIM2 have the same clock, so their ratio is exact. The cycle counter may stand still while the core sleeps,
//! so it only measures spans without sleep.

use embassy_stm32::pac::{RCC, TIM5};

use crate::clocks::{self, APB1_TIMER_MHZ};

/// Starts both.
pub(crate) fn start(core: &mut cortex_m::Peripherals) {
    RCC.apb1enr().modify(|w| w.set_tim5en(true));
    clocks::settle();
    TIM5.psc().write_value(APB1_TIMER_MHZ - 1);
    TIM5.arr().write_value(u32::MAX);
    // Loads the divider, which is buffered until the next update.
    TIM5.egr().write(|w| w.set_ug(true));
    TIM5.cr1().modify(|w| w.set_cen(true));

    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
}

/// Microseconds since the start; wraps after 71 minutes.
#[inline]
pub(crate) fn now_us() -> u32 {
    TIM5.cnt().read()
}

/// Core cycles; wraps after 25 s.
#[inline]
pub(crate) fn cycles() -> u32 {
    cortex_m::peripheral::DWT::cycle_count()
}
