//! Tests of the clock tree: its effect on timers and on the time base.

use stm32f4_model::{SocConfig, Width};

use crate::bench::*;

#[test]
fn starts_on_hsi() {
    // 7.2: HSI 16 MHz is the clock after reset.
    let bench = Bench::new();
    assert_eq!(bench.soc.hclk_hz(), 16_000_000);
    assert_eq!(bench.soc.seconds(16_000_000), 1.0);
}

#[test]
fn time_continues_on_the_pll_at_168_mhz() {
    // 7.3.2: 8 MHz / 4 * 168 / 2.
    let mut bench = Bench::new();
    bench.to(16_000);
    bench.run_at_168_mhz();
    assert_eq!(bench.soc.hclk_hz(), 168_000_000);
    assert_eq!(bench.get(RCC + 8) & 0xC, 8, "SWS follows SW");
    bench.to(16_000 + 168_000);
    assert!((bench.soc.seconds(bench.soc.now()) - 0.002).abs() < 1e-15);
    assert_eq!(bench.soc.cycle_at(0.003), 16_000 + 2 * 168_000);
    assert_eq!(bench.lint_texts(), [] as [String; 0]);
}

#[test]
fn a_failed_crystal_leaves_hsi() {
    let mut bench = Bench::with(SocConfig { hse_ready: false, ..SocConfig::default() });
    bench.run_at_168_mhz();
    assert_eq!(bench.get(RCC) & (1 << 17 | 1 << 25), 0);
    assert_eq!((bench.get(RCC + 8) & 0xC, bench.soc.hclk_hz()), (0, 16_000_000));
}

#[test]
fn hclk_follows_the_crystal_frequency() {
    // Effect of a wrong crystal constant: all frequencies scale by the ratio.
    let mut bench = Bench::with(SocConfig { hse_hz: 16_000_000, ..SocConfig::default() });
    bench.run_at_168_mhz();
    assert_eq!(bench.soc.hclk_hz(), 336_000_000);
    assert!(bench.lint_texts().iter().any(|text| text.contains("HCLK is above its rating")));
}

#[test]
fn timer_clocks_by_bus() {
    // 7.2, figure 16: 84 MHz on APB1 (42 doubled), 168 MHz on APB2 (84 doubled).
    let mut bench = Bench::clocked();
    bench.run_at_168_mhz();
    for timer in [TIM1, TIM2] {
        bench.set(timer + CR1, 1);
    }
    bench.to(1680);
    assert_eq!((bench.get(TIM1 + CNT), bench.get(TIM2 + CNT)), (1680, 840));
}

#[test]
fn every_timer_has_the_clock_of_its_bus() {
    // 2.3, table 1: TIM1 and TIM8 to TIM11 are on APB2.
    let mut bench = Bench::new();
    bench.run_at_168_mhz();
    bench.set(APB1ENR, 0x1FF);
    bench.set(APB2ENR, 0x7_0003);
    let apb1 = (0..9).map(|n| 0x4000_0000 + 0x400 * n);
    let apb2 = [0x4001_0000, 0x4001_0400, 0x4001_4000, 0x4001_4400, 0x4001_4800];
    let timers: Vec<(u32, u32)> = apb1.map(|timer| (timer, 840)).chain(apb2.map(|timer| (timer, 1680))).collect();
    for &(timer, _) in &timers {
        bench.set(timer + CR1, 1);
    }
    bench.to(1680);
    for &(timer, counts) in &timers {
        assert_eq!(bench.get(timer + CNT), counts, "{timer:08X}");
    }
}

#[test]
fn a_clock_change_in_mid_count_keeps_the_count() {
    let mut bench = Bench::clocked();
    bench.set(TIM2 + PSC, 15);
    bench.set(TIM2 + EGR, 1);
    bench.set(TIM2 + CR1, 1);
    bench.to(16_000 + 8);
    // AHB / 2: the timer keeps its 8 prescaler clocks, and now gets one per HCLK cycle as before.
    bench.set(RCC + 8, 8 << 4);
    assert_eq!(bench.soc.hclk_hz(), 8_000_000);
    bench.pass(7);
    assert_eq!(bench.get(TIM2 + CNT), 1000);
    bench.pass(1);
    assert_eq!(bench.get(TIM2 + CNT), 1001);
    // APB1 / 16: the timer gets a clock every 8 HCLK cycles.
    bench.set(RCC + 8, 7 << 10);
    bench.pass(16 * 8 * 10);
    assert_eq!(bench.get(TIM2 + CNT), 1011);
}

#[test]
fn too_few_wait_states_are_recorded() {
    // 3.5.1, table 10: 30 MHz per wait state at 2.7 to 3.6 V.
    let mut bench = Bench::new();
    bench.run_at_168_mhz();
    assert_eq!(bench.lint_texts().len(), 0);
    bench.set(FLASH_ACR, 4);
    assert!(bench.lint_texts()[0].contains("FLASH+0x00 (misuse: HCLK is too fast for the flash wait states"));
}

#[test]
fn enough_wait_states_make_no_lint() {
    // 8 MHz / 4 * 120 / 4 = 60 MHz needs one wait state.
    let mut bench = Bench::new();
    bench.set(FLASH_ACR, 1);
    bench.set(RCC, 0x1_0083);
    bench.set(RCC + 4, 4 | 120 << 6 | 1 << 16 | 1 << 22 | 5 << 24);
    bench.set(RCC, 0x101_0083);
    bench.set(RCC + 8, 2 | 4 << 10);
    assert_eq!((bench.soc.hclk_hz(), bench.lint_texts().len()), (60_000_000, 0));
    bench.set(FLASH_ACR, 0);
    assert_eq!(bench.lint_texts().len(), 1);
}

#[test]
fn clock_ready_interrupt() {
    // 7.3.4, 12.1.3: RCC is IRQ 5.
    let mut bench = Bench::new();
    bench.set(RCC + 0x0C, 1 << 11);
    bench.set(RCC, 0x1_0083);
    assert!(bench.irq(5));
    bench.soc.write(RCC + 0x0C + 2, Width::Byte, 1 << 3);
    assert!(!bench.irq(5), "a byte write to the clear bits");
    assert_eq!(bench.get(RCC + 0x0C), 1 << 11);
}
