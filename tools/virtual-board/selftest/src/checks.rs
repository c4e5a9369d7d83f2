//! The checks, in the order of their numbers. A check may rely on the results of earlier ones.

use core::arch::asm;
use core::sync::atomic::Ordering;

use crate::context::{self, FpContext};
use crate::core_registers::*;
use crate::handlers::{self, LINE0, LINE0_END, LINE1, LOG, NOTHING, PEND_LINE1, PEND_SV, SV_CALL, SV_CALL_END};

/// Runs all checks and ends the program.
#[unsafe(no_mangle)]
extern "C" fn after_reset() -> ! {
    let checks: [fn(); 18] = [
        arithmetic,
        a_handler_that_only_returns,
        it_block_interrupted_in_the_middle,
        registers_and_flags_survive,
        arithmetic_under_interrupts,
        supervisor_call,
        pending_exceptions_run_in_the_order_of_priority,
        nested_floating_point_contexts,
        exclusive_access_is_lost_to_an_exception,
        primask,
        basepri,
        faultmask,
        sys_tick_counts,
        wait_for_event,
        process_stack,
        stack_alignment,
        undefined_instruction,
        bus_fault,
    ];
    for line in 0..4 {
        set_line_priority(line, [0x80, 0x40, 0x80, 0x80][line as usize]);
        write(NVIC_ISER, 1 << line);
    }
    set_system_priority(11, 0x20);
    set_system_priority(14, 0xF0);
    set_system_priority(15, 0x60);
    for (check, number) in checks.iter().zip(1..) {
        begin(number);
        check();
        expect(read(NVIC_ISPR) == 0 && read(ICSR) & 0x1FF == 0);
    }
    exit(0)
}

fn clear_order() {
    LOG.order.store(0, Ordering::SeqCst);
}

fn order() -> u32 {
    LOG.order.load(Ordering::SeqCst)
}

/// A sequence of handlers in the format of [`handlers::HandlerLog::order`].
fn sequence(handlers: &[u32]) -> u32 {
    handlers.iter().fold(0, |order, handler| order << 4 | handler)
}

/// The operations of [`context::arithmetic`] in Rust.
fn arithmetic_by_the_compiler(a: u32, b: u32) -> u32 {
    let (signed_a, signed_b) = (a as i32, b as i32);
    let product = i64::from(signed_a) * i64::from(signed_b);
    let mut sum = signed_a.saturating_add(signed_b) as u32;
    sum = sum.wrapping_add(signed_a.clamp(-2048, 2047) as u32);
    sum ^= signed_b.clamp(0, 511) as u32;
    sum = sum.wrapping_add(a.checked_div(b).unwrap_or(0).rotate_right(7));
    sum ^= product as u32;
    sum = sum.wrapping_add((product >> 32) as u32);
    sum = sum.wrapping_add(b.leading_zeros());
    sum ^= a.reverse_bits();
    sum = sum.wrapping_add((b & 0x00FF_00FF) << 8 | b >> 8 & 0x00FF_00FF);
    sum = if a > b { sum.wrapping_add(3) } else { sum ^ 5 };
    sum = if signed_a.checked_add(signed_b).is_none() { sum.wrapping_add(7).rotate_right(b & 0xFF) } else { sum ^ 9 };
    let (mut bytes, mut selected) = (0, 0);
    for n in 0..4 {
        let lane = |word: u32| i16::from((word >> (8 * n)) as i8);
        let lane_sum = lane(a) + lane(b);
        bytes |= u32::from(lane_sum as u8) << (8 * n);
        selected |= if lane_sum >= 0 { a } else { b } & 0xFF << (8 * n);
    }
    sum = sum.wrapping_add(bytes);
    sum ^= selected;
    let field = sum >> 5 & 0x7FF;
    sum & !(0x1FF << 17) | (field & 0x1FF) << 17
}

fn arithmetic_agrees(rounds: u32, mut a: u32) -> bool {
    let mut b = 0x9E37_79B9_u32;
    (0..rounds).all(|_| {
        // xorshift32
        a ^= a << 13;
        a ^= a >> 17;
        a ^= a << 5;
        b = b.wrapping_mul(0x0019_660D).wrapping_add(0x3C6E_F35F);
        let small = if a & 1 == 0 { b >> 20 } else { b };
        // SAFETY: the function only computes.
        (unsafe { context::arithmetic(a, small) }) == arithmetic_by_the_compiler(a, small)
    })
}

