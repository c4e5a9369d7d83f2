//! Tests of what differs in the STM32F411 (RM0383): its blocks, clocks, wait states, scale of the regulator, temperature channel, flash, identity.

use stm32f4_model::{LintKind, SocConfig};

use crate::bench::*;

const PWR_CR: u32 = 0x4000_7000;
const FLASH_CR: u32 = 0x4002_3C10;
const FLASH_KEYR: u32 = 0x4002_3C04;
const PLL_FROM_HSE: u32 = 1 << 22;
const SCALE_1: u32 = 3 << 14;
const SCALE_2: u32 = 2 << 14;

fn pill() -> Bench {
    Bench::with(SocConfig::black_pill())
}

/// 25 MHz / 25 * N / P, APB1 / 2, APB2 / 1, with these wait states and this scale of the regulator.
fn run_divided(bench: &mut Bench, (n, p): (u32, u32), wait_states: u32, scale: u32) {
    bench.set(APB1ENR, 1 << 28);
    bench.set(PWR_CR, scale);
    bench.set(RCC, 0x1_0083);
    bench.set(RCC + 4, 25 | n << 6 | (p / 2 - 1) << 16 | PLL_FROM_HSE | 5 << 24);
    bench.set(RCC, 0x101_0083);
    bench.set(FLASH_ACR, wait_states);
    bench.set(RCC + 8, 2 | 4 << 10);
}

/// The same with P = 2.
fn run_at(bench: &mut Bench, n: u32, wait_states: u32, scale: u32) {
    run_divided(bench, (n, 2), wait_states, scale);
}

fn lints(bench: &Bench) -> String {
    bench.lint_texts().join("\n")
}

#[test]
fn a_crystal_of_25_mhz_makes_100_mhz_without_a_lint() {
    // 6.3.2: 25 MHz / 25 * 200 / 2. 6.2: timers run at twice PCLK1, and at PCLK2 undivided.
    let mut bench = pill();
    run_at(&mut bench, 200, 3, SCALE_1);
    assert_eq!((bench.soc.hclk_hz(), lints(&bench).as_str()), (100_000_000, ""));
    bench.set(APB1ENR, 1 << 28 | 1);
    bench.set(APB2ENR, 1);
    for timer in [TIM1, TIM2] {
        bench.set(timer + CR1, 1);
    }
    bench.pass(1000);
    assert_eq!([TIM1, TIM2].map(|timer| bench.get(timer + CNT)), [1000, 1000]);
}

#[test]
fn a_clock_above_the_rating_is_recorded() {
    // Data sheet, "General operating conditions": 100 MHz. The F407 allows 104.
    let mut bench = pill();
    run_at(&mut bench, 208, 4, SCALE_1);
    assert!(lints(&bench).contains("HCLK is above its rating of 100 MHz"), "{}", lints(&bench));
    // PCLK1 of 100 MHz is above 50 MHz, PCLK2 of 100 MHz is allowed.
    let mut bench = pill();
    run_at(&mut bench, 200, 3, SCALE_1);
    bench.set(RCC + 8, 2);
    assert!(lints(&bench).contains("PCLK1 is above its rating of 50 MHz"), "{}", lints(&bench));
    assert_eq!(bench.lint_texts().len(), 1);
}

#[test]
fn the_regulator_must_have_the_scale_of_the_clock() {
    // 5.4.1: scale 1 up to 100 MHz, 2 (after a reset) up to 84, 3 up to 64.
    for (n, scale, is_allowed) in
        [(200, SCALE_1, true), (200, SCALE_2, false), (168, SCALE_2, true), (168, 1 << 14, false), (128, 1 << 14, true)]
    {
        let mut bench = pill();
        run_at(&mut bench, n, 3, scale);
        let said = lints(&bench);
        assert_eq!(said.contains("at the scale of the regulator"), !is_allowed, "N {n}, {scale:#x}: {said}");
    }
    // 5.4.1: it can only be modified while the PLL is off.
    let mut bench = pill();
    run_at(&mut bench, 168, 3, SCALE_2);
    assert_eq!(lints(&bench), "");
    bench.set(PWR_CR, SCALE_1);
    assert!(lints(&bench).contains("VOS can only be written while the PLL is off"), "{}", lints(&bench));
    assert_eq!(bench.get(PWR_CR), SCALE_2);
}

