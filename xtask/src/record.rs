//! Records for the parameter sectors, made with `footfall pack`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::probe::{self, Sector};
use crate::shell;
use crate::workspace::Workspace;

/// Makes a record with these arguments of `footfall pack`, whose paths are relative to where the user is. An existing file is replaced.
pub(crate) fn pack(workspace: &Workspace, arguments: &[OsString], record: &Path) -> Result<()> {
    let mut footfall = shell::command(workspace.footfall()?);
    footfall.current_dir(&workspace.started_in).arg("pack").args(arguments);
    probe::done(footfall.arg("--force").arg("--out").arg(record), "footfall pack")
}

/// Makes the record of the default robot.
pub(crate) fn pack_default_robot(workspace: &Workspace, record: &Path) -> Result<()> {
    let file = record.with_extension("toml");
    let text = shell::stdout_of(shell::command(workspace.footfall()?).args(["defaults", "robot"]))?;
    std::fs::write(&file, text).with_context(|| format!("writing {}", file.display()))?;
    pack(workspace, &["--robot".into(), file.into()], record)
}

/// Where the record of a sector that is made for one command is written.
pub(crate) fn path_of(workspace: &Workspace, sector: Sector) -> PathBuf {
    workspace.target_dir.join("images").join(sector.name()).with_extension("bin")
}
