//! Proves that the program in flash is the one that was built ([`firmware::seal`]): after the boot, before anything may move, and again and again
//! while the board runs.
//!
//! The thread does it, which the ticks interrupt. A program that is not right stays so until the next boot, whatever a later pass would find. An image
//! without a seal, as `cargo build` and a debugger's download leave it, cannot be proven: it arms, and the log, the boot record and a record a second
//! say so; with the feature `require-seal` it does not arm.

use core::ops::Range;

use firmware::seal::{Check, SEAL, Unproven, WORDS, is_unsealed};
use firmware_shared::pacing::since;
use portable_atomic::{AtomicU8, Ordering};

use crate::parameters::flash;
use crate::removed::{Protection, lacks};
use crate::stopwatch;
use crate::variant::SEAL_REQUIRED;

/// Time that the first pass takes of a round of telemetry, us. A press must not wait for it.
const FIRST_US: u32 = 500;
/// Bytes of a piece. A round of a later pass has one.
const BYTES: u32 = 512;

/// The first pass has not ended.
const CHECKING: u8 = 0;
/// It was right, and no later one was wrong.
const PROVEN: u8 = 1;
/// The program is not the one that was built.
const WRONG: u8 = 2;
/// The image has no seal, and this build does not demand one.
const UNSEALED: u8 = 3;

/// One of these. The thread writes it, the ticks read it.
static STATE: AtomicU8 = AtomicU8::new(CHECKING);

/// Whether the board may not arm: the first pass has not ended, or the program is wrong.
pub(crate) fn is_unproven() -> bool {
    !matches!(STATE.load(Ordering::Relaxed), PROVEN | UNSEALED) && !lacks(Protection::Seal)
}

/// Whether the image has a seal.
pub(crate) fn sealed() -> Option<bool> {
    Some(!is_unsealed(seal()))
}

/// Whether the board will not arm until the next boot.
pub(crate) fn is_wrong() -> bool {
    STATE.load(Ordering::Relaxed) == WRONG
}

/// The passes over the program.
pub(crate) struct ProgramCheck {
    /// `None` before a pass.
    pass: Option<Check>,
}

impl ProgramCheck {
    pub(crate) const fn new() -> Self {
        Self { pass: None }
    }

    /// Checks a piece in a round of telemetry. Why the board does not arm with this program, once.
    pub(crate) fn step(&mut self) -> Option<Unproven> {
        let begun = stopwatch::now_us();
        loop {
            let state = STATE.load(Ordering::Relaxed);
            if state == WRONG || state == UNSEALED {
                return None;
            }
            match self.piece() {
                None => {}
                Some(Ok(())) => STATE.store(PROVEN, Ordering::Relaxed),
                Some(Err(unproven)) => {
                    // A seal that was there at the first pass and is gone was changed.
                    let refuses = unproven.refuses(SEAL_REQUIRED || state == PROVEN);
                    STATE.store(if refuses { WRONG } else { UNSEALED }, Ordering::Relaxed);
                    return refuses.then_some(unproven);
                }
            }
            if state == PROVEN || since(stopwatch::now_us(), begun) >= FIRST_US {
                return None;
            }
        }
    }

    /// The result of a pass, with its last piece.
    fn piece(&mut self) -> Option<Result<(), Unproven>> {
        let mut pass = match self.pass.take() {
            Some(pass) => pass,
            None => match Check::begin(seal()) {
                Ok(pass) => pass,
                Err(unproven) => return Some(Err(unproven)),
            },
        };
        let result = pass.step(BYTES, read);
        if result.is_none() {
            self.pass = Some(pass);
        }
        result
    }
}

fn read(range: Range<u32>) -> &'static [u8] {
    flash(range.start, range.len())
}

/// The words of the seal.
fn seal() -> [u32; WORDS] {
    let mut words = [0; WORDS];
    for (word, bytes) in words.iter_mut().zip(flash(SEAL, 4 * WORDS).chunks_exact(4)) {
        *word = u32::from_le_bytes(bytes.try_into().unwrap_or_default());
    }
    words
}
