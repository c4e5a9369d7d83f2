//! Hardware time: TIM5 as 32 bits of free-running microseconds, and the core's cycle counter for short spans. Channel 4 of TIM5 measures the clock
//! of the watchdog.
//!
//! TIM5 and the trigger timer TIM2 have the same clock, so their ratio is exact. The cycle counter may stand still while the core sleeps,
//! so it is only used for spans without sleep. On a board that stays off, TIM5 wakes the core instead.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt;
use embassy_stm32::pac::rcc::vals::Sw;
use embassy_stm32::pac::timer::regs::{CcerGp16, DierGp16, SrGp16};
use embassy_stm32::pac::timer::vals::CcmrInputCcs;
use embassy_stm32::pac::{RCC, TIM5};
use firmware_shared::oscillator::{EDGES_A_CAPTURE, INTERVALS, TIMEOUT_US, frequency};
use firmware_shared::pacing::since;
use joint_loop::WatchdogHz;

use crate::clocks::{self, APB1_TIMER_MHZ};

/// SEVONPEND of SCR (ARMv7-M ARM, B3.2.7): what becomes pending is an event, which ends a WFE.
const SEVONPEND: u32 = 1 << 4;

/// Clock of TIM5 while the core runs on the oscillator that the chip starts with, MHz.
const START_UP_MHZ: u16 = 16;

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
        // SAFETY: an interrupt that becomes pending, enabled or not, only ends a WFE; every wait here looks again.
        unsafe { core.SCB.scr.modify(|scr| scr | SEVONPEND) };
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
pub(crate) fn now_us() -> u32 {
    TIM5.cnt().read()
}

/// Measures LSI, the clock of the watchdog, by the captures of [`INTERVALS`]; 0 Hz if they do not come in [`TIMEOUT_US`]. It waits for them: 1.1 ms at
/// 32 kHz. The core sleeps in between: a capture or the end of the time becomes pending, which is an event. An interrupt that is longer than an interval
/// begins the measurement again.
pub(crate) fn measure_watchdog_clock() -> WatchdogHz {
    /// Channel 4, counted from 0, and in its half.
    const CHANNEL: usize = 3;
    const IN_HALF: usize = 1;
    /// The channel that compares: at the end of the time.
    const END: usize = 0;
    /// TI4_RMP of TIM5_OR (RM0090 18.4.20): LSI.
    const LSI_TO_CHANNEL_4: u32 = 1 << 6;
    const PRESCALER: u8 = EDGES_A_CAPTURE.ilog2() as u8;

    RCC.csr().modify(|w| w.set_lsion(true));
    TIM5.or().write_value(LSI_TO_CHANNEL_4);
    TIM5.ccmr_input(1).write(|w| {
        w.set_ccs(IN_HALF, CcmrInputCcs::TI4);
        w.set_icpsc(IN_HALF, PRESCALER);
    });
    TIM5.ccer().write(|w| w.set_cce(CHANNEL, true));
    let begun = now_us();
    TIM5.ccr(END).write_value(begun.wrapping_add(TIMEOUT_US));
    // Its flag is that of the last measurement. One that stays would hide the captures from the core.
    let mut clear = SrGp16(u32::MAX);
    clear.set_ccif(END, false);
    TIM5.sr().write_value(clear);
    TIM5.dier().write(|w| [CHANNEL, END].iter().for_each(|&channel| w.set_ccie(channel, true)));
    let (mut first, mut intervals) = (None, 0);
    let mut found = WatchdogHz(0);
    while since(now_us(), begun) < TIMEOUT_US {
        let flags = TIM5.sr().read();
        if !flags.ccif(CHANNEL) {
            // A capture before this instruction is an event too. After the pending state is cleared, the next one is an event again.
            cortex_m::asm::wfe();
            NVIC::unpend(interrupt::TIM5);
            continue;
        }
        // The read clears the flag.
        let at = TIM5.ccr(CHANNEL).read();
        match first {
            Some(first) if !flags.ccof(CHANNEL) => {
                intervals += 1;
                if intervals == INTERVALS {
                    found = frequency(at.wrapping_sub(first));
                    break;
                }
            }
            // The first, or one was lost.
            _ => {
                let mut clear = SrGp16(u32::MAX);
                clear.set_ccof(CHANNEL, false);
                TIM5.sr().write_value(clear);
                (first, intervals) = (Some(at), 0);
            }
        }
    }
    TIM5.ccer().write_value(CcerGp16(0));
    TIM5.dier().write_value(DierGp16(0));
    NVIC::unpend(interrupt::TIM5);
    found
}

/// Core cycles; wraps after 25 s.
pub(crate) fn cycles() -> u32 {
    cortex_m::peripheral::DWT::cycle_count()
}

/// Calls `at` every `step_ms` from now on, with the time in milliseconds, which wraps; sleeps in between. No task runs any more, and there
/// is no time stamp after the first call.
pub(crate) fn sleep_and_wake(step_ms: u16, mut at: impl FnMut(u32)) -> ! {
    // The timer's interrupt wakes the core, its handler does not run.
    cortex_m::interrupt::disable();
    let mhz = if RCC.cfgr().read().sws() == Sw::HSI { START_UP_MHZ } else { APB1_TIMER_MHZ };
    RCC.apb1enr().modify(|w| w.set_tim5en(true));
    clocks::settle();
    TIM5.cr1().modify(|w| w.set_cen(false));
    // A count of 0.1 ms.
    TIM5.psc().write_value(mhz * 100 - 1);
    TIM5.arr().write_value(u32::from(step_ms) * 10 - 1);
    TIM5.egr().write(|w| w.set_ug(true));
    TIM5.sr().modify(|w| w.set_uif(false));
    TIM5.dier().modify(|w| w.set_uie(true));
    // That of the tasks' clock stays pending and would end every sleep at once.
    NVIC::mask(interrupt::TIM4);
    // SAFETY: interrupts are masked, so no critical section is broken.
    unsafe { NVIC::unmask(interrupt::TIM5) };
    TIM5.cr1().modify(|w| w.set_cen(true));
    let mut ms: u32 = 0;
    loop {
        at(ms);
        while !TIM5.sr().read().uif() {
            cortex_m::asm::wfi();
        }
        TIM5.sr().modify(|w| w.set_uif(false));
        NVIC::unpend(interrupt::TIM5);
        ms = ms.wrapping_add(u32::from(step_ms));
    }
}
