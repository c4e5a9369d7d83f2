//! Reads a text in blocks of whole lines, so that a file of any size takes the memory of one block.

use crate::format::text_table::{BareLines, MAX_LINE, first_control};
use memchr::{memchr, memrchr};
use std::io::{self, Read};

/// Bytes of a block: the longest line and more.
const BLOCK: usize = 2 * MAX_LINE;

/// Blocks of whole lines.
pub(crate) struct Blocks<'r> {
    source: &'r mut dyn Read,
    /// Memory of a block.
    buffer: Vec<u8>,
    /// Bytes that were read into the buffer.
    filled: usize,
    /// Bytes of the last block.
    given: usize,
    /// A byte order mark may be at the beginning.
    at_start: bool,
}

impl<'r> Blocks<'r> {
    pub(crate) fn of(source: &'r mut dyn Read) -> Self {
        Self::of_bytes(BLOCK, source)
    }

    /// Blocks of at most so many bytes, which are those of the longest line at least.
    pub(crate) fn of_bytes(bytes: usize, source: &'r mut dyn Read) -> Self {
        Self { source, buffer: vec![0; bytes], filled: 0, given: 0, at_start: true }
    }

    /// The next block of lines that end in LF, the last of which may have no end; `None` at the end. `Some(None)` if it is not text as
    /// [`text`](super::text_table::text) allows it, or has a line of more than [`MAX_LINE`] bytes, or of more than a block.
    ///
    /// # Errors
    /// Those of the source.
    pub(crate) fn next(&mut self) -> io::Result<Option<Option<BareLines<'_>>>> {
        self.buffer.copy_within(self.given..self.filled, 0);
        self.filled -= self.given;
        let mut ended = false;
        while self.filled < self.buffer.len() && !ended {
            match self.source.read(&mut self.buffer[self.filled..]) {
                Ok(0) => ended = true,
                Ok(count) => self.filled += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        let bytes = &self.buffer[..self.filled];
        let end = if ended { self.filled } else { memrchr(b'\n', bytes).map_or(0, |end| end + 1) };
        self.given = end;
        if ended && end == 0 {
            return Ok(None);
        }
        let begin = if std::mem::take(&mut self.at_start) && bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        let block = &bytes[begin.min(end)..end];
        // Without LF a whole text would have its lines at CR.
        if memchr(b'\n', block).is_none() && !ended || has_long_line(block) || first_control(block).is_some() {
            return Ok(Some(None));
        }
        Ok(Some(std::str::from_utf8(block).ok().map(BareLines::in_lf)))
    }
}

/// Whether a line has more than [`MAX_LINE`] bytes, or about as many.
fn has_long_line(block: &[u8]) -> bool {
    let mut from = 0;
    while from < block.len() {
        // The last line end within the longest line; one beyond it is of a line that is too long.
        let to = block.len().min(from + MAX_LINE);
        if to == block.len() {
            return false;
        }
        match memrchr(b'\n', &block[from..to]) {
            Some(end) => from += end + 1,
            None => return true,
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Option<Vec<String>> {
        let mut source = bytes;
        let mut blocks = Blocks::of(&mut source);
        let mut all = Vec::new();
        while let Some(block) = blocks.next().unwrap() {
            all.push(block?.rest().to_owned());
        }
        Some(all)
    }

    #[test]
    fn blocks_are_whole_lines_and_all_of_them() {
        let text: String = (0..400_000).map(|n| format!("{n},é\r\n")).collect();
        for end in ["", "the last"] {
            let text = format!("{text}{end}");
            let blocks = read(text.as_bytes()).unwrap();
            assert!(blocks.len() > 2 && blocks.concat() == text);
            assert!(blocks[..blocks.len() - 1].iter().all(|block| block.ends_with('\n') && block.len() <= BLOCK));
        }
        assert_eq!(read(b"\xef\xbb\xbfa\nb").unwrap(), ["a\nb"]);
        assert!(read(b"").unwrap().is_empty());
    }

    #[test]
    fn what_is_not_text_is_not_given() {
        let line = "0.25,1\n".repeat(500_000);
        for bad in [b"\x00\n".as_slice(), b"\xff\n", &[b'7'; MAX_LINE + 1], &[b'7'; 3 * MAX_LINE]] {
            let bytes = [line.as_bytes(), bad, line.as_bytes()].concat();
            assert!(read(&bytes).is_none(), "{:?}", &bad[..1]);
        }
    }
}
