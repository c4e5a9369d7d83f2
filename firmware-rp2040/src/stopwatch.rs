//! Hardware time: TIMER as microseconds, and the core's SysTick for short spans.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use embassy_rp::pac::{TIMER, WATCHDOG};
use firmware_rp2040::timing::CORE_MHZ;
use firmware_rp2040::watchdog_time::equivalent;
use firmware_shared::pacing::since;
use joint_loop::WatchdogHz;

/// SysTick counts down 24 bits.
const SYSTICK_MASK: u32 = 0x00FF_FFFF;

/// Time over which the watchdog's counter is measured, us: well below its time-out.
const MEASURED_US: u32 = 1_000;

/// Starts SysTick. TIMER was started with the clocks.
pub(crate) fn start() {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(SYSTICK_MASK);
        core.SYST.clear_current();
        core.SYST.enable_counter();
    }
}

/// Microseconds since the start that never wrap: the time stamp of the log.
pub(crate) fn log_us() -> u64 {
    loop {
        let high = TIMER.timerawh().read();
        let low = TIMER.timerawl().read();
        if TIMER.timerawh().read() == high {
            return u64::from(high) << 32 | u64::from(low);
        }
    }
}

/// Microseconds since the start; wraps after 71 minutes.
pub(crate) fn now_us() -> u32 {
    TIMER.timerawl().read()
}

/// Core cycles; wraps after 21 s. For the ticks only, at least once in 80 ms: SysTick wraps after 84 ms.
pub(crate) fn cycles() -> u32 {
    static TOTAL: AtomicU32 = AtomicU32::new(0);
    // The caller is the only writer.
    let total = TOTAL.load(Ordering::Relaxed);
    let total = total.wrapping_add(counted().wrapping_sub(total) & SYSTICK_MASK);
    TOTAL.store(total, Ordering::Relaxed);
    total
}

/// 24 bits that count up.
fn counted() -> u32 {
    SYSTICK_MASK - (SYST::get_current() & SYSTICK_MASK)
}

/// Measures how fast the watchdog's counter falls, by the core's clock; 0 Hz if it stands still.
pub(crate) fn measure_watchdog_clock() -> WatchdogHz {
    let time = || WATCHDOG.ctrl().read().time();
    let (before, begun) = (time(), counted());
    let cycles = || counted().wrapping_sub(begun) & SYSTICK_MASK;
    while cycles() < MEASURED_US * CORE_MHZ {}
    let (after, passed) = (time(), cycles());
    // A reload in between lets the counter rise: nothing is measured then, and the caller measures again later.
    equivalent(before.saturating_sub(after), passed / CORE_MHZ)
}

/// Calls `at` every `step_ms` from now on, with the time in milliseconds, which wraps. No task runs any more.
pub(crate) fn wait_and_call(step_ms: u16, mut at: impl FnMut(u32)) -> ! {
    let mut ms: u32 = 0;
    let mut last_us = now_us();
    loop {
        at(ms);
        while since(now_us(), last_us) < u32::from(step_ms) * 1_000 {}
        last_us = last_us.wrapping_add(u32::from(step_ms) * 1_000);
        ms = ms.wrapping_add(u32::from(step_ms));
    }
}
