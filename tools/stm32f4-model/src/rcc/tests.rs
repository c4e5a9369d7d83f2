//! Tests of the RCC registers.

use super::faults::HseFailure;
use super::*;

fn rcc() -> Rcc {
    Rcc::new(Chip::F407, 8_000_000, true, false)
}

fn write(rcc: &mut Rcc, offset: u32, value: u32) -> Vec<LintKind> {
    let mut lints = Vec::new();
    rcc.write(offset, value, true, &mut lints);
    lints
}

/// 8 MHz HSE, M 4, N 168, P 2, Q 7, APB1 / 4, APB2 / 2: 168 MHz.
fn to_168_mhz(rcc: &mut Rcc) {
    assert_eq!(write(rcc, CR, 0x83 | HSEON), []);
    assert_eq!(write(rcc, PLLCFGR, 4 | 168 << 6 | PLLSRC_HSE | 7 << 24), []);
    assert_eq!(write(rcc, CR, 0x83 | HSEON | PLLON), []);
    assert_eq!(write(rcc, CFGR, SW_PLL | 5 << 10 | 4 << 13), []);
}

#[test]
fn reset_values() {
    // RM0090 7.3: values after reset of each register; HSICAL is factory data and left 0.
    let rcc = rcc();
    let values: Vec<u32> =
        [CR, PLLCFGR, CFGR, CIR, 0x30, 0x44, 0x50, BDCR, CSR].iter().filter_map(|&at| rcc.peek(at)).collect();
    assert_eq!(values, [0x83, 0x2400_3010, 0, 0, 0x0010_0000, 0, 0x7E67_91FF, 0, 0x0E00_0000]);
}

#[test]
fn hse_through_the_pll_gives_168_mhz() {
    // RM0090 7.3.2: f(VCO) = f(in) * N / M, f(PLL out) = f(VCO) / P: 8 MHz * 168 / 4 / 2.
    let mut rcc = rcc();
    to_168_mhz(&mut rcc);
    assert_eq!(rcc.clocks(), ClockTree { hclk: 168e6, apb: [4, 2] });
    assert_eq!(rcc.peek(CFGR).map(|cfgr| cfgr >> 2 & 3), Some(SW_PLL));
}

#[test]
fn a_failed_crystal_never_becomes_ready() {
    let mut rcc = Rcc::new(Chip::F407, 8_000_000, false, false);
    write(&mut rcc, CR, 0x83 | HSEON);
    assert_eq!(rcc.cr & HSERDY, 0);
    write(&mut rcc, PLLCFGR, 4 | 168 << 6 | PLLSRC_HSE | 7 << 24);
    write(&mut rcc, CR, 0x83 | HSEON | PLLON);
    assert_eq!(rcc.cr & PLLRDY, 0);
    // RM0090 7.2.6: the switch waits until the wanted source is ready.
    write(&mut rcc, CFGR, SW_PLL);
    assert_eq!(rcc.source(), SW_HSI);
    assert_eq!(rcc.clocks().hclk, 16e6);
}

#[test]
fn the_running_oscillator_cannot_be_switched_off() {
    let mut rcc = rcc();
    assert_eq!(write(&mut rcc, CR, 0x80).len(), 1);
    assert_eq!(rcc.cr & HSIRDY, HSIRDY);
    to_168_mhz(&mut rcc);
    assert_eq!(write(&mut rcc, CR, 0x83 | HSEON).len(), 1);
    assert_eq!(rcc.cr & PLLON, PLLON);
    assert_eq!(write(&mut rcc, CR, 0x80 | HSEON | PLLON), []);
    assert_eq!(rcc.cr & HSIRDY, 0);
}

