//! Register access: checks address, width, clock and reset, then reads or writes the register in its block.

use super::Soc;
use crate::bus::Width;
use crate::chip::Chip;
use crate::lint::LintKind;
use crate::memory_map::{Model, PeripheralBlock, Widths, locate};

impl Soc {
    /// Reads a peripheral register, with the side effects of the read. An access that is not modelled, clocked or allowed returns 0 and is
    /// recorded as a lint.
    pub fn read(&mut self, addr: u32, width: Width) -> u32 {
        let value = self.read_register(addr, width);
        self.refresh_if_stale();
        value
    }

    /// [`Soc::read`] without the update of interrupt lines and next event.
    pub(super) fn read_register(&mut self, addr: u32, width: Width) -> u32 {
        match self.reach(addr, width, false) {
            Err(kind) => {
                self.lint(addr, width, kind, None);
                0
            }
            Ok((block, offset)) => {
                let register = offset & !3;
                self.advance_block(block.model);
                let Some(word) = self.peek(block.model, register) else {
                    self.lint(addr, width, LintKind::Unmodelled, None);
                    return 0;
                };
                if let Model::Adc(index) = block.model {
                    self.adcs[index].after_read(register);
                    self.stale = true;
                }
                if let Model::Tim(number) = block.model
                    && self.timers[number].after_read(register)
                {
                    self.refresh();
                }
                if block.model == Model::Usart2 {
                    self.usart2.after_read(register);
                    self.stale = true;
                }
                word >> ((offset & 3) * 8) & width.mask()
            }
        }
    }

    /// Writes a peripheral register. An access that is not modelled, clocked or allowed is ignored and recorded as a lint.
    pub fn write(&mut self, addr: u32, width: Width, value: u32) {
        self.write_register(addr, width, value);
        self.refresh_if_stale();
    }

    /// [`Soc::write`] without the update of interrupt lines and next event.
    pub(super) fn write_register(&mut self, addr: u32, width: Width, value: u32) {
        match self.reach(addr, width, true) {
            Err(kind) => self.lint(addr, width, kind, Some(value)),
            Ok((block, offset)) => {
                let register = offset & !3;
                self.advance_block(block.model);
                // A narrow write keeps the other bytes. Registers with bits that act when written read as 0: no effect.
                let shift = (offset & 3) * 8;
                let lanes = width.mask() << shift;
                let rest = if lanes == u32::MAX { 0 } else { self.peek(block.model, register).unwrap_or(0) & !lanes };
                let mut lints = Vec::new();
                self.write_block(block.model, register, (value << shift & lanes) | rest, &mut lints);
                for kind in lints {
                    self.lint(addr, width, kind, Some(value));
                }
                self.stale = true;
            }
        }
    }

    /// Finds the block and offset of an access.
    ///
    /// # Errors
    /// The reason why the access has no effect.
    fn reach(&self, addr: u32, width: Width, write: bool) -> Result<(&'static PeripheralBlock, u32), LintKind> {
        let (block, offset) = locate(addr).ok_or(LintKind::Unmodelled)?;
        if block.model == Model::None || !block.exists(self.config.chip) {
            return Err(LintKind::Unmodelled);
        }
        if !addr.is_multiple_of(width.bytes()) {
            return Err(LintKind::Unaligned);
        }
        let allowed = match (block.widths, write) {
            (Widths::Any, _) | (Widths::WriteHalf | Widths::WriteWord, false) => true,
            (Widths::WriteHalf, true) | (Widths::Half, _) => width >= Width::Half,
            (Widths::WriteWord, true) | (Widths::Word, _) => width == Width::Word,
        };
        if !allowed {
            return Err(LintKind::Width);
        }
        if !self.clocked(block) {
            return Err(LintKind::Unclocked);
        }
        if block.reset.is_some_and(|gate| self.rcc.in_reset(gate)) {
            return Err(LintKind::InReset);
        }
        Ok((block, offset))
    }

    fn clocked(&self, block: &PeripheralBlock) -> bool {
        match block.model {
            // The common registers are clocked with any of the three converters.
            Model::AdcCommon => (0..3).any(|index| self.adc_enabled(index)),
            _ => block.enable.is_none_or(|gate| self.rcc.enabled(gate)),
        }
    }

    /// Advances a timer to the present cycle.
    fn advance_block(&mut self, model: Model) {
        let now = self.now;
        if let Model::Tim(number) = model {
            let before = self.timers[number].next_event();
            // Used signals were routed by the advance to the present cycle.
            let _ = self.timers[number].run_to(now);
            self.schedule_stale |= self.timers[number].next_event() != before;
        }
    }

