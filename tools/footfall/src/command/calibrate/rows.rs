//! Reads rows of known angles from CSV with a header.
//!
//! | column | content |
//! |---|---|
//! | `angle_deg` or `angle_rad` | the known angle of the joint, flexion positive |
//! | `volts`, or `code` (`codes`) | volts at the sensor, or the converter's 12 bit code, also as a mean with decimals |
//! | `vrefint` | the internal reference's code at the same time, if the supply is computed from it |
//! | `direction` | `up` or `down`: the direction in which the joint reached the angle |
//!
//! Other columns are not read. Commas, semicolons or tabs separate; lines that begin with `#` are skipped. Rows are in the order
//! in which they were taken.

use hgod_adc::{ANATOMY, MAX_VOLTS, Reference};
use joint_units::AdcCode;
use std::fmt;
use std::path::Path;

use crate::file::bounded;

/// Most bytes of a file of rows.
const MAX_BYTES: u64 = 64 << 20;

/// Most rows: an hour of codes of a board.
const MAX_ROWS: usize = 4_000_000;

/// Direction in which the joint reached an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// From smaller angles.
    Up,
    /// From greater angles.
    Down,
}

/// One row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Line of the file, from 1.
    pub line: u64,
    /// The known angle in degrees.
    pub angle_deg: f64,
    /// Volts at the sensor.
    pub volts: f64,
    /// The code was 0 or 4095, the limits of the converter: the true volts are there or beyond.
    pub clipped: bool,
    /// The direction, if the file has it.
    pub direction: Option<Direction>,
}

/// The rows of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// In the order of the file.
    pub rows: Vec<Row>,
    /// Name of the column of the volts.
    pub signal: String,
    /// Worth of one code at the sensor, in volts; 0 for rows of volts.
    pub code_v: f64,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// An error of a file of rows, and its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowsError {
    /// The file, as named by the caller.
    pub file: String,
    /// Line from 1, if the error is in one line.
    pub line: Option<u64>,
    /// Column from 1, if known, and its name.
    pub column: Option<(Option<usize>, String)>,
    /// What is wrong, and what is allowed.
    pub what: String,
}

impl fmt::Display for RowsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&generator_file::toml_file::place(&self.file, self.line))?;
        match &self.column {
            Some((Some(number), name)) => write!(f, "column {number} `{name}`: ")?,
            Some((None, name)) => write!(f, "column `{name}`: ")?,
            None => {}
        }
        f.write_str(&self.what)
    }
}

impl std::error::Error for RowsError {}

/// Conversion of codes to volts at the pin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Not known: rows of codes are refused.
    Unknown,
    /// The converter's supply in volts, as given; a `vrefint` column is not read.
    Supply(f64),
    /// The supply of each row from its `vrefint`.
    Reference(Reference),
}

/// How to read a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Conversion of codes to volts at the pin.
    pub scale: Scale,
    /// Volts at the sensor for one volt at the pin; for codes only, since rows of volts are at the sensor already.
    pub divider: f64,
    /// Name of the column of angles, where it is not `angle_deg` or `angle_rad`.
    pub angle: Option<String>,
    /// Name of the column of volts, where it is not `volts`.
    pub volts: Option<String>,
    /// Name of the column of codes, where it is not `code`.
    pub codes: Option<String>,
}

impl Default for Reading {
    fn default() -> Self {
        Self { scale: Scale::Unknown, divider: 1.0, angle: None, volts: None, codes: None }
    }
}

/// Reads a file of rows.
///
/// # Errors
/// The first error, with line and column.
pub fn read(path: &Path, reading: &Reading) -> Result<Rows, RowsError> {
    let file = path.display().to_string();
    let fail = |what: String| RowsError { file: file.clone(), line: None, column: None, what };
    let bytes = bounded::bytes(path, MAX_BYTES).map_err(|why| fail(why.to_string()))?;
    parse(&file, &bytes, reading)
}

