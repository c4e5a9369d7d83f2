//! `footfall pack`: writes a generator, the sensors or a robot as a flash record of the board, or a generator as a Rust constant.

use clap::{ArgGroup, Args};
use firmware::board::{GENERATOR_SECTOR, ROBOT_SECTOR, SENSORS_SECTOR};
use generator_file::file::GeneratorFile;
use generator_file::robot_file::RobotFile;
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_loop::{GeneratorConfig, RecordName};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::messages;
use crate::options::board_supply::BoardSupply;
use crate::options::overwrite::Overwrite;
use crate::options::record_name;
use crate::options::sensors::SensorArgument;
use crate::output;

/// Options of `footfall pack`.
#[derive(Debug, Clone, Args)]
#[command(group(ArgGroup::new("written").required(true).args(["rust", "out"])))]
pub struct Options {
    /// A generator file
    #[arg(value_name = "GENERATOR", required_unless_present_any = ["sensor", "robot"], conflicts_with_all = ["sensor", "robot"])]
    pub params: Option<PathBuf>,
    /// A sensor instead, from channel 1 on, up to four: its joint, and its sensor file [default: the published curve]
    #[arg(long, value_name = "JOINT[=TOML]", requires = "out")]
    pub sensor: Vec<SensorArgument>,
    /// A robot file instead
    #[arg(long, value_name = "TOML", requires = "out", conflicts_with = "sensor")]
    pub robot: Option<PathBuf>,
    /// Name of the record, which the board's boot line shows: up to 24 bytes [default: that of the file, of the sensors, or in the robot file]
    #[arg(long, value_name = "TEXT", requires = "out")]
    pub name: Option<RecordName>,
    /// Print a Rust constant for programs that use `joint-loop` instead
    #[arg(long)]
    pub rust: bool,
    /// The record to write
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// The board that is to take the record
    #[command(flatten)]
    pub board: BoardSupply,
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
        output::check_apart(
            [out.as_path()],
            options.params.as_deref().into_iter().chain(options.robot.as_deref()).chain(sensors),
        )?;
        output::check(out, options.overwrite)?;
    }
    let write = |out: &Path, what: &str, name: &RecordName, bytes: &[u8], crc: u32, address: u32| {
        output::write_bytes(out, bytes, options.overwrite)?;
        let (path, length) = (out.display(), bytes.len());
        messages::status(format_args!(
            "{path}: {what} \"{name}\", {length} bytes, check sum {crc:08x}, for {address:#010x}"
        ));
        messages::written(out);
        Ok(())
    };
    if options.robot.is_some() {
        options.board.check_unused()?;
    }
    let missing = || Failure::input("--out is missing; name the file to write");
    if let Some(robot) = &options.robot {
        let file = RobotFile::read(robot).map_err(Failure::input)?;
        let name = options.name.unwrap_or(file.name);
        let record = robot_record::record_of(&file.robot, &name);
        let path = options.out.as_ref().ok_or_else(missing)?;
        return write(path, "the robot", &name, record.bytes(), record.crc(), ROBOT_SECTOR);
    }
    let Some(params) = &options.params else {
        options
            .sensor
            .iter()
            .filter_map(|sensor| sensor.calibration.as_deref())
            .try_for_each(|file| options.board.check(file))?;
        let (sensors, path) = (SensorArgument::read_all(&options.sensor)?, options.out.as_ref());
        let name = options.name.unwrap_or_else(|| record_name::of_sensors(&options.sensor));
        let record = sensor_record::record_of(&sensors, &name);
        let joints: Vec<&str> = sensors.iter().map(|sensor| sensor.joint.name()).collect();
        let what = format!("sensors on {}", joints.join(", "));
        let path = path.ok_or_else(missing)?;
        return write(path, &what, &name, record.bytes(), record.crc(), SENSORS_SECTOR);
    };
    let file = GeneratorFile::read(params).map_err(Failure::input)?;
    let config = file.set.config();
    options.board.check_generator(params, &config)?;
    let Some(path) = &options.out else {
        return output::print(&constant(&config, &file.provenance.source));
    };
    let name = options.name.unwrap_or_else(|| record_name::of_file(params));
    let record = generator_record::record_of(&config, &name);
    let what = format!("a {} generator", config.name());
    write(path, &what, &name, record.bytes(), record.crc(), GENERATOR_SECTOR)
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
