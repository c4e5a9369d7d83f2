//! `Servo`: a hobby servo under load; `robot` and `sensor_volts`: what a simulated body needs of the robot's file and of a sensor's calibration.

use footfall::options::sensors::SensorArgument;
use joint_loop::Direction;
use joint_units::{Joint, Radians};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use servo_model::{LoadSheet, LoadedServo};
use std::path::PathBuf;

use crate::{arguments, arrays, error};

/// A hobby servo under load: it takes pulses (us) and gives the torque (N m) of its shaft, at the angle and the speed that a body gives the shaft.
///
/// ``name``: one of ``footfall.servos()``. ``supply_v``: V, within the data sheet; 0 is none. ``us_per_rad``: change of the pulse for one radian of
/// the shaft, 100 to 2000. ``band_deg``: error at which the motor gets the whole supply, 0.5 to 45 deg. ``stall_factor``: of this one's stall torque
/// to that of the data sheet, 0.1 to 2. The shaft's angle is 0 at 1500 us and grows with the pulse. Simulation: nothing was measured on a servo.
#[pyclass(module = "footfall")]
pub(crate) struct Servo {
    sheet: LoadSheet,
    servo: LoadedServo,
    supply_v: f64,
    /// End of the last pulse since the supply was switched on, s.
    last_s: f64,
}

#[pymethods]
impl Servo {
    #[new]
    #[pyo3(signature = (name, *, supply_v, us_per_rad = 2_000.0 / std::f64::consts::PI, band_deg = 5.0, stall_factor = 1.0))]
    fn build(name: &str, supply_v: f64, us_per_rad: f64, band_deg: f64, stall_factor: f64) -> PyResult<Self> {
        let mut sheet = *arguments::one_of("name", name, LoadSheet::ALL, |sheet| sheet.name)?;
        let us_per_rad = arguments::within("us_per_rad", us_per_rad, 100.0, 2_000.0, " us/rad")?;
        sheet.band_rad = arguments::within("band_deg", band_deg, 0.5, 45.0, " deg")?.to_radians();
        let factor = arguments::within("stall_factor", stall_factor, 0.1, 2.0, "")?;
        sheet.points.iter_mut().for_each(|point| point.stall_nm *= factor);
        let mut built =
            Self { sheet, servo: LoadedServo::new(&sheet, us_per_rad), supply_v: 0.0, last_s: f64::NEG_INFINITY };
        built.set_supply(supply_v)?;
        Ok(built)
    }

    /// Switches the supply, V; at 0 V the servo has no torque and forgets its last pulse.
    fn set_supply(&mut self, volts: f64) -> PyResult<()> {
        self.servo.set_supply(volts).map_err(error::input)?;
        self.supply_v = volts;
        if volts == 0.0 {
            self.last_s = f64::NEG_INFINITY;
        }
        Ok(())
    }

    /// Takes a pulse of a width (us) that ends at a time (s), not before that of the pulse before. A width that the servo does not accept changes nothing.
    fn pulse(&mut self, time_s: f64, us: f64) -> PyResult<()> {
        let (time_s, us) = (finite("time_s", time_s, "s")?, finite("us", us, "us")?);
        if time_s < self.last_s {
            let last_s = self.last_s;
            return Err(error::input(format!(
                "time_s = {time_s}: allowed is {last_s} s or later, the end of the pulse before; set_supply(0.0) forgets it"
            )));
        }
        self.last_s = time_s;
        self.servo.pulse(time_s, us);
        Ok(())
    }

    /// Torque of the motor at the shaft, N m, positive towards longer pulses, at a time (s), an angle (rad) and a speed (rad/s) of the shaft.
    fn torque(&self, time_s: f64, angle_rad: f64, speed_rad_s: f64) -> PyResult<f64> {
        let (time_s, angle_rad) = (finite("time_s", time_s, "s")?, finite("angle_rad", angle_rad, "rad")?);
        Ok(self.servo.torque(time_s, angle_rad, finite("speed_rad_s", speed_rad_s, "rad/s")?))
    }

    /// Name of the servo; no unit.
    #[getter]
    fn name(&self) -> &str {
        self.sheet.name
    }

    /// Supply, V.
    #[getter]
    fn supply_v(&self) -> f64 {
        self.supply_v
    }

    /// Torque at speed 0 with this supply, N m; 0 without supply.
    #[getter]
    fn stall_nm(&self) -> f64 {
        self.sheet.strength(self.supply_v).map_or(0.0, |strength| strength.stall_nm)
    }