#[test]
fn pll_factors_are_locked_while_it_runs_and_checked() {
    let mut rcc = rcc();
    to_168_mhz(&mut rcc);
    let before = rcc.pllcfgr;
    assert_eq!(write(&mut rcc, PLLCFGR, 8 | 100 << 6 | PLLSRC_HSE | 7 << 24).len(), 1);
    assert_eq!(rcc.pllcfgr, before);
    // At 8 MHz: 4 * 168 = 672 MHz and 4 MHz in; 2 * 45, N too small; M = 1; Q = 1; 1 * 99 MHz; 2 * 216 = 432 MHz; 2.1 MHz would do.
    let cases =
        [(2, 168, 7, 2), (4, 49, 7, 1), (1, 100, 7, 1), (4, 168, 1, 1), (8, 99, 7, 1), (4, 216, 9, 0), (8, 100, 2, 0)];
    for (m, n, q, lints) in cases {
        let mut fresh = Rcc::new(Chip::F407, 8_000_000, true, false);
        assert_eq!(write(&mut fresh, PLLCFGR, m | n << 6 | PLLSRC_HSE | q << 24), []);
        assert_eq!(write(&mut fresh, CR, 0x83 | HSEON | PLLON).len(), lints, "M {m}, N {n}, Q {q}");
        assert_eq!(write(&mut fresh, CR, 0x83 | HSEON | PLLON), [], "reported once");
    }
}

#[test]
fn clock_switch_value_3_is_refused() {
    // RM0090 7.3.3: SW = 3 is not allowed.
    let mut rcc = rcc();
    assert_eq!(write(&mut rcc, CFGR, 3).len(), 1);
    assert_eq!((rcc.source(), rcc.clocks().hclk), (SW_HSI, 16e6));
}

#[test]
fn reset_flags_accumulate_until_rmvf() {
    // RM0090 7.3.21: flags are set by each reset and cleared by RMVF or power-on.
    let mut rcc = rcc();
    rcc.reset(ResetCause::IndependentWatchdog);
    assert_eq!(rcc.csr, 0x2E00_0000);
    write(&mut rcc, CSR, RMVF);
    assert_eq!(rcc.csr, 0);
    rcc.reset(ResetCause::Software);
    assert_eq!(rcc.csr, 0x1400_0000);
    rcc.reset(ResetCause::Pin);
    assert_eq!(rcc.csr, 0x1400_0000);
    rcc.reset(ResetCause::PowerOn);
    assert_eq!(rcc.csr, 0x0E00_0000);
}

#[test]
fn lsi_is_ready_when_on() {
    let mut rcc = rcc();
    write(&mut rcc, CSR, 1);
    assert_eq!(rcc.csr & 3, 3);
    write(&mut rcc, CSR, 0);
    assert_eq!(rcc.csr & 3, 0);
    // It stays 0 where the oscillator does not oscillate.
    rcc.set_lsi_works(false);
    write(&mut rcc, CSR, 1);
    assert_eq!(rcc.csr & 3, 1);
    rcc.set_lsi_works(true);
    assert_eq!(rcc.csr & 3, 3);
}

#[test]
fn backup_domain_needs_dbp_and_survives_a_reset() {
    let mut rcc = rcc();
    let mut lints = Vec::new();
    rcc.write(BDCR, 0x8100, false, &mut lints);
    assert_eq!((rcc.bdcr, lints.len()), (0, 1));
    write(&mut rcc, BDCR, 0x8100);
    rcc.reset(ResetCause::Software);
    assert_eq!(rcc.bdcr, 0x8100);
    write(&mut rcc, BDCR, 1);
    assert_eq!(rcc.bdcr, 1, "no 32 kHz crystal is fitted");
    rcc.reset(ResetCause::PowerOn);
    assert_eq!(rcc.bdcr, 0);
}

#[test]
fn ready_interrupt_and_its_clear_bit() {
    let mut rcc = rcc();
    write(&mut rcc, CIR, 1 << 11);
    write(&mut rcc, CR, 0x83 | HSEON);
    assert!(rcc.interrupt());
    write(&mut rcc, CIR, 1 << 11 | 1 << 19);
    assert!(!rcc.interrupt());
}

