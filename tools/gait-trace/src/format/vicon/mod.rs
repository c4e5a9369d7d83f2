//! Reads ASCII exports of Vicon Nexus with model outputs, such as the joint angles of Plug-in Gait.
//!
//! The file has sections (`Devices`, `Joints`, `Model Outputs`, `Trajectories`, ...), of which `Model Outputs` is read, wherever it is.
//! A section begins with five lines: its title, its rate in Hz, the names (`Anna:LHipAngles`, each above the first of its columns),
//! `Frame, Sub Frame` and the component of each column, and the units; rows of numbers follow up to a blank line. Fields are separated
//! by commas, semicolons or tabs (with the latter two, decimal commas are read). An empty field is a missing value.
//!
//! Frame 1 is at time 0. A rate line counts rows: with `n` sub frames a frame, the time is `((frame - 1) n + sub frame) / rate`.

mod section;

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::axis;
use crate::format::description::Description;
use crate::format::outputs;
use crate::format::row_lines::RowLines;
use crate::format::segments::Track;
use crate::format::text_table::{
    Delimiter, check_rows, cut_line, finite, is_missing, lines, listed, number_or_missing, short, text,
};
use crate::format::unit::Said;
use crate::options::{Axis, ReadOptions};
use crate::raw::RawJoints;
use joint_units::Joint;
use section::{Head, MODEL, is_blank, title_of};

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "Vicon Nexus ASCII export with model outputs (`.csv`, `.txt`)",
    recognised: "a first line `Model Outputs`, or the title of another section (`Devices`, `Joints`, `Trajectories`, ...) above a rate",
    units: "the row of units",
    axes: "`LHipAngles`, `RKneeAngles`, ... of one subject: component X, as Plug-in Gait defines it",
    signs: "of component X of `LHipAngles`, `LKneeAngles`, ... flexion positive, as Plug-in Gait defines it",
    rate: "`Frame` and `Sub Frame`, by the rate below the section's title; frame 1 is at time 0",
    options: &["--map", "--unit", "--axis", "--hip-sign", "--knee-sign", "--mirror", "--stride-time"],
};

/// Largest number of a frame or of a sub frame.
const MAX_FRAME: f64 = 1e9;

/// Whether the text begins like an export of Nexus.
pub(crate) fn looks_like(text: &str) -> bool {
    section::begins(text)
}

