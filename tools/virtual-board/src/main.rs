//! Virtual board: runs the firmware ELF on a modelled STM32F407 or STM32F411. Unicorn executes the code, `stm32f4-model` models the peripherals.
//!
//! Exit status: 0 after the given time, `quit` or a signal, without error; 1 if an access was not modelled, not clocked or not allowed, or
//! the core locked up, slept without a wake-up source or took a fault that was not injected, or a servo got a pulse that it may not get; 2 if the
//! run could not start. A self-test's own status has priority.
//!
//! Not cycle-accurate, and no evidence about hardware: an instruction costs a constant number of cycles, and no electrical behaviour,
//! wait states, bus contention or errata are modelled.
#![forbid(unsafe_code)]

mod addresses;
mod board;
mod campaign;
mod console;
mod cpu;
mod exception;
mod execution_trace;
mod fault;
mod feed;
mod inject;
mod judge;
mod loader;
mod lockstep;
mod modelled_board;
mod nvic;
mod pin_name;
mod plant;
mod probe;
mod pulses;
mod random;
mod recorder;
mod report;
mod rtt;
mod rtt_server;
mod run;
mod script;
mod scs;
mod semihosting;
mod serial;
mod servo_pulse;
mod servos;
mod systick;
mod tables;
mod unicorn;
mod waveform;

use std::collections::BTreeMap;
use std::io::{BufWriter, stdout};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context as _, Result, ensure};
use clap::{Parser, ValueEnum};
use servo_model::Kind;
use stm32f4_model::{BrownOutThreshold, Pin, SocConfig};

use crate::campaign::{Campaign, Several};
use crate::console::Console;
use crate::inject::{FrequencyAt, Injection, InjectionKind, RegisterAt, SymbolAt};
use crate::judge::Joint;
use crate::loader::ProgramImage;
use crate::lockstep::Requests;
use crate::modelled_board::ModelledBoard;
use crate::plant::{BoardPlant, ButtonPress, EMERGENCY_STOP, Wire};
use crate::recorder::SignalRecorder;
use crate::report::ReportWriter;
use crate::run::{BoardRun, FlashDownload, Plan, RunOptions};
use crate::script::{HIGHEST_LSI_HZ, Script};
use crate::serial::SerialPort;
use crate::servos::Servos;
use crate::tables::{LevelTable, VoltageTable};

