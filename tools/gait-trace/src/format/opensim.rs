//! Reads OpenSim motion and storage files (.mot, .sto) of versions 1 to 3 and older SIMM motion files; writes motion files.
//!
//! A header of lines `key=value` (or `key value`) that ends with `endheader`, a line of column names, and rows of numbers,
//! separated by tabs or blanks. The numbers in the header (`nRows`, `nColumns`, `datarows`, `datacolumns`) are checked against the
//! rows and columns, so a file that was cut off is refused. `inDegrees` names the unit of the rotations. Columns are coordinates
//! (`hip_flexion_l`, `knee_angle_r`) or paths to one (`/jointset/hip_l/hip_flexion_l/value`); only those of hips and knees
//! are read. The sign is the file's: models differ in whether a flexed knee is positive.

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::joint_names::{AngleUnit, joint_of, time_of};
use crate::format::text_table::{
    Delimiter, bare_lines, check_rows, column_called, finite, lines, listed, number_or_missing, short, text,
};
use crate::format::whole_file;
use crate::options::ReadOptions;
use crate::raw::RawJoints;
use crate::recording::{Quantity, Recording};
use joint_units::Joint;
use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

/// `endheader` must be within this many lines.
const MAX_HEADER_LINES: usize = 1000;

/// Whether the text has the line that ends a header.
pub(crate) fn looks_like(text: &str) -> bool {
    bare_lines(text).take(MAX_HEADER_LINES).any(is_end)
}

fn is_end(line: &str) -> bool {
    line.trim().eq_ignore_ascii_case("endheader")
}

/// Reads the bytes of a file.
///
/// # Errors
/// The first fault of the file, with line and column.
///
/// ```
/// use gait_trace::format::opensim;
/// use gait_trace::ReadOptions;
/// let text = b"walk\nversion=1\nnRows=2\nnColumns=3\ninDegrees=no\nendheader\ntime\thip_flexion_l\tpelvis_tx\n0\t0.5\t1\n0.01\t1.0\t1\n";
/// let raw = opensim::parse("walk.mot", text, &ReadOptions::default())?;
/// assert_eq!(raw.format, "OpenSim motion, version 1, tabs, radians");
/// let hip = raw.joints[0].as_ref().unwrap();
/// assert!((hip.angle_deg[0] - 28.65).abs() < 0.01);
///
/// let cut = opensim::parse("walk.mot", &text[..text.len() - 11], &ReadOptions::default()).unwrap_err();
/// assert!(cut.to_string().starts_with("walk.mot:8: `nRows` announces 2 rows, but the file has 1 (cut off"));
/// # Ok::<(), gait_trace::TraceError>(())
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let mut notes = Vec::new();
    let whole = text(name, bytes)?;
    let mut rows = lines(name, whole);
    let header = Header::parse(name, &mut rows)?;
    let mut rows = rows.filter(|row| !matches!(row, Ok((_, row)) if row.trim().is_empty()));
    let no_names = || {
        let (field, found) = ("names of columns below `endheader`".into(), "missing".into());
        TraceError::new(
            name,
            Some(header.end),
            Fault::HeaderField { field, found, allowed: "time, hip_flexion_l, ...".into() },
        )
    };
    let (line, row) = rows.next().ok_or_else(no_names)??;
    let delimiter = if row.contains('\t') { Delimiter::Char('\t') } else { Delimiter::Blanks };
    let split = |line, row| split(delimiter, row).map_err(|fault| TraceError::new(name, Some(line), fault));
    let labels: Vec<String> = split(line, row)?.iter().map(|label| label.to_string()).collect();
    let fault = |fault| TraceError::new(name, Some(line), fault);
    if let Some((at, field, columns)) = &header.columns
        && *columns != labels.len() as u64
    {
        let (announced, found) = (format!("{columns} columns"), labels.len().to_string());
        return Err(TraceError::new(name, Some(*at), Fault::Announced { field: field.clone(), announced, found }));
    }
    let time = match &how.time {
        Some(wanted) => column_called(&labels, wanted)
            .ok_or_else(|| fault(Fault::MapColumn { joint: "time", wanted: wanted.clone(), have: listed(&labels) }))?,
        None => labels
            .iter()
            .position(|label| time_of(label).is_some())
            .ok_or_else(|| fault(Fault::NoTime { have: listed(&labels), hint: "" }))?,
    };
    let said = header.unit(&mut notes);
    let mut columns = chosen(&labels, how, said).map_err(fault)?;

    let mut time_s = Vec::new();
    let mut row_lines = Vec::new();
    for row in rows {
        let (line, row) = row?;
        let fields = split(line, row)?;
        let fault = |fault| TraceError::new(name, Some(line), fault);
        if fields == labels {
            return Err(fault(Fault::SecondHeader));
        }
        if fields.len() != labels.len() {
            let wanted = labels.len();
            // If another header follows, this row is the first line of another file.
            let again = bare_lines(whole).filter(|row| is_end(row)).nth(1).is_some();
            return Err(fault(if again {
                Fault::SecondHeader
            } else {
                Fault::FieldCount { found: fields.len(), wanted }
            }));
        }
        time_s.push(finite(&fields[time], false).map_err(|f| fault(f).in_column(time, &labels[time]))?);
        check_rows(row_lines.len()).map_err(fault)?;
        row_lines.push(line);
        for column in &mut columns {
            let value = number_or_missing(&fields[column.index], false);
            column.values.push(value.map_err(|f| fault(f).in_column(column.index, &column.heading))?);
        }
    }
    let last = row_lines.last().copied().or(Some(line));
    if let Some((_, field, rows)) = &header.rows
        && *rows != time_s.len() as u64
    {
        let (announced, found) = (format!("{rows} rows"), time_s.len().to_string());
        return Err(TraceError::new(name, last, Fault::Announced { field: field.clone(), announced, found }));
    }
    if time_s.len() < 2 {
        return Err(TraceError::new(name, last, Fault::TooFewRows { rows: time_s.len() }));
    }
    if header.rows.is_none() {
        notes
            .push("The header does not give the number of rows, so it is unknown whether the file is complete.".into());
    }
    let place = Place { file: name, header: Some(line), lines: &row_lines };
    let joints = in_degrees(&place, columns, how.unit, &mut notes)?;
    let unit = how.unit.or(said).map_or("unit not given", AngleUnit::words);
    let format = format!("OpenSim motion, {}, {}, {unit}", header.version_words(), delimiter.words());
    Ok(RawJoints { file: name.into(), format, time_s, joints, notes })
}

