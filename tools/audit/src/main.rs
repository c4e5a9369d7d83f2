//! `audit`: what `cargo xtask` asks of an image and of the source.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use audit::graph::Calls;
use audit::image::Image;
use audit::{panics, stack};
use clap::{Parser, Subcommand};

/// Measures the flashed image and the source
#[derive(Parser)]
#[command(name = "audit", version)]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Fail if a panic is reachable from the tick or from a handler
    Panics {
        /// ELF file of the image
        elf: PathBuf,
    },
    /// Print a bound of the stack: the deepest calls of the thread, and one interrupt of each priority on top
    Stack {
        /// ELF file of the image
        elf: PathBuf,
    },
}

fn read(elf: &PathBuf) -> Result<Image> {
    let bytes = std::fs::read(elf).with_context(|| format!("reading {}", elf.display()))?;
    Image::parse(&bytes).with_context(|| format!("in {}", elf.display()))
}

fn main() -> ExitCode {
    match perform(Cli::parse().task) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn perform(task: Task) -> Result<()> {
    match task {
        Task::Panics { elf } => {
            let image = read(&elf)?;
            let calls = Calls::of(&image)?;
            let followed = panics::none_reachable(&image, &calls)?;
            println!("no panic is reachable from {} roots, over {followed} functions", panics::ROOTS.len());
        }
        Task::Stack { elf } => {
            let image = read(&elf)?;
            print!("{}", stack::bound(&image, &Calls::of(&image)?)?);
        }
    }
    Ok(())
}