/// Reads the bytes of a file.
///
/// # Errors
/// The first fault of the file, with line and column; or its angles are of several subjects.
///
/// ```
/// use gait_trace::format::vicon;
/// use gait_trace::ReadOptions;
/// let rows = "101,0,21.5,1,2\n102,0,,,\n103,0,20.25,1,2\n";
/// let text = format!("Model Outputs\n100\n,,Anna:LHipAngles,,\nFrame,Sub Frame,X,Y,Z\n,,deg,deg,deg\n{rows}");
/// let raw = vicon::parse("walk.csv", text.as_bytes(), &ReadOptions::default())?;
/// assert_eq!(raw.time_s, [1.0, 1.01, 1.02]);
/// let hip = raw.joints[0].as_ref().unwrap();
/// assert!(hip.angle_deg[0] == 21.5 && hip.angle_deg[1].is_nan() && hip.angle_deg[2] == 20.25);
/// # Ok::<(), gait_trace::TraceError>(())
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let text = text(name, bytes)?;
    let mut notes = Vec::new();
    if how.rate_hz.is_some() {
        return Err(TraceError::new(name, None, Fault::RateAndTime { has: "its frames and their rate".into() }));
    }
    if how.time.is_some() {
        return Err(TraceError::new(name, None, Fault::NoTimeColumn { has: "that of its frames" }));
    }
    let mut rows = lines(name, text);
    let mut others: Vec<&str> = Vec::new();
    let title = loop {
        let no_section = || TraceError::new(name, None, Fault::NoModelOutputs { have: listed(&others) });
        let (line, row) = rows.next().ok_or_else(no_section)??;
        match title_of(row) {
            Some(title) if title == MODEL => break line,
            title => others.extend(title),
        }
    };
    let head = Head::parse(name, title, &mut rows)?;
    let fault = |fault| TraceError::new(name, Some(head.line), fault);
    let joints = outputs::choose(&head.outputs, "subjects", how).map_err(fault)?;
    let mut table = Table::new(name, &head, &joints);
    table.read(text, head.first_row.map(Ok).into_iter().chain(&mut rows), &mut others)?;
    for row in rows {
        let (line, row) = row?;
        match title_of(row) {
            Some(title) if title == MODEL => return Err(TraceError::new(name, Some(line), Fault::SecondHeader)),
            title => others.extend(title),
        }
    }
    if !others.is_empty() {
        others.dedup();
        notes.push(format!("The file also has the sections {}; only `{MODEL}` is read.", listed(&others)));
    }
    let Table { frames, line_numbers, tracks, cut, .. } = table;
    if frames.len() < 2 {
        let last = line_numbers.last().unwrap_or(head.line);
        return Err(TraceError::new(name, Some(last), Fault::TooFewRows { rows: frames.len() }));
    }
    match cut {
        Some(line) => notes.push(format!("The last row is cut short (line {line}): it is left out.")),
        None if !text.ends_with(['\n', '\r']) => {
            notes.push("The last line has no line end: if the file was cut off, its last number may be wrong.".into());
        }
        None => {}
    }
    let time_s = times(&frames, head.rate_hz, &mut notes);
    let points: Vec<(Joint, usize, Track)> =
        joints.iter().zip(tracks).map(|(&(joint, index), track)| (joint, index, track)).collect();
    let axis = match how.axis {
        Some(axis) => axis,
        // The section has the outputs of that model, whatever a laboratory calls them.
        None => axis::of_flexion(&points, true, &mut notes, &mut vec![]).map_err(|why| {
            let labels: Vec<String> = points.iter().map(|&(_, index, _)| head.outputs[index].label()).collect();
            fault(Fault::UnclearFlexion { columns: listed(&labels), why })
        })?,
    };
    let column = |point| {
        column(&head, point, axis).map_err(|(below, fault)| TraceError::new(name, Some(head.line + below), fault))
    };
    let columns = points.into_iter().map(column).collect::<Result<_, _>>()?;
    let place = Place { file: name, header: Some(head.line), lines: &line_numbers };
    let joints = in_degrees(&place, columns, how, &mut notes)?;
    let (delimiter, count) = (head.delimiter.words(), joints.iter().flatten().count());
    let format = format!(
        "Vicon Nexus ASCII, {delimiter}, {} Hz, {count} joints of {} outputs",
        head.rate_hz,
        head.outputs.len()
    );
    Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts: vec![] })
}

/// Rows of numbers of the section.
struct Table<'a> {
    name: &'a str,
    head: &'a Head<'a>,
    /// Columns of each joint, x, y and z, and the name of its output.
    columns: Vec<([Option<usize>; 3], String)>,
    tracks: Vec<Track>,
    /// Frame and sub frame of each row.
    frames: Vec<(f64, f64)>,
    line_numbers: RowLines,
    /// The last line, if it is cut short.
    cut: Option<u64>,
}

impl<'a> Table<'a> {
    fn new(name: &'a str, head: &'a Head<'a>, joints: &[(Joint, usize)]) -> Self {
        let of = |&(_, index): &(Joint, usize)| (head.outputs[index].columns, head.outputs[index].label());
        let columns = joints.iter().map(of).collect();
        let tracks = vec![Track::new(); joints.len()];
        Self { name, head, columns, tracks, frames: Vec::new(), line_numbers: RowLines::default(), cut: None }
    }

    /// Reads rows up to a blank line or a title.
    fn read<'t>(
        &mut self,
        text: &str,
        mut rows: impl Iterator<Item = Result<(u64, &'t str), TraceError>>,
        others: &mut Vec<&'static str>,
    ) -> Result<(), TraceError> {
        let delimiter = self.head.delimiter;
        let cut = cut_line(text, delimiter, self.head.components.len(), |_| true);
        for row in &mut rows {
            let (line, row) = row?;
            if cut == Some(line) && !is_blank(row) {
                self.cut = cut;
                return Ok(());
            }
            match title_of(row) {
                Some(title) if title == MODEL => {
                    return Err(TraceError::new(self.name, Some(line), Fault::SecondHeader));
                }
                Some(title) => {
                    others.push(title);
                    return Ok(());
                }
                None if is_blank(row) => break,
                None => self.push(line, row)?,
            }
        }
        // What follows the blank line is another section, not more rows.
        let next = rows.find(|row| !matches!(row, Ok((_, row)) if is_blank(row))).transpose()?;
        let Some((line, row)) = next else { return Ok(()) };
        let first = delimiter.fields(row).ok().and_then(|fields| fields.into_iter().next());
        match title_of(row) {
            Some(title) if title == MODEL => Err(TraceError::new(self.name, Some(line), Fault::SecondHeader)),
            None if first.is_some_and(|first| finite(&first, false).is_ok()) => {
                Err(TraceError::new(self.name, Some(line), Fault::RowsBelowEnd { section: MODEL }))
            }
            title => {
                others.extend(title);
                Ok(())
            }
        }
    }

