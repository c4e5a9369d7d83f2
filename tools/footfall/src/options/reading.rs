//! Options that say how a recording is read.

use clap::Args;
use gait_trace::LowPass;
use gait_trace::format::joint_names::AngleUnit;
use std::path::PathBuf;

use super::value::number;
use crate::failure::Failure;
use crate::file::recording::ReadSettings;

/// How recordings are read.
#[derive(Debug, Clone, Args)]
pub struct Reading {
    /// The columns of the joints and of the time, by name or by number from 1: left_hip=COLUMN,...,time=COLUMN
    #[arg(long, value_name = "MAP")]
    pub map: Vec<String>,
    /// Unit of the angles where the file does not state it: degrees or radians
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<AngleUnit>,
    /// Low-pass filter before all other processing: customary (zero-lag Butterworth, 6 Hz for walking, 12 Hz for running), off, or a
    /// corner frequency in Hz [default: customary; for `convert` and `entrain`: off]
    #[arg(long, value_name = "HOW", value_parser = low_pass)]
    pub low_pass: Option<LowPass>,
    /// Sensor file with the calibration, for recordings of volts
    #[arg(long, value_name = "TOML")]
    pub calibration: Option<PathBuf>,
}

impl Reading {
    /// The settings; `low_pass` is the filter where the options name none.
    ///
    /// # Errors
    /// The calibration cannot be read, or the map is wrong.
    pub fn settings(self, low_pass: LowPass) -> Result<ReadSettings, Failure> {
        ReadSettings::new(self.map, self.unit, self.low_pass.unwrap_or(low_pass), self.calibration)
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

    #[test]
    fn a_low_pass_is_a_name_or_a_frequency() {
        assert_eq!((low_pass("off"), low_pass("8")), (Ok(LowPass::Off), Ok(LowPass::At(8.0))));
        assert!(low_pass("0").is_err() && low_pass("nan").is_err());
    }
}
