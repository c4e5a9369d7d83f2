//! Reads CSV with any header: the time and the joints are found by name or by the caller's map.
//!
//! Fields are separated by commas, semicolons or tabs (with the latter two, decimal commas are read); a byte order mark,
//! CR LF, quotes, blank lines, lines that begin with `#`, and a row of units below the header are allowed. An empty field,
//! `nan` or `NaN` in a joint's column is a missing value. The other columns may hold anything. Rows of numbers without a header may
//! also be separated by blanks. Lines of free text above the header are left out, with a note, if exactly one line below them is a header. A last row that
//! is cut short, as a program leaves it that is killed while it writes, is left out, with a note.
//!
//! The unit of an angle comes from its heading (`left_hip_deg`, `hip l [rad]`) or from the caller, else from the values, with a
//! note. A column in volts (`PA1`, `goniometer (mV)`; a goniometer measures a joint angle) that the map assigns to a joint is
//! converted by the calibration; with a calibration, so is a column without unit. A column of frames, or no time at all, needs the
//! rate from the caller; a rate may also replace times that are rounded too coarsely, where they agree with it.
//!
//! Headings that do not say which column is meant are errors: cells merged over components, and columns that a program renamed
//! (`left_hip.1`).
//!
//! A column such as `subject` or `trial` with several values is an error, unless the caller chooses rows or takes all of them.

use crate::clean::rules::MOST_PERCENT_ROWS;
use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::axis;
use crate::format::components::{self, Triple};
use crate::format::conversion_record::Record;
use crate::format::csv_header::{Chosen, Header, TimeSource};
use crate::format::description::Description;
use crate::format::extension_columns;
use crate::format::flexion_component;
use crate::format::plain_row::PlainRow;
use crate::format::preamble::{self, Preamble};
use crate::format::row_lines::RowLines;
use crate::format::row_marks::RowMarks;
use crate::format::rows::{Row, Rows};
use crate::format::text_table::{
    BareLines, Delimiter, MAX_LINE, MAX_ROWS, bare_lines, check_length, check_rows, finite, is_blank, is_comment,
    is_cut, is_separator_line, numbered, short, text,
};
use crate::format::time_names::{is_share, is_time_like};
use crate::format::time_step;
use crate::format::unit::{scaled, scaled_or_missing};
use crate::options::ReadOptions;
use crate::raw::{Doubt, RawJoints, SignSource, UnitSource};
use crate::series::upper_median;
use std::borrow::Cow;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "CSV of any program, with the project's own, Saleae and PicoScope (`.csv`, `.txt`, `.tsv`)",
    recognised: "text that is none of the other formats; commas, semicolons or tabs, or blanks between rows of numbers without a header",
    units: "a heading's end (`_deg`, `[rad]`, `(mV)`, `PA1`) or a row of units below it; volts need a calibration",
    axes: "one column a joint; of the components of Plug-in Gait (`LKneeAngles_X`, `LKneeAngles_Y`, ...) the first; of others (`left_knee_angle_x`, ...) the one that clearly moves most at the knees, with a warning, the same for all joints",
    signs: "of the first component of `LKneeAngles`, ... flexion positive; else the file's, then made flexion positive (see below)",
    rate: "a column of times in s, ms, us or ns (`time_ms`, `Time [s]`, `sec`), or of frames, or the part of a cycle (`pct`, `gait_cycle_percent`); none with `--rate`, which also replaces times that agree with it",
    options: &[
        "--map",
        "--where",
        "--axis",
        "--unit",
        "--calibration",
        "--rate",
        "--hip-sign",
        "--knee-sign",
        "--mirror",
        "--own-cycles",
        "--stride-time",
    ],
};

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

pub(crate) fn parse_text(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    Table::begin(name, text, how)?.read(text, how)
}

/// The rows that were read.
pub(crate) struct Table {
    name: String,
    header: Header,
    header_line: u64,
    /// The first line that is no comment: the header, or a row.
    first: u64,
    /// Whether there is no header.
    headless: bool,
    delimiter: Delimiter,
    marks: RowMarks,
    /// How most rows are read.
    plain: Option<PlainRow>,
    /// Rows that were not of plain numbers, less those that were.
    misses: usize,
    /// The last line, if it is cut short.
    cut: Option<u64>,
    record: Option<Record>,
    /// Rows with nothing between their separators: how many, and the line of the first.
    empty: (usize, u64),
    time_s: Vec<f64>,
    row_lines: RowLines,
    notes: Vec<String>,
}

