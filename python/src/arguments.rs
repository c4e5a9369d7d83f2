//! Checks of arguments: every refusal says what is allowed.

use generator_file::robot_file::RobotFile;
use joint_units::{Joint, Period};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use std::path::Path;

use crate::error;

/// One of some words.
pub(crate) fn one_of<T: Copy>(
    argument: &str,
    word: &str,
    all: impl IntoIterator<Item = T> + Clone,
    name: impl Fn(T) -> &'static str,
) -> PyResult<T> {
    all.clone().into_iter().find(|item| name(*item) == word).ok_or_else(|| {
        let allowed: Vec<&str> = all.into_iter().map(name).collect();
        error::input(format!("{argument} = '{word}': allowed is one of {}", allowed.join(", ")))
    })
}

/// A joint by its name.
pub(crate) fn joint(argument: &str, name: &str) -> PyResult<Joint> {
    one_of(argument, name, Joint::ALL, Joint::name)
}

/// A number within a range.
pub(crate) fn within(argument: &str, value: f64, least: f64, most: f64, unit: &str) -> PyResult<f64> {
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(error::input(format!("{argument} = {value}: allowed is {least} to {most}{unit}")))
    }
}

/// A whole number of Python. One that has more than 128 bits is the end of their range, which no argument allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Whole(pub(crate) i128);

impl<'py> FromPyObject<'_, 'py> for Whole {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        integer(&value).map(Self)
    }
}

impl From<Whole> for i128 {
    fn from(Whole(value): Whole) -> Self {
        value
    }
}

/// The same, for an argument with a default.
pub(crate) fn integer(value: &Bound<'_, PyAny>) -> PyResult<i128> {
    match value.extract::<i128>() {
        Err(wrong) if wrong.is_instance_of::<PyOverflowError>(value.py()) => {
            Ok(if value.lt(0)? { i128::MIN } else { i128::MAX })
        }
        found => found,
    }
}

/// A whole number within a range.
pub(crate) fn whole(argument: &str, value: impl Into<i128>, least: u64, most: u64) -> PyResult<u64> {
    let value = value.into();
    let found = u64::try_from(value).ok().filter(|value| (least..=most).contains(value));
    found.ok_or_else(|| error::input(format!("{argument} = {value}: allowed is {least} to {most}")))
}

/// A control period of a whole number of microseconds.
pub(crate) fn period(seconds: f64) -> PyResult<Period> {
    let micros = (seconds * 1e6).round();
    let is_whole = (seconds * 1e6 - micros).abs() < 1e-3;
    let period = (is_whole && (0.0..=1e6).contains(&micros)).then(|| Period::from_micros(micros as u32)).flatten();
    period.ok_or_else(|| {
        let most = f64::from(Period::MAX_MICROS) / 1e6;
        error::input(format!("period_s = {seconds}: allowed is 0.000001 to {most} s in whole microseconds"))
    })
}

/// The robot of a file, or the default robot.
pub(crate) fn robot(path: Option<&Path>) -> PyResult<RobotFile> {
    if let Some(path) = path {
        error::can_open(path)?;
    }
    RobotFile::read_or_default(path).map_err(|wrong| error::file(&wrong))
}
