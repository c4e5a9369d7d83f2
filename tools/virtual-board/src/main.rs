//! Runs the very ELF that would be flashed on a modelled STM32F407: Unicorn executes, `stm32f4-model` is the rest of the chip.
//!
//! It ends with status 0 when the time is over or someone asked it to end and nothing was wrong; 1 when an access was not modelled, not
//! clocked or not allowed, the core locked up, slept for ever or took a fault that was not injected; 2 when it could not start.
//! A self-test's own status comes before these.
//!
//! Not cycle-accurate, and no evidence about hardware: an instruction costs a constant number of cycles, and no electrical behaviour,
//! wait states, bus contention or errata are modelled.
#![forbid(unsafe_code)]

mod board;
mod console;
mod cpu;
mod exception;
mod fault;
mod inject;
mod loader;
mod nvic;
mod plant;
mod pulses;
mod recorder;
mod report;
mod rtt;
mod run;
mod scs;
mod semihosting;
mod systick;
mod unicorn;

use std::collections::BTreeMap;
use std::io::{BufWriter, stdout};
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context as _, Result, ensure};
use clap::{Parser, ValueEnum};
use stm32f4_model::{Pin, SocConfig};

use crate::console::Console;
use crate::exception::Broken;
use crate::inject::{Injection, Kind, PANIC_FUNCTIONS, SymbolAt};
use crate::loader::Image;
use crate::plant::{BUTTON, BoardPlant, Levels, Press, Volts};
use crate::recorder::Recorder;
use crate::report::Report;
use crate::run::{Options, Run};

/// Runs an ELF for the STM32F407 without the chip. Reports JSON lines on standard output; standard input takes press, release, quit.
#[derive(Debug, Parser)]
#[command(version)]
struct Cli {
    /// The ELF file that would be flashed
    elf: PathBuf,
    /// Write a file's bytes into flash that the program leaves erased, as in 0x08004000=walker.bin
    #[arg(long, value_name = "ADDRESS=FILE", value_parser = download)]
    flash: Vec<Download>,
    /// Virtual seconds to run; otherwise until quit or a signal
    #[arg(long, value_parser = positive)]
    secs: Option<f64>,
    /// Volts over time at ADC pins, and of the analogue supply: CSV with the header time_s,PA1,... or time_s,PA1,VDDA,...
    #[arg(long, value_name = "FILE")]
    volts: Option<PathBuf>,
    /// Repeat the volts instead of holding the last row
    #[arg(long = "loop", requires = "volts")]
    repeat: bool,
    /// Press the user button at these times, s; T:HOLD sets how long, otherwise 0.1 s
    #[arg(long, value_name = "T[:HOLD]", num_args = 1.., value_parser = press)]
    press: Vec<Press>,
    /// Hold an input pin at a level, as in PB12=1
    #[arg(long, value_name = "PIN=0|1", value_parser = level)]
    level: Vec<(Pin, bool)>,
    /// Drive an input pin, as in PC6=edges.csv: CSV with the header time_s,level, an edge a row; low before the first
    #[arg(long, value_name = "PIN=FILE", value_parser = edge_file)]
    edges: Vec<(Pin, PathBuf)>,
    /// Make a function hang from a time on
    #[arg(long, value_name = "SYMBOL@T")]
    hang: Vec<SymbolAt>,
    /// Make a function fault from a time on
    #[arg(long, value_name = "SYMBOL@T")]
    fault: Vec<SymbolAt>,
    /// Make the program panic at a time, s
    #[arg(long, value_name = "T", value_parser = time)]
    panic: Vec<f64>,
    /// Stop the crystal at a time, s
    #[arg(long, value_name = "T", value_parser = time)]
    hse_fail: Vec<f64>,
    /// Make ADC1 lose a result to an overrun at these times, s
    #[arg(long, value_name = "T", value_parser = time)]
    adc_overrun: Vec<f64>,
    /// Make a transfer of stream 0 of DMA2 fail at these times, s
    #[arg(long, value_name = "T", value_parser = time)]
    dma_error: Vec<f64>,
    /// The crystal never starts
    #[arg(long)]
    hse_dead: bool,
    /// Frequency of the low speed oscillator, which clocks the watchdog, Hz
    #[arg(long, default_value_t = 32_000.0, value_parser = positive)]
    lsi_hz: f64,
    /// Analogue supply and ADC reference, V, unless the volts have a column VDDA [default: 3]
    #[arg(long, value_parser = positive)]
    vdda: Option<f64>,
    /// RTT mode that the attached debugger sets: 0 skip, 1 trim, 2 wait
    #[arg(long, value_parser = clap::value_parser!(u32).range(0..=2))]
    rtt_mode: Option<u32>,
    /// The attached debugger reads nothing from RTT
    #[arg(long)]
    no_drain: bool,
    /// Cycles that an instruction costs, 0.1 to 100
    #[arg(long, default_value_t = 1.0, value_parser = cpi)]
    cpi: f64,
    /// Hold real time
    #[arg(long)]
    pace: bool,
    /// Write every ADC result that the program was given to a CSV file
    #[arg(long, value_name = "FILE")]
    record_conversions: Option<PathBuf>,
    /// Write a pin's edges to a CSV file with the header time_s,level, as in PB5=sync.csv
    #[arg(long, value_name = "PIN=FILE", value_parser = edge_file)]
    record_edges: Vec<(Pin, PathBuf)>,
    /// End at the first access that is not modelled, clocked or allowed
    #[arg(long)]
    stop_on_lint: bool,
    /// Answer semihosting, and exit with the program's own status, 1 to 255, unless that is 0
    #[arg(long, value_name = "HOW")]
    self_test_exit: Option<SelfTestExit>,
    /// Leave out a part of the exception model, to show that a self-test notices
    #[arg(long = "break", value_name = "PART")]
    broken: Vec<Break>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SelfTestExit {
    Semihosting,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Break {
    /// No floating-point registers in exception frames
    NoFpuFrame,
    /// The exclusive monitor survives exceptions
    NoClrex,
    /// The emulator's cached mode flags are not refreshed at an exception
    StaleFlags,
}

/// Bytes for flash beside the program.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Download {
    addr: u32,
    file: PathBuf,
}

fn download(text: &str) -> Result<Download, String> {
    let wanted = || format!("`{text}` is not ADDRESS=FILE, as in 0x08004000=walker.bin");
    let (addr, file) = text.split_once('=').ok_or_else(wanted)?;
    let digits = addr.strip_prefix("0x").ok_or_else(wanted)?;
    Ok(Download { addr: u32::from_str_radix(digits, 16).map_err(|_| wanted())?, file: file.into() })
}

fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| format!("`{text}` is no finite number"))
}