/// Runs an ELF for the STM32F407 or the STM32F411 on a modelled chip. Writes JSON lines to standard output; reads press, release, hold, stop, reset, power,
/// wire, inject, quit from standard input.
#[derive(Debug, Parser)]
#[command(version)]
struct Cli {
    /// ELF file of the firmware
    #[arg(required_unless_present = "erased")]
    elf: Option<PathBuf>,
    /// The board is a debug probe with its target: probe-rs connects to this address, with `--probe 0:0:ADDRESS --protocol swd`. Port 0 takes a free
    /// one, which a line of the output names. While a client is connected, time passes no faster than real time
    #[arg(long, value_name = "ADDRESS:PORT", conflicts_with_all = ["campaign", "lockstep", "rtt_server", "self_test_exit"])]
    probe: Option<SocketAddr>,
    /// The flash is erased and holds no program, as in a new chip
    #[arg(long, requires = "probe", conflicts_with = "elf")]
    erased: bool,
    /// The board, for an ELF file that does not name it [default: f4-discovery]. A firmware image names its board, and runs on no other
    #[arg(long, value_name = "BOARD")]
    board: Option<ModelledBoard>,
    /// Write the bytes of a file to erased flash, for example 0x08004000=generator.bin
    #[arg(long, value_name = "ADDRESS=FILE", value_parser = parse_download)]
    flash: Vec<FlashDownload>,
    /// Virtual seconds to run; by default until quit or a signal
    #[arg(long, value_parser = parse_positive)]
    secs: Option<f64>,
    /// Voltages over time at ADC pins, V, and of the analogue supply: CSV with the header time_s,PA1,... or time_s,PA1,VDDA,...
    #[arg(long, value_name = "FILE")]
    volts: Option<PathBuf>,
    /// Repeat the voltages instead of holding the last row
    #[arg(long = "loop", requires = "volts")]
    repeat: bool,
    /// Press the user button at these times, s, for HOLD seconds [default: 0.5, a hold whose release arms]
    #[arg(long, value_name = "T[:HOLD]", num_args = 1.., value_parser = parse_press)]
    press: Vec<ButtonPress>,
    /// Press the emergency stop, whose line is high while it is released, at these times, s, for HOLD seconds [default: 0.1]. The board arms only
    /// after it was pressed and released once since the boot
    #[arg(long, value_name = "T[:HOLD]", num_args = 1.., value_parser = parse_stop)]
    emergency_stop: Vec<ButtonPress>,
    /// Set an input pin to a constant level, for example PB12=0: an emergency stop with a cut cable
    #[arg(long, value_name = "PIN=0|1", value_parser = parse_level)]
    level: Vec<(Pin, bool)>,
    /// Drive an input pin, for example PC6=edges.csv: CSV with the header time_s,level, one edge per row; low before the first
    #[arg(long, value_name = "PIN=FILE", value_parser = parse_edge_file)]
    edges: Vec<(Pin, PathBuf)>,
    /// A jumper wire from a pin that the chip drives to an input, digital or of the converter, for example PE9=PC6. The command `wire` on standard input
    /// moves it
    #[arg(long, value_name = "PIN=PIN", conflicts_with = "campaign")]
    wire: Vec<Wire>,
    /// Make a function hang from a time on, s
    #[arg(long, value_name = "SYMBOL@T")]
    hang: Vec<SymbolAt>,
    /// Make a function fault from a time on, s
    #[arg(long, value_name = "SYMBOL@T")]
    fault: Vec<SymbolAt>,
    /// Make the program panic at a time, s
    #[arg(long, value_name = "T", value_parser = parse_time)]
    panic: Vec<f64>,
    /// Stop the crystal at a time, s
    #[arg(long, value_name = "T", value_parser = parse_time)]
    hse_fail: Vec<f64>,
    /// Make ADC1 lose a result in an overrun at these times, s
    #[arg(long, value_name = "T", value_parser = parse_time)]
    adc_overrun: Vec<f64>,
    /// Make a transfer of DMA2 stream 0 fail at these times, s
    #[arg(long, value_name = "T", value_parser = parse_time)]
    dma_error: Vec<f64>,
    /// Stop TIM2, which triggers the conversions, at these times, s
    #[arg(long, value_name = "T", value_parser = parse_time)]
    trigger_stop: Vec<f64>,
    /// A debugger is attached from power-on: it reads the log, and the program runs on
    #[arg(long)]
    debugger: bool,
    /// A debugger halts the core at a time, s: it executes nothing until a reset, while timers and watchdog go on
    #[arg(long, value_name = "T", value_parser = parse_time)]
    halt: Vec<f64>,
    /// Give the low speed oscillator another frequency at a time, Hz and s, for example 60000@2.5; 0 stops it
    #[arg(long, value_name = "HZ@T")]
    lsi: Vec<FrequencyAt>,
    /// Write a word to a register at a time, s, for example 0x40010020=0@3
    #[arg(long, value_name = "ADDRESS=VALUE@T")]
    register: Vec<RegisterAt>,
    /// Events of a script of faults: a TOML file, docs/virtual-board.md
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// At the end, write the sector of the flash at an address to a file, for example 0x08004000=sector.bin; --flash puts it in again
    #[arg(long, value_name = "ADDRESS=FILE", value_parser = parse_download)]
    save_flash: Vec<FlashDownload>,
    /// The option bytes have the brown-out reset off, as in a chip as delivered
    #[arg(long)]
    no_brown_out_reset: bool,
    /// Level of the brown-out reset in the option bytes [default: that of the board, f4-discovery 2, black-pill-f411 3]
    #[arg(long, value_name = "LEVEL", value_parser = clap::value_parser!(u8).range(1..=3), conflicts_with = "no_brown_out_reset")]
    brown_out_level: Option<u8>,
    /// The crystal does not start
    #[arg(long, conflicts_with = "hse_hz")]
    hse_dead: bool,
    /// Frequency of the crystal, Hz, for one that is not the board's [default: 8000000, black-pill-f411 25000000]
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(1_000_000..=50_000_000))]
    hse_hz: Option<u32>,
    /// Run a campaign of faults: a TOML file; each fault in each state at each phase is a line of the output
    #[arg(long, value_name = "FILE", requires = "run", conflicts_with_all = ["secs", "serial", "pace", "press", "emergency_stop", "script", "save_flash", "record_conversions", "record_edges"])]
    campaign: Option<PathBuf>,
    /// The run of the campaign: its name in the file
    #[arg(long, value_name = "NAME", requires = "campaign")]
    run: Option<String>,
    /// Only faults and sequences of the campaign whose name contains TEXT
    #[arg(long, value_name = "TEXT", requires = "campaign", conflicts_with = "several")]
    only: Option<String>,
    /// Instead of single faults N cases of 2 to 4 faults each, drawn at random. A case is drawn from its seed, in a state of any run; those of
    /// another run are left out
    #[arg(long, value_name = "N", requires = "campaign")]
    several: Option<u64>,
    /// Seed of the first of them; the next case has the next seed
    #[arg(long, value_name = "SEED", requires = "several", default_value_t = 1)]
    seed: u64,
    /// Cases of the campaign at a time [default: the processor's cores, and one more]
    #[arg(long, value_name = "N", requires = "campaign")]
    jobs: Option<std::num::NonZero<usize>>,
    /// One case of N of the campaign
    #[arg(long, value_name = "N", requires = "campaign", default_value = "1")]
    every: std::num::NonZero<usize>,
    /// A case with a reset goes on until the board has said why it booted; its line has that log, and what the file allows it to give
    #[arg(long, requires = "campaign", conflicts_with = "several")]
    boot_log: bool,
    /// Frequency of the low speed oscillator at power-on, which clocks the watchdog, Hz; 0: it does not oscillate
    #[arg(long, default_value_t = 32_000.0, value_parser = parse_lsi)]
    lsi_hz: f64,
    /// Supply of the chip, V [default: 3, black-pill-f411 3.3]
    #[arg(long, value_parser = parse_positive)]
    vdd: Option<f64>,
    /// Where the thresholds of the brown-out reset lie in the spread that the data sheet allows
    #[arg(long, value_name = "WHERE", default_value = "typical")]
    brown_out_threshold: Threshold,
    /// Analogue supply and ADC reference, V, unless the voltages have a column VDDA [default: as --vdd]
    #[arg(long, value_parser = parse_positive)]
    vdda: Option<f64>,
    /// RTT mode that the attached debugger sets when the buffer is full: 0 skip, 1 trim, 2 wait
    #[arg(long, value_parser = clap::value_parser!(u32).range(0..=2))]
    rtt_mode: Option<u32>,
    /// The attached debugger reads nothing from RTT
    #[arg(long)]
    no_drain: bool,
    /// Milliseconds from one read of RTT to the next: 100 are those of a debugger that looks ten times a second
    #[arg(long, value_name = "MS", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    rtt_every: u64,
    /// Serve RTT channel 1 at an address, as a debug probe's program does; port 0 is any free one, and a line of the output names it
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "campaign")]
    rtt_server: Option<std::net::SocketAddr>,
    /// Cycles per instruction, 0.1 to 100
    #[arg(long, default_value_t = 1.0, value_parser = parse_cpi)]
    cpi: f64,
    /// A program steps the board: it reads requests on standard input, one JSON object a line, and answers each; docs/virtual-board.md
    #[arg(long, conflicts_with_all = ["secs", "volts", "pace", "campaign", "self_test_exit"])]
    lockstep: bool,
    /// Make a pseudo-terminal that is the host's end of the serial port USART2; its name is in a line of the output
    #[arg(long)]
    serial: bool,
    /// Run no faster than real time
    #[arg(long)]
    pace: bool,
    /// Write every ADC result to a CSV file
    #[arg(long, value_name = "FILE")]
    record_conversions: Option<PathBuf>,
    /// Write the edges of a pin to a CSV file with the header time_s,level, for example PB5=sync.csv
    #[arg(long, value_name = "PIN=FILE", value_parser = parse_edge_file)]
    record_edges: Vec<(Pin, PathBuf)>,
    /// Write what the core executes to a file, block by block, for tools/board-cost: some 5 MB a virtual second
    #[arg(long, value_name = "FILE", conflicts_with = "campaign")]
    trace_execution: Option<PathBuf>,
    /// Model servos of this kind at the servo pins, and write the angles of the joints each 20 ms
    #[arg(long, value_name = "KIND", conflicts_with = "campaign")]
    servo: Option<ServoKind>,
    /// Angles at which the joints stand at the start, degrees: left hip, right hip, left knee, right knee [default: 0,0,0,0]
    #[arg(long, value_name = "DEG,DEG,DEG,DEG", requires = "servo", allow_hyphen_values = true, value_parser = parse_pose)]
    servo_at: Option<Pose>,
    /// End at the first access that is not modelled, not clocked or not allowed
    #[arg(long)]
    stop_on_lint: bool,
    /// The run is meant to give pulses that no servo may get, for this reason: it fails if it gives none. Without this option it fails if it
    /// gives one
    #[arg(long, value_name = "REASON", conflicts_with = "campaign", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    violates: Option<String>,
    /// Serve semihosting calls, and exit with the program's own status, 1 to 255, unless that is 0
    #[arg(long, value_name = "HOW")]
    self_test_exit: Option<SelfTestExit>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SelfTestExit {
    Semihosting,
}

