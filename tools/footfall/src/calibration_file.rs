//! A sensor's calibration as a file.
//!
//! ```toml
//! schema = 1
//! interpolation = "monotone_cubic"   # or "linear"
//! divider = 1.0                      # volts at the sensor for one volt at the pin
//!
//! [[points]]                         # 2 to 32, volts rising, the angle rising or falling throughout
//! sensor_v = 0.5
//! angle_deg = 90.0                   # flexion positive
//!
//! [[points]]
//! sensor_v = 2.5
//! angle_deg = -20.0
//! ```

use hgod_adc::{ANATOMY, Calibration, CalibrationPoint, Interpolation, MAX_VOLTS};
use joint_units::{Radians, Volts};
use std::fmt::Write as _;
use std::path::Path;
use walker::toml_table::{Document, FileError, Problem};

/// Version of the layout.
pub const SCHEMA: u32 = 1;

const INTERPOLATIONS: [(&str, Interpolation); 2] =
    [("linear", Interpolation::Linear), ("monotone_cubic", Interpolation::MonotoneCubic)];

/// A sensor as it is wired to the pin.
#[derive(Debug, Clone, PartialEq)]
pub struct WiredSensor {
    /// Volts at the sensor to the angle.
    pub calibration: Calibration,
    /// Volts at the sensor for one volt at the pin.
    pub divider: f32,
}

/// Reads a file.
///
/// # Errors
/// The first thing that is wrong with it, with line and field.
pub fn read(path: &Path) -> Result<WiredSensor, FileError> {
    parse(&Document::read(path)?)
}

/// Reads a text.
///
/// # Errors
/// As [`read`].
///
/// ```
/// use footfall::calibration_file;
/// use walker::toml_table::Document;
/// let text = "schema = 1\ninterpolation = \"linear\"\ndivider = 1\npoints = [\n\
///     { sensor_v = 0.5, angle_deg = 90 },\n\
///     { sensor_v = 0.4, angle_deg = -20 },\n]\n";
/// let error = calibration_file::parse(&Document::of_text("knee.toml", text.into())).unwrap_err();
/// assert!(error.to_string().starts_with("knee.toml:6: field `points[1].sensor_v`: "), "{error}");
/// ```
pub fn parse(document: &Document) -> Result<WiredSensor, FileError> {
    let tree = document.parse()?;
    let top = document.top(tree.get_ref(), &["schema", "interpolation", "divider", "points"])?;
    top.schema(SCHEMA)?;
    let interpolation = top.word("interpolation", &INTERPOLATIONS)?;
    let divider = top.number("divider", 0.05, 20.0, "")?;
    let mut points = Vec::new();
    for point in top.tables("points", &["sensor_v", "angle_deg"])? {
        let volts = Volts(point.number("sensor_v", 0.0, MAX_VOLTS.0, " V")?);
        let (least, most) = (ANATOMY.0.degrees().round(), ANATOMY.1.degrees().round());
        let angle = Radians::from_degrees(point.number("angle_deg", least, most, " degrees")?);
        points.push(CalibrationPoint { volts, angle });
    }
    let calibration = Calibration::build(&points, interpolation).map_err(|error| {
        let field = match (error.index(), error.field()) {
            (Some(index), Some("angle")) => format!("points[{index}].angle_deg"),
            (Some(index), _) => format!("points[{index}].sensor_v"),
            (None, _) => "points".into(),
        };
        document.at(&field, Problem::Rule(error.to_string()))
    })?;
    Ok(WiredSensor { calibration, divider })
}

/// The text of a file.
#[must_use]
pub fn to_text(sensor: &WiredSensor) -> String {
    let calibration = &sensor.calibration;
    let interpolation = INTERPOLATIONS.iter().find(|(_, kind)| *kind == calibration.interpolation());
    let mut text = format!(
        "# Calibration of a gait sensor: volts at the sensor and angle of the joint, flexion positive.\n\
         schema = {SCHEMA}\ninterpolation = \"{}\"\ndivider = {}\n",
        interpolation.map_or("linear", |(word, _)| word),
        sensor.divider
    );
    for point in calibration.points() {
        let (volts, angle) = (point.volts.0, crate::degrees::shortest(point.angle));
        // Writing to a string cannot fail.
        let _ = write!(text, "\n[[points]]\nsensor_v = {volts}\nangle_deg = {angle}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_calibration_is_written_and_read_back() {
        let shipped = crate::shipped::wired_sensor().unwrap();
        let back = parse(&Document::of_text("sensor.toml", to_text(&shipped))).unwrap();
        assert_eq!((back.divider, back.calibration.interpolation()), (1.0, Interpolation::MonotoneCubic));
        assert_eq!(back.calibration.points().len(), shipped.calibration.points().len());
        for (back, point) in back.calibration.points().iter().zip(shipped.calibration.points()) {
            assert_eq!(back.volts, point.volts);
            // The curve was computed in radians; a few of its angles lie between two numbers of degrees.
            assert!(back.angle.0.to_bits().abs_diff(point.angle.0.to_bits()) <= 1, "{back:?} for {point:?}");
        }
    }
}
