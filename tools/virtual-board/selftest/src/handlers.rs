//! Exception handlers; each records its state in a log for the checks.

use core::arch::{global_asm, naked_asm};
use core::ptr::addr_of;
use core::sync::atomic::{AtomicU32, Ordering};

use crate::core_registers::{CFSR, HFSR, ICSR, ICSR_PENDSVSET, STIR, fail, read, write};

/// Records of the handlers.
pub(crate) struct HandlerLog {
    /// Handlers in the order in which they began: four bits each, the latest lowest.
    pub(crate) order: AtomicU32,
    /// EXC_RETURN of the latest line 0 and line 1.
    pub(crate) exc_return: [AtomicU32; 2],
    /// MSP, PSP and CONTROL at the start of line 0.
    pub(crate) stacks: [AtomicU32; 3],
    /// Number of SysTick exceptions.
    pub(crate) ticks: AtomicU32,
    /// Address of the instruction that must fault, 0 if none; then exception number and status of the fault.
    pub(crate) fault_at: AtomicU32,
    pub(crate) fault_number: AtomicU32,
    pub(crate) fault_status: AtomicU32,
    /// Action of line 0: one of the constants below.
    pub(crate) line0_task: AtomicU32,
}

/// Line 0 only records its state.
pub(crate) const NOTHING: u32 = 0;
/// Line 0 pends line 1 and then continues.
pub(crate) const PEND_LINE1: u32 = 1;

#[unsafe(no_mangle)]
pub(crate) static LOG: HandlerLog = HandlerLog {
    order: AtomicU32::new(0),
    exc_return: [AtomicU32::new(0), AtomicU32::new(0)],
    stacks: [AtomicU32::new(0), AtomicU32::new(0), AtomicU32::new(0)],
    ticks: AtomicU32::new(0),
    fault_at: AtomicU32::new(0),
    fault_number: AtomicU32::new(0),
    fault_status: AtomicU32::new(0),
    line0_task: AtomicU32::new(0),
};

/// Marks of the handlers in [`HandlerLog::order`].
pub(crate) const LINE0: u32 = 1;
pub(crate) const LINE0_END: u32 = 2;
pub(crate) const LINE1: u32 = 3;
pub(crate) const SV_CALL: u32 = 4;
pub(crate) const SV_CALL_END: u32 = 5;
pub(crate) const PEND_SV: u32 = 6;

fn mark(handler: u32) {
    let order = LOG.order.load(Ordering::SeqCst);
    LOG.order.store(order << 4 | handler, Ordering::SeqCst);
}

/// Lines 0 and 1 pass LR and the stack pointers on as arguments.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn line0() {
    naked_asm!("mov r0, lr", "mrs r1, msp", "mrs r2, psp", "mrs r3, control", "b line0_entered");
}

#[unsafe(no_mangle)]
extern "C" fn line0_entered(exc_return: u32, msp: u32, psp: u32, control: u32) {
    mark(LINE0);
    LOG.exc_return[0].store(exc_return, Ordering::SeqCst);
    for (cell, value) in LOG.stacks.iter().zip([msp, psp, control]) {
        cell.store(value, Ordering::SeqCst);
    }
    if LOG.line0_task.load(Ordering::SeqCst) == PEND_LINE1 {
        crate::core_registers::trigger(1);
    }
    mark(LINE0_END);
}

#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn line1() {
    naked_asm!("mov r0, lr", "b line1_entered");
}

#[unsafe(no_mangle)]
extern "C" fn line1_entered(exc_return: u32) {
    mark(LINE1);
    LOG.exc_return[1].store(exc_return, Ordering::SeqCst);
}

// Line 2 only returns, without an instruction that would make an emulator update its cached mode.
global_asm!(
    ".section .text.line2, \"ax\"",
    ".global line2",
    ".type line2, %function",
    ".thumb_func",
    "line2:",
    "bx lr",
);

// Line 3 overwrites the registers and flags that belong to the frame. If the IT state of the interrupted code were not cleared, its first
// instruction would be skipped.
global_asm!(
    ".section .text.line3, \"ax\"",
    ".global line3",
    ".type line3, %function",
    ".thumb_func",
    "line3:",
    "movs r2, #0x55",
    "movw r0, #:lower16:{count}",
    "movt r0, #:upper16:{count}",
    "ldr r1, [r0]",
    "adds r1, r1, r2",
    "str r1, [r0]",
    "movs r0, #0x80",
    "lsls r0, r0, #24",
    "adds r1, r0, r0",
    "mvns r3, r1",
    "mov r12, r3",
    "usub8 r1, r0, r3",
    "bx lr",
    count = sym LINE3_COUNT,
);

/// Count of line 3: see [`line3_count`].
static LINE3_COUNT: AtomicU32 = AtomicU32::new(0);

/// 0x55 for each complete run of line 3.
pub(crate) fn line3_count() -> u32 {
    LINE3_COUNT.load(Ordering::SeqCst)
}

#[unsafe(no_mangle)]
extern "C" fn sys_tick() {
    let ticks = LOG.ticks.load(Ordering::SeqCst);
    LOG.ticks.store(ticks + 1, Ordering::SeqCst);
}

#[unsafe(no_mangle)]
extern "C" fn pend_sv() {
    mark(PEND_SV);
}

#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn sv_call() {
    naked_asm!("tst lr, #4", "ite eq", "mrseq r0, msp", "mrsne r0, psp", "b sv_call_entered");
}

