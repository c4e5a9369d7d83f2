//! Protections that a control image lacks, one at a time: what shows a protection must notice that it is gone.
//!
//! Only an image of the feature `controls` can lack one. The step `controls` of `cargo xtask test` writes the number of a protection into that image,
//! where [`REMOVED`] has its first value, and runs the tests and faults that show the protection. In every other image all are there, and nothing of this is.

/// A protection, by its number in a control image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
#[allow(dead_code, reason = "each family has its own; the numbers are those of the step")]
pub(crate) enum Protection {
    /// The interrupt of the break switches the supply of the servos off.
    SupplyInBreak = 1,
    /// A handler of a fault switches the supply of the servos off first.
    SupplyFirst = 2,
    /// It waits for the end of a pulse.
    PulseEnd = 3,
    /// The watchdog is reloaded only while all tasks make progress.
    Liveness = 4,
    /// The bits by which a debugger stops the watchdog are taken back.
    FreezeBits = 5,
    /// Three crashes in a row lock out.
    LockOut = 6,
    /// Each tick reads back what shapes a pulse.
    ReadBack = 7,
    /// The check of the pulses after the loop.
    PulseCheck = 8,
    /// The check sum of the program.
    Seal = 9,
    /// The measured clock of the watchdog.
    WatchdogClock = 10,
    /// A robot may demand a brown-out reset.
    BrownOut = 11,
    /// The clock security system.
    ClockSecurity = 12,
    /// The licence to move.
    Licence = 13,
}

/// Whether this image lacks a protection.
#[cfg(feature = "controls")]
#[inline(always)]
pub(crate) fn lacks(protection: Protection) -> bool {
    use portable_atomic::{AtomicU32, Ordering};
    /// The number of the protection that is gone; this value: all are there. Marked as used, or the compiler would know that nothing writes it.
    #[used]
    static REMOVED: AtomicU32 = AtomicU32::new(0x00C0_FFEE);
    REMOVED.load(Ordering::Relaxed) == protection as u32
}

/// Whether this image lacks a protection: never.
#[cfg(not(feature = "controls"))]
pub(crate) const fn lacks(_: Protection) -> bool {
    false
}
