//! `certify` and `Certificate`: what was measured on a generator, and the reasons why it is refused.

use generator_file::certificate::{CertificateStatus, Verdict, certify_subject};
use generator_file::network_certificate::certify_network;
use generator_file::network_file::HostGenerator;
use generator_file::subject::Subject;
use joint_loop::LoopConfig;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use serde::Serialize;
use serde_json::Value;
use std::path::PathBuf;

use crate::generator::{Definition, Generator};
use crate::{arguments, arrays, error, interrupt};

/// The certificate of a generator: what was measured, and every condition that is not met.
///
/// It has no truth value: ``reasons`` says why a generator is refused, ``walks_why_not`` why it does not walk on the robot. Units are in the names
/// of ``as_dict()``: degrees, seconds, Hz, milliseconds.
#[pyclass(frozen, module = "footfall")]
pub(crate) struct Certificate {
    measured: Value,
    status: CertificateStatus,
    reasons: Vec<Verdict>,
    walks: Option<(bool, Option<String>)>,
}

impl Certificate {
    pub(crate) fn of(certificate: &generator_file::certificate::Certificate) -> PyResult<Self> {
        let drive = &certificate.drive;
        Ok(Self {
            walks: Some((drive.walks, drive.why_not.clone())),
            ..Self::measured(certificate, certificate.status, &certificate.reasons)?
        })
    }

    fn measured(certificate: &impl Serialize, status: CertificateStatus, reasons: &[Verdict]) -> PyResult<Self> {
        let measured = serde_json::to_value(certificate).map_err(error::run)?;
        Ok(Self { measured, status, reasons: reasons.to_vec(), walks: None })
    }
}

/// The name of a status, as in the JSON of the program.
fn name(status: CertificateStatus) -> PyResult<String> {
    let name = serde_json::to_value(status).map_err(error::run)?;
    Ok(name.as_str().unwrap_or_default().to_owned())
}

#[pymethods]
impl Certificate {
    /// ``accepted``, or the first condition that is not met, such as ``kicks_do_not_return`` or ``beyond_limits``; no unit.
    #[getter]
    fn status(&self) -> PyResult<String> {
        name(self.status)
    }

    /// Every condition that is not met: list of ``Reason``, with numbers and units in its text. Empty if it is accepted.
    #[getter]
    fn reasons<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let reason = |(status, why): &Verdict| {
            arrays::result(py, "Reason", (name(*status)?, status.words(), why.clone().unwrap_or_default()))
        };
        self.reasons.iter().map(reason).collect()
    }

    /// Whether it walks in the control loop of the robot; ``None`` for a network of six or eight joints, for which there is no robot. No unit.
    #[getter]
    fn walks(&self) -> Option<bool> {
        self.walks.as_ref().map(|(walks, _)| *walks)
    }

    /// Why it does not walk, with numbers and units; ``None`` if it walks.
    #[getter]
    fn walks_why_not(&self) -> Option<&str> {
        self.walks.as_ref().and_then(|(_, why)| why.as_deref())
    }

    /// Stride period of its orbit, s; 0 without an orbit.
    #[getter]
    fn period_s(&self) -> f64 {
        self.measured["period_s"].as_f64().unwrap_or_default()
    }

    /// Everything that was measured, as ``footfall certify --json`` prints it; each key has its unit in its name.
    fn as_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::plain(py, &self.measured)
    }

    fn __bool__(&self) -> PyResult<bool> {
        Err(PyTypeError::new_err(
            "a certificate is neither true nor false; read its status, its reasons and whether it walks",
        ))
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("<footfall.Certificate {}, {} reasons>", self.status()?, self.reasons.len()))
    }
}

/// What can be certified: a generator, or the name of a default, a gait or a model.
#[derive(FromPyObject)]
pub(crate) enum Certified<'py> {
    Generator(PyRef<'py, Generator>),
    Name(String),
}

impl Certified<'_> {
    fn definition(&self) -> PyResult<Result<Subject, Box<HostGenerator>>> {
        match self {
            Self::Name(name) => Subject::named(name).map(Ok).ok_or_else(|| {
                let names: Vec<&str> = Subject::names().into_iter().map(|(name, _)| name).collect();
                error::input(format!("generator = '{name}': allowed is a Generator, or one of {}", names.join(", ")))
            }),
            Self::Generator(generator) => Ok(match &generator.definition {
                Definition::File(HostGenerator::FourJoints(file)) => Ok(Subject::Set(file.set.clone())),
                Definition::File(network) => Err(Box::new(network.clone())),
                Definition::Gait(gait, speed) if *speed == 1.0 => Ok(Subject::Gait(*gait)),
                Definition::Gait(gait, speed) => {
                    return Err(error::input(format!(
                        "the gait {} at speed {speed}: allowed is a gait at speed 1, or the generator of a file",
                        gait.name()
                    )));
                }
            }),
        }
    }
}

/// Measures a generator and returns a ``Certificate``: orbit, return after kicks, limits and rates (deg, deg/s), walk in the control loop.
///
/// ``generator`` is a ``Generator`` or the name of a default, gait or model. ``robot``: a robot file; the default robot if it is not given.
/// ``starts``: number of random starts, 1 to 100000. An interrupt (Ctrl-C) ends it within about 50 ms and changes nothing; its computation ends with
/// its stage.
#[pyfunction]
#[pyo3(signature = (generator, *, robot = None, starts = 1000))]
pub(crate) fn certify(
    py: Python<'_>,
    generator: Certified<'_>,
    robot: Option<PathBuf>,
    #[pyo3(from_py_with = arguments::integer)] starts: i128,
) -> PyResult<Certificate> {
    let starts = arguments::whole("starts", starts, 1, 100_000)? as u32;
    match generator.definition()? {
        Ok(subject) => {
            let robot = LoopConfig::of(&arguments::robot(robot.as_deref())?.robot);
            let certificate = interrupt::beside(py, move |stage| certify_subject(&subject, starts, &robot, stage))?;
            Certificate::of(&certificate.map_err(error::input)?)
        }
        Err(network) => {
            let HostGenerator::Network(file) = *network else { return Err(error::input("no generator of a file")) };
            if robot.is_some() {
                return Err(error::input(format!(
                    "robot with a network of {} joints, which no robot has; allowed is it with a generator of four joints",
                    file.set.joints.len()
                )));
            }
            let certificate = interrupt::beside(py, move |stage| certify_network(&file.set, starts, stage))?;
            let certificate = certificate.map_err(error::input)?;
            Certificate::measured(&certificate, certificate.status, &certificate.reasons)
        }
    }
}
