//! Tests of PWM on pins: four servos on TIM1 at 168 MHz, 1 us per count, 50 Hz.

use crate::bench::*;

const US: f64 = 1e-6;
const PERIOD: u64 = 168 * 20_000;
const MOE: u32 = 1 << 15;
const OSSI: u32 = 1 << 10;

/// Four channels in PWM mode 1 with preload on PA8 to PA11, 1500 us each, BDTR as given. Returns the bench and the cycle of the start.
fn servos(bdtr: u32) -> (Bench, u64) {
    let mut bench = Bench::clocked();
    bench.run_at_168_mhz();
    bench.set(TIM1 + PSC, 167);
    bench.set(TIM1 + ARR, 19_999);
    for channel in 0..4 {
        bench.set(TIM1 + CCR1 + 4 * channel, 1500);
    }
    bench.set(TIM1 + CCMR1, 0x6868);
    bench.set(TIM1 + CCMR2, 0x6868);
    bench.set(TIM1 + CCER, 0x1111);
    bench.set(TIM1 + BDTR, bdtr);
    for name in ["PA8", "PA9", "PA10", "PA11"] {
        bench.function(name, 2, 1);
    }
    bench.set(TIM1 + EGR, 1);
    bench.set(TIM1 + CR1, 0x81);
    let start = bench.soc.now();
    (bench, start)
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12
}

#[test]
fn pulses_have_their_width_and_period() {
    // 17.3.10 and 17.4.7: in mode 1 the output is high while CNT < CCRx.
    let (mut bench, start) = servos(MOE);
    bench.to(start + 3 * PERIOD - 1);
    for name in ["PA8", "PA9", "PA10", "PA11"] {
        let edges = bench.edges_of(name);
        assert_eq!(edges.len(), 6, "{name}");
        for (index, &(level, at)) in edges.iter().enumerate() {
            let wanted = (index / 2) as f64 * 0.02 + if level { 0.0 } else { 1500.0 * US };
            assert_eq!(level, index % 2 == 0);
            assert!(close(at, wanted), "{name}: edge {index} at {at}");
        }
    }
    assert!(bench.soc.lints().is_empty(), "{:?}", bench.lint_texts());
}

#[test]
fn each_channel_has_its_own_pin() {
    let (mut bench, start) = servos(MOE);
    for channel in 0..4 {
        bench.set(TIM1 + CCR1 + 4 * channel, 1000 + 100 * channel);
    }
    bench.to(start + 2 * PERIOD - 1);
    for (channel, name) in ["PA8", "PA9", "PA10", "PA11"].iter().enumerate() {
        let edges = bench.edges_of(name);
        let width = edges[3].1 - edges[2].1;
        assert!(close(width, (1000 + 100 * channel) as f64 * US), "{name}: {width}");
    }
}

#[test]
fn a_width_written_in_mid_pulse_waits_for_the_next_period() {
    // 17.3.10: with OCxPE the new value acts at the next update, so that every pulse has the old or the new width.
    for written_at in [0, 1, 700, 1499, 1500, 1501, 19_999] {
        let (mut bench, start) = servos(MOE);
        bench.to(start + 168 * written_at);
        bench.set(TIM1 + CCR1, 900);
        bench.to(start + 3 * PERIOD - 1);
        let edges = bench.edges_of("PA8");
        let widths: Vec<f64> = edges.chunks(2).map(|pulse| ((pulse[1].1 - pulse[0].1) / US).round()).collect();
        assert_eq!(widths, [1500.0, 900.0, 900.0], "written at {written_at} us");
    }
}

#[test]
fn without_preload_a_smaller_width_cuts_the_pulse() {
    // 17.4.13: without OCxPE the value acts at once.
    let (mut bench, start) = servos(MOE);
    bench.set(TIM1 + CCMR1, 0x6860);
    bench.to(start + 168 * 1000);
    bench.set(TIM1 + CCR1, 900);
    bench.to(start + PERIOD - 1);
    let edges = bench.edges_of("PA8");
    assert!(close(edges[1].1 - edges[0].1, 1000.0 * US));
}

#[test]
fn zero_and_full_width() {
    // 17.3.10: CCRx = 0 holds the output low, CCRx > ARR holds it high.
    let (mut bench, start) = servos(MOE);
    bench.set(TIM1 + CCR1, 0);
    bench.set(TIM1 + CCR1 + 4, 20_000);
    bench.to(start + 3 * PERIOD);
    assert_eq!(bench.edges_of("PA8").len(), 2, "one pulse, then nothing");
    assert_eq!(bench.edges_of("PA9").len(), 3, "high from the second period on");
}

