//! Tests of address decoding, clock enables, access widths and the texts of lints.

use stm32f4_model::{LintKind, Width};

use crate::bench::*;

#[test]
fn a_block_without_clock_reads_zero_and_ignores_writes() {
    // 7.3.14: registers of a block without clock cannot be accessed.
    let mut bench = Bench::new();
    assert_eq!(bench.get(TIM1 + ARR), 0);
    bench.set(TIM1 + ARR, 5);
    bench.clock_all();
    assert_eq!(bench.get(TIM1 + ARR), 0xFFFF);
    let kinds: Vec<_> = bench.soc.lints().iter().map(|lint| (lint.kind, lint.write)).collect();
    assert_eq!(kinds, [(LintKind::Unclocked, false), (LintKind::Unclocked, true)]);
}

#[test]
fn the_adcs_have_an_enable_bit_each_and_one_common_block() {
    let mut bench = Bench::new();
    bench.set(APB2ENR, 1 << 10);
    bench.get(ADC1 + 0x200);
    bench.get(ADC_CCR);
    assert_eq!(bench.soc.lints().len(), 0);
    bench.get(ADC1);
    assert_eq!(bench.lint_texts(), ["read of ADC1+0x00 (its clock is off) at cycle 0"]);
    bench.set(APB2ENR, 0);
    bench.get(ADC_CCR);
    assert_eq!(bench.soc.lints().len(), 2);
}

#[test]
fn unmodelled_registers_and_blocks_are_named() {
    let mut bench = Bench::clocked();
    bench.to(7);
    bench.set(TIM1 + 0x50, 1);
    bench.get(TIM1 + 0x50);
    bench.get(0x4000_4800);
    bench.get(0x4002_9400);
    bench.get(0x4002_9400);
    assert_eq!(
        bench.lint_texts(),
        [
            "write of 0x00000001 to TIM1+0x50 (unmodelled) at cycle 7",
            "read of TIM1+0x50 (unmodelled) at cycle 7",
            "read of USART3+0x00 (unmodelled) at cycle 7",
            "read of 0x40029400 (unmodelled) at cycle 7, 2 times",
        ]
    );
    assert!(bench.soc.lints().iter().all(|lint| lint.kind.is_unmodelled()));
    assert_eq!((bench.soc.lints()[0].block(), bench.soc.lints()[0].offset()), (Some("TIM1"), 0x50));
}

#[test]
fn widths() {
    // 17.4: timers are written by half-words or words; 13.13: the ADC by words; 8.4: GPIO by any width.
    let mut bench = Bench::clocked();
    bench.soc.write(TIM2 + PSC, Width::Half, 0x1234);
    assert_eq!(bench.soc.read(TIM2 + PSC, Width::Byte), 0x34);
    bench.soc.write(TIM2 + PSC, Width::Byte, 1);
    assert_eq!(bench.get(TIM2 + PSC), 0x1234);
    bench.soc.write(ADC1 + 4, Width::Half, 1);
    assert_eq!(bench.get(ADC1 + 4), 0);
    bench.soc.write(GPIOD + 0x15, Width::Byte, 0x50);
    assert_eq!(bench.get(GPIOD + 0x14), 0x5000);
    bench.soc.write(GPIOD + 0x1A, Width::Half, 0x4000);
    assert_eq!(bench.get(GPIOD + 0x14), 0x1000, "the upper half of BSRR resets bits");
    let kinds: Vec<_> = bench.soc.lints().iter().map(|lint| lint.kind).collect();
    assert_eq!(kinds, [LintKind::Width, LintKind::Width]);
    bench.soc.read(TIM2 + 2, Width::Word);
    assert_eq!(bench.soc.lints()[2].kind, LintKind::Unaligned);
}

#[test]
fn pwr_enables_writes_to_the_backup_domain() {
    // 5.4.1, 7.3.20.
    let mut bench = Bench::clocked();
    bench.set(RCC + 0x70, 0x8100);
    assert_eq!(bench.get(RCC + 0x70), 0);
    bench.set(0x4000_7000, 1 << 8);
    bench.set(RCC + 0x70, 0x8100);
    assert_eq!(bench.get(RCC + 0x70), 0x8100);
    assert_eq!(bench.soc.lints().len(), 1);
}

#[test]
fn identity_and_wait_states_need_no_clock_enable() {
    let mut bench = Bench::new();
    assert_eq!(bench.get(0xE004_2000) & 0xFFF, 0x413);
    bench.set(0xE004_2008, 1 << 12);
    assert_eq!(bench.get(0xE004_2008), 1 << 12);
    bench.set(FLASH_ACR, 0x705);
    assert_eq!(bench.get(FLASH_ACR), 0x705);
    assert_eq!(bench.soc.lints().len(), 0);
}
