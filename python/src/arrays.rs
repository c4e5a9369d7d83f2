//! Arrays of numpy, and the result types of the Python part (`footfall/_results.py`).

use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray1};
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

/// An array that was given, as numbers in the order of its rows, and its shape.
pub(crate) struct Given {
    /// The values, row by row.
    pub(crate) values: Vec<f64>,
    /// Number of rows and of columns; one column for an array of one dimension.
    pub(crate) shape: (usize, usize),
}

impl Given {
    /// The values of a row.
    pub(crate) fn row(&self, row: usize) -> &[f64] {
        let width = self.shape.1;
        &self.values[row * width..(row + 1) * width]
    }
}

/// An argument as an array of numbers of one dimension, or of two where `columns` says what they are.
///
/// # Errors
/// It holds something else than numbers, or has another number of dimensions; the error has its name and what is allowed.
pub(crate) fn given(argument: &str, value: &Bound<'_, PyAny>, columns: Option<&str>) -> PyResult<Given> {
    let py = value.py();
    let allowed = columns.map_or("(n,)".to_owned(), |columns| format!("(n, {columns})"));
    let refused = |what: String| error::input(format!("{argument} {what}: allowed are numbers, shape {allowed}"));
    let array = py.import("numpy")?.call_method1("asarray", (value,));
    let array = array.map_err(|wrong| refused(format!("is no array ({})", wrong.value(py))))?;
    let (kind, shape) = (array.getattr("dtype")?.getattr("kind")?, array.getattr("shape")?);
    let (kind, shape): (String, Vec<usize>) = (kind.extract()?, shape.extract()?);
    if !matches!(kind.as_str(), "b" | "i" | "u" | "f" | "O") {
        return Err(refused(format!("holds {}", array.getattr("dtype")?)));
    }
    let shape = match (shape.as_slice(), columns) {
        ([rows], None) => (*rows, 1),
        ([rows, width], Some(_)) => (*rows, *width),
        _ => {
            let shape = array.getattr("shape")?;
            return Err(error::input(format!("{argument} has the shape {shape}: allowed is {allowed}")));
        }
    };
    let flat = array.call_method1("astype", ("float64",));
    let flat = flat.map_err(|wrong| refused(format!("holds something else ({})", wrong.value(py))))?;
    let flat: PyReadonlyArray1<'_, f64> = flat.call_method0("ravel")?.extract()?;
    Ok(Given { values: flat.as_array().to_vec(), shape })
}

/// Plain data as dictionaries, lists, numbers and texts.
pub(crate) fn plain<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(error::run)?;
    py.import("json")?.getattr("loads")?.call1((text,))
}