#[test]
fn each_number_of_wait_states_has_its_clock() {
    // 3.4.1 at 2.7 to 3.6 V: 30, 64, 90, 100 MHz.
    for (mhz, enough) in [(30, 0), (31, 1), (64, 1), (65, 2), (90, 2), (91, 3), (100, 3)] {
        for wait_states in 0..=3 {
            let mut bench = pill();
            run_divided(&mut bench, (4 * mhz, 4), wait_states, SCALE_1);
            assert_eq!(bench.soc.hclk_hz(), mhz * 1_000_000);
            let is_short = lints(&bench).contains("30, 64, 90, 100 MHz for 0 to 3 wait states");
            assert_eq!(is_short, wait_states < enough, "{mhz} MHz, {wait_states}: {}", lints(&bench));
        }
    }
}

#[test]
fn blocks_that_the_chip_lacks_are_not_modelled() {
    // 2.3: no TIM6, TIM7, TIM8, TIM12 to TIM14, ADC2, ADC3, DAC, CAN, USART3, GPIOF, GPIOG, GPIOI.
    for addr in [
        TIM6,
        0x4000_1400,
        0x4001_0400,
        0x4000_1800,
        0x4000_1C00,
        0x4000_2000,
        0x4001_2100,
        0x4001_2200,
        0x4000_7400,
        0x4000_6400,
        0x4000_4800,
        0x4002_1400,
        0x4002_1800,
        0x4002_2000,
    ] {
        let mut bench = pill();
        bench.set(AHB1ENR, u32::MAX);
        bench.set(APB1ENR, u32::MAX);
        bench.set(APB2ENR, u32::MAX);
        let before = bench.soc.lints().len();
        assert_eq!(bench.get(addr), 0);
        let kinds: Vec<LintKind> = bench.soc.lints()[before..].iter().map(|lint| lint.kind).collect();
        assert_eq!(kinds, [LintKind::Unmodelled], "{addr:#010x}");
    }
    // 6.3: their enable bits are reserved.
    let mut bench = pill();
    bench.set(APB1ENR, 1 << 4);
    assert_eq!(bench.get(APB1ENR), 0);
    assert!(lints(&bench).contains("reserved bits of an RCC register"), "{}", lints(&bench));
}

#[test]
fn the_temperature_is_on_the_channel_of_vbat() {
    // 11.9: ADC1_IN18; 11.10: with VBATE the channel has a quarter of VBAT.
    let code = |channel: u32, common: u32| {
        let mut bench = pill();
        bench.set(APB2ENR, 1 << 8);
        bench.set(ADC_CCR, common);
        bench.set(ADC1 + 0x0C, 7 << 24 | 7 << 18);
        bench.set(ADC1 + 0x34, channel);
        bench.set(ADC1 + 8, 1);
        bench.pass(100);
        bench.set(ADC1 + 8, 1 | 1 << 30);
        bench.pass(20_000);
        f64::from(bench.get(ADC1 + 0x4C)) * 3.3 / 4095.0
    };
    let (sensor, battery) = (1 << 23, 1 << 22);
    assert!((code(18, sensor) - 0.76).abs() < 0.001 && code(16, sensor) == 0.0);
    assert!((code(18, sensor | battery) - 3.3 / 4.0).abs() < 0.001);
}

#[test]
fn identity_and_size_of_the_flash() {
    // 23.6.1, 24.2.
    let mut bench = pill();
    assert_eq!(bench.get(0xE004_2000) & 0xFFF, 0x431);
    assert_eq!(bench.get(0x1FFF_7A20) >> 16, 512);
    assert_eq!(bench.lint_texts().len(), 0);
}

#[test]
fn sector_8_does_not_exist() {
    // 3.3: sectors 0 to 7.
    for (sector, lints_wanted) in [(7, 0), (8, 1)] {
        let mut bench = pill();
        bench.set(FLASH_KEYR, 0x4567_0123);
        bench.set(FLASH_KEYR, 0xCDEF_89AB);
        bench.set(FLASH_CR, 1 << 1 | sector << 3 | 2 << 8 | 1 << 16);
        assert_eq!(bench.lint_texts().len(), lints_wanted, "sector {sector}: {}", lints(&bench));
    }
}

#[test]
fn an_open_pin_has_the_level_of_its_pull_up() {
    let mut bench = pill();
    bench.plant.open = vec![pin("PA0")];
    bench.set(AHB1ENR, 1);
    bench.to(0);
    let level = |bench: &mut Bench| bench.get(GPIOA + 0x10) & 1;
    assert_eq!(level(&mut bench), 0);
    bench.set(GPIOA + 0x0C, 1);
    assert_eq!(level(&mut bench), 1);
    // 8.4.4: 2 is the pull-down.
    bench.set(GPIOA + 0x0C, 2);
    assert_eq!(level(&mut bench), 0);
}
