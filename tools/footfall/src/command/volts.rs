//! `footfall volts`: converts a recorded angle to the semi-synthetic volts of a sensor, looped, as `footfall watch` feeds them.

use crate::board::default_loop;
use crate::board::default_loop::SENSOR_JOINT;
use crate::board::feed;
use crate::board::feed::Opened;
use crate::failure::Failure;
use crate::file::calibration_file;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output;
use clap::Args;
use gait_trace::format::csv_file;
use joint_loop::{JointSensor, JointSensors};
use std::path::PathBuf;

/// Options of `footfall volts`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A recording of angles, in any format that `fit` reads: its left knee, or its only channel [default: a healthy adult]
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// A sensor file with the calibration [default: the firmware's]
    #[arg(long, value_name = "TOML")]
    pub calibration: Option<PathBuf>,
    /// The file to write [default: standard output]
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
        let inputs = [&options.trace, &options.calibration].into_iter().flatten().map(PathBuf::as_path);
        output::check_apart([out.as_path()], inputs)?;
        output::check(out, options.overwrite)?;
    }
    let (name, recording) = match &options.trace {
        Some(path) => {
            let Opened { name, recording, notes, .. } = feed::opened(path)?;
            output::notes(&notes);
            (name, recording)
        }
        None => feed::default_trace().map_err(Failure::input)?,
    };
    let sensor = match &options.calibration {
        Some(path) => calibration_file::read(path).map_err(Failure::input)?,
        None => default_loop::wired_sensor().map_err(Failure::run)?,
    };
    let sensor = JointSensor { joint: SENSOR_JOINT, divider: sensor.divider, calibration: sensor.calibration };
    let sensors = JointSensors::build([sensor]).map_err(Failure::run)?;
    let feed = feed::feed(&name, &recording, &sensors, default_loop::SENSOR_PINS, None)?;
    output::notes(&feed.notes);
    match &options.out {
        Some(path) => {
            output::write(path, options.overwrite, |out| csv_file::write_to(out, &feed.volts))?;
            messages::written(path);
        }
        None => {
            let mut text = Vec::new();
            csv_file::write_to(&mut text, &feed.volts).map_err(Failure::run)?;
            output::print(&String::from_utf8_lossy(&text))?;
        }
    }
    messages::status(format_args!("{} ({} rows)", feed.title, feed.volts.time_s().len()));
    if let Some(path) = &options.out {
        let command = format!("cargo xtask run --trace {}", gait_trace::shell_word(path));
        messages::next("feed them to the virtual board", command);
    }
    Ok(())
}
