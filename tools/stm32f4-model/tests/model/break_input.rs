//! Tests of the break: a level at BKIN or a failed crystal disables the outputs without the program.

use stm32f4_model::SocConfig;

use crate::bench::*;

const MOE: u32 = 1 << 15;
const AOE: u32 = 1 << 14;
const BKP: u32 = 1 << 13;
const BKE: u32 = 1 << 12;
const BIF: u32 = 1 << 7;

/// TIM1 channel 1 at 50 % of 1000 clocks on PA8, BKIN on a pin, 16 MHz; started.
fn driven(bdtr: u32, bkin: &str, inputs: &[(f64, bool)]) -> Bench {
    let mut bench = Bench::clocked();
    bench.plant.inputs = inputs.iter().map(|&(at, level)| (at, pin(bkin), level)).collect();
    bench.function(bkin, 2, 1);
    bench.function("PA8", 2, 1);
    bench.set(TIM1 + ARR, 999);
    bench.set(TIM1 + CCR1, 500);
    bench.set(TIM1 + CCMR1, 0x60);
    bench.set(TIM1 + CCER, 1);
    bench.set(TIM1 + CR1, 1);
    bench.to(0);
    bench.set(TIM1 + BDTR, bdtr);
    bench
}

#[test]
fn a_break_clears_moe_sets_bif_and_drops_the_pin_at_once() {
    // 17.3.12.
    for bkin in ["PB12", "PA6"] {
        let mut bench = driven(MOE | BKE | BKP, bkin, &[(80e-6, true)]);
        bench.set(TIM1 + DIER, 1 << 7);
        let at = 16 * 80;
        bench.to(at - 1);
        assert_eq!(bench.get(TIM1 + BDTR) & MOE, MOE);
        bench.to(at);
        assert_eq!((bench.get(TIM1 + BDTR) & MOE, bench.get(TIM1 + SR) & BIF), (0, BIF), "{bkin}");
        assert!(bench.irq(24));
        let last = bench.edges_of("PA8").pop();
        assert_eq!(last, Some((false, 80e-6)), "{bkin}: high from 62.5 us, low at the break");
        bench.to(100_000);
        assert_eq!(bench.edges_of("PA8").pop(), last, "and no further change");
    }
}

#[test]
fn an_active_low_break() {
    // 17.4.18: BKP = 0 is active low.
    let mut bench = driven(BKE, "PB12", &[(0.0, true), (100e-6, false)]);
    bench.set(TIM1 + BDTR, MOE | BKE);
    assert_eq!(bench.get(TIM1 + BDTR) & MOE, MOE);
    bench.to(1600);
    assert_eq!(bench.get(TIM1 + BDTR) & MOE, 0);
}

#[test]
fn moe_and_bif_cannot_change_while_the_break_is_active() {
    // 17.3.12: the break acts on the level.
    let mut bench = driven(MOE | BKE | BKP, "PB12", &[(100e-6, true), (200e-6, false)]);
    bench.to(2000);
    bench.set(TIM1 + SR, 0);
    assert_eq!(bench.get(TIM1 + SR) & BIF, BIF);
    bench.set(TIM1 + BDTR, MOE | BKE | BKP);
    assert_eq!(bench.get(TIM1 + BDTR) & MOE, 0);
    bench.to(3200);
    bench.set(TIM1 + SR, 0);
    assert_eq!(bench.get(TIM1 + SR) & BIF, 0);
    bench.set(TIM1 + BDTR, MOE | BKE | BKP);
    assert_eq!(bench.get(TIM1 + BDTR) & MOE, MOE);
}

#[test]
fn without_aoe_the_outputs_stay_off_after_the_break() {
    let mut bench = driven(MOE | BKE | BKP, "PB12", &[(100e-6, true), (101e-6, false)]);
    bench.to(16_000);
    assert_eq!(bench.get(TIM1 + BDTR) & MOE, 0);
    assert!(!bench.soc.output_level(pin("PA8")));
}

#[test]
fn with_aoe_the_outputs_return_at_the_next_update() {
    // 17.4.18: AOE sets MOE at the update, if the break is not active.
    let mut bench = driven(MOE | AOE | BKE | BKP, "PB12", &[(70e-6, true), (130e-6, false)]);
    bench.to(2999);
    assert_eq!(bench.get(TIM1 + BDTR) & MOE, 0, "the updates at 1000 and 2000 lie before and in the break");
    bench.to(3000);
    assert_eq!(bench.get(TIM1 + BDTR) & MOE, MOE);
    assert_eq!(bench.edges_of("PA8").pop(), Some((true, 3000.0 / 16e6)));
}

