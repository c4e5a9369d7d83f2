//! Recordings: one is in the repository, [`test_suite::traces_folder`] beside it holds many more.

use footfall::board::feed;
use gait_trace::Recording;
use gait_trace::format::csv_file;
use std::path::{Path, PathBuf};

/// The folder of this package.
#[must_use]
pub fn package() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The recordings of the repository.
#[must_use]
pub fn default_traces_folder() -> PathBuf {
    package().join("traces")
}

/// The default recording of angles.
///
/// # Panics
/// It cannot be read.
#[must_use]
pub fn default_trace() -> Recording {
    feed::default_trace().expect("the default recording is good").1
}

/// The default recording of semi-synthetic volts: a loop.
///
/// # Panics
/// It cannot be read.
#[must_use]
pub fn default_volts() -> Recording {
    csv_file::read(&default_volts_file()).expect("the default volts are good")
}

/// Where the default volts are.
#[must_use]
pub fn default_volts_file() -> PathBuf {
    default_traces_folder().join("gaitkit_fukuchi_healthy_left_knee_volts.csv")
}

/// Every CSV file in a folder and the folders in it, in order.
///
/// # Panics
/// The folder cannot be read.
#[must_use]
pub fn csv_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder that can be read") {
        let path = entry.expect("an entry that can be read").path();
        if path.is_dir() {
            files.extend(csv_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "csv") {
            files.push(path);
        }
    }
    files.sort();
    files
}
