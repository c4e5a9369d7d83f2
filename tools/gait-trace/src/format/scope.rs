//! Reads CSV exports of oscilloscopes: the volts of a goniometer (joint-angle sensor), converted to angles by a calibration table.
//!
//! | dialect | how it begins | time |
//! |---|---|---|
//! | Rigol, screen data | `X,CH1,CH2,Start,Increment` over `Sequence,Volt,Volt,-1.2e-2,1e-3` | start and increment |
//! | Rigol, older | `X,CH1,CH2` over `Second,Volt,Volt` | column |
//! | Rigol, newer | `Time(s),CH1(V),t0 = -1.2e-2, tInc = 1e-3`, or the same without the first | column, or t0 and tInc |
//! | Siglent | `Record Length,Analog:7000` ... or `Source,CH1`, then `Second,Volt` | column |
//! | Tektronix, one file a channel | rows of `key,value,,time,volts`, the first `Record Length,2.5e+03,,` | column 4 |
//! | Tektronix, newer | `Model,...` ... `TIME,CH1,CH2` | column |
//! | Keysight | `x-axis,1,2` over `second,Volt,Volt` | column |
//!
//! The map assigns channels to joints (`left_knee=CH1`, or by number); the calibration converts volts to angles. Volts outside of its
//! table are missing values, counted in a note: the table is never extrapolated.

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::joint_names::{AngleUnit, joint_of};
use crate::format::text_table::{
    Delimiter, bare_lines, check_rows, column_called, finite, lines, listed, number_or_missing, short, text,
};
use crate::options::ReadOptions;
use crate::raw::RawJoints;
use joint_units::{Joint, Volts};
use std::borrow::Cow;

/// A header must end within this many lines.
const MAX_HEADER_LINES: usize = 64;

/// The make of the oscilloscope and the layout of its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dialect {
    RigolSequence,
    RigolTime,
    RigolInline,
    Siglent,
    TektronixSideBySide,
    Tektronix,
    Keysight,
}

impl Dialect {
    const fn words(self) -> &'static str {
        match self {
            Self::RigolSequence => "Rigol, start and increment",
            Self::RigolTime => "Rigol, time column",
            Self::RigolInline => "Rigol, t0 and tInc",
            Self::Siglent => "Siglent",
            Self::TektronixSideBySide => "Tektronix, header beside the rows",
            Self::Tektronix => "Tektronix",
            Self::Keysight => "Keysight",
        }
    }
}

/// The dialect of a text; `None` if it is not an oscilloscope export.
pub(crate) fn dialect_of(text: &str) -> Option<Dialect> {
    let head: Vec<String> = bare_lines(text)
        .map(|row| row.trim().chars().take(400).collect::<String>().to_ascii_lowercase().replace(['"', ' ', '\t'], ""))
        .filter(|row| !row.is_empty())
        .take(MAX_HEADER_LINES)
        .collect();
    let (first, second) = (head.first()?.as_str(), head.get(1).map_or("", String::as_str));
    let any = |start: &str| head.iter().any(|row| row.starts_with(start));
    if first.contains("tinc=") {
        return Some(Dialect::RigolInline);
    }
    if first.starts_with("x,") && second.starts_with("sequence,") {
        return Some(Dialect::RigolSequence);
    }
    if first.starts_with("x,") && second.starts_with("second,") {
        return Some(Dialect::RigolTime);
    }
    if first.starts_with("x-axis,") {
        return Some(Dialect::Keysight);
    }
    if first.starts_with("recordlength,analog") || (any("second,volt") || any("second,value")) {
        return Some(Dialect::Siglent);
    }
    if first.starts_with("recordlength,") && first.split(',').count() >= 5 {
        return Some(Dialect::TektronixSideBySide);
    }
    let tektronix = any("sampleinterval,") || any("recordlength,") || first.starts_with("model,");
    (tektronix && any("time,")).then_some(Dialect::Tektronix)
}

/// Source of a row's time.
enum Time {
    Column(usize),
    Steps { start_s: f64, step_s: f64 },
}

/// The parsed header.
struct Layout {
    time: Time,
    /// Index, name and volts per unit of each channel.
    channels: Vec<(usize, String, f64)>,
    /// Line and number of rows that the header announces.
    announced: Option<(u64, u64)>,
    /// Last line of the header; 0 if the header is beside the rows.
    end: u64,
}

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
    let dialect = dialect_of(text).ok_or_else(|| {
        let why = "it is text without the header of an oscilloscope".into();
        TraceError::new(name, Some(1), Fault::UnknownFormat { why })
    })?;
    parse_text(name, text, dialect, how)
}