    fn peek(&self, model: Model, offset: u32) -> Option<u32> {
        match model {
            Model::Tim(number) => self.timers[number].peek(offset),
            Model::Adc(index) => self.adcs[index].peek(offset),
            Model::AdcCommon => self.adc_common.peek(offset, [0, 1, 2].map(|index| self.adcs[index].status())),
            Model::Dma(index) => self.dma[index].peek(offset),
            Model::Gpio(port) => self.gpio[port].peek(offset),
            Model::Rcc => self.rcc.peek(offset),
            Model::Pwr => self.pwr.peek(offset),
            Model::Flash => self.flash.peek(offset),
            Model::Syscfg => self.syscfg.peek(offset),
            Model::Exti => self.exti.peek(offset),
            Model::Iwdg => self.iwdg.peek(offset, self.lsi.periods(self.time.seconds(self.now))),
            Model::Usart2 => self.usart2.peek(offset),
            Model::Dbgmcu => self.dbgmcu.peek(offset),
            Model::SystemMemory => self.factory_data(offset),
            Model::None => None,
        }
    }

    /// Word of the factory data in system memory (RM0090 39.1, 39.2, RM0383 24.1, 24.2; data sheet 6.3.22, 6.3.24).
    fn factory_data(&self, offset: u32) -> Option<u32> {
        let temperature = |celsius: f64| ((0.76 + 0.0025 * (celsius - 25.0)) / 3.3 * 4095.0).round() as u32;
        match offset {
            0x10 | 0x14 | 0x18 => Some(self.config.unique_id[(offset as usize - 0x10) / 4]),
            // The size is the upper half of the word.
            0x20 => Some((self.config.chip.flash_bytes() / 1024) << 16),
            // VREFINT_CAL and, above it, the temperature sensor at 30 and 110 degrees.
            0x28 => Some(u32::from(self.config.vrefint_cal()) << 16),
            0x2C => Some(temperature(30.0) | temperature(110.0) << 16),
            _ => None,
        }
    }

    fn write_block(&mut self, model: Model, offset: u32, value: u32, lints: &mut Vec<LintKind>) {
        let now = self.now;
        match model {
            Model::Tim(number) => {
                let signals = self.timers[number].write(offset, value, now, lints);
                if offset == crate::tim::bits::BDTR && self.timers[number].break_without_pin() {
                    lints.push(LintKind::Misuse("the break is enabled (BDTR.BKE), but no pin is connected to BKIN"));
                }
                self.pass_signals(number, signals);
                if self.timers[number].features.measures.is_some() {
                    self.schedule_low_speed();
                }
            }
            Model::Adc(index) => {
                self.adcs[index].write(offset, value, now, lints);
                self.update_used_signals();
            }
            Model::AdcCommon => {
                self.adc_common.write(offset, value, lints);
                self.apply_clock_tree();
            }
            Model::Dma(index) => self.dma[index].write(offset, value, index, lints),
            Model::Gpio(port) => {
                self.gpio[port].write(offset, value, lints);
                self.port_written(port, offset);
            }
            Model::Rcc => {
                for timer in &mut self.timers {
                    // Up to the present cycle by the old clock.
                    let _ = timer.run_to(now);
                }
                let before = self.clocks;
                self.rcc.write(offset, value, self.pwr.backup_writable(), lints);
                self.apply_clock_tree();
                if self.clocks != before {
                    self.check_ratings(lints);
                }
            }
            Model::Pwr => {
                self.pwr.write(offset, value, self.rcc.pll_on(), lints);
                self.update_voltage_detector();
                if self.config.chip == Chip::F411 {
                    self.check_ratings(lints);
                }
            }
            Model::Flash => {
                let seconds = self.time.seconds(now);
                self.flash.write(offset, value, seconds, lints);
                self.schedule_flash_end();
                if offset == 0 {
                    self.check_ratings(lints);
                }
            }
            Model::Syscfg => {
                self.syscfg.write(offset, value, lints);
                self.pins_changed();
            }
            Model::Exti => self.exti.write(offset, value, lints),
            Model::Iwdg => {
                let periods = self.lsi.periods(self.time.seconds(now));
                self.iwdg.write(offset, value, periods, lints);
                self.schedule_low_speed();
            }
            Model::Usart2 => self.usart2.write(offset, value, now, lints),
            Model::Dbgmcu => {
                self.dbgmcu.write(offset, value, lints);
                if self.halted {
                    self.set_halted(true);
                }
            }
            Model::SystemMemory => lints.push(LintKind::Misuse("system memory is read only")),
            Model::None => lints.push(LintKind::Unmodelled),
        }
    }
}
