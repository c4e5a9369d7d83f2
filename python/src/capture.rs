//! `read_capture` and `Capture`: every tick of a board, as `footfall record` writes it, and its replay.

use footfall::command::replay::{Comparison, loop_of_boot};
use footfall::file::capture::recorded::{self, Recorded, RecordedError, Tick};
use joint_units::Joint;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::joint_loop::JointLoop;
use crate::{arrays, error};

/// A recording of a board: the inputs of every tick of its control loop, and the outputs that are known (setpoints in deg, pulses in us).
#[pyclass(frozen, module = "footfall")]
pub(crate) struct Capture {
    recorded: Recorded,
    ticks: Vec<Tick>,
}

#[pymethods]
impl Capture {
    /// Number of ticks (of 1 ms each).
    fn __len__(&self) -> usize {
        self.ticks.len()
    }

    /// Number of boots of the board in the capture; no unit.
    #[getter]
    fn boots(&self) -> usize {
        self.recorded.boots.len()
    }

    /// Whether the capture has an end: its recorder was not stopped. No unit.
    #[getter]
    fn finished(&self) -> bool {
        self.recorded.finished
    }

    /// Kind of the generator that the board ran; no unit.
    #[getter]
    fn generator_kind(&self) -> &'static str {
        self.recorded.parameters.generator.name()
    }

    /// Joints of the sensors, in the order of the channels; no unit.
    #[getter]
    fn sensor_joints(&self) -> Vec<&'static str> {
        self.recorded.parameters.sensors.iter().map(|sensor| sensor.joint.name()).collect()
    }

    /// The inputs of every tick, as ``Inputs``: columns of shape (n,), and codes of shape (n, sensors); ``elapsed`` in ms.
    fn inputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let channels = self.recorded.parameters.sensors.count();
        let ticks = &self.ticks;
        let code = |tick: &Tick, channel: usize| tick.call.codes.get(channel).copied().unwrap_or_default();
        let codes: Vec<u16> = ticks.iter().flat_map(|tick| (0..channels).map(|channel| code(tick, channel))).collect();
        let flag = |of: fn(&Tick) -> bool| arrays::column(py, ticks.iter().map(of).collect::<Vec<bool>>());
        let request = |(row, tick): (usize, &Tick)| tick.call.request.map(|request| (row, request.to_string()));
        let measured = |(row, tick): (usize, &Tick)| tick.call.watchdog_hz.map(|hz| (row, hz));
        let watchdog_hz: BTreeMap<usize, u32> = ticks.iter().enumerate().filter_map(measured).collect();
        let requests: BTreeMap<usize, String> = ticks.iter().enumerate().filter_map(request).collect();
        let fields = [
            arrays::column(py, ticks.iter().map(|tick| tick.boot).collect()),
            arrays::column(py, ticks.iter().map(|tick| tick.tick).collect()),
            arrays::column(py, ticks.iter().map(|tick| tick.call.elapsed).collect()),
            arrays::table(py, codes, channels)?,
            arrays::column(py, ticks.iter().map(|tick| tick.call.reference).collect()),
            flag(|tick| tick.call.flags.button()),
            flag(|tick| tick.call.flags.foot()),
            flag(|tick| tick.call.flags.late()),
            arrays::column(py, ticks.iter().map(|tick| tick.call.flags.faults().bits()).collect()),
            watchdog_hz.into_pyobject(py)?.into_any(),
            arrays::column(py, ticks.iter().map(|tick| tick.call.flags.debugger() as u8).collect()),
            flag(|tick| tick.call.flags.program_unproven()),
            requests.into_pyobject(py)?.into_any(),
        ];
        arrays::result(py, "Inputs", PyTuple::new(py, fields)?)
    }

    /// The outputs of every tick, as ``Outputs``: ``known`` of shape (n,), setpoints in deg (float32, NaN where not known) and pulses in us, both of
    /// shape (n, 4).
    fn outputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let of = |tick: &Tick| tick.output.as_ref().map_or([f32::NAN; Joint::COUNT], |output| output.setpoints_deg);
        let setpoints: Vec<f32> = self.ticks.iter().flat_map(of).collect();
        let of = |tick: &Tick| tick.output.as_ref().map_or([0; Joint::COUNT], |output| output.pulses_us);
        let pulses: Vec<u16> = self.ticks.iter().flat_map(of).collect();
        let states: Vec<&str> =
            self.ticks.iter().map(|tick| tick.output.as_ref().map_or("", |output| output.state.as_str())).collect();
        let fields = (
            arrays::column(py, self.ticks.iter().map(|tick| tick.output.is_some()).collect()),
            states,
            arrays::table(py, setpoints, Joint::COUNT)?,
            arrays::table(py, pulses, Joint::COUNT)?,
        );
        arrays::result(py, "Outputs", fields)
    }

    /// The control loop of a boot of the board (counted from 1), before its first tick of 1 ms: same generator, sensors, robot and chip.
    #[pyo3(signature = (boot = 1))]
    fn joint_loop(&self, boot: u32) -> PyResult<JointLoop> {
        let joints = loop_of_boot(&self.recorded, boot).map_err(|why| error::run(format!("boot {boot}: {why}")))?;
        Ok(JointLoop::new(joints, self.recorded.parameters.sensors.count()))
    }

    /// Runs the control loop with the inputs and compares every tick (1 ms) bit for bit: a dictionary as ``footfall replay --json`` prints it.
    fn replay<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = py.detach(|| {
            let mut comparison = Comparison::default();
            self.ticks.iter().for_each(|tick| comparison.take(&self.recorded, tick));
            comparison.to_json(self.recorded.finished)
        });
        arrays::plain(py, &found)
    }

    fn __repr__(&self) -> String {
        format!("<footfall.Capture {} ticks, {} boots>", self.ticks.len(), self.recorded.boots.len())
    }
}

/// Reads a recording of a board (CSV with the JSON file beside it, or MCAP) and returns a ``Capture`` of n ticks of 1 ms.
#[pyfunction]
pub(crate) fn read_capture(py: Python<'_>, path: PathBuf) -> PyResult<Capture> {
    error::can_open(&path)?;
    let mut ticks = Vec::new();
    let recorded = py.detach(|| recorded::read(&path, |_, tick| ticks.push(tick)));
    let recorded = recorded.map_err(|wrong: RecordedError| error::input(wrong))?;
    Ok(Capture { recorded, ticks })
}
