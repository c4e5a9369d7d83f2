//! `read`, `Recording` and `Conditioned`: recordings of a person's gait, as read and as repaired.

use footfall::file::recording::{self, ReadSettings, Recorded, SensorCalibration};
use gait_trace::clean::condition;
use gait_trace::format::angle_unit::AngleUnit;
use gait_trace::{Axis, Finding, LowPass, PositiveDirection, RawJoint, RawJoints, Rules};
use joint_units::Joint;
use pyo3::prelude::*;
use pyo3::types::PyType;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use crate::{arguments, arrays, error};

/// A recording of joint angles as its file has it: nothing is repaired, signs are those of the file.
///
/// Made by ``footfall.read`` or ``Recording.of_arrays``. Times are seconds, angles radians; columns are in the order of ``joints``.
/// ``condition()`` repairs it.
#[pyclass(frozen, module = "footfall")]
pub(crate) struct Recording {
    pub(crate) recorded: Recorded,
}

impl Recording {
    /// Reads a file.
    fn read(path: &Path, settings: &ReadSettings) -> PyResult<Self> {
        error::can_open(path)?;
        let recorded = recording::open(path).and_then(|mut content| content.parse(settings)).map_err(error::failure)?;
        match &recorded.joints {
            Ok(_) => Ok(Self { recorded }),
            Err(wrong) => Err(error::trace(wrong)),
        }
    }

    /// The joints of the file.
    pub(crate) fn raw(&self) -> PyResult<&RawJoints> {
        self.recorded.joints.as_ref().map_err(error::trace)
    }
}

/// What is asked about the conditioning of a recording.
pub(crate) struct Asked {
    pub(crate) low_pass: LowPass,
    pub(crate) knee_sign: Option<PositiveDirection>,
    pub(crate) hip_sign: Option<PositiveDirection>,
    pub(crate) stride_s: Option<f64>,
}

impl Asked {
    pub(crate) fn of(
        low_pass: LowPassArgument,
        knee_sign: Option<&str>,
        hip_sign: Option<&str>,
        stride_s: Option<f64>,
    ) -> PyResult<Self> {
        let low_pass = match low_pass {
            LowPassArgument::Hz(hz) => {
                LowPass::At(arguments::within("low_pass", hz, 1.0, 100.0, " Hz, 'customary' or 'off'")?)
            }
            LowPassArgument::Name(name) => {
                const NAMES: [(&str, LowPass); 2] = [("customary", LowPass::Customary), ("off", LowPass::Off)];
                let found = NAMES.into_iter().find(|(known, _)| *known == name);
                let refused = || error::input(format!("low_pass = '{name}': allowed is customary, off or 1 to 100 Hz"));
                found.ok_or_else(refused)?.1
            }
            LowPassArgument::Other(value) => {
                return Err(error::input(format!("low_pass = {value}: allowed is 'customary', 'off' or 1 to 100 Hz")));
            }
        };
        let direction = |argument: &str, sign: Option<&str>| {
            sign.map(|sign| arguments::one_of(argument, sign, PositiveDirection::ALL, PositiveDirection::name))
                .transpose()
        };
        let (knee_sign, hip_sign) = (direction("knee_sign", knee_sign)?, direction("hip_sign", hip_sign)?);
        let stride_s = stride_s.map(|stride| arguments::within("stride_s", stride, 0.2, 20.0, " s")).transpose()?;
        Ok(Self { low_pass, knee_sign, hip_sign, stride_s })
    }

    /// The rules, for a recording that may have been filtered before, and what to say about that.
    pub(crate) fn rules(&self, recorded: &Recorded) -> PyResult<(Rules, Option<String>)> {
        let (low_pass, note) = recorded.low_pass(self.low_pass).map_err(error::failure)?;
        let Self { knee_sign, hip_sign, stride_s, .. } = *self;
        Ok((Rules { low_pass, knee_sign, hip_sign, stride_s, ..Rules::default() }, note))
    }
}

/// A low-pass by its name or its corner frequency.
#[derive(FromPyObject)]
pub(crate) enum LowPassArgument {
    Hz(f64),
    Name(String),
    /// Something else, which is refused.
    Other(Py<PyAny>),
}

/// Columns of joints, one after the other, radians; rows are times.
fn table<'py>(py: Python<'py>, columns: &[&[f64]], rows: usize) -> PyResult<Bound<'py, PyAny>> {
    let values = (0..rows).flat_map(|row| columns.iter().map(move |column| column[row].to_radians())).collect();
    arrays::table(py, values, columns.len())
}

