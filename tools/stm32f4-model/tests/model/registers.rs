//! Tests of reset values and writable bits of registers without side effects, from the register maps of RM0090.

use crate::bench::*;

/// Address, value after reset, value after all bits but those in `spare` were written 1.
type Row = (u32, u32, u32, u32);

fn check(base: u32, rows: &[Row]) {
    for &(offset, reset, spare, written) in rows {
        let mut bench = Bench::new();
        bench.set(AHB1ENR, 0x0060_01FF);
        bench.set(APB1ENR, 0x1000_01FF);
        bench.set(APB2ENR, 0x0007_4703);
        assert_eq!(bench.get(base + offset), reset, "reset value of {base:08X}+{offset:02X}");
        bench.set(base + offset, !spare);
        assert_eq!(bench.get(base + offset), written, "{base:08X}+{offset:02X} after writing all but {spare:X}");
        bench.set(base + offset, 0);
    }
}

#[test]
fn rcc() {
    // 7.3. `oracle` checks the enables one by one; this test checks that reserved bits read as 0.
    check(
        RCC,
        &[
            (0x00, 0x83, 0, 0x83 & 2 | 0x0F0F_00F9),
            (0x04, 0x2400_3010, 0, 0x2F43_7FFF),
            (0x08, 0, 3, 0xFFFF_FCF0),
            (0x0C, 0, 0, 0x3F00),
            (0x10, 0, 0, 0x2260_11FF),
            (0x14, 0, 0, 0xF1),
            (0x18, 0, 0, 1),
            (0x20, 0, 0, 0x36FE_C9FF),
            (0x24, 0, 0, 0x0007_5933),
            (0x34, 0, 0, 0xF1),
            (0x38, 0, 0, 1),
            (0x50, 0x7E67_91FF, 0, 0x7E67_91FF),
            (0x54, 0xF1, 0, 0xF1),
            (0x58, 1, 0, 1),
            (0x60, 0x36FE_C9FF, 0, 0x36FE_C9FF),
            (0x64, 0x0007_5F33, 0, 0x0007_5F33),
            (0x70, 0, 0, 0),
            (0x74, 0x0E00_0000, 0, 3),
            (0x80, 0, 0, 0xCFFF_FFFF),
            (0x84, 0x2000_3000, 0, 0x7000_7FC0),
            (0x8C, 0, u32::MAX, 0),
        ],
    );
    let mut bench = Bench::new();
    assert_eq!(bench.get(AHB1ENR), 0x0010_0000);
    for (register, bits) in [(AHB1ENR, 0x7E74_11FF), (APB1ENR, 0x36FE_C9FF), (APB2ENR, 0x0007_5F33)] {
        bench.set(register, u32::MAX);
        assert_eq!(bench.get(register), bits);
    }
}

#[test]
fn advanced_timer() {
    // 17.4.21.
    check(
        TIM1,
        &[
            (0x00, 0, 1, 0x3FE),
            (0x04, 0, 0, 0x7FFD),
            (0x08, 0, 0, 0xFFF7),
            (0x0C, 0, 0, 0x7FFF),
            (0x10, 0, 0, 0),
            (0x14, 0, u32::MAX, 0),
            (0x18, 0, 0x303, 0xFCFC),
            (0x1C, 0, 0x303, 0xFCFC),
            (0x20, 0, 0, 0x3FFF),
            (0x24, 0, 0, 0xFFFF),
            (0x28, 0, 0, 0xFFFF),
            (0x2C, 0xFFFF, 0, 0xFFFF),
            (0x30, 0, 0, 0xFF),
            (0x34, 0, 0, 0xFFFF),
            (0x38, 0, 0, 0xFFFF),
            (0x3C, 0, 0, 0xFFFF),
            (0x40, 0, 0, 0xFFFF),
            (0x44, 0, 0, 0xFFFF),
        ],
    );
}

#[test]
fn general_timers() {
    // 18.4.21: TIM2 with its input option.
    check(
        TIM2,
        &[
            (0x00, 0, 1, 0x3FE),
            (0x04, 0, 0, 0xF8),
            (0x08, 0, 0, 0xFFF7),
            (0x0C, 0, 0, 0x5F5F),
            (0x18, 0, 0x303, 0xFCFC),
            (0x20, 0, 0, 0xBBBB),
            (0x24, 0, 0, u32::MAX),
            (0x2C, u32::MAX, 0, u32::MAX),
            (0x34, 0, 0, u32::MAX),
            (0x40, 0, 0, u32::MAX),
            (0x50, 0, 0xFFFF_F3FF, 0x0C00),
        ],
    );
    // 19.4.13, 19.5.12: TIM9, TIM10; 20.4.9: TIM6.
    let (tim9, tim10) = (0x4001_4000, 0x4001_4400);
    check(
        tim9,
        &[(0x00, 0, 1, 0x38E), (0x0C, 0, 0, 0x47), (0x18, 0, 0x303, 0xFCFC), (0x20, 0, 0, 0xBB), (0x38, 0, 0, 0xFFFF)],
    );
    check(
        tim10,
        &[(0x00, 0, 1, 0x38E), (0x0C, 0, 0, 3), (0x18, 0, 0x303, 0xFC), (0x20, 0, 0, 0xB), (0x34, 0, 0, 0xFFFF)],
    );
    check(TIM6, &[(0x00, 0, 1, 0x8E), (0x04, 0, 0, 0x70), (0x0C, 0, 0, 0x101), (0x2C, 0xFFFF, 0, 0xFFFF)]);
}

