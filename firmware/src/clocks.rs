//! Starts the board's clocks from HSE ([`firmware::board::ClockTree`]), with a bounded wait, and the flash accelerator, which the HAL leaves off.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use embassy_stm32::Config;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::flash::vals::Latency;
use embassy_stm32::pac::{DBGMCU, FLASH, RCC};
use embassy_stm32::rcc;
use embassy_stm32::time::Hertz;
use firmware::board::{BOARD, ClockTree, Hse};
use firmware::crystal::HseFault;
use wire::BrownOut;

use crate::crystal_timer;
use crate::removed::{Protection, lacks};

const CLOCKS: ClockTree = BOARD.clocks;
const _: () = assert!(CLOCKS.is_exact(), "the timers count microseconds");
const HSE_HZ: u32 = CLOCKS.hse_mhz as u32 * 1_000_000;

/// Clock of the timers on APB1 (TIM2 to TIM5), MHz.
pub(crate) const APB1_TIMER_MHZ: u16 = CLOCKS.apb1_timer_mhz();
/// Clock of the timers on APB2 (TIM1), MHz.
pub(crate) const APB2_TIMER_MHZ: u16 = CLOCKS.apb2_timer_mhz();

/// The registers of the clock as they were after its start.
static STARTED: [AtomicU32; 4] = [const { AtomicU32::new(0) }; 4];

/// The registers that the speed of the timers and the reads of the flash depend on: oscillators, dividers, PLL, wait states. Bits that change by
/// themselves are left out.
fn registers() -> [u32; 4] {
    /// HSEON, HSERDY, CSSON, PLLON, PLLRDY.
    const RUNNING: u32 = 1 << 16 | 1 << 17 | 1 << 19 | 1 << 24 | 1 << 25;
    [RCC.cr().read().0 & RUNNING, RCC.cfgr().read().0, RCC.pllcfgr().read().0, FLASH.acr().read().0]
}

/// Whether the clock is configured as it was started.
pub(crate) fn is_as_started() -> bool {
    registers().iter().zip(&STARTED).all(|(now, started)| *now == started.load(Ordering::Relaxed))
}

/// Registers of 32 interrupts each: lines 0 to 95. Of the line above them, which only the F446 has, the HAL enables nothing (RM0390 table 38).
const INTERRUPT_WORDS: usize = 3;

/// Rounds of the wait for HSE: at least four cycles of the 16 MHz start-up clock each, so no less than 100 ms. Crystals take 2 ms.
const HSE_ROUNDS: u32 = 400_000;

/// Starts HSE and the clocks that are derived from it. A crystal of another frequency is found before anything runs by it: every pulse and every
/// period would be wrong by its ratio.
pub(crate) fn start() -> Result<(), HseFault> {
    // HSE is started here, because the HAL waits for it without a limit and before a watchdog runs.
    RCC.cr().modify(|w| w.set_hsebyp(CLOCKS.hse == Hse::External));
    RCC.cr().modify(|w| w.set_hseon(true));
    if !(0..HSE_ROUNDS).any(|_| RCC.cr().read().hserdy()) {
        return Err(HseFault::NotReady);
    }
    let measured = crystal_timer::measure();
    if !measured.can_be(HSE_HZ) {
        return Err(HseFault::Frequency { measured, nominal_hz: HSE_HZ });
    }

    let mut config = Config::default();
    config.rcc.hse = Some(rcc::Hse {
        freq: Hertz(HSE_HZ),
        mode: match CLOCKS.hse {
            Hse::Crystal => rcc::HseMode::Oscillator,
            Hse::External => rcc::HseMode::Bypass,
        },
    });
    config.rcc.pll_src = rcc::PllSource::HSE;
    config.rcc.pll = Some(rcc::Pll {
        prediv: rcc::PllPreDiv::from_bits(CLOCKS.pll.m),
        mul: rcc::PllMul::from_bits(CLOCKS.pll.n),
        // PLLP 0 to 3 divides by 2, 4, 6, 8.
        divp: Some(rcc::PllPDiv::from_bits(CLOCKS.pll.p / 2 - 1)),
        divq: Some(rcc::PllQDiv::from_bits(CLOCKS.pll.q)),
        divr: None,
    });
    // The HAL waits for LSI without a limit and before a watchdog runs; [`crate::stopwatch`] starts and measures it.
    config.rcc.ls = rcc::LsConfig::off();
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.ahb_pre = rcc::AHBPrescaler::DIV1;
    [config.rcc.apb1_pre, config.rcc.apb2_pre] = CLOCKS.apb.map(bus_divider);
    // The tokens of the peripherals are not used: each driver here owns its registers, see `main.rs`.
    let _ = embassy_stm32::init(config);
    interrupts_off_but_task_clock();

    set_wait_states();
    start_flash_accelerator();
    // From here on a crystal that stops raises the non-maskable interrupt, and breaks TIM1 in hardware.
    RCC.cr().modify(|w| w.set_csson(!lacks(Protection::ClockSecurity)));
    for (register, started) in registers().into_iter().zip(&STARTED) {
        started.store(register, Ordering::Relaxed);
    }
    Ok(())
}

