//! Status codes, and the text of an error in memory of the caller.

use core::ffi::{CStr, c_char};
use core::fmt::{self, Write};

use cpg_core::BuildError;

/// Bytes of the text of an error, with the zero at its end.
pub const FOOTFALL_TEXT_BYTES: usize = 192;

/// What became of a call.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FootfallStatus {
    /// It did what it says.
    Ok = 0,
    /// A pointer is null, or an object was not built.
    NotBuilt = 1,
    /// No gait has this name.
    UnknownName = 2,
    /// A value is not a finite number.
    NotFinite = 3,
    /// A value is out of its range.
    OutOfRange = 4,
    /// The control period is 0 or too long.
    Period = 5,
    /// A record cannot be read.
    Record = 6,
    /// The control loop cannot be built of its parts.
    Loop = 7,
}

/// Why a build was refused.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct FootfallError {
    /// The kind of error.
    pub status: FootfallStatus,
    /// What is wrong, its value, and what is allowed: text in UTF-8 with a zero at its end.
    pub text: [c_char; FOOTFALL_TEXT_BYTES],
}

/// Writes text, cut at the end of the buffer.
struct Cut<'a> {
    text: &'a mut [c_char; FOOTFALL_TEXT_BYTES],
    length: usize,
}

impl Write for Cut<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        // The last byte stays zero.
        for (place, byte) in self.text[..FOOTFALL_TEXT_BYTES - 1].iter_mut().skip(self.length).zip(text.bytes()) {
            *place = byte as c_char;
            self.length += 1;
        }
        Ok(())
    }
}

/// Writes the error where the caller wants it, and returns its status.
///
/// # Safety
/// `error` is null, or points to an error that nobody else uses.
pub(crate) unsafe fn refuse(
    error: *mut FootfallError,
    status: FootfallStatus,
    why: impl fmt::Display,
) -> FootfallStatus {
    let mut text = [0; FOOTFALL_TEXT_BYTES];
    // Writing into the buffer cannot fail.
    let _ = write!(Cut { text: &mut text, length: 0 }, "{why}");
    if !error.is_null() {
        // SAFETY: it is not null, and the caller guarantees the rest.
        unsafe { error.write(FootfallError { status, text }) };
    }
    status
}

/// The status of a refused configuration.
pub(crate) fn status_of(error: &BuildError) -> FootfallStatus {
    match error {
        BuildError::NotFinite { .. } => FootfallStatus::NotFinite,
        BuildError::PeriodTooLong { .. } => FootfallStatus::Period,
        _ => FootfallStatus::OutOfRange,
    }
}

/// A text of C; `None` if it is null or not UTF-8.
///
/// # Safety
/// `text` is null, or points to bytes with a zero at their end that stay while the result lives.
pub(crate) unsafe fn text<'a>(text: *const c_char) -> Option<&'a str> {
    if text.is_null() {
        return None;
    }
    // SAFETY: it is not null, and the caller guarantees the zero at its end.
    unsafe { CStr::from_ptr(text) }.to_str().ok()
}

/// Bytes of the caller; `None` if they are null.
///
/// # Safety
/// `bytes` is null, or points to `length` bytes that stay while the result lives.
pub(crate) unsafe fn bytes<'a>(bytes: *const u8, length: usize) -> Option<&'a [u8]> {
    // SAFETY: it is not null, and the caller guarantees the length.
    (!bytes.is_null()).then(|| unsafe { core::slice::from_raw_parts(bytes, length) })
}
