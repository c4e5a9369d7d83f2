//! Tests of USART2: baud rate, flags, and its DMA requests.

use stm32f4_model::{DmaMemory, Width};

use crate::bench::*;

const USART2: u32 = 0x4000_4400;
const DMA1: u32 = 0x4002_6000;
const DR: u32 = USART2 + 4;
const BRR: u32 = USART2 + 8;
const CONTROL1: u32 = USART2 + 12;
const CONTROL2: u32 = USART2 + 16;
const CONTROL3: u32 = USART2 + 20;
const ORE: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const TXE: u32 = 1 << 7;
const ON: u32 = 1 << 13 | 1 << 3 | 1 << 2;
const IRQ: u32 = 38;
const STREAM5: u32 = DMA1 + 0x10 + 0x18 * 5;
const STREAM6: u32 = DMA1 + 0x10 + 0x18 * 6;
const MEMORY: u32 = 0x2000_0100;

/// The port at a divisor, after its first idle frame, on PA2 and PA3. HCLK and the bus run at 16 MHz.
fn port(brr: u32, control1: u32) -> Bench {
    let mut bench = Bench::clocked();
    bench.set(APB1ENR, 0x1000_003F | 1 << 17);
    bench.function("PA2", 2, 7);
    bench.function("PA3", 2, 7);
    bench.set(BRR, brr);
    bench.set(CONTROL1, ON | control1);
    bench.pass(20_000);
    bench
}

#[test]
fn registers_have_their_reset_values() {
    // 30.6: SR 0x00C0, all others 0; without clock nothing is read.
    let mut bench = Bench::clocked();
    assert_eq!(bench.get(USART2), 0);
    assert!(bench.lint_texts()[0].contains("clock"), "{:?}", bench.lint_texts());
    bench.set(APB1ENR, 0x1000_003F | 1 << 17);
    assert_eq!(bench.get(USART2), 0xC0);
    assert_eq!([DR, BRR, CONTROL1, CONTROL2, CONTROL3].map(|addr| bench.get(addr)), [0; 5]);
}

#[test]
fn the_divisor_sets_the_rate() {
    // 30.3.4: by 16, a bit takes BRR cycles of the bus clock; by 8 (OVER8), 8 DIV_Mantissa + DIV_Fraction.
    for (brr, control1, control2, cycles) in [
        (0x8B, 0, 0, 10 * 139),
        (16, 0, 0, 160),
        (0x683, 0, 0, 10 * 1667),
        (0x0115, 1 << 15, 0, 10 * (0x11 * 8 + 5)),
        // 30.6.5: two stop bits.
        (16, 0, 2 << 12, 176),
    ] {
        let mut bench = port(brr, control1);
        bench.set(CONTROL2, control2);
        bench.set(DR, 0x55);
        bench.pass(cycles - 1);
        assert_eq!(bench.soc.take_serial(), [], "{brr:#x}");
        bench.pass(1);
        assert_eq!(bench.soc.take_serial(), [0x55], "{brr:#x}");
        assert_eq!(bench.lint_texts(), [""; 0]);
    }
}

#[test]
fn the_bus_clock_sets_the_rate_and_not_hclk() {
    // 7.2: PCLK1 is a quarter of HCLK here; 21 divides 42 MHz to 2 Mbaud: 84 cycles of HCLK a bit.
    let mut bench = Bench::clocked();
    bench.run_at_168_mhz();
    bench.set(APB1ENR, 0x1000_003F | 1 << 17);
    bench.function("PA2", 2, 7);
    bench.set(BRR, 21);
    bench.set(CONTROL1, ON);
    bench.pass(10_000);
    bench.set(DR, 1);
    bench.pass(839);
    assert_eq!(bench.soc.take_serial(), []);
    bench.pass(1);
    assert_eq!(bench.soc.take_serial(), [1]);
}

#[test]
fn txe_and_tc_as_in_figure_297() {
    let mut bench = port(16, 0);
    // 30.3.2: the first character moves to the shift register at once: TXE stays; the second waits.
    assert_eq!(bench.get(USART2), TXE | TC);
    bench.set(DR, 1);
    assert_eq!(bench.get(USART2), TXE, "TC is cleared by reading SR and writing DR");
    bench.set(DR, 2);
    assert_eq!(bench.get(USART2) & (TXE | TC), 0);
    bench.pass(160);
    assert_eq!(bench.get(USART2) & (TXE | TC), TXE);
    bench.pass(159);
    assert_eq!(bench.get(USART2) & (TXE | TC), TXE);
    bench.pass(1);
    assert_eq!(bench.get(USART2) & (TXE | TC), TXE | TC);
    assert_eq!(bench.soc.take_serial(), [1, 2]);
    // 30.6.1: TC is cleared by writing 0.
    bench.set(USART2, !TC);
    assert_eq!(bench.get(USART2) & (TXE | TC), TXE);
    // Written too soon.
    bench.set(DR, 3);
    bench.set(DR, 4);
    bench.set(DR, 5);
    assert!(bench.lint_texts()[0].contains("TXE is 0"), "{:?}", bench.lint_texts());
}

#[test]
fn the_first_frame_is_idle() {
    // 30.3.2: setting TE sends an idle frame before the first character.
    let mut bench = port(16, 0);
    bench.set(CONTROL1, 0);
    bench.set(CONTROL1, ON);
    bench.set(DR, 7);
    bench.pass(319);
    assert_eq!(bench.soc.take_serial(), []);
    bench.pass(1);
    assert_eq!(bench.soc.take_serial(), [7]);
}

