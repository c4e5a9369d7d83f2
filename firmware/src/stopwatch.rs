//! Hardware time: TIM5 as 32 bits of free-running microseconds, and the core's cycle counter for short spans.
//!
//! TIM5 and the trigger timer TIM2 have the same clock, so their ratio is exact. The cycle counter may stand still while the core sleeps,
//! so it is only used for spans without sleep.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::pac::{RCC, TIM5};

use crate::clocks::{self, APB1_TIMER_MHZ};

/// Starts TIM5 and the cycle counter.
pub(crate) fn start() {
    RCC.apb1enr().modify(|w| w.set_tim5en(true));
    clocks::settle();
    TIM5.psc().write_value(APB1_TIMER_MHZ - 1);
    TIM5.arr().write_value(u32::MAX);
    // Loads the divider, which is buffered until the next update.
    TIM5.egr().write(|w| w.set_ug(true));
    TIM5.cr1().modify(|w| w.set_cen(true));

    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
}

/// Microseconds since the start that never wrap: the time stamp of the log. 0 before the start.
///
/// For the thread only, which alone writes the log; a wrap of the 32 bits is counted if it is called once in 71 minutes.
pub(crate) fn log_us() -> u64 {
    static LAST: AtomicU32 = AtomicU32::new(0);
    static WRAPS: AtomicU32 = AtomicU32::new(0);

    // A timer without a clock cannot be read.
    if !RCC.apb1enr().read().tim5en() {
        return 0;
    }
    let now = now_us();
    let wrapped = u32::from(now < LAST.load(Ordering::Relaxed));
    let wraps = WRAPS.load(Ordering::Relaxed).wrapping_add(wrapped);
    LAST.store(now, Ordering::Relaxed);
    WRAPS.store(wraps, Ordering::Relaxed);
    u64::from(wraps) << 32 | u64::from(now)
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
