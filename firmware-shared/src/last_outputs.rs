//! How the servo outputs stand, as words for RAM that a reset does not clear: the next boot reads where the last pulses were, whether a reset found
//! the outputs on, and how many pulses were cut short.

use wire::{LastOutputs, Reset};

use crate::post_mortem::checksum;

/// Length of the record in words.
pub const WORDS: usize = 5;

const MAGIC: u32 = 0xF007_0075;
/// Most cut pulses that a record can hold.
const MOST_CUT: u32 = 0xFFFF;

/// The state as words; of more than 65,535 cut pulses that number is kept.
///
/// ```
/// use firmware_shared::last_outputs::{WORDS, from_words, to_words};
/// use wire::LastOutputs;
/// let last = LastOutputs { pulses_us: [1500, 1520, 1056, 900], on: true, cut: 2 };
/// assert_eq!(from_words(&to_words(&last)), Some(last));
/// assert_eq!(from_words(&[0xA5A5_A5A5; WORDS]), None);
/// ```
#[must_use]
pub fn to_words(last: &LastOutputs) -> [u32; WORDS] {
    let [a, b, c, d] = last.pulses_us.map(u32::from);
    let content = [MAGIC, a | b << 16, c | d << 16, u32::from(last.on) | last.cut.min(MOST_CUT) << 16];
    let [magic, hips, knees, rest] = content;
    [magic, hips, knees, rest, checksum(&content)]
}

/// From words; `None` when they are no record.
#[must_use]
pub fn from_words(&[magic, hips, knees, rest, check]: &[u32; WORDS]) -> Option<LastOutputs> {
    if magic != MAGIC || check != checksum(&[magic, hips, knees, rest]) || rest & 0xFFFF > 1 {
        return None;
    }
    let [low, high] = [|word: u32| word as u16, |word: u32| (word >> 16) as u16];
    let pulses_us = [low(hips), high(hips), low(knees), high(knees)];
    Some(LastOutputs { pulses_us, on: rest & 1 != 0, cut: rest >> 16 })
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
        let words = to_words(&LastOutputs { pulses_us: [1325, 1786, 988, 2013], on: true, cut: 9 });
        for word in 0..WORDS {
            for bit in 0..32 {
                let mut flipped = words;
                flipped[word] ^= 1 << bit;
                assert_eq!(from_words(&flipped), None, "word {word} bit {bit}");
            }
        }
        for noise in [0, u32::MAX] {
            assert_eq!(from_words(&[noise; WORDS]), None);
        }
    }

    #[test]
    fn the_number_of_cut_pulses_stops_at_its_largest() {
        let cut = |cut| from_words(&to_words(&LastOutputs { cut, ..LastOutputs::default() })).map(|last| last.cut);
        assert_eq!([65_535, 65_536, u32::MAX].map(cut), [Some(65_535); 3]);
    }

    #[test]
    fn the_supply_decides_what_is_kept() {
        let kept: Vec<_> = Reset::ALL.into_iter().filter(|reset| is_kept_by(*reset)).map(Reset::name).collect();
        assert_eq!(kept, ["iwdg", "wwdg", "software", "low_power", "pin"]);
    }
}