    fn push(&mut self, line: u64, row: &str) -> Result<(), TraceError> {
        let Head { delimiter, components, .. } = self.head;
        let fault = |fault| TraceError::new(self.name, Some(line), fault);
        let fields = delimiter.fields(row).map_err(fault)?;
        let wanted = components.len();
        // A spreadsheet makes all rows as wide as the widest section.
        if fields.len() < wanted || fields[wanted..].iter().any(|field| !field.is_empty()) {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted }));
        }
        check_rows(self.frames.len()).map_err(fault)?;
        let number = |index: usize| count(&fields[index]).map_err(|f| fault(f).in_column(index, &components[index]));
        self.frames.push((number(0)?, number(1)?));
        self.line_numbers.push(line);
        let comma = *delimiter != Delimiter::Char(',');
        for (track, (columns, label)) in self.tracks.iter_mut().zip(&self.columns) {
            let mut point = [f64::NAN; 3];
            for (value, index) in point.iter_mut().zip(columns) {
                let Some(index) = *index else { continue };
                let heading = || format!("{label} {}", components[index]);
                let number = number_or_missing(&fields[index], comma);
                *value = number.map_err(|f| fault(f).in_column(index, &heading()))?;
            }
            track.push(point);
        }
        Ok(())
    }
}

/// A whole number of frames.
fn count(field: &str) -> Result<f64, Fault> {
    match finite(field, false) {
        Ok(number) if number.fract() == 0.0 && (0.0..=MAX_FRAME).contains(&number) => Ok(number),
        _ => Err(Fault::NotAFrame { text: short(field) }),
    }
}

/// The time of each row, seconds.
fn times(frames: &[(f64, f64)], rate_hz: f64, notes: &mut Vec<String>) -> Vec<f64> {
    let most = frames.iter().fold(0.0, |most: f64, &(_, sub)| most.max(sub));
    let per_frame = most + 1.0;
    if per_frame > 1.0 {
        notes.push(format!("A frame has {per_frame} sub frames; the rate of {rate_hz} Hz is that of the sub frames."));
    }
    frames.iter().map(|&(frame, sub)| ((frame - 1.0) * per_frame + sub) / rate_hz).collect()
}

/// The flexion of a joint, in the unit that the file names; else what is wrong, and how many lines below the names.
fn column(
    head: &Head<'_>,
    (joint, index, track): (Joint, usize, Track),
    axis: Axis,
) -> Result<AngleColumn, (u64, Fault)> {
    let output = &head.outputs[index];
    let heading = output.label();
    let Some(column) = output.columns[axis as usize] else {
        let (field, found) = (short(&heading), format!("without component {}", axis.name()));
        let allowed = "an output with the components X, Y and Z".into();
        return Err((1, Fault::HeaderField { field, found, allowed }));
    };
    let unit = head.units.get(column).map_or("", String::as_str);
    let said = match unit.parse() {
        Ok(unit) => Said::Unit(unit),
        Err(_) if is_missing(unit) => Said::Angle,
        Err(_) => {
            let (field, found) = (format!("the unit of {}", short(&heading)), format!("`{}`", short(unit)));
            return Err((2, Fault::HeaderField { field, found, allowed: "deg or rad".into() }));
        }
    };
    let values = track.iter().map(|point| point[axis as usize]).collect();
    let sign = axis::sign_of_plug_in_gait(&output.name, axis);
    Ok(AngleColumn { joint, heading, index: column, said, sign, values })
}