/// Findings as `Finding`s of the Python part; those that are warnings are issued as warnings of Python too.
pub(crate) fn findings<'py>(py: Python<'py>, findings: &[Finding]) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let of = |finding: &Finding| {
        let joint = finding.joint.map_or("", Joint::name);
        let fields =
            (finding.level().name(), error::in_python(finding.to_string()), joint, finding.from_s, finding.to_s);
        arrays::result(py, "Finding", fields)
    };
    findings.iter().map(of).collect()
}

#[pymethods]
impl Recording {
    /// A recording from arrays: times in s, shape (n,), and angles in ``unit`` (``rad`` or ``deg``), shape (n, k), a column for each of ``joints``.
    ///
    /// NaN is a missing value. ``name`` stands for the file in messages.
    #[classmethod]
    #[pyo3(signature = (time_s, angles, joints, *, unit = "rad", name = "arrays"))]
    fn of_arrays(
        _: &Bound<'_, PyType>,
        time_s: &Bound<'_, PyAny>,
        angles: &Bound<'_, PyAny>,
        joints: Vec<String>,
        unit: &str,
        name: &str,
    ) -> PyResult<Self> {
        let unit: AngleUnit = unit.parse().map_err(error::input)?;
        let (time_s, angles) =
            (arrays::given("time_s", time_s, None)?.values, arrays::given("angles", angles, Some("k"))?);
        let (rows, columns) = angles.shape;
        if rows != time_s.len() || columns != joints.len() {
            return Err(error::input(format!(
                "angles has the shape ({rows}, {columns}): allowed is ({}, {}), a row for each time and a column for each joint",
                time_s.len(),
                joints.len()
            )));
        }
        if let Some(row) = time_s.iter().position(|time| !time.is_finite()) {
            return Err(error::input(format!("time_s[{row}] = {}: allowed is a finite time in seconds", time_s[row])));
        }
        let is_beyond = |angle: &f64| unit == AngleUnit::Radians && angle.abs() > TAU;
        if let Some(place) = angles.values.iter().position(is_beyond) {
            let (row, column, angle) = (place / columns, place % columns, angles.values[place]);
            return Err(error::input(format!(
                "angles[{row}, {column}] = {angle} rad, more than a turn (wrong unit?): allowed is -{TAU:.4} to {TAU:.4} rad; unit='deg' reads degrees"
            )));
        }
        let mut found: [Option<RawJoint>; Joint::COUNT] = [const { None }; Joint::COUNT];
        for (column, name) in joints.iter().enumerate() {
            let place = &mut found[arguments::joint("joints", name)? as usize];
            if place.is_some() {
                return Err(error::input(format!("joints has {name} twice; allowed is each joint once")));
            }
            let in_degrees = |angle: &f64| if unit == AngleUnit::Radians { angle.to_degrees() } else { *angle };
            *place = Some(RawJoint::degrees(
                name.as_str(),
                (0..rows).map(|row| in_degrees(&angles.row(row)[column])).collect(),
            ));
        }
        let raw = RawJoints {
            file: name.into(),
            format: format!("arrays, {}", unit.words()),
            time_s,
            received: false,
            joints: found,
            notes: vec![],
            doubts: vec![],
        };
        let recorded = Recorded { name: name.into(), sha256: String::new(), joints: Ok(raw), conversion: None };
        Ok(Self { recorded })
    }

    /// Name of the file; no unit.
    #[getter]
    fn file(&self) -> &str {
        &self.recorded.name
    }

    /// SHA-256 of the file in hexadecimal digits; empty for arrays. No unit.
    #[getter]
    fn sha256(&self) -> &str {
        &self.recorded.sha256
    }

    /// Format of the file in words, with the unit that the file has.
    #[getter]
    fn format(&self) -> PyResult<&str> {
        Ok(&self.raw()?.format)
    }

    /// Decisions of the reader that the user should know, one sentence each, with their units.
    #[getter]
    fn notes(&self) -> PyResult<Vec<String>> {
        Ok(self.raw()?.notes.clone())
    }

