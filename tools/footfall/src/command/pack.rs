//! `footfall pack`: a walker's parameters, or the worn sensors, as the bytes of a parameter sector of the board; or a walker as a
//! constant in Rust.

use clap::Args;
use generator_file::file::GeneratorFile;
use joint_loop::GeneratorConfig;
use joint_loop::store::{generator_record, sensor_record};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::file::sensors::SensorArgument;

/// Options of `footfall pack`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A walker's parameters
    #[arg(value_name = "PARAMS", required_unless_present = "sensor", conflicts_with = "sensor")]
    pub params: Option<PathBuf>,
    /// A worn sensor instead, from channel 1 on, up to four: its joint, and its calibration [default: the published curve]
    #[arg(long, value_name = "JOINT[=TOML]", requires = "out")]
    pub sensor: Vec<SensorArgument>,
    /// Print a constant in Rust for programs that use `joint-loop`, instead
    #[arg(long, conflicts_with = "out", required_unless_present = "out")]
    pub rust: bool,
    /// Write the bytes here
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or the file cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let write = |path: &Path, what: &str, bytes: &[u8], crc: u32, address: u32| {
        gait_trace::format::whole_file::write(path, |out| out.write_all(bytes))
            .map_err(|error| Failure::run(format!("{}: cannot be written: {error}", path.display())))?;
        let (path, length) = (path.display(), bytes.len());
        eprintln!("{path}: {what}, {length} bytes, check sum {crc:08x}, for {address:#010x}");
        Ok(())
    };
    let Some(params) = &options.params else {
        let (worn, path) = (SensorArgument::read_all(&options.sensor)?, options.out.as_ref());
        let record = sensor_record::record_of(&worn);
        let joints: Vec<&str> = worn.iter().map(|sensor| sensor.joint.name()).collect();
        let what = format!("sensors on {}", joints.join(", "));
        let path = path.ok_or_else(|| Failure::input("--out is missing"))?;
        return write(path, &what, record.bytes(), record.crc(), sensor_record::ADDRESS);
    };
    let file = GeneratorFile::read(params).map_err(Failure::input)?;
    let config = file.set.config();
    let Some(path) = &options.out else {
        return crate::cli::print(&constant(&config, &file.provenance.source));
    };
    let record = generator_record::record_of(&config);
    let what = format!("a {} walker", config.name());
    write(path, &what, record.bytes(), record.crc(), generator_record::ADDRESS)
}

/// The configuration as a Rust file: what `Debug` prints is the expression itself, and its numbers read back to the same bits.
#[must_use]
pub fn constant(config: &GeneratorConfig, source: &str) -> String {
    let uses = config.rust_imports();
    let source: String = source.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!(
        "// Written by `footfall pack --rust`. Angles in radians, times in seconds.\n{uses}\n/// A walker from: {}\n#[rustfmt::skip]\n#[allow(clippy::all)]\npub const WALKER: GeneratorConfig = GeneratorConfig::{config:#?};\n",
        if source.is_empty() { "nowhere told" } else { &source }
    )
}
