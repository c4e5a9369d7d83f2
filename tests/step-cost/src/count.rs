//! Counting: the DWT's cycle counter before and after a call, less what a call of a function that only returns takes.

use core::arch::naked_asm;
use core::hint::black_box;

/// Trace enable in DEMCR, the counter's enable in DWT_CTRL, the counter.
const DEMCR: u32 = 0xE000_EDFC;
const DWT_CTRL: u32 = 0xE000_1000;
const DWT_CYCCNT: u32 = 0xE000_1004;

/// Calls that are counted, after as many that are not.
pub(crate) const STEPS: u32 = 1000;

/// What the calls took, in instructions, from the first of the function to its return.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Count {
    pub(crate) least: u32,
    pub(crate) sum: u32,
    pub(crate) most: u32,
}

fn read(register: u32) -> u32 {
    // SAFETY: callers name core registers by the constants above, which every Cortex-M4 has.
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

/// What is counted: a function on a generator.
pub(crate) type Function<G> = extern "C" fn(&mut G);

/// The function that is taken off: a return and nothing else, one instruction. A compiled one could have a frame.
#[unsafe(naked)]
extern "C" fn nothing<G>(_: &mut G) {
    naked_asm!("bx lr")
}

/// Counts the calls of a function on a generator, which goes on from where it is.
pub(crate) fn count<G>(generator: &mut G, function: Function<G>) -> Count {
    let empty = raw(generator, black_box(nothing::<G> as Function<G>));
    let raw = raw(generator, black_box(function));
    // The one instruction of the empty function was taken off with the call.
    let less = |count: u32| count - empty.least + 1;
    Count { least: less(raw.least), sum: raw.sum - empty.sum + STEPS, most: less(raw.most) }
}

/// One loop for every function on a type, so that what stands around the call is the same.
#[inline(never)]
fn raw<G>(generator: &mut G, function: Function<G>) -> Count {
    let mut count = Count { least: u32::MAX, sum: 0, most: 0 };
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
