//! Files with bytes of the flash.

use std::fs::File;
use std::path::PathBuf;

/// A file, and the flash address of its bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FlashDownload {
    pub(crate) addr: u32,
    pub(crate) file: PathBuf,
}

/// A sector, and the file that gets it.
#[derive(Debug)]
pub(super) struct SavedSector {
    pub(super) address: u32,
    pub(super) bytes: u32,
    pub(super) to: FlashDownload,
    pub(super) file: File,
}
