//! `Gate`: the limits of a robot file, as the control loop of a board applies them.

use joint_loop::GateState;
use joint_units::{Joint, Period, Radians};
use pyo3::prelude::*;
use std::path::PathBuf;

use crate::{arguments, arrays, error};

/// The limits that a board puts on every setpoint, bit for bit: range (rad), pose envelope (rad), rate (rad/s) and acceleration (rad/s^2) of the joints.
///
/// ``robot``: a robot file; the default robot without it. It begins at rest in the park pose.
#[pyclass(module = "footfall")]
pub(crate) struct Gate {
    gate: joint_loop::Gate,
    state: GateState,
}

#[pymethods]
impl Gate {
    #[new]
    #[pyo3(signature = (robot = None))]
    fn build(robot: Option<PathBuf>) -> PyResult<Self> {
        let robot = arguments::robot(robot.as_deref())?.robot;
        let gate = joint_loop::Gate::build(&robot.gate, Period::MILLISECOND).map_err(error::input)?;
        let state = gate
            .rest(robot.park)
            .ok_or_else(|| error::input("park pose: allowed is one within range and pose envelope"))?;
        Ok(Self { gate, state })
    }

    /// The setpoints (rad, shape (n, 4)) of target angles (rad, shape (n, 4)), one row a millisecond, and the limits that acted in each (bits 0 to 3:
    /// range, pose, rate, acceleration; shape (n,), no unit). It goes on from the last row of the call before.
    fn limit<'py>(
        &mut self,
        py: Python<'py>,
        targets_rad: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let targets = arrays::given("targets_rad", targets_rad, Some("4"))?;
        let (rows, columns) = targets.shape;
        if columns != Joint::COUNT {
            return Err(error::input(format!(
                "targets_rad has the shape ({rows}, {columns}): allowed is (n, {}), a column for each joint",
                Joint::COUNT
            )));
        }
        let (mut setpoints, mut limited) = (Vec::with_capacity(targets.values.len()), Vec::with_capacity(rows));
        let mut state = self.state;
        for row in 0..rows {
            let mut pose = [Radians(0.0); Joint::COUNT];
            pose.iter_mut().zip(targets.row(row)).for_each(|(angle, value)| *angle = Radians(*value as f32));
            let (found, status) = self.gate.limit(&mut state, pose).map_err(|wrong| {
                error::input(format!(
                    "targets_rad of row {row}, {}: allowed is a finite number of radians",
                    wrong.joint.name()
                ))
            })?;
            setpoints.extend(found.map(|angle| angle.0));
            limited.push(status.bits());
        }
        self.state = state;
        Ok((arrays::table(py, setpoints, Joint::COUNT)?, arrays::column(py, limited)))
    }
}
