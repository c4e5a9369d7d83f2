//! Assembly routines for the checks: they fix the registers and instructions at which an exception comes.

use core::arch::{global_asm, naked_asm};

/// Registers of a floating-point context: S0 to S31 and FPSCR.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct FpContext(pub(crate) [u32; 33]);

impl FpContext {
    /// A context whose words all differ; `fpscr` is its status word.
    pub(crate) const fn pattern(seed: u32, fpscr: u32) -> Self {
        let mut words = [fpscr; 33];
        let mut n = 0;
        while n < 32 {
            words[n] = seed.wrapping_mul(n as u32 + 1) ^ 0x3F80_0000;
            n += 1;
        }
        FpContext(words)
    }
}

// Loads every floating-point register, pends the line in R2 through STIR, and stores what the registers hold afterwards.
global_asm!(
    ".section .text.fp_context, \"ax\"",
    ".global fp_context_through_line",
    ".type fp_context_through_line, %function",
    ".thumb_func",
    "fp_context_through_line:",
    "push {{r4, lr}}",
    "vpush {{s16-s31}}",
    "ldr r3, [r0, #128]",
    "vmsr fpscr, r3",
    "vldmia r0, {{s0-s31}}",
    "movw r3, #0xEF00",
    "movt r3, #0xE000",
    "str r2, [r3]",
    "dsb",
    "isb",
    "vmrs r3, fpscr",
    "str r3, [r1, #128]",
    "vstmia r1, {{s0-s31}}",
    "vpop {{s16-s31}}",
    "movs r3, #0",
    "vmsr fpscr, r3",
    "pop {{r4, pc}}",
);

unsafe extern "C" {
    /// `fp_context_through_line(load, store, line)`, see above.
    pub(crate) fn fp_context_through_line(load: *const FpContext, store: *mut FpContext, line: u32);
}

/// Loads R0 to R9, R12 and LR with known words, sets the flags N, Z, C, V, Q and GE, pends line 3, and returns 0 if all are unchanged
/// afterwards.
#[unsafe(naked)]
pub(crate) unsafe extern "C" fn registers_through_line3() -> u32 {
    naked_asm!(
        "push {{r4-r11, lr}}",
        "movw r12, #0xEF00",
        "movt r12, #0xE000",
        "mov r4, #0x14",
        "mov r5, #0x15",
        "mov r6, #0x16",
        "mov r7, #0x17",
        "mov r8, #0x18",
        "mov r9, #0x19",
        "movw r0, #0",
        "movt r0, #0xF80F",
        "msr apsr_nzcvqg, r0",
        "mov lr, #0x1E",
        "mov r0, #0x10",
        "mov r1, #0x11",
        "mov r2, #0x12",
        "mov r3, #3",
        "str r3, [r12]",
        "dsb",
        "isb",
        "mrs r11, apsr",
        "lsr r11, r11, #16",
        "movw r10, #0xF80F",
        "eor r11, r11, r10",
        "movw r10, #0xEF00",
        "movt r10, #0xE000",
        "eor r12, r12, r10",
        "eor r0, r0, #0x10",
        "eor r1, r1, #0x11",
        "eor r2, r2, #0x12",
        "eor r3, r3, #3",
        "eor r4, r4, #0x14",
        "eor r5, r5, #0x15",
        "eor r6, r6, #0x16",
        "eor r7, r7, #0x17",
        "eor r8, r8, #0x18",
        "eor r9, r9, #0x19",
        "eor lr, lr, #0x1E",
        "orr r0, r0, r1",
        "orr r0, r0, r2",
        "orr r0, r0, r3",
        "orr r0, r0, r4",
        "orr r0, r0, r5",
        "orr r0, r0, r6",
        "orr r0, r0, r7",
        "orr r0, r0, r8",
        "orr r0, r0, r9",
        "orr r0, r0, r11",
        "orr r0, r0, r12",
        "orr r0, r0, lr",
        "pop {{r4-r11, pc}}",
    )
}

// IT blocks that cross a 1 KiB boundary, where QEMU and Unicorn end a block of translated code: an interrupt that was pended before the
// boundary is taken in the middle of the IT block.
global_asm!(
    ".section .text.it_boundary, \"ax\"",
    ".balign 1024",
    ".space 1024 - 12",
    ".global it_all_execute",
    ".type it_all_execute, %function",
    ".thumb_func",
    "it_all_execute:",
    "movs r2, #0",
    "movs r3, #0",
    "cmp r2, #0",
    "itttt eq",
    "streq r1, [r0]",
    "addeq r2, #1",
    // the boundary
    "addeq r2, #2",
    "addeq r2, #4",
    "mov r0, r2",
    "bx lr",
    ".balign 1024",
    ".space 1024 - 12",
    ".global it_half_execute",
    ".type it_half_execute, %function",
    ".thumb_func",
    "it_half_execute:",
    "movs r2, #0",
    "movs r3, #0",
    "cmp r2, #0",
    "ittee eq",
    "streq r1, [r0]",
    "addeq r2, #1",
    // the boundary
    "addne r2, #16",
    "addne r2, #32",
    "mov r0, r2",
    "bx lr",
);

