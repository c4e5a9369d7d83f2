//! Reads the rows of a table from its whole text, or from blocks of it that are in memory one at a time, with the same result.

use crate::fault::{Fault, TraceError};
use crate::format::blocks::Blocks;
use crate::format::text_table::{BareLines, bare_lines, check_length, is_blank};
use crate::options::ReadOptions;
use crate::raw::RawJoints;
use std::borrow::Cow;

/// A line below the header that is not blank.
#[derive(Clone, Copy)]
pub(crate) struct Row<'t> {
    /// Its number from 1.
    pub(crate) line: u64,
    pub(crate) text: &'t str,
    /// The file ends within it: it has no line end.
    pub(crate) is_open: bool,
}

/// A table that reads its header, then takes its rows one by one, without the text before and behind each.
pub(crate) trait Rows: Sized {
    /// Reads the header at the beginning of a text.
    fn begin(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<Self, TraceError>;

    /// The file's name.
    fn name(&self) -> &str;

    /// The last line of the header.
    fn header_end(&self) -> u64;

    /// Reads a row; `fields` is memory for its fields.
    fn push<'t>(&mut self, row: Row<'t>, fields: &mut Vec<Cow<'t, str>>) -> Result<(), TraceError>;

    /// Reads rows that can be read faster than one by one, up to one that cannot; `line` is the last line before them.
    fn push_plain(&mut self, _line: &mut u64, _lines: &mut BareLines<'_>) {}

    /// Lines behind the row with a fault, which may say more about it.
    fn look_behind(_error: &mut TraceError, _lines: &mut BareLines<'_>) {}

    /// The joints, once all rows are read; `ended` is whether the last line has an end.
    fn finish(self, ended: bool, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError>;

    /// Reads lines, of which some may be of the header; `line` is the last line before them.
    fn push_lines(&mut self, line: &mut u64, lines: &mut BareLines<'_>) -> Result<(), TraceError> {
        let (header_end, is_open) = (self.header_end(), lines.is_open());
        let mut fields = Vec::new();
        loop {
            if *line >= header_end {
                self.push_plain(line, lines);
            }
            let Some(text) = lines.next() else { return Ok(()) };
            *line += 1;
            if *line > header_end {
                check_length(self.name(), *line, text)?;
                if !is_blank(text) {
                    let is_open = is_open && lines.rest().is_empty();
                    self.push(Row { line: *line, text, is_open }, &mut fields)?;
                }
            }
        }
    }

    /// Reads the rows of the whole text.
    ///
    /// # Errors
    /// The first fault of a row, else that of the table.
    fn read(mut self, text: &str, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
        let mut lines = bare_lines(text);
        let ended = !lines.is_open();
        if let Err(mut error) = self.push_lines(&mut 0, &mut lines) {
            Self::look_behind(&mut error, &mut lines);
            return Err(error);
        }
        self.finish(ended, how)
    }
}

/// Reads a table from blocks of its text; `head` is its beginning, with all lines that the header is looked for in. `None` if the blocks are
/// not text, or a line is too long: reading the whole file says where.
///
/// # Errors
/// That of the header, else the first one of a row, else that of the table; or those of the source.
pub(crate) fn read_blocks<T: Rows>(
    name: &str,
    head: &str,
    blocks: &mut Blocks<'_>,
    how: &ReadOptions<'_>,
) -> Result<Option<RawJoints>, TraceError> {
    let mut table = T::begin(name, head, how);
    let (mut line, mut ended) = (0, true);
    while let Some(block) = blocks.next().map_err(|error| TraceError::new(name, None, Fault::Io(error)))? {
        let Some(mut lines) = block else { return Ok(None) };
        ended = !lines.is_open();
        // A fault of the text is reported before any of its rows: behind one of a row, blocks are still looked through.
        if let Ok(rows) = &mut table
            && let Err(error) = rows.push_lines(&mut line, &mut lines)
        {
            table = Err(error);
        }
        if let Err(error) = &mut table {
            T::look_behind(error, &mut lines);
        }
    }
    table?.finish(ended, how).map(Some)
}