    /// Names of the joints that the file has, in the order of the columns; no unit.
    #[getter]
    fn joints(&self) -> PyResult<Vec<&'static str>> {
        let raw = self.raw()?;
        Ok(Joint::ALL.into_iter().filter(|joint| raw.joints[*joint as usize].is_some()).map(Joint::name).collect())
    }

    /// Column of the file for each joint, with where its unit is from.
    #[getter]
    fn columns(&self) -> PyResult<BTreeMap<&'static str, (String, String)>> {
        let raw = self.raw()?;
        let column = |joint: Joint| {
            let found = raw.joints[joint as usize].as_ref()?;
            Some((joint.name(), (found.column.clone(), found.unit.to_string())))
        };
        Ok(Joint::ALL.into_iter().filter_map(column).collect())
    }

    /// Times, s, as in the file; float64 array of shape (n,).
    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(arrays::column(py, self.raw()?.time_s.clone()))
    }

    /// Angles, rad, with the signs of the file; float64 array of shape (n, joints), NaN where the file has no value.
    #[getter]
    fn angles_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let raw = self.raw()?;
        let columns: Vec<&[f64]> = raw.joints.iter().flatten().map(|joint| joint.angle_deg.as_slice()).collect();
        table(py, &columns, raw.time_s.len())
    }

    /// A structured array of shape (n,): fields ``time_s`` and, for each joint, ``left_hip_rad`` and so on; with ``unit='deg'``, ``left_hip_deg``.
    #[pyo3(signature = (*, unit = "rad"))]
    fn to_numpy<'py>(&self, py: Python<'py>, unit: &str) -> PyResult<Bound<'py, PyAny>> {
        arrays::result(py, "_structured", (self.time_s(py)?, self.angles_rad(py)?, self.joints()?, unit))
    }

    /// A pandas ``DataFrame`` with n rows, index ``time_s``, and the columns of ``to_numpy`` (unit in their names). It needs pandas.
    #[pyo3(signature = (*, unit = "rad"))]
    fn to_pandas<'py>(&self, py: Python<'py>, unit: &str) -> PyResult<Bound<'py, PyAny>> {
        arrays::result(py, "_frame", (self.to_numpy(py, unit)?,))
    }

    /// Repairs the recording: equal time steps (s), no gaps, no jumps, flexion positive. Returns a ``Conditioned``.
    ///
    /// ``low_pass``: ``off``, ``customary`` (zero-lag Butterworth, 6 Hz for walking, 12 Hz for running) or a corner frequency in Hz.
    /// ``knee_sign``: what the file counts as positive at the knees, ``flexion`` or ``extension``; by the angles if it is not given.
    /// ``hip_sign``: the same at the hips; as the format defines it, else by the shape of the strides, if it is not given. A sign that only the shape
    /// shows to be the other one is changed with a warning, and so is one assumed that nothing shows.
    /// ``stride_s``: duration of the stride, s, of a recording of one cycle. Defects that are warnings are issued as ``RecordingWarning``.
    #[pyo3(signature = (*, low_pass = LowPassArgument::Name("off".into()), knee_sign = None, hip_sign = None, stride_s = None))]
    fn condition(
        &self,
        py: Python<'_>,
        low_pass: LowPassArgument,
        knee_sign: Option<&str>,
        hip_sign: Option<&str>,
        stride_s: Option<f64>,
    ) -> PyResult<Conditioned> {
        let (rules, _) = Asked::of(low_pass, knee_sign, hip_sign, stride_s)?.rules(&self.recorded)?;
        let raw = self.raw()?;
        let conditioned = py.detach(|| condition::condition(raw, &rules)).map_err(error::input)?;
        arrays::result(py, "_warn", (findings(py, &conditioned.findings)?,))?;
        Ok(Conditioned { conditioned })
    }

    fn __repr__(&self) -> PyResult<String> {
        let raw = self.raw()?;
        Ok(format!("<footfall.Recording {}: {}, {} rows>", raw.file, raw.format, raw.time_s.len()))
    }
}

/// A recording that was repaired: equal time steps, no gaps, no jumps, flexion positive.
///
/// Times are seconds from the first row of the file, angles radians; columns are in the order of ``joints``.
#[pyclass(frozen, module = "footfall")]
pub(crate) struct Conditioned {
    conditioned: condition::Conditioned,
}