/// With so many more rows that are not of plain numbers than are, no row is tried: it would be read twice.
const MOST_MISSES: usize = 1000;

impl Rows for Table {
    fn begin(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<Self, TraceError> {
        let mut notes = Vec::new();
        let mut comment: Option<(u64, &str)> = None;
        let mut rows = numbered(text).filter(|(_, row)| row.len() > MAX_LINE || !is_blank(row));
        let preamble = preamble::find(name, text, how)?;
        if let Preamble::UpTo(header) = preamble {
            notes.push(format!("Line {header} is read as the header; the lines above it are left out."));
            if how.unit.is_none() && how.calibration.is_none() {
                preamble::check_titles(name, text, header)?;
            }
        }
        let first = loop {
            let (line, row) = rows.next().ok_or_else(|| TraceError::new(name, None, Fault::Empty))?;
            check_length(name, line, row)?;
            if matches!(preamble, Preamble::UpTo(header) if line < header) {
                continue;
            }
            match row.trim_start().strip_prefix('#') {
                Some(rest) => comment = Some((line, rest)),
                // Some spreadsheets name the delimiter in a first line; the header shows it too.
                None if is_separator_line(row) => {}
                None => break (line, row),
            }
        };
        let below = bare_lines(text).skip(first.0 as usize).filter(|row| !is_blank(row));
        let delimiter = Delimiter::of_line(first.1, below);
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
            _ if headless && (how.time.is_some() || how.rate_hz.is_some()) => {
                (first.0, (1..=first_fields.len()).map(|n| n.to_string()).collect())
            }
            // An oscilloscope's rows without a header: the time, then volts.
            _ if headless && how.calibration.is_some() && first_fields.len() >= 2 => {
                let channels = (1..first_fields.len()).map(|n| format!("CH{n}"));
                let headings: Vec<String> = std::iter::once("time".to_owned()).chain(channels).collect();
                notes.push(format!(
                    "The file has no header; column 1 is read as the time, the others as CH1 to CH{}.",
                    first_fields.len() - 1
                ));
                (first.0, headings)
            }
            _ => (first.0, first_fields.iter().map(|field| field.to_string()).collect()),
        };
        let understood = Header::understand(name, header_line, headings, headless && header_line == first.0, how);
        let header = understood.map_err(|error| match (preamble, &*error.fault) {
            (Preamble::Unclear { first_row, fields }, Fault::NoTime { .. } | Fault::NoJoints { .. }) => {
                let found = first_fields.len();
                if found == 1 && first.1.split_whitespace().count() == fields {
                    return TraceError::new(name, Some(first.0), Fault::BlankHeader { words: fields });
                }
                TraceError::new(name, Some(first.0), Fault::NoHeader { found, first_row, fields })
            }
            _ => error,
        })?;

        let is_read = |joint| header.chosen.iter().any(|chosen| chosen.joint == joint);
        if let Some(advice) = extension_columns::advice(&header.headings, is_read) {
            notes.push(advice + ".");
        }

        if how.axis.is_some() && header.chosen.iter().all(|chosen| chosen.triple.is_none()) {
            let what = "this file has no angles of three components";
            return Err(TraceError::new(name, None, Fault::NoAxes { what }));
        }

        let used: Vec<usize> = header.used().collect();
        let marks = RowMarks::of(&header.headings, &used, &how.only)
            .map_err(|fault| TraceError::new(name, Some(header_line), fault))?;
        let is_component = |column| header.chosen.iter().any(|chosen| chosen.is_component(column));
        let is_used = |column| used.contains(&column) || is_component(column);
        let plain = PlainRow::of(delimiter, header.headings.len(), is_used);
        Ok(Self {
            name: name.to_owned(),
            header,
            header_line,
            first: first.0,
            headless,
            delimiter,
            marks,
            plain,
            misses: 0,
            cut: None,
            record: Record::of_bytes(text.as_bytes()),
            empty: (0, 0),
            time_s: Vec::new(),
            row_lines: RowLines::default(),
            notes,
        })
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn header_end(&self) -> u64 {
        if self.headless { self.first - 1 } else { self.first }
    }

    /// Reads rows of plain numbers up to one that is none. `line` is the last line before them; a row has shown that there is no row of units.
    fn push_plain(&mut self, line: &mut u64, lines: &mut BareLines<'_>) {
        let Some(plain) = self.plain.as_ref().filter(|_| self.misses < MOST_MISSES) else { return };
        // The end of a plain row is an LF, which a text of lines that end in CR would be searched for in vain.
        if lines.end_in_cr() || self.row_lines.is_empty() || !self.marks.are_settled() || !self.header.is_in_units() {
            return;
        }
        let mut numbers = vec![0.0; plain.columns()];
        while self.row_lines.len() < MAX_ROWS
            && let Some(length) = plain.read(lines.rest(), &mut numbers)
        {
            self.time_s.push(match self.header.time {
                TimeSource::Column { index, .. } => numbers[index],
                TimeSource::Frames { index, rate_hz } => numbers[index] / rate_hz,
                TimeSource::Rows { rate_hz } => self.row_lines.len() as f64 / rate_hz,
            });
            *line += 1;
            self.marks.take_unmarked();
            self.row_lines.push(*line);
            for chosen in &mut self.header.chosen {
                chosen.values.push(numbers[chosen.index]);
                for (index, values) in chosen.triple.iter_mut().flat_map(Triple::others) {
                    values.push(numbers[index]);
                }
            }
            lines.skip_bytes(length);
            self.misses = self.misses.saturating_sub(1);
        }
        self.misses += 1;
    }

    fn push<'t>(&mut self, row: Row<'t>, fields: &mut Vec<Cow<'t, str>>) -> Result<(), TraceError> {
        let Row { line, text: row, is_open } = row;
        if is_comment(row) {
            return Ok(());
        }
        if is_open && line > self.first {
            let is_number = |column| self.header.used().any(|used| used == column);
            if is_cut(row, self.delimiter, self.header.headings.len(), is_number) {
                self.cut = Some(line);
                return Ok(());
            }
        }
        let Self { name, header, delimiter, marks, empty, time_s, row_lines, .. } = self;
        let comma = *delimiter != Delimiter::Char(',');
        let fault = |fault| TraceError::new(name, Some(line), fault);
        delimiter.split(row, fields).map_err(fault)?;
        // Spreadsheets write rows of separators where cells were emptied. Where rows are counted, one of missing values is a row.
        if header.time.index().is_some() && fields.iter().all(|field| field.is_empty()) {
            *empty = (empty.0 + 1, if empty.0 == 0 { line } else { empty.1 });
            return Ok(());
        }
        if time_s.is_empty() && row_lines.is_empty() && header.take_units(name, line, fields)? {
            return Ok(());
        }
        let wanted = header.headings.len();
        let trailing = fields.len() > wanted && fields[wanted..].iter().all(|field| field.is_empty());
        if fields.len() != wanted && !trailing {
            return Err(fault(wrong_count(fields, wanted, comma)));
        }
        let is_header = || fields.iter().zip(&header.headings).all(|(field, heading)| field == heading);
        let at = |index: usize, f: Fault| fault(f).in_column(index, &header.headings[index]);
        let number = |index: usize, power: i32| {
            scaled(&fields[index], comma, power).map_err(|f| {
                if is_header() {
                    return fault(Fault::SecondHeader);
                }
                at(index, clock_time(f))
            })
        };
        if !marks.takes(fields) && !is_header() {
            return Ok(());
        }
        time_s.push(match header.time {
            TimeSource::Column { index, power } => number(index, power.unwrap_or(0))?,
            TimeSource::Frames { index, rate_hz } => number(index, 0)? / rate_hz,
            TimeSource::Rows { rate_hz } => row_lines.len() as f64 / rate_hz,
        });
        check_rows(row_lines.len()).map_err(fault)?;
        row_lines.push(line);
        for chosen in &mut header.chosen {
            let field = &fields[chosen.index];
            let value = scaled_or_missing(field, comma, chosen.power);
            chosen.values.push(value.map_err(|f| fault(f).in_column(chosen.index, &header.headings[chosen.index]))?);
            for (index, values) in chosen.triple.iter_mut().flat_map(Triple::others) {
                let field = &fields[index];
                let value = scaled_or_missing(field, comma, chosen.power);
                values.push(value.map_err(|f| fault(f).in_column(index, &header.headings[index]))?);
            }
        }
        Ok(())
    }

