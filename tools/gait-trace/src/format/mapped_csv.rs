//! Reads CSV with any header: the time and the joints are found by name or by the caller's map.
//!
//! Fields are separated by commas, semicolons or tabs (with the latter two, decimal commas are read); a byte order mark,
//! CR LF, quotes, blank lines, lines that begin with `#`, and a row of units below the header are allowed. An empty field,
//! `nan` or `NaN` in a joint's column is a missing value. The other columns may hold anything. A last row that is cut short, as a
//! program leaves it that is killed while it writes, is left out, with a note.
//!
//! The unit of an angle comes from its heading (`left_hip_deg`, `hip l [rad]`) or from the caller, else from the values, with a
//! note. A column in volts (`PA1`, `goniometer (V)`; a goniometer measures a joint angle) that the map assigns to a joint is
//! converted by the calibration.

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::joint_names::{AngleUnit, joint_of, sideless_of, time_of, unit_of};
use crate::format::scope;
use crate::format::text_table::{
    Delimiter, check_rows, column_called, cut_line, finite, lines, listed, number_or_missing, short, text,
};
use crate::options::ReadOptions;
use crate::raw::RawJoints;
use crate::recording::{Channel, Quantity};
use joint_units::Joint;
use std::borrow::Cow;

/// From this median step on, seconds, a time column without unit is refused.
const MAX_STEP_S: f64 = 1.0;

/// Reads the bytes of a CSV file.
///
/// # Errors
/// The first fault of the file, with line and column.
///
/// ```
/// use gait_trace::format::mapped_csv;
/// use gait_trace::ReadOptions;
/// let text = b"time_s,left_knee_deg\n0,3\n0.01,abc\n";
/// let error = mapped_csv::parse("walk.csv", text, &ReadOptions::default()).unwrap_err();
/// assert_eq!(error.to_string(), "walk.csv:3: column 2 `left_knee_deg`: `abc` is not a number; allowed is a decimal number such as -12.5");
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    parse_text(name, text(name, bytes)?, how)
}

/// A column that was chosen for a joint.
struct Chosen {
    joint: Joint,
    index: usize,
    heading: String,
    said: Option<AngleUnit>,
    volts: bool,
    values: Vec<f64>,
}

impl Chosen {
    /// The only hip or knee of a file that names no side, as a recording of a single sensor does.
    fn sideless(headings: &[String], how: &ReadOptions<'_>, notes: &mut Vec<String>) -> Option<Self> {
        let all = || headings.iter().enumerate();
        let mut found = all().filter_map(|(index, heading)| sideless_of(heading).map(|what| (index, what)));
        let (index, (joints, said)) = found.next()?;
        if found.next().is_some() {
            return None;
        }
        let joint = how.sideless.filter(|joint| joints.contains(joint)).unwrap_or(joints[0]);
        let heading = headings[index].clone();
        notes.push(format!("`{heading}` names no side; it is read as {}.", joint.name()));
        Some(Self { joint, index, heading, said, volts: false, values: Vec::new() })
    }
}

/// The parsed header.
struct Header {
    headings: Vec<String>,
    time: usize,
    /// Length of the time's unit in seconds; `None` where the heading names no unit.
    time_unit: Option<f64>,
    chosen: Vec<Chosen>,
}