/// Reads rows from bytes; `file` is their name in errors.
///
/// # Errors
/// As [`read`].
///
/// ```
/// use footfall::command::calibrate::rows::{Reading, Scale, parse};
/// let reading = Reading { scale: Scale::Supply(3.3), ..Reading::default() };
/// let rows = parse("knee.csv", b"angle_deg,code\n10,2048\n20,1024\n", &reading)?;
/// assert!((rows.rows[0].volts - 1.6504).abs() < 1e-4);
/// let error = parse("knee.csv", b"angle_deg,code\n10,2048\n20,5000\n", &reading).unwrap_err();
/// assert_eq!(error.to_string(), "knee.csv:3: column 2 `code`: is 5000; allowed is 0 to 4095, a 12 bit code");
/// # Ok::<(), footfall::command::calibrate::rows::RowsError>(())
/// ```
pub fn parse(file: &str, bytes: &[u8], reading: &Reading) -> Result<Rows, RowsError> {
    let fail = |line, what: String| RowsError { file: file.into(), line, column: None, what };
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
        fail(Some(line as u64), "is not text; allowed is CSV in UTF-8".into())
    })?;
    if text.trim().is_empty() {
        return Err(fail(None, "is empty; allowed is CSV with a header".into()));
    }
    let header = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
    let delimiter = [',', ';', '\t'].into_iter().find(|&c| header.contains(c)).unwrap_or(',');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter as u8)
        .comment(Some(b'#'))
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let headings = reader.headers().map_err(|error| fail(None, format!("is not CSV: {error}")))?.clone();
    let header_line = headings.position().map_or(1, csv::Position::line);
    let columns =
        Columns::find(&headings, reading).map_err(|what| RowsError { line: Some(header_line), ..fail(None, what) })?;
    let mut notes = Vec::new();
    if matches!(reading.scale, Scale::Supply(_)) && headings.iter().any(|name| name == "vrefint") {
        notes.push("the column `vrefint` was not read: the supply is as stated".into());
    }
    let mut rows = Vec::new();
    let mut supply_sum = 0.0;
    for record in reader.records() {
        let record = record.map_err(|error| fail(error.position().map(csv::Position::line), "is not CSV".into()))?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != headings.len() {
            let what = format!("has {} fields; allowed are {}, as in the header", record.len(), headings.len());
            return Err(fail(Some(line), what));
        }
        if rows.len() == MAX_ROWS {
            return Err(fail(Some(line), format!("one row too many; allowed are {MAX_ROWS}")));
        }
        let (row, supply) = columns.row(&record, line, reading).map_err(|(column, what)| RowsError {
            column: Some((Some(column + 1), headings.get(column).unwrap_or_default().into())),
            ..fail(Some(line), what)
        })?;
        rows.push(row);
        supply_sum += supply;
    }
    if rows.is_empty() {
        return Err(fail(None, "has no rows; allowed are rows of a known angle and its volts or code".into()));
    }
    let signal = headings.get(columns.signal).unwrap_or_default().into();
    let code_v = supply_sum / rows.len() as f64 * reading.divider / f64::from(AdcCode::MAX.0);
    Ok(Rows { rows, signal, code_v, notes })
}

/// Where the columns are, from 0.
struct Columns {
    angle: usize,
    radians: bool,
    signal: usize,
    codes: bool,
    vrefint: Option<usize>,
    direction: Option<usize>,
}

/// A column from 0, and the error of its field.
type FieldError = (usize, String);

impl Columns {
    fn find(headings: &csv::StringRecord, reading: &Reading) -> Result<Self, String> {
        for (index, name) in headings.iter().enumerate() {
            if headings.iter().take(index).any(|before| before == name) {
                return Err(format!("the heading `{name}` is there twice; allowed is once"));
            }
        }
        let found = || headings.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let place = |name: &str| headings.iter().position(|heading| heading == name);
        let one_of = |names: &[&str], what: &str, option: &str| -> Result<usize, String> {
            let there: Vec<usize> = names.iter().filter_map(|name| place(name)).collect();
            let allowed = names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(" or ");
            match there[..] {
                [index] => Ok(index),
                [] => Err(format!("no column of {what}: found {}; allowed is {allowed}, or {option}", found())),
                _ => Err(format!("two columns of {what}; allowed is one of {allowed}, or {option}")),
            }
        };
        let angle = match &reading.angle {
            Some(name) => one_of(&[name], "angles", "another name with --angle-column")?,
            None => one_of(&["angle_deg", "angle_rad"], "angles", "another name with --angle-column")?,
        };
        let name = headings.get(angle).unwrap_or_default();
        let radians = name.ends_with("_rad");
        if !radians && !name.ends_with("_deg") {
            return Err(format!("column `{name}`: its unit is not known; allowed are names that end in _deg or _rad"));
        }
        let (signal, codes) = match (&reading.volts, &reading.codes) {
            (Some(name), _) => (one_of(&[name], "volts", "another name with --volts-column")?, false),
            (None, Some(name)) => (one_of(&[name], "codes", "another name with --codes-column")?, true),
            (None, None) => {
                let option = "another name with --volts-column or --codes-column";
                let signal = one_of(&["volts", "code", "codes"], "the sensor's signal", option)?;
                (signal, headings.get(signal) != Some("volts"))
            }
        };
        let vrefint = match (codes, reading.scale) {
            (true, Scale::Unknown) => {
                return Err("codes need the converter's supply; allowed is --supply VOLTS, \
                            or a column `vrefint` with --vrefint-cal CODE"
                    .into());
            }
            (true, Scale::Reference(_)) => Some(one_of(&["vrefint"], "the reference", "--supply VOLTS")?),
            _ => None,
        };
        Ok(Self { angle, radians, signal, codes, vrefint, direction: place("direction") })
    }