#[test]
fn adc_registers() {
    // 13.13.18.
    check(
        ADC1,
        &[
            (0x00, 0, 0, 0),
            (0x04, 0, 0, 0x07C0_FFFF),
            (0x08, 0, 1 << 22 | 1 << 30, 0x3F3F_0F03),
            (0x0C, 0, 0, 0x07FF_FFFF),
            (0x10, 0, 0, 0x3FFF_FFFF),
            (0x14, 0, 0, 0xFFF),
            (0x18, 0, 0, 0xFFF),
            (0x1C, 0, 0, 0xFFF),
            (0x20, 0, 0, 0xFFF),
            (0x24, 0xFFF, 0, 0xFFF),
            (0x28, 0, 0, 0xFFF),
            (0x2C, 0, 0, 0x00FF_FFFF),
            (0x30, 0, 0, 0x3FFF_FFFF),
            (0x34, 0, 0, 0x3FFF_FFFF),
            (0x38, 0, 0, 0x003F_FFFF),
            (0x3C, 0, 0, 0),
            (0x4C, 0, 0, 0),
            (0x304, 0, 0, 0x00C3_EF1F),
        ],
    );
}

#[test]
fn dma_registers() {
    // 10.5.11: every stream resets to FCR = 0x21 (FS: empty).
    for stream in 0..8 {
        let at = 0x10 + 0x18 * stream;
        check(
            DMA2,
            &[
                (at, 0, 1, 0x0FEF_FFFE),
                (at + 0x04, 0, 0, 0xFFFF),
                (at + 0x08, 0, 0, u32::MAX),
                (at + 0x0C, 0, 0, u32::MAX),
                (at + 0x10, 0, 0, u32::MAX),
                (at + 0x14, 0x21, 0, 0xA7),
            ],
        );
    }
    check(DMA2, &[(0x00, 0, 0, 0), (0x04, 0, 0, 0), (0x08, 0, 0, 0), (0x0C, 0, 0, 0)]);
}

#[test]
fn pins_and_lines() {
    // 8.4.11, 12.3.7, 9.2.9.
    for port in 2..9 {
        let base = GPIOA + 0x400 * port;
        check(
            base,
            &[
                (0x00, 0, 0, u32::MAX),
                (0x04, 0, 0, 0xFFFF),
                (0x08, 0, 0, u32::MAX),
                (0x0C, 0, 0, u32::MAX),
                (0x10, 0, 0, 0),
                (0x14, 0, 0, 0xFFFF),
                (0x18, 0, 0, 0),
                (0x1C, 0, 1 << 16, 0xFFFF),
                (0x20, 0, 0, u32::MAX),
                (0x24, 0, 0, u32::MAX),
            ],
        );
    }
    let lines = 0x7F_FFFF;
    check(
        EXTI,
        &[
            (0x00, 0, 0, lines),
            (0x04, 0, 0, lines),
            (0x08, 0, 0, lines),
            (0x0C, 0, 0, lines),
            (0x10, 0, 0, lines),
            (0x14, 0, 0, 0),
        ],
    );
    check(SYSCFG, &[(0x08, 0, 0, 0xFFFF), (0x14, 0, 0, 0xFFFF), (0x20, 0, 0, 0x101)]);
}

#[test]
fn power_flash_watchdog_debug() {
    // 5.4.5, 3.9.8, 21.4.5, 38.16.
    check(0x4000_7000, &[(0x00, 0x4000, 0, 0x43F3), (0x04, 0x4000, 0, 0x4308)]);
    check(
        FLASH_ACR,
        &[(0x00, 0, 0, 0x1F07), (0x0C, 0, 0, 0), (0x10, 1 << 31, 0, 1 << 31), (0x14, 0x0FFF_AAED, 0, 0x0FFF_AAED)],
    );
    check(IWDG, &[(0x00, 0, 0, 0), (0x04, 0, 0, 0), (0x08, 0xFFF, 0, 0xFFF), (0x0C, 0, 0, 0)]);
    check(0xE004_2000, &[(0x04, 0, 0, 0xE7), (0x08, 0, 0, 0x06E0_1DFF), (0x0C, 0, 0, 0x0007_0003)]);
}
