//! Writes charts as SVG files.

use picture::draw;
pub use picture::links::{Link, Links, Node};
pub use picture::{Bars, Curve, Panel};
use std::path::Path;

use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output;

/// Draws the panels below one another and writes the file.
///
/// # Errors
/// The file exists and may not be replaced, or it cannot be written.
pub fn write(path: &Path, title: &str, panels: &[Panel], overwrite: Overwrite) -> Result<(), Failure> {
    output::write_text(path, &draw(&messages::escaped(title), panels, 1).map_err(Failure::run)?, overwrite)?;
    messages::written(path);
    Ok(())
}
