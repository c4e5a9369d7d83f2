//! Memory map: address, size, and RCC clock and reset bits of each peripheral block (RM0090 2.3 "Memory map", 7.3 "RCC registers"). The F411 has a part
//! of these blocks, at the same addresses and with the same bits (RM0383 2.3, 6.3).

use crate::chip::Chip;

/// Bus of a block. It selects the RCC enable and reset registers that hold the block's bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Bus {
    Ahb1,
    Ahb2,
    Ahb3,
    Apb1,
    Apb2,
}

/// Model that handles the accesses to a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Model {
    /// General timer: index in [`crate::tim::TIMERS`].
    Tim(usize),
    /// ADC 0 to 2.
    Adc(usize),
    AdcCommon,
    /// DMA controller 0 or 1.
    Dma(usize),
    /// Port 0 to 8.
    Gpio(usize),
    Rcc,
    Pwr,
    Flash,
    Syscfg,
    Exti,
    Iwdg,
    Usart2,
    Dbgmcu,
    /// Factory data in system memory, read only.
    SystemMemory,
    /// The block exists in the chip but is not modelled.
    None,
}

/// Access widths that the registers of a block allow (RM0090, each block's register chapter).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Widths {
    Any,
    /// Writes by half-words and words, reads by any width.
    WriteHalf,
    /// Writes by words only, reads by any width.
    WriteWord,
    /// Half-words and words for reads and writes.
    Half,
    /// Words only, for reads and writes.
    Word,
}

/// One block of the memory map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PeripheralBlock {
    pub(crate) name: &'static str,
    pub(crate) base: u32,
    pub(crate) size: u32,
    pub(crate) model: Model,
    pub(crate) widths: Widths,
    /// Bus and bit of the clock enable; `None`: always clocked.
    pub(crate) enable: Option<(Bus, u8)>,
    /// Bus and bit of the reset; `None`: no reset bit.
    pub(crate) reset: Option<(Bus, u8)>,
    /// The F411 has it too.
    pub(crate) in_f411: bool,
}

impl PeripheralBlock {
    /// True where a chip has the block.
    pub(crate) fn exists(&self, chip: Chip) -> bool {
        self.in_f411 || chip == Chip::F407
    }
}

const fn block(
    name: &'static str,
    base: u32,
    model: Model,
    widths: Widths,
    gate: Option<(Bus, u8)>,
) -> PeripheralBlock {
    PeripheralBlock { name, base, size: 0x400, model, widths, enable: gate, reset: gate, in_f411: true }
}

const fn other(name: &'static str, base: u32, gate: Option<(Bus, u8)>) -> PeripheralBlock {
    block(name, base, Model::None, Widths::Any, gate)
}

const fn tim(name: &'static str, base: u32, index: usize, bus: Bus, bit: u8) -> PeripheralBlock {
    block(name, base, Model::Tim(index), Widths::WriteHalf, Some((bus, bit)))
}

/// The three ADCs share one page and one reset bit; each has its own enable bit.
const fn adc(name: &'static str, base: u32, index: usize, bit: u8) -> PeripheralBlock {
    PeripheralBlock {
        name,
        base,
        size: 0x100,
        model: Model::Adc(index),
        widths: Widths::WriteWord,
        enable: Some((Bus::Apb2, bit)),
        reset: Some((Bus::Apb2, 8)),
        in_f411: true,
    }
}

/// A block that the F411 lacks (RM0383 2.3).
const fn only_f407(block: PeripheralBlock) -> PeripheralBlock {
    PeripheralBlock { in_f411: false, ..block }
}

const fn sized(block: PeripheralBlock, size: u32) -> PeripheralBlock {
    PeripheralBlock { size, ..block }
}