#[test]
fn mode_two_and_polarity_invert() {
    // 17.4.7: mode 2 is the inverse; 17.4.9: CCxP inverts the pin.
    let (mut bench, start) = servos(MOE);
    bench.set(TIM1 + CCMR1, 0x6878);
    bench.set(TIM1 + CCER, 0x1131);
    bench.plant.edges.clear();
    bench.to(start);
    // Channel 2 is inverted by its polarity, channel 1 by its mode: both low now.
    assert!(!bench.soc.output_level(pin("PA8")) && !bench.soc.output_level(pin("PA9")));
    bench.to(start + 168 * 1500);
    assert!(bench.soc.output_level(pin("PA8")) && bench.soc.output_level(pin("PA9")));
}

#[test]
fn forced_levels() {
    // 17.3.8: forced output modes 4 and 5 ignore the comparison.
    let (mut bench, start) = servos(MOE);
    bench.set(TIM1 + CCMR1, 0x4858);
    bench.to(start + 168 * 5000);
    assert!(bench.soc.output_level(pin("PA8")) && !bench.soc.output_level(pin("PA9")));
}

#[test]
fn match_modes_set_reset_and_toggle() {
    // 17.4.7: modes 1, 2 and 3 act on the match.
    let (mut bench, start) = servos(MOE);
    bench.set(TIM1 + CCMR1, 0x4848);
    bench.set(TIM1 + CCMR1, 0x3818);
    bench.to(start);
    bench.plant.edges.clear();
    bench.to(start + 3 * PERIOD - 1);
    assert_eq!(bench.edges_of("PA8").len(), 1, "set once");
    let toggles: Vec<bool> = bench.edges_of("PA9").iter().map(|&(level, _)| level).collect();
    assert_eq!(toggles, [true, false, true]);
    bench.set(TIM1 + CCMR1, 0x3828);
    bench.pass(PERIOD);
    assert!(!bench.soc.output_level(pin("PA8")));
}

#[test]
fn no_edge_before_moe() {
    // 17.3.12: MOE is 0 after reset; without OSSI the pins are not driven.
    let (mut bench, start) = servos(0);
    bench.to(start + 10 * PERIOD);
    assert_eq!(bench.plant.edges, []);
    bench.set(TIM1 + BDTR, MOE);
    bench.pass(PERIOD);
    assert!(!bench.plant.edges.is_empty());
}

#[test]
fn clearing_moe_disables_all_outputs_at_once() {
    // 17.4.18 and table 94.
    let (mut bench, start) = servos(MOE);
    bench.to(start + 168 * 700);
    bench.set(TIM1 + BDTR, 0);
    bench.to(start + 5 * PERIOD);
    for name in ["PA8", "PA9", "PA10", "PA11"] {
        let edges = bench.edges_of(name);
        assert_eq!(edges.len(), 2, "{name}");
        assert!(close(edges[1].1, 700.0 * US), "{name}: low at {}", edges[1].1);
    }
    // The timer continues: MOE affects only the pins.
    bench.set(TIM1 + BDTR, MOE);
    bench.pass(PERIOD);
    assert!(bench.edges_of("PA8").len() > 2);
}

#[test]
fn moe_set_in_mid_period_gives_a_runt_pulse() {
    // Effect of setting MOE while CCRx is not 0: the first pulse has the length that remains of it.
    let (mut bench, start) = servos(0);
    bench.to(start + 168 * 1000);
    bench.set(TIM1 + BDTR, MOE);
    bench.to(start + PERIOD - 1);
    let edges = bench.edges_of("PA8");
    assert!(close(edges[1].1 - edges[0].1, 500.0 * US));
}

#[test]
fn idle_levels_with_ossi() {
    // Table 94: MOE = 0 with OSSI drives OISx on enabled channels.
    let (mut bench, start) = servos(OSSI);
    bench.set(TIM1 + CR2, 1 << 8);
    bench.set(TIM1 + CCER, 0x0111);
    bench.to(start + PERIOD);
    let levels: Vec<bool> = ["PA8", "PA9", "PA11"].iter().map(|name| bench.soc.output_level(pin(name))).collect();
    assert_eq!(levels, [true, false, false]);
    bench.set(TIM1 + BDTR, 0);
    assert!(!bench.soc.output_level(pin("PA8")), "without OSSI the pin is not driven");
}

