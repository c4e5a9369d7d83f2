//! Reads files of the user whole, up to a stated size.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Why a file was not read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It is not there, or may not be read.
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    /// It is a pipe, a device or a folder.
    #[error("is no regular file")]
    NotRegular,
    /// It is too large, or has no end.
    #[error("is larger than {most} bytes; allowed is up to that")]
    TooLarge {
        /// Most bytes.
        most: u64,
    },
    /// It is no text.
    #[error("is not text (line {line}); allowed is text in UTF-8")]
    NoText {
        /// The line of the first byte that is none, from 1.
        line: usize,
    },
}

/// The bytes of a file, of at most `most` bytes. No more are read, whatever the file is.
///
/// # Errors
/// It cannot be read or is larger.
pub fn bytes(path: &Path, most: u64) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(ReadError::TooLarge { most }) } else { Ok(bytes) }
}

/// The same of a regular file: to open a pipe would wait for who writes to it.
///
/// # Errors
/// As [`bytes`], or it is no regular file.
#[cfg(feature = "analysis")]
pub fn regular(path: &Path, most: u64) -> Result<Vec<u8>, ReadError> {
    if path.metadata()?.is_file() { bytes(path, most) } else { Err(ReadError::NotRegular) }
}

/// The text of a file, of at most `most` bytes.
///
/// # Errors
/// It cannot be read, is larger, or is no text.
pub fn text(path: &Path, most: u64) -> Result<String, ReadError> {
    String::from_utf8(bytes(path, most)?).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        ReadError::NoText { line: 1 + before.iter().filter(|&&byte| byte == b'\n').count() }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "a\nbc\n").unwrap();
        assert_eq!(text(&path, 5).unwrap(), "a\nbc\n");
        let error = bytes(&path, 4).unwrap_err().to_string();
        assert_eq!(error, "is larger than 4 bytes; allowed is up to that");
        std::fs::write(&path, b"a\nb\xff").unwrap();
        assert!(text(&path, 9).unwrap_err().to_string().starts_with("is not text (line 2)"));
        assert!(bytes(folder.path(), 9).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_file_without_end_is_refused() {
        assert!(matches!(bytes(Path::new("/dev/zero"), 1 << 16), Err(ReadError::TooLarge { .. })));
    }
}
