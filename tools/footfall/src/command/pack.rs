//! `footfall pack`: writes a generator or the sensors as a flash record of the board, or a generator as a Rust constant.

use clap::{ArgGroup, Args};
use firmware::board::{GENERATOR_SECTOR, SENSORS_SECTOR};
use generator_file::file::GeneratorFile;
use joint_loop::GeneratorConfig;
use joint_loop::store::{generator_record, sensor_record};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::options::sensors::SensorArgument;
use crate::output;

/// Options of `footfall pack`.
#[derive(Debug, Clone, Args)]
#[command(group(ArgGroup::new("written").required(true).args(["rust", "out"])))]
pub struct Options {
    /// A generator file
    #[arg(value_name = "GENERATOR", required_unless_present = "sensor", conflicts_with = "sensor")]
    pub params: Option<PathBuf>,
    /// A sensor instead, from channel 1 on, up to four: its joint, and its sensor file [default: the published curve]
    #[arg(long, value_name = "JOINT[=TOML]", requires = "out")]
    pub sensor: Vec<SensorArgument>,
    /// Print a Rust constant for programs that use `joint-loop` instead
    #[arg(long)]
    pub rust: bool,
    /// The record to write
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command.
///
/// # Errors
/// Wrong input, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    if let Some(out) = &options.out {
        let sensors = options.sensor.iter().filter_map(|sensor| sensor.calibration.as_deref());
        output::check_apart([out.as_path()], options.params.as_deref().into_iter().chain(sensors))?;
        output::check(out, options.overwrite)?;
    }
    let write = |out: &Path, what: &str, bytes: &[u8], crc: u32, address: u32| {
        output::write_bytes(out, bytes, options.overwrite)?;
        let (path, length) = (out.display(), bytes.len());
        messages::status(format_args!("{path}: {what}, {length} bytes, check sum {crc:08x}, for {address:#010x}"));
        messages::written(out);
        Ok(())
    };
    let Some(params) = &options.params else {
        let (sensors, path) = (SensorArgument::read_all(&options.sensor)?, options.out.as_ref());
        let record = sensor_record::record_of(&sensors);
        let joints: Vec<&str> = sensors.iter().map(|sensor| sensor.joint.name()).collect();
        let what = format!("sensors on {}", joints.join(", "));
        let path = path.ok_or_else(|| Failure::input("--out is missing; name the file to write"))?;
        return write(path, &what, record.bytes(), record.crc(), SENSORS_SECTOR);
    };
    let file = GeneratorFile::read(params).map_err(Failure::input)?;
    let config = file.set.config();
    let Some(path) = &options.out else {
        return output::print(&constant(&config, &file.provenance.source));
    };
    let record = generator_record::record_of(&config);
    let what = format!("a {} generator", config.name());
    write(path, &what, record.bytes(), record.crc(), GENERATOR_SECTOR)
}

/// The configuration as Rust source: the output of `Debug` is the expression, and its numbers read back to the same bits.
#[must_use]
pub fn constant(config: &GeneratorConfig, source: &str) -> String {
    let uses = config.rust_imports();
    let source: String = source.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!(
        "// Written by `footfall pack --rust`. Angles in radians, times in seconds.\n{uses}\n/// A generator fitted to: {}\n#[rustfmt::skip]\n#[allow(clippy::all)]\npub const GENERATOR: GeneratorConfig = GeneratorConfig::{config:#?};\n",
        if source.is_empty() { "not stated" } else { &source }
    )
}
