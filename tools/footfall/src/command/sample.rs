//! `footfall sample`: lists the sample files, prints one, or writes them.

use clap::Args;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output;

/// A sample file.
#[derive(Debug)]
pub struct Sample {
    /// Name of the file.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// A command line that takes it; `{}` stands for the file.
    pub taken_by: &'static str,
    /// Its content.
    pub content: &'static [u8],
}

macro_rules! sample {
    ($name:literal, $what:literal, $taken_by:literal) => {
        Sample {
            name: $name,
            what: $what,
            taken_by: $taken_by,
            content: include_bytes!(concat!("../../../../samples/", $name)),
        }
    };
}

/// Every sample file. `samples/README.md` describes them.
pub const SAMPLES: [Sample; 16] = [
    sample!("walk.csv", "a recording: CSV with four joints, 40 s", "footfall fit {} -o generator.toml"),
    sample!(
        "walk.mot",
        "a recording: OpenSim motion, knees extension positive, 12 s",
        "footfall fit {} -o generator.toml"
    ),
    sample!("walk.c3d", "a recording: C3D with angles of Plug-in Gait, 12 s", "footfall check --trace {}"),
    sample!(
        "ankles.mot",
        "a recording: OpenSim motion of hips, knees and ankles, 12 s",
        "footfall fit {} --kind phase-coupled --joints 6 -o six-joints.toml"
    ),
    sample!(
        "oscilloscope.csv",
        "volts of a sensor on the left knee: CSV of a Tektronix oscilloscope, 15 s",
        "footfall convert {} --map left_knee=CH1 --calibration sensor.toml -o knee.csv"
    ),
    sample!("rows.csv", "known angles and the volts of a sensor there", "footfall calibrate {} -o hip.toml"),
    sample!("sensor.toml", "a sensor file: the calibration table of a sensor", "footfall check --calibration {}"),
    sample!("edges.csv", "edges of a board's synchronisation output on another clock", "footfall sync {}"),
    sample!(
        "line-board.csv",
        "edges of a line on the clock of a board",
        "footfall sync {} --against line-recorder.csv"
    ),
    sample!(
        "line-recorder.csv",
        "edges of the same line on another clock",
        "footfall sync line-board.csv --against {}"
    ),
    sample!("generator.toml", "a generator file: phase and shape", "footfall certify {}"),
    sample!("follower.toml", "a generator file: a follower with the sensor on the left hip", "footfall certify {}"),
    sample!("robot.toml", "a robot file: other servos and less travel", "footfall check --robot {}"),
    sample!("graph.txt", "a graph of nodes that operate by edge reversal", "footfall smer {}"),
    sample!(
        "foxglove-layout.json",
        "a layout of Foxglove for `watch --foxglove` and captures",
        "footfall watch --serial /dev/ttyACM0 --foxglove, then in Foxglove: Layouts, Import from file, {}"
    ),
    sample!("plotjuggler-layout.xml", "a layout of PlotJuggler for `watch --udp`", "plotjuggler --layout {}"),
];

/// Options of `footfall sample`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The sample to print or to write [default: a list of all]
    #[arg(value_name = "NAME")]
    pub name: Option<String>,
    /// Write every sample to the folder --out, which is made if it is not there
    #[arg(long, conflicts_with = "name", requires = "out")]
    pub all: bool,
    /// The file to write, or with --all the folder [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command.
///
/// # Errors
/// There is no such sample, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    match (&options.name, &options.out) {
        (Some(name), out) => one(sample(name)?, out.as_ref(), options.overwrite),
        (None, Some(folder)) if options.all => all(folder, options.overwrite),
        (None, Some(_)) => Err(Failure::input("--out without the name of a sample; allowed is NAME, or --all")),
        (None, None) => output::print(&SAMPLES.map(|sample| format!("{:<18} {}\n", sample.name, sample.what)).concat()),
    }
}

fn sample(name: &str) -> Result<&'static Sample, Failure> {
    let names = || SAMPLES.map(|sample| sample.name).join(", ");
    let found = SAMPLES.iter().find(|sample| sample.name == name);
    found.ok_or_else(|| Failure::input(format!("sample `{name}`: allowed is one of {}", names())))
}

fn one(sample: &Sample, out: Option<&PathBuf>, overwrite: Overwrite) -> Result<(), Failure> {
    let Some(path) = out else {
        if std::str::from_utf8(sample.content).is_err() && io::stdout().is_terminal() {
            return Err(Failure::input(format!("{} is no text; name the file to write with --out", sample.name)));
        }
        return output::print_bytes(sample.content);
    };
    output::write_bytes(path, sample.content, overwrite)?;
    messages::written(path);
    messages::next("for example", sample.taken_by.replace("{}", &gait_trace::shell_word(path)));
    Ok(())
}

fn all(folder: &Path, overwrite: Overwrite) -> Result<(), Failure> {
    let files = SAMPLES.map(|sample| (sample.name, sample.content));
    output::write_all(folder, &files, overwrite)?.iter().for_each(|path| messages::written(path));
    Ok(())
}