/// 1: data processing, saturation, division, SIMD and IT blocks.
fn arithmetic() {
    for (a, b) in [(0, 0), (1, 0), (u32::MAX, 1), (0x7FFF_FFFF, 0x7FFF_FFFF), (0x8000_0000, 0x8000_0000)] {
        // SAFETY: the function only computes.
        expect(unsafe { context::arithmetic(a, b) } == arithmetic_by_the_compiler(a, b));
    }
    expect(arithmetic_agrees(2_000, 0x1234_5678));
}

/// 2: EXC_RETURN works in a handler that only returns.
fn a_handler_that_only_returns() {
    for _ in 0..3 {
        trigger(2);
    }
}

/// 3: the IT state is stacked, clear in the handler, and restored.
fn it_block_interrupted_in_the_middle() {
    for round in 0..3 {
        let before = handlers::line3_count();
        // SAFETY: the functions store a line's number to STIR.
        expect(unsafe { context::it_all_execute(STIR, 3) } == 7);
        barrier();
        expect(handlers::line3_count() == before + 0x55);
        // SAFETY: as above.
        expect(unsafe { context::it_half_execute(STIR, 3) } == 1);
        barrier();
        expect(handlers::line3_count() == 0xAA * (round + 1));
    }
}

/// 4: a handler that overwrites all caller-saved registers does not change R0 to R3, R12, LR and the flags of the interrupted code.
fn registers_and_flags_survive() {
    // SAFETY: the function restores the callee-saved registers.
    expect(unsafe { context::registers_through_line3() } == 0);
}

/// 5: the result does not depend on the instruction at which an interrupt comes.
fn arithmetic_under_interrupts() {
    start_sys_tick(4_999);
    let mut rounds = 0;
    while LOG.ticks.load(Ordering::SeqCst) < 200 {
        expect(arithmetic_agrees(16, 0xC0FF_EE00 | rounds & 0xFF) && rounds < 1_000_000);
        rounds += 1;
    }
    stop_sys_tick();
}

/// 6: an SVC handler reads its number through the stacked PC and returns a value through the frame.
fn supervisor_call() {
    clear_order();
    let answer: u32;
    // SAFETY: the handler returns its value in R0.
    unsafe { asm!("svc 42", inlateout("r0") 0 => answer, in("r1") 1_000) }
    expect(answer == 1_042 && order() == sequence(&[SV_CALL, SV_CALL_END]));
}

/// 7: exceptions that an SVC handler pends run after it, the most urgent first; a line preempts a less urgent one but not an equal one.
fn pending_exceptions_run_in_the_order_of_priority() {
    clear_order();
    // SAFETY: the handler returns its value in R0.
    unsafe { asm!("svc 7", inlateout("r0") 0 => _, in("r1") 0) }
    barrier();
    expect(order() == sequence(&[SV_CALL, SV_CALL_END, LINE0, LINE0_END, PEND_SV]));

    LOG.line0_task.store(PEND_LINE1, Ordering::SeqCst);
    clear_order();
    trigger(0);
    expect(order() == sequence(&[LINE0, LINE1, LINE0_END]));
    expect(LOG.exc_return[1].load(Ordering::SeqCst) | 0x10 == 0xFFFF_FFF1);

    set_line_priority(1, 0x80);
    clear_order();
    trigger(0);
    expect(order() == sequence(&[LINE0, LINE0_END, LINE1]));
    expect(LOG.exc_return[1].load(Ordering::SeqCst) | 0x10 == 0xFFFF_FFF9);
    set_line_priority(1, 0x40);
    LOG.line0_task.store(NOTHING, Ordering::SeqCst);

    write(NVIC_ICER, 1);
    clear_order();
    trigger(0);
    expect(order() == 0 && read(NVIC_ISPR) & 1 == 1);
    write(NVIC_ICPR, 1);
    write(NVIC_ISER, 1);
    barrier();
    expect(order() == 0);
}

/// 8: each of three levels has its own S0 to S31 and FPSCR.
fn nested_floating_point_contexts() {
    // Rounding towards zero and all condition flags in thread mode, other words in the handlers.
    let thread = FpContext::pattern(0x0123_4567, 0xF0C0_0000);
    handlers::fp::prepare();
    let mut after = FpContext::pattern(0, 0);
    // SAFETY: both contexts are complete, and the function restores the callee-saved registers.
    unsafe { context::fp_context_through_line(&raw const thread, &raw mut after, 4) };
    expect(after == thread);
    expect(handlers::fp::inner_contexts_are_whole());
    expect(handlers::fp::exc_returns() == (0xFFFF_FFE9, 0xFFFF_FFE1));
}

