//! The tracking of a follower, as columns over time and as a value of Python.

use cpg_core::entrainment::{FollowStatus, Lock, SensorFault};
use joint_units::Phase;
use pyo3::prelude::*;

use crate::arrays;

/// A phase in cycles, without rounding.
pub(crate) fn cycles(phase: Phase) -> f64 {
    f64::from(phase.0) / 4_294_967_296.0
}

/// The columns of a status over time.
#[derive(Default)]
pub(crate) struct Statuses {
    state: Vec<u8>,
    fault: Vec<u8>,
    phase_error: Vec<f32>,
    stride_s: Vec<f32>,
    confidence: Vec<f32>,
}

impl Statuses {
    pub(crate) fn push(&mut self, status: &FollowStatus) {
        let place = |found: Option<usize>| found.unwrap_or_default() as u8;
        self.state.push(place(Lock::ALL.iter().position(|state| *state == status.state)));
        // 0 is no fault.
        let fault = |fault| SensorFault::ALL.iter().position(|known| *known == fault).map(|place| place + 1);
        self.fault.push(place(status.fault.and_then(fault)));
        self.phase_error.push(status.phase_error.0);
        self.stride_s.push(status.stride_s);
        self.confidence.push(status.confidence);
    }

    /// State and fault as numbers and their names, then the other columns.
    pub(crate) fn columns<'py>(self, py: Python<'py>) -> [Bound<'py, PyAny>; 5] {
        [
            arrays::column(py, self.state),
            arrays::column(py, self.fault),
            arrays::column(py, self.phase_error),
            arrays::column(py, self.stride_s),
            arrays::column(py, self.confidence),
        ]
    }
}

/// Names of the states and of the faults, in the order of their numbers.
pub(crate) fn names() -> (Vec<&'static str>, Vec<&'static str>) {
    let faults = std::iter::once("").chain(SensorFault::ALL.iter().map(|fault| fault.name()));
    (Lock::ALL.iter().map(|state| state.name()).collect(), faults.collect())
}

/// A status as a `FollowStatus` of the Python part.
pub(crate) fn status<'py>(py: Python<'py>, status: &FollowStatus) -> PyResult<Bound<'py, PyAny>> {
    let FollowStatus { state, fault, phase_error, stride_s, confidence } = status;
    let fault = fault.map_or("", |fault| fault.name());
    arrays::result(py, "FollowStatus", (state.name(), fault, phase_error.0, *stride_s, *confidence))
}

impl Extend<FollowStatus> for Statuses {
    fn extend<T: IntoIterator<Item = FollowStatus>>(&mut self, iter: T) {
        iter.into_iter().for_each(|status| self.push(&status));
    }
}
