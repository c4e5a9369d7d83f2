//! Folders that a user names for output.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

/// A folder of the user's: nothing in it is replaced.
pub(crate) fn empty_folder(folder: PathBuf) -> Result<PathBuf> {
    std::fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let mut files = std::fs::read_dir(&folder).with_context(|| format!("reading {}", folder.display()))?;
    ensure!(files.next().is_none(), "{} is not empty; --out needs a new or an empty folder", folder.display());
    Ok(folder)
}
