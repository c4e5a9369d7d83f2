//! What a debugger at the probe does to core and memory (ARMv7-M ARM, part C1).

use std::io::Write;
use std::time::Instant;

use anyhow::Result;
use stm32f4_model::Width;

use super::{BoardRun, IdleState};
use crate::addresses::{FLASH, FLASH_SIZE};
use crate::cpu::{Cpu, Machine as _, Reg, XPSR_EXCEPTION};
use crate::probe::adi::DebugBus;
use crate::probe::core::{self, CoreActivity, HaltReason, Request};
use crate::probe::{Event, ProbeServer};
use crate::report::ReportLine;
use crate::unicorn::is_device;

/// The private peripheral bus.
const PRIVATE_BUS: std::ops::Range<u32> = 0xE000_0000..0xE010_0000;
/// Application interrupt and reset control; with VECTCLRACTIVE.
const AIRCR: u32 = 0xE000_ED0C;
const AIRCR_KEY: u32 = 0x05FA;
const VECTCLRACTIVE: u32 = 1 << 1;
/// Registers of the flash interface.
const FLASH_REGISTERS: std::ops::Range<u32> = 0x4002_3C00..0x4002_3C18;

/// REGSEL of DCRSR (C1.6.3).
const CONTROL_AND_MASKS: u8 = 20;

/// The register that DCRSR selects; `None`: it is [`CONTROL_AND_MASKS`], or there is none.
const fn register(selector: u8) -> Option<Reg> {
    Some(match selector {
        0..=12 => Reg::R(selector),
        13 => Reg::Sp,
        14 => Reg::Lr,
        15 => Reg::Pc,
        16 => Reg::Xpsr,
        17 => Reg::Msp,
        18 => Reg::Psp,
        33 => Reg::Fpscr,
        64..=95 => Reg::S(selector - 64),
        _ => return None,
    })
}