#[pymethods]
impl Conditioned {
    /// Names of the joints, in the order of the columns; no unit.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.conditioned.recording.channels().iter().map(|channel| channel.name().to_owned()).collect()
    }

    /// Times, s, from 0 at equal steps; float64 array of shape (n,).
    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::column(py, self.conditioned.recording.time_s().to_vec())
    }

    /// Angles, rad, flexion positive; float64 array of shape (n, joints).
    #[getter]
    fn angles_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let recording = &self.conditioned.recording;
        let columns: Vec<&[f64]> = recording.channels().iter().map(gait_trace::Channel::values).collect();
        table(py, &columns, recording.time_s().len())
    }

    /// Rows a second, Hz; rows a cycle if ``normalised_cycle``.
    #[getter]
    fn rate_hz(&self) -> f64 {
        self.conditioned.rate_hz
    }

    /// Whether the time is a fraction of one cycle and not seconds; no unit.
    #[getter]
    fn normalised_cycle(&self) -> bool {
        self.conditioned.normalised_cycle
    }

    /// What it rests on that flexion is positive, for each joint: ``named`` (by the caller), ``known`` (by the format or the angles), ``shape`` (of the
    /// strides), ``turned`` (changed by their shape) or ``assumed`` (nothing shows it); no unit.
    #[getter]
    fn signs(&self) -> BTreeMap<&'static str, &'static str> {
        let sign = |joint: Joint| Some((joint.name(), self.conditioned.signs[joint as usize]?.name()));
        Joint::ALL.into_iter().filter_map(sign).collect()
    }

    /// Spans that must not be used, s; list of (start, end). The angles are a straight line there.
    #[getter]
    fn unusable_s(&self) -> Vec<(f64, f64)> {
        self.conditioned.unusable.clone()
    }

    /// Defects that were found, with what was done: list of ``Finding`` with times in s.
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        findings(py, &self.conditioned.findings)
    }

    /// A structured array of shape (n,): fields ``time_s`` and, for each joint, ``left_hip_rad`` and so on; with ``unit='deg'``, ``left_hip_deg``.
    #[pyo3(signature = (*, unit = "rad"))]
    fn to_numpy<'py>(&self, py: Python<'py>, unit: &str) -> PyResult<Bound<'py, PyAny>> {
        arrays::result(py, "_structured", (self.time_s(py), self.angles_rad(py)?, self.joints(), unit))
    }

    /// A pandas ``DataFrame`` with n rows, index ``time_s``, and the columns of ``to_numpy`` (unit in their names). It needs pandas.
    #[pyo3(signature = (*, unit = "rad"))]
    fn to_pandas<'py>(&self, py: Python<'py>, unit: &str) -> PyResult<Bound<'py, PyAny>> {
        arrays::result(py, "_frame", (self.to_numpy(py, unit)?,))
    }

    fn __repr__(&self) -> String {
        let recording = &self.conditioned.recording;
        let (rows, joints) = (recording.time_s().len(), recording.channels().len());
        format!("<footfall.Conditioned {joints} joints, {rows} rows at {:.1} Hz>", self.conditioned.rate_hz)
    }
}

/// Reads a recording of any format that ``footfall check`` knows (C3D, OpenSim, CSV, TRC, Vicon, Visual3D, GCD, MVNX, MCAP, oscilloscopes)
/// and returns a ``Recording``: times in s, angles in rad, shape (n, joints).
///
/// ``columns``: a dictionary from a joint or ``time`` to its column, by name or by number from 1. ``unit``: unit of the angles where the file
/// does not state it, ``degrees`` or ``radians``. ``calibration``: a sensor file, for recordings of volts. ``rate_hz``: frames a second, for a
/// file that has no times. ``only``: rows of a CSV file to read, a dictionary from a column to its value. ``axis``: the component that is
/// flexion, ``x``, ``y`` or ``z``. ``topic``: topic of the joints of an MCAP file.
#[pyfunction]
#[pyo3(signature = (path, *, columns = None, unit = None, calibration = None, rate_hz = None, only = None, axis = None, topic = None))]
#[allow(clippy::too_many_arguments)] // They are keywords in Python.
pub(crate) fn read(
    py: Python<'_>,
    path: PathBuf,
    columns: Option<BTreeMap<String, String>>,
    unit: Option<&str>,
    calibration: Option<PathBuf>,
    rate_hz: Option<f64>,
    only: Option<BTreeMap<String, String>>,
    axis: Option<&str>,
    topic: Option<String>,
) -> PyResult<Recording> {
    let calibration = calibration.map(|path| {
        error::can_open(&path)?;
        SensorCalibration::read(path).map_err(error::failure)
    });
    let rows = |(column, value): (String, String)| format!("{column}={value}").parse().map_err(error::input);
    let settings = ReadSettings {
        map: columns.unwrap_or_default().into_iter().map(|(joint, column)| format!("{joint}={column}")).collect(),
        unit: unit.map(|unit| unit.parse().map_err(error::input)).transpose()?,
        low_pass: LowPass::Off,
        calibration: calibration.transpose()?,
        rate_hz: rate_hz.map(|rate| arguments::within("rate_hz", rate, 0.1, 1e6, " Hz")).transpose()?,
        only: only.unwrap_or_default().into_iter().map(rows).collect::<PyResult<_>>()?,
        axis: axis.map(|axis| arguments::one_of("axis", axis, Axis::ALL, Axis::name)).transpose()?,
        topic,
        knee_sign: None,
        hip_sign: None,
        stride_s: None,
        mirror: false,
        own_cycles: false,
        sideless: None,
    };
    py.detach(|| Recording::read(&path, &settings))
}

/// A recording read without options.
pub(crate) fn of_path(py: Python<'_>, path: PathBuf) -> PyResult<Recording> {
    read(py, path, None, None, None, None, None, None, None)
}
