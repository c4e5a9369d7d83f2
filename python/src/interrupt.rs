//! Interrupts of the interpreter (Ctrl-C) during long calls, which hold no lock of the interpreter.

use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use crate::error;

/// Longest time between two looks, beside that of `STEPS` steps.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Steps between two looks at the clock: at most a few milliseconds of the slowest generator.
const STEPS: u32 = 512;
/// Stack of a computation beside the interpreter, bytes: that of a program's main thread.
const STACK_BYTES: usize = 8 << 20;

/// Looks for interrupts in a loop of steps.
pub(crate) struct Interrupts {
    looked: Instant,
    steps: u32,
}

impl Interrupts {
    pub(crate) fn new() -> Self {
        Self { looked: Instant::now(), steps: 0 }
    }

    /// To be called after each step, without the lock of the interpreter. The error is what the handler of the signal raised, such as `KeyboardInterrupt`.
    pub(crate) fn check(&mut self) -> PyResult<()> {
        self.steps = (self.steps + 1) % STEPS;
        if self.steps != 0 || self.looked.elapsed() < LOOK_EVERY {
            return Ok(());
        }
        self.looked = Instant::now();
        Python::attach(|py| py.check_signals())
    }
}

/// Runs a computation on a thread of its own, and returns its result, or the interrupt as soon as there is one. The computation gets the function that it
/// calls at the begin of each stage; after an interrupt that call ends its thread.
pub(crate) fn beside<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&mut dyn FnMut(&str)) -> T + Send + 'static,
) -> PyResult<T> {
    let is_abandoned = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = mpsc::channel();
    let seen = Arc::clone(&is_abandoned);
    let thread = std::thread::Builder::new().name("footfall".into()).stack_size(STACK_BYTES);
    let thread = thread.spawn(move || {
        let found = work(&mut |_| {
            if seen.load(Ordering::Relaxed) {
                // Ends the thread without a message: nobody waits for its result.
                std::panic::resume_unwind(Box::new("interrupted"));
            }
        });
        // The receiver is gone after an interrupt.
        let _ = sender.send(found);
    });
    let thread = thread.map_err(error::run)?;
    py.detach(move || {
        loop {
            match receiver.recv_timeout(LOOK_EVERY) {
                Ok(found) => return Ok(found),
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(interrupt) = Python::attach(|py| py.check_signals()) {
                        is_abandoned.store(true, Ordering::Relaxed);
                        return Err(interrupt);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => match thread.join() {
                    // It sends before it ends.
                    Ok(()) => return Err(error::run("the computation ended without a result")),
                    Err(panic) => std::panic::resume_unwind(panic),
                },
            }
        }
    })
}