/// 9: STREX fails when an exception came after LDREX.
fn exclusive_access_is_lost_to_an_exception() {
    let mut word = 5;
    // SAFETY: the word is a local variable.
    unsafe {
        expect(context::exclusive_add(&raw mut word, -1) == 0);
        expect((&raw const word).read_volatile() == 6);
        expect(context::exclusive_add(&raw mut word, 2) == 1);
        expect((&raw const word).read_volatile() == 6);
        expect(context::exclusive_add(&raw mut word, -1) == 0);
        expect((&raw const word).read_volatile() == 7);
    }
}

/// 10: while PRIMASK is set no exception is taken; pending ones are taken after it is cleared.
fn primask() {
    clear_order();
    // SAFETY: the handlers change only their log.
    unsafe { asm!("cpsid i") }
    trigger(0);
    let held = order();
    // SAFETY: as above.
    unsafe { asm!("cpsie i", "isb") }
    expect(held == 0 && order() == sequence(&[LINE0, LINE0_END]));
}

/// 11: BASEPRI masks its own priority and less urgent ones only.
fn basepri() {
    clear_order();
    // SAFETY: the handlers change only their log.
    unsafe { asm!("msr basepri, {}", "isb", in(reg) 0x80) }
    trigger(0);
    let held = order();
    trigger(1);
    let passed = order();
    // SAFETY: as above.
    unsafe { asm!("msr basepri, {}", "isb", in(reg) 0) }
    expect(held == 0 && passed == sequence(&[LINE1]));
    expect(order() == sequence(&[LINE1, LINE0, LINE0_END]));
}

/// 12: FAULTMASK masks every interrupt.
fn faultmask() {
    clear_order();
    // SAFETY: the handlers change only their log.
    unsafe { asm!("cpsid f") }
    trigger(1);
    let held = order();
    // SAFETY: as above.
    unsafe { asm!("cpsie f", "isb") }
    expect(held == 0 && order() == sequence(&[LINE1]));
}

fn start_sys_tick(reload: u32) {
    LOG.ticks.store(0, Ordering::SeqCst);
    write(SYST_RVR, reload);
    write(SYST_CVR, 0);
    write(SYST_CSR, 7);
}

fn stop_sys_tick() {
    write(SYST_CSR, 0);
    write(ICSR, ICSR_PENDSTCLR);
    barrier();
}

/// 13: SysTick counts down from its reload value, sets its flag once at each zero, and interrupts.
fn sys_tick_counts() {
    stop_sys_tick();
    LOG.ticks.store(0, Ordering::SeqCst);
    write(SYST_RVR, 0x00FF_FFFF);
    write(SYST_CVR, 0);
    write(SYST_CSR, 5);
    barrier();
    // QEMU counts by the host's clock in a separate thread: the first reload may be late, and under load the counter may occasionally wrap
    // between two readings.
    let mut waits = 0;
    while read(SYST_CVR) == 0 {
        waits += 1;
        expect(waits < 10_000_000);
    }
    let (mut earlier, mut falls, mut rises) = (read(SYST_CVR), 0, 0);
    for _ in 0..1_000 {
        let later = read(SYST_CVR);
        falls += u32::from(later < earlier);
        rises += u32::from(later > earlier);
        earlier = later;
    }
    expect(falls > 10 * rises);
    write(SYST_RVR, 9_999);
    write(SYST_CVR, 0);
    let mut waits = 0;
    while read(SYST_CSR) & 1 << 16 == 0 {
        waits += 1;
        expect(waits < 10_000_000 && read(SYST_CVR) <= 9_999);
    }
    expect(LOG.ticks.load(Ordering::SeqCst) == 0);
    start_sys_tick(9_999);
    let mut waits = 0;
    while LOG.ticks.load(Ordering::SeqCst) < 3 {
        waits += 1;
        expect(waits < 100_000_000);
    }
    stop_sys_tick();
    let ticks = LOG.ticks.load(Ordering::SeqCst);
    // Pended by software, it is taken like any other exception.
    write(ICSR, ICSR_PENDSTSET);
    barrier();
    expect(LOG.ticks.load(Ordering::SeqCst) == ticks + 1);
}

