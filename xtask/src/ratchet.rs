//! `cargo xtask ratchet`: compares what the image, a run of it on the virtual board and the source need with `ratchets.toml`.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};

use crate::board::{Board, Variant};
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// Options of `cargo xtask ratchet`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Write ratchets.toml with the numbers of today
    #[arg(long, requires = "reason")]
    write: bool,
    /// Why the numbers changed; stands in the file
    #[arg(long, requires = "write", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    reason: Option<String>,
}

/// The run: arming, a walk of ten seconds, and a stop by the button.
const RUN: [&str; 5] = ["watch", "--json", "--secs", "12", "--disarm"];

/// Builds what is needed and compares, or writes the file.
pub(crate) fn ratchet(options: &Options) -> Result<ExitCode> {
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let image = workspace.firmware(Board::F4Discovery, Variant::USUAL)?;
    let virtual_board = workspace.virtual_board()?;
    let footfall = workspace.footfall()?;
    let reason = options.reason.as_deref().filter(|_| options.write);
    print!("{}", compare(&workspace, &image.elf, &virtual_board, &footfall, reason)?);
    Ok(ExitCode::SUCCESS)
}

/// The table of all numbers; with a reason they are written to the file first.
pub(crate) fn compare(
    workspace: &Workspace,
    elf: &Path,
    virtual_board: &Path,
    footfall: &Path,
    reason: Option<&str>,
) -> Result<String> {
    let audit = workspace.audit()?;
    let mut run = shell::command(footfall);
    run.args(RUN).arg("--elf").arg(elf).arg("--virtual-board").arg(virtual_board);
    let lines = shell::stdout_of(&mut run).context("running the image on the virtual board")?;
    let file = workspace.target_dir.join("ratchet-run.jsonl");
    std::fs::write(&file, lines).with_context(|| format!("writing {}", file.display()))?;
    let mut audit = shell::command(audit);
    audit.args(["ratchet", "--elf"]).arg(elf).arg("--run").arg(&file);
    if let Some(reason) = reason {
        audit.args(["--write", "--reason", reason]);
    }
    shell::stdout_of(&mut audit)
}
