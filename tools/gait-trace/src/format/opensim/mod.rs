//! Reads OpenSim motion and storage files (.mot, .sto) of versions 1 to 3 and older SIMM motion files; writes motion files.
//!
//! A header of lines `key=value` (or `key value`) that ends with `endheader`, a line of column names, and rows of numbers,
//! separated by tabs or blanks. Files of controls, speeds, forces or activations have columns of the same names, so that something in the
//! file must say that they are angles (`holds`), or the caller (`--unit`). The numbers in the header (`nRows`, `nColumns`, `datarows`,
//! `datacolumns`) are compared with the rows and columns; a difference is a note where every row is whole. `inDegrees` names the unit of the rotations. Columns are coordinates
//! (`hip_flexion_l`, `knee_angle_r`) or paths to one (`/jointset/hip_l/hip_flexion_l/value`); only those of hips and knees
//! are read, speeds (`/speed`) are not. The sign of `hip_flexion` is in its name; that of a knee is the model's: gait2354, gait2392 and the
//! models made from them count extension as positive, Rajagopal's and OpenCap's flexion. It is one for both knees.

mod header;
mod holds;
mod write;

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::angle_unit::AngleUnit;
use crate::format::conversion_record::Record;
use crate::format::description::Description;
use crate::format::extension_columns;
use crate::format::joint_names::joint_of;
use crate::format::row_lines::RowLines;
use crate::format::rows::{Row, Rows};
use crate::format::stated;
use crate::format::text_table::{
    BareLines, Delimiter, bare_lines, check_rows, column_called, finite, lines, listed, number_or_missing, short, text,
};
use crate::format::time_names::time_of;
use crate::format::time_step;
use crate::format::unit::Said;
use crate::options::ReadOptions;
use crate::raw::{Doubt, RawJoints, SignSource};
use header::{Header, MAX_HEADER_LINES, is_end};
use holds::Holds;
use joint_units::Joint;
use std::borrow::Cow;
pub(crate) use write::coordinate;
pub use write::{write, write_to};

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "OpenSim motion and storage (`.mot`, `.sto`)",
    recognised: "a line `endheader`; that the columns are angles is said by the title (`Coordinates`, `inverse kinematics`, ...), paths that end in `/value`, speeds beside them (`hip_flexion_l_u`) or a `pelvis_ty` that is a height in metres; else `--unit` says it",
    units: "`inDegrees`, or a remark in the header",
    axes: "columns `hip_flexion_l`, `knee_angle_r`, ..., or paths to them that end in `/value`; `/speed` is not read",
    signs: "of `hip_flexion` flexion positive, by its name; of knees that of the model, which the file does not name: one for both (see below)",
    rate: "the column `time`, in seconds; `--rate` replaces times that agree with it",
    options: &["--map", "--unit", "--rate", "--hip-sign", "--knee-sign", "--mirror", "--own-cycles", "--stride-time"],
};

/// Whether the text has the line that ends a header.
pub(crate) fn looks_like(text: &str) -> bool {
    bare_lines(text).take(MAX_HEADER_LINES).any(is_end)
}

/// Reads the bytes of a file.
///
/// # Errors
/// The first fault of the file, with line and column.
///
/// ```
/// use gait_trace::format::opensim;
/// use gait_trace::ReadOptions;
/// let text = b"Coordinates\nversion=1\nnRows=2\nnColumns=3\ninDegrees=no\nendheader\ntime\thip_flexion_l\tpelvis_tx\n0\t0.5\t1\n0.01\t1.0\t1\n";
/// let raw = opensim::parse("walk.mot", text, &ReadOptions::default())?;
/// assert_eq!(raw.format, "OpenSim motion, version 1, tabs, radians");
/// let hip = raw.joints[0].as_ref().unwrap();
/// assert!((hip.angle_deg[0] - 28.65).abs() < 0.01);
///
/// let text = String::from_utf8_lossy(text).replace("Coordinates\n", "controls\n");
/// let controls = opensim::parse("walk.sto", text.as_bytes(), &ReadOptions::default()).unwrap_err().to_string();
/// assert!(controls.starts_with("walk.sto:1: the title line `controls` names another quantity than joint angles"), "{controls}");
/// # Ok::<(), gait_trace::TraceError>(())
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let text = text(name, bytes)?;
    Table::begin(name, text, how)?.read(text, how)
}