fn bus_divider(divider: u16) -> rcc::APBPrescaler {
    match divider {
        1 => rcc::APBPrescaler::DIV1,
        2 => rcc::APBPrescaler::DIV2,
        4 => rcc::APBPrescaler::DIV4,
        8 => rcc::APBPrescaler::DIV8,
        _ => rcc::APBPrescaler::DIV16,
    }
}

/// Switches every interrupt off but that of the tasks' clock: the HAL enables those of all streams of both DMA controllers, at the highest priority.
/// The control loop enables its own later ([`firmware::interrupts`]).
fn interrupts_off_but_task_clock() {
    // SAFETY: a bit that is written as 1 disables an interrupt, which breaks no critical section; nothing else uses these registers now.
    unsafe {
        let nvic = &*NVIC::PTR;
        nvic.icer.iter().take(INTERRUPT_WORDS).for_each(|register| register.write(u32::MAX));
        interrupt::TIM4.enable();
    }
}

/// Waits until a peripheral clock that was just switched on is running (ES0182, "Delay after an RCC peripheral clock enabling").
pub(crate) fn settle() {
    cortex_m::asm::dsb();
}

/// Sets the wait states for the lowest supply of the board's brown-out level. The HAL sets those for 2.7 V, with which the flash is read up to here.
fn set_wait_states() {
    const { assert!(BOARD.wait_states() as u16 >= (CLOCKS.core_mhz() - 1) / 30, "no fewer than the HAL's") };
    let latency = Latency::from_bits(BOARD.wait_states());
    FLASH.acr().modify(|w| w.set_latency(latency));
    // RM0090 3.5.1: they count once they read back. A register that does not keep them is found by the comparison in each tick.
    let _ = FLASH.acr().read();
}

/// Switches on instruction cache, data cache, and prefetch unless the silicon has an erratum (ES0182: not on revision A of the F407).
///
/// The HAL sets the wait states and leaves these off, which makes the program much slower at 3 to 5 wait states.
fn start_flash_accelerator() {
    // Caches are reset while they are off (RM0090 3.9.1).
    FLASH.acr().modify(|w| {
        w.set_icrst(true);
        w.set_dcrst(true);
    });
    FLASH.acr().modify(|w| {
        w.set_icrst(false);
        w.set_dcrst(false);
    });
    /// Device and revision. Other chips of the family have the revision too, without the erratum.
    const F407_REVISION_A: (u16, u16) = (0x413, 0x1000);
    /// The device id that revision A has instead (ES0182, "MCU device ID is incorrect").
    const WRONG_ID: u16 = 0x411;
    let chip = DBGMCU.idcode().read();
    let prefetch_works = chip.dev_id() != WRONG_ID && (chip.dev_id(), chip.rev_id()) != F407_REVISION_A;
    FLASH.acr().modify(|w| {
        w.set_icen(true);
        w.set_dcen(true);
        w.set_prften(prefetch_works);
    });
}

/// How the brown-out reset gets the level of the board: the firmware does not write option bytes.
pub(crate) const BROWN_OUT_HELP: &str = "`cargo xtask board brown-out` sets it";

/// The brown-out reset in the option bytes, which is off as delivered: then the chip runs on at any supply. Below the level of the board it runs on where
/// its flash is too slow for this clock; above it the board may not start.
pub(crate) fn brown_out() -> BrownOut {
    // BOR_LEV counts from the highest level down, and 3 is off (RM0090 3.9.10).
    BrownOut { level: 3 - FLASH.optcr().read().bor_lev().min(3), wanted: BOARD.brown_out as u8 }
}
