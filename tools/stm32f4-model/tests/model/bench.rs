//! Test bench: the modelled chip with test inputs, a recorder of its outputs and RAM for DMA.

use stm32f4_model::{AdcChannel, DmaMemory, Pin, Plant, Soc, SocConfig, Width};

pub(crate) const TIM1: u32 = 0x4001_0000;
pub(crate) const TIM2: u32 = 0x4000_0000;
pub(crate) const TIM3: u32 = 0x4000_0400;
pub(crate) const TIM5: u32 = 0x4000_0C00;
pub(crate) const TIM6: u32 = 0x4000_1000;
pub(crate) const ADC1: u32 = 0x4001_2000;
pub(crate) const ADC_CCR: u32 = 0x4001_2304;
pub(crate) const DMA2: u32 = 0x4002_6400;
pub(crate) const GPIOA: u32 = 0x4002_0000;
pub(crate) const GPIOB: u32 = 0x4002_0400;
pub(crate) const GPIOD: u32 = 0x4002_0C00;
pub(crate) const EXTI: u32 = 0x4001_3C00;
pub(crate) const SYSCFG: u32 = 0x4001_3800;
pub(crate) const IWDG: u32 = 0x4000_3000;
pub(crate) const RCC: u32 = 0x4002_3800;
pub(crate) const FLASH_ACR: u32 = 0x4002_3C00;
pub(crate) const AHB1ENR: u32 = RCC + 0x30;
pub(crate) const APB1ENR: u32 = RCC + 0x40;
pub(crate) const APB2ENR: u32 = RCC + 0x44;
pub(crate) const APB2RSTR: u32 = RCC + 0x24;

// Offsets in a timer.
pub(crate) const CR1: u32 = 0x00;
pub(crate) const CR2: u32 = 0x04;
pub(crate) const DIER: u32 = 0x0C;
pub(crate) const SR: u32 = 0x10;
pub(crate) const EGR: u32 = 0x14;
pub(crate) const CCMR1: u32 = 0x18;
pub(crate) const CCMR2: u32 = 0x1C;
pub(crate) const CCER: u32 = 0x20;
pub(crate) const CNT: u32 = 0x24;
pub(crate) const PSC: u32 = 0x28;
pub(crate) const ARR: u32 = 0x2C;
pub(crate) const RCR: u32 = 0x30;
pub(crate) const CCR1: u32 = 0x34;
pub(crate) const BDTR: u32 = 0x44;

/// Plant of the tests: supplies the inputs and records the outputs.
pub(crate) struct TestPlant {
    /// Voltage of each channel over time.
    pub(crate) volts: Box<dyn Fn(AdcChannel, f64) -> f64>,
    /// Time, s, pin and level of each input change, in the order of time; a pin is low before its first.
    pub(crate) inputs: Vec<(f64, Pin, bool)>,
    /// Pins that nothing drives.
    pub(crate) open: Vec<Pin>,
    /// True: announces input changes; false: the chip must poll.
    pub(crate) announces: bool,
    /// Requests an input sample at once, always.
    pub(crate) look_now: bool,
    pub(crate) vdda: Option<f64>,
    /// Recorded changes of outputs: pin, level, time in s.
    pub(crate) edges: Vec<(Pin, bool, f64)>,
    /// When each channel was sampled.
    pub(crate) sampled: Vec<(AdcChannel, f64)>,
    /// Number of input levels read.
    pub(crate) level_reads: usize,
}

impl Plant for TestPlant {
    fn volts(&mut self, channel: AdcChannel, seconds: f64) -> f64 {
        self.sampled.push((channel, seconds));
        (self.volts)(channel, seconds)
    }

    fn input_level(&mut self, pin: Pin, seconds: f64) -> bool {
        self.level_reads += 1;
        self.inputs.iter().rev().find(|&&(at, of, _)| of == pin && at <= seconds).is_some_and(|&(.., level)| level)
    }

    fn input_floats(&mut self, pin: Pin, _seconds: f64) -> bool {
        self.open.contains(&pin)
    }

    fn record_edge(&mut self, pin: Pin, level: bool, seconds: f64) {
        self.edges.push((pin, level, seconds));
    }

    fn next_pin_change(&self, seconds: f64) -> Option<f64> {
        if self.look_now {
            return Some(seconds);
        }
        let next = self.inputs.iter().map(|&(at, ..)| at).find(|&at| at > seconds);
        self.announces.then_some(next.unwrap_or(f64::INFINITY))
    }

    fn vdda(&mut self, _seconds: f64) -> Option<f64> {
        self.vdda
    }
}