/// The rows that were read.
pub(crate) struct Table {
    name: String,
    header: Header,
    /// The line of the names of the columns.
    names_line: u64,
    delimiter: Delimiter,
    labels: Vec<String>,
    /// The index of the column of times.
    time: usize,
    /// The unit that the header names.
    said: Option<AngleUnit>,
    columns: Vec<AngleColumn>,
    /// What says that they are angles.
    holds: Holds,
    time_s: Vec<f64>,
    row_lines: RowLines,
    notes: Vec<String>,
}

impl Rows for Table {
    fn begin(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<Self, TraceError> {
        let mut notes = Vec::new();
        let mut rows = lines(name, text);
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
        let fault = |fault| TraceError::new(name, Some(line), fault);
        let labels = delimiter.fields(without_last_tab(delimiter, row)).map_err(fault)?;
        let labels: Vec<String> = labels.iter().map(|label| label.to_string()).collect();
        if let Some((_, field, columns)) =
            header.columns.as_ref().filter(|(.., columns)| *columns != labels.len() as u64)
        {
            notes.push(format!(
            "`{field}` announces {columns} columns, but the file has {}; every row has that many, and they are read.",
            labels.len()
        ));
        }
        let time = match &how.time {
            Some(wanted) => column_called(&labels, wanted).ok_or_else(|| {
                fault(Fault::MapColumn { joint: "time", wanted: wanted.clone(), have: listed(&labels) })
            })?,
            None => labels.iter().position(|label| time_of(label).is_some()).ok_or_else(|| {
                fault(Fault::NoTime { have: listed(&labels), hint: "", has_joints: false, example: String::new() })
            })?,
        };
        let said = header.unit(&mut notes);
        let record = Record::of_bytes(text.as_bytes());
        let columns = chosen(&labels, how, said, record.as_ref()).map_err(fault)?;
        let holds = Holds::of(header.title.clone(), &labels, &columns);
        holds.check_header(name)?;
        let is_read = |joint| columns.iter().any(|column| column.joint == joint);
        notes.extend(extension_columns::advice(&labels, is_read).map(|advice| advice + "."));
        Ok(Self {
            name: name.to_owned(),
            header,
            names_line: line,
            delimiter,
            labels,
            time,
            said,
            columns,
            holds,
            time_s: Vec::new(),
            row_lines: RowLines::default(),
            notes,
        })
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn header_end(&self) -> u64 {
        self.names_line
    }

    fn push<'t>(&mut self, row: Row<'t>, fields: &mut Vec<Cow<'t, str>>) -> Result<(), TraceError> {
        let Row { line, text: row, .. } = row;
        let Self { name, delimiter, labels, time, columns, holds, time_s, row_lines, .. } = self;
        let fault = |fault| TraceError::new(name, Some(line), fault);
        delimiter.split(without_last_tab(*delimiter, row), fields).map_err(fault)?;
        if fields == labels || (fields.len() != labels.len() && is_end(row)) {
            return Err(fault(Fault::SecondHeader));
        }
        if fields.len() != labels.len() {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted: labels.len() }));
        }
        time_s.push(finite(&fields[*time], false).map_err(|f| fault(f).in_column(*time, &labels[*time]))?);
        check_rows(row_lines.len()).map_err(fault)?;
        row_lines.push(line);
        holds.take(fields);
        for column in columns {
            let value = number_or_missing(&fields[column.index], false);
            column.values.push(value.map_err(|f| fault(f).in_column(column.index, &column.heading))?);
        }
        Ok(())
    }

    /// If another header follows, a row of another number of fields is the first line of another file.
    fn look_behind(error: &mut TraceError, lines: &mut BareLines<'_>) {
        if matches!(*error.fault, Fault::FieldCount { .. }) && lines.any(is_end) {
            *error.fault = Fault::SecondHeader;
        }
    }

    fn finish(self, ended: bool, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
        let Self {
            name,
            header,
            names_line,
            delimiter,
            labels,
            time,
            said,
            columns,
            holds,
            mut time_s,
            row_lines,
            mut notes,
        } = self;
        let name = name.as_str();
        let doubts: Vec<Doubt> = holds.angles(name, said, how)?.into_iter().collect();
        let last = row_lines.last().or(Some(names_line));
        if time_s.len() < 2 {
            return Err(TraceError::new(name, last, Fault::TooFewRows { rows: time_s.len() }));
        }
        match &header.rows {
        Some((_, field, rows)) if *rows != time_s.len() as u64 => notes.push(format!(
            "`{field}` announces {rows} rows, but the file has {}; all of them are whole and are read (was the file cut off, or rows removed?).",
            time_s.len()
        )),
        Some(_) => {}
        None => notes
            .push("The header does not give the number of rows, so it is unknown whether the file is complete.".into()),
    }
        if !ended && header.rows.as_ref().is_none_or(|(.., rows)| *rows != time_s.len() as u64) {
            notes.push("The last line has no line end: if the file was cut off, its last number may be wrong.".into());
        }
        if let Some(rate_hz) = how.rate_hz {
            time_step::at_rate(&mut time_s, rate_hz, &labels[time], &mut notes)
                .map_err(|f| TraceError::new(name, Some(names_line), f).in_column(time, &labels[time]))?;
        }
        let place = Place { file: name, header: Some(names_line), lines: &row_lines };
        let joints = in_degrees(&place, columns, how, &mut notes)?;
        let unit = how.unit.or(said).map_or("unit not given", AngleUnit::words);
        let format = format!("OpenSim motion, {}, {}, {unit}", header.version_words(), delimiter.words());
        Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts })
    }
}

