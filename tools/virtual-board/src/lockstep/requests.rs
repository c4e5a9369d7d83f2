//! Lines of a program's requests.

use std::io::{BufRead, Read as _, Result};

/// Longest line, bytes: a request with every pin is far shorter.
const LONGEST: u64 = 64 * 1024;

/// What was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Line {
    /// A line, without its end.
    Whole(Vec<u8>),
    /// A line that is longer than is allowed; it was skipped.
    TooLong,
    /// The input ended in the middle of a line.
    Cut,
    /// The input has ended.
    End,
}

impl Line {
    /// Longest line, bytes.
    pub(crate) const LONGEST: u64 = LONGEST;
}

/// Source of requests.
pub(crate) struct Requests(Box<dyn BufRead>);

impl Requests {
    /// Requests from a stream.
    pub(crate) fn new(input: impl BufRead + 'static) -> Self {
        Requests(Box::new(input))
    }

    /// Waits for the next line that is not empty.
    ///
    /// # Errors
    /// The stream cannot be read.
    pub(crate) fn next(&mut self) -> Result<Line> {
        loop {
            let mut line = Vec::new();
            self.0.by_ref().take(LONGEST + 1).read_until(b'\n', &mut line)?;
            match line.pop() {
                None => return Ok(Line::End),
                Some(b'\n') if line.trim_ascii().is_empty() => {}
                Some(b'\n') => return Ok(Line::Whole(line)),
                Some(_) if line.len() as u64 == LONGEST => return self.skip(),
                Some(_) => return Ok(Line::Cut),
            }
        }
    }

    fn skip(&mut self) -> Result<Line> {
        let mut piece = Vec::new();
        loop {
            piece.clear();
            self.0.by_ref().take(LONGEST).read_until(b'\n', &mut piece)?;
            match piece.last() {
                None => return Ok(Line::Cut),
                Some(b'\n') => return Ok(Line::TooLong),
                Some(_) => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<Line> {
        let mut requests = Requests::new(std::io::Cursor::new(text.to_owned()));
        let mut all = vec![requests.next().unwrap()];
        while !matches!(all.last(), Some(Line::End | Line::Cut)) {
            all.push(requests.next().unwrap());
        }
        all
    }

    #[test]
    fn a_line_ends_with_its_end() {
        let whole = |text: &str| Line::Whole(text.into());
        assert_eq!(lines("{}\n\n  \r\n[]\r\n"), [whole("{}"), whole("[]\r"), Line::End]);
        assert_eq!(lines("{}\n{\"us\": 10"), [whole("{}"), Line::Cut]);
        let long = "x".repeat(200_000);
        assert_eq!(lines(&format!("{long}\n{{}}\n")), [Line::TooLong, whole("{}"), Line::End]);
        assert_eq!(lines(&long), [Line::Cut]);
        let longest = "x".repeat(LONGEST as usize);
        assert_eq!(lines(&format!("{longest}\n")), [whole(&longest), Line::End]);
    }
}
