//! Core registers of the Cortex-M4, barrier instructions, and the end of the test.

use core::arch::asm;
use core::sync::atomic::{AtomicU32, Ordering};

/// Addresses of SysTick control and status, reload value, current value.
pub(crate) const SYST_CSR: u32 = 0xE000_E010;
pub(crate) const SYST_RVR: u32 = 0xE000_E014;
pub(crate) const SYST_CVR: u32 = 0xE000_E018;
/// Addresses of the first words of interrupt set-enable, clear-enable, set-pending and clear-pending.
pub(crate) const NVIC_ISER: u32 = 0xE000_E100;
pub(crate) const NVIC_ICER: u32 = 0xE000_E180;
pub(crate) const NVIC_ISPR: u32 = 0xE000_E200;
pub(crate) const NVIC_ICPR: u32 = 0xE000_E280;
/// Address of interrupt control and state.
pub(crate) const ICSR: u32 = 0xE000_ED04;
pub(crate) const ICSR_PENDSVSET: u32 = 1 << 28;
pub(crate) const ICSR_PENDSTSET: u32 = 1 << 26;
pub(crate) const ICSR_PENDSTCLR: u32 = 1 << 25;
pub(crate) const SCR: u32 = 0xE000_ED10;
pub(crate) const SCR_SEVONPEND: u32 = 1 << 4;
pub(crate) const SHCSR: u32 = 0xE000_ED24;
pub(crate) const SHCSR_BUSFAULTENA: u32 = 1 << 17;
pub(crate) const SHCSR_USGFAULTENA: u32 = 1 << 18;
pub(crate) const CFSR: u32 = 0xE000_ED28;
pub(crate) const CFSR_UNDEFINSTR: u32 = 1 << 16;
pub(crate) const CFSR_PRECISERR: u32 = 1 << 9;
pub(crate) const CFSR_BFARVALID: u32 = 1 << 15;
pub(crate) const HFSR: u32 = 0xE000_ED2C;
pub(crate) const HFSR_FORCED: u32 = 1 << 30;
pub(crate) const BFAR: u32 = 0xE000_ED38;
/// Address of the software trigger interrupt register.
pub(crate) const STIR: u32 = 0xE000_EF00;

/// Number of the running check.
static CHECK: AtomicU32 = AtomicU32::new(0);

/// Reads a register of the private peripheral bus.
pub(crate) fn read(register: u32) -> u32 {
    // SAFETY: callers pass the addresses above, which every Cortex-M4 has.
    unsafe { core::ptr::with_exposed_provenance::<u32>(register as usize).read_volatile() }
}

/// Writes a register of the private peripheral bus.
pub(crate) fn write(register: u32, value: u32) {
    // SAFETY: as for `read`.
    unsafe { core::ptr::with_exposed_provenance_mut::<u32>(register as usize).write_volatile(value) }
}

/// Waits until all writes are complete, and discards prefetched instructions.
pub(crate) fn barrier() {
    // SAFETY: barriers touch no state.
    unsafe { asm!("dsb", "isb") }
}

/// Sets the priority of an interrupt line; only the upper four bits are implemented.
pub(crate) fn set_line_priority(line: u32, priority: u8) {
    // SAFETY: a byte of NVIC_IPR; lines 0 to 3 exist.
    unsafe { core::ptr::with_exposed_provenance_mut::<u8>(0xE000_E400 + line as usize).write_volatile(priority) }
}

/// Sets the priority of a system exception, 4 to 15.
pub(crate) fn set_system_priority(exception: u32, priority: u8) {
    // SAFETY: a byte of SHPR1 to SHPR3.
    unsafe { core::ptr::with_exposed_provenance_mut::<u8>(0xE000_ED14 + exception as usize).write_volatile(priority) }
}

/// Pends a line and waits until it has been taken.
pub(crate) fn trigger(line: u32) {
    write(STIR, line);
    barrier();
}

/// Sets the number of the running check.
pub(crate) fn begin(number: u32) {
    CHECK.store(number, Ordering::SeqCst);
}

/// Ends the test with the number of the running check if `held` is false.
pub(crate) fn expect(held: bool) {
    if !held {
        fail();
    }
}

/// Ends the test with the number of the running check.
pub(crate) fn fail() -> ! {
    exit(CHECK.load(Ordering::SeqCst).max(1))
}

/// Ends the test by semihosting: SYS_EXIT_EXTENDED with the reason "application exit".
pub(crate) fn exit(status: u32) -> ! {
    let block = [0x2_0026, status];
    // SAFETY: the debugger, here an emulator, reads the block and does not return.
    unsafe {
        asm!("bkpt 0xAB", in("r0") 0x20, in("r1") block.as_ptr());
    }
    loop {
        barrier();
    }
}
