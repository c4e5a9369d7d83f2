//! Decimal commas, where nothing but tabs or blanks separates numbers: all numbers have them, or none has.

use crate::fault::{Fault, TraceError};

/// Which decimal signs the numbers of a file have.
#[derive(Debug, Default)]
pub(crate) struct Decimals {
    /// The line of the first comma.
    comma: Option<u64>,
    has_points: bool,
}

impl Decimals {
    /// Takes a number of a line.
    pub(crate) fn take(&mut self, line: u64, field: &str) {
        self.has_points |= field.contains('.');
        if self.comma.is_none() && field.contains(',') {
            self.comma = Some(line);
        }
    }

    /// A note if the numbers have decimal commas; an error if only some have.
    pub(crate) fn check(&self, name: &str, notes: &mut Vec<String>) -> Result<(), TraceError> {
        match self.comma {
            Some(line) if self.has_points => Err(TraceError::new(name, Some(line), Fault::MixedDecimals)),
            Some(_) => {
                notes.push("Numbers have decimal commas.".into());
                Ok(())
            }
            None => Ok(()),
        }
    }
}