impl<W: Write> BoardRun<'_, W> {
    /// Serves the client of the probe, and lets no more virtual time pass than real time, where that is wanted.
    pub(super) fn follow_real_time(&mut self) -> Result<()> {
        let Some(mut probe) = self.probe.take() else {
            if self.options.pace {
                let due = self.pace.due(self.cpu.machine().seconds());
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
            }
            return Ok(());
        };
        let served = self.serve(&mut probe);
        self.probe = Some(probe);
        served
    }

    fn serve(&mut self, probe: &mut ProbeServer) -> Result<()> {
        loop {
            let seconds = self.cpu.machine().seconds();
            // A core that stands still until a debugger comes would let time fly.
            let stands_still = matches!(self.idle, IdleState::Halted | IdleState::LockedUp);
            let until = if self.options.pace || probe.is_connected() || stands_still {
                if !self.options.pace {
                    self.pace.follow(seconds);
                }
                self.pace.due(seconds)
            } else {
                Instant::now()
            };
            match probe.next(until) {
                None => return Ok(()),
                Some(Event::Command(command)) => {
                    probe.answer(&command, self);
                    self.settle();
                    if let Some(error) = self.failure.take() {
                        return Err(error);
                    }
                }
                Some(event) => {
                    let connected = event == Event::Connected;
                    self.report.line(&ReportLine::ProbeClient { t_s: self.now_s(), connected });
                    self.report.flush();
                }
            }
        }
    }

    /// Carries out what an access has caused: changes of the flash, a reset.
    fn settle(&mut self) {
        let settled = self.try_to_settle();
        self.failure = self.failure.take().or(settled.err());
    }

    fn try_to_settle(&mut self) -> Result<()> {
        let (reset, changes) = {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            board.sync(&mut memory);
            (board.reset, board.soc.take_flash_operations())
        };
        self.change_flash(&changes)?;
        match reset {
            Some(cause) => self.carry_out_reset(cause),
            None => Ok(()),
        }
    }

    /// Halts the core.
    pub(super) fn halt_core(&mut self, reason: HaltReason) {
        self.locked_at = (self.idle == IdleState::LockedUp).then(|| self.cpu.reg(Reg::Pc));
        self.idle = IdleState::Halted;
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        board.scs.debug.halt(reason);
        board.soc.halt();
        board.sync(&mut memory);
    }

    fn resume_core(&mut self) {
        let pc = self.cpu.reg(Reg::Pc);
        // A core that was locked up is so again, unless the debugger has given it another address.
        let is_locked_up = self.locked_at.take() == Some(pc);
        self.idle = if is_locked_up { IdleState::LockedUp } else { IdleState::No };
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        board.scs.debug.go_on();
        board.soc.resume();
        board.sync(&mut memory);
    }

    /// Executes one instruction, or takes an exception, and halts again.
    fn step_core(&mut self) -> Result<()> {
        self.resume_core();
        if self.idle == IdleState::LockedUp {
            return Ok(());
        }
        if let Some(number) = self.deliverable() {
            let pc = self.cpu.reg(Reg::Pc);
            self.take_exception(number, pc);
        } else {
            let stop = self.cpu.step()?;
            // A semihosting call halts as any other BKPT.
            self.handle_stop(stop);
        }
        // A wait does not wait: the request to halt ends it. A core that locked up is not halted (C1.6.2).
        if self.idle != IdleState::LockedUp && self.idle != IdleState::Halted {
            self.halt_core(HaltReason::Request);
        }
        Ok(())
    }

    /// Sets the hardware break points by the comparators.
    pub(super) fn set_breakpoints(&mut self) -> Result<()> {
        if self.probe.is_none() && self.options.probe.is_none() {
            return Ok(());
        }
        let addresses = self.cpu.machine().scs.debug.breakpoints();
        self.cpu.set_breakpoints(&addresses)
    }

    fn activity(&self) -> CoreActivity {
        CoreActivity {
            sleeps: matches!(self.idle, IdleState::ForInterrupt | IdleState::ForEvent),
            is_locked_up: self.idle == IdleState::LockedUp,
        }
    }

    /// Carries out a transfer between DCRDR and a register, which works only while the core is halted.
    fn transfer_register(&mut self, selection: u32) {
        if self.idle != IdleState::Halted {
            return;
        }
        let (selector, is_write) = ((selection & 0x7F) as u8, selection >> 16 & 1 != 0);
        let data = self.cpu.machine().scs.debug.data;
        match (register(selector), is_write) {
            (Some(register), false) => {
                let value = self.cpu.reg(register);
                self.cpu.machine().scs.debug.data = value;
            }
            (Some(Reg::Xpsr), true) => {
                let control = self.cpu.reg(Reg::Control);
                self.cpu.set_mode(data, control);
            }
            (Some(register), true) => self.cpu.set_reg(register, data),
            (None, _) if selector != CONTROL_AND_MASKS => {}
            (None, false) => {
                let [control, fault, base, primask] =
                    [Reg::Control, Reg::Faultmask, Reg::Basepri, Reg::Primask].map(|register| self.cpu.reg(register));
                self.cpu.machine().scs.debug.data =
                    control << 24 | (fault & 1) << 16 | (base & 0xFF) << 8 | primask & 1;
            }
            (None, true) => {
                let xpsr = self.cpu.reg(Reg::Xpsr);
                self.cpu.set_mode(xpsr, data >> 24 & 7);
                self.cpu.set_reg(Reg::Faultmask, data >> 16 & 1);
                self.cpu.set_reg(Reg::Basepri, data >> 8 & 0xFF);
                self.cpu.set_reg(Reg::Primask, data & 1);
            }
        }
    }

    fn read_private_bus(&mut self, addr: u32) -> u32 {
        let activity = self.activity();
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        let debug = &mut board.scs.debug;
        match addr {
            core::DHCSR => return debug.read_dhcsr(activity),
            core::DCRDR => return debug.data,
            core::DCRSR => return 0,
            _ => {}
        }
        if let Some(word) = debug.read_breakpoint_unit(addr) {
            return word;
        }
        let chip = board.soc.config().chip;
        if let Some(word) = core::identification(chip, addr) {
            return word;
        }
        board.is_debugger = true;
        let word = board.load(addr, Width::Word, &mut memory);
        board.is_debugger = false;
        word
    }

    fn write_private_bus(&mut self, addr: u32, width: Width, value: u32) -> Result<()> {
        match addr {
            core::DHCSR => {
                let request = self.cpu.machine().scs.debug.write_dhcsr(value);
                match request {
                    Request::None => {}
                    Request::Halt => self.halt_core(HaltReason::Request),
                    Request::Resume => self.resume_core(),
                    Request::Step => self.step_core()?,
                }
                // They act only with C_DEBUGEN.
                return self.set_breakpoints();
            }
            core::DCRSR => {
                self.transfer_register(value);
                return Ok(());
            }
            core::DCRDR => {
                self.cpu.machine().scs.debug.data = value;
                return Ok(());
            }
            _ => {}
        }
        let is_breakpoint = self.cpu.machine().scs.debug.write_breakpoint_unit(addr, value);
        if is_breakpoint {
            return self.set_breakpoints();
        }
        if addr == AIRCR && value >> 16 == AIRCR_KEY && value & VECTCLRACTIVE != 0 && self.idle == IdleState::Halted {
            self.cpu.machine().nvic.clear_active();
            let (xpsr, control) = (self.cpu.reg(Reg::Xpsr), self.cpu.reg(Reg::Control));
            self.cpu.set_mode(xpsr & !XPSR_EXCEPTION, control);
        }
        self.store_to_device(addr, width, value);
        Ok(())
    }

    fn store_to_device(&mut self, addr: u32, width: Width, value: u32) {
        let (mut board, mut memory) = self.cpu.machine_and_memory();
        board.is_debugger = true;
        board.store(addr, width, value, &mut memory);
        board.is_debugger = false;
    }

    /// Lets a flash operation end, as the bus makes an access to the flash or its interface wait.
    fn wait_for_flash(&mut self) {
        {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            if board.soc.flash_ends_at().is_none() {
                return;
            }
            board.wait_for_flash(&mut memory);
        }
        self.settle();
    }
}

