//! Exceptions, faults, lock-up and semihosting during a run.

use std::io::Write;

use super::{Idle, Run};
use crate::cpu::{CONTROL_FPCA, Cpu, Reg};
use crate::exception::{self, ReturnFault};
use crate::fault::{self, Answer, Cause};
use crate::inject::Kind;
use crate::nvic;
use crate::report::{self, Line};
use crate::semihosting;

/// Cycles from an exception to its handler's first instruction (Cortex-M4 TRM 3.9.1, no wait states).
const ENTRY_CYCLES: u64 = 12;
/// Cycles of an exception return.
const RETURN_CYCLES: u64 = 10;
/// Cycles from the end of a handler to the next one without unstacking.
const TAIL_CHAIN_CYCLES: u64 = 6;
/// Faults told one by one; the rest are only counted.
const FAULT_LINES: u64 = 50;

impl<W: Write> Run<'_, W> {
    /// Takes exception `number`; the program counter to return to is `return_to`.
    pub(super) fn take(&mut self, number: u8, return_to: u32) {
        self.exceptions += 1;
        let Some(handler) = self.vector(number) else { return };
        if self.cpu.reg(Reg::Control) & CONTROL_FPCA != 0 {
            self.cpu.machine().fpu_used();
        }
        // The NVIC is lent to the frame's writer: the processor and the board are two halves of one cell.
        let mut nvic = std::mem::take(&mut self.cpu.machine().nvic);
        let entered = exception::enter(&mut self.cpu, &mut nvic, number, handler, return_to, self.options.broken);
        let mut board = self.cpu.machine();
        board.nvic = nvic;
        board.event = true;
        board.spend(ENTRY_CYCLES);
        drop(board);
        // A frame that HardFault itself could not write changes nothing more.
        if entered.is_err() && number != nvic::HARD_FAULT {
            let pc = self.cpu.reg(Reg::Pc);
            self.fault(Cause::Stacking, pc);
        }
    }

    /// Address of a handler; a bad vector becomes a HardFault, or locks the core up.
    pub(super) fn vector(&mut self, number: u8) -> Option<u32> {
        let table = self.cpu.machine().scs.vtor;
        let handler = self.cpu.read_word(table + 4 * u32::from(number)).filter(|handler| handler & 1 != 0);
        if handler.is_none() {
            let pc = self.cpu.reg(Reg::Pc);
            if number == nvic::HARD_FAULT {
                self.lock_up(Cause::Vector, pc);
            } else {
                self.cpu.machine().nvic.unpend(number);
                self.fault(Cause::Vector, pc);
            }
        }
        handler
    }

    pub(super) fn exception_return(&mut self, value: u32) {
        let checked = exception::check_return(&self.cpu, &self.cpu.machine().nvic, value);
        let number = match checked {
            Ok(number) => number,
            Err(_) => return self.fault(Cause::Return, value & !1),
        };
        let mut nvic = std::mem::take(&mut self.cpu.machine().nvic);
        exception::deactivate(&mut self.cpu, &mut nvic, number);
        let masks = self.cpu.masks();
        let next = nvic.deliverable(masks);
        self.cpu.machine().nvic = nvic;
        self.cpu.machine().event = true;
        if let Some(next) = next {
            self.tail_chain(next, value);
            return;
        }
        match exception::unstack(&mut self.cpu, value, self.options.broken) {
            Ok(()) => {
                let mut board = self.cpu.machine();
                board.spend(RETURN_CYCLES);
                let sleeps = board.scs.sleeps_on_exit();
                drop(board);
                if sleeps && self.cpu.exception() == 0 {
                    self.idle = Idle::ForInterrupt;
                }
            }
            Err(ReturnFault::Stack(_)) => self.fault(Cause::Unstacking, value & !1),
            Err(ReturnFault::Invalid) => self.fault(Cause::Return, value & !1),
        }
    }

    /// Starts the next handler on the frame of the one that has just ended.
    pub(super) fn tail_chain(&mut self, number: u8, exc_return: u32) {
        self.exceptions += 1;
        let Some(handler) = self.vector(number) else { return };
        let mut nvic = std::mem::take(&mut self.cpu.machine().nvic);
        exception::vector(&mut self.cpu, &mut nvic, number, handler, exc_return, self.options.broken);
        let mut board = self.cpu.machine();
        board.nvic = nvic;
        board.spend(TAIL_CHAIN_CYCLES);
    }

    /// Answers for something that went wrong at `pc`, or for a supervisor call.
    pub(super) fn fault(&mut self, cause: Cause, pc: u32) {
        let masks = self.cpu.masks();
        let answer = {
            let board = &mut *self.cpu.machine();
            fault::answer(cause, &mut board.scs, &board.nvic, masks)
        };
        match answer {
            Answer::Take(number) => {
                if number < nvic::SV_CALL {
                    self.tell_fault(number, cause, pc);
                }
                self.take(number, pc);
            }
            Answer::LockUp => self.lock_up(cause, pc),
        }
    }

    pub(super) fn lock_up(&mut self, cause: Cause, pc: u32) {
        self.idle = Idle::LockedUp;
        self.locked_up = true;
        self.report.line(&Line::Lockup { t_s: self.now_s(), cause: cause.name(), pc: format!("0x{pc:08X}") });
    }

    pub(super) fn tell_fault(&mut self, exception: u8, cause: Cause, pc: u32) {
        self.faults += 1;
        let now = self.stamp();
        let (armed, high) = self.outputs();
        let mut explained = false;
        for injection in &mut self.injections {
            if matches!(injection.kind, Kind::Fault(_)) && injection.expected() {
                injection.show(now, armed, high);
            }
            explained |= injection.took_effect();
        }
        self.unexpected_faults += u64::from(!explained);
        if self.faults <= FAULT_LINES {
            let function = self.image.function_at(pc & !1).map(str::to_owned);
            let t_s = report::seconds(now.seconds);
            self.report.line(&Line::Fault { t_s, exception, cause: cause.name(), pc: format!("0x{pc:08X}"), function });
        }
    }

    pub(super) fn outputs(&self) -> (bool, bool) {
        let board = self.cpu.machine();
        (board.plant.pulses.armed(), board.plant.pulses.any_high())
    }

    pub(super) fn semihosting(&mut self) -> Option<&'static str> {
        let pc = self.cpu.reg(Reg::Pc);
        self.cpu.set_reg(Reg::Pc, pc + 2);
        match semihosting::call(&mut self.cpu) {
            semihosting::Answer::Exit(status) => {
                self.status = Some(status);
                return Some("semihosting");
            }
            semihosting::Answer::Text(text) => self.report.line(&Line::Semihosting { t_s: self.now_s(), text }),
            semihosting::Answer::Unknown(operation) => {
                eprintln!("virtual-board: semihosting operation 0x{operation:02X} is not answered");
            }
        }
        None
    }
}
