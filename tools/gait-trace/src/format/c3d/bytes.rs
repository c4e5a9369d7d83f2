//! The bytes of a C3D file with the file's name, and reads that report where the file ends too early.

use crate::fault::{Fault, TraceError};

/// A file that is read: its name for errors, and its bytes.
pub(crate) struct Ctx<'a> {
    pub(crate) file: &'a str,
    pub(crate) bytes: &'a [u8],
}

impl Ctx<'_> {
    /// The error of a field that cannot be used, at an offset in bytes from 0.
    pub(crate) fn bad(&self, offset: usize, field: &str, found: &str, allowed: &str) -> TraceError {
        let fault = Fault::Binary { offset, field: field.into(), found: found.into(), allowed: allowed.into() };
        TraceError::new(self.file, None, fault)
    }

    /// `N` bytes at an offset, or the error that the file ends before them.
    pub(crate) fn at<const N: usize>(&self, offset: usize, field: &str) -> Result<[u8; N], TraceError> {
        let end = offset.checked_add(N);
        let slice = end.and_then(|end| self.bytes.get(offset..end)).and_then(|slice| slice.try_into().ok());
        slice.ok_or_else(|| {
            let found = format!("beyond the end of the file, at {}", self.bytes.len());
            self.bad(offset, field, &found, "a place inside of the file")
        })
    }
}
