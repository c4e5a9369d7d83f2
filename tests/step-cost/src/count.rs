//! Instruction counts: difference of the DWT cycle counter over a call, minus the count of a call of an empty function.

use core::arch::naked_asm;
use core::hint::black_box;

use crate::generators::Function;

/// Address of DEMCR, which has the trace enable.
const DEMCR: u32 = 0xE000_EDFC;
/// Address of DWT_CTRL, which has the enable of the cycle counter.
const DWT_CTRL: u32 = 0xE000_1000;
/// Address of the cycle counter.
const DWT_CYCCNT: u32 = 0xE000_1004;

/// Number of counted calls; as many uncounted calls come before.
pub(crate) const STEPS: u32 = 1000;

/// Instructions of the calls, each from the first instruction of the function to its return: least, sum, most.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InstructionCount {
    pub(crate) least: u32,
    pub(crate) sum: u32,
    pub(crate) most: u32,
}

fn read(register: u32) -> u32 {
    // SAFETY: callers pass the addresses above, which every Cortex-M4 has.
    unsafe { core::ptr::with_exposed_provenance::<u32>(register as usize).read_volatile() }
}

fn write(register: u32, value: u32) {
    // SAFETY: as for `read`.
    unsafe { core::ptr::with_exposed_provenance_mut::<u32>(register as usize).write_volatile(value) }
}

/// Starts the counter.
pub(crate) fn begin() {
    write(DEMCR, read(DEMCR) | 1 << 24);
    write(DWT_CYCCNT, 0);
    write(DWT_CTRL, read(DWT_CTRL) | 1);
}

/// The empty function, one instruction. Written in assembly because a compiled one could have a frame.
#[unsafe(naked)]
extern "C" fn nothing<G>(_: &mut G) {
    naked_asm!("bx lr")
}

/// Counts calls of a function on a generator, which continues from its present state.
pub(crate) fn count<G>(generator: &mut G, function: Function<G>) -> InstructionCount {
    let empty = count_with_call(generator, black_box(nothing::<G> as Function<G>));
    let raw = count_with_call(generator, black_box(function));
    // The difference also removes the one instruction of the empty function; add it again.
    let less = |count: u32| count - empty.least + 1;
    InstructionCount { least: less(raw.least), sum: raw.sum - empty.sum + STEPS, most: less(raw.most) }
}

/// One loop for all functions on a type, so that the instructions around the call are the same.
#[inline(never)]
fn count_with_call<G>(generator: &mut G, function: Function<G>) -> InstructionCount {
    let mut count = InstructionCount { least: u32::MAX, sum: 0, most: 0 };
    for call in 0..2 * STEPS {
        let before = read(DWT_CYCCNT);
        function(generator);
        let took = read(DWT_CYCCNT) - before;
        if call >= STEPS {
            count.least = count.least.min(took);
            count.sum += took;
            count.most = count.most.max(took);
        }
    }
    count
}
