//! How the servo outputs stand, as words for RAM that a reset does not clear: the next boot reads where the last pulses were, whether a reset found
//! the outputs on, and how many pulses were cut short.

use joint_units::PulseMicros;
use wire::Reset;

use crate::post_mortem::checksum;

/// Length of the record in words.
pub const WORDS: usize = 5;

const MAGIC: u32 = 0xF007_0075;

/// State of the outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LastOutputs {
    /// The pulses that were last commanded, in joint order; 0: none, or too long ago.
    pub pulses: [PulseMicros; 4],
    /// The outputs are on.
    pub on: bool,
    /// Pulses that the break input or a clock failure cut short in this run.
    pub cut: u16,
}

impl LastOutputs {
    /// As words.
    ///
    /// ```
    /// use firmware::last_outputs::{LastOutputs, WORDS};
    /// use joint_units::PulseMicros;
    /// let last = LastOutputs { pulses: [1500, 1520, 1056, 900].map(PulseMicros), on: true, cut: 2 };
    /// assert_eq!(LastOutputs::from_words(&last.to_words()), Some(last));
    /// assert_eq!(LastOutputs::from_words(&[0xA5A5_A5A5; WORDS]), None);
    /// ```
    #[must_use]
    pub fn to_words(&self) -> [u32; WORDS] {
        let [a, b, c, d] = self.pulses.map(|pulse| u32::from(pulse.0));
        let content = [MAGIC, a | b << 16, c | d << 16, u32::from(self.on) | u32::from(self.cut) << 16];
        let [magic, hips, knees, rest] = content;
        [magic, hips, knees, rest, checksum(&content)]
    }

    /// From words; `None` when they are no record.
    #[must_use]
    pub fn from_words(&[magic, hips, knees, rest, check]: &[u32; WORDS]) -> Option<Self> {
        if magic != MAGIC || check != checksum(&[magic, hips, knees, rest]) || rest & 0xFFFF > 1 {
            return None;
        }
        let [low, high] = [|word: u32| PulseMicros(word as u16), |word: u32| PulseMicros((word >> 16) as u16)];
        Some(Self {
            pulses: [low(hips), high(hips), low(knees), high(knees)],
            on: rest & 1 != 0,
            cut: (rest >> 16) as u16,
        })
    }
}

/// Whether what was kept is of the run before, after this reset. After a power-on or a brown-out RAM may hold anything, and the supply was
/// away for an unknown time.
#[must_use]
pub const fn is_kept_by(reset: Reset) -> bool {
    !matches!(reset, Reset::PowerOn | Reset::BrownOut)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_flipped_bit_is_noise() {
        let words = LastOutputs { pulses: [1325, 1786, 988, 2013].map(PulseMicros), on: true, cut: 9 }.to_words();
        for word in 0..WORDS {
            for bit in 0..32 {
                let mut flipped = words;
                flipped[word] ^= 1 << bit;
                assert_eq!(LastOutputs::from_words(&flipped), None, "word {word} bit {bit}");
            }
        }
        for noise in [0, u32::MAX] {
            assert_eq!(LastOutputs::from_words(&[noise; WORDS]), None);
        }
    }

    #[test]
    fn the_supply_decides_what_is_kept() {
        let kept: Vec<_> = Reset::ALL.into_iter().filter(|reset| is_kept_by(*reset)).map(Reset::name).collect();
        assert_eq!(kept, ["iwdg", "wwdg", "software", "low_power", "pin"]);
    }
}