/// See [`BrownOutThreshold`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Threshold {
    /// The lowest ones: level 3 falling 2.75 V, rising 2.85 V
    Min,
    /// Typical ones: level 3 falling 2.83 V, rising 2.92 V
    Typical,
    /// The highest ones: level 3 falling 2.88 V, rising 2.97 V
    Max,
}

impl From<Threshold> for BrownOutThreshold {
    fn from(threshold: Threshold) -> Self {
        match threshold {
            Threshold::Min => BrownOutThreshold::Min,
            Threshold::Typical => BrownOutThreshold::Typical,
            Threshold::Max => BrownOutThreshold::Max,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ServoKind {
    /// Hitec HS-311: each pulse drives it for a servo frame at most
    Analogue,
    /// FEETECH FT-7235: it keeps the angle of the last pulse
    Digital,
}

/// Angles of the four joints, degrees.
type Pose = [f64; 4];

fn parse_download(text: &str) -> Result<FlashDownload, String> {
    let expected =
        || format!("`{text}` is not ADDRESS=FILE with a hexadecimal address, for example 0x08004000=generator.bin");
    let (addr, file) = text.split_once('=').ok_or_else(expected)?;
    let digits = addr.strip_prefix("0x").ok_or_else(expected)?;
    Ok(FlashDownload { addr: u32::from_str_radix(digits, 16).map_err(|_| expected())?, file: file.into() })
}

fn parse_number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| format!("`{text}` is not a finite number"))
}

fn parse_time(text: &str) -> Result<f64, String> {
    parse_number(text).and_then(|value| {
        if value >= 0.0 { Ok(value) } else { Err(format!("{value} is negative; allowed is 0 or more")) }
    })
}

fn parse_positive(text: &str) -> Result<f64, String> {
    parse_number(text).and_then(|value| {
        if value > 0.0 { Ok(value) } else { Err(format!("{value} is not allowed; must be greater than 0")) }
    })
}

fn parse_lsi(text: &str) -> Result<f64, String> {
    parse_number(text).and_then(|hz| {
        if (0.0..=HIGHEST_LSI_HZ).contains(&hz) {
            Ok(hz)
        } else {
            Err(format!("{hz} Hz is not allowed; must be 0 to {HIGHEST_LSI_HZ}"))
        }
    })
}

fn parse_cpi(text: &str) -> Result<f64, String> {
    parse_number(text).and_then(|value| {
        if (0.1..=100.0).contains(&value) {
            Ok(value)
        } else {
            Err(format!("{value} is not allowed; must be 0.1 to 100"))
        }
    })
}

fn parse_press(text: &str) -> Result<ButtonPress, String> {
    match text.split_once(':') {
        Some((at, hold)) => Ok(ButtonPress { at: parse_time(at)?, hold: parse_positive(hold)? }),
        None => parse_time(text).map(ButtonPress::deliberate),
    }
}

fn parse_stop(text: &str) -> Result<ButtonPress, String> {
    match text.split_once(':') {
        Some(_) => parse_press(text),
        None => parse_time(text).map(ButtonPress::short),
    }
}

fn parse_pose(text: &str) -> Result<Pose, String> {
    let expected = || format!("`{text}` is not four angles in degrees, -180 to 180, for example 0,0,5,5");
    let angles: Vec<f64> = text.split(',').map(parse_number).collect::<Result<_, _>>().map_err(|_| expected())?;
    let pose: Pose = angles.try_into().map_err(|_| expected())?;
    if pose.iter().all(|angle| angle.abs() <= 180.0) { Ok(pose) } else { Err(expected()) }
}

fn parse_level(text: &str) -> Result<(Pin, bool), String> {
    let expected = || format!("`{text}` is not PIN=0 or PIN=1, for example PB12=1");
    let (pin, level) = text.split_once('=').ok_or_else(expected)?;
    let pin: Pin = pin.parse().map_err(|error| format!("{error}"))?;
    match level {
        "0" => Ok((pin, false)),
        "1" => Ok((pin, true)),
        _ => Err(expected()),
    }
}

fn parse_edge_file(text: &str) -> Result<(Pin, PathBuf), String> {
    let expected = || format!("`{text}` is not PIN=FILE, for example PB5=sync.csv");
    let (pin, file) = text.split_once('=').filter(|(_, file)| !file.is_empty()).ok_or_else(expected)?;
    Ok((pin.parse().map_err(|error| format!("{error}"))?, file.into()))
}

fn collect_injections(cli: &Cli, image: &ProgramImage) -> Result<Vec<Injection>> {
    let mut all = Vec::new();
    let mut add = |option: &'static str, kind: InjectionKind, symbol: &str, at: f64| {
        all.push(Injection::new(kind, symbol.into(), at).of_option(option));
    };
    for SymbolAt { symbol, at } in &cli.hang {
        add("--hang", InjectionKind::Hang(image.find_function(symbol)?), symbol, *at);
    }
    for SymbolAt { symbol, at } in &cli.fault {
        add("--fault", InjectionKind::Fault(image.find_function(symbol)?), symbol, *at);
    }
    for &at in &cli.panic {
        let (name, kind) = inject::panic_in(image).context("--panic")?;
        add("--panic", kind, name, at);
    }
    for (option, kind, symbol, times) in [
        ("--hse-fail", InjectionKind::Crystal, "HSE", &cli.hse_fail),
        ("--adc-overrun", InjectionKind::Overrun, "ADC1", &cli.adc_overrun),
        ("--dma-error", InjectionKind::Transfer, "DMA2 stream 0", &cli.dma_error),
        ("--trigger-stop", InjectionKind::Trigger, "TIM2", &cli.trigger_stop),
        ("--halt", InjectionKind::Halt, "core", &cli.halt),
    ] {
        times.iter().for_each(|&at| add(option, kind.clone(), symbol, at));
    }
    for &FrequencyAt { hz, at } in &cli.lsi {
        add("--lsi", InjectionKind::LowSpeedClock(hz), "LSI", at);
    }
    for &RegisterAt { address, value, at } in &cli.register {
        add("--register", InjectionKind::Register { address, value }, &format!("{address:#010x}"), at);
    }
    Ok(all)
}

