//! Tests of what a caller can break: each has the effect that the manual states.

use stm32f4_model::{FlashChange, ResetCause, SocConfig, Width};

use crate::bench::*;

const FLASH: u32 = 0x4002_3C00;
const ADC_CR2: u32 = ADC1 + 0x08;
const ADC_DR: u32 = ADC1 + 0x4C;
const SWSTART: u32 = 1 << 30;
const EOC: u32 = 1 << 1;
const OVR: u32 = 1 << 5;
const CSR: u32 = RCC + 0x74;
const PWR_CR: u32 = 0x4000_7000;
const PWR_CSR: u32 = 0x4000_7004;

/// ADC1 converts channel 1, with 1.5 V of 3.0 V.
fn adc() -> Bench {
    let mut bench = Bench::clocked();
    bench.plant.volts = Box::new(|_, _| 1.5);
    bench.set(GPIOA, 0xA800_000C);
    bench.set(ADC1 + 0x34, 1);
    bench.set(ADC_CR2, 1);
    bench
}

fn unlock_flash(bench: &mut Bench) {
    bench.set(FLASH + 4, 0x4567_0123);
    bench.set(FLASH + 4, 0xCDEF_89AB);
}

#[test]
fn a_crystal_at_another_frequency_scales_every_timer() {
    // 7.2.1, 7.2.3: the PLL multiplies HSE, and the timers count its output.
    let mut bench = Bench::clocked();
    bench.run_at_168_mhz();
    bench.set(TIM2 + PSC, 83);
    bench.set(TIM2 + EGR, 1);
    bench.set(TIM2 + CR1, 1);
    let from = bench.soc.seconds(bench.soc.now());
    bench.to(bench.soc.cycle_at(from + 0.001));
    assert_eq!(bench.get(TIM2 + CNT), 1000);
    bench.soc.set_hse_hz(8.08e6);
    assert_eq!((bench.soc.hclk_hz(), bench.soc.hse_hz()), (169_680_000, 8.08e6));
    bench.to(bench.soc.cycle_at(from + 0.101));
    assert_eq!(bench.get(TIM2 + CNT), 1000 + 101_000, "1 % more in 100 ms of true time");
}

#[test]
fn a_pll_without_lock_is_slower_or_stops() {
    // 7.3.1: PLLRDY is 0 while it is not locked.
    let mut bench = Bench::clocked();
    bench.run_at_168_mhz();
    bench.soc.set_pll_factor(0.5);
    assert_eq!((bench.soc.hclk_hz(), bench.get(RCC) & 1 << 25), (84_000_000, 0));
    bench.soc.set_pll_factor(0.0);
    assert!(bench.soc.clock_stopped());
    bench.soc.set_pll_factor(1.0);
    assert!(!bench.soc.clock_stopped());
    assert_eq!((bench.soc.hclk_hz(), bench.get(RCC) & 1 << 25), (168_000_000, 1 << 25));
    // A reset selects HSI; the PLL is off.
    bench.soc.set_pll_factor(0.0);
    bench.soc.reset(ResetCause::IndependentWatchdog);
    assert!(!bench.soc.clock_stopped() && bench.soc.hclk_hz() == 16_000_000);
    bench.run_at_168_mhz();
    assert_eq!((bench.soc.hclk_hz(), bench.get(RCC) & 1 << 25), (16_000_000, 0), "it never becomes ready");
}

#[test]
fn a_brown_out_resets_and_holds_until_the_supply_is_back() {
    // 5.2.2, 7.3.21: BORRSTF without PORRSTF; option bytes 3.9.10.
    let mut bench = Bench::with(SocConfig { bor_level: 0, ..SocConfig::default() });
    bench.set(CSR, 1 << 24);
    bench.to(16_000);
    bench.soc.set_supply(2.9);
    assert_eq!((bench.soc.take_reset(), bench.soc.core_waits()), (None, false));
    bench.soc.set_supply(2.7);
    assert_eq!(bench.soc.take_reset(), Some(ResetCause::BrownOut));
    bench.soc.reset(ResetCause::BrownOut);
    assert_eq!(bench.get(CSR) & 0xFF00_0000, 1 << 25 | 1 << 26);
    bench.to(32_000);
    assert!(bench.soc.core_waits());
    bench.soc.set_supply(3.0);
    assert_eq!(bench.soc.next_event(), Some(32_000 + 24_000), "1.5 ms");
    bench.to(32_000 + 23_999);
    assert!(bench.soc.core_waits());
    bench.to(32_000 + 24_000);
    assert!(!bench.soc.core_waits());
    // Off, as delivered: nothing happens above the power-down level.
    let mut off = Bench::new();
    off.soc.set_supply(1.8);
    assert_eq!(off.soc.take_reset(), None);
}