pub(crate) fn parse_text(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let mut notes = Vec::new();
    let mut comment: Option<(u64, &str)> = None;
    let mut rows = lines(name, text).filter(|row| !matches!(row, Ok((_, row)) if row.trim().is_empty()));
    let first = loop {
        let (line, row) = rows.next().ok_or_else(|| TraceError::new(name, None, Fault::Empty))??;
        match row.trim_start().strip_prefix('#') {
            Some(rest) => comment = Some((line, rest)),
            // Some spreadsheets name the delimiter in a first line; the header shows it too.
            None if row.len() <= 6 && row.to_ascii_lowercase().starts_with("sep=") => {}
            None => break (line, row),
        }
    };
    let delimiter = Delimiter::of_header(first.1);
    let split = |line, row| delimiter.fields(row).map_err(|fault| TraceError::new(name, Some(line), fault));
    let comma = delimiter != Delimiter::Char(',');
    let is_number = |field: &Cow<'_, str>| finite(field, comma).is_ok();
    let first_fields = split(first.0, first.1)?;
    let headless =
        first_fields.iter().all(|field| field.is_empty() || is_number(field)) && first_fields.iter().any(is_number);
    let (header_line, headings): (u64, Vec<String>) = match comment {
        // Some programs write the header as a comment.
        Some((line, row)) if headless && split(line, row)?.len() == first_fields.len() => {
            notes.push(format!("The comment in line {line} is used as the header."));
            (line, split(line, row)?.iter().map(|field| field.to_string()).collect())
        }
        _ if headless && how.time.is_some() => (first.0, (1..=first_fields.len()).map(|n| n.to_string()).collect()),
        _ => (first.0, first_fields.iter().map(|field| field.to_string()).collect()),
    };
    let mut header =
        Header::understand(name, header_line, headings, headless && header_line == first.0, how, &mut notes)?;

    let is_number = |index| index == header.time || header.chosen.iter().any(|chosen| chosen.index == index);
    let cut = cut_line(text, delimiter, header.headings.len(), is_number).filter(|&line| line > first.0);

    let mut time_s = Vec::new();
    let mut row_lines: Vec<u64> = Vec::new();
    let again = headless.then_some(Ok(first));
    for row in again.into_iter().chain(rows) {
        let (line, row) = row?;
        if cut == Some(line) || row.trim_start().starts_with('#') {
            continue;
        }
        let fields = split(line, row)?;
        let fault = |fault| TraceError::new(name, Some(line), fault);
        if time_s.is_empty() && row_lines.is_empty() && header.take_units(&fields) {
            continue;
        }
        let wanted = header.headings.len();
        let trailing = fields.len() == wanted + 1 && fields[wanted].is_empty();
        if fields.len() != wanted && !trailing {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted }));
        }
        let at = |index: usize, f: Fault| fault(f).in_column(index, &header.headings[index]);
        let time = finite(&fields[header.time], comma).map_err(|f| {
            if fields.iter().zip(&header.headings).all(|(field, heading)| field == heading) {
                return fault(Fault::SecondHeader);
            }
            at(header.time, f)
        })?;
        time_s.push(time * header.time_unit.unwrap_or(1.0));
        check_rows(row_lines.len()).map_err(fault)?;
        row_lines.push(line);
        for chosen in &mut header.chosen {
            let value = number_or_missing(&fields[chosen.index], comma);
            chosen.values.push(value.map_err(|f| fault(f).in_column(chosen.index, &header.headings[chosen.index]))?);
        }
    }
    if time_s.len() < 2 {
        let last = row_lines.last().copied().unwrap_or(header_line);
        return Err(TraceError::new(name, Some(last), Fault::TooFewRows { rows: time_s.len() }));
    }
    if let Some(line) = cut {
        notes.push(format!("The last row is cut short (line {line}): it is left out."));
    } else if !text.ends_with(['\n', '\r']) {
        notes.push("The last line has no line end: if the file was cut off, its last number may be wrong.".into());
    }
    if header.time_unit.is_none() {
        check_seconds(name, header_line, &header, &time_s, &mut notes)?;
    }
    let place = Place { file: name, header: Some(header_line), lines: &row_lines };
    let mut columns = Vec::new();
    // Angles from a calibration are degrees; the caller's unit holds for the other columns.
    let any_volts = header.chosen.iter().any(|chosen| chosen.volts);
    for chosen in header.chosen {
        let Chosen { joint, index, heading, said, volts, values } = chosen;
        let (said, values) = match volts {
            true => (Some(AngleUnit::Degrees), scope::angles_of_volts(name, &heading, values, how, &mut notes)?),
            false if any_volts => (how.unit.or(said), values),
            false => (said, values),
        };
        columns.push(AngleColumn { joint, heading, index, said, values });
    }
    let joints = in_degrees(&place, columns, how.unit.filter(|_| !any_volts), &mut notes)?;
    let count = joints.iter().flatten().count();
    let format = format!("CSV, {}, {count} joints of {} columns", delimiter.words(), header.headings.len());
    Ok(RawJoints { file: name.into(), format, time_s, joints, notes })
}

