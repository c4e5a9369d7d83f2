//! Tests of TIM11, which measures the crystal while the chip runs on HSI (RM0090 7.2.11).

use stm32f4_model::SocConfig;

use crate::bench::*;

const TIM11: u32 = 0x4001_4800;
const OR: u32 = 0x50;
const CFGR: u32 = RCC + 8;
const TIM11EN: u32 = 1 << 18;
const HSEON: u32 = 1 << 16;
/// TI1_RMP: HSE_RTC (19.5.12).
const REMAP_TO_HSE_RTC: u32 = 2;
/// CC1S: input 1; IC1PSC: one of eight edges.
const CAPTURE_OF_EIGHT: u32 = 0x0D;
const CC1IF: u32 = 1 << 1;
const CC1OF: u32 = 1 << 9;

/// A chip on HSI, whose TIM11 captures every eighth edge of the crystal divided by RTCPRE.
fn measuring(hse_hz: u32, divider: u32) -> Bench {
    let mut bench = Bench::with(SocConfig { hse_hz, ..SocConfig::default() });
    bench.clock_all();
    bench.set(APB2ENR, TIM11EN);
    bench.set(RCC, 0x83 | HSEON);
    bench.set(CFGR, divider << 16);
    bench.set(TIM11 + OR, REMAP_TO_HSE_RTC);
    bench.set(TIM11 + CCMR1, CAPTURE_OF_EIGHT);
    bench.set(TIM11 + CCER, 1);
    bench.set(TIM11 + CR1, 1);
    assert!(bench.lint_texts().is_empty(), "{:?}", bench.lint_texts());
    bench
}

/// Counts between captures, over 1 ms that is looked at every 16 cycles.
fn intervals(bench: &mut Bench) -> Vec<u16> {
    let mut captures = Vec::new();
    for _ in 0..1_000 {
        bench.pass(16);
        if bench.get(TIM11 + SR) & CC1IF != 0 {
            captures.push(bench.get(TIM11 + CCR1) as u16);
            assert_eq!(bench.get(TIM11 + SR) & CC1IF, 0, "the read clears the flag");
        }
    }
    captures.windows(2).map(|pair| pair[1].wrapping_sub(pair[0])).collect()
}

#[test]
fn an_interval_is_eight_periods_of_the_divided_crystal() {
    for (hse_hz, divider) in [(8_000_000, 31), (8_000_000, 16), (25_000_000, 31), (12_000_000, 31), (4_000_000, 20)] {
        let intervals = intervals(&mut measuring(hse_hz, divider));
        let expected = 8.0 * f64::from(divider) / f64::from(hse_hz) * 16e6;
        let sum: f64 = intervals.iter().map(|&counts| f64::from(counts)).sum();
        let mean = sum / intervals.len() as f64;
        assert!(intervals.len() > 10 && (mean - expected).abs() < 0.1, "{hse_hz} / {divider}: {mean}, not {expected}");
        assert!(intervals.iter().all(|&counts| (f64::from(counts) - expected).abs() < 1.0), "{intervals:?}");
    }
}

#[test]
fn without_a_crystal_or_a_prescaler_nothing_is_captured() {
    let mut dead = Bench::with(SocConfig { hse_ready: false, ..SocConfig::default() });
    dead.clock_all();
    dead.set(APB2ENR, TIM11EN);
    for (register, value) in [
        (RCC, 0x83 | HSEON),
        (CFGR, 31 << 16),
        (TIM11 + OR, REMAP_TO_HSE_RTC),
        (TIM11 + CCMR1, CAPTURE_OF_EIGHT),
        (TIM11 + CCER, 1),
        (TIM11 + CR1, 1),
    ] {
        dead.set(register, value);
    }
    assert_eq!(intervals(&mut dead), []);
    // 7.3.3: 0 and 1 are no clock.
    for (register, value) in [(CFGR, 0), (CFGR, 1 << 16), (RCC, 0x83), (TIM11 + OR, 0), (TIM11 + CCER, 0)] {
        let mut bench = measuring(8_000_000, 31);
        bench.set(register, value);
        assert_eq!(intervals(&mut bench), [], "{register:#x} = {value:#x}");
    }
}

#[test]
fn a_capture_that_is_not_read_is_shown() {
    let mut bench = measuring(8_000_000, 31);
    bench.pass(600);
    assert_eq!(bench.get(TIM11 + SR) & (CC1IF | CC1OF), CC1IF);
    bench.pass(600);
    assert_eq!(bench.get(TIM11 + SR) & (CC1IF | CC1OF), CC1IF | CC1OF);
}

#[test]
fn a_crystal_that_changes_is_captured_at_its_new_frequency() {
    let mut bench = measuring(8_000_000, 31);
    assert_eq!(intervals(&mut bench).last(), Some(&496));
    bench.soc.set_hse_hz(16e6);
    assert_eq!(intervals(&mut bench).last(), Some(&248));
}
