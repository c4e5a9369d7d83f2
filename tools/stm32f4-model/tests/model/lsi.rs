//! Tests of the internal low-speed oscillator: the watchdog that it clocks, and TIM5, which measures it.

use stm32f4_model::{ResetCause, SocConfig};

use crate::bench::*;

const CCR4: u32 = 0x40;
const OR: u32 = 0x50;
const CSR: u32 = RCC + 0x74;
const LSION: u32 = 1;
/// TI4_RMP: LSI (18.4.20).
const REMAP_TO_LSI: u32 = 1 << 6;
/// CC4S: input 4; IC4PSC: one of eight edges (18.4.8).
const CAPTURE_OF_EIGHT: u32 = 0x0D00;
const CC4E: u32 = 1 << 12;
const CC4IF: u32 = 1 << 4;
const CC4OF: u32 = 1 << 12;

/// A chip whose TIM5 counts microseconds and captures every eighth edge of LSI.
fn measuring(lsi_hz: f64) -> Bench {
    let mut bench = Bench::with(SocConfig { lsi_hz, ..SocConfig::default() });
    bench.clock_all();
    bench.set(CSR, LSION);
    bench.set(TIM5 + PSC, 15);
    bench.set(TIM5 + EGR, 1);
    bench.set(TIM5 + CR1, 1);
    bench.set(TIM5 + OR, REMAP_TO_LSI);
    bench.set(TIM5 + CCMR2, CAPTURE_OF_EIGHT);
    bench.set(TIM5 + CCER, CC4E);
    bench.set(TIM5 + SR, 0);
    assert!(bench.lint_texts().is_empty(), "{:?}", bench.lint_texts());
    bench
}

/// Counts of the first captures of a run of 20 ms, looked for every microsecond.
fn captures(bench: &mut Bench) -> Vec<u32> {
    let mut captures = Vec::new();
    for _ in 0..20_000 {
        bench.pass(16);
        if bench.get(TIM5 + SR) & CC4IF != 0 {
            captures.push(bench.get(TIM5 + CCR4));
            assert_eq!(bench.get(TIM5 + SR) & CC4IF, 0, "18.4.5: the read clears the flag");
        }
    }
    captures
}

#[test]
fn eight_periods_are_between_two_captures() {
    // 7.2.11, 18.3.5.
    for hz in [10_000.0, 17_000.0, 32_000.0, 47_000.0, 100_000.0] {
        let captures = captures(&mut measuring(hz));
        let (first, last) = (captures[0], captures[captures.len() - 1]);
        let periods = 8.0 * (captures.len() - 1) as f64;
        let measured = periods / f64::from(last - first) * 1e6;
        assert!((measured / hz - 1.0).abs() < 2e-4, "{measured} Hz of {hz} Hz");
    }
}

#[test]
fn a_capture_that_is_not_read_is_lost_and_shown() {
    // 18.4.5: CC4OF.
    let mut bench = measuring(32_000.0);
    bench.pass(16 * 300);
    assert_eq!(bench.get(TIM5 + SR) & (CC4IF | CC4OF), CC4IF);
    bench.pass(16 * 300);
    assert_eq!(bench.get(TIM5 + SR) & (CC4IF | CC4OF), CC4IF | CC4OF);
    bench.set(TIM5 + SR, !CC4OF);
    assert_eq!(bench.get(TIM5 + SR) & (CC4IF | CC4OF), CC4IF);
}

#[test]
fn without_an_oscillator_nothing_is_captured() {
    // Off, not connected, or dead.
    for (register, value) in [(CSR, 0), (TIM5 + OR, 0), (TIM5 + CCER, 0)] {
        let mut bench = measuring(32_000.0);
        bench.set(register, value);
        assert_eq!(captures(&mut bench), [], "{register:#x}");
    }
    let mut dead = measuring(0.0);
    assert_eq!((captures(&mut dead), dead.get(CSR) & 3), (vec![], LSION), "7.3.21: LSIRDY stays 0");
    // 7.2.5: the watchdog forces it on.
    let mut bench = measuring(32_000.0);
    bench.set(CSR, 0);
    bench.set(IWDG, 0xCCCC);
    assert!(captures(&mut bench).len() > 70);
}

#[test]
fn a_change_acts_on_what_is_under_way() {
    let mut bench = measuring(32_000.0);
    bench.set(IWDG, 0xCCCC);
    // Half of the 16 384 periods at 32 kHz, the others at 16 kHz.
    bench.to(16_000_000 / 1_000 * 256);
    bench.soc.set_lsi(16_000.0);
    bench.to(16_000_000);
    assert_eq!(bench.soc.take_reset(), Some(ResetCause::IndependentWatchdog));
    assert!((bench.soc.seconds(bench.soc.now()) - 0.768).abs() < 1e-4, "{}", bench.soc.seconds(bench.soc.now()));
    // A dead one never resets.
    let mut bench = measuring(32_000.0);
    bench.set(IWDG, 0xCCCC);
    bench.soc.set_lsi(0.0);
    bench.to(160_000_000);
    assert_eq!(bench.soc.take_reset(), None);
    bench.soc.set_lsi(32_000.0);
    bench.to(320_000_000);
    assert_eq!(bench.soc.take_reset(), Some(ResetCause::IndependentWatchdog));
}

#[test]
fn other_captures_are_reported() {
    for (register, value) in [(TIM2 + CCMR2, 0x0100), (TIM5 + CCMR1, 1), (TIM5 + CCMR2, 0x1100), (TIM5 + OR, 2 << 6)] {
        let mut bench = Bench::clocked();
        bench.set(register, value);
        assert_eq!(bench.lint_texts().len(), 1, "{register:#x}");
    }
}
