//! The licence to move, which only a deliberate hold of the button makes. It is kept apart from the loop, and asked for before each pulse.
//!
//! The loop arms by a hold as well, but what it keeps from tick to tick is memory, of which a bit can change by itself. So this looks at the same
//! button with a reading of its own, and gives a [`Permit`] only for pulses that begin in the tick of a hold and have not paused since. The driver of
//! the outputs takes no pulses without a permit. A licence that is neither given nor absent, because a bit has changed, gives no permit any more.
//!
//! ```
//! use firmware_shared::licence::Licence;
//! use joint_loop::SupervisorState::{Arming, Disarmed};
//! let mut licence = Licence::new(false)?;
//! let mut tick = |pressed, state, pulses| licence.tick(pressed, 1, state, pulses);
//! // Released, then held for half a second.
//! for ms in 0..600 {
//!     assert_eq!(tick((100..600).contains(&ms), Disarmed, false), None);
//! }
//! // The loop arms when the release is debounced: in the twentieth tick.
//! assert!((0..19).all(|_| tick(false, Disarmed, false).is_none()));
//! assert!(tick(false, Arming, true).is_some());
//! assert!(tick(false, Arming, true).is_some());
//! // Without pulses the licence ends.
//! assert!(tick(false, Disarmed, false).is_none());
//! assert!(tick(false, Arming, true).is_none());
//! # Ok::<(), joint_loop::LoopError>(())
//! ```

use joint_loop::control::button::{Button, ButtonConfig, ButtonEvent, Press};
use joint_loop::{LoopError, SupervisorState};
use joint_units::Period;

/// The values of a licence: any two differ in 16 bits, and each in 12 or more from a word that is all zeros or all ones.
const NONE: u32 = 0x3A96_5C69;
const WALK: u32 = 0x6FC3_093C;
const TRIM: u32 = 0x09A5_6F5A;
const LOCKED_OUT: u32 = 0x5CF0_3A0F;

/// Proof that pulses may go to the servos in this tick.
#[derive(Debug, PartialEq, Eq)]
pub struct Permit {
    is_trim: bool,
}

impl Permit {
    /// The hold was for a trim, in which a servo may leave the range of its joint.
    #[must_use]
    pub const fn is_trim(&self) -> bool {
        self.is_trim
    }

    /// A permit that nobody gave: for a control image, which must be noticed.
    #[cfg(feature = "controls")]
    #[must_use]
    pub const fn without_licence(is_trim: bool) -> Self {
        Self { is_trim }
    }
}

/// The licence, and the button as it has been since the boot.
#[derive(Debug, Clone)]
pub struct Licence {
    word: u32,
    button: Button,
    press: Press,
}

impl Licence {
    /// At the boot, with the button of the default loop. `locked_out`: no hold makes a licence until the next reset.
    ///
    /// # Errors
    /// The times of the button are not allowed; those of the default are.
    pub fn new(locked_out: bool) -> Result<Self, LoopError> {
        let button = ButtonConfig::DEFAULT.build(Period::MILLISECOND)?;
        Ok(Self { word: if locked_out { LOCKED_OUT } else { NONE }, button, press: Press::default() })
    }

    /// Whether no hold makes a licence: it was locked out at the boot, or memory holds no licence any more.
    #[must_use]
    pub const fn is_locked_out(&self) -> bool {
        !matches!(self.word, NONE | WALK | TRIM)
    }

    /// Takes a tick of the loop, `elapsed` periods after the last one: the level of the button that the loop got, the state after it, and whether it has
    /// pulses. The permit for these pulses.
    #[must_use]
    pub fn tick(&mut self, pressed: bool, elapsed: u32, state: SupervisorState, pulses: bool) -> Option<Permit> {
        let event = self.button.sample(&mut self.press, pressed, elapsed);
        let is_trim = matches!(state, SupervisorState::Trimming);
        let asked = if is_trim { TRIM } else { WALK };
        if pulses && self.word == asked {
            return Some(Permit { is_trim });
        }
        if self.is_locked_out() {
            return None;
        }
        let is_given = pulses && self.word == NONE && event == ButtonEvent::Hold;
        self.word = if is_given { asked } else { NONE };
        is_given.then_some(Permit { is_trim })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use SupervisorState::{Arming, Disarmed, Stopping, TrimReady, Trimming, Walking};

    fn licence() -> Licence {
        Licence::new(false).expect("the default")
    }

    /// At rest, up to the tick before the one in which a hold of half a second counts.
    fn held() -> Licence {
        let mut licence = licence();
        for ms in 0..619 {
            assert_eq!(licence.tick((100..600).contains(&ms), 1, Disarmed, false), None);
        }
        licence
    }

    fn armed() -> Licence {
        let mut licence = held();
        assert!(licence.tick(false, 1, Arming, true).is_some());
        licence
    }

    #[test]
    fn pulses_without_a_hold_have_no_permit() {
        for state in SupervisorState::ALL {
            let mut licence = licence();
            for _ in 0..2_000 {
                assert_eq!(licence.tick(false, 1, state, true), None, "{state:?}");
            }
        }
        // A tick too soon, and one too late.
        assert_eq!({ held() }.tick(true, 1, Arming, true), None);
        let mut late = held();
        assert_eq!(late.tick(false, 1, Disarmed, false), None);
        assert_eq!(late.tick(false, 1, Arming, true), None);
    }

    #[test]
    fn a_licence_lasts_while_there_are_pulses() {
        let mut licence = armed();
        for state in [Arming, Walking, Stopping] {
            assert!((0..1_000).all(|_| licence.tick(state == Stopping, 1, state, true).is_some()));
        }
        assert_eq!(licence.tick(false, 1, Disarmed, false), None);
        assert_eq!(licence.tick(false, 1, Walking, true), None);
    }

    #[test]
    fn a_hold_for_a_walk_is_no_licence_for_a_trim() {
        let mut licence = armed();
        assert_eq!(licence.tick(false, 1, Trimming, true), None);
        assert_eq!(licence.tick(false, 1, Walking, true), None, "it has paused");
        let mut trims = held();
        assert!(trims.tick(false, 1, Trimming, true).is_some_and(|permit| permit.is_trim()));
        assert_eq!(trims.tick(false, 1, TrimReady, false), None);
    }

    #[test]
    fn a_changed_bit_of_the_word_gives_no_permit() {
        for bit in 0..32 {
            let mut licence = held();
            licence.word ^= 1 << bit;
            assert_eq!(licence.tick(false, 1, Arming, true), None, "at rest, bit {bit}");
            assert!(licence.is_locked_out());
            let mut licence = armed();
            licence.word ^= 1 << bit;
            assert!((0..100).all(|_| licence.tick(false, 1, Walking, true).is_none()), "in a walk, bit {bit}");
        }
        let words = [NONE, WALK, TRIM, LOCKED_OUT];
        for (place, word) in words.into_iter().enumerate() {
            assert!(words[place + 1..].iter().all(|other| (word ^ other).count_ones() == 16));
            assert!([0, u32::MAX].iter().all(|other| (word ^ other).count_ones() >= 12));
        }
    }

    #[test]
    fn who_is_locked_out_gets_no_permit_whichever_bit_changes() {
        for bit in (0..32).map(|bit| 1 << bit).chain([0]) {
            let mut licence = Licence { word: LOCKED_OUT ^ bit, ..held() };
            assert_eq!(licence.tick(false, 1, Arming, true), None);
            assert!(licence.is_locked_out());
        }
        assert!(Licence::new(true).expect("the default").is_locked_out() && !armed().is_locked_out());
    }
}