    /// The row, and the supply at which its code was taken.
    fn row(&self, record: &csv::StringRecord, line: u64, reading: &Reading) -> Result<(Row, f64), FieldError> {
        let number = |column: usize| -> Result<f64, FieldError> {
            let field = record.get(column).unwrap_or_default();
            let short: String = field.chars().take(40).collect();
            let comma = if field.contains(',') { ", with a decimal point" } else { "" };
            match field.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(number),
                Ok(_) => Err((column, format!("`{short}` is not finite; allowed is a finite number"))),
                Err(_) => Err((column, format!("`{short}` is not a number; allowed is a finite number{comma}"))),
            }
        };
        let range = |column: usize, value: f64, least: f64, most: f64, unit: &str| {
            let what = || format!("is {value}; allowed is {least} to {most}{unit}");
            if (least..=most).contains(&value) { Ok(value) } else { Err((column, what())) }
        };
        let angle = number(self.angle)?;
        let degrees = if self.radians { angle.to_degrees() } else { angle };
        let (least, most) = (f64::from(ANATOMY.0.degrees()).round(), f64::from(ANATOMY.1.degrees()).round());
        // Angles in radians may have been rounded.
        let tolerance = if self.radians { 1e-3 } else { 0.0 };
        if !(least - tolerance..=most + tolerance).contains(&degrees) {
            let value = if self.radians { format!("{angle} rad, {degrees:.2} degrees") } else { angle.to_string() };
            let what = format!("is {value}; allowed is {least} to {most} degrees, the range of a joint with a sensor");
            return Err((self.angle, what));
        }
        let angle_deg = degrees.clamp(least, most);
        let signal = number(self.signal)?;
        let (volts, clipped, supply) = if self.codes {
            let full = f64::from(AdcCode::MAX.0);
            let code = range(self.signal, signal, 0.0, full, ", a 12 bit code")?;
            let supply = self.supply(reading, &number)?;
            let volts = code / full * supply * reading.divider;
            (
                range(self.signal, volts, 0.0, f64::from(MAX_VOLTS.0), " V at the sensor")?,
                code <= 0.0 || code >= full,
                supply,
            )
        } else {
            (range(self.signal, signal, 0.0, f64::from(MAX_VOLTS.0), " V at the sensor")?, false, 0.0)
        };
        let direction = self.direction.map(|column| match record.get(column).unwrap_or_default() {
            "up" => Ok(Direction::Up),
            "down" => Ok(Direction::Down),
            other => {
                let short: String = other.chars().take(40).collect();
                Err((column, format!("is `{short}`; allowed is `up` or `down`")))
            }
        });
        Ok((Row { line, angle_deg, volts, clipped, direction: direction.transpose()? }, supply))
    }

    fn supply(&self, reading: &Reading, number: &impl Fn(usize) -> Result<f64, FieldError>) -> Result<f64, FieldError> {
        match (reading.scale, self.vrefint) {
            (Scale::Reference(reference), Some(column)) => {
                let code = number(column)?;
                // The supply from the code as on the board: whole, and checked for plausibility.
                let whole = AdcCode(code.round().clamp(0.0, f64::from(u16::MAX)) as u16);
                reference
                    .supply(whole)
                    .map_err(|fault| (column, format!("is {code}: {fault}; allowed is what the supply allows")))?;
                let at_cal = reference.supply_at_cal();
                Ok(f64::from(at_cal.volts().0) * f64::from(reference.vrefint(at_cal).0) / code)
            }
            (Scale::Supply(supply), _) => Ok(supply),
            _ => Ok(0.0),
        }
    }
}
