//! Fatal faults: switches the servos off, stores the cause for the next boot, and resets the chip. It boots disarmed; only a person arms it
//! again.
//!
//! Covers panic, hard fault (and with it bus, usage and memory faults, which are not enabled separately), the non-maskable interrupt
//! (the crystal stopped), interrupts without a handler, and the findings of the watchdog task. A hang of the whole processor is detected by
//! the independent watchdog.

use embassy_stm32::pac::RCC;
use firmware_shared::post_mortem::{Cause, LOCKOUT_STREAK, Record, WORDS};
use joint_loop::Debugger;
use wire::{LastOutputs, Reset};

use crate::debugger;
use crate::kept::Kept;
use crate::kept_outputs;
use crate::servo_pwm::outputs_off;

#[cfg_attr(target_os = "none", unsafe(link_section = ".uninit.footfall.post_mortem"))]
static KEPT: Kept<WORDS> = Kept::new();

fn load() -> Option<Record> {
    Record::from_words(&KEPT.load())
}

fn store(record: &Record) {
    KEPT.store(record.to_words());
}

/// Switches the servos off, stores the record, and resets.
pub(crate) fn die(record: Record) -> ! {
    outputs_off();
    cortex_m::interrupt::disable();
    let streak = load().map_or(0, |kept| kept.streak);
    store(&record.with_streak(streak));
    cortex_m::peripheral::SCB::sys_reset()
}

/// Reads the flags of the last reset's cause and clears them for the next one.
fn take_reset() -> Reset {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset pulls the reset pin too, so that flag only counts alone; a power-on also sets the brown-out flag.
    if flags.porrstf() {
        Reset::PowerOn
    } else if flags.borrstf() {
        Reset::BrownOut
    } else if flags.wdgrstf() {
        Reset::IndependentWatchdog
    } else if flags.wwdgrstf() {
        Reset::WindowWatchdog
    } else if flags.sftrstf() {
        Reset::Software
    } else if flags.lpwrrstf() {
        Reset::LowPower
    } else {
        Reset::Pin
    }
}

/// The end of the last run.
pub(crate) struct LastRun {
    /// The reset that ended it.
    pub(crate) reset: Reset,
    /// Its crash record, if there is one.
    pub(crate) crash: Option<Record>,
    /// Crashes in a row up to now.
    pub(crate) streak: u32,
    /// How its servo outputs ended, if that is known.
    pub(crate) outputs: Option<LastOutputs>,
}

/// Reads the end of the last run; called once, early in the boot.
pub(crate) fn last_run() -> LastRun {
    let reset = take_reset();
    let kept = load();
    let crash = kept.filter(|record| record.cause != Cause::None);
    // A debugger that halts the core in a walk ends in the watchdog's reset: that is no crash of the program.
    let is_bitten = matches!(reset, Reset::IndependentWatchdog | Reset::WindowWatchdog);
    let crashed = crash.is_some() || is_bitten && debugger::attached() == Debugger::Absent;
    let by_hand = matches!(reset, Reset::PowerOn | Reset::Pin);
    let streak = Record::streak_after(kept.map_or(0, |record| record.streak), crashed, by_hand);
    store(&Record::new(Cause::None, [0; 2], "").with_streak(streak));
    // After a power-on the RAM may still hold an old record.
    let crash = crash.filter(|_| reset != Reset::PowerOn);
    LastRun { reset, crash, streak, outputs: kept_outputs::take(reset) }
}

/// Clears the streak after a stable run. A lock-out remains until a person acts.
pub(crate) fn forget_streak() {
    if load().is_none_or(|kept| kept.streak < LOCKOUT_STREAK) {
        store(&Record::new(Cause::None, [0; 2], ""));
    }
}

/// The handlers, which only the board has.
#[cfg(target_os = "none")]
mod handlers {
    use core::panic::PanicInfo;

    use cortex_m_rt::exception;
    use embassy_stm32::pac::RCC;
    use firmware_shared::post_mortem::{Cause, Record};

    use super::die;
    use crate::servo_pwm::outputs_off;
    use crate::stack;

    #[panic_handler]
    fn panic(info: &PanicInfo<'_>) -> ! {
        outputs_off();
        // File and line identify the panic; its message would need the formatting code.
        let (line, file) = info.location().map_or((0, ""), |at| (at.line(), at.file()));
        die(Record::new(Cause::Panic, [line, 0], file))
    }

    #[exception]
    unsafe fn NonMaskableInt() -> ! {
        outputs_off();
        let cause = if RCC.cir().read().cssf() { Cause::ClockFailure } else { Cause::NonMaskable };
        die(Record::new(cause, [0; 2], ""))
    }

    #[exception]
    unsafe fn DefaultHandler(number: i16) -> ! {
        outputs_off();
        die(Record::new(Cause::UnexpectedInterrupt, [number.unsigned_abs().into(), 0], ""))
    }

    /// Passes the stack pointer on and starts a new stack at the top, because after a stack overflow the old one cannot be used.
    #[unsafe(naked)]
    #[unsafe(no_mangle)]
    #[unsafe(link_section = ".HardFault.user")]
    unsafe extern "C" fn HardFault() -> ! {
        core::arch::naked_asm!(
            "mrs r0, msp",
            "movw r1, #:lower16:_stack_start",
            "movt r1, #:upper16:_stack_start",
            "msr msp, r1",
            "b {hard_fault}",
            hard_fault = sym hard_fault,
        )
    }

    /// Configurable fault status register.
    const CFSR: *const u32 = 0xE000_ED28 as *const u32;

    unsafe extern "C" fn hard_fault(frame: usize) -> ! {
        /// Offset of the program counter in the frame that the core stacks.
        const PC_OFFSET: usize = 24;
        const RAM: core::ops::Range<usize> = 0x2000_0000..0x2002_0000;

        outputs_off();
        // SAFETY: a register of the core that every program may read.
        let status = unsafe { CFSR.read_volatile() };
        if frame < stack::bottom() {
            die(Record::new(Cause::StackOverflow, [frame as u32, status], ""));
        }
        let at = frame.wrapping_add(PC_OFFSET);
        let readable = at.is_multiple_of(4) && RAM.contains(&at);
        // SAFETY: aligned, and in RAM, which holds the frame that the core stacked.
        let pc = if readable { unsafe { (at as *const u32).read_volatile() } } else { 0 };
        die(Record::new(Cause::HardFault, [pc, status], ""))
    }
}
