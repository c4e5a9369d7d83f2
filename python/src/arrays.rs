//! Arrays of numpy, and the result types of the Python part (`footfall/_results.py`).

use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::call::PyCallArgs;
use pyo3::prelude::*;
use serde::Serialize;

use crate::error;

/// An array of one dimension.
pub(crate) fn column<T: Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyAny> {
    PyArray1::from_vec(py, values).into_any()
}

/// An array of rows of `width` values.
pub(crate) fn table<T: Element>(py: Python<'_>, values: Vec<T>, width: usize) -> PyResult<Bound<'_, PyAny>> {
    let rows = values.len() / width.max(1);
    Ok(PyArray1::from_vec(py, values).reshape([rows, width])?.into_any())
}

/// A value of a result type of the Python part.
pub(crate) fn result<'py>(py: Python<'py>, name: &str, fields: impl PyCallArgs<'py>) -> PyResult<Bound<'py, PyAny>> {
    py.import("footfall._results")?.getattr(name)?.call1(fields)
}

/// Plain data as dictionaries, lists, numbers and texts.
pub(crate) fn plain<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(error::run)?;
    py.import("json")?.getattr("loads")?.call1((text,))
}
