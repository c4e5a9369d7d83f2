//! The firmware's ELF file: its hash, and the table that decodes its log.
//!
//! The bytes of a `defmt` log are indices into the format strings of **that** ELF file. Another file decodes them to plausible but
//! wrong text, so the hash of the file goes into every capture, and a stream whose first frame is malformed is refused.

use defmt_decoder::{DecodeError, StreamDecoder, Table};
use firmware::board::BOARDS;
use joint_loop::SENSORS;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use crate::board::default_loop::{SENSOR_PINS, sensor_pins};
use crate::file::bounded::{self, ReadError};

/// Most bytes of an ELF file: an image with all of its debugging data has a hundredth of that.
const MOST_BYTES: u64 = 1 << 30;

/// How the symbol begins that names the board of an image.
const BOARD_SYMBOL: &str = "__board_";

/// The symbol of a board's image, as it stands in the table of names.
fn board_symbol(board: &str) -> String {
    format!("{BOARD_SYMBOL}{}\0", board.replace('-', "_"))
}

/// Why an ELF file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file cannot be read.
    #[error("{}: {why}", .file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The reason.
        why: ReadError,
    },
    /// The file is no ELF file, or its log format is not supported.
    #[error("{}: is no firmware image: {why}; allowed is the ELF file that `cargo xtask build` makes", .file.display())]
    NoElf {
        /// The file.
        file: PathBuf,
        /// The decoder's reason.
        why: String,
    },
    /// The file has no log.
    #[error("{}: holds no defmt log; allowed is the ELF file that `cargo xtask build` makes (not stripped)", .file.display())]
    NoLog {
        /// The file.
        file: PathBuf,
    },
}

/// A firmware image.
#[derive(Debug)]
pub struct Image {
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
    table: Table,
    bytes: Vec<u8>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// It cannot be read, is no ELF file, or has no log.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let file = || path.to_owned();
        let bytes = bounded::bytes(path, MOST_BYTES).map_err(|why| ImageError::Unreadable { file: file(), why })?;
        let parsed = Table::parse(&bytes).map_err(|why| ImageError::NoElf { file: file(), why: format!("{why:#}") })?;
        let table = parsed.ok_or_else(|| ImageError::NoLog { file: file() })?;
        Ok(Self { sha256: sha256(&bytes), table, bytes })
    }

    /// Whether the image is of that board, by the symbol of its build. A file without one is of the boards whose names are somewhere in it. Images of two
    /// boards may have the same table.
    #[must_use]
    pub fn is_of_board(&self, name: &str) -> bool {
        name.is_empty() || self.holds(&board_symbol(name)) || !self.holds(BOARD_SYMBOL) && self.holds(name)
    }

    /// The pins of the sensors of the image's board, from channel 1 on. Without the symbol of a board they are those of the default board.
    #[must_use]
    pub fn sensor_pins(&self) -> [&'static str; SENSORS] {
        let named = BOARDS.iter().find(|board| self.holds(&board_symbol(board.name)));
        named.map_or(SENSOR_PINS, |board| sensor_pins(board))
    }

    fn holds(&self, text: &str) -> bool {
        self.bytes.windows(text.len()).any(|bytes| bytes == text.as_bytes())
    }

    /// A decoder at the beginning of a stream.
    #[must_use]
    pub fn decoder(&self) -> Decoder<'_> {
        Decoder { stream: self.table.new_stream_decoder(), table: &self.table, waiting: 0, is_long: false }
    }
}

/// SHA-256, hexadecimal.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// SHA-256 of what a file has from its place on, hexadecimal.
///
/// # Errors
/// It cannot be read.
pub fn sha256_of(file: &mut impl io::Read) -> io::Result<String> {
    let mut hash = Sha256::new();
    io::copy(file, &mut hash)?;
    Ok(hexadecimal(&hash.finalize()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    let mut text = String::new();
    for byte in bytes {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
    }
    text
}

/// A message of the log.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Its time stamp by the board's clock, s; `None` if the image has none.
    pub stamp_s: Option<f64>,
    /// `info`, `warn`, `error` ...; empty if the message has no level.
    pub level: String,
    /// The text.
    pub text: String,
}

/// The bytes are no frame of this image's log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Malformed;

/// Most bytes of a message, far more than one of the firmware has. The decoder looks through all that waits at each call.
const MOST_WAITING: usize = 1 << 16;

/// Decodes a stream of bytes to messages.
pub struct Decoder<'t> {
    table: &'t Table,
    stream: Box<dyn StreamDecoder + Send + Sync + 't>,
    /// Bytes since the last message, at least.
    waiting: usize,
    /// More came than a message has, and was discarded.
    is_long: bool,
}

impl Decoder<'_> {
    /// Adds bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(MOST_WAITING) {
            if self.waiting + part.len() > MOST_WAITING {
                self.restart();
                self.is_long = true;
            }
            self.waiting += part.len();
            self.stream.received(part);
        }
    }

    /// The next complete message. After [`Malformed`] the following frames can still be read.
    pub fn message(&mut self) -> Option<Result<Message, Malformed>> {
        if std::mem::take(&mut self.is_long) {
            return Some(Err(Malformed));
        }
        let decoded = self.stream.decode();
        if !matches!(decoded, Err(DecodeError::UnexpectedEof)) {
            self.waiting = 0;
        }
        match decoded {
            Ok(frame) => {
                let level = frame.level().map_or(String::new(), |level| level.as_str().to_owned());
                let stamp_s = frame.display_timestamp().and_then(|stamp| stamp.to_string().parse().ok());
                Some(Ok(Message { stamp_s, level, text: frame.display_message().to_string() }))
            }
            Err(DecodeError::UnexpectedEof) => None,
            Err(DecodeError::Malformed) => Some(Err(Malformed)),
        }
    }

    /// Discards an unfinished frame, after a reset of the board.
    pub fn restart(&mut self) {
        self.stream = self.table.new_stream_decoder();
        (self.waiting, self.is_long) = (0, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_sha_256() {
        // FIPS 180-2, appendix B.1.
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn files_that_are_no_images_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fw.elf");
        let error = Image::read(&path).unwrap_err();
        assert!(matches!(error, ImageError::Unreadable { .. }) && error.to_string().contains("fw.elf"), "{error}");
        for junk in [&b""[..], b"time_s,left_knee_deg\n", b"\x7fELF\x01\x01\x01"] {
            std::fs::write(&path, junk).unwrap();
            let error = Image::read(&path).unwrap_err();
            assert!(matches!(error, ImageError::NoElf { .. }) && error.to_string().contains("fw.elf"), "{error}");
        }
        // The running test program: an ELF file without a log.
        std::fs::copy(std::env::current_exe().unwrap(), &path).unwrap();
        assert!(matches!(Image::read(&path).unwrap_err(), ImageError::NoLog { .. }));
    }
}