    fn finish(self, ended: bool, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
        let Self {
            name,
            mut header,
            header_line,
            delimiter,
            marks,
            cut,
            record,
            empty,
            mut time_s,
            row_lines,
            mut notes,
            ..
        } = self;
        let name = name.as_str();
        marks.check(name, header_line, &time_s, &mut notes)?;
        if time_s.len() < 2 {
            let last = row_lines.last().unwrap_or(header_line);
            return Err(TraceError::new(name, Some(last), Fault::TooFewRows { rows: time_s.len() }));
        }
        if let Some(line) = cut {
            notes.push(format!("The last row is cut short (line {line}): it is left out."));
        } else if !ended {
            notes.push("The last line has no line end: if the file was cut off, its last number may be wrong.".into());
        }
        if let (rows @ 1.., line) = empty {
            notes.push(format!(
                "{rows} rows have nothing between their separators, the first in line {line}: they are left out."
            ));
        }
        if let TimeSource::Column { index, power } = header.time {
            let heading = &header.headings[index];
            check_seconds(name, header_line, (index, heading), power.is_some(), how, &time_s, &mut notes)?;
            if let Some(rate_hz) = how.rate_hz {
                time_step::at_rate(&mut time_s, rate_hz, heading, &mut notes)
                    .map_err(|fault| TraceError::new(name, Some(header_line), fault).in_column(index, heading))?;
            }
        }
        let mut doubts = Vec::new();
        flexion_component::settle(&mut header.chosen, &header.mapped_axes, how, &mut notes, &mut doubts).map_err(
            |(index, fault)| TraceError::new(name, Some(header_line), fault).in_column(index, &header.headings[index]),
        )?;
        header.settle_side(marks.is_left(), &mut notes);
        let place = Place { file: name, header: Some(header_line), lines: &row_lines };
        let column = |Chosen { joint, index, heading, said, values, .. }| {
            let by_name = || plug_in_gait_sign(&heading);
            let sign = record.as_ref().map_or_else(by_name, |record| record.sign_of(&header.headings[index]));
            AngleColumn { joint, heading, index, said, sign, values }
        };
        let joints = in_degrees(&place, header.chosen.into_iter().map(column).collect(), how, &mut notes)?;
        let unsaid = joints.iter().flatten().find_map(|joint| match joint.unit {
            UnitSource::Inferred(unit) if !components::says_angle(&joint.column) => Some(Doubt::Unit(unit)),
            _ => None,
        });
        doubts.extend(unsaid);
        let count = joints.iter().flatten().count();
        let format = format!("CSV, {}, {count} joints of {} columns", delimiter.words(), header.headings.len());
        Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts })
    }
}