/// Every block, in the order of addresses.
pub(crate) static BLOCKS: [PeripheralBlock; 65] = [
    sized(block("SYSMEM", 0x1FFF_7A00, Model::SystemMemory, Widths::Any, None), 0x100),
    tim("TIM2", 0x4000_0000, 2, Bus::Apb1, 0),
    tim("TIM3", 0x4000_0400, 3, Bus::Apb1, 1),
    tim("TIM4", 0x4000_0800, 4, Bus::Apb1, 2),
    tim("TIM5", 0x4000_0C00, 5, Bus::Apb1, 3),
    only_f407(tim("TIM6", 0x4000_1000, 6, Bus::Apb1, 4)),
    only_f407(tim("TIM7", 0x4000_1400, 7, Bus::Apb1, 5)),
    only_f407(tim("TIM12", 0x4000_1800, 12, Bus::Apb1, 6)),
    only_f407(tim("TIM13", 0x4000_1C00, 13, Bus::Apb1, 7)),
    only_f407(tim("TIM14", 0x4000_2000, 14, Bus::Apb1, 8)),
    other("RTC", 0x4000_2800, None),
    other("WWDG", 0x4000_2C00, Some((Bus::Apb1, 11))),
    block("IWDG", 0x4000_3000, Model::Iwdg, Widths::Half, None),
    other("I2S2ext", 0x4000_3400, None),
    other("SPI2", 0x4000_3800, Some((Bus::Apb1, 14))),
    other("SPI3", 0x4000_3C00, Some((Bus::Apb1, 15))),
    other("I2S3ext", 0x4000_4000, None),
    block("USART2", 0x4000_4400, Model::Usart2, Widths::Any, Some((Bus::Apb1, 17))),
    only_f407(other("USART3", 0x4000_4800, Some((Bus::Apb1, 18)))),
    only_f407(other("UART4", 0x4000_4C00, Some((Bus::Apb1, 19)))),
    only_f407(other("UART5", 0x4000_5000, Some((Bus::Apb1, 20)))),
    other("I2C1", 0x4000_5400, Some((Bus::Apb1, 21))),
    other("I2C2", 0x4000_5800, Some((Bus::Apb1, 22))),
    other("I2C3", 0x4000_5C00, Some((Bus::Apb1, 23))),
    only_f407(other("CAN1", 0x4000_6400, Some((Bus::Apb1, 25)))),
    only_f407(other("CAN2", 0x4000_6800, Some((Bus::Apb1, 26)))),
    block("PWR", 0x4000_7000, Model::Pwr, Widths::Half, Some((Bus::Apb1, 28))),
    only_f407(other("DAC", 0x4000_7400, Some((Bus::Apb1, 29)))),
    tim("TIM1", 0x4001_0000, 1, Bus::Apb2, 0),
    only_f407(tim("TIM8", 0x4001_0400, 8, Bus::Apb2, 1)),
    other("USART1", 0x4001_1000, Some((Bus::Apb2, 4))),
    other("USART6", 0x4001_1400, Some((Bus::Apb2, 5))),
    adc("ADC1", 0x4001_2000, 0, 8),
    only_f407(adc("ADC2", 0x4001_2100, 1, 9)),
    only_f407(adc("ADC3", 0x4001_2200, 2, 10)),
    // Clocked with any of the three: see `Soc::clocked`.
    PeripheralBlock {
        name: "ADC",
        base: 0x4001_2300,
        size: 0x100,
        model: Model::AdcCommon,
        widths: Widths::WriteWord,
        enable: None,
        reset: Some((Bus::Apb2, 8)),
        in_f411: true,
    },
    other("SDIO", 0x4001_2C00, Some((Bus::Apb2, 11))),
    other("SPI1", 0x4001_3000, Some((Bus::Apb2, 12))),
    block("SYSCFG", 0x4001_3800, Model::Syscfg, Widths::Any, Some((Bus::Apb2, 14))),
    block("EXTI", 0x4001_3C00, Model::Exti, Widths::Word, None),
    tim("TIM9", 0x4001_4000, 9, Bus::Apb2, 16),
    tim("TIM10", 0x4001_4400, 10, Bus::Apb2, 17),
    tim("TIM11", 0x4001_4800, 11, Bus::Apb2, 18),
    block("GPIOA", 0x4002_0000, Model::Gpio(0), Widths::Any, Some((Bus::Ahb1, 0))),
    block("GPIOB", 0x4002_0400, Model::Gpio(1), Widths::Any, Some((Bus::Ahb1, 1))),
    block("GPIOC", 0x4002_0800, Model::Gpio(2), Widths::Any, Some((Bus::Ahb1, 2))),
    block("GPIOD", 0x4002_0C00, Model::Gpio(3), Widths::Any, Some((Bus::Ahb1, 3))),
    block("GPIOE", 0x4002_1000, Model::Gpio(4), Widths::Any, Some((Bus::Ahb1, 4))),
    only_f407(block("GPIOF", 0x4002_1400, Model::Gpio(5), Widths::Any, Some((Bus::Ahb1, 5)))),
    only_f407(block("GPIOG", 0x4002_1800, Model::Gpio(6), Widths::Any, Some((Bus::Ahb1, 6)))),
    block("GPIOH", 0x4002_1C00, Model::Gpio(7), Widths::Any, Some((Bus::Ahb1, 7))),
    only_f407(block("GPIOI", 0x4002_2000, Model::Gpio(8), Widths::Any, Some((Bus::Ahb1, 8)))),
    other("CRC", 0x4002_3000, Some((Bus::Ahb1, 12))),
    block("RCC", 0x4002_3800, Model::Rcc, Widths::Any, None),
    block("FLASH", 0x4002_3C00, Model::Flash, Widths::Any, None),
    only_f407(other("BKPSRAM", 0x4002_4000, Some((Bus::Ahb1, 18)))),
    block("DMA1", 0x4002_6000, Model::Dma(0), Widths::Any, Some((Bus::Ahb1, 21))),
    block("DMA2", 0x4002_6400, Model::Dma(1), Widths::Any, Some((Bus::Ahb1, 22))),
    only_f407(sized(other("ETH", 0x4002_8000, Some((Bus::Ahb1, 25))), 0x1400)),
    only_f407(sized(other("USB_OTG_HS", 0x4004_0000, Some((Bus::Ahb1, 29))), 0x4_0000)),
    sized(other("USB_OTG_FS", 0x5000_0000, Some((Bus::Ahb2, 7))), 0x4_0000),
    only_f407(other("DCMI", 0x5005_0000, Some((Bus::Ahb2, 0)))),
    only_f407(other("RNG", 0x5006_0800, Some((Bus::Ahb2, 6)))),
    only_f407(sized(other("FSMC", 0xA000_0000, Some((Bus::Ahb3, 0))), 0x1000)),
    block("DBGMCU", 0xE004_2000, Model::Dbgmcu, Widths::Any, None),
];

