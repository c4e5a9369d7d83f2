//! `cargo xtask book`: builds the book of all pages with the program `book`, which is compiled only then: mdBook has some 60 crates that no
//! other command needs.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;

use crate::folder::empty_folder;
use crate::shell;
use crate::workspace::Workspace;

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// The folder for the book, new or empty [default: book below cargo's target folder, which is emptied]
    #[arg(short, long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Show it in the browser
    #[arg(long)]
    open: bool,
}

/// Builds the book, prints where it begins, and shows it.
pub(crate) fn book(options: &Options) -> Result<ExitCode> {
    let workspace = Workspace::open()?;
    let out = match &options.out {
        Some(folder) => empty_folder(workspace.started_in.join(folder))?,
        None => workspace.target_dir.join("book"),
    };
    program(&out, if options.open { &["--open"] } else { &[] })?;
    println!("{}", out.join("index.html").display());
    Ok(ExitCode::SUCCESS)
}

/// Builds the book of this workspace in a folder, whose old content goes.
pub(crate) fn build(out: &Path) -> Result<()> {
    program(out, &[])
}

/// The profile of the tests: its crates are compiled once for both.
fn program(out: &Path, options: &[&str]) -> Result<()> {
    eprintln!("build: book");
    let mut cargo = shell::cargo();
    cargo.args(["run", "--package", "book", "--", "."]).arg(out).args(options);
    shell::must_succeed(&mut cargo, "the book")
}
