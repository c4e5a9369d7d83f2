//! Reads text exports of Visual3D: joint angles as signals, one column a component.
//!
//! Five lines, separated by tabs, begin the file: the recording of each column, the signal's name, its type (`LINK_MODEL_BASED`,
//! `DERIVED`, `FRAME_NUMBERS`, ...), its folder (`ORIGINAL`, `PROCESSED`), and `ITEM` with the component (X, Y, Z). Rows of numbers
//! follow, of which the first is the number of the frame. An empty field and `NODATA` are missing values.
//!
//! The times are those of the signal `TIME`, in seconds; without it the rate is the caller's, and frame 1 is at time 0. The file names no
//! unit. Recordings of other lengths share the rows: where no row below has a value of the angles, the
//! recording has ended.

mod header;

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::axis;
use crate::format::decimals::Decimals;
use crate::format::description::{Description, SIGNS};
use crate::format::outputs;
use crate::format::row_lines::RowLines;
use crate::format::segments::Track;
use crate::format::text_table::{Delimiter, check_rows, cut_line, finite, is_missing, lines, short, text};
use crate::format::time_step;
use crate::format::unit::Said;
use crate::options::{Axis, ReadOptions};
use crate::raw::{RawJoints, SignSource};
use header::Header;
use joint_units::Joint;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "Visual3D text export (`.txt`)",
    recognised: "tabs; a third line of signal types (`LINK_MODEL_BASED`, ...), or a fifth line that begins with `ITEM`",
    units: "by the values",
    axes: "signals `Left Hip Angle`, `RKneeAngles`, ... of one recording, of type `LINK_MODEL_BASED` or `DERIVED`: the component that moves most at the knees, else X, with a warning",
    signs: SIGNS,
    rate: "the signal `TIME`, in seconds (`--rate` replaces times that agree with it); without it `ITEM`, with `--rate`; of a cycle normalised to 101 points `--rate 100` with `--stride-time`",
    options: &[
        "--map",
        "--unit",
        "--axis",
        "--rate",
        "--hip-sign",
        "--knee-sign",
        "--mirror",
        "--own-cycles",
        "--stride-time",
    ],
};

/// Whether the text begins like a Visual3D file.
pub(crate) fn looks_like(text: &str) -> bool {
    header::begins(text)
}

