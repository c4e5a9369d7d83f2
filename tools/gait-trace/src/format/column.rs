//! A column of a file that was recognised as a joint, and its place for errors.

use crate::fault::{Fault, TraceError};
use crate::format::row_lines::RowLines;
use crate::format::unit::Said;
use crate::raw::SignSource;
use joint_units::Joint;

/// A column of a file that was recognised as a joint, in the file's unit.
pub(crate) struct AngleColumn {
    pub(crate) joint: Joint,
    /// Its name in the file.
    pub(crate) heading: String,
    /// Its index in the file, from 0.
    pub(crate) index: usize,
    /// The unit that the file names.
    pub(crate) said: Said,
    /// What the file or its format says about the sign, if the joint is a hip.
    pub(crate) sign: SignSource,
    pub(crate) values: Vec<f64>,
}

/// Place of the columns for errors: the file's name and the line of each row, if the file has lines.
pub(crate) struct Place<'a> {
    pub(crate) file: &'a str,
    /// The line of the heading.
    pub(crate) header: Option<u64>,
    /// The line of each row; empty for a file without lines.
    pub(crate) lines: &'a RowLines,
}

impl Place<'_> {
    pub(crate) fn at(&self, line: Option<u64>, column: Option<&AngleColumn>, fault: Fault) -> TraceError {
        let error = TraceError::new(self.file, line, fault);
        match column {
            Some(column) => error.in_column(column.index, &column.heading),
            None => error,
        }
    }
}
