//! Where the calls through a pointer of an image can lead: disassembly alone does not show it.

/// Calls through a pointer in one function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pointer {
    /// Part of the name of the function that calls.
    pub within: &'static str,
    /// Parts of the names of all functions that the pointer can have.
    pub to: &'static [&'static str],
    /// Why no other.
    pub why: &'static str,
}

/// Every function that calls through a pointer, as far as the roots of the analyses reach it.
pub const POINTERS: &[Pointer] = &[
    Pointer {
        within: "embassy_executor::platform::thread::Executor>::run",
        to: &["TaskStorage<firmware::tasks::telemetry::", "TaskStorage<firmware::tasks::watchdog::"],
        why: "the executor of the thread has these two tasks",
    },
    Pointer { within: "embassy_time", to: &[WAKERS], why: "the queue of timers holds wakers" },
    Pointer {
        within: "core::fmt::",
        to: &["core::fmt::", "::fmt", "FormatterWriter", "InternalFormatter"],
        why: "arguments of a format string, and what is written to: functions named `fmt`, or of a trait of `core::fmt`",
    },
];

/// The functions of the executors' wakers, the only ones of the image.
const WAKERS: &str = "embassy_executor::raw::waker::";