/// What a heading says of the sign, if it is a name of Plug-in Gait: `LKneeAngles`, `LKneeAngles_X (deg)`.
fn plug_in_gait_sign(heading: &str) -> SignSource {
    let (base, axis) = components::parts(heading);
    if axis::is_plug_in_gait(&base) { axis::sign_of_plug_in_gait(&base, axis) } else { SignSource::Unknown }
}

/// A field that is no number in a column of times may be a time of day.
fn clock_time(fault: Fault) -> Fault {
    match fault {
        Fault::NotANumber { text } if text.contains(':') => Fault::ClockTime { text },
        other => other,
    }
}

/// What is wrong with a row of too few or too many fields.
fn wrong_count(fields: &[Cow<'_, str>], wanted: usize, comma: bool) -> Fault {
    let found = fields.len();
    let is_whole = |field: &Cow<'_, str>| !field.is_empty() && field.parse::<i64>().is_ok();
    if !comma && found > wanted && found <= 2 * wanted && fields.iter().all(is_whole) {
        return Fault::DecimalCommas { found, wanted };
    }
    Fault::FieldCount { found, wanted }
}

/// Accepts times as seconds if their median step is short enough; with a note where the unit is not stated.
fn check_seconds(
    name: &str,
    line: u64,
    (index, heading): (usize, &str),
    is_stated: bool,
    how: &ReadOptions<'_>,
    time_s: &[f64],
    notes: &mut Vec<String>,
) -> Result<(), TraceError> {
    let (first, last) = (time_s[0], time_s[time_s.len() - 1]);
    if first.abs() < 0.1 && (last - 100.0).abs() < 0.1 && time_s.len() <= MOST_PERCENT_ROWS {
        if !is_stated {
            notes.push(format!("`{heading}` names no unit; it runs from 0 to 100, as percent of a cycle does."));
        }
        return Ok(());
    }
    // A header of MATLAB is a comment: `% TimeStamp`.
    let is_of_matlab = heading.trim_start().strip_prefix('%').is_some_and(|rest| is_time_like(rest) && !is_share(rest));
    let is_share = is_share(heading) || heading.contains('%') && !is_of_matlab;
    let is_cycle = first.abs() < 1e-3 && (last - 1.0).abs() < 1e-3;
    if is_share && !is_cycle {
        let fault = Fault::HeaderField {
            field: short(heading),
            found: format!("from {first} to {last}"),
            allowed: "one cycle, from 0 to 100 or from 0 to 1, or a time".into(),
        };
        return Err(TraceError::new(name, Some(line), fault).in_column(index, heading));
    }
    // The upper median is needed only where it is said: whether it is that long is counted.
    let middle = (time_s.len() - 1) / 2;
    let shorter = time_s.windows(2).filter(|pair| pair[1] - pair[0] < time_step::MAX_STEP_S).count();
    if is_stated && shorter > middle {
        return Ok(());
    }
    let step = upper_median(time_s.windows(2).map(|pair| pair[1] - pair[0]));
    if step >= time_step::MAX_STEP_S {
        let (likely, right) = time_step::likely_unit(step);
        let fault = Fault::TimeUnit { step, likely, heading: right };
        return Err(TraceError::new(name, Some(line), fault).in_column(index, heading));
    }
    // An oscilloscope's rows of volts may be that close.
    if !is_stated && how.calibration.is_none() && step > 0.0 && step < time_step::MIN_UNSAID_STEP_S {
        let fault = Fault::TimeTooShort { step };
        return Err(TraceError::new(name, Some(line), fault).in_column(index, heading));
    }
    if !is_stated {
        notes.push(format!("`{heading}` names no unit; it is read as seconds because its median step is {step:.4}."));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The joints with the digits of all their bits, or the error; rows of plain numbers may be read in one pass.
    fn read(text: &str, in_one_pass: bool) -> Result<String, String> {
        let how = ReadOptions::default();
        let joints = Table::begin("walk.csv", text, &how).and_then(|mut table| {
            table.plain = table.plain.filter(|_| in_one_pass);
            table.read(text, &how)
        });
        joints.map(|joints| format!("{joints:?}")).map_err(|error| error.to_string())
    }

    proptest! {
        /// A table is the same, and so is its error, where its rows are read in one pass and where each is read field by field.
        #[test]
        fn rows_in_one_pass_are_those_field_by_field(
            rows in prop::collection::vec(prop::array::uniform3(-99.0..99.0f64), 2..60),
            decimals in 0_usize..18,
            delimiter in prop::sample::select(vec![",", ";", "\t"]),
            end in prop::sample::select(vec!["\n", "\n", "\r\n", "\r"]),
            others in prop::collection::vec((any::<prop::sample::Index>(), "[-+.,;\t\r\n\" #0-9a-zé]{0,4}|nan|inf|1e999|[0-9.]{9,40}"), 0..3),
            cut in 0_usize..9,
        ) {
            let mut text = ["time_s", "left_hip_deg", "note", "left_knee_deg"].join(delimiter) + end;
            for (n, [hip, note, knee]) in rows.iter().enumerate() {
                let fields = [n as f64 * 0.01, *hip, *note, *knee].map(|value| format!("{value:.decimals$}"));
                text += &(fields.join(delimiter) + end);
            }
            for (place, other) in others {
                let at = text.floor_char_boundary(place.index(text.len()));
                text.insert_str(at, &other);
            }
            if cut < 4 {
                text.truncate(text.floor_char_boundary(text.trim_end().len() - cut));
            }
            prop_assert_eq!(read(&text, true), read(&text, false), "{}", text);
        }
    }
}
