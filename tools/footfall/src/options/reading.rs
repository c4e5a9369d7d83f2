//! Options that say how a recording is read.

use clap::Args;
use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::{Axis, LowPass, PositiveDirection, RowFilter};
use std::path::PathBuf;

use super::value::{number, one_of};
use crate::failure::Failure;
use crate::file::recording::{ReadSettings, SensorCalibration};

/// How recordings are read.
#[derive(Debug, Clone, Args)]
pub struct Reading {
    /// The columns of the joints and of the time, by name or by number from 1: left_hip=COLUMN,...,time=COLUMN
    #[arg(long, value_name = "MAP")]
    pub map: Vec<String>,
    /// Rows of a CSV file to read, where a column tells subjects or trials apart: subject=S01, or subject=* for all; may be repeated
    #[arg(long = "where", value_name = "COLUMN=VALUE")]
    pub only: Vec<RowFilter>,
    /// Unit of the angles where the file does not state it: degrees or radians
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<AngleUnit>,
    /// Low-pass filter before all other processing: customary (zero-lag Butterworth, 6 Hz for walking, 12 Hz for running), off, or a
    /// corner frequency in Hz [default: customary; for `convert` and `entrain`: off]
    #[arg(long, value_name = "HOW", value_parser = low_pass)]
    pub low_pass: Option<LowPass>,
    /// Sensor file with the calibration, for recordings of volts; also for columns whose unit the file does not state
    #[arg(long, value_name = "TOML")]
    pub calibration: Option<PathBuf>,
    /// Frames a second, for a CSV file with a column of frame numbers (`--map time=COLUMN`) or without a time, or in place of times that
    /// are rounded and agree with it
    #[arg(long, value_name = "HZ", value_parser = number(0.1..=1e6, " Hz"))]
    pub rate: Option<f64>,
    /// Component of the angles that is flexion, in C3D, Vicon and Visual3D files and in CSV with columns of components (`LKneeAngles_X`): x, y
    /// or z [default: of Plug-in Gait x, else the one that moves most]
    #[arg(long, value_name = "AXIS", value_parser = one_of(Axis::ALL, Axis::name))]
    pub axis: Option<Axis>,
    /// Topic of the joints, for an MCAP file that has joints in several topics
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// What the file counts as positive at the knees: flexion or extension [default: by the angles, if they show it]
    #[arg(long, value_name = "SIGN", value_parser = one_of(PositiveDirection::ALL, PositiveDirection::name))]
    pub knee_sign: Option<PositiveDirection>,
    /// What the file counts as positive at the hips: flexion or extension [default: as the format defines it, else by the shape of the
    /// strides]
    #[arg(long, value_name = "SIGN", value_parser = one_of(PositiveDirection::ALL, PositiveDirection::name))]
    pub hip_sign: Option<PositiveDirection>,
    /// Make the leg that the file does not have from the other one, half a stride later: for files with hip and knee of one leg
    #[arg(long)]
    pub mirror: bool,
    /// Curves of one cycle in which each leg counts from its own contact: move the right leg by half of the cycle
    #[arg(long)]
    pub own_cycles: bool,
    /// Duration of the stride, for a recording of one cycle whose time runs from 0 to 1 or from 0 to 100
    #[arg(long, visible_alias = "stride", value_name = "S", value_parser = number(0.2..=20.0, " seconds"))]
    pub stride_time: Option<f64>,
}

impl Reading {
    /// The settings; `low_pass` is the filter where the options name none.
    ///
    /// # Errors
    /// The calibration cannot be read, or the map is wrong.
    pub fn settings(self, low_pass: LowPass) -> Result<ReadSettings, Failure> {
        let settings = ReadSettings {
            map: self.map,
            unit: self.unit,
            low_pass: self.low_pass.unwrap_or(low_pass),
            calibration: self.calibration.map(SensorCalibration::read).transpose()?,
            rate_hz: self.rate,
            only: self.only,
            axis: self.axis,
            topic: self.topic,
            knee_sign: self.knee_sign,
            hip_sign: self.hip_sign,
            mirror: self.mirror,
            own_cycles: self.own_cycles,
            stride_s: self.stride_time,
            sideless: None,
        };
        settings.check()?;
        Ok(settings)
    }
}

fn low_pass(text: &str) -> Result<LowPass, String> {
    match text {
        "customary" => Ok(LowPass::Customary),
        "off" => Ok(LowPass::Off),
        hz => number(1.0..=100.0, " Hz")(hz).map(LowPass::At).map_err(|why| format!("{why}, customary or off")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, Command};

    /// Every option that the page of formats names is one of these; `--strict`, of warnings, is of the commands.
    #[test]
    fn the_options_of_the_page_of_formats_exist() {
        let command = Reading::augment_args(Command::new("read"));
        let has = |name: &str| command.get_arguments().any(|argument| argument.get_long() == Some(name));
        let page = gait_trace::format::page::markdown();
        let named = page.split("`--").skip(1);
        let named: Vec<&str> =
            named.filter_map(|rest| rest.split(|c: char| c != '-' && !c.is_ascii_lowercase()).next()).collect();
        assert!(named.len() > 20, "{named:?}");
        for name in named {
            assert!(has(name) || name == "strict", "--{name}");
        }
    }

    #[test]
    fn a_low_pass_is_a_name_or_a_frequency() {
        assert_eq!((low_pass("off"), low_pass("8")), (Ok(LowPass::Off), Ok(LowPass::At(8.0))));
        assert!(low_pass("0").is_err() && low_pass("nan").is_err());
    }
}
