//! `footfall pack`: a walker's parameters as the bytes of the board's parameter sector, or as a constant in Rust.

use clap::Args;
use joint_loop::WalkerConfig;
use joint_loop::walker_record::{ADDRESS, Record};
use std::path::PathBuf;
use walker::generator_file::WalkerFile;

use crate::failure::Failure;

/// Options of `footfall pack`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A walker's parameters
    #[arg(value_name = "PARAMS")]
    pub params: PathBuf,
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
    let file = WalkerFile::read(&options.params).map_err(Failure::input)?;
    let config = file.set.config();
    let Some(path) = &options.out else {
        return crate::cli::print(&constant(&config, &file.provenance.source));
    };
    let record = Record::of(&config);
    gait_trace::whole_file::write(path, |out| out.write_all(record.bytes()))
        .map_err(|error| Failure::run(format!("{}: cannot be written: {error}", path.display())))?;
    eprintln!(
        "{}: a {} walker, {} bytes, check sum {:08x}, for {ADDRESS:#010x}",
        path.display(),
        config.name(),
        record.bytes().len(),
        record.crc()
    );
    Ok(())
}

/// The configuration as a Rust file: what `Debug` prints is the expression itself, and its numbers read back to the same bits.
#[must_use]
pub fn constant(config: &WalkerConfig, source: &str) -> String {
    let uses = match config {
        WalkerConfig::Robust(_) => {
            "use cpg_core::robust::RobustConfig;\nuse joint_loop::WalkerConfig;\nuse joint_units::{Phase, Radians};\n"
        }
        WalkerConfig::Thesis(_) => {
            "use cpg_core::rayleigh::RayleighConfig;\nuse cpg_core::thesis::NetworkConfig;\nuse joint_loop::WalkerConfig;\nuse joint_units::Phase;\n"
        }
        WalkerConfig::Follow(_) => {
            "use cpg_core::entrainment::EventSource::*;\nuse joint_loop::{FollowConfig, SeriesConfig, ShapeConfig, WalkerConfig};\nuse joint_units::Joint::*;\nuse joint_units::Radians;\n"
        }
        WalkerConfig::Shape(_) => {
            "use joint_loop::{SeriesConfig, ShapeConfig, WalkerConfig};\nuse joint_units::Radians;\n"
        }
    };
    let source: String = source.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!(
        "// Written by `footfall pack --rust`. Angles in radians, times in seconds.\n{uses}\n/// A walker from: {}\n#[rustfmt::skip]\n#[allow(clippy::all)]\npub const WALKER: WalkerConfig = WalkerConfig::{config:#?};\n",
        if source.is_empty() { "nowhere told" } else { &source }
    )
}
