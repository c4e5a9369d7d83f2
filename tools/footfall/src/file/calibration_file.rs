//! The sensor file: the calibration of a sensor.
//!
//! Written by hand, schema 1:
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
//! Measured by `footfall calibrate`, schema 2: the same, and how it was measured, see [`Measured`], and a check sum of
//! interpolation and points.

use crc::{CRC_32_ISO_HDLC, Crc};
use generator_file::degrees::shortest;
use generator_file::toml_file::{FileError, FileKind, Problem, TomlFile, Top};
use generator_file::word;
use hgod_adc::{Calibration, CalibrationError, CalibrationPoint, Interpolation};
use joint_units::{Radians, Volts};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::path::Path;
use time::{Date, Month};

/// Version of the layout that people write by hand.
pub const SCHEMA: u32 = 1;

/// Version of the layout that `footfall calibrate` writes.
pub const MEASURED_SCHEMA: u32 = 2;

const KEYS: [&str; 4] = ["schema", "interpolation", "divider", "points"];

const MEASURED_KEYS: [&str; 10] =
    ["schema", "sensor", "date", "interpolation", "divider", "rms_deg", "worst_deg", "hysteresis_deg", "crc", "points"];

/// How a correct file is made, for errors.
const HELP: &str = "`footfall defaults sensor` prints a new one, `footfall calibrate` measures one";

/// Allowed names of a sensor; the name is on a line of its own.
const NAME_ALLOWED: &str = "a name of 1 to 100 characters on one line";

const DATE_ALLOWED: &str = "a day as YYYY-MM-DD";

/// A sensor with its connection to the pin.
#[derive(Debug, Clone, PartialEq)]
pub struct WiredSensor {
    /// Volts at the sensor to the angle.
    pub calibration: Calibration,
    /// Volts at the sensor for one volt at the pin.
    pub divider: f32,
}

/// Difference of up and down sweeps, in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hysteresis {
    /// The largest difference at a pose, without its sign.
    #[serde(rename = "largest_deg")]
    pub largest: f32,
    /// The mean difference over the poses, without their signs.
    #[serde(rename = "mean_deg")]
    pub mean: f32,
}

/// How a calibration was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Name of the sensor.
    pub sensor: String,
    /// Day of the measurement, YYYY-MM-DD.
    pub date: String,
    /// Root mean square over the rows of the table's angle less the known one, in degrees.
    pub rms_deg: f32,
    /// The largest of these differences, without its sign.
    pub worst_deg: f32,
    /// `None` if the angle was reached in one direction only. In the file `[largest, mean]` or `[]`.
    #[serde(rename = "hysteresis_deg", with = "hysteresis")]
    pub hysteresis: Option<Hysteresis>,
}

/// The content of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationFile {
    /// Table and wiring.
    pub sensor: WiredSensor,
    /// How it was measured; `None` for a file written by hand.
    pub measured: Option<Measured>,
}

/// The calibration and its wiring, in the units of the file.
#[derive(Debug, Serialize, Deserialize)]
struct Table {
    #[serde(with = "word")]
    interpolation: Interpolation,
    divider: f32,
    points: Vec<Point>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Point {
    sensor_v: f32,
    angle_deg: f32,
}

impl Table {
    /// The check sum, CRC-32/ISO-HDLC as in zip and PNG, of these bytes: 0 for linear or 1 for monotone cubic, then each
    /// point's `sensor_v` and `angle_deg` as IEEE 754 single precision, little-endian.
    ///
    /// The divider is not included: a sensor with another divider is still the same sensor.
    fn crc(&self) -> u32 {
        const ALGORITHM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
        let mut digest = ALGORITHM.digest();
        digest.update(&[match self.interpolation {
            Interpolation::Linear => 0,
            Interpolation::MonotoneCubic => 1,
        }]);
        for Point { sensor_v, angle_deg } in &self.points {
            digest.update(&sensor_v.to_le_bytes());
            digest.update(&angle_deg.to_le_bytes());
        }
        digest.finalize()
    }
}

/// `[largest, mean]`, or `[]` for none.
mod hysteresis {
    use super::*;

