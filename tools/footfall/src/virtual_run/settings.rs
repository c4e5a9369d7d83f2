//! Settings of a run on the virtual board.

use crate::options::overwrite::Overwrite;
use crate::publish::Receivers;
use joint_loop::RecordName;
use joint_loop::setup::default_loop::Parameters;
use std::ffi::OsString;
use std::path::PathBuf;
use std::str::FromStr;

/// When `--press auto` begins to hold the button, in virtual seconds.
pub const ARM_AT_S: f64 = 0.1;

/// When the emergency stop is pressed, and for how long, in virtual seconds: its test, without which the board does not arm. It ends before
/// [`ARM_AT_S`], because a hold during which the stop is pressed does not arm.
pub const STOP_TEST_S: [f64; 2] = [0.05, 0.04];

/// How long before the end `--disarm` presses the button: the stop takes 1 s, and half a second shows that nothing moves after it.
pub const DISARM_BEFORE_END_S: f64 = 1.7;

/// Virtual seconds of a run without a terminal, where no option gives them.
pub const DEFAULT_SECS: f64 = 10.0;

/// How long the button is held, in virtual seconds: a deliberate hold, whose release arms.
pub const PRESS_S: f64 = 0.5;

/// A run on the virtual board.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The firmware's ELF file.
    pub elf: PathBuf,
    /// The virtual board's program.
    pub virtual_board: PathBuf,
    /// The capture to write.
    pub record: Option<PathBuf>,
    /// Unix time of the power-on for the capture, if it is stated, ns.
    pub zero_ns: Option<u64>,
    /// Whether files may be replaced.
    pub overwrite: Overwrite,
    /// The recording that is fed to the sensors; `None` for the default one.
    pub trace: Option<PathBuf>,
    /// Generator, sensors and robot.
    pub parameters: Parameters,
    /// The generator file; `None` for the built-in walk.
    pub generator: Option<PathBuf>,
    /// Name of the record of the sensors from options; `None` for the built-in ones.
    pub sensors_name: Option<RecordName>,
    /// Name of the record of the robot.
    pub robot_name: RecordName,
    /// The robot file; `None` for the default robot.
    pub robot_file: Option<PathBuf>,
    /// Virtual seconds.
    pub secs: Option<f64>,
    /// When the button is pressed.
    pub press: Press,
    /// The button is pressed again before the end.
    pub disarm: bool,
    /// In real time.
    pub pace: bool,
    /// Keys of the screen change the board, through its serial port.
    pub tune: bool,
    /// Where the run is sent while it runs.
    pub receivers: Receivers,
    /// How the run is shown.
    pub show: Show,
    /// More options for the virtual board.
    pub board: Vec<OsString>,
}

/// How a run is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Show {
    /// On a screen.
    Screen,
    /// As lines of text.
    Plain,
    /// As JSON objects, one a line.
    Json,
}

/// When the user button is pressed.
#[derive(Debug, Clone, PartialEq)]
pub enum Press {
    /// At [`ARM_AT_S`].
    Auto,
    /// At these times, in virtual seconds; an empty list for never.
    At(Vec<f64>),
}

impl FromStr for Press {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "none" => Ok(Self::At(vec![])),
            times => {
                let time = |text: &str| text.trim().parse().ok().filter(|t: &f64| t.is_finite() && *t >= 0.0);
                let wanted = || format!("`{times}`: allowed are `auto`, `none`, and times in seconds such as 0.5,4");
                times.split(',').map(time).collect::<Option<_>>().map(Self::At).ok_or_else(wanted)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_presses_are_read() {
        assert_eq!("auto".parse(), Ok(Press::Auto));
        assert_eq!("none".parse(), Ok(Press::At(vec![])));
        assert_eq!("0.5, 4".parse(), Ok(Press::At(vec![0.5, 4.0])));
        for bad in ["", "soon", "-1", "1,,2", "nan", "inf"] {
            let error = bad.parse::<Press>().unwrap_err();
            assert!(error.contains("allowed are `auto`"), "{bad}: {error}");
        }
    }
}