/// Says which presses the run does not reach.
fn late_presses(cli: &Cli) -> Vec<String> {
    let Some(secs) = cli.secs else { return Vec::new() };
    [("--press", &cli.press), ("--emergency-stop", &cli.emergency_stop)]
        .into_iter()
        .flat_map(|(option, presses)| presses.iter().map(move |press| (option, press.at)))
        .filter(|(_, at)| *at >= secs)
        .map(|(option, at)| format!("{option}: the press at {at} s does not come: the run ends at {secs} s"))
        .collect()
}

fn run(cli: &Cli) -> Result<u8> {
    for late in late_presses(cli) {
        eprintln!("virtual-board: {late}");
    }
    let mut image = match &cli.elf {
        Some(elf) => ProgramImage::read(elf, cli.board)?,
        None => ProgramImage::erased(cli.board.unwrap_or_default()),
    };
    let wiring = image.board.wiring();
    for FlashDownload { addr, file } in &cli.flash {
        let bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        image.add_download(*addr, &bytes).with_context(|| format!("cannot write {} to flash", file.display()))?;
    }
    let volts = match &cli.volts {
        Some(path) => VoltageTable::read(path, cli.repeat)?,
        None => VoltageTable::default(),
    };
    ensure!(
        cli.vdda.is_none() || !volts.has_vdda(),
        "both --vdda and a column VDDA of --volts set the supply; remove one of them"
    );
    let mut lines = BTreeMap::new();
    for &(pin, level) in &cli.level {
        InjectionKind::Level(pin, level).check_pin(&wiring).context("--level")?;
        ensure!(
            lines.insert(pin, LevelTable::fixed(level)).is_none(),
            "--level is given twice for {pin}; allowed is once"
        );
    }
    for (pin, file) in &cli.edges {
        ensure!(
            lines.insert(*pin, LevelTable::read(file)?).is_none(),
            "--edges or --level is given twice for {pin}; allowed is once"
        );
    }
    let button = wiring.button;
    ensure!(!lines.contains_key(&button), "--level or --edges is given for {button}, the user button; use --press");
    ensure!(
        cli.emergency_stop.is_empty() || !lines.contains_key(&EMERGENCY_STOP),
        "both --emergency-stop and --level or --edges set {EMERGENCY_STOP}; remove one of them"
    );
    let recorder = SignalRecorder::create(cli.record_conversions.as_deref(), &cli.record_edges)?;
    let default = image.board.config();
    let vdd = cli.vdd.unwrap_or(default.vdd);
    // On the boards both are connected.
    let vdda = cli.vdda.or(cli.vdd).unwrap_or(default.vdda);
    let brown_out_threshold = cli.brown_out_threshold.into();
    // BOR_LEV counts from the highest level down. The model's default is that of a chip as delivered: off.
    let brown_out_level = cli.brown_out_level.unwrap_or(image.board.brown_out_level());
    let bor_level = if cli.no_brown_out_reset { default.bor_level } else { 3 - brown_out_level };
    let hse_hz = cli.hse_hz.unwrap_or(default.hse_hz);
    let (lsi_hz, hse_ready) = (cli.lsi_hz, !cli.hse_dead);
    let config = SocConfig { hse_hz, lsi_hz, vdd, vdda, hse_ready, bor_level, brown_out_threshold, ..default };
    let options = RunOptions {
        secs: cli.secs,
        cpi: cli.cpi,
        pace: cli.pace,
        stop_on_lint: cli.stop_on_lint,
        semihosting: cli.self_test_exit.is_some(),
        rtt_mode: cli.rtt_mode,
        rtt_every: cli.rtt_every,
        rtt_server: cli.rtt_server,
        drain: !cli.no_drain,
        debugger: cli.debugger,
        probe: cli.probe,
        violates: cli.violates.clone(),
    };
    let servos = match cli.servo {
        Some(kind) => {
            let joints = Joint::of_flash(&image.flash)
                .context("--servo: the flash has no valid robot record, which says how the servos are mounted; write one with --flash")?;
            let kind = match kind {
                ServoKind::Analogue => Kind::Analogue,
                ServoKind::Digital => Kind::Digital,
            };
            Some(Servos::new(kind, &joints, cli.servo_at.unwrap_or_default()))
        }
        None => None,
    };
    let injections = collect_injections(cli, &image)?;
    let script = cli.script.as_deref().map(Script::read).transpose()?;
    let mut plant = BoardPlant::new(wiring, volts, cli.press.clone(), lines).supplied(vdda);
    plant.wire(cli.wire.clone());
    cli.emergency_stop.iter().for_each(|press| plant.press_emergency_stop(*press));
    plant.pulses.record_edges_of(cli.record_edges.iter().map(|(pin, _)| *pin));
    if let Some(path) = &cli.campaign {
        let campaign = Campaign::read(path, &image)?;
        ensure!(injections.is_empty(), "a campaign injects its own faults; remove the other ones");
        let jobs = match cli.jobs {
            Some(jobs) => jobs.get(),
            // One more is ready where a case ends: a copy of the process takes the time in which a core would have nothing to do.
            None => std::thread::available_parallelism().map_or(1, std::num::NonZero::get) + 1,
        };
        let nowhere = ReportWriter::new(std::io::sink());
        let run = BoardRun::new(&image, config, plant, vec![], recorder, Console::closed(), None, nowhere, options)?;
        let plan = Plan {
            run: cli.run.as_deref().context("--campaign needs --run, the run of the file")?,
            only: cli.only.as_deref(),
            several: cli.several.map(|cases| Several { cases, seed: cli.seed }),
            every: cli.every.get(),
            jobs,
            boot_log: cli.boot_log,
        };
        return run.campaign(&campaign, &plan);
    }
    let report = ReportWriter::new(BufWriter::new(stdout()));
    let serial = cli.serial.then(SerialPort::open).transpose()?;
    // The requests come on standard input.
    let console = if cli.lockstep { Console::closed() } else { Console::open()? };
    let mut run = BoardRun::new(&image, config, plant, injections, recorder, console, serial, report, options)?;
    run.servos = servos;
    if cli.lockstep {
        run.follow_requests(Requests::new(std::io::stdin().lock()));
    }
    if let Some(script) = &script {
        run.follow(script)?;
    }
    run.save_flash(&cli.save_flash)?;
    if let Some(path) = &cli.trace_execution {
        run.trace_execution(path)?;
    }
    run.run()
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
    fn the_command_line_is_parsed() {
        Cli::command().debug_assert();
        let cli = parse(&["fw.elf", "--secs", "2", "--press", "0.5", "1:0.2", "--hang", "a::b@1"]).unwrap();
        assert_eq!(cli.press, [ButtonPress { at: 0.5, hold: 0.5 }, ButtonPress { at: 1.0, hold: 0.2 }]);
        let cli_stop = parse(&["fw.elf", "--emergency-stop", "0.5", "1:0.2"]).unwrap();
        assert_eq!(cli_stop.emergency_stop, [ButtonPress { at: 0.5, hold: 0.1 }, ButtonPress { at: 1.0, hold: 0.2 }]);
        assert_eq!((cli.secs, cli.cpi, cli.lsi_hz), (Some(2.0), 1.0, 32_000.0));
    }

    #[test]
    fn presses_that_do_not_come_are_named() {
        let late = |secs: &[&str]| {
            let presses = ["fw.elf", "--press", "1", "3:0.2", "--emergency-stop", "2.9", "4"];
            late_presses(&parse(&[&presses[..], secs].concat()).unwrap())
        };
        assert_eq!(
            late(&["--secs", "3"]),
            [
                "--press: the press at 3 s does not come: the run ends at 3 s",
                "--emergency-stop: the press at 4 s does not come: the run ends at 3 s"
            ]
        );
        assert!(late(&["--secs", "4.1"]).is_empty() && late(&[]).is_empty());
    }

    #[test]
    fn bad_values_are_named_in_the_message() {
        for (arguments, words) in [
            (&["fw.elf", "--secs", "0"][..], "greater than 0"),
            (&["fw.elf", "--secs", "nan"], "not a finite number"),
            (&["fw.elf", "--cpi", "0"], "0.1 to 100"),
            (&["fw.elf", "--press", "x"], "`x` is not a finite number"),
            (&["fw.elf", "--press", "1:0"], "greater than 0"),
            (&["fw.elf", "--emergency-stop", "x"], "`x` is not a finite number"),
            (&["fw.elf", "--level", "PB12"], "PB12=1"),
            (&["fw.elf", "--level", "PB12=2"], "PB12=1"),
            (&["fw.elf", "--level", "PX1=1"], "is not the name of a pin"),
            (&["fw.elf", "--wire", "PE9"], "PE9=PC6"),
            (&["fw.elf", "--wire", "PE9=PX6"], "is not the name of a pin"),
            (&["fw.elf", "--edges", "PC6"], "PIN=FILE"),
            (&["fw.elf", "--edges", "PX1=a.csv"], "is not the name of a pin"),
            (&["fw.elf", "--hang", "tick"], "SYMBOL@SECONDS"),
            (&["fw.elf", "--register", "0x40010020=1"], "ADDRESS=VALUE@SECONDS"),
            (&["fw.elf", "--flash", "4000=x"], "ADDRESS=FILE"),
            (&["fw.elf", "--save-flash", "x=a.bin"], "ADDRESS=FILE"),
            (&["fw.elf", "--campaign", "a.toml", "--script", "b.toml"], "cannot be used with"),
            (&["fw.elf", "--flash", "0x4000"], "ADDRESS=FILE"),
            (&["fw.elf", "--hse-dead", "--hse-hz", "8000000"], "cannot be used with"),
            (&["fw.elf", "--run", "disarmed"], "--campaign"),
            (&["fw.elf", "--campaign", "a.toml"], "--run"),
            (&["fw.elf", "--vdda", "0"], "greater than 0"),
            (&["fw.elf", "--record-edges", "PB5"], "PIN=FILE"),
            (&["fw.elf", "--record-edges", "P5=a.csv"], "is not the name of a pin"),
            (&["fw.elf", "--lsi-hz", "-1"], "-1"),
            (&["fw.elf", "--board", "nucleo-f446re"], "f4-discovery, black-pill-f411"),
            (&["fw.elf", "--hse-hz", "0"], "1000000..=50000000"),
            (&["fw.elf", "--lsi-hz", "100001"], "0 to 100000"),
            (&["fw.elf", "--lsi", "60000"], "HZ@SECONDS"),
            (&["fw.elf", "--halt", "x"], "`x` is not a finite number"),
            (&["fw.elf", "--servo", "steam"], "analogue, digital"),
            (&["fw.elf", "--servo", "digital", "--servo-at", "1,2,3"], "four angles in degrees"),
            (&["fw.elf", "--servo", "digital", "--servo-at", "1,2,3,181"], "four angles in degrees"),
            (&["fw.elf", "--servo-at", "0,0,0,0"], "--servo"),
            (&["fw.elf", "--violates", ""], "--violates"),
            (&["fw.elf", "--rtt-mode", "3"], "3"),
            (&["fw.elf", "--loop"], "--volts"),
            (&["fw.elf", "--lockstep", "--volts", "a.csv"], "cannot be used with"),
            (&["fw.elf", "--lockstep", "--secs", "1"], "cannot be used with"),
            (&["fw.elf", "--lockstep", "--pace"], "cannot be used with"),
            (&["fw.elf", "--lockstep", "--campaign", "a.toml"], "cannot be used with"),
            (&["fw.elf", "--campaign", "a.toml", "--press", "1"], "cannot be used with"),
            (&[], "ELF"),
        ] {
            let message = parse(arguments).unwrap_err();
            assert!(message.contains(words), "{arguments:?}: {message}");
        }
    }
}
