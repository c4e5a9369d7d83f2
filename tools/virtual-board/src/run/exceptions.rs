//! Exceptions, faults, lock-up and semihosting during a run.

use std::io::Write;

use super::{BoardRun, IdleState};
use crate::cpu::{CONTROL_FPCA, Cpu, Reg};
use crate::exception::{self, ReturnFault};
use crate::execution_trace::Event;
use crate::fault::{self, FaultCause, FaultResponse};
use crate::inject::InjectionKind;
use crate::nvic;
use crate::probe::core::HaltReason;
use crate::pulses::OutputState;
use crate::report::{self, ReportLine};
use crate::semihosting::{self, SemihostingRequest};

/// Cycles from an exception to the first instruction of its handler (Cortex-M4 TRM 3.9.1, no wait states).
const ENTRY_CYCLES: u64 = 12;
/// Cycles of an exception return.
const RETURN_CYCLES: u64 = 10;
/// Cycles from the end of a handler to the next one without unstacking.
const TAIL_CHAIN_CYCLES: u64 = 6;
/// Number of faults that are reported one by one; later ones are only counted.
const FAULT_LINES: u64 = 50;

impl<W: Write> BoardRun<'_, W> {
    /// Takes exception `number`. Its handler will return to the address `return_to`.
    pub(super) fn take_exception(&mut self, number: u8, return_to: u32) {
        self.exceptions += 1;
        let Some(handler) = self.read_vector(number) else { return };
        if self.cpu.reg(Reg::Control) & CONTROL_FPCA != 0 {
            self.cpu.machine().note_fpu_use();
        }
        self.trace_exception(number, false);
        // The NVIC is moved out meanwhile: `enter` needs the processor, whose cell also holds the board.
        let mut nvic = std::mem::take(&mut self.cpu.machine().nvic);
        let entered = exception::enter(&mut self.cpu, &mut nvic, number, handler, return_to);
        let mut board = self.cpu.machine();
        board.nvic = nvic;
        board.event = true;
        board.add_cycles(ENTRY_CYCLES);
        drop(board);
        // A stacking error of HardFault itself has no further effect.
        if entered.is_err() && number != nvic::HARD_FAULT {
            let pc = self.cpu.reg(Reg::Pc);
            self.handle_fault(FaultCause::Stacking, pc);
        }
    }

    /// Address of the handler of an exception; `None` for a bad vector, which becomes a HardFault or locks the core up.
    pub(super) fn read_vector(&mut self, number: u8) -> Option<u32> {
        let table = self.cpu.machine().scs.vtor;
        let handler = self.cpu.read_word(table + 4 * u32::from(number)).filter(|handler| handler & 1 != 0);
        if handler.is_none() {
            let pc = self.cpu.reg(Reg::Pc);
            if number == nvic::HARD_FAULT {
                self.lock_up(FaultCause::Vector, pc);
            } else {
                self.cpu.machine().nvic.unpend(number);
                self.handle_fault(FaultCause::Vector, pc);
            }
        }
        handler
    }

    pub(super) fn exception_return(&mut self, value: u32) {
        let checked = exception::check_return(&self.cpu, &self.cpu.machine().nvic, value);
        let number = match checked {
            Ok(number) => number,
            Err(_) => return self.handle_fault(FaultCause::Return, value & !1),
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
        match exception::unstack(&mut self.cpu, value) {
            Ok(()) => {
                self.trace(Event::Return);
                let mut board = self.cpu.machine();
                board.add_cycles(RETURN_CYCLES);
                let sleeps = board.scs.sleeps_on_exit();
                drop(board);
                if sleeps && self.cpu.exception() == 0 {
                    self.idle = IdleState::ForInterrupt;
                }
            }
            Err(ReturnFault::Stack(_)) => self.handle_fault(FaultCause::Unstacking, value & !1),
            Err(ReturnFault::Invalid) => self.handle_fault(FaultCause::Return, value & !1),
        }
    }

    /// Starts the next handler with the frame of the handler that has just ended.
    pub(super) fn tail_chain(&mut self, number: u8, exc_return: u32) {
        self.exceptions += 1;
        let Some(handler) = self.read_vector(number) else { return };
        self.trace_exception(number, true);
        let mut nvic = std::mem::take(&mut self.cpu.machine().nvic);
        exception::start_handler(&mut self.cpu, &mut nvic, number, handler, exc_return);
        let mut board = self.cpu.machine();
        board.nvic = nvic;
        board.add_cycles(TAIL_CHAIN_CYCLES);
    }

    /// Takes the exception of a fault at `pc` or of a supervisor call, or locks the core up.
    pub(super) fn handle_fault(&mut self, cause: FaultCause, pc: u32) {
        let masks = self.cpu.masks();
        let response = {
            let board = &mut *self.cpu.machine();
            fault::respond(cause, &mut board.scs, &board.nvic, masks)
        };
        match response {
            FaultResponse::Take(number) => {
                if number < nvic::SV_CALL {
                    self.report_fault(number, cause, pc);
                }
                self.take_exception(number, pc);
                let is_caught = self.cpu.machine().scs.debug.catches(cause.vector_catches(number));
                if is_caught && self.idle == IdleState::No {
                    self.halt_core(HaltReason::VectorCatch);
                }
            }
            FaultResponse::LockUp => self.lock_up(cause, pc),
        }
    }

    pub(super) fn lock_up(&mut self, cause: FaultCause, pc: u32) {
        self.idle = IdleState::LockedUp;
        self.locked_up = true;
        self.report.line(&ReportLine::Lockup { t_s: self.now_s(), cause: cause.name(), pc: format!("0x{pc:08X}") });
    }

    pub(super) fn report_fault(&mut self, exception: u8, cause: FaultCause, pc: u32) {
        self.faults += 1;
        let now = self.moment();
        let outputs = self.output_state();
        let mut explained = false;
        for injection in &mut self.injections {
            if matches!(injection.kind, InjectionKind::Fault(_)) && injection.awaits_effect() {
                injection.note_effect(now, outputs);
            }
            explained |= injection.took_effect();
        }
        self.unexpected_faults += u64::from(!explained);
        if self.faults <= FAULT_LINES {
            let function = self.image.function_at(pc & !1).map(str::to_owned);
            let t_s = report::seconds(now.seconds);
            self.report.line(&ReportLine::Fault {
                t_s,
                exception,
                cause: cause.name(),
                pc: format!("0x{pc:08X}"),
                function,
            });
        }
    }

    pub(super) fn output_state(&self) -> OutputState {
        self.cpu.machine().plant.pulses.state()
    }

    pub(super) fn serve_semihosting(&mut self) -> Option<&'static str> {
        let pc = self.cpu.reg(Reg::Pc);
        self.cpu.set_reg(Reg::Pc, pc + 2);
        match semihosting::serve(&mut self.cpu) {
            SemihostingRequest::Exit(status) => {
                self.status = Some(status);
                return Some("semihosting");
            }
            SemihostingRequest::Text(text) => self.report.line(&ReportLine::Semihosting { t_s: self.now_s(), text }),
            SemihostingRequest::Unknown(operation) => {
                eprintln!(
                    "virtual-board: semihosting operation 0x{operation:02X} is not supported; supported are 0x04, 0x18 and 0x20"
                );
            }
        }
        None
    }
}