#[test]
fn without_bke_the_pin_does_nothing() {
    let mut bench = driven(MOE | BKP, "PB12", &[(100e-6, true)]);
    bench.to(16_000);
    assert_eq!((bench.get(TIM1 + BDTR) & MOE, bench.get(TIM1 + SR) & BIF), (MOE, 0));
}

#[test]
fn a_pin_in_another_function_is_no_break() {
    let mut bench = driven(MOE | BKE | BKP, "PB12", &[(100e-6, true)]);
    bench.function("PB12", 0, 1);
    bench.to(16_000);
    assert_eq!(bench.get(TIM1 + BDTR) & MOE, MOE);
    bench.set(TIM1 + BDTR, MOE | BKE | BKP);
    assert!(bench.lint_texts().iter().any(|text| text.contains("no pin is connected to BKIN")));
}

#[test]
fn tim8_has_its_own_break() {
    // 17.3.12; BKIN of TIM8 is PA6 on AF3, IRQ 43.
    let tim8 = 0x4001_0400;
    let mut bench = Bench::clocked();
    bench.plant.inputs = vec![(80e-6, pin("PA6"), true)];
    bench.function("PA6", 2, 3);
    bench.function("PC6", 2, 3);
    bench.set(tim8 + CCMR1, 0x50);
    bench.set(tim8 + CCER, 1);
    bench.set(tim8 + DIER, 1 << 7);
    bench.set(tim8 + BDTR, MOE | BKE | BKP);
    bench.to(1279);
    assert!(bench.soc.output_level(pin("PC6")) && !bench.irq(43));
    bench.to(1280);
    assert!(!bench.soc.output_level(pin("PC6")) && bench.irq(43));
}

#[test]
fn software_break() {
    // 17.4.6: EGR.BG clears MOE and sets BIF.
    let mut bench = driven(MOE, "PB12", &[]);
    bench.set(TIM1 + EGR, 1 << 7);
    assert_eq!((bench.get(TIM1 + BDTR) & MOE, bench.get(TIM1 + SR) & BIF), (0, BIF));
    bench.set(TIM1 + SR, !BIF);
    assert_eq!(bench.get(TIM1 + SR) & BIF, 0);
}

#[test]
fn a_failed_crystal_breaks_and_raises_nmi() {
    // 7.2.7 and 17.3.12: the clock security system feeds the break, which needs BKE.
    for (bke, moe_after) in [(BKE, 0), (0, MOE)] {
        let mut bench = Bench::clocked();
        bench.run_at_168_mhz();
        bench.set(RCC, 0x109_0083);
        bench.function("PB12", 2, 1);
        bench.to(0);
        bench.set(TIM1 + BDTR, MOE | bke | BKP);
        bench.to(1_680_000);
        bench.soc.fail_hse();
        assert!(bench.soc.nmi_line());
        assert_eq!(bench.soc.hclk_hz(), 16_000_000);
        assert_eq!(bench.get(TIM1 + BDTR) & MOE, moe_after);
        // Time continues at the new clock.
        bench.pass(16_000);
        assert!((bench.soc.seconds(bench.soc.now()) - 0.011).abs() < 1e-12);
        // CSSC clears the flag, and with it the break.
        bench.set(RCC + 0x0C, 1 << 23);
        assert!(!bench.soc.nmi_line());
        bench.set(TIM1 + BDTR, MOE | bke | BKP);
        assert_eq!(bench.get(TIM1 + BDTR) & MOE, MOE);
    }
}

#[test]
fn without_clock_security_only_the_watchdog_runs() {
    let mut bench = Bench::with(SocConfig::default());
    bench.clock_all();
    bench.run_at_168_mhz();
    bench.set(TIM2 + CR1, 1);
    bench.set(IWDG, 0xCCCC);
    bench.to(1000);
    bench.soc.fail_hse();
    assert!(bench.soc.clock_stopped() && !bench.soc.nmi_line());
    bench.to(168_000_000);
    assert_eq!(bench.soc.take_reset(), Some(stm32f4_model::ResetCause::IndependentWatchdog));
    assert!((bench.soc.seconds(bench.soc.now()) - 0.512).abs() < 1e-8);
    assert_eq!(bench.get(TIM2 + CNT), 500, "the timer is stopped");
    bench.soc.reset(stm32f4_model::ResetCause::IndependentWatchdog);
    assert!(!bench.soc.clock_stopped());
    bench.set(RCC, 0x1_0083);
    assert_eq!(bench.get(RCC) & 1 << 17, 0, "the crystal stays off");
}