/// Reads the bytes of a file.
///
/// # Errors
/// The first fault of the file, with line and column; or its angles are of several recordings.
///
/// ```
/// use gait_trace::format::visual3d;
/// use gait_trace::ReadOptions;
/// let head = "\ta.c3d\ta.c3d\n\tTIME\tLeft Knee Angle\n\tFRAME_NUMBERS\tLINK_MODEL_BASED\n\tORIGINAL\tORIGINAL\nITEM\tX\tX\n";
/// let rows: String = (0..30).map(|n| format!("{}\t{}\t-{n}.5\n", n + 1, f64::from(n) / 100.0)).collect();
/// let raw = visual3d::parse("a.txt", format!("{head}{rows}").as_bytes(), &ReadOptions::default())?;
/// assert_eq!((raw.time_s[3], raw.joints[2].as_ref().unwrap().angle_deg[3]), (0.03, -3.5));
/// # Ok::<(), gait_trace::TraceError>(())
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let text = text(name, bytes)?;
    let mut notes = Vec::new();
    if how.time.is_some() {
        return Err(TraceError::new(name, None, Fault::NoTimeColumn { has: "that of the signal `TIME`" }));
    }
    let mut rows = lines(name, text);
    let header = Header::parse(name, &mut rows)?;
    let fault = |fault| TraceError::new(name, Some(header.line), fault);
    let chosen = outputs::choose(&header.outputs, "recordings, ranges or folders", how).map_err(fault)?;
    for &(_, index) in chosen.iter().filter(|(joint, _)| how.column_of(*joint).is_some()) {
        header.check_kind(index).map_err(fault)?;
    }
    let one = chosen[0].1;
    let source = match (header.time_of(one), how.rate_hz) {
        (Some(column), _) => Source::Time(column),
        (None, Some(rate_hz)) => Source::Items { rate_hz },
        (None, None) => return Err(fault(Fault::NoRate).in_column(0, "ITEM")),
    };
    let mut table = Table::new(name, &header, source, &chosen);
    let cut = cut_line(text, Delimiter::Char('\t'), header.width, |_| true);
    for row in rows {
        let (line, row) = row?;
        if cut != Some(line) && !row.trim().is_empty() {
            table.push(line, row)?;
        }
    }
    let Table { mut time_s, line_numbers, tracks, ended, decimals, .. } = table;
    if time_s.len() < 2 {
        let last = line_numbers.last().unwrap_or(header.line);
        return Err(TraceError::new(name, Some(last), Fault::TooFewRows { rows: time_s.len() }));
    }
    if let Some((line, _)) = ended.first() {
        notes
            .push(format!("The recording ends before line {line}; the last {} rows have no value of it.", ended.len()));
    }
    match cut {
        Some(line) => notes.push(format!("The last row is cut short (line {line}): it is left out.")),
        None if !text.ends_with(['\n', '\r']) => {
            notes.push("The last line has no line end: if the file was cut off, its last number may be wrong.".into());
        }
        None => {}
    }
    decimals.check(name, &mut notes)?;
    if let (Source::Time(column), Some(rate_hz)) = (source, how.rate_hz) {
        time_step::at_rate(&mut time_s, rate_hz, "TIME", &mut notes).map_err(|f| fault(f).in_column(column, "TIME"))?;
    }
    let points: Vec<(Joint, usize, Track)> =
        chosen.iter().zip(tracks).map(|(&(joint, index), track)| (joint, index, track)).collect();
    let mut doubts = Vec::new();
    let axis = match how.axis {
        Some(axis) => axis,
        // A model of the user may give Plug-in Gait's names to angles of other axes.
        None => axis::of_flexion(&points, false, &mut notes, &mut doubts).unwrap_or(Axis::X),
    };
    let column = |(joint, index, track): (Joint, usize, Track)| {
        let output = &header.outputs[index];
        let heading = output.label();
        let Some(index) = output.columns[axis as usize] else {
            let (field, found) = (short(&heading), format!("without component {}", axis.name()));
            return Err(fault(Fault::HeaderField { field, found, allowed: "another `--axis`".into() }));
        };
        let values = track.iter().map(|point| point[axis as usize]).collect();
        // The model of the user defines the sign, and an angle may be negated.
        Ok(AngleColumn { joint, heading, index, said: Said::Angle, sign: SignSource::Unknown, values })
    };
    let columns = points.into_iter().map(column).collect::<Result<_, _>>()?;
    let place = Place { file: name, header: Some(header.line), lines: &line_numbers };
    let joints = in_degrees(&place, columns, how, &mut notes)?;
    let count = joints.iter().flatten().count();
    let format = format!("Visual3D text, {count} joints of {} signals", header.outputs.len());
    Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts })
}

/// Where the times come from.
#[derive(Clone, Copy)]
enum Source {
    /// A column, in seconds.
    Time(usize),
    /// The numbers of the frames.
    Items { rate_hz: f64 },
}

/// Rows of numbers of one recording.
struct Table<'a> {
    name: &'a str,
    header: &'a Header,
    source: Source,
    /// Columns of each joint, x, y and z, with the name of the signal.
    columns: Vec<([Option<usize>; 3], String)>,
    /// The columns that are read, with that of the times.
    own: Vec<usize>,
    tracks: Vec<Track>,
    time_s: Vec<f64>,
    line_numbers: RowLines,
    decimals: Decimals,
    /// Rows since the last one with a value of the recording: line, and the time if the row has one.
    ended: Vec<(u64, Option<f64>)>,
}