/// Returns the number of the call plus the caller's R1 in the caller's R0. Number 7 also pends PendSV and line 0.
#[unsafe(no_mangle)]
unsafe extern "C" fn sv_call_entered(frame: *mut u32) {
    mark(SV_CALL);
    // SAFETY: the core has just written the frame; the return address follows the SVC instruction.
    let number = unsafe {
        let pc = frame.add(6).read_volatile();
        core::ptr::with_exposed_provenance::<u16>(pc as usize - 2).read_volatile() & 0xFF
    };
    if number == 7 {
        write(ICSR, ICSR_PENDSVSET);
        write(STIR, 0);
        crate::core_registers::barrier();
    }
    // SAFETY: as above.
    unsafe {
        let r1 = frame.add(1).read_volatile();
        frame.write_volatile(u32::from(number).wrapping_add(r1));
    }
    mark(SV_CALL_END);
}

global_asm!(
    ".section .text.faults, \"ax\"",
    ".global hard_fault, bus_fault, usage_fault",
    ".type hard_fault, %function",
    ".type bus_fault, %function",
    ".type usage_fault, %function",
    ".thumb_func",
    "hard_fault:",
    ".thumb_func",
    "bus_fault:",
    ".thumb_func",
    "usage_fault:",
    "tst lr, #4",
    "ite eq",
    "mrseq r0, msp",
    "mrsne r0, psp",
    "mrs r1, ipsr",
    "b fault_entered",
);

/// Records an expected fault, clears its status and continues after the instruction of two bytes. Any other fault ends the test.
#[unsafe(no_mangle)]
unsafe extern "C" fn fault_entered(frame: *mut u32, number: u32) {
    // SAFETY: the core has just written the frame.
    let pc = unsafe { frame.add(6).read_volatile() };
    let expected = LOG.fault_at.load(Ordering::SeqCst);
    if expected == 0 || expected != pc {
        fail();
    }
    LOG.fault_at.store(0, Ordering::SeqCst);
    LOG.fault_number.store(number, Ordering::SeqCst);
    let (cfsr, hfsr) = (read(CFSR), read(HFSR));
    LOG.fault_status.store(cfsr | hfsr, Ordering::SeqCst);
    write(CFSR, cfsr);
    write(HFSR, hfsr);
    // SAFETY: as above.
    unsafe { frame.add(6).write_volatile(pc + 2) };
}

/// A stack for thread mode on PSP.
#[repr(C, align(8))]
pub(crate) struct ProcessStack([u32; 256]);

static mut PROCESS_STACK: ProcessStack = ProcessStack([0; 256]);

/// First address of the process stack, and the address after its end.
pub(crate) fn process_stack() -> (u32, u32) {
    let base = addr_of!(PROCESS_STACK).expose_provenance() as u32;
    (base, base + size_of::<ProcessStack>() as u32)
}

/// Lines 4 and 5: two levels of handlers that use every floating-point register.
pub(crate) mod fp {
    use core::arch::global_asm;
    use core::ptr::addr_of_mut;

    use crate::context::FpContext;

    /// Context that a level loads, and the context that it finds after the next level has run.
    #[repr(C)]
    struct Level {
        load: FpContext,
        store: FpContext,
        exc_return: u32,
    }

    const EMPTY: Level = Level { load: FpContext([0; 33]), store: FpContext([0; 33]), exc_return: 0 };

    static mut OUTER: Level = EMPTY;
    static mut INNER: Level = EMPTY;

    // Line 4 loads its context and pends line 5; line 5 loads its context and pends line 2, which only returns.
    global_asm!(
        ".section .text.fp_lines, \"ax\"",
        ".global line4, line5",
        ".type line4, %function",
        ".type line5, %function",
        ".thumb_func",
        "line4:",
        "push {{r4, lr}}",
        "movw r0, #:lower16:{outer}",
        "movt r0, #:upper16:{outer}",
        "str lr, [r0, #264]",
        "add r1, r0, #132",
        "movs r2, #5",
        "bl fp_context_through_line",
        "pop {{r4, pc}}",
        ".thumb_func",
        "line5:",
        "push {{r4, lr}}",
        "movw r0, #:lower16:{inner}",
        "movt r0, #:upper16:{inner}",
        "str lr, [r0, #264]",
        "add r1, r0, #132",
        "movs r2, #2",
        "bl fp_context_through_line",
        "pop {{r4, pc}}",
        outer = sym OUTER,
        inner = sym INNER,
    );

    /// Sets the contexts and priorities of the levels: line 5 preempts line 4, line 2 preempts both.
    pub(crate) fn prepare() {
        // SAFETY: the lines are not pending, so nothing else touches the levels.
        unsafe {
            addr_of_mut!(OUTER.load).write_volatile(FpContext::pattern(0x89AB_CDEF, 0x0040_0000));
            addr_of_mut!(INNER.load).write_volatile(FpContext::pattern(0x1357_9BDF, 0x0080_0000));
        }
        for (line, priority) in [(4, 0x80), (5, 0x40), (2, 0x30)] {
            crate::core_registers::set_line_priority(line, priority);
        }
        crate::core_registers::write(crate::core_registers::NVIC_ISER, 1 << 4 | 1 << 5);
    }

    /// True if both levels found the registers that they had loaded.
    pub(crate) fn inner_contexts_are_whole() -> bool {
        // SAFETY: as for `prepare`.
        unsafe {
            addr_of_mut!(OUTER.load).read_volatile() == addr_of_mut!(OUTER.store).read_volatile()
                && addr_of_mut!(INNER.load).read_volatile() == addr_of_mut!(INNER.store).read_volatile()
        }
    }

    /// EXC_RETURN of both levels.
    pub(crate) fn exc_returns() -> (u32, u32) {
        // SAFETY: as for `prepare`.
        unsafe { (addr_of_mut!(OUTER.exc_return).read_volatile(), addr_of_mut!(INNER.exc_return).read_volatile()) }
    }
}