    pub(super) fn serialize<S: Serializer>(value: &Option<Hysteresis>, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(value.iter().flat_map(|hysteresis| [hysteresis.largest, hysteresis.mean]))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Hysteresis>, D::Error> {
        match Vec::<f32>::deserialize(deserializer)?[..] {
            [] => Ok(None),
            [largest, mean] if mean <= largest => Ok(Some(Hysteresis { largest, mean })),
            _ => Err(D::Error::custom("is not `[largest, mean]`; allowed are both, the largest first, or none")),
        }
    }
}

/// Reads a file.
///
/// # Errors
/// The first error, with line and field.
pub fn read(path: &Path) -> Result<WiredSensor, FileError> {
    parse(&TomlFile::read(path)?)
}

/// An error at a field of a file that was read before, with its line.
#[must_use]
pub fn error_at(path: &Path, field: &str, problem: Problem) -> FileError {
    let error = |file: TomlFile| file.top(HELP).map(|top| top.error(field, problem));
    // A file that can no longer be read says so.
    TomlFile::read(path).and_then(error).unwrap_or_else(|unreadable| unreadable)
}

/// Reads a text.
///
/// # Errors
/// As [`read`].
///
/// ```
/// use footfall::file::calibration_file;
/// use generator_file::toml_file::TomlFile;
/// let text = "schema = 1\ninterpolation = \"linear\"\ndivider = 1\npoints = [\n\
///     { sensor_v = 0.5, angle_deg = 90 },\n\
///     { sensor_v = 0.4, angle_deg = -20 },\n]\n";
/// let error = calibration_file::parse(&TomlFile::of_text("knee.toml", text.into())).unwrap_err();
/// assert!(error.to_string().starts_with("knee.toml:6: field `points[1].sensor_v`: "), "{error}");
/// ```
pub fn parse(file: &TomlFile) -> Result<WiredSensor, FileError> {
    parse_whole(file).map(|file| file.sensor)
}

/// Reads a text with all its content.
///
/// # Errors
/// As [`read`].
pub fn parse_whole(file: &TomlFile) -> Result<CalibrationFile, FileError> {
    let top = file.top(HELP)?;
    let is_measured =
        top.layout(FileKind::Sensor, &[(SCHEMA, &KEYS), (MEASURED_SCHEMA, &MEASURED_KEYS)])? == MEASURED_SCHEMA;
    let measured = if is_measured { Some(measured(&top)?) } else { None };
    let table: Table = top.read()?;
    let divider = table.divider;
    if !(0.05..=20.0).contains(&divider) {
        return Err(top.not_allowed("divider", "a number from 0.05 to 20"));
    }
    let point = |point: &Point| CalibrationPoint {
        volts: Volts(point.sensor_v),
        angle: Radians::from_degrees(point.angle_deg),
    };
    let built = Calibration::new(&table.points.iter().map(point).collect::<Vec<_>>(), table.interpolation);
    let calibration = built.map_err(|error| {
        let field = match (error.index(), error.field()) {
            (Some(index), Some("angle")) => format!("points[{index}].angle_deg"),
            (Some(index), _) => format!("points[{index}].sensor_v"),
            (None, _) => "points".into(),
        };
        match error {
            CalibrationError::NotFinite { .. } => top.not_allowed(&field, "a finite number"),
            _ => top.error(&field, Problem::Rule(error.to_string())),
        }
    })?;
    if is_measured {
        check_crc(&top, table.crc())?;
    }
    Ok(CalibrationFile { sensor: WiredSensor { calibration, divider }, measured })
}

fn measured(top: &Top<'_>) -> Result<Measured, FileError> {
    let measured: Measured = top.read()?;
    if !is_name(&measured.sensor) {
        return Err(top.not_allowed("sensor", NAME_ALLOWED));
    }
    if day(&measured.date).is_none() {
        return Err(top.not_allowed("date", DATE_ALLOWED));
    }
    let Hysteresis { largest, mean } = measured.hysteresis.unwrap_or(Hysteresis { largest: 0.0, mean: 0.0 });
    let degrees = [
        ("rms_deg", measured.rms_deg),
        ("worst_deg", measured.worst_deg),
        ("hysteresis_deg[0]", largest),
        ("hysteresis_deg[1]", mean),
    ];
    match degrees.iter().find(|(_, degrees)| !(0.0..=360.0).contains(degrees)) {
        None => Ok(measured),
        Some((key, _)) => Err(top.not_allowed(key, "a number from 0 to 360 degrees")),
    }
}

fn check_crc(top: &Top<'_>, computed: u32) -> Result<(), FileError> {
    let text: String = top.get("crc")?;
    let digits = text.strip_prefix("0x").filter(|digits| digits.len() == 8 && !digits.starts_with('+'));
    let Some(written) = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok()) else {
        return Err(top.not_allowed("crc", "`0x` and 8 hexadecimal digits"));
    };
    if written == computed {
        return Ok(());
    }
    let value = format!("0x{written:08x} as written, but 0x{computed:08x} as computed from interpolation and points");
    let allowed = "a table as it was measured: calibrate again, or make it a file written by hand, of schema 1".into();
    Err(top.error("crc", Problem::Range { value, allowed }))
}

/// Whether a name is allowed.
fn is_name(name: &str) -> bool {
    let length = name.chars().count();
    (1..=100).contains(&length) && !name.chars().any(char::is_control) && name.trim() == name
}

/// The day of a text.
fn day(text: &str) -> Option<Date> {
    let mut parts = text.split('-');
    let mut part = |digits: usize| {
        let part =
            parts.next().filter(|part| part.len() == digits && part.bytes().all(|byte| byte.is_ascii_digit()))?;
        part.parse::<u16>().ok()
    };
    let (year, month, of_month) = (part(4)?, part(2)?, part(2)?);
    let month = Month::try_from(u8::try_from(month).ok()?).ok()?;
    let whole = parts.next().is_none();
    Date::from_calendar_date(year.into(), month, u8::try_from(of_month).ok()?).ok().filter(|_| whole)
}

/// The parser of a sensor's name for the command line.
///
/// # Errors
/// Names what is allowed.
pub fn name_argument(text: &str) -> Result<String, String> {
    if is_name(text) { Ok(text.into()) } else { Err(format!("allowed is {NAME_ALLOWED}")) }
}

/// The parser of a day for the command line.
///
/// # Errors
/// Names what is allowed.
///
/// ```
/// use footfall::file::calibration_file::date_argument;
/// assert_eq!(date_argument("2024-02-29").as_deref(), Ok("2024-02-29"));
/// assert!(date_argument("2026-02-29").is_err() && date_argument("26-2-1").is_err());
/// ```
pub fn date_argument(text: &str) -> Result<String, String> {
    day(text).map(|_| text.into()).ok_or_else(|| format!("allowed is {DATE_ALLOWED}"))
}

/// The text of a file: of schema 2 with how it was measured and a check sum, else of schema 1.
#[must_use]
pub fn to_text(sensor: &WiredSensor, measured: Option<&Measured>) -> String {
    #[derive(Serialize)]
    struct File<'a> {
        schema: u32,
        #[serde(flatten)]
        measured: Option<&'a Measured>,
        crc: Option<String>,
        #[serde(flatten)]
        table: Table,
    }
    let WiredSensor { calibration, divider } = sensor;
    let point = |point: &CalibrationPoint| Point { sensor_v: point.volts.0, angle_deg: shortest(point.angle) };
    let points = calibration.points().iter().map(point).collect();
    let table = Table { interpolation: calibration.interpolation(), divider: *divider, points };
    let (schema, crc) = match measured {
        None => (SCHEMA, None),
        Some(_) => (MEASURED_SCHEMA, Some(format!("0x{:08x}", table.crc()))),
    };
    // Words, numbers and a list of tables: TOML can represent all of them.
    let text = toml::to_string(&File { schema, measured, crc, table }).unwrap_or_default();
    format!("# Calibration of a gait sensor: volts at the sensor and angle of the joint, flexion positive.\n{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_calibration_is_written_and_read_back() {
        let default = crate::board::default_loop::wired_sensor().unwrap();
        let back = parse(&TomlFile::of_text("sensor.toml", to_text(&default, None))).unwrap();
        assert_eq!((back.divider, back.calibration.interpolation()), (1.0, Interpolation::MonotoneCubic));
        assert_eq!(back.calibration.points().len(), default.calibration.points().len());
        for (back, point) in back.calibration.points().iter().zip(default.calibration.points()) {
            assert_eq!(back.volts, point.volts);
            // The curve was computed in radians; a few of its angles have no exact number of degrees.
            assert!(back.angle.0.to_bits().abs_diff(point.angle.0.to_bits()) <= 1, "{back:?} for {point:?}");
        }
    }

