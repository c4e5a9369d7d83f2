//! Tests of timers: counting, update events, flags, preload, trigger output.

use crate::bench::*;

const CEN: u32 = 1;
const ARPE: u32 = 1 << 7;
const URS: u32 = 1 << 2;
const UDIS: u32 = 1 << 1;
const OPM: u32 = 1 << 3;

/// TIM2 with a period of `arr + 1` counts of `psc + 1` clocks; flags cleared; not started. Clock 16 MHz.
fn tim2(psc: u32, arr: u32) -> Bench {
    let mut bench = Bench::clocked();
    bench.set(TIM2 + PSC, psc);
    bench.set(TIM2 + ARR, arr);
    bench.set(TIM2 + EGR, 1);
    bench.set(TIM2 + SR, 0);
    bench
}

#[test]
fn update_interrupt_comes_every_period() {
    // 18.3.1: (PSC + 1) * (ARR + 1) timer clocks from CEN to the first overflow.
    let mut bench = tim2(15, 999);
    bench.set(TIM2 + DIER, 1);
    bench.set(TIM2 + CR1, CEN);
    assert_eq!(bench.soc.next_event(), Some(16_000));
    bench.to(15_999);
    assert!(!bench.irq(28));
    assert_eq!(bench.get(TIM2 + CNT), 999);
    bench.to(16_000);
    assert!(bench.irq(28));
    assert_eq!((bench.get(TIM2 + SR), bench.get(TIM2 + CNT)), (1 | 0x1E, 0), "CCRx = 0 matches at the wrap");
    bench.set(TIM2 + SR, !1);
    assert!(!bench.irq(28));
    assert_eq!(bench.get(TIM2 + SR), 0x1E, "only the bits written 0 are cleared");
    assert_eq!(bench.soc.next_event(), Some(32_000));
}

#[test]
fn a_timer_without_used_signals_makes_no_events_but_counts() {
    let mut bench = tim2(3, 99);
    bench.set(TIM2 + CR1, CEN);
    assert_eq!(bench.soc.next_event(), None);
    // A virtual hour in one step: 57.6e9 cycles, /4 is 14.4e9 counts, a whole number of periods, and 42 counts.
    bench.to(16_000_000 * 3600 + 42 * 4 + 3);
    assert_eq!(bench.get(TIM2 + CNT), 42);
    assert_eq!(bench.get(TIM2 + SR) & 1, 1);
}

#[test]
fn the_prescaler_takes_effect_at_the_update() {
    // 18.4.11: PSC is always buffered.
    let mut bench = tim2(0, 99);
    bench.set(TIM2 + CR1, CEN);
    bench.to(50);
    bench.set(TIM2 + PSC, 9);
    assert_eq!(bench.get(TIM2 + PSC), 9);
    bench.to(99);
    assert_eq!(bench.get(TIM2 + CNT), 99);
    bench.to(100 + 35);
    assert_eq!(bench.get(TIM2 + CNT), 3);
}

#[test]
fn the_auto_reload_value_is_preloaded_with_arpe_only() {
    // 18.3.2, figures 137 and 138.
    let mut bench = tim2(0, 99);
    bench.set(TIM2 + CR1, CEN | ARPE);
    bench.to(20);
    bench.set(TIM2 + ARR, 49);
    bench.to(60);
    assert_eq!(bench.get(TIM2 + CNT), 60, "the old period is completed");
    bench.to(100 + 50 + 7);
    assert_eq!(bench.get(TIM2 + CNT), 7, "then the new one applies");

    let mut bench = tim2(0, 99);
    bench.set(TIM2 + CR1, CEN);
    bench.to(20);
    bench.set(TIM2 + ARR, 49);
    bench.to(57);
    assert_eq!(bench.get(TIM2 + CNT), 7, "without preload at once");
}

