//! Hooks of the processor for a trace of what it executes.

use std::cell::RefCell;
use std::rc::Rc;

use anyhow::Result;

use super::{Uc, UnicornCpu, convert_error, get};
use crate::addresses::FLASH;
use crate::cpu::{Machine, Reg};
use crate::execution_trace::{self, Event, ExecutionTrace};

impl<M: Machine + 'static> UnicornCpu<M> {
    /// Hooks blocks and divisions for a trace. Not reads: with a hook of reads Unicorn 2.1.5 executes a program differently, because the hook leaves the
    /// state of an IT block in the processor.
    ///
    /// # Errors
    /// Unicorn refuses a hook.
    pub(crate) fn trace_execution(&mut self, trace: &Rc<RefCell<ExecutionTrace>>) -> Result<()> {
        let blocks = Rc::clone(trace);
        self.hook_blocks(false, move |addr, size| blocks.borrow_mut().note(Event::Block(addr, size)))?;
        let image = self.counts.image.borrow().clone();
        for (addr, registers, signed) in execution_trace::divisions(&image) {
            for base in [0, FLASH] {
                let at = u64::from(addr - FLASH + base);
                let trace = Rc::clone(trace);
                let hook = move |uc: &mut Uc<'_>, _: u64, _: u32| {
                    let [dividend, divisor] =
                        registers.map(|number| execution_trace::magnitude_bits(get(uc, Reg::R(number)), signed));
                    trace.borrow_mut().note(Event::Division(dividend, divisor));
                };
                convert_error(self.uc.add_code_hook(at, at, hook), "hooking a division")?;
            }
        }
        Ok(())
    }
}
