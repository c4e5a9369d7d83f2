//! Tests of the independent watchdog and of the effects of a reset.

use stm32f4_model::{ResetCause, SocConfig};

use crate::bench::*;

const KR: u32 = IWDG;
const PR: u32 = IWDG + 4;
const RLR: u32 = IWDG + 8;
const CSR: u32 = RCC + 0x74;

fn started(lsi_hz: f64, pr: u32, rlr: u32) -> Bench {
    let mut bench = Bench::with(SocConfig { lsi_hz, ..SocConfig::default() });
    bench.set(KR, 0x5555);
    bench.set(PR, pr);
    bench.set(RLR, rlr);
    bench.set(KR, 0xCCCC);
    bench
}

#[test]
fn requests_a_reset_after_its_timeout() {
    // 21.3.2, table 107: (RLR + 1) * 4 * 2^PR / LSI; over the range of LSI.
    for lsi in [17_000.0, 32_000.0, 47_000.0] {
        let mut bench = started(lsi, 4, 19);
        let timeout = (20.0 * 64.0 / lsi * 16e6_f64).ceil() as u64;
        assert_eq!(bench.soc.next_event(), Some(timeout));
        bench.to(timeout - 1);
        assert_eq!(bench.soc.take_reset(), None);
        bench.to(timeout + 1_000_000);
        assert_eq!(bench.soc.now(), timeout, "the advance stops at the timeout");
        assert_eq!(bench.soc.take_reset(), Some(ResetCause::IndependentWatchdog));
        assert_eq!(bench.soc.take_reset(), None);
    }
}

#[test]
fn reloading_prevents_the_timeout() {
    let mut bench = started(32_000.0, 0, 0xFFF);
    for step in 1..=100 {
        bench.to(step * 8_000_000);
        assert_eq!(bench.soc.take_reset(), None);
        bench.set(KR, 0xAAAA);
    }
    bench.pass(10_000_000);
    assert_eq!(bench.soc.take_reset(), Some(ResetCause::IndependentWatchdog));
}

#[test]
fn a_faster_core_does_not_change_the_timeout() {
    // 21.2: clocked by LSI alone.
    let mut bench = started(32_000.0, 0, 0xFFF);
    bench.to(1_600_000);
    bench.run_at_168_mhz();
    bench.to(u64::MAX);
    assert_eq!(bench.soc.take_reset(), Some(ResetCause::IndependentWatchdog));
    assert!((bench.soc.seconds(bench.soc.now()) - 0.512).abs() < 1e-8);
}

#[test]
fn a_reset_stops_it_and_sets_its_flag() {
    // 6.1.1, 7.3.21; 21.3.3: only a reset stops it.
    let mut bench = started(32_000.0, 0, 0xFFF);
    bench.set(CSR, 1 << 24);
    bench.to(u64::MAX);
    let cause = bench.soc.take_reset();
    assert_eq!(cause, Some(ResetCause::IndependentWatchdog));
    bench.soc.reset(ResetCause::IndependentWatchdog);
    assert_eq!(bench.get(CSR), 1 << 29 | 1 << 26);
    assert_eq!(bench.soc.next_event(), None);
    bench.pass(160_000_000);
    assert_eq!(bench.soc.take_reset(), None);
    bench.set(CSR, 1 << 24);
    assert_eq!(bench.get(CSR), 0);
}

#[test]
fn only_a_power_on_resets_debug_and_backup_registers() {
    // 6.1.1, 6.1.3, 38.16.3.
    let (debug, bdcr) = (0xE004_2004, RCC + 0x70);
    let mut bench = Bench::clocked();
    bench.set(0x4000_7000, 1 << 8);
    bench.set(bdcr, 0x8100);
    bench.set(debug, 7);
    for cause in [ResetCause::Software, ResetCause::Pin, ResetCause::IndependentWatchdog] {
        bench.soc.reset(cause);
        assert_eq!((bench.get(debug), bench.get(bdcr)), (7, 0x8100), "{cause}");
    }
    bench.soc.reset(ResetCause::PowerOn);
    assert_eq!((bench.get(debug), bench.get(bdcr), bench.get(CSR)), (0, 0, 0x0E00_0000));
}

