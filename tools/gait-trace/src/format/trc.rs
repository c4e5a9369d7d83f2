//! Reads TRC files of motion capture (Motion Analysis, OpenSim, OpenCap): hips and knees computed from markers of hip, knee and ankle.
//!
//! Five lines, separated by tabs: `PathFileType`, names of the header's fields, their values, names of the markers (one above three
//! columns), names of the components; then rows of frame number, time, and X, Y, Z of each marker. An empty field, or a marker at
//! exactly 0, 0, 0, is missing; so are the last markers of a row whose tabs at the end were trimmed. A marker may have the name of its subject in front (`Anna:LKNE`). The angles are computed as those of a C3D file of joint centres or markers.

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{Place, in_degrees};
use crate::format::description::Description;
use crate::format::row_lines::RowLines;
use crate::format::rows::{Row, Rows};
use crate::format::segments::{self, Leg, LengthUnit, Track};
use crate::format::subjects;
use crate::format::text_table::{Delimiter, check_rows, lines, listed, number_or_missing, short, text};
use crate::format::time_names::time_of;
use crate::format::time_step;
use crate::format::unit::scaled;
use crate::options::ReadOptions;
use crate::raw::RawJoints;
use crate::series::median;
use std::borrow::Cow;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "TRC of motion capture (`.trc`)",
    recognised: "a first line that begins with `PathFileType`",
    units: "`Units` where hips are computed from the pelvis",
    axes: "markers of pelvis or hip, knee and ankle, as in C3D: the plane of vertical and walking direction",
    signs: "flexion positive, as computed (see below)",
    rate: "the second column, `Time` or `Times`, in seconds; `--rate` replaces times that agree with it",
    options: &["--rate", "--hip-sign", "--knee-sign", "--mirror", "--stride-time"],
};

/// Whether the text begins like a TRC file.
pub(crate) fn looks_like(text: &str) -> bool {
    text.get(..12).is_some_and(|start| start.eq_ignore_ascii_case("PathFileType"))
}

/// Reads the bytes of a file.
///
/// # Errors
/// The first fault of the file, with line and column; or it has no leg of hip, knee and ankle.
///
/// ```
/// use gait_trace::format::trc;
/// use gait_trace::ReadOptions;
/// let text = "PathFileType\t4\t(X/Y/Z)\tstand.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n100\t2\t1\tmm\nFrame#\tTime\tSACR\n\t\tX1\tY1\tZ1\n\n1\t0\t1\t2\t3\n2\t0.01\t1\t2\t3\n";
/// let error = trc::parse("stand.trc", text.as_bytes(), &ReadOptions::default()).unwrap_err().to_string();
/// assert!(error.starts_with("stand.trc:4: neither joint angles nor joint centres: the points are `SACR`"));
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let text = text(name, bytes)?;
    Table::begin(name, text, how)?.read(text, how)
}

/// Lines of the header.
pub(crate) const HEADER_LINES: usize = 5;

/// The rows that were read.
pub(crate) struct Table {
    name: String,
    /// The line of the names of the markers.
    names_line: u64,
    /// The last line of the header.
    end: u64,
    markers: Vec<String>,
    /// The number of frames that the header announces.
    frames: Option<u64>,
    /// The unit of length; empty if the header names none.
    unit: String,
    /// Power of ten of the unit of the times.
    time_power: i32,
    /// The trajectories of the markers that the legs may need.
    tracks: Vec<Option<Track>>,
    /// Rows that end before their last marker: how many, and the line of the first.
    short: (usize, u64),
    /// The last line, if the file was cut off within it.
    cut: Option<u64>,
    time_s: Vec<f64>,
    row_lines: RowLines,
    notes: Vec<String>,
}