/// The fields of a row; many programs end each row with a tab.
fn without_last_tab(delimiter: Delimiter, row: &str) -> &str {
    if delimiter == Delimiter::Char('\t') { row.strip_suffix('\t').unwrap_or(row) } else { row }
}

/// The columns of the joints, without values.
fn chosen(
    labels: &[String],
    how: &ReadOptions<'_>,
    said: Option<AngleUnit>,
    record: Option<&Record>,
) -> Result<Vec<AngleColumn>, Fault> {
    let mut columns = Vec::new();
    for joint in Joint::ALL {
        let index = match how.column_of(joint) {
            Some(wanted) => {
                let index = column_called(labels, wanted).ok_or_else(|| Fault::MapColumn {
                    joint: joint.name(),
                    wanted: wanted.into(),
                    have: listed(labels),
                })?;
                stated::check(&labels[index], how)?;
                Some(index)
            }
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
            // Models differ in the sign of a knee, but not in that of the coordinate `hip_flexion`.
            let is_hip_flexion = heading.to_ascii_lowercase().contains("hip_flexion");
            let by_name = if is_hip_flexion {
                SignSource::Format("by the name `hip_flexion` of OpenSim")
            } else {
                SignSource::Model
            };
            // A conversion has this name too where the sign was assumed.
            let sign = record.map_or(by_name, |record| record.sign_of(&heading));
            columns.push(AngleColumn { joint, heading, index, said: Said::angle(said), sign, values: Vec::new() });
        }
    }
    if columns.is_empty() {
        let advice = extension_columns::advice(labels, |_| false);
        let example = advice.map_or(String::new(), |advice| format!(" ({advice})"));
        return Err(Fault::NoJoints { have: listed(labels), example });
    }
    Ok(columns)
}
