//! Trace of what the core executes in a run.

use std::io::Write;
use std::path::Path;
use std::rc::Rc;

use anyhow::Result;
use stm32f4_model::Width;

use super::BoardRun;
use crate::cpu::{CONTROL_FPCA, Cpu, Reg};
use crate::execution_trace::{Event, ExecutionTrace};

/// The control register of the flash interface (RM0090 3.9.1).
const FLASH_ACR: u32 = 0x4002_3C00;

impl<W: Write> BoardRun<'_, W> {
    /// Writes what the core executes to a file, from now on.
    ///
    /// # Errors
    /// The file cannot be written, or the emulator refuses a hook.
    pub(crate) fn trace_execution(&mut self, path: &Path) -> Result<()> {
        let trace = Rc::new(ExecutionTrace::create(path)?);
        self.cpu.trace_execution(&trace)?;
        self.trace = Some(trace);
        Ok(())
    }

    /// Writes an event, if the run has a trace.
    pub(super) fn trace(&self, event: Event) {
        if let Some(trace) = &self.trace {
            trace.borrow_mut().note(event);
        }
    }

    /// Writes that an exception is taken, before its frame is made.
    pub(super) fn trace_exception(&self, number: u8, chained: bool) {
        if self.trace.is_some() {
            let floating = self.cpu.reg(Reg::Control) & CONTROL_FPCA != 0;
            self.trace(Event::Exception { number, floating, chained });
        }
    }

    /// Writes that a millisecond has passed.
    pub(super) fn trace_millisecond(&self) {
        if let Some(trace) = &self.trace {
            let flash_control = self.cpu.machine().soc.read(FLASH_ACR, Width::Word);
            let mut trace = trace.borrow_mut();
            trace.note_flash_control(flash_control);
            trace.note(Event::Millisecond);
        }
    }

    /// Writes what is left of the trace.
    ///
    /// # Errors
    /// A write failed.
    pub(super) fn finish_trace(&self) -> Result<()> {
        self.trace.as_ref().map_or(Ok(()), |trace| trace.borrow_mut().finish())
    }
}