#[test]
fn a_shorter_period_below_the_count_is_missed() {
    // 18.3.2 without preload: only equality with ARR ends the period, so that TIM3 continues to 0xFFFF.
    let mut bench = Bench::clocked();
    bench.set(TIM3 + ARR, 99);
    bench.set(TIM3 + CR1, CEN);
    bench.to(80);
    bench.set(TIM3 + ARR, 49);
    bench.to(0xFFFF);
    assert_eq!(bench.get(TIM3 + CNT), 0xFFFF);
    bench.to(0x1_0000 + 10);
    assert_eq!(bench.get(TIM3 + CNT), 10);
}

#[test]
fn ug_restarts_and_sets_the_flag_unless_urs() {
    // 18.4.1: URS limits the flag to overflows; 18.4.6: UG restarts counter and prescaler.
    let mut bench = tim2(0, 999);
    bench.set(TIM2 + DIER, 1);
    bench.set(TIM2 + CR1, CEN | URS);
    bench.to(500);
    bench.set(TIM2 + EGR, 1);
    assert_eq!((bench.get(TIM2 + CNT), bench.get(TIM2 + SR)), (0, 0));
    bench.set(TIM2 + CR1, CEN);
    bench.set(TIM2 + EGR, 1);
    assert_eq!(bench.get(TIM2 + SR), 1);
    assert!(bench.irq(28));
    bench.set(TIM2 + SR, 0);
    bench.set(TIM2 + CR1, CEN | URS);
    bench.to(1500);
    assert!(bench.irq(28), "an overflow sets the flag with URS too");
}

#[test]
fn udis_prevents_updates() {
    // 18.4.1: no update event, shadow registers keep their values; UG still restarts the counter.
    let mut bench = tim2(0, 99);
    bench.set(TIM2 + CR1, CEN | UDIS | ARPE);
    bench.set(TIM2 + ARR, 199);
    bench.to(350);
    assert_eq!((bench.get(TIM2 + CNT), bench.get(TIM2 + SR) & 1), (50, 0));
    bench.set(TIM2 + EGR, 1);
    assert_eq!((bench.get(TIM2 + CNT), bench.get(TIM2 + SR) & 1), (0, 0));
    bench.to(350 + 120);
    assert_eq!(bench.get(TIM2 + CNT), 20);
}

#[test]
fn one_pulse_stops_at_the_update() {
    // 18.4.1: OPM clears CEN at the next update event.
    let mut bench = tim2(0, 99);
    bench.set(TIM2 + CR1, CEN | OPM);
    bench.to(1000);
    assert_eq!((bench.get(TIM2 + CR1), bench.get(TIM2 + CNT), bench.get(TIM2 + SR) & 1), (OPM, 0, 1));
}

#[test]
fn the_repetition_counter_divides_updates() {
    // 17.3.3: an update every RCR + 1 overflows.
    let mut bench = Bench::clocked();
    bench.set(TIM1 + ARR, 99);
    bench.set(TIM1 + RCR, 2);
    bench.set(TIM1 + EGR, 1);
    bench.set(TIM1 + SR, 0);
    bench.set(TIM1 + DIER, 1);
    bench.set(TIM1 + CR1, CEN);
    bench.to(299);
    assert!(!bench.irq(25));
    bench.to(300);
    assert!(bench.irq(25));
    bench.set(TIM1 + SR, 0);
    bench.to(599);
    assert!(!bench.irq(25));
    bench.to(600);
    assert!(bench.irq(25));
}

#[test]
fn compare_flag_at_the_match() {
    // 18.4.5: CC1IF when the counter matches; 18.4.4: its own interrupt enable.
    let mut bench = tim2(0, 999);
    bench.set(TIM2 + CCR1, 300);
    bench.set(TIM2 + DIER, 2);
    bench.set(TIM2 + CR1, CEN);
    assert_eq!(bench.soc.next_event(), Some(300));
    bench.to(299);
    assert!(!bench.irq(28));
    bench.to(300);
    assert!(bench.irq(28));
    bench.set(TIM2 + SR, !2);
    bench.to(1300);
    assert!(bench.irq(28), "and again a period later");
}

