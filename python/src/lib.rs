//! The native part of the Python package `footfall`: the crates of this workspace, with numpy arrays and Python exceptions.
//!
//! | module | what Python gets from it |
//! |---|---|
//! | `generator` | `Generator`: generators of files, gaits by name, followers |
//! | `stepped` | generators of four, six and eight joints behind one trait |
//! | `tracking` | the status of a follower |
//! | `recording` | `read`, `Recording`, `Conditioned`: recordings of gait |
//! | `fit` | `fit`, `Fit` |
//! | `certificate` | `certify`, `Certificate` |
//! | `joint_loop` | `JointLoop`: the control loop of a board |
//! | `capture` | `read_capture`, `Capture`: recordings of a board, and their replay |
//! | `gate` | `Gate`: the limits of every setpoint |
//! | `servo` | `Servo`: a hobby servo under load; servo maps of robots, volts of sensors |
//! | `interrupt` | Ctrl-C during long calls |
//! | `arguments` | checks of arguments, with what is allowed |
//! | `arrays` | arrays of numpy, and the result types of the Python part |
//! | `error` | exceptions with the words of the errors of the crates |

mod arguments;
mod arrays;
mod capture;
mod certificate;
mod error;
mod fit;
mod gate;
mod generator;
mod interrupt;
mod joint_loop;
mod recording;
mod servo;
mod stepped;
mod tracking;

use pyo3::prelude::*;

/// The native part of `footfall`; use the package.
#[pymodule]
mod _footfall {
    #[pymodule_export]
    use super::capture::{Capture, read_capture};
    #[pymodule_export]
    use super::certificate::{Certificate, certify};
    #[pymodule_export]
    use super::fit::{Fit, fit};
    #[pymodule_export]
    use super::gate::Gate;
    #[pymodule_export]
    use super::generator::{Generator, gaits};
    #[pymodule_export]
    use super::joint_loop::JointLoop;
    #[pymodule_export]
    use super::recording::{Conditioned, Recording, read};
    #[pymodule_export]
    use super::servo::{Servo, robot, sensor_volts, servos};
    use joint_loop::store::{generator_record, robot_record, sensor_record};
    use pyo3::prelude::*;
    use pyo3::types::PyBytes;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        // Makes `numpy` load its array interface now: it cannot be loaded while an interrupt waits.
        super::arrays::column(module.py(), Vec::<f64>::new());
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        // By which `VirtualBoard` knows flash records.
        let magic =
            [("generator", generator_record::MAGIC), ("sensors", sensor_record::MAGIC), ("robot", robot_record::MAGIC)];
        let magic: std::collections::BTreeMap<&str, Bound<'_, PyBytes>> =
            magic.into_iter().map(|(name, word)| (name, PyBytes::new(module.py(), &word))).collect();
        module.add("_RECORD_MAGIC", magic)?;
        module.add("JOINTS", joint_units::Joint::ALL.map(joint_units::Joint::name))
    }
}
