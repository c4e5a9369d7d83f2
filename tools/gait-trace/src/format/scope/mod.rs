//! Reads CSV exports of oscilloscopes: the volts of a goniometer (joint-angle sensor), converted to angles by a calibration table.
//!
//! | dialect | how it begins | time |
//! |---|---|---|
//! | Rigol, screen data | `X,CH1,CH2,Start,Increment` over `Sequence,Volt,Volt,-1.2e-2,1e-3` | start and increment |
//! | Rigol, the same without row numbers | `CH1,CH2,Start,Increment` over `Volt,Volt,-1.2e-2,1e-3` | start and increment |
//! | Rigol, older | `X,CH1,CH2` over `Second,Volt,Volt` | column |
//! | Rigol, newer | `Time(s),CH1(V),t0 = -1.2e-2, tInc = 1e-3`, or the same without the first | column, or t0 and tInc |
//! | Siglent | `Record Length,Analog:7000` ... or `Source,CH1`, then `Second,Volt` | column |
//! | Tektronix, one file a channel | rows of `key,value,,time,volts`, the first `Record Length,2.5e+03,,` | column 4 |
//! | Tektronix, newer | `Model,...` ... `TIME,CH1,CH2` | column |
//! | Keysight | `x-axis,1,2` over `second,Volt,Volt`, `x_axis,channel_1`, or `sec,Volt1,Volt2` | column |
//!
//! Saleae, PicoScope and rows of numbers without a header are read as CSV ([`mapped_csv`](super::mapped_csv)).
//!
//! The map assigns channels to joints (`left_knee=CH1`, or by the number of the column, from 1 with that of the time); the calibration converts volts to angles. Volts outside of its
//! table are missing values, counted in a note: the table is never extrapolated.

mod dialect;
mod layout;

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::description::{Description, SIGNS};
use crate::format::joint_names::joint_of;
use crate::format::row_lines::RowLines;
use crate::format::rows::{Row, Rows};
use crate::format::text_table::{Delimiter, bare_lines, check_rows, listed, text};
use crate::format::unit::{Said, scaled, scaled_or_missing};
use crate::options::ReadOptions;
use crate::raw::{RawJoints, SignSource};
use crate::series::median;
pub(crate) use dialect::{Dialect, dialect_of};
use joint_units::Joint;
use layout::{Layout, Time};
use std::borrow::Cow;

/// Largest deviation of the rows' time step from the announced one, as a fraction of it, that is not reported.
const STEP_SHARE: f64 = 0.05;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "Oscilloscope CSV of Rigol, Siglent, Tektronix and Keysight (`.csv`)",
    recognised: "its first lines: `X,CH1,Start,Increment`, `CH1,Start,Increment`, `tInc =`, `Record Length,Analog:`, `Second,Volt`, `Model,` and `TIME,`, `x-axis,1`, `x_axis,channel_1`, `sec,Volt1`",
    units: "V, mV or uV by the header; a calibration is required",
    axes: "one channel a joint; a number in a map is that of the column, with that of the time",
    signs: SIGNS,
    rate: "a column of times in s, ms, us or ns, or start and increment in the header",
    options: &["--map", "--calibration", "--hip-sign", "--knee-sign", "--mirror", "--stride-time"],
};

/// Reads the bytes of an export.
///
/// # Errors
/// The first fault of the file, with line and column; or there is no map or no calibration.
///
/// ```
/// use gait_trace::format::scope;
/// use gait_trace::ReadOptions;
/// use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
/// use joint_units::{Radians, Volts};
/// let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
/// let table = Calibration::new(&[point(0.5, 0.0), point(2.5, 100.0)], Interpolation::Linear).unwrap();
/// let mut how = ReadOptions { calibration: Some(&table), ..ReadOptions::default() };
/// how.add_map("left_knee=CH1")?;
/// let text = b"X,CH1,Start,Increment,\nSequence,Volt,-0.01,0.005,\n0,1.5,,\n1,1.7,,\n2,3.1,,\n";
/// let raw = scope::parse("knee.csv", text, &how)?;
/// assert_eq!(raw.time_s, [-0.01, -0.005, 0.0]);
/// let knee = &raw.joints[2].as_ref().unwrap().angle_deg;
/// assert!((knee[0] - 50.0).abs() < 1e-4 && (knee[1] - 60.0).abs() < 1e-4 && knee[2].is_nan());
/// assert!(raw.notes[0].contains("1 of 3 values are outside of the calibration table"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let text = text(name, bytes)?;
    Table::begin(name, text, how)?.read(text, how)
}

/// The rows that were read.
pub(crate) struct Table {
    name: String,
    dialect: Dialect,
    delimiter: Delimiter,
    layout: Layout,
    /// Joint, index of the channel in the layout, and volts.
    chosen: Vec<(Joint, usize, Vec<f64>)>,
    /// The last column that is read.
    last_column: usize,
    time_s: Vec<f64>,
    row_lines: RowLines,
    notes: Vec<String>,
}

