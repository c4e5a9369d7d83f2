//! The time code: pulses on the synchronisation output that encode the tick counter, to align other recordings with the board's time.
//!
//! ```text
//! slot   100 ticks; begins with a rising edge, at a tick that is a multiple of 100
//! width  50 ms: the first slot of a frame;  10 ms: bit 0;  30 ms: bit 1
//! frame  32 slots, 3.2 s: the mark, 21 bits of the frame's number, 10 check bits, lowest bit first
//! number tick / 3200 of the mark's rising edge; 2^21 frames are 77 days, more than the range of the counter (50 days)
//! check  CRC-10 of the number: x^10 + x^9 + x^5 + x^4 + x + 1, start value 0x3FF
//! ```
//! Because of the start value, a constant width is not a valid frame. The frame in which the tick counter wraps is incomplete.

/// Ticks from rising edge to rising edge.
pub const SLOT_TICKS: u32 = 100;
/// Slots in a frame.
pub const SLOTS: u32 = 32;
/// Ticks in a frame.
pub const FRAME_TICKS: u32 = SLOT_TICKS * SLOTS;
/// Bits of the frame's number.
pub const NUMBER_BITS: u32 = 21;

/// Symbol of a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symbol {
    /// Start of a frame.
    Mark,
    /// One bit of the number or the check.
    Bit(bool),
}

impl Symbol {
    /// Width of the pulse, in ticks.
    #[must_use]
    pub const fn width_ticks(self) -> u32 {
        match self {
            Symbol::Mark => 50,
            Symbol::Bit(true) => 30,
            Symbol::Bit(false) => 10,
        }
    }
}

/// Check bits of a frame's number: CRC-10.
#[must_use]
pub const fn check(number: u32) -> u32 {
    let mut crc = 0x3FF;
    let mut bit = 0;
    while bit < NUMBER_BITS {
        let carry = (crc >> 9 ^ number >> bit) & 1;
        crc = (crc << 1 & 0x3FF) ^ if carry == 1 { 0x233 } else { 0 };
        bit += 1;
    }
    crc
}

/// Symbol of the slot of a tick.
#[must_use]
pub const fn symbol(tick: u32) -> Symbol {
    let number = tick / FRAME_TICKS;
    let bits = number as u64 | (check(number) as u64) << NUMBER_BITS;
    match (tick / SLOT_TICKS) % SLOTS {
        0 => Symbol::Mark,
        slot => Symbol::Bit(bits >> (slot - 1) & 1 == 1),
    }
}

/// Level of the output in a tick.
///
/// ```
/// use joint_loop::io::time_code::level;
/// let high = (0..100).filter(|tick| level(*tick)).count();
/// assert_eq!((level(0), level(49), level(50), high), (true, true, false, 50));
/// // Frame 1: its lowest bit is set.
/// assert_eq!((3300..3400).filter(|tick| level(*tick)).count(), 30);
/// ```
#[must_use]
pub const fn level(tick: u32) -> bool {
    let into = tick % SLOT_TICKS;
    // The check bits are computed only where the symbol decides.
    into < Symbol::Bit(false).width_ticks() || (into < Symbol::Mark.width_ticks() && into < symbol(tick).width_ticks())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_numbers_are_correct_and_the_last_one_fits() {
        let last = u32::MAX / FRAME_TICKS;
        assert!(last < 1 << NUMBER_BITS);
        for number in [0, 1, 2, 77_777, last - 1] {
            let bits = (1..SLOTS).map(|slot| symbol(number * FRAME_TICKS + slot * SLOT_TICKS));
            let read = bits.enumerate().fold(0_u64, |read, (n, symbol)| match symbol {
                Symbol::Bit(bit) => read | u64::from(bit) << n,
                Symbol::Mark => panic!("a mark inside a frame"),
            });
            assert_eq!(read & ((1 << NUMBER_BITS) - 1), u64::from(number));
            assert_eq!(read >> NUMBER_BITS, u64::from(check(number)));
        }
    }

    #[test]
    fn the_level_is_high_for_the_width_of_each_symbol() {
        for first in [0, 77_777 * FRAME_TICKS, u32::MAX - 2 * FRAME_TICKS] {
            for tick in first..first + 2 * FRAME_TICKS {
                assert_eq!(level(tick), tick % SLOT_TICKS < symbol(tick).width_ticks(), "{tick}");
            }
        }
    }

    #[test]
    fn one_or_two_wrong_bits_are_detected() {
        // A valid word with one or two changed bits is not valid.
        let word = |number: u32| u64::from(number) | u64::from(check(number)) << NUMBER_BITS;
        let valid = |word: u64| {
            let number = (word & ((1 << NUMBER_BITS) - 1)) as u32;
            word >> NUMBER_BITS == u64::from(check(number))
        };
        for number in [0, 1, 1_000, 123_456, (1 << NUMBER_BITS) - 1] {
            for one in 0..SLOTS - 1 {
                for two in one..SLOTS - 1 {
                    let changed = word(number) ^ (1_u64 << one) ^ if two == one { 0 } else { 1_u64 << two };
                    assert!(!valid(changed), "{number}: bits {one} and {two}");
                }
            }
        }
        assert!(!valid(0) && !valid((1 << (SLOTS - 1)) - 1), "a constant width");
    }
}