    fn measured_file() -> CalibrationFile {
        let points = [(0.5, 90.0), (1.25, 35.5), (2.5, -20.0)];
        let points = points.map(|(v, deg)| CalibrationPoint { volts: Volts(v), angle: Radians::from_degrees(deg) });
        let calibration = Calibration::new(&points, Interpolation::MonotoneCubic).unwrap();
        let measured = Measured {
            sensor: "left \"knee\" \\ Nr. 3, grün".into(),
            date: "2026-02-28".into(),
            rms_deg: 0.0625,
            worst_deg: 0.25,
            hysteresis: Some(Hysteresis { largest: 1.5, mean: 0.75 }),
        };
        CalibrationFile { sensor: WiredSensor { calibration, divider: 2.0 }, measured: Some(measured) }
    }

    fn text(file: &CalibrationFile) -> String {
        to_text(&file.sensor, file.measured.as_ref())
    }

    fn whole(text: &str) -> Result<CalibrationFile, String> {
        parse_whole(&TomlFile::of_text("knee.toml", text.into())).map_err(|error| error.to_string())
    }

    #[test]
    fn a_measured_file_is_written_and_read_back_exactly() {
        let mut file = measured_file();
        assert_eq!(whole(&text(&file)), Ok(file.clone()));
        file.measured.as_mut().unwrap().hysteresis = None;
        assert_eq!(whole(&text(&file)), Ok(file));
    }

