//! The steps from a recording to a fit and its report page.

use gait_fit::fit::{Fit, Settings, Source, fit};
use gait_fit::report;
use gait_trace::LowPass;
use gait_trace::RawJoints;
use std::path::Path;

use crate::failure::Failure;
use crate::file::recording::{self, ReadSettings, Recorded};

/// What is done with each recording.
#[derive(Debug)]
pub(super) struct Job {
    /// How it is read.
    pub(super) reading: ReadSettings,
    /// What is fitted.
    pub(super) fit: Settings,
}

/// A recording that can be fitted.
pub(super) struct Input {
    source: Source,
    joints: RawJoints,
}

impl Input {
    /// From what was read; `name` is how the result calls it.
    ///
    /// # Errors
    /// The recording is wrong.
    pub(super) fn of(recorded: Recorded, name: &str) -> Result<Self, Failure> {
        let joints = recorded.joints.map_err(Failure::input)?;
        Ok(Self { source: Source { name: name.into(), sha256: recorded.sha256 }, joints })
    }
}

impl Job {
    /// Reads a recording.
    pub(super) fn read(&self, path: &Path, name: &str) -> Result<Input, Failure> {
        Input::of(recording::parse(path, &recording::bytes(path)?, &self.reading)?, name)
    }

    /// Fits a recording, and judges the fit on strides that were not fitted.
    pub(super) fn fit(&self, input: &Input, progress: &mut dyn FnMut(&str)) -> Result<Fit, Failure> {
        fit(&input.source, &input.joints, &self.fit, progress).map_err(Failure::input)
    }

    /// The report page, with the command that makes it again.
    pub(super) fn page(&self, fitted: &Fit, path: &Path) -> Result<String, Failure> {
        let Self { reading, fit } = self;
        let mut words: Vec<String> =
            vec!["footfall fit".into(), quoted(&name_of(path)), "--kind".into(), fit.generator.name().into()];
        let mut option = |name: &str, value: String| words.extend([format!("--{name}"), quoted(&value)]);
        if let Some(harmonics) = fit.harmonics {
            option("harmonics", harmonics.to_string());
        }
        if let Some(joint) = fit.follow {
            option("follow", joint.name().into());
            option("events", fit.events.name().into());
        }
        match reading.low_pass {
            LowPass::Customary => {}
            LowPass::Off => option("low-pass", "off".into()),
            LowPass::At(hz) => option("low-pass", hz.to_string()),
        }
        reading.map.iter().for_each(|map| option("map", map.clone()));
        if let Some(unit) = reading.unit {
            option("unit", unit.words().into());
        }
        if let Some(calibration) = &reading.calibration {
            option("calibration", name_of(&calibration.path));
        }
        if let Some(rate) = reading.rate_hz {
            option("rate", rate.to_string());
        }
        if let Some(axis) = reading.axis {
            option("axis", axis.name().into());
        }
        if let Some(sign) = reading.knee_sign {
            option("knee-sign", sign.name().into());
        }
        if let Some(seconds) = reading.stride_s {
            option("stride-time", seconds.to_string());
        }
        option("seed", fit.seed.to_string());
        option("evaluations", fit.evaluations.to_string());
        let command = words.join(" ") + " -o generator.toml --report generator.html";
        report::html(fitted, &command).map_err(Failure::run)
    }
}

/// The name of a file without its folder.
pub(super) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// As a shell reads it as one word.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_split_them() {
        assert_eq!(quoted("left_hip=3,time=1"), "left_hip=3,time=1");
        assert_eq!(quoted("my walk.csv"), "'my walk.csv'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
