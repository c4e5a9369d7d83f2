//! Tests of DMA: transfers of ADC results and on timer updates.

use stm32f4_model::{DmaMemory, Width};

use crate::bench::*;

const LISR: u32 = DMA2;
const HISR: u32 = DMA2 + 4;
const LIFCR: u32 = DMA2 + 8;
const HIFCR: u32 = DMA2 + 12;
/// Base address of the registers of stream n.
const fn stream(n: u32) -> u32 {
    DMA2 + 0x10 + 0x18 * n
}
const NDTR: u32 = 4;
const PAR: u32 = 8;
const M0AR: u32 = 12;
const M1AR: u32 = 16;

const EN: u32 = 1;
const TCIE: u32 = 1 << 4;
const HTIE: u32 = 1 << 3;
const TEIE: u32 = 1 << 2;
const CIRC: u32 = 1 << 8;
const MINC: u32 = 1 << 10;
const HALF: u32 = 1 << 11 | 1 << 13;
const HTIF: u32 = 1 << 4;
const TCIF: u32 = 1 << 5;
const TEIF: u32 = 1 << 3;

const BUFFER: u32 = 0x2000_0100;
const DMA: u32 = 1 << 8;
const DDS: u32 = 1 << 9;
const OVR: u32 = 1 << 5;

/// ADC1 converts channel 1 on every TIM2 update, 1000 cycles apart; the n-th sample is n * 10 codes. A stream is set up for it.
fn ring(n: u32, length: u32, control: u32, dds: u32) -> Bench {
    let mut bench = Bench::clocked();
    bench.plant.volts = Box::new(|_, seconds| (seconds * 16e6 / 1000.0).floor() * 10.0 / 4095.0 * 3.0);
    bench.set(GPIOA, 0xA800_000C);
    bench.set(stream(n) + NDTR, length);
    bench.set(stream(n) + PAR, ADC1 + 0x4C);
    bench.set(stream(n) + M0AR, BUFFER);
    bench.set(stream(n), HALF | MINC | control);
    bench.set(stream(n), HALF | MINC | control | EN);
    bench.set(ADC1 + 0x34, 1);
    bench.set(ADC1 + 0x08, 1 | DMA | dds | 6 << 24 | 1 << 28);
    bench.set(TIM2 + ARR, 999);
    bench.set(TIM2 + CR2, 2 << 4);
    bench.set(TIM2 + CR1, 1);
    bench
}

fn buffer(bench: &mut Bench, length: u32) -> Vec<u32> {
    (0..length).filter_map(|index| bench.ram.read(BUFFER + 2 * index, Width::Half)).collect()
}

#[test]
fn results_go_to_memory_with_half_and_full_flags() {
    // 10.3.3, table 43: ADC1 on streams 0 and 4, channel 0; 10.3.16: HTIF at half of NDTR, TCIF at its end.
    for (n, status, shift, irq) in [(0, LISR, 0, 56), (4, HISR, 0, 60)] {
        let mut bench = ring(n, 4, HTIE | TCIE, 0);
        bench.to(1000 + 15 * 2 - 1);
        assert_eq!(bench.get(stream(n) + NDTR), 4);
        bench.to(1000 + 15 * 2);
        assert_eq!(bench.get(stream(n) + NDTR), 3);
        assert!(!bench.irq(irq));
        bench.to(2500);
        assert_eq!(bench.get(status) >> shift, HTIF);
        assert!(bench.irq(irq), "stream {n}");
        bench.set(if n < 4 { LIFCR } else { HIFCR }, HTIF);
        assert!(!bench.irq(irq));
        bench.to(4500);
        assert_eq!(bench.get(status), TCIF);
        assert!(bench.irq(irq));
        assert_eq!(bench.get(stream(n)) & EN, 0, "switched off at the end");
        assert_eq!(buffer(&mut bench, 5), [10, 20, 30, 40, 0]);
    }
}

#[test]
fn each_flag_has_its_own_interrupt_enable() {
    // 10.5.5.
    for (enables, at) in [(HTIE, 2030), (TCIE, 4030), (TEIE, u64::MAX)] {
        let mut bench = ring(0, 4, enables, 0);
        for sample in 1..6 {
            bench.to(1000 * sample + 29);
            assert_eq!(bench.irq(56), 1000 * sample + 29 >= at);
            bench.pass(1);
            assert_eq!(bench.irq(56), 1000 * sample + 30 >= at);
        }
    }
}

#[test]
fn a_circular_buffer_continues_with_dds() {
    // 10.3.8 and 13.8.1.
    let mut bench = ring(0, 4, CIRC, DDS);
    bench.to(10_500);
    assert_eq!(buffer(&mut bench, 4), [90, 100, 70, 80]);
    assert_eq!(bench.get(stream(0) + NDTR), 2);
    assert_eq!(bench.get(ADC1) & OVR, 0);
}

