//! Crash record: written to RAM that a reset does not clear, and read by the next boot.
//!
//! The record is an array of words, so that any content of the RAM after power-on can be read; a magic word and a checksum distinguish a
//! record from noise. It also counts crashes in a row: a controller that crashes at every boot must not be armed again.

/// Length of a record in words.
pub const WORDS: usize = 7 + TEXT_WORDS;

/// Bytes of text that are kept: the end of a path, which identifies the file.
pub const TEXT_BYTES: usize = TEXT_WORDS * 4;

const TEXT_WORDS: usize = 10;
const MAGIC: u32 = 0xF007_FA11;

/// After this many crashes in a row arming is locked out until a person acts: power off, or the reset button.
pub const LOCKOUT_STREAK: u32 = 3;

/// Crashes are in a row when none of the runs between them lasted this long.
pub const STABLE_RUN_S: u32 = 60;

/// Why the program was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Cause {
    /// It was not stopped; the record only carries the streak.
    None = 0,
    /// A panic: line, and the file as text.
    Panic = 1,
    /// A hard fault: program counter, fault status register.
    HardFault = 2,
    /// The crystal stopped while running (clock security system).
    ClockFailure = 3,
    /// A non-maskable interrupt that was not the clock's.
    NonMaskable = 4,
    /// An interrupt without a handler: its number.
    UnexpectedInterrupt = 5,
    /// A task stood still: its number, see [`crate::liveness::Part`].
    Stalled = 6,
    /// A task ran too fast: its number.
    Racing = 7,
    /// A hard fault below the end of the stack: stack pointer, fault status register.
    StackOverflow = 8,
}

impl Cause {
    /// Its name in the log.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Cause::None => "none",
            Cause::Panic => "panic",
            Cause::HardFault => "hard_fault",
            Cause::ClockFailure => "clock_failure",
            Cause::NonMaskable => "non_maskable",
            Cause::UnexpectedInterrupt => "unexpected_interrupt",
            Cause::Stalled => "stalled",
            Cause::Racing => "racing",
            Cause::StackOverflow => "stack_overflow",
        }
    }

    const fn from_word(word: u32) -> Option<Self> {
        match word {
            0 => Some(Cause::None),
            1 => Some(Cause::Panic),
            2 => Some(Cause::HardFault),
            3 => Some(Cause::ClockFailure),
            4 => Some(Cause::NonMaskable),
            5 => Some(Cause::UnexpectedInterrupt),
            6 => Some(Cause::Stalled),
            7 => Some(Cause::Racing),
            8 => Some(Cause::StackOverflow),
            _ => None,
        }
    }

    /// Every cause, in the order of the numbers.
    pub const ALL: [Self; 9] = [
        Self::None,
        Self::Panic,
        Self::HardFault,
        Self::ClockFailure,
        Self::NonMaskable,
        Self::UnexpectedInterrupt,
        Self::Stalled,
        Self::Racing,
        Self::StackOverflow,
    ];
}

/// A crash record.
///
/// ```
/// use firmware_shared::post_mortem::{Cause, Record};
/// let crash = Record::new(Cause::Panic, [123, 0], "joint-loop/src/control/tick.rs");
/// let back = Record::from_words(&crash.to_words()).unwrap();
/// assert_eq!((back.cause, back.details[0], back.text()), (Cause::Panic, 123, "joint-loop/src/control/tick.rs"));
/// assert_eq!(Record::from_words(&[0xA5A5_A5A5; firmware_shared::post_mortem::WORDS]), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// Why.
    pub cause: Cause,
    /// Two numbers; [`Cause`] says what they are.
    pub details: [u32; 2],
    /// Crashes in a row, this one included; see [`Record::streak_after`].
    pub streak: u32,
    text: [u8; TEXT_BYTES],
    text_len: u32,
}

impl Record {
    /// A record with a streak of 0. Only the last [`TEXT_BYTES`] bytes of the text are kept.
    #[must_use]
    pub fn new(cause: Cause, details: [u32; 2], text: &str) -> Self {
        let bytes = text.as_bytes();
        let skip = bytes.len().saturating_sub(TEXT_BYTES);
        let mut kept = [0; TEXT_BYTES];
        let mut text_len = 0;
        for (to, from) in kept.iter_mut().zip(bytes.iter().skip(skip)) {
            *to = *from;
            text_len += 1;
        }
        Self { cause, details, streak: 0, text: kept, text_len }
    }

    /// The same with another streak.
    #[must_use]
    pub const fn with_streak(self, streak: u32) -> Self {
        Self { streak, ..self }
    }

    /// The text; empty if shortening it left invalid UTF-8.
    #[must_use]
    pub fn text(&self) -> &str {
        self.text.get(..self.text_len as usize).and_then(|bytes| core::str::from_utf8(bytes).ok()).unwrap_or("")
    }