/// The fields of a row; many programs end each row with a tab.
fn split(delimiter: Delimiter, row: &str) -> Result<Vec<Cow<'_, str>>, Fault> {
    delimiter.fields(if delimiter == Delimiter::Char('\t') { row.strip_suffix('\t').unwrap_or(row) } else { row })
}

/// The columns of the joints, without values.
fn chosen(labels: &[String], how: &ReadOptions<'_>, said: Option<AngleUnit>) -> Result<Vec<AngleColumn>, Fault> {
    let mut columns = Vec::new();
    for joint in Joint::ALL {
        let index = match how.column_of(joint) {
            Some(wanted) => Some(column_called(labels, wanted).ok_or_else(|| Fault::MapColumn {
                joint: joint.name(),
                wanted: wanted.into(),
                have: listed(labels),
            })?),
            None => {
                let mut found = labels
                    .iter()
                    .enumerate()
                    .filter(|(_, label)| joint_of(label).is_some_and(|(found, _)| found == joint));
                let index = found.next();
                if let (Some((_, first)), Some((_, second))) = (index, found.next()) {
                    let (first, second) = (short(first), short(second));
                    return Err(Fault::TwoColumns { joint: joint.name(), first, second });
                }
                index.map(|(index, _)| index)
            }
        };
        if let Some(index) = index {
            let heading = labels[index].clone();
            columns.push(AngleColumn { joint, heading, index, said, values: Vec::new() });
        }
    }
    if columns.is_empty() {
        return Err(Fault::NoJoints { have: listed(labels) });
    }
    Ok(columns)
}

/// The parsed header.
#[derive(Default)]
struct Header {
    /// The line of `endheader`.
    end: u64,
    version: Option<u64>,
    /// Line, key and number.
    rows: Option<(u64, String, u64)>,
    columns: Option<(u64, String, u64)>,
    in_degrees: Option<bool>,
    /// A sentence about degrees or radians, as version 1 has it.
    remark: Option<AngleUnit>,
}

impl Header {
    fn parse<'a>(
        name: &str,
        rows: &mut impl Iterator<Item = Result<(u64, &'a str), TraceError>>,
    ) -> Result<Self, TraceError> {
        let mut header = Self::default();
        let mut last = 1;
        for row in rows.take(MAX_HEADER_LINES) {
            let (line, row) = row?;
            last = line;
            if is_end(row) {
                header.end = line;
                return Ok(header);
            }
            header.take(line, row.trim()).map_err(|fault| TraceError::new(name, Some(line), fault))?;
        }
        let (field, found) = ("endheader".into(), "missing".into());
        let allowed = format!("a line `endheader` within the first {MAX_HEADER_LINES}, and columns and rows below it");
        Err(TraceError::new(name, Some(last), Fault::HeaderField { field, found, allowed }))
    }