pub(crate) fn parse_text(
    name: &str,
    text: &str,
    dialect: Dialect,
    how: &ReadOptions<'_>,
) -> Result<RawJoints, TraceError> {
    let mut notes = Vec::new();
    let delimiter = Delimiter::of_header(bare_lines(text).find(|row| !row.trim().is_empty()).unwrap_or_default());
    let comma = delimiter != Delimiter::Char(',');
    let layout = Layout::parse(name, text, dialect, delimiter)?;
    let names: Vec<&str> = layout.channels.iter().map(|(_, channel, _)| channel.as_str()).collect();
    let mut chosen: Vec<(Joint, usize, Vec<f64>)> = Vec::new();
    for joint in Joint::ALL {
        let wanted = how.column_of(joint);
        let by_name = || names.iter().position(|channel| joint_of(channel).is_some_and(|(found, _)| found == joint));
        let channel = match wanted {
            Some(wanted) => Some(column_called(&names, wanted).ok_or_else(|| {
                let (joint, wanted, have) = (joint.name(), wanted.into(), listed(&names));
                TraceError::new(name, Some(layout.end.max(1)), Fault::MapColumn { joint, wanted, have })
            })?),
            None => by_name(),
        };
        chosen.extend(channel.map(|channel| (joint, channel, Vec::new())));
    }
    if chosen.is_empty() {
        return Err(TraceError::new(name, Some(layout.end.max(1)), Fault::NoChannelMap { have: listed(&names) }));
    }

    let mut time_s = Vec::new();
    let mut row_lines = Vec::new();
    for row in lines(name, text).skip(layout.end as usize) {
        let (line, row) = row?;
        if row.trim().is_empty() {
            continue;
        }
        let fault = |fault| TraceError::new(name, Some(line), fault);
        let fields = delimiter.fields(row).map_err(fault)?;
        let field = |index: usize| fields.get(index).map_or("", |field| &**field);
        let least = match layout.time {
            Time::Column(index) => index,
            Time::Steps { .. } => 0,
        };
        let most = chosen.iter().map(|&(_, channel, _)| layout.channels[channel].0).fold(least, usize::max);
        if fields.len() <= most {
            return Err(fault(Fault::FieldCount { found: fields.len(), wanted: most + 1 }));
        }
        let time = match layout.time {
            Time::Column(index) => finite(field(index), comma).map_err(|f| fault(f).in_column(index, "time"))?,
            Time::Steps { start_s, step_s } => start_s + step_s * time_s.len() as f64,
        };
        if !time.is_finite() {
            return Err(fault(Fault::NotFinite { text: time.to_string() }).in_column(0, "time"));
        }
        time_s.push(time);
        check_rows(row_lines.len()).map_err(fault)?;
        row_lines.push(line);
        for (_, channel, values) in &mut chosen {
            let (index, heading, volts) = &layout.channels[*channel];
            let value = number_or_missing(field(*index), comma).map_err(|f| fault(f).in_column(*index, heading))?;
            values.push(value * volts);
        }
    }
    if time_s.len() < 2 {
        let last = row_lines.last().copied().unwrap_or(layout.end);
        return Err(TraceError::new(name, Some(last), Fault::TooFewRows { rows: time_s.len() }));
    }
    match layout.announced {
        Some((line, rows)) if rows > time_s.len() as u64 => {
            let (announced, found) = (format!("{rows} rows"), time_s.len().to_string());
            let field = "Record Length".into();
            return Err(TraceError::new(name, Some(line), Fault::Announced { field, announced, found }));
        }
        Some((_, rows)) if rows < time_s.len() as u64 => {
            notes.push(format!("The header announces {rows} rows, but the file has {}; all were read.", time_s.len()));
        }
        _ => {}
    }
    let mut columns = Vec::new();
    for (joint, channel, values) in chosen {
        let (index, heading, _) = &layout.channels[channel];
        let values = angles_of_volts(name, heading, values, how, &mut notes)?;
        let said = Some(AngleUnit::Degrees);
        columns.push(AngleColumn { joint, heading: heading.clone(), index: *index, said, values });
    }
    let place = Place { file: name, header: Some(layout.end.max(1)), lines: &row_lines };
    let joints = in_degrees(&place, columns, None, &mut notes)?;
    let format = format!("oscilloscope CSV ({}), {} channels", dialect.words(), layout.channels.len());
    Ok(RawJoints { file: name.into(), format, time_s, joints, notes })
}

