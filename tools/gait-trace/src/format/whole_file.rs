//! Writes a file completely or not at all: to a temporary file in the same folder, flushed to disk, then renamed.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Calls `content` with a writer, and puts the result at `path` if it succeeds.
///
/// # Errors
/// The file cannot be written. No temporary file remains, and an existing file at `path` is unchanged.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("walk.csv");
/// gait_trace::format::whole_file::write(&path, |out| out.write_all(b"whole"))?;
/// let failed = gait_trace::format::whole_file::write(&path, |out| {
///     out.write_all(b"half")?;
///     Err(std::io::Error::other("power cut"))
/// });
/// assert!(failed.is_err());
/// assert_eq!(std::fs::read_to_string(&path)?, "whole");
/// assert_eq!(std::fs::read_dir(folder.path())?.count(), 1);
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let (part, file) = part_beside(path)?;
    let written = fill(file, content).and_then(|()| fs::rename(&part, path));
    if written.is_err() {
        // The error of the write is reported; one of the removal adds nothing.
        let _ = fs::remove_file(&part);
    }
    written
}

fn fill(file: File, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    content(&mut out)?;
    out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// A new file in the same folder, so that the rename stays on one file system.
fn part_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"))?;
    let mut part_name = OsString::from(".");
    part_name.push(name);
    part_name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(part_name);
    let file = OpenOptions::new().write(true).create(true).truncate(true).open(&part)?;
    Ok((part, file))
}
