//! Exceptions of Python, with the words of the errors of the crates.
//!
//! `InputError`, which is also a `ValueError`, for wrong values and wrong contents of files; `OSError` for files that cannot be read;
//! `FootfallError` where a correct input gives no result.

use std::fmt::Display;
use std::io;
use std::path::Path;

use footfall::failure::Failure;
use gait_trace::{Fault, TraceError};
use generator_file::toml_file::FileError;
use pyo3::PyErr;

pyo3::import_exception!(footfall._errors, FootfallError);
pyo3::import_exception!(footfall._errors, InputError);

/// Options of the program that its errors name, and what Python has for them.
const OPTIONS: [(&str, &str); 10] = [
    ("--axis", "axis"),
    ("--calibration", "calibration"),
    ("--hip-sign", "hip_sign"),
    ("--knee-sign", "knee_sign"),
    ("--map", "columns"),
    ("--rate", "rate_hz"),
    ("--stride-time", "stride_s"),
    ("--topic", "topic"),
    ("--unit", "unit"),
    ("--where", "only"),
];

/// The words of the program, and which arguments its options are in Python.
pub(crate) fn in_python(text: String) -> String {
    let named = OPTIONS.into_iter().filter(|(option, _)| text.contains(option));
    let named: Vec<String> = named.map(|(option, argument)| format!("{option} is {argument}")).collect();
    if named.is_empty() { text } else { format!("{text} (arguments in Python: {})", named.join(", ")) }
}

/// A wrong value, or the wrong content of a file.
pub(crate) fn input(error: impl Display) -> PyErr {
    InputError::new_err(in_python(error.to_string()))
}

/// A correct input without a result.
pub(crate) fn run(error: impl Display) -> PyErr {
    FootfallError::new_err(error.to_string())
}

/// What is wrong with a generator file, a robot file or a sensor file.
pub(crate) fn file(error: &FileError) -> PyErr {
    input(error)
}

/// What is wrong with a recording.
pub(crate) fn trace(error: &TraceError) -> PyErr {
    match &*error.fault {
        Fault::Io(why) => io::Error::new(why.kind(), error.to_string()).into(),
        _ => input(error),
    }
}

/// Why a command of the program `footfall` would have failed.
pub(crate) fn failure(failure: Failure) -> PyErr {
    match failure {
        Failure::Input(text) => input(text),
        Failure::Run(text) => FootfallError::new_err(in_python(text)),
    }
}

/// Refuses a file that cannot be opened, as an `OSError` of the kind that Python has for it.
pub(crate) fn can_open(path: &Path) -> Result<(), PyErr> {
    match std::fs::File::open(path) {
        Ok(_) => Ok(()),
        Err(error) => Err(io::Error::new(error.kind(), format!("{}: cannot be read: {error}", path.display())).into()),
    }
}

/// Refuses a file that cannot be written.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), PyErr> {
    std::fs::write(path, text)
        .map_err(|error| io::Error::new(error.kind(), format!("{}: cannot be written: {error}", path.display())).into())
}