#[test]
fn a_compare_value_above_the_period_flags_at_the_overflow() {
    // 18.4.5.
    let mut bench = tim2(0, 99);
    bench.set(TIM2 + CCR1, 500);
    bench.set(TIM2 + CR1, CEN);
    bench.to(99);
    assert_eq!(bench.get(TIM2 + SR) & 2, 0);
    bench.to(100);
    assert_eq!(bench.get(TIM2 + SR) & 2, 2);
}

#[test]
fn preloaded_compare_value_waits_for_the_update() {
    // 18.3.8: OCxPE.
    let mut bench = tim2(0, 999);
    bench.set(TIM2 + CCMR1, 1 << 3);
    bench.set(TIM2 + CCR1, 500);
    bench.set(TIM2 + EGR, 1);
    bench.set(TIM2 + SR, 0);
    bench.set(TIM2 + CR1, CEN);
    bench.to(100);
    bench.set(TIM2 + CCR1, 200);
    assert_eq!(bench.get(TIM2 + CCR1), 200, "reads give what was written");
    bench.to(499);
    assert_eq!(bench.get(TIM2 + SR) & 2, 0);
    bench.to(500);
    assert_eq!(bench.get(TIM2 + SR) & 2, 2);
    bench.set(TIM2 + SR, 0);
    bench.to(1199);
    assert_eq!(bench.get(TIM2 + SR) & 2, 0);
    bench.to(1200);
    assert_eq!(bench.get(TIM2 + SR) & 2, 2);
}

#[test]
fn widths_of_the_counters() {
    // 18.2: TIM2 and TIM5 count 32 bits, TIM3 and TIM4 16.
    let mut bench = Bench::clocked();
    for (timer, top) in [(TIM2, u32::MAX), (TIM3, 0xFFFF), (TIM5, u32::MAX), (TIM1, 0xFFFF), (TIM6, 0xFFFF)] {
        assert_eq!(bench.get(timer + ARR), top);
        bench.set(timer + CNT, u32::MAX);
        assert_eq!(bench.get(timer + CNT), top);
    }
}

#[test]
fn time_driver_with_a_16_bit_period_on_tim5() {
    // A common time base: 1 MHz, ARR 0xFFFF, half period interrupt by CC1, alarm by CC2.
    let mut bench = Bench::clocked();
    bench.run_at_168_mhz();
    bench.set(TIM5 + PSC, 83);
    bench.set(TIM5 + ARR, 0xFFFF);
    bench.set(TIM5 + CR1, URS);
    bench.set(TIM5 + EGR, 1);
    bench.set(TIM5 + CR1, 0);
    bench.set(TIM5 + CCR1, 0x8000);
    bench.set(TIM5 + DIER, 3);
    bench.set(TIM5 + CR1, CEN);
    bench.to(168 * 0x8000 - 1);
    assert!(!bench.irq(50));
    bench.to(168 * 0x8000);
    assert!(bench.irq(50));
    assert_eq!((bench.get(TIM5 + CNT), bench.get(TIM5 + SR) & 3), (0x8000, 2));
    bench.set(TIM5 + SR, 0);
    bench.set(TIM5 + CCR1 + 4, 0x9000);
    bench.set(TIM5 + DIER, 7);
    assert_eq!(bench.soc.next_event(), Some(168 * 0x9000));
    bench.to(168 * 0x1_0000);
    assert_eq!(bench.get(TIM5 + SR) & 7, 5);
}

#[test]
fn modes_that_are_not_modelled_make_lints() {
    let mut bench = Bench::clocked();
    bench.set(TIM2 + CR1, 1 << 4);
    bench.set(TIM2 + 0x08, 4);
    bench.set(TIM2 + CCMR1, 1);
    bench.set(TIM2 + 0x48, 0);
    assert_eq!(
        bench.lint_texts(),
        [
            "write of 0x00000010 to TIM2+0x00 (unmodelled mode: counting down or centre-aligned) at cycle 0",
            "write of 0x00000004 to TIM2+0x08 (unmodelled mode: timer slave mode or external clock) at cycle 0",
            "write of 0x00000001 to TIM2+0x18 (unmodelled mode: input capture) at cycle 0",
            "write of 0x00000000 to TIM2+0x48 (unmodelled) at cycle 0",
        ]
    );
}

