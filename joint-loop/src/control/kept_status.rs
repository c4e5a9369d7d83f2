//! The supervisor's status as it is kept from one tick to the next: a state is a word in which up to 13 changed bits are found.
//!
//! As a number from 0 to 7 one changed bit of memory would make a moving state of one at rest, and the outputs would go on without a hold of the
//! button. Any two of these words differ in 16 bits, and each in 14 or more from a word that is all zeros or all ones. A word that is no state is a fault.

use crate::control::supervisor::{Cause, SupervisorState, SupervisorStatus};

/// The word of each state, in the order of its number: three rows of a Walsh matrix in all combinations, on one pattern.
const WORDS: [u32; SupervisorState::ALL.len()] =
    [0x6B8F_21D4, 0x3EDA_7481, 0x58BC_12E7, 0x0DE9_47B2, 0x6480_2EDB, 0x31D5_7B8E, 0x57B3_1DE8, 0x02E6_48BD];

/// A status between two ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct KeptStatus {
    word: u32,
    cause: Cause,
}

impl KeptStatus {
    /// Keeps a status.
    pub(crate) const fn of(status: SupervisorStatus) -> Self {
        Self { word: WORDS[status.state as usize & 7], cause: status.cause }
    }

    /// The same with changed bits.
    #[cfg(test)]
    pub(crate) const fn with_flipped(self, mask: u32) -> Self {
        Self { word: self.word ^ mask, ..self }
    }

    /// The status that was kept; the fault `memory` if the word is no state.
    pub(crate) fn read(self) -> SupervisorStatus {
        // Compared with each word: a table of the states by a part of the word would find less.
        match WORDS.into_iter().zip(SupervisorState::ALL).find(|(word, _)| *word == self.word) {
            Some((_, state)) => SupervisorStatus { state, cause: self.cause },
            None => SupervisorStatus { state: SupervisorState::Fault, cause: Cause::Memory },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_is_read_as_it_was_kept() {
        for state in SupervisorState::ALL {
            for cause in Cause::ALL {
                let status = SupervisorStatus { state, cause };
                assert_eq!(KeptStatus::of(status).read(), status);
            }
        }
    }

    /// Also a word whose memory lost its supply, or was cleared.
    #[test]
    fn up_to_thirteen_changed_bits_make_no_state() {
        for (place, word) in WORDS.into_iter().enumerate() {
            for other in WORDS.into_iter().skip(place + 1).chain([0, u32::MAX]) {
                assert!((word ^ other).count_ones() >= 14, "{word:#010x} {other:#010x}");
            }
            assert!(WORDS.into_iter().skip(place + 1).all(|other| (word ^ other).count_ones() == 16));
        }
    }

    #[test]
    fn a_word_that_is_no_state_is_a_fault() {
        let fault = SupervisorStatus { state: SupervisorState::Fault, cause: Cause::Memory };
        for state in SupervisorState::ALL {
            let kept = KeptStatus::of(SupervisorStatus { state, cause: Cause::Button });
            for first in 0..32 {
                for second in 0..32 {
                    let changed = KeptStatus { word: kept.word ^ (1 << first) ^ (1 << second), ..kept };
                    assert_eq!(changed.read(), if first == second { kept.read() } else { fault });
                }
                assert_eq!(KeptStatus { word: kept.word ^ (1 << first), ..kept }.read(), fault);
            }
        }
    }
}
