//! Input pins, EXTI, SYSCFG.

use stm32f4_model::Width;

use crate::bench::*;

const IMR: u32 = EXTI;
const RTSR: u32 = EXTI + 0x08;
const FTSR: u32 = EXTI + 0x0C;
const PR: u32 = EXTI + 0x14;
const IDR: u32 = 0x10;

fn button() -> Bench {
    let mut bench = Bench::clocked();
    bench.plant.inputs = vec![(1e-3, pin("PA0"), true), (2e-3, pin("PA0"), false), (3e-3, pin("PD5"), true)];
    bench
}

#[test]
fn idr_shows_the_input_at_its_time() {
    // 8.4.5.
    let mut bench = button();
    bench.to(15_999);
    assert_eq!(bench.get(GPIOA + IDR), 0);
    bench.to(16_000);
    assert_eq!(bench.get(GPIOA + IDR), 1);
    bench.to(32_000);
    assert_eq!(bench.get(GPIOA + IDR), 0);
    bench.set(GPIOA, 0xA800_0003);
    bench.plant.inputs.push((4e-3, pin("PA0"), true));
    bench.to(70_000);
    assert_eq!(bench.get(GPIOA + IDR) & 1, 0, "8.3.12: an analog pin reads 0");
}

#[test]
fn idr_of_an_output_shows_what_is_driven() {
    // 8.3.10.
    let mut bench = button();
    bench.set(GPIOD, 1 << 24);
    bench.set(GPIOD + 0x18, 1 << 12);
    assert_eq!(bench.get(GPIOD + IDR), 1 << 12);
}

#[test]
fn announced_changes_are_events() {
    let mut bench = button();
    bench.to(0);
    let level_reads = bench.plant.level_reads;
    assert_eq!(bench.soc.next_event(), Some(16_000));
    for cycle in 1..16_000 {
        bench.to(cycle);
    }
    assert_eq!(bench.plant.level_reads, level_reads, "levels are not read in between");
    bench.to(16_000);
    assert_eq!(bench.soc.next_event(), Some(32_000));
}

#[test]
fn a_change_that_comes_unannounced_is_seen_at_the_next_advance() {
    let mut bench = button();
    bench.plant.inputs.clear();
    bench.to(1000);
    assert_eq!(bench.soc.next_event(), None);
    bench.plant.inputs.push((2000.0 / 16e6, pin("PA0"), true));
    bench.to(3000);
    assert_eq!(bench.get(GPIOA + IDR), 1);
}

#[test]
fn a_plant_may_request_a_sample_at_once() {
    // A live input: pressed at the time of the last sample, or earlier.
    for at in [1000.0 / 16e6, 10.0 / 16e6] {
        let mut bench = button();
        bench.plant.inputs.clear();
        bench.plant.look_now = true;
        bench.to(1000);
        assert_eq!(bench.get(GPIOA + IDR), 0);
        bench.plant.inputs.push((at, pin("PA0"), true));
        bench.to(1000);
        assert_eq!(bench.get(GPIOA + IDR), 1);
        let level_reads = bench.plant.level_reads;
        bench.to(2000);
        assert_eq!(
            bench.plant.level_reads,
            level_reads + 144,
            "one sample for each advance, however often it is requested"
        );
    }
}

#[test]
fn a_plant_that_announces_nothing_is_polled() {
    let mut bench = button();
    bench.plant.announces = false;
    bench.to(15_000);
    assert_eq!((bench.get(GPIOA + IDR), bench.soc.next_event()), (0, None));
    bench.to(17_000);
    assert_eq!(bench.get(GPIOA + IDR), 1);
}

