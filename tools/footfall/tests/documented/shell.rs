//! A folder in which command lines of pages run as in a clone: with copies of `samples` and `tests/traces`, and programs called `footfall`
//! and `cargo` that start the program under test.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The folder of the repository.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folder, which goes when it is dropped.
pub(crate) struct Shell {
    folder: tempfile::TempDir,
}

impl Shell {
    pub(crate) fn new() -> Self {
        let shell = Self { folder: tempfile::tempdir().unwrap() };
        copy(&root().join("samples"), &shell.path("samples"));
        copy(&root().join("tests/traces"), &shell.path("tests/traces"));
        for folder in ["programs", "out"] {
            std::fs::create_dir(shell.path(folder)).unwrap();
        }
        let footfall = env!("CARGO_BIN_EXE_footfall");
        shell.program("footfall", &format!("exec '{footfall}' \"$@\""));
        let not_run = "[ \"$1\" = footfall ] || { echo \"cargo $1 is not run here\"; exit 99; }";
        shell.program("cargo", &format!("{not_run}\nshift\nexec '{footfall}' \"$@\""));
        shell
    }

    fn program(&self, name: &str, script: &str) {
        let path = self.path("programs").join(name);
        std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).unwrap();
    }

    /// A file in the folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs a line as it is written.
    pub(crate) fn run(&self, line: &str) -> Output {
        let before = std::env::var_os("PATH").unwrap_or_default();
        let path = std::iter::once(self.path("programs")).chain(std::env::split_paths(&before));
        Command::new("sh")
            .args(["-c", line])
            .current_dir(self.folder.path())
            .env("PATH", std::env::join_paths(path).unwrap())
            .env("HOME", self.folder.path())
            .stdin(Stdio::null())
            .output()
            .unwrap()
    }
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}
