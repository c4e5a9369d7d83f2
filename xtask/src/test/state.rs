//! What the steps share: the workspace, what an earlier step has built, the tests that have run.

use std::cell::{OnceCell, RefCell};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::counts::Counts;
use super::programs;
use crate::board::{Board, Variant};
use crate::setup::{REQUIRE, Required};
use crate::shell;
use crate::workspace::Workspace;

/// A step without what it needs, as it turned out while it ran: it is skipped, and neither passed nor failed.
#[derive(Debug)]
pub(super) struct CannotRun(pub(super) String);

impl std::fmt::Display for CannotRun {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for CannotRun {}

/// What the steps share: the workspace, what an earlier step has built, and the tests that have run.
pub(super) struct State {
    pub(super) workspace: Workspace,
    pub(super) required: Required,
    pub(super) counts: RefCell<Counts>,
    pub(super) image: OnceCell<PathBuf>,
    pub(super) shadow: OnceCell<PathBuf>,
    pub(super) without_sensor: OnceCell<PathBuf>,
    pub(super) black_pill: OnceCell<PathBuf>,
    virtual_board: OnceCell<PathBuf>,
}

impl State {
    pub(super) fn new(workspace: Workspace, required: Required) -> State {
        State {
            workspace,
            required,
            counts: RefCell::default(),
            image: OnceCell::new(),
            shadow: OnceCell::new(),
            without_sensor: OnceCell::new(),
            black_pill: OnceCell::new(),
            virtual_board: OnceCell::new(),
        }
    }

    pub(super) fn image(&self) -> Result<&Path> {
        build_once(&self.image, || Ok(self.workspace.firmware(Board::F4Discovery, Variant::USUAL)?.elf))
    }

    pub(super) fn shadow(&self) -> Result<&Path> {
        build_once(&self.shadow, || Ok(self.workspace.firmware(Board::F4Discovery, Variant::SHADOW)?.elf))
    }

    /// The image with the features `no-sensor` and `no-debugger`.
    pub(super) fn without_sensor(&self) -> Result<&Path> {
        build_once(&self.without_sensor, || Ok(self.workspace.firmware_without_sensor()?.elf))
    }

    /// The image of the Black Pill, the other board that the virtual board models.
    pub(super) fn black_pill(&self) -> Result<&Path> {
        build_once(&self.black_pill, || Ok(self.workspace.firmware(Board::BlackPillF411, Variant::USUAL)?.elf))
    }

    pub(super) fn virtual_board(&self) -> Result<&Path> {
        build_once(&self.virtual_board, || self.workspace.virtual_board())
    }

    /// Where the output of programs is kept.
    pub(super) fn logs(&self) -> PathBuf {
        self.workspace.target_dir.join("xtask-logs")
    }

    /// Where the output of a program that is run under a deadline is kept.
    pub(super) fn log(&self, name: &str) -> PathBuf {
        self.logs().join(format!("{name}.log"))
    }
}

fn build_once(cell: &OnceCell<PathBuf>, make: impl FnOnce() -> Result<PathBuf>) -> Result<&Path> {
    if cell.get().is_none() {
        // Empty, so this sets it.
        let _ = cell.set(make()?);
    }
    cell.get().map(PathBuf::as_path).context("nothing was built")
}

/// A cargo command of the host whose output is the step's.
pub(super) fn cargo(arguments: &[&str]) -> Result<()> {
    shell::must_succeed(shell::cargo().args(arguments), &format!("cargo {}", arguments.join(" ")))
}

/// Runs the tests that the arguments of `cargo test` select: shows their output, counts them and names those that fail.
pub(super) fn tests(state: &State, arguments: &[&str], variables: &[(&str, &OsStr)]) -> Result<Counts> {
    let required = state.required.for_tests(!variables.is_empty());
    let variables = [variables, &[(REQUIRE, OsStr::new(&required))]].concat();
    programs::run(arguments, &variables)
}

/// What the table says about the tests of a step.
pub(super) fn passed(state: &State, counts: Counts) -> Result<String> {
    let counts = counts.without_failures()?;
    let text = counts.to_string();
    state.counts.borrow_mut().add(counts);
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::bail;

    #[test]
    fn a_program_is_built_once() {
        let cell = OnceCell::new();
        assert!(build_once(&cell, || bail!("no")).is_err());
        assert_eq!(build_once(&cell, || Ok("a".into())).unwrap(), Path::new("a"));
        assert_eq!(build_once(&cell, || panic!("built again")).unwrap(), Path::new("a"));
    }
}