#[test]
fn edges_raise_interrupts() {
    // 12.2.5, 12.1.3: EXTI0 is IRQ 6.
    let mut bench = button();
    bench.set(IMR, 1);
    bench.set(RTSR, 1);
    bench.to(15_999);
    assert!(!bench.irq(6));
    bench.to(16_000);
    assert!(bench.irq(6));
    bench.set(PR, 1);
    assert!(!bench.irq(6));
    bench.to(40_000);
    assert!(!bench.irq(6), "the falling edge is not selected");
    bench.set(FTSR, 1);
    bench.plant.inputs.extend([(3.1e-3, pin("PA0"), true), (3.2e-3, pin("PA0"), false)]);
    bench.set(RTSR, 0);
    bench.to(50_000);
    assert!(!bench.irq(6));
    bench.to(52_000);
    assert!(bench.irq(6));
}

#[test]
fn exticr_selects_the_port_and_needs_its_clock() {
    // 9.2.3, 7.3.14: SYSCFG_EXTICR2 for line 5; without SYSCFGEN the write is lost.
    for (enabled, irq) in [(true, true), (false, false)] {
        let mut bench = button();
        if !enabled {
            let clocks = bench.get(APB2ENR);
            bench.set(APB2ENR, clocks & !(1 << 14));
        }
        bench.set(SYSCFG + 0x0C, 3 << 4);
        bench.set(IMR, 1 << 5);
        bench.set(RTSR, 1 << 5);
        bench.to(60_000);
        assert_eq!(bench.irq(23), irq);
        assert_eq!(bench.lint_texts().len(), usize::from(!enabled));
        if !enabled {
            assert!(bench.lint_texts()[0].contains("SYSCFG+0x0C (its clock is off)"));
        }
    }
}

#[test]
fn lines_and_their_interrupts() {
    // 12.1.3: EXTI0 to 4 are IRQ 6 to 10, 5 to 9 IRQ 23, 10 to 15 IRQ 40; 16 to 22 are PVD, RTC, USB, Ethernet.
    let mut bench = Bench::clocked();
    bench.set(IMR, 0x7F_FFFF);
    let others = [1, 41, 42, 62, 76, 2, 3];
    for line in 0..23 {
        bench.set(EXTI + 0x10, 1 << line);
        let wanted = match line {
            0..=4 => 6 + line,
            5..=9 => 23,
            10..=15 => 40,
            _ => others[line as usize - 16],
        };
        for irq in 0..82 {
            assert_eq!(bench.irq(irq), irq == wanted, "line {line}, IRQ {irq}");
        }
        bench.set(PR, 1 << line);
    }
}

#[test]
fn exti_takes_words_only() {
    // 12.3.
    let mut bench = button();
    bench.soc.write(IMR, Width::Half, 1);
    assert_eq!(bench.get(IMR), 0);
    assert_eq!(bench.lint_texts(), ["write of 0x00000001 to EXTI+0x00 as a half-word (width not allowed) at cycle 0"]);
}

#[test]
fn exti_15_starts_the_injected_group() {
    // 13.6, table 67: JEXTSEL = 15.
    for edge in 1..=3 {
        let mut bench = button();
        bench.plant.inputs.extend([(4e-3, pin("PB15"), true), (5e-3, pin("PB15"), false)]);
        bench.set(SYSCFG + 0x14, 1 << 12);
        bench.set(RTSR, 1 << 15);
        bench.set(ADC1 + 0x08, 1 | 15 << 16 | edge << 20);
        bench.to(100_000);
        let ends: Vec<u64> = bench.soc.conversions().map(|conversion| conversion.cycle).collect();
        assert_eq!(ends, [64_000 + 15 * 2]);
    }
}

#[test]
fn output_changes_are_recorded() {
    let mut bench = Bench::clocked();
    bench.set(GPIOB, 1 << 10 | 0x280);
    for (cycle, value) in [(100, 1 << 5), (200, 1 << 21), (300, 1 << 5)] {
        bench.to(cycle);
        bench.set(GPIOB + 0x18, value);
    }
    bench.to(400);
    assert_eq!(bench.edges_of("PB5"), [(true, 100.0 / 16e6), (false, 200.0 / 16e6), (true, 300.0 / 16e6)]);
    bench.set(GPIOB, 0x280);
    bench.to(500);
    assert_eq!(bench.edges_of("PB5").pop(), Some((false, 400.0 / 16e6)), "an input is not driven");
}