/// The debugger's accesses are those of another master at the same bus: with the side effects of the core's own.
impl<W: Write> DebugBus for BoardRun<'_, W> {
    fn load(&mut self, addr: u32, width: Width) -> Option<u32> {
        if PRIVATE_BUS.contains(&addr) {
            // Words only: a narrower access takes its part.
            let word = self.read_private_bus(addr & !3);
            return Some(word >> (8 * (addr & 3)) & width.mask());
        }
        if is_device(addr) {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            board.is_debugger = true;
            let value = board.load(addr, width, &mut memory);
            board.is_debugger = false;
            return Some(value);
        }
        let mut bytes = [0; 4];
        self.cpu.read_memory(addr, &mut bytes[..width.bytes() as usize]).then(|| u32::from_le_bytes(bytes))
    }

    fn store(&mut self, addr: u32, width: Width, value: u32) -> bool {
        if PRIVATE_BUS.contains(&addr) {
            let written = self.write_private_bus(addr, width, value);
            self.failure = self.failure.take().or(written.err());
            return true;
        }
        let is_flash = addr & !FLASH < FLASH_SIZE;
        if is_flash || FLASH_REGISTERS.contains(&addr) {
            self.wait_for_flash();
        }
        if is_device(addr) {
            self.store_to_device(addr, width, value);
            return true;
        }
        if is_flash {
            let (mut board, mut memory) = self.cpu.machine_and_memory();
            // Without PG it only sets an error flag.
            board.soc.store_to_flash(FLASH | addr, width, value);
            board.sync(&mut memory);
            return true;
        }
        let length = width.bytes() as usize;
        if !self.cpu.write_ram(addr, &value.to_le_bytes()[..length]) {
            return false;
        }
        let dropped = self.cpu.drop_code(addr, length);
        self.failure = self.failure.take().or(dropped.err());
        true
    }

    fn pull_reset_pin(&mut self, low: bool) {
        self.cpu.machine().soc.pull_reset_pin(low);
    }
}