fn time(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| if value >= 0.0 { Ok(value) } else { Err("must be 0 or later".into()) })
}

fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| if value > 0.0 { Ok(value) } else { Err("must be greater than 0".into()) })
}

fn cpi(text: &str) -> Result<f64, String> {
    number(text)
        .and_then(|value| if (0.1..=100.0).contains(&value) { Ok(value) } else { Err("must be 0.1 to 100".into()) })
}

fn press(text: &str) -> Result<Press, String> {
    let (at, hold) = text.split_once(':').unwrap_or((text, "0.1"));
    Ok(Press { at: time(at)?, hold: positive(hold)? })
}

fn level(text: &str) -> Result<(Pin, bool), String> {
    let wanted = || format!("`{text}` is not PIN=0 or PIN=1, as in PB12=1");
    let (pin, level) = text.split_once('=').ok_or_else(wanted)?;
    let pin: Pin = pin.parse().map_err(|error| format!("{error}"))?;
    match level {
        "0" => Ok((pin, false)),
        "1" => Ok((pin, true)),
        _ => Err(wanted()),
    }
}

fn edge_file(text: &str) -> Result<(Pin, PathBuf), String> {
    let wanted = || format!("`{text}` is not PIN=FILE, as in PB5=sync.csv");
    let (pin, file) = text.split_once('=').filter(|(_, file)| !file.is_empty()).ok_or_else(wanted)?;
    Ok((pin.parse().map_err(|error| format!("{error}"))?, file.into()))
}

fn injections(cli: &Cli, image: &Image) -> Result<Vec<Injection>> {
    let mut all = Vec::new();
    for SymbolAt { symbol, at } in &cli.hang {
        all.push(Injection::new(Kind::Hang(image.function(symbol)?), symbol.clone(), *at));
    }
    for SymbolAt { symbol, at } in &cli.fault {
        all.push(Injection::new(Kind::Fault(image.function(symbol)?), symbol.clone(), *at));
    }
    if !cli.panic.is_empty() {
        let names = PANIC_FUNCTIONS.map(|(name, _)| name);
        let (name, address) =
            image.first_function(&names).with_context(|| format!("the ELF has none of {}", names.join(", ")))?;
        let arguments = PANIC_FUNCTIONS.iter().find(|(known, _)| *known == name).map(|(_, arguments)| *arguments);
        let arguments = arguments.context("a panic function without known arguments")?;
        all.extend(cli.panic.iter().map(|&at| Injection::new(Kind::Panic(address, arguments), name.into(), at)));
    }
    all.extend(cli.hse_fail.iter().map(|&at| Injection::new(Kind::Crystal, "HSE".into(), at)));
    all.extend(cli.adc_overrun.iter().map(|&at| Injection::new(Kind::Overrun, "ADC1".into(), at)));
    all.extend(cli.dma_error.iter().map(|&at| Injection::new(Kind::Transfer, "DMA2 stream 0".into(), at)));
    Ok(all)
}

