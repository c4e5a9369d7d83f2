//! The files and the packages of this workspace.

use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use serde_json::Value;

/// The crates that compile for every chip, in the order of their dependencies.
pub const CORES: [&str; 5] = ["joint-units", "hgod-adc", "cpg-core", "joint-loop", "wire"];

/// The folder of the workspace.
///
/// # Panics
/// This package is not in a folder.
#[must_use]
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ is in the workspace")
}

static FILES: LazyLock<Vec<String>> = LazyLock::new(|| {
    let output = Command::new("git")
        .args(["-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(root())
        .output()
        .expect("git starts");
    assert!(output.status.success(), "git ls-files: {}", String::from_utf8_lossy(&output.stderr));
    let list = String::from_utf8(output.stdout).expect("file names are text");
    // A file that was removed but not from the index is not there.
    let files: Vec<String> =
        list.split('\0').filter(|name| !name.is_empty() && root().join(name).is_file()).map(str::to_owned).collect();
    assert!(files.len() > 200, "{} files", files.len());
    files
});

/// Every file of the repository that git does not ignore, relative to the root.
///
/// # Panics
/// git cannot list them.
pub fn files() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(String::as_str)
}

/// Those of [`files`] whose names end so.
///
/// # Panics
/// As [`files`].
pub fn files_ending(endings: &'static [&'static str]) -> impl Iterator<Item = &'static str> {
    files().filter(move |name| endings.iter().any(|ending| name.ends_with(ending)))
}

/// The text of a file, whose name is relative to the root.
///
/// # Panics
/// It cannot be read.
#[must_use]
pub fn read(name: impl AsRef<Path>) -> String {
    let path = root().join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

static METADATA: LazyLock<Value> = LazyLock::new(|| {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "cargo metadata: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("cargo metadata is JSON")
});

/// What `cargo metadata` says about the packages of this workspace.
///
/// # Panics
/// Cargo cannot be called.
#[must_use]
pub fn metadata() -> &'static Value {
    &METADATA
}

/// Fails with the list of what was found.
///
/// # Panics
/// Something was found.
pub fn assert_none(found: &[String], what: &str) {
    assert!(found.is_empty(), "{} {what}:\n{}", found.len(), found.join("\n"));
}