    /// Crashes in a row, counted at a boot: one more if the last run ended in a crash, 0 if a person caused the reset.
    #[must_use]
    pub const fn streak_after(before: u32, crashed: bool, by_hand: bool) -> u32 {
        if by_hand {
            0
        } else if crashed {
            before.saturating_add(1)
        } else {
            before
        }
    }

    /// As words for the RAM that a reset does not clear.
    #[must_use]
    pub fn to_words(&self) -> [u32; WORDS] {
        let mut words = [0; WORDS];
        let head = [MAGIC, self.cause as u32, self.details[0], self.details[1], self.streak, self.text_len];
        let texts = self.text.chunks_exact(4).map(|b| match b {
            [a, b, c, d] => u32::from_le_bytes([*a, *b, *c, *d]),
            _ => 0,
        });
        for (to, from) in words.iter_mut().zip(head.into_iter().chain(texts)) {
            *to = from;
        }
        if let Some((check, content)) = words.split_last_mut() {
            *check = checksum(content);
        }
        words
    }

    /// From words; `None` when they are not a record.
    #[must_use]
    pub fn from_words(words: &[u32; WORDS]) -> Option<Self> {
        let (check, content) = words.split_last()?;
        let [magic, cause, first, second, streak, text_len, texts @ ..] = content else { return None };
        if *magic != MAGIC || *check != checksum(content) || *text_len as usize > TEXT_BYTES {
            return None;
        }
        let mut text = [0; TEXT_BYTES];
        for (to, from) in text.chunks_exact_mut(4).zip(texts) {
            to.copy_from_slice(&from.to_le_bytes());
        }
        Some(Self {
            cause: Cause::from_word(*cause)?,
            details: [*first, *second],
            streak: *streak,
            text,
            text_len: *text_len,
        })
    }
}

/// FNV-1a over words.
pub(crate) fn checksum(words: &[u32]) -> u32 {
    words.iter().fold(0x811C_9DC5, |hash, word| (hash ^ word).wrapping_mul(0x0100_0193))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_survives_the_reset() {
        let mut causes = 0;
        for word in 0..16 {
            let Some(cause) = Cause::from_word(word) else { continue };
            causes += 1;
            assert_eq!(cause as u32, word);
            let record = Record::new(cause, [word, !word], "src/tick.rs").with_streak(word);
            assert_eq!(Record::from_words(&record.to_words()), Some(record), "{}", cause.name());
        }
        assert_eq!(causes, Cause::ALL.len());
        assert!(Cause::ALL.into_iter().eq((0..16).filter_map(Cause::from_word)));
    }

    #[test]
    fn any_flipped_bit_is_noise_and_not_a_crash() {
        let words = Record::new(Cause::HardFault, [0x0801_2344, 0x0000_8200], "").with_streak(2).to_words();
        for word in 0..WORDS {
            for bit in 0..32 {
                let mut flipped = words;
                flipped[word] ^= 1 << bit;
                assert_eq!(Record::from_words(&flipped), None, "word {word} bit {bit}");
            }
        }
        assert_eq!(Record::from_words(&[0; WORDS]), None);
        // A valid checksum over another magic word: the record of another layout.
        let mut other = words;
        other[0] = MAGIC + 1;
        other[WORDS - 1] = checksum(&other[..WORDS - 1]);
        assert_eq!(Record::from_words(&other), None);
        assert_eq!(Record::from_words(&[u32::MAX; WORDS]), None);
    }

    #[test]
    fn the_end_of_a_long_path_is_kept() {
        let path = "/a/very/long/path/that/does/not/fit/into/the/record/firmware/src/tasks/control.rs";
        let record = Record::new(Cause::Panic, [1, 0], path);
        assert_eq!(record.text().len(), TEXT_BYTES);
        assert!(path.ends_with(record.text()) && record.text().ends_with("tasks/control.rs"));
        // A character that is cut in half makes the text empty.
        let record = Record::new(Cause::Panic, [1, 0], &"é".repeat(TEXT_BYTES).as_str()[..TEXT_BYTES * 2 - 2]);
        assert_eq!(record.text().len(), TEXT_BYTES);
        assert_eq!(Record::new(Cause::Panic, [1, 0], &format!("é{}", "x".repeat(TEXT_BYTES - 1))).text(), "");
    }

    #[test]
    fn three_crashes_in_a_row_lock_and_a_person_unlocks() {
        let mut streak = 0;
        for _ in 0..LOCKOUT_STREAK {
            assert!(streak < LOCKOUT_STREAK);
            streak = Record::streak_after(streak, true, false);
        }
        assert!(streak >= LOCKOUT_STREAK);
        assert_eq!(Record::streak_after(streak, false, false), streak);
        assert_eq!(Record::streak_after(streak, true, true), 0);
        assert_eq!(Record::streak_after(u32::MAX, true, false), u32::MAX);
    }
}
