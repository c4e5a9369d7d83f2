//! Options of a run on a board: what is fed to it, and how the run is shown.

use clap::Args;
use generator_file::file::GeneratorFile;
use generator_file::robot_file::RobotFile;
use joint_loop::setup::default_loop::Parameters;
use std::ffi::OsString;
use std::path::PathBuf;

use super::overwrite::Overwrite;
use super::record_name;
use super::robot::RobotArgument;
use super::sensors::SensorArgument;
use super::terminal::{Keys, shows_screens};
use super::value::number;
use crate::failure::Failure;
use crate::publish::Receivers;
use crate::virtual_run::settings::{Press, Settings, Show};

/// What is fed to the board, and how the run is shown.
#[derive(Debug, Clone, Args)]
pub struct Played {
    /// A recording to feed the sensors with: angles in degrees (of the joints with a sensor, or its only channel), or volts at the
    /// sensors' pins (PA1, PC1, PB0, PB1), of a Black Pill PA1, PA5, PB0, PB1 [default: a recording of a healthy adult]
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// A sensor, from channel 1 on, up to four: its joint, and the sensor file that `footfall calibrate` writes. They go into the board's
    /// second parameter sector [default: one sensor with the published curve, on the joint that the generator follows or on left_knee]
    #[arg(long, value_name = "JOINT[=TOML]")]
    pub sensor: Vec<SensorArgument>,
    /// A generator file; it goes into the board's parameter sector [default: the built-in walk]
    #[arg(long, value_name = "TOML")]
    pub generator: Option<PathBuf>,
    /// The robot, whose record goes into the board's third parameter sector
    #[command(flatten)]
    pub robot: RobotArgument,
    /// Virtual seconds to run [default: until q or Ctrl-C on a terminal, else 10]
    #[arg(long, value_name = "N", value_parser = number(0.1..=86_400.0, " seconds"))]
    pub secs: Option<f64>,
    /// Print one JSON object a line; the last one is the result of the run
    #[arg(long)]
    pub json: bool,
    /// Print plain lines even on a terminal
    #[arg(long, conflicts_with = "json")]
    pub plain: bool,
    /// When to hold the user button for 0.5 s, whose release arms, and which stops a motion at once: `auto` (at 0.1 s), `none`, or times in virtual
    /// seconds such as 0.5,4
    #[arg(long, value_name = "WHEN", default_value = "auto")]
    pub press: Press,
    /// Press the button again before the end, early enough to come to rest (needs --secs)
    #[arg(long, requires = "secs")]
    pub disarm: bool,
    /// Run in real time, as on a terminal
    #[arg(long)]
    pub pace: bool,
    /// Change the board's parameters by keys of the live screen. It takes the serial port of the virtual board, so that no other program can
    #[arg(long, conflicts_with_all = ["json", "plain"])]
    pub tune: bool,
    /// Unix time of the zero of a capture's time axis, seconds: of the first power-on in it [default: by the host's clock]
    #[arg(long, value_name = "SECONDS", value_parser = number(0.0..=2_147_483_647.0, " seconds"))]
    pub start_time: Option<f64>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// More options for the virtual board, as in `-- --hang control_step@3`
    #[arg(last = true, value_name = "OPTION")]
    pub board: Vec<OsString>,
}

impl Played {
    /// The content of the board's parameter sectors, with the built-in values where no option is given, and the default robot.
    ///
    /// # Errors
    /// A file is wrong, the sensors do not go together, or the generator follows a joint without a sensor.
    pub fn parameters(&self) -> Result<Parameters, Failure> {
        self.parameters_on(&self.robot.read()?)
    }

    fn parameters_on(&self, robot: &RobotFile) -> Result<Parameters, Failure> {
        let generator = match &self.generator {
            Some(path) => Some(GeneratorFile::read(path).map_err(Failure::input)?.set.config()),
            None => None,
        };
        let sensors = if self.sensor.is_empty() { None } else { Some(SensorArgument::read_all(&self.sensor)?) };
        let parameters = Parameters::with_defaults(generator, sensors, robot.robot).map_err(Failure::run)?;
        match parameters.generator.follows() {
            Some(joint) if parameters.sensors.channel_of(joint).is_none() => {
                let joint = joint.name();
                Err(Failure::input(format!(
                    "the generator follows {joint}, which has no sensor; add --sensor {joint}, or leave --sensor out"
                )))
            }
            _ => Ok(parameters),
        }
    }

    /// How the run is shown, with the keys from there.
    #[must_use]
    pub fn show(&self, keys: Keys) -> Show {
        match (self.json, self.plain) {
            (true, _) => Show::Json,
            (false, false) if shows_screens(keys) => Show::Screen,
            (false, _) => Show::Plain,
        }
    }

    /// The Unix time of the zero of a capture's axis, if it is stated, in nanoseconds.
    #[must_use]
    pub fn zero_ns(&self) -> Option<u64> {
        self.start_time.map(|seconds| (seconds * 1e9).round() as u64)
    }

    /// The settings of a run of this image on the virtual board.
    ///
    /// # Errors
    /// As [`Played::parameters`].
    pub fn settings(self, elf: PathBuf, virtual_board: PathBuf, record: Option<PathBuf>) -> Result<Settings, Failure> {
        let show = self.show(Keys::Stdin);
        if self.tune && show != Show::Screen {
            return Err(Failure::input(
                "--tune: there is no live screen here; allowed is a terminal, or `footfall set`",
            ));
        }
        let zero_ns = self.zero_ns();
        let robot = self.robot.read()?;
        let parameters = self.parameters_on(&robot)?;
        let sensors_name = (!self.sensor.is_empty()).then(|| record_name::of_sensors(&self.sensor));
        Ok(Settings {
            elf,
            virtual_board,
            record,
            zero_ns,
            overwrite: self.overwrite,
            trace: self.trace,
            parameters,
            generator: self.generator,
            sensors_name,
            robot_name: robot.name,
            robot_file: self.robot.robot,
            secs: self.secs,
            press: self.press,
            disarm: self.disarm,
            pace: self.pace,
            tune: self.tune,
            receivers: Receivers::default(),
            show,
            board: self.board,
        })
    }
}