/// Volts converted to degrees; NaN outside of the calibration table.
pub(crate) fn angles_of_volts(
    name: &str,
    channel: &str,
    mut values: Vec<f64>,
    how: &ReadOptions<'_>,
    notes: &mut Vec<String>,
) -> Result<Vec<f64>, TraceError> {
    let calibration =
        how.calibration.ok_or_else(|| TraceError::new(name, None, Fault::NoCalibration { channel: short(channel) }))?;
    let (mut least, mut most, mut there, mut outside) = (f64::INFINITY, f64::NEG_INFINITY, 0_usize, 0_usize);
    for value in values.iter_mut().filter(|value| !value.is_nan()) {
        (least, most) = (least.min(*value), most.max(*value));
        there += 1;
        *value = match calibration.angle(Volts(*value as f32)) {
            Ok(angle) => f64::from(angle.degrees()),
            Err(_) => {
                outside += 1;
                f64::NAN
            }
        };
    }
    let (low, high) = calibration.volts_span();
    let (low, high) = (low.0, high.0);
    if there > 0 && outside == there {
        let found = format!("{least:.3} to {most:.3} V, completely outside of the calibration table");
        let allowed = format!("{low:.3} to {high:.3} V");
        let fault = Fault::HeaderField { field: short(channel), found, allowed };
        return Err(TraceError::new(name, None, fault));
    }
    if outside > 0 {
        notes.push(format!(
            "`{channel}`: {outside} of {there} values are outside of the calibration table ({low:.3} to {high:.3} V) and are treated as missing."
        ));
    }
    Ok(values)
}

/// Volts per unit.
fn volts_of(unit: &str) -> Option<f64> {
    match unit.trim().trim_matches(['(', ')', '[', ']']).to_ascii_lowercase().as_str() {
        "v" | "volt" | "volts" | "value" => Some(1.0),
        "mv" | "millivolt" | "millivolts" => Some(1e-3),
        _ => None,
    }
}

impl Layout {
    fn parse(name: &str, text: &str, dialect: Dialect, delimiter: Delimiter) -> Result<Self, TraceError> {
        let mut head = Vec::new();
        for row in lines(name, text).take(MAX_HEADER_LINES) {
            let (line, row) = row?;
            let fields = delimiter.fields(row).map_err(|fault| TraceError::new(name, Some(line), fault))?;
            if !row.trim().is_empty() {
                head.push((line, fields));
            }
        }
        match dialect {
            Dialect::RigolSequence => Self::sequence(name, &head),
            Dialect::RigolInline => Self::inline(name, &head),
            Dialect::RigolTime | Dialect::Keysight => Self::two_lines(name, &head),
            Dialect::Siglent => Self::below(name, &head, "second"),
            Dialect::Tektronix => Self::below(name, &head, "time"),
            Dialect::TektronixSideBySide => Self::beside(name, &head),
        }
    }

