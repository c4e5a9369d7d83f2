//! Effects of RCC on the blocks: their clocks and resets, and the check of the clocks against the ratings of the chip.

use super::Soc;
use crate::adc::AdcCommonRegisters;
use crate::chip::Chip;
use crate::dma::Dma;
use crate::exti::Syscfg;
use crate::gpio::Gpio;
use crate::lint::LintKind;
use crate::memory_map::{BLOCKS, Bus, Model};
use crate::pwr::Pwr;
use crate::tim::{TIMERS, Timer};
use crate::usart::Usart;

/// Bit number of RCC_APB2ENR.ADC1EN; those of ADC2 and ADC3 follow.
const ADC1_BIT: u8 = 8;

impl Soc {
    pub(super) fn adc_enabled(&self, index: usize) -> bool {
        self.rcc.enabled((Bus::Apb2, ADC1_BIT + index as u8))
    }

    /// Applies the state of RCC to all blocks. The caller must first advance the timers to the present cycle.
    pub(super) fn apply_clock_tree(&mut self) {
        for block in &BLOCKS {
            if block.reset.is_some_and(|gate| self.rcc.in_reset(gate)) {
                self.reset_block(block.model);
            }
        }
        self.clocks = self.rcc.clocks();
        self.time.change(self.now, self.clocks.hclk);
        let runs = !self.rcc.stopped();
        for block in &BLOCKS {
            let Model::Tim(number) = block.model else { continue };
            let is_frozen = self.halted && self.dbgmcu.stops_timer(number);
            let on = runs && !is_frozen && block.enable.is_some_and(|gate| self.rcc.enabled(gate));
            let clock = self.clocks.timer(TIMERS[number].apb);
            self.timers[number].set_clock(self.now, on.then_some(clock));
        }
        for index in 0..self.adcs.len() {
            let on = runs && self.adc_enabled(index);
            let clock = self.clocks.apb[1] * self.adc_common.divider();
            self.adcs[index].set_clock(on.then_some(clock));
        }
        self.usart2.set_divider(self.clocks.apb[0]);
        // 7.2.7: a failure that the clock security system detects acts on the break inputs.
        let failed = self.rcc.nmi();
        for number in [1, 8] {
            self.timers[number].set_clock_failed(failed);
        }
        self.schedule_low_speed();
        self.schedule_flash_end();
        self.schedule_release();
        self.route_pins();
        for port in 0..self.gpio.len() {
            self.port_changed(port);
        }
        self.pins_changed();
        self.update_used_signals();
    }

    fn reset_block(&mut self, model: Model) {
        match model {
            Model::Tim(number) => self.timers[number] = Timer::new(&TIMERS[number], self.now),
            Model::Adc(index) => self.adcs[index].reset(),
            Model::AdcCommon => self.adc_common = AdcCommonRegisters::default(),
            Model::Dma(index) => self.dma[index] = Dma::new(),
            Model::Gpio(port) => self.gpio[port] = Gpio::new(port),
            Model::Pwr => self.pwr = Pwr::new(self.config.chip),
            Model::Syscfg => self.syscfg = Syscfg::default(),
            Model::Usart2 => self.usart2 = Usart::new(),
            // These have no reset bit in RCC.
            Model::Rcc
            | Model::Flash
            | Model::Exti
            | Model::Iwdg
            | Model::Dbgmcu
            | Model::SystemMemory
            | Model::None => {}
        }
    }

    /// Checks the clocks against the ratings of the chip at 2.7 to 3.6 V.
    pub(super) fn check_ratings(&self, lints: &mut Vec<LintKind>) {
        let hclk = self.clocks.hclk;
        let [pclk1, pclk2] = self.clocks.apb.map(|divider| hclk / divider as f64);
        let ratings = self.config.chip.ratings();
        let states = self.flash.wait_states() as usize;
        // More wait states than the table has are allowed.
        let readable = ratings.flash.get(states).copied().unwrap_or(f64::INFINITY);
        // Without the PLL the F411 runs at most at 26 MHz, which every scale allows.
        let allowed = ratings.hclk[self.pwr.voltage_scale()];
        let chip = self.config.chip;
        let rules = [
            (hclk > allowed && chip == Chip::F407, "HCLK is above its rating of 168 MHz"),
            (hclk > 100e6 && chip == Chip::F411, "HCLK is above its rating of 100 MHz"),
            (
                hclk > allowed && hclk <= 100e6 && chip == Chip::F411,
                "HCLK is above its rating at the scale of the regulator in PWR_CR.VOS: 64, 84 and 100 MHz at scale 3, 2 and 1",
            ),
            (pclk1 > ratings.pclk[0] && chip == Chip::F407, "PCLK1 is above its rating of 42 MHz"),
            (pclk2 > ratings.pclk[1] && chip == Chip::F407, "PCLK2 is above its rating of 84 MHz"),
            (pclk1 > ratings.pclk[0] && chip == Chip::F411, "PCLK1 is above its rating of 50 MHz"),
            (pclk2 > ratings.pclk[1] && chip == Chip::F411, "PCLK2 is above its rating of 100 MHz"),
            (
                hclk > readable && chip == Chip::F407,
                "HCLK is too fast for the flash wait states in FLASH_ACR: 30 MHz for each wait state plus one",
            ),
            (
                hclk > readable && chip == Chip::F411,
                "HCLK is too fast for the flash wait states in FLASH_ACR: 30, 64, 90, 100 MHz for 0 to 3 wait states",
            ),
        ];
        lints.extend(rules.iter().filter(|(broken, _)| *broken).map(|&(_, text)| LintKind::Misuse(text)));
    }
}