impl<'a> Table<'a> {
    fn new(name: &'a str, header: &'a Header, source: Source, chosen: &[(Joint, usize)]) -> Self {
        let of = |&(_, index): &(Joint, usize)| (header.outputs[index].columns, header.outputs[index].label());
        let columns: Vec<([Option<usize>; 3], String)> = chosen.iter().map(of).collect();
        let time = if let Source::Time(column) = source { Some(column) } else { None };
        let own = time.into_iter().chain(columns.iter().flat_map(|(columns, _)| columns.iter().flatten().copied()));
        Self {
            name,
            header,
            source,
            own: own.collect(),
            columns,
            tracks: vec![Track::new(); chosen.len()],
            time_s: Vec::new(),
            line_numbers: RowLines::default(),
            decimals: Decimals::default(),
            ended: Vec::new(),
        }
    }

    fn push(&mut self, line: u64, row: &str) -> Result<(), TraceError> {
        let fault = |fault| TraceError::new(self.name, Some(line), fault);
        let fields = Delimiter::Char('\t').fields(row).map_err(fault)?;
        let wanted = self.header.width;
        if fields.iter().skip(wanted).any(|field| !field.is_empty()) {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted }));
        }
        let known = |column: &usize| fields.get(*column).is_some_and(|field| !is_no_data(field));
        let has_values = self.own.iter().any(known);
        let own = self.own.iter().filter_map(|&column| fields.get(column));
        own.for_each(|field| self.decimals.take(line, field));
        // A row may end early where a shorter recording has ended.
        if has_values && fields.len() < wanted && self.own.iter().any(|&column| column >= fields.len()) {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted }));
        }
        let time_s = match self.source {
            Source::Time(column) if !has_values || !known(&column) => None,
            Source::Time(column) => Some(number(&fields[column]).map_err(|f| fault(f).in_column(column, "TIME"))?),
            Source::Items { rate_hz } => {
                let item = finite(&fields[0], false).ok().filter(|item| item.fract() == 0.0 && item.abs() <= MAX_ITEM);
                let bad = || fault(Fault::NotAFrame { text: short(&fields[0]) }).in_column(0, "ITEM");
                Some((item.ok_or_else(bad)? - 1.0) / rate_hz)
            }
        };
        check_rows(self.time_s.len() + self.ended.len()).map_err(fault)?;
        if !has_values {
            self.ended.push((line, time_s));
            return Ok(());
        }
        for (line, time_s) in std::mem::take(&mut self.ended) {
            self.row(line, time_s)?;
            self.tracks.iter_mut().for_each(|track| track.push([f64::NAN; 3]));
        }
        self.row(line, time_s)?;
        for (track, (columns, label)) in self.tracks.iter_mut().zip(&self.columns) {
            let mut point = [f64::NAN; 3];
            for ((value, index), axis) in point.iter_mut().zip(columns).zip(["X", "Y", "Z"]) {
                let Some(index) = *index else { continue };
                let heading = || format!("{label} {axis}");
                *value = number(&fields[index]).map_err(|f| fault(f).in_column(index, &heading()))?;
            }
            track.push(point);
        }
        Ok(())
    }

    /// Adds a row's line and time.
    fn row(&mut self, line: u64, time_s: Option<f64>) -> Result<(), TraceError> {
        let Some(time_s) = time_s else {
            let column = if let Source::Time(column) = self.source { column } else { 0 };
            let fault = Fault::NotANumber { text: String::new() };
            return Err(TraceError::new(self.name, Some(line), fault).in_column(column, "TIME"));
        };
        self.time_s.push(time_s);
        self.line_numbers.push(line);
        Ok(())
    }
}

/// Largest number of a frame.
const MAX_ITEM: f64 = 1e9;

/// Whether a field holds no value. `1.#QNAN` and `-1.#IND` are how programs of Microsoft's C library write numbers that are none.
fn is_no_data(field: &str) -> bool {
    is_missing(field) || field.eq_ignore_ascii_case("nodata") || field.contains(".#QNAN") || field.contains(".#IND")
}

/// A number, or NaN where the field holds no value.
fn number(field: &str) -> Result<f64, Fault> {
    // Tabs separate the fields, so a comma is a decimal comma.
    if is_no_data(field) { Ok(f64::NAN) } else { finite(field, true) }
}