/// The pages of 1 KiB that hold most blocks: TIM2 to DMA2.
const PAGE: u32 = 0x400;
const PAGES_BASE: u32 = 0x4000_0000;
const PAGES: usize = 0xA0;

/// For each page, the index of the first block that ends above its start.
static FIRST_BLOCKS: [u8; PAGES] = {
    let mut first = [0; PAGES];
    let mut block = 0;
    let mut page = 0;
    while page < PAGES {
        while BLOCKS[block].base + BLOCKS[block].size <= PAGES_BASE + page as u32 * PAGE {
            block += 1;
        }
        first[page] = block as u8;
        page += 1;
    }
    first
};

/// Finds the block of an address, and the offset in it, bytes.
pub(crate) fn locate(addr: u32) -> Option<(&'static PeripheralBlock, u32)> {
    let page = (addr.wrapping_sub(PAGES_BASE) / PAGE) as usize;
    let from = FIRST_BLOCKS.get(page).map_or(0, |&first| usize::from(first));
    let block = BLOCKS[from..].iter().find(|block| addr < block.base + block.size)?;
    (addr >= block.base).then(|| (block, addr - block.base))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_in_order_and_do_not_overlap() {
        for pair in BLOCKS.windows(2) {
            assert!(pair[0].base + pair[0].size <= pair[1].base, "{} and {}", pair[0].name, pair[1].name);
        }
    }

    #[test]
    fn the_table_of_pages_finds_what_a_search_of_all_blocks_finds() {
        for addr in (0x4000_0000..0x4003_0000).step_by(0x40).chain((0x1FFF_7000..0x1FFF_8000).step_by(0x40)) {
            let searched = BLOCKS.iter().find(|block| (block.base..block.base + block.size).contains(&addr));
            let found = locate(addr).map(|(block, offset)| (block.name, offset));
            assert_eq!(found, searched.map(|block| (block.name, addr - block.base)), "{addr:#010x}");
        }
    }

    /// The blocks of the F411 are those that the access crate of embassy has at these addresses for it, and no other.
    #[test]
    fn the_f411_has_the_blocks_of_its_manual() {
        let names: Vec<&str> = BLOCKS.iter().filter(|block| block.exists(Chip::F411)).map(|block| block.name).collect();
        // RM0383 2.3, without SPI4 and SPI5, which the F407 lacks; SYSMEM and DBGMCU are of the core's map.
        let listed = "SYSMEM TIM2 TIM3 TIM4 TIM5 RTC WWDG IWDG I2S2ext SPI2 SPI3 I2S3ext USART2 I2C1 I2C2 I2C3 PWR TIM1 USART1 USART6 ADC1 ADC SDIO SPI1 \
                      SYSCFG EXTI TIM9 TIM10 TIM11 GPIOA GPIOB GPIOC GPIOD GPIOE GPIOH CRC RCC FLASH DMA1 DMA2 USB_OTG_FS DBGMCU";
        assert_eq!(names, listed.split_whitespace().collect::<Vec<_>>());
        assert!(BLOCKS.iter().all(|block| block.exists(Chip::F407)));
    }

    #[test]
    fn addresses_decode_to_block_and_offset() {
        let name = |addr| locate(addr).map(|(block, offset)| (block.name, offset));
        assert_eq!(name(0x4001_0044), Some(("TIM1", 0x44)));
        assert_eq!(name(0x4001_2304), Some(("ADC", 0x04)));
        assert_eq!(name(0x4001_20FF), Some(("ADC1", 0xFF)));
        assert_eq!(name(0x4000_2400), None);
        assert_eq!(name(0x2000_0000), None);
        assert_eq!(name(0xE004_2000), Some(("DBGMCU", 0)));
        assert_eq!(name(0xE000_ED00), None);
        assert_eq!(name(0), None);
    }
}
