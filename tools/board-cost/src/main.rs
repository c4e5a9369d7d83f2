//! Cost of each part of an image, from a trace of the virtual board (`virtual-board --trace-execution`). `cargo xtask bench board` runs it.
//!
//! Exit codes: 0 done, 2 wrong input.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use audit::graph::Calls;
use audit::stack;
use board_cost::flash::{Control, Prefetched};
use board_cost::instruction::Decoder;
use board_cost::program::Program;
use board_cost::replay::{Interrupts, Options, Replay};
use board_cost::trace;
use clap::Parser;
use serde_json::json;

/// Prints the cost of each part of an image as a JSON object: instructions, and modelled cycles of a Cortex-M4F
#[derive(Parser)]
#[command(version)]
struct Cli {
    /// The image, with debug information
    #[arg(long, value_name = "FILE")]
    elf: PathBuf,
    /// The trace, a file or a pipe
    #[arg(long, value_name = "FILE")]
    trace: PathBuf,
    /// Virtual milliseconds before the count begins
    #[arg(long, value_name = "N", default_value_t = 0)]
    from_ms: u64,
    /// Virtual milliseconds that are counted [default: to the end of the trace]
    #[arg(long, value_name = "N")]
    for_ms: Option<u64>,
    /// Value of FLASH_ACR, hexadecimal, for a program that does not set it: 0x705 is what the firmware sets
    #[arg(long, value_name = "HEX", value_parser = parse_control)]
    flash_acr: Option<Control>,
    /// A prefetched line of flash that is used goes into the cache: the manual can be read in both ways
    #[arg(long)]
    cache_prefetched: bool,
    /// Flash, RAM and the bound of the stack too
    #[arg(long)]
    image: bool,
    /// Instead of the firmware's parts, each call of these functions, by their symbols
    #[arg(long, value_name = "SYMBOL", num_args = 1..)]
    function: Vec<String>,
    /// Also the instructions of each call of these functions, in order
    #[arg(long, requires = "function")]
    calls: bool,
    /// Writes the instructions of the tick to a file: in a tick on average how often each ran, its cycles and its waits for flash, its text, and
    /// its places in the source
    #[arg(long, value_name = "FILE")]
    listing: Option<PathBuf>,
}

fn parse_control(text: &str) -> Result<Control, String> {
    let digits = text.strip_prefix("0x").and_then(|digits| u32::from_str_radix(digits, 16).ok());
    digits.map(Control::of).ok_or_else(|| format!("`{text}` is not a hexadecimal number, for example 0x705"))
}

fn run(cli: Cli) -> Result<()> {
    let elf = std::fs::read(&cli.elf).with_context(|| format!("reading {}", cli.elf.display()))?;
    let program = Program::parse(&elf).with_context(|| format!("in {}", cli.elf.display()))?;
    let prefetched = if cli.cache_prefetched { Prefetched::Cached } else { Prefetched::NotCached };
    let (from_ms, for_ms, flash) = (cli.from_ms, cli.for_ms, cli.flash_acr);
    let options =
        Options { from_ms, for_ms, flash, prefetched, functions: cli.function, listing: cli.listing.is_some() };
    let mut replay = Replay::new(&program, Interrupts::of_firmware(), options)?;
    let from = File::open(&cli.trace).with_context(|| format!("reading {}", cli.trace.display()))?;
    trace::read(from, |event| replay.take(event)).with_context(|| format!("in {}", cli.trace.display()))?;
    if let Some(file) = &cli.listing {
        std::fs::write(file, listing(&program, &replay)?).with_context(|| format!("writing {}", file.display()))?;
    }
    let image = &program.image;
    let cycles = replay.counted_cycles();
    let calls: Option<BTreeMap<String, Vec<u64>>> =
        cli.calls.then(|| replay.calls().map(|(name, calls)| (name.to_owned(), calls)).collect());
    let mut result = json!({ "compiler": image.compiler, "cycles": cycles, "rows": replay.finish()? });
    if let Some(calls) = calls {
        result["calls"] = json!(calls);
    }
    if cli.image {
        let bound = stack::bound(image, &Calls::of(image)?)?.total();
        result["image"] =
            json!({ "flash_bytes": image.flash, "static_ram_bytes": image.ram, "stack_bound_bytes": bound });
    }
    println!("{result}");
    Ok(())
}

/// The instructions of the tick as text.
fn listing(program: &Program<'_>, replay: &Replay<'_>) -> Result<String> {
    let (costs, ticks) = replay.listing();
    let decoder = Decoder::new()?;
    let mut text = String::new();
    let mut function = String::new();
    for (&address, cost) in costs {
        let a_tick = |count: u64| count as f64 / ticks.max(1) as f64;
        let inside = program.functions_at(address)?.pop().unwrap_or_default();
        if inside != function {
            function = inside;
            let _ = writeln!(text, "{function}");
        }
        let code = program.code(address, 4).or_else(|_| program.code(address, 2))?;
        let _ = writeln!(
            text,
            "{address:08x} {:7.2} {:7.2} {:7.2}  {:<40} {}",
            a_tick(cost.instructions),
            a_tick(cost.cycles),
            a_tick(cost.stalls),
            decoder.text(address, code)?,
            program.source_at(address)?.join(" < ")
        );
    }
    Ok(text)
}

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("board-cost: {error:#}");
            ExitCode::from(2)
        }
    }
}