    fn take(&mut self, line: u64, row: &str) -> Result<(), Fault> {
        let pair = row.split_once('=').or_else(|| row.split_once(char::is_whitespace));
        let (key, value) = pair.map_or((row, ""), |(key, value)| (key.trim(), value.trim()));
        let bad = |allowed: &str| Fault::HeaderField {
            field: key.into(),
            found: format!("`{}`", short(value)),
            allowed: allowed.into(),
        };
        let count = || value.parse::<u64>().map_err(|_| bad("a whole number"));
        match key.to_ascii_lowercase().as_str() {
            "nrows" | "datarows" => self.rows = Some((line, key.into(), count()?)),
            "ncolumns" | "datacolumns" => self.columns = Some((line, key.into(), count()?)),
            "version" if row.contains('=') => {
                let version = value.parse().ok().filter(|version| (1..=3).contains(version));
                self.version = Some(version.ok_or_else(|| bad("1, 2 or 3"))?);
            }
            "indegrees" => {
                self.in_degrees = Some(match value.to_ascii_lowercase().as_str() {
                    "yes" | "true" | "1" => true,
                    "no" | "false" | "0" => false,
                    _ => return Err(bad("yes or no")),
                });
            }
            "datatype" if !value.eq_ignore_ascii_case("double") => {
                return Err(bad("double: one number a column, such as coordinates have"));
            }
            _ => {
                let row = row.to_ascii_lowercase();
                let says = |unit: &str| row.contains(&format!("angles are in {unit}"));
                self.remark = match (says("degrees"), says("radians")) {
                    (true, false) => Some(AngleUnit::Degrees),
                    (false, true) => Some(AngleUnit::Radians),
                    _ => self.remark,
                };
            }
        }
        Ok(())
    }

    fn unit(&self, notes: &mut Vec<String>) -> Option<AngleUnit> {
        let of = |in_degrees| if in_degrees { AngleUnit::Degrees } else { AngleUnit::Radians };
        self.in_degrees.map(of).or_else(|| {
            let words = self.remark?.words();
            notes.push(format!("The header has no `inDegrees`; a remark in it says that angles are in {words}."));
            self.remark
        })
    }

    fn version_words(&self) -> String {
        match (self.version, &self.rows) {
            (Some(version), _) => format!("version {version}"),
            (None, Some((_, field, _))) if field.eq_ignore_ascii_case("datarows") => "SIMM header".into(),
            (None, _) => "version not given".into(),
        }
    }
}

/// OpenSim's name of a joint.
pub(crate) const fn coordinate(joint: Joint) -> &'static str {
    match joint {
        Joint::LeftHip => "hip_flexion_l",
        Joint::RightHip => "hip_flexion_r",
        Joint::LeftKnee => "knee_angle_l",
        Joint::RightKnee => "knee_angle_r",
    }
}

/// Writes a recording as a motion file, version 1, in degrees, completely or not at all. Channels that are joints get OpenSim's
/// names, other angles keep theirs. Flexion stays positive. Reading the file gives the same bits.
///
/// # Errors
/// A channel is not an angle, or the file cannot be written.
pub fn write(path: &Path, recording: &Recording) -> io::Result<()> {
    whole_file::write(path, |out| {
        let title = path.file_stem().map_or_else(|| "motion".into(), |stem| stem.to_string_lossy().into_owned());
        write_to(out, &title, recording)
    })
}

/// Writes the text of a motion file; `title` is its first line.
///
/// # Errors
/// A channel is not an angle, the title has more than one line, or an error of the writer.
///
/// ```
/// use gait_trace::{Channel, Quantity, Recording};
/// use gait_trace::format::opensim;
/// let knee = Channel::new("left_knee", Quantity::Angle, vec![10.0, 20.5]);
/// let mut text = Vec::new();
/// opensim::write_to(&mut text, "walk", &Recording::build(vec![0.0, 0.5], vec![knee])?)?;
/// let text = String::from_utf8(text)?;
/// assert_eq!(text, "walk\nversion=1\nnRows=2\nnColumns=2\ninDegrees=yes\nendheader\ntime\tknee_angle_l\n0\t10\n0.5\t20.5\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_to(out: &mut dyn Write, title: &str, recording: &Recording) -> io::Result<()> {
    let refuse = |why: String| Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    if title.contains(char::is_control) || is_end(title) {
        return refuse(format!("title `{}`; allowed is one line of text", title.escape_debug()));
    }
    let channels = recording.channels();
    if let Some(volts) = channels.iter().find(|channel| channel.quantity() != Quantity::Angle) {
        return refuse(format!("`{}` holds {}; allowed are angles", volts.name(), volts.quantity().unit()));
    }
    let (rows, columns) = (recording.time_s().len(), channels.len() + 1);
    writeln!(out, "{title}\nversion=1\nnRows={rows}\nnColumns={columns}\ninDegrees=yes\nendheader")?;
    write!(out, "time")?;
    for channel in channels {
        let joint = Joint::ALL.into_iter().find(|joint| joint.name() == channel.name());
        match joint {
            Some(joint) => write!(out, "\t{}", coordinate(joint))?,
            None => write!(out, "\t{}", channel.name())?,
        }
    }
    for (row, time) in recording.time_s().iter().enumerate() {
        write!(out, "\n{time}")?;
        for channel in channels {
            write!(out, "\t{}", channel.values()[row])?;
        }
    }
    writeln!(out)
}