    /// `X,CH1,Start,Increment` over `Sequence,Volt,<s>,<s>`.
    fn sequence(name: &str, head: &[(u64, Vec<Cow<'_, str>>)]) -> Result<Self, TraceError> {
        let (line, names, units) = first_two(name, head)?;
        let value = |wanted: &str| {
            let index = names.iter().position(|field| field.eq_ignore_ascii_case(wanted));
            let found = index.and_then(|index| units.get(index)).map_or("missing", |field| &**field);
            let allowed = "a number of seconds in the second line";
            finite(found, false).map_err(|_| bad_field(name, line, wanted, found, allowed))
        };
        let (start_s, step_s) = (value("Start")?, value("Increment")?);
        let time = Time::Steps { start_s, step_s: positive(name, line, "Increment", step_s)? };
        let is_channel = |heading: &str| !["start", "increment"].contains(&heading.to_ascii_lowercase().as_str());
        let channels = channels(name, line, names, units, 1, is_channel)?;
        Ok(Self { time, channels, announced: None, end: line })
    }

    /// `Time(s),CH1(V),t0 = <s>, tInc = <s>`.
    fn inline(name: &str, head: &[(u64, Vec<Cow<'_, str>>)]) -> Result<Self, TraceError> {
        let Some((line, fields)) = head.first() else { return Err(TraceError::new(name, None, Fault::Empty)) };
        let value = |wanted: &str| {
            let field = fields.iter().find_map(|field| {
                let (key, value) = field.split_once('=')?;
                key.trim().eq_ignore_ascii_case(wanted).then(|| value.trim().trim_end_matches('s'))
            });
            let found = field.unwrap_or("missing");
            finite(found, false).map_err(|_| bad_field(name, *line, wanted, found, "a number of seconds"))
        };
        let has_time = fields.first().is_some_and(|field| field.to_ascii_lowercase().starts_with("time"));
        let time = if has_time {
            Time::Column(0)
        } else {
            let (start_s, step_s) = (value("t0")?, value("tInc")?);
            Time::Steps { start_s, step_s: positive(name, *line, "tInc", step_s)? }
        };
        let mut channels = Vec::new();
        for (index, field) in fields.iter().enumerate().skip(usize::from(has_time)) {
            if field.is_empty() || field.contains('=') {
                continue;
            }
            let (heading, unit) = field.split_once(['(', '[']).unwrap_or((field, "V"));
            let scale = volts_of(unit).ok_or_else(|| bad_field(name, *line, field, unit, "V or mV"))?;
            let heading = heading.trim();
            // Some files have the unit without brackets: `CH1V`.
            let heading = heading
                .strip_suffix('V')
                .filter(|rest| rest.ends_with(|c: char| c.is_ascii_digit()))
                .unwrap_or(heading);
            channels.push((index, heading.to_owned(), scale));
        }
        some(name, *line, channels).map(|channels| Self { time, channels, announced: None, end: *line })
    }

    /// Names over units, the first column the time: `x-axis,1,2` over `second,Volt,Volt`.
    fn two_lines(name: &str, head: &[(u64, Vec<Cow<'_, str>>)]) -> Result<Self, TraceError> {
        let (line, names, units) = first_two(name, head)?;
        check_seconds(name, line, units.first().map_or("", |unit| unit))?;
        let channels = channels(name, line, names, units, 1, |_| true)?;
        Ok(Self { time: Time::Column(0), channels, announced: None, end: line })
    }

    /// Lines of key and value, then a line that begins with `start`, then rows.
    fn below(name: &str, head: &[(u64, Vec<Cow<'_, str>>)], start: &str) -> Result<Self, TraceError> {
        let is_start = |fields: &[Cow<'_, str>]| fields.first().is_some_and(|field| field.eq_ignore_ascii_case(start));
        let Some(at) = head.iter().position(|(_, fields)| is_start(fields)) else {
            let line = head.last().map_or(1, |(line, _)| *line);
            return Err(bad_field(name, line, start, "missing", "a line that begins with it, above the rows"));
        };
        let (line, fields) = &head[at];
        let keys = &head[..at];
        let of_key =
            |key: &str| keys.iter().find(|(_, fields)| fields.first().is_some_and(|f| f.eq_ignore_ascii_case(key)));
        let announced = match of_key("Record Length") {
            Some((line, fields)) => Some((*line, count(name, *line, fields.get(1).map_or("", |field| field))?)),
            None => None,
        };
        if let Some((line, fields)) = of_key("Horizontal Units") {
            check_seconds(name, *line, fields.get(1).map_or("", |field| field))?;
        }
        let named = start == "time";
        let sources: Vec<&Cow<'_, str>> = of_key("Source")
            .map(|(_, fields)| fields[1..].iter().filter(|f| !f.is_empty()).collect())
            .unwrap_or_default();
        let units = of_key("Vertical Units").map(|(line, fields)| (*line, &fields[1..]));
        let mut channels = Vec::new();
        for (index, field) in fields.iter().enumerate().skip(1).filter(|(_, field)| !field.is_empty()) {
            let ordinal = channels.len();
            let heading = match sources.get(ordinal) {
                _ if named => field.to_string(),
                Some(source) => source.to_string(),
                None => format!("CH{}", ordinal + 1),
            };
            // `CH1:V`, or `V` alone.
            let said =
                units.and_then(|(line, units)| Some((line, units.get(ordinal).filter(|unit| !unit.is_empty())?)));
            let (line, unit) = match said {
                Some((line, unit)) => (line, unit.rsplit(':').next().unwrap_or(unit)),
                None if named => (*line, "V"),
                None => (*line, &**field),
            };
            let scale = volts_of(unit).ok_or_else(|| bad_field(name, line, "Vertical Units", unit, "V or mV"))?;
            channels.push((index, heading, scale));
        }
        some(name, *line, channels).map(|channels| Self { time: Time::Column(0), channels, announced, end: *line })
    }

    /// Keys and values in the first columns of the rows; time and volts in the fourth and fifth.
    fn beside(name: &str, head: &[(u64, Vec<Cow<'_, str>>)]) -> Result<Self, TraceError> {
        let of_key = |key: &str| {
            let found = head.iter().find(|(_, fields)| fields.first().is_some_and(|f| f.eq_ignore_ascii_case(key)));
            found.and_then(|(line, fields)| Some((*line, fields.get(1)?)))
        };
        let announced = match of_key("Record Length") {
            Some((line, text)) => Some((line, count(name, line, text)?)),
            None => None,
        };
        if let Some((line, unit)) = of_key("Horizontal Units") {
            check_seconds(name, line, unit)?;
        }
        let scale = match of_key("Vertical Units") {
            Some((line, unit)) => {
                volts_of(unit).ok_or_else(|| bad_field(name, line, "Vertical Units", unit, "V or mV"))?
            }
            None => 1.0,
        };
        let channel = of_key("Source").map_or_else(|| "CH1".into(), |(_, source)| source.to_string());
        Ok(Self { time: Time::Column(3), channels: vec![(4, channel, scale)], announced, end: 0 })
    }
}

type TwoRows<'a> = (u64, &'a [Cow<'a, str>], &'a [Cow<'a, str>]);

fn first_two<'a>(name: &str, head: &'a [(u64, Vec<Cow<'_, str>>)]) -> Result<TwoRows<'a>, TraceError> {
    match head {
        [(_, names), (line, units), ..] => Ok((*line, names, units)),
        _ => Err(TraceError::new(name, None, Fault::Empty)),
    }
}

fn bad_field(name: &str, line: u64, field: &str, found: &str, allowed: &str) -> TraceError {
    let found = format!("`{}`", short(found));
    TraceError::new(name, Some(line), Fault::HeaderField { field: short(field), found, allowed: allowed.into() })
}

fn positive(name: &str, line: u64, field: &str, value: f64) -> Result<f64, TraceError> {
    if value > 0.0 {
        return Ok(value);
    }
    Err(bad_field(name, line, field, &value.to_string(), "a number of seconds above 0"))
}

fn check_seconds(name: &str, line: u64, unit: &str) -> Result<(), TraceError> {
    match unit.to_ascii_lowercase().as_str() {
        "s" | "sec" | "second" | "seconds" => Ok(()),
        _ => Err(bad_field(name, line, "the time's unit", unit, "s or second")),
    }
}

/// A number of rows: `Analog:7000`, `2500`, `2.500000e+03`.
fn count(name: &str, line: u64, text: &str) -> Result<u64, TraceError> {
    let number = text.rsplit(':').next().unwrap_or(text);
    match finite(number.trim(), false) {
        Ok(value) if value >= 0.0 && value.fract() == 0.0 => Ok(value as u64),
        _ => Err(bad_field(name, line, "Record Length", text, "a whole number")),
    }
}

fn some<T>(name: &str, line: u64, channels: Vec<T>) -> Result<Vec<T>, TraceError> {
    if channels.is_empty() { Err(TraceError::new(name, Some(line), Fault::NoChannels)) } else { Ok(channels) }
}

/// The channels of a line of names over a line of units; a name that is only a number means the channel of that number.
fn channels(
    name: &str,
    line: u64,
    names: &[Cow<'_, str>],
    units: &[Cow<'_, str>],
    from: usize,
    is_channel: impl Fn(&str) -> bool,
) -> Result<Vec<(usize, String, f64)>, TraceError> {
    let mut channels = Vec::new();
    for (index, heading) in names.iter().enumerate().skip(from) {
        if heading.is_empty() || !is_channel(heading) {
            continue;
        }
        let unit = units.get(index).map_or("", |unit| &**unit);
        let scale = volts_of(unit).ok_or_else(|| bad_field(name, line, heading, unit, "Volt or mV, its unit"))?;
        let bare = heading.parse::<u8>().is_ok();
        channels.push((index, if bare { format!("CH{heading}") } else { heading.to_string() }, scale));
    }
    some(name, line, channels)
}
