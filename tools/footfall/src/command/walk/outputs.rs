//! Where the lines and the picture of a walk go.

use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output;

/// Where lines and picture go.
pub(super) struct Outputs {
    /// The file of the lines; standard output if there is none.
    pub(super) csv: Option<PathBuf>,
    /// The lines are JSON.
    pub(super) json: bool,
    pub(super) svg: Option<PathBuf>,
    pub(super) overwrite: Overwrite,
}

impl Outputs {
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        [&self.csv, &self.svg].into_iter().flatten().map(PathBuf::as_path)
    }

    /// Refuses files that may not be written.
    pub(super) fn check(&self) -> Result<(), Failure> {
        output::check_apart(self.files(), [])?;
        self.files().try_for_each(|path| output::check(path, self.overwrite))
    }

    /// Writes the lines, and the picture by `draw`, if there is one.
    pub(super) fn write(
        &self,
        lines: &str,
        draw: impl FnOnce(&Path, Overwrite) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if let Some(path) = &self.svg {
            draw(path, self.overwrite)?;
        }
        let Some(path) = &self.csv else { return output::print(lines) };
        output::write_text(path, lines, self.overwrite)?;
        messages::written(path);
        Ok(())
    }
}
