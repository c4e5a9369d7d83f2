//! Pictures as files.

use picture::draw;
pub use picture::{Bars, Curve, Panel};
use std::path::Path;

use crate::failure::Failure;

/// Draws the panels below one another and writes the file.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, title: &str, panels: &[Panel]) -> Result<(), Failure> {
    let text = draw(title, panels, 1).map_err(Failure::run)?;
    std::fs::write(path, text).map_err(|error| Failure::run(format!("{}: cannot be written: {error}", path.display())))
}