impl Header {
    fn understand(
        name: &str,
        line: u64,
        headings: Vec<String>,
        headless: bool,
        how: &ReadOptions<'_>,
        notes: &mut Vec<String>,
    ) -> Result<Self, TraceError> {
        let fault = |fault| TraceError::new(name, Some(line), fault);
        let find = |joint, wanted: &str| {
            let have = || listed(&headings);
            column_called(&headings, wanted)
                .ok_or_else(|| fault(Fault::MapColumn { joint, wanted: wanted.into(), have: have() }))
        };
        let time = match &how.time {
            Some(wanted) => find("time", wanted)?,
            None => {
                let mut times = (0..headings.len()).filter(|&index| time_of(&headings[index]).is_some());
                let time = times.next().ok_or_else(|| {
                    let hint = if headless {
                        " (the first line is a row of numbers, not a header)"
                    } else if headings.len() == 1 {
                        " (there is only one column; separate the fields by `,`, `;` or tabs)"
                    } else {
                        ""
                    };
                    fault(Fault::NoTime { have: listed(&headings), hint })
                })?;
                if let Some(other) = times.next() {
                    let (first, second) = (short(&headings[time]), short(&headings[other]));
                    return Err(
                        fault(Fault::TwoColumns { joint: "time", first, second }).in_column(other, &headings[other])
                    );
                }
                time
            }
        };
        let mut chosen: Vec<Chosen> = Vec::new();
        for joint in Joint::ALL {
            let index = match how.column_of(joint) {
                Some(wanted) => Some(find(joint.name(), wanted)?),
                None => {
                    let mapped = |index: &usize| {
                        how.map.iter().any(|(_, wanted)| column_called(&headings, wanted) == Some(*index))
                    };
                    let is_joint = |index: &usize| joint_of(&headings[*index]).is_some_and(|(found, _)| found == joint);
                    let mut found = (0..headings.len()).filter(|index| is_joint(index) && !mapped(index));
                    let index = found.next();
                    if let (Some(index), Some(other)) = (index, found.next()) {
                        let (first, second) = (short(&headings[index]), short(&headings[other]));
                        let fault = fault(Fault::TwoColumns { joint: joint.name(), first, second });
                        return Err(fault.in_column(other, &headings[other]));
                    }
                    index
                }
            };
            if let Some(index) = index {
                let heading = headings[index].clone();
                let said = joint_of(&heading).and_then(|(_, unit)| unit).or_else(|| unit_of(&heading));
                let volts = is_volts(&heading);
                chosen.push(Chosen { joint, index, heading, said, volts, values: Vec::new() });
            }
        }
        if chosen.is_empty() {
            chosen.extend(Chosen::sideless(&headings, how, notes));
        }
        if chosen.is_empty() {
            let volts: Vec<&String> = headings.iter().filter(|heading| is_volts(heading)).collect();
            return Err(fault(match volts.as_slice() {
                [] => Fault::NoJoints { have: listed(&headings) },
                volts => Fault::NoChannelMap { have: listed(volts) },
            }));
        }
        let heading = &headings[time];
        let at_end = || {
            let (_, end) = heading.trim_end_matches([']', ')', ' ']).rsplit_once(['_', '[', '(', ' '])?;
            time_of(&format!("t{end}"))?
        };
        let time_unit = time_of(heading).flatten().or_else(at_end);
        Ok(Self { headings, time, time_unit, chosen })
    }

    /// Reads a row of units below the header (`s,deg,deg`); false if the row is not one.
    fn take_units(&mut self, fields: &[Cow<'_, str>]) -> bool {
        let bare = |field: &str| field.trim_matches(['[', ']', '(', ')', ' ']).to_ascii_lowercase();
        let time = |field: &str| time_of(&format!("t{}", bare(field))).flatten();
        let Some(unit) = fields.get(self.time).and_then(|field| time(field)) else { return false };
        let is_unit = |field: &Cow<'_, str>| field.parse::<f64>().is_err();
        if fields.len() != self.headings.len() || !fields.iter().all(is_unit) {
            return false;
        }
        self.time_unit = Some(unit);
        for chosen in &mut self.chosen {
            let unit = bare(&fields[chosen.index]);
            chosen.said = chosen.said.or_else(|| unit.parse().ok());
            chosen.volts |= matches!(unit.as_str(), "v" | "volt" | "volts");
        }
        true
    }
}

/// Whether a heading is in volts: a pin, or a unit at its end.
fn is_volts(heading: &str) -> bool {
    let end = heading.to_ascii_lowercase();
    let end = end.trim_end_matches([']', ')', ' ']);
    matches!(Channel::of_column(heading), Some((_, Quantity::PinVolts)))
        || ["(v", "[v", "_v", "(volt", "[volt", "_volt", "_volts"].iter().any(|unit| end.ends_with(unit))
}

/// Accepts a time without unit as seconds if its median step is short enough.
fn check_seconds(
    name: &str,
    line: u64,
    header: &Header,
    time_s: &[f64],
    notes: &mut Vec<String>,
) -> Result<(), TraceError> {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let (_, step, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    let step = *step;
    let heading = &header.headings[header.time];
    if step >= MAX_STEP_S {
        return Err(TraceError::new(name, Some(line), Fault::TimeUnit { step }).in_column(header.time, heading));
    }
    notes.push(format!("`{heading}` names no unit; it is read as seconds because its median step is {step:.4}."));
    Ok(())
}