#[test]
fn a_character_without_its_pin_stays_inside() {
    let mut bench = port(16, 0);
    bench.function("PA2", 0, 7);
    bench.set(DR, 7);
    bench.pass(200);
    assert_eq!(bench.soc.take_serial(), []);
    assert!(bench.lint_texts()[0].contains("PA2"), "{:?}", bench.lint_texts());
}

#[test]
fn a_character_sets_rxne_and_an_idle_line_idle() {
    let mut bench = port(16, 0);
    bench.soc.put_serial(&[0xA5]);
    bench.pass(159);
    assert_eq!(bench.get(USART2) & (RXNE | IDLE), 0);
    bench.pass(1);
    assert_eq!(bench.get(USART2) & (RXNE | IDLE), RXNE);
    assert_eq!(bench.get(DR), 0xA5);
    assert_eq!(bench.get(USART2) & (RXNE | IDLE), 0);
    // 30.3.3: a frame of ones; cleared by reading SR, then DR; set again only after a character.
    bench.pass(160);
    assert_eq!(bench.get(USART2) & (RXNE | IDLE), IDLE);
    bench.get(DR);
    assert_eq!(bench.get(USART2) & (RXNE | IDLE), 0);
    bench.pass(10_000);
    assert_eq!(bench.get(USART2) & IDLE, 0);
}

#[test]
fn an_overrun_keeps_the_character_before() {
    // 30.3.3: ORE is set, RDR is not lost, the shift register is.
    let mut bench = port(16, 0);
    bench.soc.put_serial(&[1, 2, 3]);
    bench.pass(480);
    assert_eq!(bench.get(USART2) & (RXNE | ORE), RXNE | ORE);
    assert_eq!(bench.get(DR), 1);
    assert_eq!(bench.get(USART2) & (RXNE | ORE), 0);
    bench.soc.put_serial(&[4]);
    bench.pass(160);
    assert_eq!(bench.get(DR), 4);
}

#[test]
fn flags_reach_the_interrupt_only_when_enabled() {
    // 30.4: TXEIE, TCIE, RXNEIE, IDLEIE are the bits of their flags; ORE comes with RXNEIE.
    for (enable, set) in [(TXE, true), (TC, true), (RXNE, false), (IDLE, false)] {
        let mut bench = port(16, 0);
        assert!(!bench.irq(IRQ));
        bench.set(CONTROL1, ON | enable);
        assert_eq!(bench.irq(IRQ), set, "{enable:#x}");
        bench.soc.put_serial(&[1]);
        bench.pass(320);
        assert!(bench.irq(IRQ), "{enable:#x}");
    }
}

#[test]
fn dma1_sends_by_stream_6_and_receives_by_stream_5_on_channel_4() {
    // 10.3.3, table 42: USART2_TX stream 6, USART2_RX stream 5, both channel 4; 30.3.13.
    const ENABLE: u32 = 1;
    for channel in [4, 5] {
        let mut bench = port(16, 0);
        for n in 0..4 {
            bench.ram.write(MEMORY + n, Width::Byte, 0x40 + n);
        }
        for (stream, direction, memory) in [(STREAM6, 1 << 6, MEMORY), (STREAM5, 1 << 8, MEMORY + 16)] {
            bench.set(stream + 4, 4);
            bench.set(stream + 8, DR);
            bench.set(stream + 12, memory);
            bench.set(stream, channel << 25 | 1 << 10 | direction);
            bench.set(stream, channel << 25 | 1 << 10 | direction | ENABLE);
        }
        bench.set(USART2, !TC);
        bench.set(CONTROL3, 1 << 7 | 1 << 6);
        bench.soc.put_serial(&[1, 2, 3, 4, 5]);
        bench.pass(4 * 160 + 1);
        let sent = bench.soc.take_serial();
        bench.pass(160);
        let received: Vec<u32> = (0..4).filter_map(|n| bench.ram.read(MEMORY + 16 + n, Width::Byte)).collect();
        if channel == 4 {
            assert_eq!(sent, [0x40, 0x41, 0x42, 0x43]);
            // Circular: the fifth is the first again.
            assert_eq!((received, bench.get(STREAM5 + 4)), (vec![5, 2, 3, 4], 3));
            assert_eq!((bench.get(STREAM6) & ENABLE, bench.get(STREAM6 + 4)), (0, 0));
            assert_eq!(bench.get(USART2) & (TC | ORE), TC);
        } else {
            assert_eq!((sent, received), (vec![], vec![0; 4]));
        }
        assert_eq!(bench.lint_texts(), [""; 0]);
    }
}

#[test]
fn what_is_not_modelled_is_reported() {
    for (register, value) in [(CONTROL1, ON | 1 << 12), (CONTROL2, 1 << 14), (CONTROL3, 1 << 9)] {
        let mut bench = port(16, 0);
        bench.set(register, value);
        assert!(bench.lint_texts()[0].contains("USART"), "{:?}", bench.lint_texts());
    }
}

#[test]
fn a_reset_clears_the_port() {
    // 7.3.8: bit 17 of RCC_APB1RSTR.
    let mut bench = port(16, 0);
    bench.set(RCC + 0x20, 1 << 17);
    bench.set(RCC + 0x20, 0);
    assert_eq!((bench.get(CONTROL1), bench.get(BRR), bench.get(USART2)), (0, 0, 0xC0));
}