    const CRC_PYTHON: u32 = 0x1ea9_a1a5;

    /// The value is Python's: `zlib.crc32(b"\1" + struct.pack("<6f", 0.5, 90, 1.25, 35.5, 2.5, -20))`.
    #[test]
    fn the_check_sum_is_that_of_zlib() {
        assert!(text(&measured_file()).contains(&format!("crc = \"0x{CRC_PYTHON:08x}\"")));
    }

    #[test]
    fn a_file_that_was_changed_is_refused() {
        let good = text(&measured_file());
        let line = |part: &str| 1 + good[..good.find(part).unwrap()].matches('\n').count();
        let long = "3".repeat(100);
        for (from, to, field, words) in [
            ("angle_deg = 35.5", "angle_deg = 35.6", "crc", &["as written", "as computed", "calibrate again"][..]),
            ("sensor_v = 1.25", "sensor_v = 1.26", "crc", &["as written"]),
            ("monotone_cubic", "linear", "crc", &["as written"]),
            ("crc = \"0x", "crc = \"0y", "crc", &["8 hexadecimal digits"]),
            ("date = \"2026-02-28\"", "date = \"2026-02-30\"", "date", &["2026-02-30", "YYYY-MM-DD"]),
            ("[1.5, 0.75]", "[1.5]", "hysteresis_deg", &["[largest, mean]", "or none"]),
            ("[1.5, 0.75]", "[0.75, 1.5]", "hysteresis_deg", &["the largest first"]),
            ("rms_deg = 0.0625", "rms_deg = -1", "rms_deg", &["-1", "0 to 360 degrees"]),
            ("worst_deg = 0.25", "worst_deg = nan", "worst_deg", &["nan", "0 to 360 degrees"]),
            ("Nr. 3", long.as_str(), "sensor", &["1 to 100 characters on one line"]),
        ] {
            let error = whole(&good.replacen(from, to, 1)).unwrap_err();
            let field_line = line(&format!("{field} = "));
            assert!(error.starts_with(&format!("knee.toml:{field_line}: field `{field}`: ")), "{error}");
            for word in words.iter().chain(&["allowed"]) {
                assert!(error.contains(word), "{error} does not say {word}");
            }
        }
        let without = |field: &str| {
            let lines: Vec<&str> = good.lines().filter(|line| !line.starts_with(field)).collect();
            whole(&lines.join("\n"))
        };
        for field in ["crc", "sensor", "date", "rms_deg", "worst_deg", "hysteresis_deg"] {
            let error = without(field).unwrap_err();
            assert!(error.contains(&format!("field `{field}`: is missing; the key must be there: ")), "{error}");
        }
        // Another divider is another wiring of the same sensor.
        assert_eq!(whole(&good.replace("divider = 2.0", "divider = 3")).unwrap().sensor.divider, 3.0);
    }

    #[test]
    fn a_file_of_hand_needs_no_check_sum_and_may_have_none() {
        let hand = to_text(&measured_file().sensor, None);
        assert_eq!(whole(&hand), Ok(CalibrationFile { measured: None, ..measured_file() }));
        let error = whole(&hand.replace("schema = 1", "schema = 1\ncrc = \"0x00000000\"")).unwrap_err();
        assert!(error.contains("field `crc`: unknown field"), "{error}");
        let error = whole(&hand.replace("schema = 1", "schema = 3")).unwrap_err();
        assert!(error.contains("field `schema`: is 3; allowed is 1 or 2, the version"), "{error}");
    }
}
