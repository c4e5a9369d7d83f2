//! The words of a line of the log, and what is said where another one was expected.

use super::LineError;
use std::str::{FromStr, SplitWhitespace};

/// The words of a line, taken one by one.
pub(crate) struct Words<'a> {
    line: &'a str,
    rest: SplitWhitespace<'a>,
    /// The last one that was taken.
    word: &'a str,
}

impl<'a> Words<'a> {
    pub(crate) fn of(line: &'a str) -> Self {
        Self { line, rest: line.split_whitespace(), word: "" }
    }

    /// How many are left.
    pub(crate) fn left(&self) -> usize {
        self.rest.clone().count()
    }

    pub(crate) fn next(&mut self) -> &'a str {
        self.word = self.rest.next().unwrap_or_default();
        self.word
    }

    /// The next one, left where it is.
    pub(crate) fn peek(&self) -> &'a str {
        self.rest.clone().next().unwrap_or_default()
    }

    pub(crate) fn wanted(&self, wanted: &str) -> LineError {
        LineError { line: self.line.into(), wanted: wanted.into(), found: self.word.into() }
    }

    pub(crate) fn text(&mut self) -> Result<String, LineError> {
        match self.next() {
            "" => Err(self.wanted("a word")),
            word => Ok(word.into()),
        }
    }

    pub(crate) fn after(&mut self, literal: &str) -> Result<&mut Self, LineError> {
        if self.next() == literal { Ok(self) } else { Err(self.wanted(&format!("`{literal}`"))) }
    }

    pub(crate) fn number<T: FromStr>(&mut self) -> Result<T, LineError> {
        self.next().parse().map_err(|_| self.wanted("a number"))
    }

    pub(crate) fn four<T: FromStr + Copy>(&mut self) -> Result<[T; 4], LineError> {
        Ok([self.number()?, self.number()?, self.number()?, self.number()?])
    }

    pub(crate) fn name<T>(&mut self, wanted: &str, of: impl Fn(&str) -> Option<T>) -> Result<T, LineError> {
        of(self.next()).ok_or_else(|| self.wanted(wanted))
    }

    pub(crate) fn hexadecimal<T>(&mut self, digits: usize, of: impl Fn(&str) -> Option<T>) -> Result<T, LineError> {
        self.name(&format!("{digits} hexadecimal digits"), |word| (word.len() == digits).then(|| of(word)).flatten())
    }

    pub(crate) fn end(&mut self) -> Result<(), LineError> {
        if self.next().is_empty() { Ok(()) } else { Err(self.wanted("the end of the line")) }
    }
}