#[test]
fn the_voltage_detector_raises_its_interrupt() {
    // 5.2.3, 12.2.5: PVD is EXTI line 16, IRQ 1.
    let mut bench = Bench::clocked();
    bench.set(PWR_CR, 1 << 4 | 5 << 5);
    bench.set(EXTI, 1 << 16);
    bench.set(EXTI + 8, 1 << 16);
    bench.soc.set_supply(2.9);
    assert_eq!((bench.get(PWR_CSR) & 4, bench.irq(1)), (0, false));
    bench.soc.set_supply(2.8);
    assert_eq!((bench.get(PWR_CSR) & 4, bench.irq(1)), (4, true));
    bench.soc.set_supply(3.0);
    assert_eq!(bench.get(PWR_CSR) & 4, 0);
    assert_eq!(bench.lint_texts(), [] as [String; 0]);
}

#[test]
fn the_reset_pin_resets_and_holds() {
    // 6.1.1: PINRSTF alone.
    let mut bench = Bench::new();
    bench.set(CSR, 1 << 24);
    bench.soc.pull_reset_pin(true);
    assert_eq!(bench.soc.take_reset(), Some(ResetCause::Pin));
    bench.soc.reset(ResetCause::Pin);
    bench.to(16_000);
    assert!(bench.soc.core_waits());
    assert_eq!(bench.get(CSR) & 0xFF00_0000, 1 << 26);
    bench.soc.pull_reset_pin(false);
    assert!(!bench.soc.core_waits());
    bench.soc.cycle_power();
    assert_eq!(bench.soc.take_reset(), Some(ResetCause::PowerOn));
}

#[test]
fn the_core_waits_while_a_sector_is_erased() {
    // 3.6: a fetch waits until the operation has ended. 16 KiB by words: 250 ms.
    let mut bench = Bench::new();
    unlock_flash(&mut bench);
    bench.set(FLASH + 0x10, 1 << 1 | 2 << 3 | 2 << 8 | 1 << 16);
    assert!(bench.soc.core_waits());
    assert_eq!(bench.soc.next_event(), Some(4_000_000));
    bench.to(4_000_000);
    assert!(!bench.soc.core_waits());
    let ended = bench.soc.take_flash_operations();
    assert_eq!(ended.len(), 1);
    assert_eq!((ended[0].address, ended[0].change), (0x0800_8000, FlashChange::Erase { bytes: 0x4000 }));
    assert_eq!((ended[0].done, bench.get(FLASH + 0x0C)), (1.0, 0));
    assert_eq!(bench.lint_texts(), [] as [String; 0]);
}

#[test]
fn a_reset_cuts_the_operation() {
    let mut bench = Bench::new();
    unlock_flash(&mut bench);
    bench.set(FLASH + 0x10, 1 | 2 << 8);
    bench.soc.store_to_flash(0x0800_4000, Width::Word, 0x1234_5678);
    bench.pass(64);
    bench.soc.reset(ResetCause::Pin);
    let cut = bench.soc.take_flash_operations();
    assert!((cut[0].done - 0.25).abs() < 1e-6, "4 of 16 us");
    assert!(!bench.soc.core_waits());
    assert_eq!(bench.get(FLASH + 0x10), 1 << 31);
}

#[test]
fn a_conversion_that_does_not_end_has_no_eoc() {
    // 13.3.5: EOC is set at the end of a conversion.
    let mut bench = adc();
    bench.soc.hold_conversions(0, true);
    bench.set(ADC_CR2, 1 | SWSTART);
    bench.pass(100_000);
    assert_eq!(bench.get(ADC1) & EOC, 0);
    bench.soc.hold_conversions(0, false);
    bench.pass(2);
    assert_eq!((bench.get(ADC1) & EOC, bench.get(ADC_DR)), (EOC, 2048));
}

#[test]
fn stuck_bits_are_in_every_code_also_after_a_reset() {
    let mut bench = adc();
    bench.soc.set_stuck_bits(0, 0x800, 0x00F);
    bench.set(ADC_CR2, 1 | SWSTART);
    bench.pass(1000);
    assert_eq!(bench.get(ADC_DR), 0x00F);
    bench.soc.reset(ResetCause::Pin);
    bench.clock_all();
    bench.set(GPIOA, 0xA800_000C);
    bench.set(ADC1 + 0x34, 1);
    bench.set(ADC_CR2, 1);
    bench.set(ADC_CR2, 1 | SWSTART);
    bench.pass(1000);
    assert_eq!(bench.get(ADC_DR), 0x00F);
}

/// ADC1 converts channel 1 on each TIM2 update, 1000 cycles apart, into a ring of 8 by stream 0 of DMA2: codes 1, 2, 3 ...
fn ring() -> Bench {
    const BUFFER: u32 = 0x2000_0100;
    let mut bench = Bench::clocked();
    bench.plant.volts = Box::new(|_, seconds| (seconds * 16e6 / 1000.0).floor() / 4095.0 * 3.0);
    bench.set(GPIOA, 0xA800_000C);
    let stream = DMA2 + 0x10;
    for (offset, value) in [(4, 8), (8, ADC_DR), (12, BUFFER), (0, 0x2D00), (0, 0x2D01)] {
        bench.set(stream + offset, value);
    }
    bench.set(ADC1 + 0x34, 1);
    bench.set(ADC_CR2, 1 | 1 << 8 | 1 << 9 | 6 << 24 | 1 << 28);
    bench.set(TIM2 + ARR, 999);
    bench.set(TIM2 + CR2, 2 << 4);
    bench.set(TIM2 + CR1, 1);
    bench
}