/// 14: WFE returns for an earlier event, for an exception, and for an exception that becomes pending with SEVONPEND; WFI for an exception
/// that PRIMASK masks. If the core does not wake up, this check never ends.
fn wait_for_event() {
    // SAFETY: waiting changes no state.
    unsafe { asm!("sev", "wfe", "sev", "wfe") }
    start_sys_tick(19_999);
    while LOG.ticks.load(Ordering::SeqCst) < 3 {
        // SAFETY: as above.
        unsafe { asm!("wfe") }
    }
    // SAFETY: PRIMASK only masks SysTick.
    unsafe { asm!("cpsid i") }
    let ticks = LOG.ticks.load(Ordering::SeqCst);
    // SAFETY: waiting changes no state.
    unsafe { asm!("wfi") }
    let held = LOG.ticks.load(Ordering::SeqCst) == ticks;
    // SAFETY: as above.
    unsafe { asm!("cpsie i", "isb") }
    expect(held && LOG.ticks.load(Ordering::SeqCst) > ticks);
    stop_sys_tick();

    write(SCR, SCR_SEVONPEND);
    write(NVIC_ICER, 1);
    clear_order();
    // Clear an event that earlier exceptions have set.
    // SAFETY: waiting changes no state.
    unsafe { asm!("sev", "wfe") }
    trigger(0);
    // SAFETY: as above.
    unsafe { asm!("wfe") }
    expect(order() == 0);
    write(SCR, 0);
    write(NVIC_ICPR, 1);
    write(NVIC_ISER, 1);
}

/// 15: an exception in thread mode on PSP leaves its frame there, runs on MSP with SPSEL clear, and returns to PSP; the
/// floating-point context is active afterwards when it was before.
fn process_stack() {
    let (base, top) = handlers::process_stack();
    // SAFETY: the stack is large enough for a frame of either size.
    let after = unsafe { context::line0_from_process_stack(top) };
    expect(after == top && LOG.exc_return[0].load(Ordering::SeqCst) == 0xFFFF_FFFD);
    let [msp, psp, control] = LOG.stacks.each_ref().map(|cell| cell.load(Ordering::SeqCst));
    expect(psp == top - 0x20 && control & 3 == 0 && !(base..=top).contains(&msp));
    // SAFETY: R3 of the frame, which line 0's handler did not change.
    let r3 = unsafe { core::ptr::with_exposed_provenance::<u32>(psp as usize + 12).read_volatile() };
    expect(r3 == 0x1234);
    // SAFETY: as above.
    let after = unsafe { context::line0_from_process_stack_with_fp(top) };
    expect(after == top + 1 && LOG.exc_return[0].load(Ordering::SeqCst) == 0xFFFF_FFED);
    expect(LOG.stacks[1].load(Ordering::SeqCst) == top - 0x68);
}

/// 16: frames are aligned to 8 bytes, and bit 9 of the stacked xPSR marks a word of padding.
fn stack_alignment() {
    let (_, top) = handlers::process_stack();
    // SAFETY: as for check 15.
    let after = unsafe { context::line0_from_process_stack(top - 4) };
    let psp = LOG.stacks[1].load(Ordering::SeqCst);
    // SAFETY: xPSR of the frame.
    let xpsr = unsafe { core::ptr::with_exposed_provenance::<u32>(psp as usize + 28).read_volatile() };
    expect(after == top - 4 && psp == top - 0x28 && xpsr & 1 << 9 != 0);
}

fn expect_fault(at: *const u8) {
    LOG.fault_number.store(0, Ordering::SeqCst);
    LOG.fault_at.store(at.expose_provenance() as u32, Ordering::SeqCst);
}

fn fault_was(number: u32, status: u32) -> bool {
    LOG.fault_number.load(Ordering::SeqCst) == number && LOG.fault_status.load(Ordering::SeqCst) & status == status
}

/// 17: UDF is a HardFault with the address of the instruction in the frame, or a UsageFault where that is enabled.
fn undefined_instruction() {
    // SAFETY: the fault handler continues after the instruction.
    unsafe {
        expect_fault(&raw const context::undefined_at);
        expect(context::undefined() == 2 && fault_was(3, HFSR_FORCED | CFSR_UNDEFINSTR));
        write(SHCSR, read(SHCSR) | SHCSR_USGFAULTENA);
        barrier();
        expect_fault(&raw const context::undefined_at);
        expect(context::undefined() == 2 && fault_was(6, CFSR_UNDEFINSTR));
    }
    write(SHCSR, read(SHCSR) & !SHCSR_USGFAULTENA);
}

/// 18: a load from an unmapped address is a precise BusFault with its address in BFAR.
fn bus_fault() {
    const UNMAPPED: u32 = 0x6000_0010;
    write(SHCSR, read(SHCSR) | SHCSR_BUSFAULTENA);
    barrier();
    // SAFETY: the fault handler continues after the instruction.
    unsafe {
        expect_fault(&raw const context::bad_load_at);
        expect(context::bad_load(UNMAPPED) == 2 && fault_was(5, CFSR_PRECISERR | CFSR_BFARVALID));
    }
    expect(read(BFAR) == UNMAPPED);
    write(SHCSR, read(SHCSR) & !SHCSR_BUSFAULTENA);
}
