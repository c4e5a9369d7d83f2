//! Writes what a command produces: data to standard output, and whole files.

use gait_trace::format::whole_file;
use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use crate::failure::Failure;

/// Writes data to standard output. A reader that closes the pipe early is no failure.
///
/// # Errors
/// Standard output cannot be written.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::run(error)),
        _ => Ok(()),
    }
}

/// Writes a text file: the whole of it, or nothing.
///
/// # Errors
/// The file cannot be written.
pub fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    write_bytes(path, text.as_bytes())
}

/// Writes a file: the whole of it, or nothing.
///
/// # Errors
/// The file cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    whole_file::write(path, |out| out.write_all(bytes)).map_err(|error| cannot_write(path, error))
}

/// The failure of a file that cannot be written.
#[must_use]
pub fn cannot_write(path: &Path, error: impl fmt::Display) -> Failure {
    Failure::run(format!("{}: cannot be written: {error}", path.display()))
}

/// Prints notes for the user to standard error, one a line.
pub fn notes(notes: impl IntoIterator<Item = impl fmt::Display>) {
    for note in notes {
        eprintln!("note: {note}");
    }
}