#[test]
fn without_dds_transfers_stop_after_the_first_buffer() {
    // 13.8.1: DDS = 0 makes no request after the last transfer of the buffer; no overrun is then detected.
    let mut bench = ring(0, 4, CIRC, 0);
    bench.to(10_500);
    assert_eq!(buffer(&mut bench, 4), [10, 20, 30, 40]);
    assert_eq!(bench.get(ADC1) & OVR, 0);
}

#[test]
fn a_full_buffer_with_dds_overruns() {
    // 13.8.1: with DDS = 1 requests continue; the stream is off, so that the second result after it is an overrun.
    let mut bench = ring(0, 4, 0, DDS);
    bench.to(5500);
    assert_eq!(bench.get(ADC1) & OVR, 0);
    bench.to(6500);
    assert_eq!(bench.get(ADC1) & OVR, OVR);
    bench.soc.conversions();
    bench.to(20_000);
    assert_eq!(bench.soc.conversions().count(), 0, "triggers are ignored until OVR is cleared");
}

#[test]
fn a_transfer_error_stops_the_stream() {
    // 10.3.19.
    let mut bench = ring(0, 4, TEIE, DDS);
    bench.set(stream(0), 0);
    bench.set(LIFCR, 0x3D);
    bench.set(stream(0) + M0AR, 0x1000_0000);
    bench.set(stream(0), HALF | MINC | TEIE | EN);
    bench.to(1500);
    assert_eq!((bench.get(LISR), bench.get(stream(0)) & EN), (TEIF, 0));
    assert!(bench.irq(56));
}

#[test]
fn double_buffer_swaps_targets() {
    // 10.3.9: DBM, CT.
    let mut bench = ring(0, 2, 1 << 18, DDS);
    bench.set(stream(0), 0);
    bench.set(LIFCR, 0x3D);
    bench.set(stream(0) + M1AR, BUFFER + 0x40);
    bench.set(stream(0) + NDTR, 2);
    bench.set(stream(0), HALF | MINC | 1 << 18 | EN);
    bench.to(3500);
    assert_eq!(bench.get(stream(0)) & 1 << 19, 1 << 19);
    bench.to(4500);
    assert_eq!(bench.get(stream(0)) & 1 << 19, 0);
    assert_eq!(buffer(&mut bench, 2), [10, 20]);
    assert_eq!(bench.ram.read(BUFFER + 0x40, Width::Word), Some(40 << 16 | 30));
}

#[test]
fn flags_must_be_cleared_before_a_stream_starts_again() {
    // 10.3.17.
    let mut bench = ring(0, 2, 0, DDS);
    bench.to(2500);
    assert_eq!(bench.get(LISR), HTIF | TCIF);
    bench.set(stream(0) + NDTR, 2);
    bench.set(stream(0), HALF | MINC | EN);
    assert_eq!(bench.get(stream(0)) & EN, 0);
    bench.set(LIFCR, 0x3D);
    bench.set(stream(0), HALF | MINC | EN);
    assert_eq!(bench.get(stream(0)) & EN, EN);
    bench.set(stream(0) + PAR, 0);
    assert_eq!(bench.get(stream(0) + PAR), ADC1 + 0x4C, "10.5.7: protected while the stream is on");
    bench.set(stream(0), HALF | MINC);
    assert_eq!(bench.get(LISR), TCIF, "10.3.14: switching off sets TCIF");
}

#[test]
fn timer_updates_fetch_compare_values_from_memory() {
    // Table 43: TIM1_UP is stream 5, channel 6; memory to peripheral.
    let mut bench = Bench::clocked();
    for (index, value) in [300, 200, 100].into_iter().enumerate() {
        bench.ram.write(BUFFER + 2 * index as u32, Width::Half, value);
    }
    bench.set(stream(5) + NDTR, 3);
    bench.set(stream(5) + PAR, TIM1 + CCR1);
    bench.set(stream(5) + M0AR, BUFFER);
    bench.set(stream(5), 6 << 25 | HALF | MINC | 1 << 6 | CIRC | EN);
    bench.set(TIM1 + ARR, 999);
    bench.set(TIM1 + DIER, 1 << 8);
    bench.set(TIM1 + CR1, 1);
    let mut seen = Vec::new();
    for period in 1..=4 {
        bench.to(1000 * period);
        seen.push(bench.get(TIM1 + CCR1));
    }
    assert_eq!(seen, [300, 200, 100, 300]);
    assert_eq!(bench.lint_texts(), [] as [String; 0]);
}

