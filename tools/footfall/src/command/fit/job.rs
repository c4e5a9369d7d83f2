//! The steps from a recording to a fit and its report page.

use gait_fit::fit::{Fit, FitError, Settings, Source, fit};
use gait_fit::report;
use gait_trace::{LowPass, RawJoints, StrideError};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::file::recording::{self, ReadSettings, Recorded};
use gait_trace::shell_word;

/// What is done with each recording.
#[derive(Debug)]
pub(crate) struct Job {
    /// How it is read.
    pub(crate) reading: ReadSettings,
    /// What is fitted.
    pub(crate) fit: Settings,
    /// The robot file; `None` for the default robot.
    pub(crate) robot: Option<PathBuf>,
    /// A recording with a warning is refused.
    pub(crate) strict: bool,
}

/// Why a recording was not fitted.
pub(crate) enum NotFitted {
    /// It is a recording of joints, but of no gait.
    NoGait(Failure),
    /// Another reason.
    Failed(Failure),
}

impl From<NotFitted> for Failure {
    fn from(why: NotFitted) -> Self {
        match why {
            NotFitted::NoGait(failure) | NotFitted::Failed(failure) => failure,
        }
    }
}

/// A recording that can be fitted.
pub(crate) struct Input {
    source: Source,
    pub(crate) joints: RawJoints,
    low_pass: LowPass,
    /// What the user should know of how it is read.
    note: Option<String>,
}

impl Input {
    /// From what was read; `name` is how the result calls it, `low_pass` is the requested filter.
    ///
    /// # Errors
    /// The recording is wrong, or has been filtered before.
    pub(crate) fn of(recorded: Recorded, name: &str, low_pass: LowPass) -> Result<Self, Failure> {
        let (low_pass, note) = recorded.low_pass(low_pass)?;
        let joints = recorded.joints.map_err(Failure::input)?;
        Ok(Self { source: Source { name: name.into(), sha256: recorded.sha256 }, joints, low_pass, note })
    }
}

impl Job {
    /// Reads a recording.
    pub(crate) fn read(&self, path: &Path, name: &str) -> Result<Input, Failure> {
        Input::of(recording::open(path)?.parse(&self.reading)?, name, self.fit.rules.low_pass)
    }

    /// Fits a recording, and judges the fit on strides that were not fitted.
    pub(crate) fn fit(&self, input: &Input, progress: &mut dyn FnMut(&str)) -> Result<Fit, NotFitted> {
        let mut settings = self.fit.clone();
        settings.rules.low_pass = input.low_pass;
        let mut fitted = fit(&input.source, &input.joints, &settings, progress).map_err(|error| match error {
            FitError::Strides { why: StrideError::NoGait(_), .. } => NotFitted::NoGait(Failure::input(error)),
            _ => NotFitted::Failed(Failure::input(error)),
        })?;
        fitted.notes.extend(input.note.clone());
        if self.strict {
            recording::no_warning(&input.source.name, &fitted.conditioned.findings).map_err(NotFitted::Failed)?;
        }
        Ok(fitted)
    }

    /// The report page, with the command that makes it again.
    pub(crate) fn page(&self, fitted: &Fit, path: &Path) -> String {
        let Self { reading, fit, .. } = self;
        let mut words: Vec<String> =
            vec!["footfall fit".into(), shell_word(name_of(path)), "--kind".into(), fit.generator.name().into()];
        let mut option = |name: &str, value: String| words.extend([format!("--{name}"), shell_word(&value)]);
        if let Some(harmonics) = fit.harmonics {
            option("harmonics", harmonics.to_string());
        }
        if let Some(joint) = fit.follow {
            option("follow", joint.name().into());
            option("events", fit.events.name().into());
        }
        if let Some(robot) = &self.robot {
            option("robot", name_of(robot));
        }
        match reading.low_pass {
            LowPass::Customary => {}
            LowPass::Off => option("low-pass", "off".into()),
            LowPass::At(hz) => option("low-pass", hz.to_string()),
        }
        reading.map.iter().for_each(|map| option("map", map.clone()));
        reading.only.iter().for_each(|rows| option("where", rows.to_string()));
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
        if let Some(topic) = &reading.topic {
            option("topic", topic.clone());
        }
        if let Some(sign) = reading.knee_sign {
            option("knee-sign", sign.name().into());
        }
        if let Some(sign) = reading.hip_sign {
            option("hip-sign", sign.name().into());
        }
        if let Some(seconds) = reading.stride_s {
            option("stride-time", seconds.to_string());
        }
        option("seed", fit.seed.to_string());
        option("evaluations", fit.evaluations.to_string());
        let flags = [
            ("--mirror", reading.mirror),
            ("--own-cycles", reading.own_cycles),
            ("--no-corrections", !fit.corrections),
            ("--fit-limits", fit.fit_limits),
        ];
        words.extend(flags.into_iter().filter(|(_, is_set)| *is_set).map(|(flag, _)| flag.to_owned()));
        let command = words.join(" ") + " -o generator.toml --report generator.html";
        report::html(fitted, &command)
    }
}

/// The name of a file without its folder.
pub(crate) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