#[test]
fn events_by_software() {
    // 17.4.6: CCxG, COMG and TG raise their flags.
    let mut bench = Bench::clocked();
    bench.set(TIM1 + EGR, 0x7E);
    assert_eq!(bench.get(TIM1 + SR), 0x7E);
    bench.set(TIM1 + DIER, 0x7E);
    assert!(bench.irq(27) && bench.irq(26) && !bench.irq(25) && !bench.irq(24));
    bench.set(TIM1 + SR, !0x40);
    assert!(bench.irq(26), "COMIF is left");
    bench.set(TIM1 + SR, !0x20);
    assert!(!bench.irq(26));
    // 19.5, 18.4.6: TIM3 has no commutation, TIM6 no channels.
    bench.set(TIM3 + EGR, 0x7E);
    assert_eq!(bench.get(TIM3 + SR), 0x5E);
    bench.set(TIM6 + EGR, 0x7E);
    assert_eq!(bench.get(TIM6 + SR), 0);
}

#[test]
fn an_input_channel_neither_flags_nor_drives() {
    // 18.4.7: CCxS other than 0 makes the channel an input, which is not modelled and has no effect.
    for (value, silent) in [(0x0001, 2), (0x0100, 4)] {
        let mut bench = tim2(0, 99);
        bench.set(TIM2 + CCMR1, value);
        bench.set(TIM2 + CCR1, 50);
        bench.set(TIM2 + CCR1 + 4, 50);
        bench.set(TIM2 + CR1, CEN);
        bench.to(60);
        assert_eq!(bench.get(TIM2 + SR) & 6, 6 & !silent);
    }
}

#[test]
fn skipped_periods_keep_the_repetition_counter_correct() {
    // 17.3.3 over a billion periods: updates at multiples of (RCR + 1) * (ARR + 1) still.
    for rcr in 0..5 {
        let mut bench = Bench::clocked();
        bench.set(TIM1 + ARR, 9);
        bench.set(TIM1 + RCR, rcr);
        bench.set(TIM1 + CCMR1, 0x30);
        bench.set(TIM1 + EGR, 1);
        bench.set(TIM1 + CR1, CEN);
        let update = 10 * (u64::from(rcr) + 1);
        let far = update * 1_000_000_007;
        bench.to(far + 3);
        assert_eq!(bench.get(TIM1 + CNT), 3);
        bench.set(TIM1 + SR, 0);
        bench.to(far + update - 1);
        assert_eq!(bench.get(TIM1 + SR) & 1, 0, "RCR = {rcr}");
        bench.to(far + update);
        assert_eq!(bench.get(TIM1 + SR) & 1, 1, "RCR = {rcr}");
        // A toggling channel flips once a period: CCR1 = 0 matches at every wrap.
        let flips = 1_000_000_008 * (u64::from(rcr) + 1);
        bench.function("PA8", 2, 1);
        bench.set(TIM1 + CCER, 1);
        bench.set(TIM1 + BDTR, 1 << 15);
        assert_eq!(bench.soc.output_level(pin("PA8")), flips % 2 == 1, "RCR = {rcr}");
    }
}

#[test]
fn dead_time_makes_a_lint_where_it_would_act() {
    // 17.3.11: between OCx and OCxN, when both are on.
    for (ccer, dead_time, lint_texts) in [(5 << 4, 10, 1), (5 << 4, 0, 0), (1 << 4, 10, 0)] {
        let mut bench = Bench::clocked();
        bench.set(TIM1 + BDTR, dead_time);
        bench.set(TIM1 + CCER, ccer);
        assert_eq!(bench.lint_texts().iter().filter(|text| text.contains("dead time")).count(), lint_texts);
    }
}