    /// Speed at torque 0 with this supply, rad/s; 0 without supply.
    #[getter]
    fn no_load_rad_s(&self) -> f64 {
        self.sheet.strength(self.supply_v).map_or(0.0, |strength| strength.no_load_rad_s)
    }

    /// Inertia of rotor and gear at the shaft, kg m^2; assumed, no data sheet has it.
    #[getter]
    fn rotor_kg_m2(&self) -> f64 {
        self.sheet.rotor_kg_m2
    }

    /// Friction of the gear at the shaft, N m; assumed, no data sheet has it.
    #[getter]
    fn friction_nm(&self) -> f64 {
        self.sheet.friction_nm
    }

    /// Least and highest supply of the data sheet, V.
    #[getter]
    fn supply_range_v(&self) -> (f64, f64) {
        (self.sheet.points[0].volts, self.sheet.points[1].volts)
    }
}

/// A finite number.
fn finite(argument: &str, value: f64, unit: &str) -> PyResult<f64> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(error::input(format!("{argument} = {value}: allowed is a finite number of {unit}")))
    }
}

/// Names of the modelled servos under load, for ``Servo``; no unit.
#[pyfunction]
pub(crate) fn servos() -> Vec<&'static str> {
    LoadSheet::ALL.iter().map(|sheet| sheet.name).collect()
}

/// Servo map and limits of each joint of a robot file, or of the default robot: a dictionary from the joint to a dictionary.
///
/// ``neutral_us`` and ``at_neutral_rad``: a pulse (us) and the joint's angle there (rad). ``us_per_rad``: change of the pulse for one radian of the
/// joint, negative for a mirrored servo. ``least_rad``, ``most_rad``, ``park_rad``: range and park pose, rad.
/// ``feedback``: share of the joint's distance to its last setpoint that is added to its next target, no unit; 0 without feedback.
#[pyfunction]
#[pyo3(signature = (path = None))]
pub(crate) fn robot(py: Python<'_>, path: Option<PathBuf>) -> PyResult<Bound<'_, PyDict>> {
    let robot = arguments::robot(path.as_deref())?.robot;
    let all = PyDict::new(py);
    for joint in Joint::ALL {
        let (servo, range) = (robot.servos[joint as usize], robot.gate.range[joint as usize]);
        let sign = if servo.direction == Direction::Mirrored { -1.0 } else { 1.0 };
        let one = PyDict::new(py);
        one.set_item("neutral_us", servo.neutral.0)?;
        one.set_item("at_neutral_rad", servo.angle_at_neutral.0)?;
        one.set_item("us_per_rad", sign * servo.micros_per_radian)?;
        one.set_item("least_rad", range.least.0)?;
        one.set_item("most_rad", range.most.0)?;
        one.set_item("park_rad", robot.park[joint as usize].0)?;
        one.set_item("feedback", robot.feedback[joint as usize])?;
        all.set_item(joint.name(), one)?;
    }
    Ok(all)
}

/// Volts (V, at the sensor) of a sensor at angles (rad), shape (n,): the inverse of its calibration. An angle beyond the table has the volts of its
/// end.
///
/// ``calibration``: a sensor file; without it, the published curve.
#[pyfunction]
#[pyo3(signature = (angles_rad, *, calibration = None))]
pub(crate) fn sensor_volts<'py>(
    py: Python<'py>,
    angles_rad: &Bound<'py, PyAny>,
    calibration: Option<PathBuf>,
) -> PyResult<Bound<'py, PyAny>> {
    calibration.as_deref().map_or(Ok(()), error::can_open)?;
    let sensors =
        SensorArgument::read_all(&[SensorArgument { joint: Joint::LeftHip, calibration }]).map_err(error::failure)?;
    let Some(sensor) = sensors.iter().next() else { return Ok(arrays::column(py, Vec::<f64>::new())) };
    let (least, most) = sensor.calibration.span();
    let volts = |angle: &f64| {
        if !angle.is_finite() {
            return Err(error::input(format!("angles_rad = {angle}: allowed is a finite number of radians")));
        }
        let within = Radians((*angle as f32).clamp(least.0, most.0));
        sensor.calibration.volts(within).map(|volts| f64::from(volts.0)).map_err(error::run)
    };
    let all =
        arrays::given("angles_rad", angles_rad, None)?.values.iter().map(volts).collect::<PyResult<Vec<f64>>>()?;
    Ok(arrays::column(py, all))
}