#[test]
fn a_reset_resets_all_blocks() {
    let mut bench = Bench::clocked();
    bench.run_at_168_mhz();
    bench.set(GPIOD, 1 << 24);
    bench.set(GPIOD + 0x14, 1 << 12);
    bench.set(TIM2 + DIER, 1);
    bench.set(TIM2 + EGR, 1);
    bench.to(1_680_000);
    assert!(bench.irq(28));
    bench.soc.reset(ResetCause::Software);
    assert_eq!(bench.soc.now(), 1_680_000);
    assert_eq!(bench.soc.hclk_hz(), 16_000_000);
    assert_eq!(bench.soc.irq_lines(), &[0; 3]);
    assert!(!bench.soc.output_level(pin("PD12")));
    bench.to(1_680_001);
    assert_eq!(bench.edges_of("PD12"), [(true, 0.0), (false, 0.01)]);
    assert_eq!(bench.get(TIM2 + DIER), 0);
    assert!(bench.lint_texts().last().is_some_and(|text| text.contains("TIM2+0x0C (its clock is off)")));
    bench.clock_all();
    assert_eq!((bench.get(TIM2 + DIER), bench.get(GPIOD)), (0, 0));
    assert_eq!(bench.get(CSR), 0x1E00_0000);
}

#[test]
fn a_halted_core_stops_what_the_freeze_bits_name() {
    // 38.16.2, 38.16.4, 38.16.5.
    let apb1_freeze = 0xE004_2008;
    for (bits, counts, resets) in [(0, true, true), (1, false, true), (1 << 12, true, false)] {
        let mut bench = Bench::clocked();
        bench.set(IWDG, 0xCCCC);
        bench.set(TIM2 + CR1, 1);
        bench.set(apb1_freeze, bits);
        bench.pass(16_000);
        let before = bench.get(TIM2 + CNT);
        bench.soc.halt();
        bench.pass(16_000);
        assert_eq!(bench.get(TIM2 + CNT) > before, counts, "{bits:#x}");
        bench.to(160_000_000);
        assert_eq!(bench.soc.take_reset().is_some(), resets, "{bits:#x}");
    }
}

#[test]
fn after_a_halt_what_was_frozen_goes_on_from_where_it_stood() {
    // 38.16.2: the counters are stopped while the core is halted. IWDG after its reset: 512 ms at 32 kHz.
    let apb1_freeze = 0xE004_2008;
    for (bits, timer_stands, resets_after_s) in [(1, true, 0.512), (1 | 1 << 12, true, 0.812), (1 << 12, false, 0.812)]
    {
        let mut bench = Bench::clocked();
        bench.set(IWDG, 0xCCCC);
        bench.set(TIM2 + CR1, 1);
        bench.set(apb1_freeze, bits);
        let after = |bench: &Bench, seconds: f64| bench.soc.cycle_at(seconds);
        let halt = after(&bench, 0.1);
        bench.to(halt);
        bench.soc.halt();
        let before = bench.get(TIM2 + CNT);
        let end = after(&bench, 0.4);
        bench.to(end);
        bench.soc.resume();
        assert_eq!(bench.get(TIM2 + CNT) == before, timer_stands, "{bits:#x}");
        let at = bench.get(TIM2 + CNT);
        bench.pass(16_000);
        assert!(bench.get(TIM2 + CNT) > at, "{bits:#x}: it counts again");
        let early = after(&bench, resets_after_s - 0.002);
        bench.to(early);
        assert_eq!(bench.soc.take_reset(), None, "{bits:#x}");
        let late = after(&bench, resets_after_s + 0.002);
        bench.to(late);
        assert!(bench.soc.take_reset().is_some(), "{bits:#x}");
    }
}
