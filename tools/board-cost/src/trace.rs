//! Trace of the virtual board: its words as events. The format stands in `tools/virtual-board/src/execution_trace.rs`.

use std::io::Read;

use anyhow::{Context, Result, ensure};

use crate::flash::Control;

/// An event. Addresses are those of the flash at 0x0800_0000.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// A block of instructions begins.
    Block {
        /// Its address.
        address: u32,
        /// Its length, bytes.
        length: u32,
    },
    /// An exception is taken.
    Exception {
        /// Its number.
        number: u32,
        /// The frame has floating-point registers.
        floating: bool,
        /// It follows another handler without stacking.
        chained: bool,
    },
    /// A handler returned to what it interrupted.
    Return,
    /// Bits of the magnitudes of dividend and divisor.
    Division(u32, u32),
    /// The flash interface is set so.
    FlashControl(Control),
    /// A virtual millisecond has passed.
    Millisecond,
    /// The core starts after a reset.
    Boot,
}

/// Address of the flash.
const FLASH: u32 = 0x0800_0000;
/// Bytes that are read at a time.
const BUFFER: usize = 1 << 20;

impl Event {
    /// The event of a word.
    #[must_use]
    pub const fn of(word: u32) -> Self {
        let (upper, lower) = (word >> 19 & 0x3FF, word & 0x7_FFFF);
        match word >> 29 {
            0 => Self::Block { address: FLASH + 2 * lower, length: 2 * upper },
            1 => Self::Exception { number: lower, floating: upper & 1 != 0, chained: upper & 2 != 0 },
            2 => Self::Return,
            3 => Self::Division(upper, lower),
            4 => Self::FlashControl(Control::of(lower)),
            5 => Self::Millisecond,
            _ => Self::Boot,
        }
    }
}

/// Passes each event of a trace on, until there is no more or `each` returns false.
///
/// # Errors
///
/// When the trace cannot be read, or ends in the middle of a word, and what `each` returns.
pub fn read(mut from: impl Read, mut each: impl FnMut(Event) -> Result<()>) -> Result<()> {
    let mut buffer = vec![0; BUFFER];
    let mut filled = 0;
    loop {
        let count = from.read(&mut buffer[filled..]).context("reading the trace")?;
        if count == 0 {
            ensure!(filled == 0, "the trace ends in the middle of a word: the run was cut short; run it again");
            return Ok(());
        }
        filled += count;
        let whole = filled / 4 * 4;
        for word in buffer[..whole].chunks_exact(4) {
            each(Event::of(u32::from_le_bytes([word[0], word[1], word[2], word[3]])))?;
        }
        buffer.copy_within(whole..filled, 0);
        filled -= whole;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_word_is_an_event() {
        assert_eq!(Event::of(3 << 19 | 0x10), Event::Block { address: 0x0800_0020, length: 6 });
        let entry = Event::Exception { number: 72, floating: true, chained: false };
        assert_eq!(Event::of(1 << 29 | 1 << 19 | 72), entry);
        assert_eq!(Event::of(3 << 29 | 32 << 19 | 5), Event::Division(32, 5));
        assert_eq!(Event::of(4 << 29 | 0x705), Event::FlashControl(Control::of(0x705)));
        assert_eq!([2, 5, 6].map(|kind| Event::of(kind << 29)), [Event::Return, Event::Millisecond, Event::Boot]);
    }

    /// Gives one byte at a time.
    struct Slow<'a>(&'a [u8]);

    impl Read for Slow<'_> {
        fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
            let Some((first, rest)) = self.0.split_first() else { return Ok(0) };
            (into[0], self.0) = (*first, rest);
            Ok(1)
        }
    }

    #[test]
    fn a_trace_in_pieces_is_whole_and_a_cut_one_is_refused() {
        let bytes: Vec<u8> = [2_u32 << 29, 5 << 29].iter().flat_map(|word| word.to_le_bytes()).collect();
        let mut events = Vec::new();
        read(Slow(&bytes), |event| {
            events.push(event);
            Ok(())
        })
        .unwrap();
        assert_eq!(events, [Event::Return, Event::Millisecond]);
        let error = read(Slow(&bytes[..7]), |_| Ok(())).unwrap_err().to_string();
        assert!(error.contains("in the middle of a word"), "{error}");
    }
}
