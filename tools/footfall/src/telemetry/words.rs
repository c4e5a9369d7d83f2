//! The words of a line of the log, and what is said where another one was expected.

use super::LineError;
use std::str::{FromStr, SplitWhitespace};

/// The words of a line, taken one by one.
pub(super) struct Words<'a> {
    line: &'a str,
    rest: SplitWhitespace<'a>,
    /// The last one that was taken.
    word: &'a str,
}

impl<'a> Words<'a> {
    pub(super) fn of(line: &'a str) -> Self {
        Self { line, rest: line.split_whitespace(), word: "" }
    }

    /// How many are left.
    pub(super) fn left(&self) -> usize {
        self.rest.clone().count()
    }

    pub(super) fn next(&mut self) -> &'a str {
        self.word = self.rest.next().unwrap_or_default();
        self.word
    }

    /// The next one, left where it is.
    pub(super) fn peek(&self) -> &'a str {
        self.rest.clone().next().unwrap_or_default()
    }

    pub(super) fn wanted(&self, wanted: &str) -> LineError {
        LineError { line: self.line.into(), wanted: wanted.into(), found: self.word.into() }
    }

    pub(super) fn text(&mut self) -> Result<String, LineError> {
        match self.next() {
            "" => Err(self.wanted("a word")),
            word => Ok(word.into()),
        }
    }

    pub(super) fn after(&mut self, literal: &str) -> Result<&mut Self, LineError> {
        if self.next() == literal { Ok(self) } else { Err(self.wanted(&format!("`{literal}`"))) }
    }

    pub(super) fn number<T: FromStr>(&mut self) -> Result<T, LineError> {
        self.next().parse().map_err(|_| self.wanted("a number"))
    }

    pub(super) fn four<T: FromStr + Copy>(&mut self) -> Result<[T; 4], LineError> {
        Ok([self.number()?, self.number()?, self.number()?, self.number()?])
    }

    pub(super) fn name<T>(&mut self, wanted: &str, of: impl Fn(&str) -> Option<T>) -> Result<T, LineError> {
        of(self.next()).ok_or_else(|| self.wanted(wanted))
    }

    pub(super) fn hexadecimal<T>(&mut self, digits: usize, of: impl Fn(&str) -> Option<T>) -> Result<T, LineError> {
        self.name(&format!("{digits} hexadecimal digits"), |word| (word.len() == digits).then(|| of(word)).flatten())
    }

    pub(super) fn end(&mut self) -> Result<(), LineError> {
        if self.next().is_empty() { Ok(()) } else { Err(self.wanted("the end of the line")) }
    }
}