#[test]
fn the_channel_must_be_the_one_of_the_source() {
    let mut bench = ring(0, 4, 3 << 25, DDS);
    bench.to(1500);
    assert_eq!(bench.get(stream(0) + NDTR), 4);
}

#[test]
fn modes_that_are_not_modelled_make_lints() {
    let mut bench = Bench::clocked();
    bench.set(stream(1) + NDTR, 1);
    bench.set(stream(1), 2 << 6 | EN);
    assert!(bench.lint_texts().iter().any(|text| text.contains("unmodelled mode: DMA memory to memory")));
    // Widths that differ: direct mode uses PSIZE for both, the FIFO would pack.
    for (n, fifo, lint) in [(2, 0, false), (3, 1 << 2, true)] {
        let mut bench = Bench::clocked();
        bench.set(stream(n) + NDTR, 1);
        bench.set(stream(n) + 0x14, fifo);
        bench.set(stream(n), 1 << 11 | 2 << 13 | EN);
        assert_eq!(bench.lint_texts().iter().any(|text| text.contains("FIFO packing")), lint);
    }
}

#[test]
fn compare_requests_come_with_the_match_or_with_the_update() {
    // 17.4.2: CCDS. TIM1_CH1 is stream 1, channel 6; TIM1_CH2 stream 2.
    for (ccds, at) in [(0, 300), (1 << 3, 1000)] {
        let mut bench = Bench::clocked();
        for n in [1, 2] {
            bench.set(stream(n) + NDTR, 8);
            bench.set(stream(n) + PAR, TIM1 + 0x3C);
            bench.set(stream(n) + M0AR, BUFFER);
            bench.set(stream(n), 6 << 25 | HALF | MINC | 1 << 6 | EN);
        }
        bench.set(TIM1 + ARR, 999);
        bench.set(TIM1 + CCR1, 300);
        bench.set(TIM1 + CR2, ccds);
        bench.set(TIM1 + DIER, 1 << 9);
        bench.set(TIM1 + CR1, 1);
        assert_eq!(bench.soc.next_event(), Some(at));
        bench.to(at - 1);
        assert_eq!(bench.get(stream(1) + NDTR), 8);
        bench.to(at);
        assert_eq!((bench.get(stream(1) + NDTR), bench.get(stream(2) + NDTR)), (7, 8));
        // CC1G requests a transfer too, unless requests come with updates.
        bench.set(TIM1 + EGR, 2);
        bench.pass(0);
        assert_eq!(bench.get(stream(1) + NDTR), if ccds == 0 { 6 } else { 7 });
        bench.to(999 + at);
        assert_eq!(bench.get(stream(1) + NDTR), if ccds == 0 { 6 } else { 7 });
    }
}

#[test]
fn only_the_enabled_requests_are_made() {
    // 17.4.4: UDE, CCxDE; 17.4.1: with URS UG makes no request.
    let mut bench = Bench::clocked();
    bench.set(stream(5) + NDTR, 8);
    bench.set(stream(5) + PAR, TIM1 + CCR1);
    bench.set(stream(5) + M0AR, BUFFER);
    bench.set(stream(5), 6 << 25 | HALF | MINC | 1 << 6 | EN);
    bench.set(TIM1 + ARR, 99);
    bench.set(TIM1 + DIER, 1);
    bench.set(TIM1 + CR1, 1);
    bench.to(250);
    assert_eq!(bench.get(stream(5) + NDTR), 8);
    bench.set(TIM1 + DIER, 1 << 8);
    bench.set(TIM1 + CR1, 1 | 1 << 2);
    bench.set(TIM1 + EGR, 1);
    bench.pass(0);
    assert_eq!(bench.get(stream(5) + NDTR), 8);
    bench.set(TIM1 + CR1, 1);
    bench.set(TIM1 + EGR, 1);
    bench.pass(0);
    assert_eq!(bench.get(stream(5) + NDTR), 7);
}

#[test]
fn while_on_only_interrupt_enables_can_be_written() {
    // 10.5.5.
    let mut bench = ring(0, 4, CIRC, DDS);
    bench.set(stream(0), HALF | MINC | CIRC | EN | TCIE | HTIE);
    assert_eq!(bench.soc.lints().len(), 0);
    assert_eq!(bench.get(stream(0)), HALF | MINC | CIRC | EN | TCIE | HTIE);
    bench.set(stream(0), HALF | MINC | EN);
    assert_eq!(bench.soc.lints().len(), 1);
    assert_eq!(bench.get(stream(0)), HALF | MINC | CIRC | EN);
}