/// 4 KiB of RAM at 0x2000_0000.
pub(crate) struct Ram(pub(crate) Vec<u8>);

impl DmaMemory for Ram {
    fn read(&mut self, addr: u32, width: Width) -> Option<u32> {
        let start = addr.checked_sub(0x2000_0000)? as usize;
        let bytes = self.0.get(start..start + width.bytes() as usize)?;
        Some(bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte)))
    }

    fn write(&mut self, addr: u32, width: Width, value: u32) -> bool {
        let Some(start) = addr.checked_sub(0x2000_0000) else { return false };
        let range = start as usize..(start + width.bytes()) as usize;
        let Some(bytes) = self.0.get_mut(range) else { return false };
        bytes.copy_from_slice(&value.to_le_bytes()[..width.bytes() as usize]);
        true
    }
}

pub(crate) struct Bench {
    pub(crate) soc: Soc,
    pub(crate) plant: TestPlant,
    pub(crate) ram: Ram,
}

pub(crate) fn pin(name: &str) -> Pin {
    name.parse().unwrap_or_else(|error| panic!("{error}"))
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with(SocConfig::default())
    }

    pub(crate) fn with(config: SocConfig) -> Self {
        let plant = TestPlant {
            volts: Box::new(|_, _| 0.0),
            inputs: Vec::new(),
            open: Vec::new(),
            announces: true,
            look_now: false,
            vdda: None,
            edges: Vec::new(),
            sampled: Vec::new(),
            level_reads: 0,
        };
        Bench { soc: Soc::new(config), plant, ram: Ram(vec![0; 4096]) }
    }

    /// A bench with all blocks that the tests use clocked: ports A to D, DMA, timers 1 to 7, ADC1 to ADC3, SYSCFG.
    pub(crate) fn clocked() -> Self {
        let mut bench = Self::new();
        bench.clock_all();
        bench
    }

    pub(crate) fn clock_all(&mut self) {
        self.set(AHB1ENR, 0x0060_000F);
        self.set(APB1ENR, 0x1000_003F);
        self.set(APB2ENR, 0x0000_4703);
    }

    /// HSE through the PLL to 168 MHz, APB1 / 4, APB2 / 2: timers 84 and 168 MHz.
    pub(crate) fn run_at_168_mhz(&mut self) {
        self.set(FLASH_ACR, 0x705);
        self.set(RCC, 0x1_0083);
        self.set(RCC + 4, 4 | 168 << 6 | 1 << 22 | 7 << 24);
        self.set(RCC, 0x101_0083);
        self.set(RCC + 8, 2 | 5 << 10 | 4 << 13);
    }

    pub(crate) fn set(&mut self, addr: u32, value: u32) {
        self.soc.write(addr, Width::Word, value);
    }

    pub(crate) fn get(&mut self, addr: u32) -> u32 {
        self.soc.read(addr, Width::Word)
    }

    /// Advances to an absolute cycle in one call.
    pub(crate) fn to(&mut self, cycle: u64) {
        self.soc.advance_to(cycle, &mut self.plant, &mut self.ram);
    }

    /// Advances by a number of cycles in one call.
    pub(crate) fn pass(&mut self, cycles: u64) {
        self.to(self.soc.now() + cycles);
    }

    pub(crate) fn irq(&self, number: u32) -> bool {
        self.soc.irq_lines()[number as usize / 32] >> (number % 32) & 1 != 0
    }

    /// Sets a pin's mode and alternate function.
    pub(crate) fn function(&mut self, name: &str, mode: u32, af: u32) {
        let pin = pin(name);
        let base = GPIOA + 0x400 * pin.port_index() as u32;
        let number = u32::from(pin.number());
        let (register, shift) = (base + 0x20 + number / 8 * 4, number % 8 * 4);
        let value = self.get(register) & !(0xF << shift) | af << shift;
        self.set(register, value);
        let value = self.get(base) & !(3 << (number * 2)) | mode << (number * 2);
        self.set(base, value);
    }

    /// Recorded changes of one output: level and time in s.
    pub(crate) fn edges_of(&self, name: &str) -> Vec<(bool, f64)> {
        let pin = pin(name);
        self.plant.edges.iter().filter(|&&(of, ..)| of == pin).map(|&(_, level, at)| (level, at)).collect()
    }

    /// The texts of all lints.
    pub(crate) fn lint_texts(&self) -> Vec<String> {
        self.soc.lints().iter().map(|lint| lint.to_string()).collect()
    }
}