#[test]
fn the_pin_follows_only_with_the_right_alternate_function() {
    // 8.3.2: MODER = 2 and AF1.
    let (mut bench, start) = servos(MOE);
    bench.function("PA8", 2, 2);
    bench.function("PA9", 0, 1);
    bench.function("PA10", 1, 1);
    bench.plant.edges.clear();
    bench.to(start + 2 * PERIOD - 1);
    // The three pins fall at the first advance, as they are disconnected from the timer.
    for name in ["PA8", "PA9", "PA10"] {
        assert!(bench.edges_of(name).iter().all(|&(_, at)| at == 0.0), "{name}");
        assert!(!bench.soc.output_level(pin(name)));
    }
    assert_eq!(bench.edges_of("PA11").len(), 4);
}

#[test]
fn complementary_output() {
    // Table 94: OCxN alone follows the reference, together with OCx its complement.
    let (mut bench, start) = servos(MOE);
    bench.function("PA7", 2, 1);
    bench.to(start + 168 * 100);
    bench.set(TIM1 + CCER, 0x1114);
    assert!(bench.soc.output_level(pin("PA7")) && !bench.soc.output_level(pin("PA8")));
    bench.set(TIM1 + CCER, 0x1115);
    assert!(!bench.soc.output_level(pin("PA7")) && bench.soc.output_level(pin("PA8")));
}

#[test]
fn ossr_holds_the_partner_inactive() {
    // Table 94: CCxE = 0, CCxNE = 1, MOE = 1: with OSSR OCx is driven at its inactive level CCxP, else it is not driven.
    for (ossr, held) in [(1 << 11, true), (0, false)] {
        let (mut bench, _) = servos(MOE | ossr);
        bench.set(TIM1 + CCER, 0x6);
        assert_eq!(bench.soc.output_level(pin("PA8")), held);
        bench.set(TIM1 + CCER, 0x2);
        assert!(!bench.soc.output_level(pin("PA8")), "with both off it is not driven in any case");
        bench.function("PA7", 2, 1);
        bench.set(TIM1 + CCER, 0x9);
        assert_eq!(bench.soc.output_level(pin("PA7")), held, "the other way round too");
    }
}

#[test]
fn lock_levels_freeze_the_configuration() {
    // 17.4.18: level 1 break and idle bits, level 2 polarities, level 3 modes; LOCK is written once.
    let (mut bench, _) = servos(0);
    bench.set(TIM1 + BDTR, 1 << 8);
    assert_eq!(bench.get(TIM1 + BDTR), 0, "the first write of BDTR fixed LOCK = 0");

    let (mut bench, start) = servos(3 << 8 | 1 << 13);
    bench.set(TIM1 + BDTR, MOE | 1 << 12);
    bench.set(TIM1 + CR2, 0x100);
    bench.set(TIM1 + CCER, 0x1113);
    bench.set(TIM1 + CCMR1, 0x7878);
    assert_eq!(
        [BDTR, CR2, CCER, CCMR1].map(|offset| bench.get(TIM1 + offset)),
        [MOE | 3 << 8 | 1 << 13, 0, 0x1111, 0x6868]
    );
    assert!(bench.lint_texts().len() >= 4);
    // Widths and MOE are not locked.
    bench.set(TIM1 + CCR1, 1000);
    bench.to(start + 2 * PERIOD - 1);
    let edges = bench.edges_of("PA8");
    assert!(close(edges[3].1 - edges[2].1, 1000.0 * US));
}

#[test]
fn a_reset_of_the_timer_stops_driving_its_pins() {
    // 7.3.9: APB2RSTR.TIM1RST.
    let (mut bench, start) = servos(MOE);
    bench.to(start + 168 * 100);
    bench.set(APB2RSTR, 1);
    assert!(!bench.soc.output_level(pin("PA8")));
    assert_eq!(bench.get(TIM1 + ARR), 0, "held in reset");
    bench.set(APB2RSTR, 0);
    assert_eq!(bench.get(TIM1 + ARR), 0xFFFF);
    bench.pass(PERIOD);
    assert_eq!(bench.edges_of("PA8").len(), 2);
}

#[test]
fn without_its_clock_the_timer_freezes_with_its_output() {
    // 7.3.14: a stopped timer keeps its output level, so that a servo line may stay high.
    let (mut bench, start) = servos(MOE);
    bench.to(start + 168 * 100);
    let enabled = bench.get(APB2ENR);
    bench.set(APB2ENR, enabled & !1);
    bench.pass(PERIOD);
    assert!(bench.soc.output_level(pin("PA8")));
    bench.set(APB2ENR, enabled);
    assert_eq!(bench.get(TIM1 + CNT), 100);
}