fn run(cli: &Cli) -> Result<u8> {
    let mut image = Image::read(&cli.elf)?;
    for Download { addr, file } in &cli.flash {
        let bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        image.download(*addr, &bytes).with_context(|| format!("cannot write {} to flash", file.display()))?;
    }
    let volts = match &cli.volts {
        Some(path) => Volts::read(path, cli.repeat)?,
        None => Volts::default(),
    };
    ensure!(
        cli.vdda.is_none() || !volts.has_vdda(),
        "--vdda and a column VDDA of the volts both say what the supply is"
    );
    let mut lines = BTreeMap::new();
    for &(pin, level) in &cli.level {
        ensure!(lines.insert(pin, Levels::fixed(level)).is_none(), "--level names {pin} twice");
    }
    for (pin, file) in &cli.edges {
        ensure!(lines.insert(*pin, Levels::read(file)?).is_none(), "--edges and --level name {pin} twice");
    }
    ensure!(!lines.contains_key(&BUTTON), "{BUTTON} is the user button; allowed is --press");
    let recorder = Recorder::create(cli.record_conversions.as_deref(), &cli.record_edges)?;
    let default = SocConfig::default();
    let vdda = cli.vdda.unwrap_or(default.vdda);
    let config = SocConfig { lsi_hz: cli.lsi_hz, vdda, hse_ready: !cli.hse_dead, ..default };
    let options = Options {
        secs: cli.secs,
        cpi: cli.cpi,
        pace: cli.pace,
        stop_on_lint: cli.stop_on_lint,
        semihosting: cli.self_test_exit.is_some(),
        rtt_mode: cli.rtt_mode,
        drain: !cli.no_drain,
        broken: Broken {
            no_fpu_frame: cli.broken.contains(&Break::NoFpuFrame),
            no_clrex: cli.broken.contains(&Break::NoClrex),
        },
        stale_flags: cli.broken.contains(&Break::StaleFlags),
    };
    let injections = injections(cli, &image)?;
    let mut plant = BoardPlant::new(volts, cli.press.clone(), lines);
    plant.pulses.watch(cli.record_edges.iter().map(|(pin, _)| *pin));
    let report = Report::new(BufWriter::new(stdout()));
    Run::new(&image, config, plant, injections, recorder, Console::open()?, report, options)?.run()
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(&cli) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            eprintln!("virtual-board: {error:#}");
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    fn parse(arguments: &[&str]) -> Result<Cli, String> {
        Cli::try_parse_from([&["virtual-board"], arguments].concat()).map_err(|error| error.to_string())
    }

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
        let cli =
            parse(&["fw.elf", "--secs", "2", "--press", "0.5", "1:0.2", "--hang", "a::b@1", "--break", "no-clrex"])
                .unwrap();
        assert_eq!(cli.press, [Press { at: 0.5, hold: 0.1 }, Press { at: 1.0, hold: 0.2 }]);
        assert_eq!((cli.secs, cli.cpi, cli.lsi_hz), (Some(2.0), 1.0, 32_000.0));
        assert_eq!(cli.broken, [Break::NoClrex]);
    }

    #[test]
    fn bad_values_are_refused_by_name() {
        for (arguments, words) in [
            (&["fw.elf", "--secs", "0"][..], "greater than 0"),
            (&["fw.elf", "--secs", "nan"], "no finite number"),
            (&["fw.elf", "--cpi", "0"], "0.1 to 100"),
            (&["fw.elf", "--press", "x"], "`x` is no finite number"),
            (&["fw.elf", "--press", "1:0"], "greater than 0"),
            (&["fw.elf", "--level", "PB12"], "PB12=1"),
            (&["fw.elf", "--level", "PB12=2"], "PB12=1"),
            (&["fw.elf", "--level", "PX1=1"], "names no pin"),
            (&["fw.elf", "--edges", "PC6"], "PIN=FILE"),
            (&["fw.elf", "--edges", "PX1=a.csv"], "names no pin"),
            (&["fw.elf", "--hang", "tick"], "SYMBOL@SECONDS"),
            (&["fw.elf", "--flash", "4000=x"], "ADDRESS=FILE"),
            (&["fw.elf", "--flash", "0x4000"], "ADDRESS=FILE"),
            (&["fw.elf", "--vdda", "0"], "greater than 0"),
            (&["fw.elf", "--record-edges", "PB5"], "PIN=FILE"),
            (&["fw.elf", "--record-edges", "P5=a.csv"], "names no pin"),
            (&["fw.elf", "--rtt-mode", "3"], "3"),
            (&["fw.elf", "--loop"], "--volts"),
            (&[], "ELF"),
        ] {
            let message = parse(arguments).unwrap_err();
            assert!(message.contains(words), "{arguments:?}: {message}");
        }
    }
}
