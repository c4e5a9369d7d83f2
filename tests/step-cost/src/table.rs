//! The table of `step-cost`: counts a step of every generator, and prints a line for each.

use core::fmt::Write as _;

use cpg_core::Generator;

use crate::count::{self, InstructionCount, count};
use crate::exit::exit;
use crate::generators::{self, Function, Visitor};
use crate::semihosting::TextLine;

/// Entry point: the start-up code calls it after reset.
#[unsafe(no_mangle)]
extern "C" fn after_reset() -> ! {
    count::begin();
    exit(u32::from(!generators::visit(&mut Lines)))
}

struct Lines;

impl Visitor for Lines {
    fn generator<G: Generator<N>, const N: usize>(
        &mut self,
        name: &str,
        mut generator: G,
        step: Function<G>,
        tick: Function<G>,
    ) -> bool {
        let step = count(&mut generator, step);
        let tick = count(&mut generator, tick);
        print_line(name, step, tick) && generator.check().is_ok()
    }
}

fn print_line(name: &str, step: InstructionCount, tick: InstructionCount) -> bool {
    let mut line = TextLine::new();
    let InstructionCount { least, sum, most } = step;
    let written = write!(line, "{name} {least} {sum} {most} {} {} {}", tick.least, tick.sum, tick.most);
    line.print();
    written.is_ok()
}