unsafe extern "C" {
    /// Stores `line` to `register` inside an IT block whose four instructions all execute; returns 7.
    pub(crate) fn it_all_execute(register: u32, line: u32) -> u32;
    /// The same, with the last two instructions not executed; returns 1.
    pub(crate) fn it_half_execute(register: u32, line: u32) -> u32;
}

/// Adds 1 to a word by LDREX and STREX; pends `line` in between unless it is negative. Returns 0 if the store succeeded.
#[unsafe(naked)]
pub(crate) unsafe extern "C" fn exclusive_add(word: *mut u32, line: i32) -> u32 {
    naked_asm!(
        "movw r12, #0xEF00",
        "movt r12, #0xE000",
        "ldrex r2, [r0]",
        "adds r2, #1",
        "cmp r1, #0",
        "it ge",
        "strge r1, [r12]",
        "dsb",
        "isb",
        "strex r3, r2, [r0]",
        "mov r0, r3",
        "bx lr",
    )
}

/// Runs on the process stack at `top`, with the floating-point context inactive, pends line 0 and returns PSP afterwards, plus 1 if the
/// floating-point context is then active.
#[unsafe(naked)]
pub(crate) unsafe extern "C" fn line0_from_process_stack(top: u32) -> u32 {
    naked_asm!(
        "push {{r4, lr}}",
        "msr psp, r0",
        "movs r0, #2",
        "msr control, r0",
        "isb",
        "movw r1, #0xEF00",
        "movt r1, #0xE000",
        "movw r3, #0x1234",
        "movs r2, #0",
        "str r2, [r1]",
        "dsb",
        "isb",
        "mrs r4, psp",
        "mrs r0, control",
        "ubfx r0, r0, #2, #1",
        "adds r4, r4, r0",
        "movs r0, #0",
        "msr control, r0",
        "isb",
        "mov r0, r4",
        "pop {{r4, pc}}",
    )
}

/// The same with the floating-point context active.
#[unsafe(naked)]
pub(crate) unsafe extern "C" fn line0_from_process_stack_with_fp(top: u32) -> u32 {
    naked_asm!(
        "push {{r4, lr}}",
        "msr psp, r0",
        "movs r0, #2",
        "msr control, r0",
        "isb",
        "vmov.f32 s0, #1.5",
        "movw r1, #0xEF00",
        "movt r1, #0xE000",
        "movs r2, #0",
        "str r2, [r1]",
        "dsb",
        "isb",
        "mrs r4, psp",
        "mrs r0, control",
        "ubfx r0, r0, #2, #1",
        "adds r4, r4, r0",
        "movs r0, #0",
        "msr control, r0",
        "isb",
        "mov r0, r4",
        "pop {{r4, pc}}",
    )
}

global_asm!(
    ".section .text.faulting, \"ax\"",
    ".global undefined, undefined_at, bad_load, bad_load_at",
    ".type undefined, %function",
    ".thumb_func",
    "undefined:",
    "movs r0, #1",
    "undefined_at:",
    "udf #0",
    "adds r0, #1",
    "bx lr",
    ".type bad_load, %function",
    ".thumb_func",
    "bad_load:",
    "movs r1, #1",
    "bad_load_at:",
    "ldr r0, [r0]",
    "adds r1, #1",
    "mov r0, r1",
    "bx lr",
);

unsafe extern "C" {
    /// Executes UDF at `undefined_at`, then returns 2.
    pub(crate) fn undefined() -> u32;
    /// Loads from `address` at `bad_load_at`, then returns 2.
    pub(crate) fn bad_load(address: u32) -> u32;
    /// The UDF instruction.
    pub(crate) static undefined_at: u8;
    /// The load instruction.
    pub(crate) static bad_load_at: u8;
}

/// Saturating, dividing, bit and multiply instructions and IT blocks on two words, combined into one word.
#[unsafe(naked)]
pub(crate) unsafe extern "C" fn arithmetic(a: u32, b: u32) -> u32 {
    naked_asm!(
        "push {{r4-r7, lr}}",
        "qadd r2, r0, r1",
        "ssat r3, #12, r0",
        "usat r4, #9, r1",
        "udiv r5, r0, r1",
        "smull r6, r7, r0, r1",
        "add r2, r2, r3",
        "eor r2, r2, r4",
        "add r2, r2, r5, ror #7",
        "eor r2, r2, r6",
        "add r2, r2, r7",
        "clz r3, r1",
        "rbit r4, r0",
        "rev16 r5, r1",
        "add r2, r2, r3",
        "eor r2, r2, r4",
        "add r2, r2, r5",
        "cmp r0, r1",
        "ite hi",
        "addhi r2, #3",
        "eorls r2, #5",
        "cmn r0, r1",
        "itte vs",
        "addvs r2, #7",
        "rorvs r2, r1",
        "eorvc r2, #9",
        "sadd8 r3, r0, r1",
        "sel r4, r0, r1",
        "add r2, r2, r3",
        "eor r2, r2, r4",
        "ubfx r3, r2, #5, #11",
        "bfi r2, r3, #17, #9",
        "mov r0, r2",
        "pop {{r4-r7, pc}}",
    )
}
