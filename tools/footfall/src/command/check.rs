//! `footfall check`: reads files and reports what they are and what is wrong with them.
//!
//! A recording takes the way that it takes in `footfall fit`, up to the result, which is not written: what `check` calls good, `fit` takes.

mod record;
mod recording;

use crate::command::fit::job::Job;
use crate::failure::Failure;
use crate::file::recording::ReadSettings;
use crate::file::recording::SensorCalibration;
use crate::options::board_supply::BoardSupply;
use crate::options::reading::Reading;
use clap::Args;
use gait_fit::fit::Settings;
use gait_trace::LowPass;
use generator_file::network_file::HostGenerator;
use generator_file::robot_file::RobotFile;
use std::path::PathBuf;

/// Options of `footfall check`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Files without an option; refused with the option of their kind
    #[arg(hide = true)]
    pub bare: Vec<PathBuf>,
    /// A recording, in any format that `fit` reads; good is what `fit` takes
    #[arg(long, value_name = "FILE")]
    pub trace: Vec<PathBuf>,
    /// A robot file
    #[arg(long, value_name = "TOML")]
    pub robot: Vec<PathBuf>,
    /// A generator file
    #[arg(long, value_name = "TOML")]
    pub generator: Vec<PathBuf>,
    /// A flash record, or a sector that was read from a board
    #[arg(long, value_name = "BIN")]
    pub record: Vec<PathBuf>,
    /// How recordings are read; the sensor file that --calibration names is checked too
    #[command(flatten)]
    pub reading: Reading,
    /// The board that is to take the sensor file
    #[command(flatten)]
    pub board: BoardSupply,
    /// Call no recording with a warning good: the exit code is 1
    #[arg(long)]
    pub strict: bool,
}

/// Results of all files.
#[derive(Default)]
struct Results {
    /// What is printed to standard output.
    text: String,
    wrong_input: Vec<String>,
    /// Good but for warnings, with --strict.
    not_sound: Vec<String>,
}

impl Results {
    fn take(&mut self, result: Result<String, Failure>) {
        match result {
            Ok(line) => self.text.extend([line.as_str(), "\n"]),
            Err(Failure::Input(why)) => self.wrong_input.push(why),
            Err(Failure::Run(why)) => self.not_sound.push(why),
        }
    }
}

/// Runs the command: prints a line for each correct file, and a report for each recording.
///
/// # Errors
/// The errors of all wrong files, one a line.
pub fn run(options: Options) -> Result<(), Failure> {
    let Options { bare, trace, robot, generator, record, reading, board, strict } = options;
    if let Some(file) = bare.first() {
        let file = file.display();
        return Err(Failure::input(format!(
            "`{file}`: allowed is a file behind the option of its kind: `--trace {file}` if it is a recording, else --generator, --robot, --record or --calibration"
        )));
    }
    let files = [&trace, &robot, &generator, &record];
    if files.iter().all(|files| files.is_empty()) && reading.calibration.is_none() {
        return Err(Failure::input(
            "no file named: allowed are --trace, --robot, --generator and --record, each any number of times, and --calibration",
        ));
    }
    let mut results = Results::default();
    match reading.settings(LowPass::Customary) {
        Ok(reading) => {
            let is_for_recordings = !trace.is_empty();
            match &reading.calibration {
                Some(sensor) => results.take(sensor_file(sensor, &board, is_for_recordings)),
                None => board.check_unused().err().into_iter().for_each(|unused| results.take(Err(unused))),
            }
            let job = job(reading, strict);
            for path in &trace {
                let (report, result) = recording::check(path, &job);
                results.text += &report;
                results.take(result);
            }
        }
        Err(why) => {
            results.take(Err(why));
            results
                .wrong_input
                .extend(trace.iter().map(|path| format!("{}: not read, since the options are wrong", path.display())));
        }
    }
    for path in &robot {
        let file = RobotFile::read(path).map_err(Failure::input);
        results.take(file.map(|file| format!("{}: good: the robot \"{}\"", path.display(), file.name)));
    }
    for path in &generator {
        let file = HostGenerator::read(path).map_err(Failure::input);
        let what = file.map(|file| match file {
            HostGenerator::FourJoints(file) => format!("a {} generator", file.set.name()),
            HostGenerator::Network(file) => {
                format!("a phase-coupled network of {} joints, for the host", file.set.joints.len())
            }
        });
        results.take(what.map(|what| format!("{}: good: {what}", path.display())));
    }
    record.iter().for_each(|path| results.take(record::check(path)));
    crate::output::print(&crate::messages::escaped(&results.text))?;
    let Results { wrong_input, not_sound, .. } = results;
    match (wrong_input.is_empty(), not_sound.is_empty()) {
        (true, true) => Ok(()),
        (true, false) => Err(Failure::Run(not_sound.join("\n"))),
        (false, _) => Err(Failure::Input([wrong_input, not_sound].concat().join("\n"))),
    }
}

/// One line about a sensor file. What reads a recording of volts needs no board that takes it, but that is said.
fn sensor_file(sensor: &SensorCalibration, board: &BoardSupply, is_for_recordings: bool) -> Result<String, Failure> {
    let (least, most) = sensor.curve.span();
    let (path, points) = (sensor.path.display(), sensor.curve.points().len());
    let good = format!("{path}: good: {points} points, {:.1} to {:.1} degrees", least.degrees(), most.degrees());
    match board.check(&sensor.path) {
        Ok(()) => Ok(good),
        Err(refused) if is_for_recordings => Ok(format!("{good}, for recordings only: {refused}")),
        Err(refused) => Err(refused),
    }
}

/// The fit that a recording must pass: of the shape, as the other generators are replaced by it where they fail.
fn job(reading: ReadSettings, strict: bool) -> Job {
    Job { fit: Settings { rules: reading.rules(), ..Settings::default() }, reading, robot: None, strict }
}
