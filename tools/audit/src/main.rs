//! `audit`: what `cargo xtask` asks of an image and of the source.
//!
//! Exit codes: 0 what was asked for holds, 1 it does not, 2 the command line or a file is wrong.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use audit::graph::Calls;
use audit::image::Image;
use audit::ratchet::{Baseline, Measured};
use audit::run::Run;
use audit::{panics, paths, stack, unsafe_code};
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
        /// ELF files of images
        #[arg(required = true)]
        elf: Vec<PathBuf>,
    },
    /// Print a bound of the stack: the deepest calls of the thread, and one interrupt of each priority on top
    Stack {
        /// ELF file of the image
        elf: PathBuf,
    },
    /// Fail if an absolute path is in the loaded bytes
    Paths {
        /// ELF files of images
        #[arg(required = true)]
        elf: Vec<PathBuf>,
    },
    /// Fail if two images do not load the same bytes
    Same {
        /// ELF file of an image
        one: PathBuf,
        /// ELF file of the other
        other: PathBuf,
    },
    /// Compare what the image, a run of it and the source need with ratchets.toml
    Ratchet {
        /// ELF file of the image
        #[arg(long)]
        elf: PathBuf,
        /// The lines of `footfall watch --json` of a run
        #[arg(long)]
        run: PathBuf,
        /// Folder of the workspace, which has ratchets.toml
        #[arg(long, default_value = ".")]
        root: PathBuf,
    },
}

fn main() -> ExitCode {
    match perform(Cli::parse().task) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if error.downcast_ref::<std::io::Error>().is_some() { 2 } else { 1 })
        }
    }
}

fn read(elf: &Path) -> Result<Image> {
    let bytes = std::fs::read(elf).with_context(|| format!("reading {}", elf.display()))?;
    Image::parse(&bytes).with_context(|| format!("in {}", elf.display()))
}

/// Writes text to standard output. A reader that closes the pipe early is no failure.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error).context("writing the output"),
        _ => Ok(()),
    }
}

fn perform(task: Task) -> Result<()> {
    match task {
        Task::Panics { elf } => {
            for elf in elf {
                let image = read(&elf)?;
                let followed = panics::none_reachable(&image, &Calls::of(&image)?)
                    .with_context(|| format!("in {}", elf.display()))?;
                let roots = panics::ROOTS.len();
                let elf = elf.display();
                print(&format!("{elf}: no panic is reachable from {roots} roots, over {followed} functions\n"))?;
            }
        }
        Task::Stack { elf } => {
            let image = read(&elf)?;
            print(&stack::bound(&image, &Calls::of(&image)?)?.to_string())?;
        }
        Task::Paths { elf } => {
            let here = std::env::current_dir().context("reading the working directory")?;
            for elf in elf {
                let found = paths::absolute(&read(&elf)?, &here.to_string_lossy());
                ensure!(found.is_empty(), "{} has paths of this computer:\n  {}", elf.display(), found.join("\n  "));
                print(&format!("{}: no absolute path in the loaded bytes\n", elf.display()))?;
            }
        }
        Task::Same { one, other } => {
            let bytes = paths::same(&read(&one)?, &read(&other)?)?;
            print(&format!("the same {bytes} bytes\n"))?;
        }
        Task::Ratchet { elf, run, root } => ratchet(&elf, &run, &root)?,
    }
    Ok(())
}

/// All numbers of today, compared with the file.
fn ratchet(elf: &Path, run: &Path, root: &Path) -> Result<()> {
    let image = read(elf)?;
    let lines = std::fs::read_to_string(run).with_context(|| format!("reading {}", run.display()))?;
    let run = Run::parse(&lines).with_context(|| format!("in {}", run.display()))?;
    let stack = stack::bound(&image, &Calls::of(&image)?)?;
    let bound = u64::from(stack.total());
    let cost = run.cost;
    // A bound that a run exceeds is none.
    ensure!(
        cost.stack_used <= bound,
        "the run used {} bytes of stack, more than the bound of {bound}",
        cost.stack_used
    );
    ensure!(bound <= cost.stack_size, "the stack can be {bound} bytes deep, and has {}", cost.stack_size);
    let mut all = vec![
        Measured::compiled("tick-instructions", cost.longest_cycles),
        Measured::always("late-ticks", run.late_ticks),
        Measured::always("missed-ticks", run.missed_ticks),
        Measured::always("truncated-pulses", cost.truncated),
        Measured::compiled("stack-bound-bytes", bound),
        Measured::compiled("stack-after-start-bytes", stack.running.into()),
        Measured::compiled("stack-main-bytes", stack.main.into()),
        Measured::compiled("stack-used-bytes", cost.stack_used),
        Measured::compiled("flash-bytes", image.flash),
        Measured::compiled("static-ram-bytes", image.ram),
    ];
    for (name, count) in unsafe_code::by_crate(root)? {
        all.push(Measured::always(&format!("unsafe-{name}"), count));
    }
    let file = root.join("ratchets.toml");
    let text = std::fs::read_to_string(&file).with_context(|| format!("reading {}", file.display()))?;
    let before = Baseline::parse(&text)?;
    Baseline::control(&all, &image.compiler)?;
    print(&before.compare(&all, &image.compiler)?)?;
    if before.compiler != image.compiler {
        let (file, now) = (&before.compiler, &image.compiler);
        print(&format!("the file has numbers of {file}, the image is by {now}\n"))?;
    }
    Ok(())
}
