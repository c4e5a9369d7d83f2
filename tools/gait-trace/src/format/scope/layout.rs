//! Parses the headers of oscilloscope exports: the source of the time, and the channels with their units.

use super::dialect::{Dialect, MAX_HEADER_LINES};
use crate::fault::{Fault, TraceError};
use crate::format::text_table::{Delimiter, finite, lines, short};
use crate::format::time_names::time_of;
use crate::format::unit::{scaled, seconds_of, volts_of};
use joint_units::Joint;
use std::borrow::Cow;

/// Source of a row's time.
pub(super) enum Time {
    /// A column of times in units of `10^power` seconds.
    Column { index: usize, power: i32 },
    /// A start and equal steps.
    Steps { start_s: f64, step_s: f64 },
}

/// The lines of a header: number and fields.
type Head<'a> = [(u64, Vec<Cow<'a, str>>)];

/// The parsed header.
pub(super) struct Layout {
    pub(super) time: Time,
    /// Index, name and power of ten of volts of each channel.
    pub(super) channels: Vec<(usize, String, i32)>,
    /// Line and number of rows that the header announces.
    pub(super) announced: Option<(u64, u64)>,
    /// Time step that the header announces, seconds.
    pub(super) interval_s: Option<f64>,
    /// Last line of the header; 0 if the header is beside the rows.
    pub(super) end: u64,
}

impl Layout {
    pub(super) fn parse(
        name: &str,
        text: &str,
        dialect: Dialect,
        delimiter: Delimiter,
        notes: &mut Vec<String>,
    ) -> Result<Self, TraceError> {
        let mut head = Vec::new();
        for row in lines(name, text).take(MAX_HEADER_LINES) {
            let (line, row) = row?;
            let fields = delimiter.fields(row).map_err(|fault| TraceError::new(name, Some(line), fault))?;
            if !row.trim().is_empty() {
                head.push((line, fields));
            }
        }
        match dialect {
            Dialect::RigolSequence => Self::sequence(name, &head, 1),
            Dialect::RigolSteps => Self::sequence(name, &head, 0),
            Dialect::RigolInline => Self::inline(name, &head),
            Dialect::RigolTime | Dialect::Keysight => Self::two_lines(name, &head),
            Dialect::KeysightOneLine => Self::one_line(name, &head, notes),
            Dialect::Siglent => Self::below(name, &head, "second"),
            Dialect::Tektronix => Self::below(name, &head, "time"),
            Dialect::TektronixSideBySide => Self::beside(name, &head),
        }
    }

    /// The channel that a map names, by its name or by the number of its column from 1, as an index of [`Self::channels`].
    pub(super) fn channel_called(&self, joint: Joint, wanted: &str) -> Result<usize, Fault> {
        let named =
            |exact: bool| {
                self.channels.iter().position(|(_, channel, _)| {
                    if exact { channel == wanted } else { channel.eq_ignore_ascii_case(wanted) }
                })
            };
        let column = wanted.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        if let (Time::Column { index, .. }, None) = (&self.time, named(false))
            && column == Some(*index)
        {
            return Err(Fault::TimeAsJoint { joint: joint.name() });
        }
        let numbered = || self.channels.iter().position(|(index, ..)| Some(*index) == column);
        named(true).or_else(|| named(false)).or_else(numbered).ok_or_else(|| {
            let place =
                |(index, channel, _): &(usize, String, i32)| format!("`{}` in column {}", short(channel), index + 1);
            let have = self.channels.iter().map(place).collect::<Vec<_>>().join(", ");
            Fault::MapColumn { joint: joint.name(), wanted: wanted.into(), have }
        })
    }

    /// `X,CH1,Start,Increment` over `Sequence,Volt,<s>,<s>`, or the same without the first column: `from` is that of the first channel.
    fn sequence(name: &str, head: &Head<'_>, from: usize) -> Result<Self, TraceError> {
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
        let channels = channels(name, line, names, units, from, is_channel)?;
        Ok(Self { time, channels, announced: None, interval_s: None, end: line })
    }

    /// `Time(s),CH1(V),t0 = <s>, tInc = <s>`.
    fn inline(name: &str, head: &Head<'_>) -> Result<Self, TraceError> {
        let Some((line, fields)) = head.first() else { return Err(TraceError::new(name, None, Fault::Empty)) };
        let value = |wanted: &str| {
            let field = fields.iter().find_map(|field| {
                let (key, value) = field.split_once('=')?;
                key.trim().eq_ignore_ascii_case(wanted).then(|| value.trim().trim_end_matches('s'))
            });
            let found = field.unwrap_or("missing");
            finite(found, false).map_err(|_| bad_field(name, *line, wanted, found, "a number of seconds"))
        };
        let heading = fields.first().filter(|field| field.to_ascii_lowercase().starts_with("time"));
        let has_time = heading.is_some();
        let time = if let Some(heading) = heading {
            let power = time_of(heading).map(|power| power.unwrap_or(0));
            let unit = || bad_field(name, *line, heading, heading, "Time(s), Time(ms), Time(us) or Time(ns)");
            Time::Column { index: 0, power: power.ok_or_else(unit)? }
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
            let power = volts_of(unit).ok_or_else(|| bad_field(name, *line, field, unit, "V or mV"))?;
            let heading = heading.trim();
            // Some files have the unit without brackets: `CH1V`.
            let heading = heading
                .strip_suffix('V')
                .filter(|rest| rest.ends_with(|c: char| c.is_ascii_digit()))
                .unwrap_or(heading);
            channels.push((index, heading.to_owned(), power));
        }
        some(name, *line, channels).map(|channels| Self {
            time,
            channels,
            announced: None,
            interval_s: None,
            end: *line,
        })
    }