impl Rows for Table {
    fn begin(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<Self, TraceError> {
        let mut notes = Vec::new();
        let split =
            |line, row| Delimiter::Char('\t').fields(row).map_err(|fault| TraceError::new(name, Some(line), fault));
        let mut rows = lines(name, text).filter(|row| !matches!(row, Ok((_, row)) if row.trim().is_empty()));
        let mut next = |what: &str| match rows.next() {
            Some(row) => row.and_then(|(line, row)| Ok((line, split(line, row)?))),
            None => {
                let allowed =
                    "five lines: PathFileType, names and values of the header, names of markers, X1 Y1 Z1 ...";
                let fault = Fault::HeaderField { field: what.into(), found: "missing".into(), allowed: allowed.into() };
                Err(TraceError::new(name, None, fault))
            }
        };
        next("PathFileType")?;
        let (_, keys) = next("the names of the header")?;
        let (_, values) = next("the values of the header")?;
        let (line, names) = next("the names of the markers")?;
        let (end, _) = next("the names of the components")?;
        let fault = |fault| TraceError::new(name, Some(line), fault);
        refuse_options(how).map_err(fault)?;
        let second = names.get(1).map_or("", |name| name);
        let Some(time_power) = time_of(second) else {
            let (field, found) = ("the second column".into(), format!("`{}`", short(second)));
            return Err(fault(Fault::HeaderField { field, found, allowed: "`Time`, behind `Frame#`".into() }));
        };
        let markers: Vec<&str> = names.iter().skip(2).map(|name| &**name).filter(|name| !name.is_empty()).collect();
        // Some programs put two tabs between values: where there are as many as names, they are in the same order.
        let filled = |fields: &[Cow<'_, str>]| -> Vec<String> {
            fields.iter().filter(|field| !field.is_empty()).map(ToString::to_string).collect()
        };
        let (filled_keys, filled_values) = (filled(&keys), filled(&values));
        let value_of = |key: &str| -> Option<String> {
            let is = |found: &str| found.eq_ignore_ascii_case(key);
            if filled_keys.len() == filled_values.len() {
                filled_values.get(filled_keys.iter().position(|found| is(found))?).cloned()
            } else {
                values.get(keys.iter().position(|found| is(found))?).map(ToString::to_string)
            }
        };
        let announced = |key: &str| -> Option<u64> { value_of(key)?.parse().ok() };
        differs(announced("NumMarkers"), markers.len(), "NumMarkers", "markers", &mut notes);

        let bare: Vec<&str> = markers.iter().map(|label| subjects::bare(label)).collect();
        let legs = segments::find(&bare);
        if legs.iter().all(Option::is_none) {
            return Err(fault(Fault::NoTrajectories { have: listed(&markers) }));
        }
        let with_legs = subjects::with_legs(&markers);
        if with_legs.len() > 1 {
            return Err(fault(Fault::SeveralSubjects { have: listed(&with_legs) }));
        }
        let mut tracks: Vec<Option<Track>> = vec![None; markers.len()];
        segments::candidates(&bare).into_iter().for_each(|point| tracks[point] = Some(Track::new()));
        Ok(Self {
            name: name.to_owned(),
            names_line: line,
            end,
            frames: announced("NumFrames"),
            unit: value_of("Units").unwrap_or_default(),
            markers: markers.into_iter().map(str::to_owned).collect(),
            time_power: time_power.unwrap_or(0),
            tracks,
            short: (0, 0),
            cut: None,
            time_s: Vec::new(),
            row_lines: RowLines::default(),
            notes,
        })
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn header_end(&self) -> u64 {
        self.end
    }

    fn push<'t>(&mut self, row: Row<'t>, fields: &mut Vec<Cow<'t, str>>) -> Result<(), TraceError> {
        let Row { line, text: row, is_open } = row;
        let fault = |fault| TraceError::new(&self.name, Some(line), fault);
        Delimiter::Char('\t').split(row, fields).map_err(fault)?;
        let wanted = 2 + 3 * self.markers.len();
        while fields.len() > wanted && fields.last().is_some_and(|field| field.is_empty()) {
            fields.pop();
        }
        if fields.len() < wanted && is_open {
            self.cut = Some(line);
            return Ok(());
        }
        // Behind a whole marker a row may end: the tabs of missing ones at the end were trimmed.
        let is_short = (2..wanted).contains(&fields.len()) && (fields.len() - 2).is_multiple_of(3);
        if fields.len() != wanted && !is_short {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted }));
        }
        if is_short {
            self.short = (self.short.0 + 1, if self.short.0 == 0 { line } else { self.short.1 });
            fields.resize(wanted, Cow::Borrowed(""));
        }
        check_rows(self.row_lines.len()).map_err(fault)?;
        self.time_s.push(scaled(&fields[1], false, self.time_power).map_err(|f| fault(f).in_column(1, "Time"))?);
        self.row_lines.push(line);
        for (point, track) in self.tracks.iter_mut().enumerate() {
            if let Some(track) = track {
                track.push(place(fields, point).map_err(|(index, f)| fault(f).in_column(index, &self.markers[point]))?);
            }
        }
        Ok(())
    }

    fn finish(self, _ended: bool, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
        let Self {
            name,
            names_line,
            markers,
            frames,
            unit,
            mut tracks,
            short,
            cut,
            mut time_s,
            row_lines,
            mut notes,
            ..
        } = self;
        let name = name.as_str();
        if let Some(line) = cut {
            notes.push(format!("The last row is cut short (line {line}): it is left out."));
        }
        if let (rows @ 1.., line) = short {
            notes.push(format!(
                "{rows} rows end before their last marker, the first in line {line}: those markers are missing there."
            ));
        }
        if time_s.len() < 2 {
            let last = row_lines.last().unwrap_or(names_line);
            return Err(TraceError::new(name, Some(last), Fault::TooFewRows { rows: time_s.len() }));
        }
        let fault = |fault| TraceError::new(name, Some(names_line), fault);
        if let Some(rate_hz) = how.rate_hz {
            time_step::at_rate(&mut time_s, rate_hz, "Time", &mut notes).map_err(|f| fault(f).in_column(1, "Time"))?;
        }
        differs(frames, time_s.len(), "NumFrames", "frames", &mut notes);
        let step_s = median(time_s.windows(2).map(|pair| pair[1] - pair[0]));
        let rate_hz = if step_s > 0.0 { 1.0 / step_s } else { 1.0 };
        let unit = LengthUnit { field: "Units", text: &unit };
        let mut bare: Vec<&str> = markers.iter().map(|label| subjects::bare(label)).collect();
        let is_empty = |point: usize| !tracks[point].iter().flatten().any(segments::is_seen);
        let legs = segments::find_seen(&mut bare, is_empty, &mut notes);
        if legs.iter().all(Option::is_none) {
            return Err(fault(Fault::NoTrajectories { have: listed(&markers) }));
        }
        notes.extend(segments::one_leg(&legs, &bare));
        let mut uses = vec![0_usize; markers.len()];
        legs.iter().flatten().flat_map(Leg::points).for_each(|point| uses[point] += 1);
        // Not copied where it is used for the last time.
        let track = |point: usize| {
            uses[point] -= 1;
            let track = if uses[point] == 0 { tracks[point].take() } else { tracks[point].clone() };
            track.unwrap_or_default()
        };
        let legs = segments::tracks(legs, track, unit, &mut notes).map_err(fault)?;
        let mut doubts = Vec::new();
        let columns = segments::angles(&legs, rate_hz, None, &mut notes, &mut doubts).map_err(fault)?;
        let place = Place { file: name, header: Some(names_line), lines: &row_lines };
        let joints = in_degrees(&place, columns, how, &mut notes)?;
        let format = format!("TRC, {} markers", markers.len());
        Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts })
    }
}

/// An error for options that a file of markers has no use for.
fn refuse_options(how: &ReadOptions<'_>) -> Result<(), Fault> {
    if how.map.is_empty() && how.time.is_none() {
        return Ok(());
    }
    Err(Fault::NoColumns { has: "markers and no columns of joints" })
}

/// A note if the header announces another number.
fn differs(announced: Option<u64>, found: usize, key: &str, what: &str, notes: &mut Vec<String>) {
    if let Some(announced) = announced.filter(|announced| *announced != found as u64) {
        notes.push(format!("`{key}` announces {announced} {what}, but the file has {found}; all of them are read."));
    }
}

/// The place of a marker in a row; the index of a field that is wrong.
fn place(fields: &[Cow<'_, str>], point: usize) -> Result<[f64; 3], (usize, Fault)> {
    let first = 2 + 3 * point;
    let mut place = [f64::NAN; 3];
    for (value, index) in place.iter_mut().zip(first..) {
        *value = number_or_missing(&fields[index], false).map_err(|fault| (index, fault))?;
    }
    let seen = place.iter().all(|value| value.is_finite()) && place != [0.0; 3];
    Ok(if seen { place } else { [f64::NAN; 3] })
}