#[test]
fn every_ready_flag_has_its_enable_and_clear_bit() {
    // RM0090 7.3.4: HSI 2, HSE 3, PLL 4, PLLI2S 5; enables 8 above, clear bits 16 above.
    for (flag, on) in [(2, HSION), (3, HSEON), (4, PLLON), (5, PLLI2SON)] {
        let mut rcc = rcc();
        write(&mut rcc, CR, 0x82 | HSEON);
        write(&mut rcc, CFGR, SW_HSE);
        write(&mut rcc, PLLCFGR, 0x0440_2A04);
        write(&mut rcc, CR, 0x80 | HSEON);
        if on == HSEON {
            write(&mut rcc, CR, 0x81 | HSEON);
            write(&mut rcc, CFGR, SW_HSI);
            write(&mut rcc, CR, 0x81);
        }
        write(&mut rcc, CIR, 0x3F00 & !(1 << (8 + flag)));
        let on_value = rcc.cr | on;
        write(&mut rcc, CR, on_value);
        assert!(!rcc.interrupt(), "only flag {flag} could be set, and it is disabled");
        let off_value = rcc.cr & !on;
        write(&mut rcc, CR, off_value);
        write(&mut rcc, CIR, 1 << (8 + flag));
        let on_value = rcc.cr | on;
        write(&mut rcc, CR, on_value);
        assert_eq!(rcc.peek(CIR), Some(1 << (8 + flag) | 1 << flag));
        assert!(rcc.interrupt());
        write(&mut rcc, CIR, 1 << (8 + flag) | 1 << (16 + flag));
        assert!(!rcc.interrupt());
    }
}

#[test]
fn sources_of_the_system_clock() {
    // RM0090 7.2: HSI, HSE, and the PLL from either.
    let mut rcc = rcc();
    write(&mut rcc, CR, 0x83 | HSEON);
    write(&mut rcc, CFGR, SW_HSE);
    assert_eq!(rcc.clocks().hclk, 8e6);
    // 16 MHz / 16 * 336 / 4 from HSI; the AHB divided by 2.
    write(&mut rcc, PLLCFGR, 16 | 336 << 6 | 1 << 16 | 7 << 24);
    write(&mut rcc, CR, 0x83 | HSEON | PLLON);
    write(&mut rcc, CFGR, SW_PLL | 8 << 4);
    assert_eq!(rcc.clocks().hclk, 42e6);
    assert_eq!(rcc.fail_hse(), HseFailure::Unused);
    assert_eq!((rcc.clocks().hclk, rcc.cr & PLLRDY), (42e6, PLLRDY));
}

#[test]
fn clock_security_with_the_crystal_as_the_system_clock() {
    let mut rcc = rcc();
    write(&mut rcc, CIR, 1 << 11);
    write(&mut rcc, CR, 0x83 | HSEON | CSSON);
    write(&mut rcc, CFGR, SW_HSE);
    assert_eq!(rcc.fail_hse(), HseFailure::Secured);
    assert_eq!((rcc.source(), rcc.clocks().hclk), (SW_HSI, 16e6));
    assert_eq!(rcc.peek(CIR), Some(1 << 11 | 1 << 7 | 1 << 3), "earlier flags stay set");
    let mut rcc = Rcc::new(Chip::F407, 8_000_000, true, false);
    write(&mut rcc, CR, 0x83 | HSEON);
    write(&mut rcc, CFGR, SW_HSE);
    assert_eq!(rcc.fail_hse(), HseFailure::ClockStopped);
}

#[test]
fn clock_security_switches_to_hsi_and_raises_nmi() {
    // RM0090 7.2.7.
    let mut rcc = rcc();
    to_168_mhz(&mut rcc);
    let on = rcc.cr | CSSON;
    write(&mut rcc, CR, on);
    assert_eq!(rcc.fail_hse(), HseFailure::Secured);
    assert!(rcc.nmi());
    assert_eq!(rcc.clocks().hclk, 16e6);
    assert_eq!(rcc.cr & (HSEON | HSERDY | PLLON | PLLRDY), 0);
    write(&mut rcc, CIR, 1 << 23);
    assert!(!rcc.nmi());
}

#[test]
fn clock_security_acts_only_if_hse_was_ready() {
    // RM0090 7.2.7: enabled after HSE is ready.
    let mut rcc = Rcc::new(Chip::F407, 8_000_000, false, false);
    write(&mut rcc, CR, 0x83 | HSEON | CSSON);
    assert_eq!(rcc.fail_hse(), HseFailure::Unused);
    assert!(!rcc.nmi());
}

#[test]
fn without_clock_security_the_core_stops() {
    let mut rcc = rcc();
    to_168_mhz(&mut rcc);
    assert_eq!(rcc.fail_hse(), HseFailure::ClockStopped);
    assert!(rcc.stopped() && !rcc.nmi());
    rcc.reset(ResetCause::IndependentWatchdog);
    assert!(!rcc.stopped());
    let mut idle = Rcc::new(Chip::F407, 8_000_000, true, false);
    assert_eq!(idle.fail_hse(), HseFailure::Unused);
}