fn codes(bench: &mut Bench) -> Vec<u32> {
    use stm32f4_model::DmaMemory;
    (0..8).filter_map(|n| bench.ram.read(0x2000_0100 + 2 * n, Width::Half)).collect()
}

#[test]
fn a_stalled_stream_leads_to_an_overrun() {
    // 13.8.1: a result while the request of the last one is not served is an overrun.
    let mut bench = ring();
    bench.to(2_500);
    bench.soc.stall_stream(1, 0, true);
    bench.to(3_500);
    assert_eq!(bench.get(ADC1) & OVR, 0, "one result waits");
    bench.to(4_500);
    assert_eq!(bench.get(ADC1) & OVR, OVR);
    assert_eq!(codes(&mut bench)[..4], [1, 2, 0, 0]);
    // A stall that is shorter than a period is made up for.
    let mut short = ring();
    short.to(2_500);
    short.soc.stall_stream(1, 0, true);
    short.to(3_500);
    short.soc.stall_stream(1, 0, false);
    short.to(3_510);
    assert_eq!(codes(&mut short)[..4], [1, 2, 3, 0], "the request that waits is served at once");
    short.to(4_500);
    assert_eq!(codes(&mut short)[..4], [1, 2, 3, 4]);
}

#[test]
fn a_lost_request_shifts_the_items_without_an_overrun() {
    let mut bench = ring();
    bench.to(2_500);
    bench.soc.lose_next_request(1, 0);
    bench.to(5_500);
    assert_eq!((codes(&mut bench)[..4].to_vec(), bench.get(ADC1) & OVR), (vec![1, 2, 4, 5], 0));
}

#[test]
fn a_disturbance_passes_every_lock_that_a_write_does_not() {
    let mut bench = Bench::clocked();
    // 17.4.18: LOCK 3 with PWM mode 1 and preload on channel 1, and idle levels low.
    bench.set(TIM1 + CCMR1, 0x68);
    bench.set(TIM1 + BDTR, 0x8300);
    // 10.5.5: a stream that is on.
    bench.set(DMA2 + 0x10, 0x2501);
    // 21.3.2: the registers of the watchdog without the key.
    let written = |bench: &mut Bench, addr: u32, mask: u32| {
        let before = bench.get(addr);
        bench.set(addr, before ^ mask);
        bench.get(addr) != before
    };
    let locked = [
        (TIM1 + CCMR1, 1 << 4),
        (TIM1 + CCMR1, 1 << 3),
        (TIM1 + CR2, 1 << 8),
        (TIM1 + CCER, 1 << 1),
        (TIM1 + BDTR, 1 << 12),
        (TIM1 + BDTR, 1 << 8),
        (DMA2 + 0x10, 1 << 13),
        (IWDG + 4, 1),
        (IWDG + 8, 1 << 11),
    ];
    for (addr, mask) in locked {
        assert!(!written(&mut bench, addr, mask), "{addr:#x} is locked");
        let before = bench.get(addr);
        assert!(bench.soc.flip_bits(addr, mask), "{addr:#x}");
        assert_eq!(bench.get(addr), before ^ mask, "{addr:#x}");
        assert!(bench.soc.flip_bits(addr, mask), "{addr:#x}, back");
        assert!(!written(&mut bench, addr, mask), "{addr:#x} is locked again");
    }
    // What the hardware has not got does not change, and that is said.
    assert!(!bench.soc.flip_bits(TIM1 + RCR, 1 << 20));
    assert!(!bench.soc.flip_bits(0x4000_8000, 1), "no peripheral");
}

#[test]
fn a_disturbed_mode_changes_the_output() {
    // 17.3.10: from PWM mode 1 (6) to inactive on match (2) the output stays low after the end of the pulse.
    let mut bench = Bench::clocked();
    bench.set(GPIOA, 0xA800_0000 | 2 << 16);
    bench.set(GPIOA + 0x24, 1);
    bench.set(TIM1 + ARR, 999);
    bench.set(TIM1 + CCR1, 500);
    bench.set(TIM1 + CCMR1, 0x68);
    bench.set(TIM1 + CCER, 1);
    bench.set(TIM1 + BDTR, 0x8300);
    bench.set(TIM1 + EGR, 1);
    bench.set(TIM1 + CR1, 1);
    let edges = |bench: &mut Bench| {
        let before = bench.plant.edges.len();
        let now = bench.soc.now();
        bench.to(now + 10_000);
        bench.plant.edges.len() - before
    };
    assert!(edges(&mut bench) >= 18);
    assert!(bench.soc.flip_bits(TIM1 + CCMR1, 1 << 6));
    assert!(edges(&mut bench) <= 1);
}