    /// Names over units, the first column the time: `x-axis,1,2` over `second,Volt,Volt`.
    fn two_lines(name: &str, head: &Head<'_>) -> Result<Self, TraceError> {
        let (line, names, units) = first_two(name, head)?;
        let power = time_unit(name, line, units.first().map_or("", |unit| unit))?;
        let channels = channels(name, line, names, units, 1, |_| true)?;
        Ok(Self { time: Time::Column { index: 0, power }, channels, announced: None, interval_s: None, end: line })
    }

    /// One line of names, the first column the time in seconds: `sec,Volt1,Volt2`, or `x_axis,channel_1`.
    fn one_line(name: &str, head: &Head<'_>, notes: &mut Vec<String>) -> Result<Self, TraceError> {
        let Some((line, fields)) = head.first() else { return Err(TraceError::new(name, None, Fault::Empty)) };
        let first = fields.first().map_or("", |field| field);
        if seconds_of(first).is_none() {
            notes
                .push(format!("`{}` and the channels name no unit; they are read as seconds and volts.", short(first)));
        }
        let named = |(index, field): (usize, &Cow<'_, str>)| {
            let bare = field.parse::<u8>().is_ok();
            (!field.is_empty()).then(|| (index, if bare { format!("CH{field}") } else { field.to_string() }, 0))
        };
        let channels = fields.iter().enumerate().skip(1).filter_map(named).collect();
        let power = seconds_of(first).unwrap_or(0);
        some(name, *line, channels).map(|channels| Self {
            time: Time::Column { index: 0, power },
            channels,
            announced: None,
            interval_s: None,
            end: *line,
        })
    }

    /// Lines of key and value, then a line that begins with `start`, then rows.
    fn below(name: &str, head: &Head<'_>, start: &str) -> Result<Self, TraceError> {
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
        let named = start == "time";
        // `Second` is the unit of the column below it; there `Horizontal Units` is that of the screen, often `us`.
        let power = match of_key("Horizontal Units").filter(|_| named) {
            Some((line, fields)) => time_unit(name, *line, fields.get(1).map_or("", |field| field))?,
            None => 0,
        };
        let interval_s = of_key("Sample Interval").and_then(|(_, fields)| {
            let text = fields.get(1)?;
            scaled(text.rsplit(':').next()?.trim(), false, power).ok().filter(|interval| *interval > 0.0)
        });
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
            // Siglent writes `Value` above the volts.
            let unit = if unit.eq_ignore_ascii_case("value") { "V" } else { unit };
            let power = volts_of(unit).ok_or_else(|| bad_field(name, line, "Vertical Units", unit, "V or mV"))?;
            channels.push((index, heading, power));
        }
        let time = Time::Column { index: 0, power };
        some(name, *line, channels).map(|channels| Self { time, channels, announced, interval_s, end: *line })
    }

    /// Keys and values in the first columns of the rows; time and volts in the fourth and fifth.
    fn beside(name: &str, head: &Head<'_>) -> Result<Self, TraceError> {
        let of_key = |key: &str| {
            let found = head.iter().find(|(_, fields)| fields.first().is_some_and(|f| f.eq_ignore_ascii_case(key)));
            found.and_then(|(line, fields)| Some((*line, fields.get(1)?)))
        };
        let announced = match of_key("Record Length") {
            Some((line, text)) => Some((line, count(name, line, text)?)),
            None => None,
        };
        let power = match of_key("Horizontal Units") {
            Some((line, unit)) => time_unit(name, line, unit)?,
            None => 0,
        };
        let time = Time::Column { index: 3, power };
        let volts = match of_key("Vertical Units") {
            Some((line, unit)) => {
                volts_of(unit).ok_or_else(|| bad_field(name, line, "Vertical Units", unit, "V or mV"))?
            }
            None => 0,
        };
        let channel = of_key("Source").map_or_else(|| "CH1".into(), |(_, source)| source.to_string());
        Ok(Self { time, channels: vec![(4, channel, volts)], announced, interval_s: None, end: 0 })
    }
}

type TwoRows<'a> = (u64, &'a [Cow<'a, str>], &'a [Cow<'a, str>]);

fn first_two<'a>(name: &str, head: &'a Head<'_>) -> Result<TwoRows<'a>, TraceError> {
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

/// The power of ten of the time's unit.
fn time_unit(name: &str, line: u64, unit: &str) -> Result<i32, TraceError> {
    seconds_of(unit).ok_or_else(|| bad_field(name, line, "the time's unit", unit, "s or second, ms, us or ns"))
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
) -> Result<Vec<(usize, String, i32)>, TraceError> {
    let mut channels = Vec::new();
    for (index, heading) in names.iter().enumerate().skip(from) {
        if heading.is_empty() || !is_channel(heading) {
            continue;
        }
        let unit = units.get(index).map_or("", |unit| &**unit);
        let power = volts_of(unit).ok_or_else(|| bad_field(name, line, heading, unit, "Volt or mV, its unit"))?;
        let bare = heading.parse::<u8>().is_ok();
        channels.push((index, if bare { format!("CH{heading}") } else { heading.to_string() }, power));
    }
    some(name, line, channels)
}
