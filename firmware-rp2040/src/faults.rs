//! Fatal faults: switches the servos off, stores the cause for the next boot, and resets the chip. It boots disarmed; only a person arms it
//! again.

use cortex_m_rt::exception;
use embassy_rp::pac::{RESETS, VREG_AND_CHIP_RESET, WATCHDOG};
use firmware_shared::post_mortem::{Cause, LOCKOUT_STREAK, Record, WORDS};
use wire::{LastOutputs, Reset};

use crate::kept::Kept;
use crate::kept_outputs;
use crate::servo_pwm::outputs_off;
use crate::{stack, watchdog};

#[unsafe(link_section = ".uninit.footfall.post_mortem")]
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
    watchdog::reset()
}

/// Reads the cause of the last reset; before any block but the pins is taken out of reset.
fn reset_cause() -> Reset {
    // REASON is cleared by every reset of the chip but those of the watchdog (RP2040 datasheet, 4.7.6). A reset of the core alone, as a debugger's,
    // leaves it as it is, and the other blocks too: the PWM runs then.
    let core_alone = !RESETS.reset().read().pwm();
    let watchdog = WATCHDOG.reason().read();
    let chip = VREG_AND_CHIP_RESET.chip_reset().read();
    if core_alone {
        Reset::Software
    } else if watchdog.timer() && watchdog::was_own() {
        Reset::IndependentWatchdog
    } else if watchdog.force() && watchdog::was_own() {
        Reset::Software
    } else if chip.had_por() {
        // Or a brown-out: the chip has one flag for both. Or the boot ROM has restarted the chip with what it has written.
        Reset::PowerOn
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
    let reset = reset_cause();
    let kept = load();
    let crash = kept.filter(|record| record.cause != Cause::None);
    let crashed = crash.is_some() || reset == Reset::IndependentWatchdog;
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

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    outputs_off();
    // File and line identify the panic; its message would need the formatting code.
    let (line, file) = info.location().map_or((0, ""), |at| (at.line(), at.file()));
    die(Record::new(Cause::Panic, [line, 0], file))
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
        "ldr r1, =_stack_start",
        "msr msp, r1",
        "ldr r1, ={hard_fault}",
        "bx r1",
        hard_fault = sym hard_fault,
    )
}

/// Offset of the program counter in the frame that the core stacks.
const PC_OFFSET: usize = 24;
const RAM: core::ops::Range<usize> = 0x2000_0000..0x2004_2000;

unsafe extern "C" fn hard_fault(frame: usize) -> ! {
    outputs_off();
    if frame < stack::bottom() {
        die(Record::new(Cause::StackOverflow, [frame as u32, 0], ""));
    }
    let at = frame.wrapping_add(PC_OFFSET);
    let readable = at.is_multiple_of(4) && RAM.contains(&at);
    // SAFETY: aligned, and in RAM, which holds the frame that the core stacked.
    let pc = if readable { unsafe { (at as *const u32).read_volatile() } } else { 0 };
    // This core has no fault status register.
    die(Record::new(Cause::HardFault, [pc, 0], ""))
}