impl Rows for Table {
    fn begin(name: &str, text: &str, how: &ReadOptions<'_>) -> Result<Self, TraceError> {
        let dialect = dialect_of(text).ok_or_else(|| {
            let why = "it is text without the header of an oscilloscope".into();
            TraceError::new(name, Some(1), Fault::UnknownFormat { why })
        })?;
        let mut notes = Vec::new();
        let delimiter = Delimiter::of_header(bare_lines(text).find(|row| !row.trim().is_empty()).unwrap_or_default());
        let layout = Layout::parse(name, text, dialect, delimiter, &mut notes)?;
        let names: Vec<&str> = layout.channels.iter().map(|(_, channel, _)| channel.as_str()).collect();
        if how.rate_hz.is_some() {
            let has = "the header or a column".into();
            return Err(TraceError::new(name, Some(layout.end.max(1)), Fault::RateAndTime { has }));
        }
        let fault = |fault| TraceError::new(name, Some(layout.end.max(1)), fault);
        let mut chosen: Vec<(Joint, usize, Vec<f64>)> = Vec::new();
        for joint in Joint::ALL {
            let channel = match how.column_of(joint) {
                Some(wanted) => Some(layout.channel_called(joint, wanted).map_err(fault)?),
                None => names.iter().position(|channel| joint_of(channel).is_some_and(|(found, _)| found == joint)),
            };
            chosen.extend(channel.map(|channel| (joint, channel, Vec::new())));
        }
        if chosen.is_empty() {
            return Err(fault(Fault::NoChannelMap { have: listed(&names) }));
        }
        let least = match layout.time {
            Time::Column { index, .. } => index,
            Time::Steps { .. } => 0,
        };
        let last_column = chosen.iter().map(|&(_, channel, _)| layout.channels[channel].0).fold(least, usize::max);
        let (time_s, row_lines) = (Vec::new(), RowLines::default());
        Ok(Self { name: name.to_owned(), dialect, delimiter, layout, chosen, last_column, time_s, row_lines, notes })
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn header_end(&self) -> u64 {
        self.layout.end
    }

    fn push<'t>(&mut self, row: Row<'t>, fields: &mut Vec<Cow<'t, str>>) -> Result<(), TraceError> {
        let Row { line, text: row, .. } = row;
        let comma = self.delimiter != Delimiter::Char(',');
        let fault = |fault| TraceError::new(&self.name, Some(line), fault);
        self.delimiter.split(row, fields).map_err(fault)?;
        if fields.len() <= self.last_column {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted: self.last_column + 1 }));
        }
        let time = match self.layout.time {
            Time::Column { index, power } => {
                scaled(&fields[index], comma, power).map_err(|f| fault(f).in_column(index, "time"))?
            }
            Time::Steps { start_s, step_s } => start_s + step_s * self.time_s.len() as f64,
        };
        if !time.is_finite() {
            return Err(fault(Fault::NotFinite { text: time.to_string() }).in_column(0, "time"));
        }
        self.time_s.push(time);
        check_rows(self.row_lines.len()).map_err(fault)?;
        self.row_lines.push(line);
        for (_, channel, values) in &mut self.chosen {
            let (index, heading, power) = &self.layout.channels[*channel];
            let value = scaled_or_missing(&fields[*index], comma, *power);
            values.push(value.map_err(|f| fault(f).in_column(*index, heading))?);
        }
        Ok(())
    }

    fn finish(self, _ended: bool, how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
        let Self { name, dialect, layout, chosen, time_s, row_lines, mut notes, .. } = self;
        let name = name.as_str();
        if time_s.len() < 2 {
            let last = row_lines.last().unwrap_or(layout.end);
            return Err(TraceError::new(name, Some(last), Fault::TooFewRows { rows: time_s.len() }));
        }
        if let Some((_, rows)) = layout.announced.filter(|(_, rows)| *rows != time_s.len() as u64) {
            let read = format!("the header announces {rows} rows, but the file has {}", time_s.len());
            notes.push(format!("`Record Length`: {read}; all of them are whole and are read (was the file cut off?)."));
        }
        if let Some(announced) = layout.interval_s {
            let step = median(time_s.windows(2).map(|pair| pair[1] - pair[0]));
            if (step - announced).abs() > STEP_SHARE * announced {
                notes.push(format!(
                    "`Sample Interval` announces {announced} s, but the rows are {step} s apart; the times of the rows are used."
                ));
            }
        }
        let mut columns = Vec::new();
        for (joint, channel, values) in chosen {
            let (index, heading, _) = &layout.channels[channel];
            let (heading, index, sign) = (heading.clone(), *index, SignSource::Unknown);
            columns.push(AngleColumn { joint, heading, index, said: Said::Volts, sign, values });
        }
        let place = Place { file: name, header: Some(layout.end.max(1)), lines: &row_lines };
        let joints = in_degrees(&place, columns, how, &mut notes)?;
        let format = format!("oscilloscope CSV ({}), {} channels", dialect.words(), layout.channels.len());
        Ok(RawJoints { file: name.into(), format, time_s, received: false, joints, notes, doubts: vec![] })
    }
}