#[test]
fn both_ends_step_as_configured() {
    // 10.3.6: PINC, MINC, PINCOS; words, half-words, bytes.
    for (size, bytes) in [(0, 1), (1, 2), (2, 4)] {
        for (control, memory_step, peripheral_step) in
            [(0, 0, 0), (1 << 10, bytes, 0), (1 << 9, 0, bytes), (3 << 9 | 1 << 15, bytes, 4)]
        {
            let mut bench = Bench::clocked();
            for index in 0..16 {
                bench.ram.write(BUFFER + index, Width::Byte, 0xA0 + index);
            }
            bench.ram.write(BUFFER + 0x40, Width::Word, 0);
            bench.set(stream(5) + NDTR, 3);
            // GPIOB: AFRL and AFRH take any width.
            bench.set(stream(5) + PAR, GPIOB + 0x1C + 4);
            bench.set(stream(5) + M0AR, BUFFER);
            bench.set(stream(5), 6 << 25 | size << 11 | size << 13 | 1 << 6 | control | EN);
            bench.set(TIM1 + DIER, 1 << 8);
            let mut wanted = [0u8; 12];
            for transfer in 0..2u32 {
                bench.set(TIM1 + EGR, 1);
                bench.pass(0);
                for byte in 0..bytes {
                    let to = (transfer * peripheral_step + byte) as usize;
                    wanted[to] = 0xA0 + (transfer * memory_step + byte) as u8;
                }
            }
            let got = [bench.get(GPIOB + 0x20).to_le_bytes(), bench.get(GPIOB + 0x24).to_le_bytes()].concat();
            assert_eq!(got, wanted[..8], "size {size}, control {control:#x}");
        }
    }
}

#[test]
fn double_buffer_mode_changes_targets_at_each_end() {
    // 10.3.9: CT is the target now; it changes when NDTR has run down, which sets TCIF; NDTR is reloaded.
    const DBM: u32 = 1 << 18;
    const CT: u32 = 1 << 19;
    let mut bench = ring(0, 4, DBM | CIRC | TCIE, DDS);
    bench.set(ADC1 + 8, 0);
    bench.set(stream(0), 0);
    bench.set(LIFCR, 0x3D);
    bench.set(stream(0) + M1AR, BUFFER + 8);
    bench.set(stream(0) + NDTR, 4);
    bench.set(stream(0), HALF | MINC | DBM | CIRC | TCIE | EN);
    bench.set(ADC1 + 8, 1 | DMA | DDS | 6 << 24 | 1 << 28);
    bench.to(4500);
    assert_eq!((bench.get(LISR) & TCIF, bench.get(stream(0)) & CT), (TCIF, CT));
    assert_eq!(bench.get(stream(0) + NDTR), 4);
    bench.set(LIFCR, 0x3D);
    bench.to(6500);
    assert_eq!(buffer(&mut bench, 8), [10, 20, 30, 40, 50, 60, 0, 0]);
    assert_eq!((bench.get(LISR) & TCIF, bench.get(stream(0) + NDTR)), (0, 2));
    bench.to(8500);
    assert_eq!((bench.get(LISR) & TCIF, bench.get(stream(0)) & CT), (TCIF, 0));
    bench.to(12_500);
    assert_eq!(buffer(&mut bench, 8), [90, 100, 110, 120, 50, 60, 70, 80]);
    assert_eq!(bench.lint_texts(), [] as [String; 0]);
}

#[test]
fn a_forced_overrun_is_recovered_as_in_the_manual() {
    // 13.8.1: OVR is set, no request comes and triggers are ignored, until the stream is set up again and OVR is cleared.
    let mut bench = ring(0, 4, CIRC, DDS);
    bench.to(2500);
    bench.soc.force_overrun(0);
    bench.to(9500);
    assert_eq!(bench.get(ADC1) & OVR, OVR);
    assert_eq!(buffer(&mut bench, 4), [10, 20, 0, 0]);
    bench.set(stream(0), 0);
    bench.set(LIFCR, 0x3D);
    bench.set(stream(0) + NDTR, 4);
    bench.set(stream(0), HALF | MINC | CIRC | EN);
    bench.set(ADC1, !OVR);
    bench.to(11_500);
    assert_eq!(buffer(&mut bench, 4), [100, 110, 0, 0]);
}

#[test]
fn a_failed_transfer_stops_the_stream() {
    // 10.3.19: TEIF, and the stream is off.
    let mut bench = ring(0, 4, CIRC | TEIE, DDS);
    bench.to(2500);
    bench.soc.fail_next_transfer(1, 0);
    bench.to(3500);
    assert_eq!((bench.get(LISR), bench.get(stream(0)) & EN), (TEIF | HTIF, 0));
    assert!(bench.irq(56));
}
