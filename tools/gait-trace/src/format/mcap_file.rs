//! Reads MCAP (<https://mcap.dev/spec>): joint angles in JSON messages, such as the `/sensor` messages of a capture.
//!
//! A channel has a joint if its first message is a JSON object with a number (or null) of a joint's name (`left_knee_deg`). Other
//! channels are skipped. The column is called `/topic.field`; a map may also use `field` alone. The time is the message's log time;
//! messages of the same time make one row. A null is a missing value.
//!
//! A file that ends early because its recorder was stopped is read up to its last complete chunk, with a note. The check sum of each
//! chunk is verified before it is used. Compressed chunks are refused.

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::description::{Description, SIGNS};
use crate::format::joint_names::{joint_of, unit_of};
use crate::format::text_table::{check_rows, column_called, listed, short};
use crate::format::unit::{Said, scaled, volts_in, volts_of};
use crate::options::ReadOptions;
use crate::raw::RawJoints;
use joint_units::Joint;
use mcap::records::{Channel, Record};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Longest message with joints, bytes.
const MAX_MESSAGE: usize = 64 * 1024;

/// Largest number of fields of all channels together.
const MAX_FIELDS: usize = 4096;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "MCAP with JSON messages, such as a capture of the board (`.mcap`)",
    recognised: "the magic bytes of MCAP",
    units: "a field's end (`left_knee_deg`, `knee_mV`); volts need a calibration",
    axes: "one field a joint",
    signs: SIGNS,
    rate: "the log times of the messages",
    said: "a file without an end record; lost samples; degrees or radians by the values, where a field has no unit; volts, where a calibration is given",
    options: &["--map", "--unit", "--calibration", "--knee-sign", "--stride-time"],
};

/// Whether the bytes begin with the magic bytes of MCAP.
#[must_use]
pub fn looks_like(bytes: &[u8]) -> bool {
    bytes.starts_with(mcap::MAGIC)
}

/// A joint and the field of a channel that holds it.
struct Chosen {
    joint: Joint,
    channel: u16,
    field: String,
    heading: String,
    said: Said,
    /// The numbers are in units of `10^power`.
    power: i32,
    values: Vec<f64>,
}

/// A field of a channel's first message that may be a joint.
struct Field {
    channel: u16,
    name: String,
    heading: String,
}

/// Reads the bytes of an MCAP file.
///
/// # Errors
/// The first fault of the file, with its place.
pub fn parse(name: &str, bytes: &[u8], how: &ReadOptions<'_>) -> Result<RawJoints, TraceError> {
    let mut notes = Vec::new();
    if how.rate_hz.is_some() {
        let has = "the log times of its messages".into();
        return Err(TraceError::new(name, None, Fault::RateAndTime { has }));
    }
    let mut seen = Seen::default();
    let cut = records(name, bytes, |at, record| seen.take(name, at, record))?;
    if let Some(messages) = cut.then_some(seen.messages) {
        let read = format!("the {messages} messages up to the last complete chunk are read");
        notes.push(format!("The file has no end record (recorder stopped, or file cut off); {read}."));
    }
    if let Some(lost) = seen.lost.filter(|&lost| lost > 0) {
        notes.push(format!("The capture reports {lost} lost samples; they are missing values."));
    }
    let mut chosen = choose(name, &seen, how)?;
    let mut time_s: Vec<f64> = Vec::new();
    let mut last: Option<u64> = None;
    records(name, bytes, |at, record| {
        let Record::Message { header, data } = record else { return Ok(()) };
        if !chosen.iter().any(|chosen| chosen.channel == header.channel_id) {
            return Ok(());
        }
        let object = object_of(&data)
            .map_err(|why| TraceError::new(name, None, Fault::Mcap { offset: at, what: format!("message: {why}") }))?;
        let of_channel = |chosen: &&mut Chosen| chosen.channel == header.channel_id;
        let taken =
            |chosen: &Chosen| chosen.values.len() == time_s.len() && chosen.values.last().is_some_and(|v| !v.is_nan());
        let joins = last == Some(header.log_time)
            && !chosen.iter().filter(|chosen| chosen.channel == header.channel_id).any(taken);
        if !joins {
            check_rows(time_s.len()).map_err(|fault| TraceError::new(name, None, fault))?;
            time_s.push(header.log_time as f64 / 1e9);
            for chosen in &mut chosen {
                chosen.values.push(f64::NAN);
            }
            last = Some(header.log_time);
        }
        for chosen in chosen.iter_mut().filter(of_channel) {
            let value = match object.get(&chosen.field) {
                None | Some(Value::Null) => f64::NAN,
                Some(Value::Number(number)) => scaled(&number.to_string(), false, chosen.power).unwrap_or(f64::NAN),
                Some(other) => {
                    let what =
                        format!("`{}` is {}; allowed is a number or null", chosen.heading, short(&other.to_string()));
                    return Err(TraceError::new(name, None, Fault::Mcap { offset: at, what }));
                }
            };
            if let Some(last) = chosen.values.last_mut() {
                *last = value;
            }
        }
        Ok(())
    })?;
    if time_s.len() < 2 {
        return Err(TraceError::new(name, None, Fault::TooFewRows { rows: time_s.len() }));
    }
    let columns = chosen.into_iter().enumerate().map(|(index, chosen)| {
        let Chosen { joint, heading, said, values, .. } = chosen;
        AngleColumn { joint, heading, index, said, values }
    });
    let place = Place { file: name, header: None, lines: &[] };
    let joints = in_degrees(&place, columns.collect(), how, &mut notes)?;
    let count = joints.iter().flatten().count();
    let format = format!("MCAP, JSON, {count} joints of {} channels", seen.channels.len());
    Ok(RawJoints { file: name.into(), format, time_s, joints, notes })
}

/// Channels, fields and counts of a file.
#[derive(Default)]
struct Seen {
    channels: BTreeMap<u16, Channel>,
    /// Channels whose first message was read.
    known: BTreeMap<u16, ()>,
    fields: Vec<Field>,
    messages: u64,
    lost: Option<u64>,
}

impl Seen {
    fn take(&mut self, name: &str, at: u64, record: Record<'_>) -> Result<(), TraceError> {
        match record {
            Record::Channel(channel) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            Record::Metadata(metadata) if metadata.name == "end" => {
                self.lost = metadata.metadata.get("lost_samples").and_then(|text| text.parse().ok());
            }
            Record::Message { header, data } => {
                self.messages += 1;
                if self.known.insert(header.channel_id, ()).is_some() {
                    return Ok(());
                }
                let fault = |what| TraceError::new(name, None, Fault::Mcap { offset: at, what });
                let Some(channel) = self.channels.get(&header.channel_id) else {
                    return Err(fault(format!(
                        "a message of channel {}, which no earlier record defines",
                        header.channel_id
                    )));
                };
                if channel.message_encoding != "json" {
                    return Ok(());
                }
                let Ok(object) = object_of(&data) else { return Ok(()) };
                for (field, value) in &object {
                    if !matches!(value, Value::Number(_) | Value::Null) {
                        continue;
                    }
                    if self.fields.len() == MAX_FIELDS {
                        return Err(fault(format!("more than {MAX_FIELDS} fields; allowed are up to that")));
                    }
                    let heading = format!("{}.{field}", channel.topic);
                    self.fields.push(Field { channel: header.channel_id, name: field.clone(), heading });
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Chooses the field of each joint.
fn choose(name: &str, seen: &Seen, how: &ReadOptions<'_>) -> Result<Vec<Chosen>, TraceError> {
    let fault = |fault| TraceError::new(name, None, fault);
    let headings: Vec<&str> = seen.fields.iter().map(|field| field.heading.as_str()).collect();
    let names: Vec<&str> = seen.fields.iter().map(|field| field.name.as_str()).collect();
    let mut chosen = Vec::new();
    for joint in Joint::ALL {
        let index = match how.column_of(joint) {
            Some(wanted) => {
                Some(column_called(&headings, wanted).or_else(|| column_called(&names, wanted)).ok_or_else(|| {
                    fault(Fault::MapColumn { joint: joint.name(), wanted: wanted.into(), have: listed(&headings) })
                })?)
            }
            None => {
                let mut found =
                    (0..names.len()).filter(|&index| joint_of(names[index]).is_some_and(|(of, _)| of == joint));
                let index = found.next();
                if let (Some(index), Some(other)) = (index, found.next()) {
                    let (first, second) = (short(headings[index]), short(headings[other]));
                    return Err(fault(Fault::TwoColumns { joint: joint.name(), first, second }));
                }
                index
            }
        };
        if let Some(index) = index {
            let Field { channel, name, heading } = &seen.fields[index];
            let (field, heading) = (name.clone(), heading.clone());
            let (said, power) = unit_in(&field);
            chosen.push(Chosen { joint, channel: *channel, field, heading, said, power, values: Vec::new() });
        }
    }
    if chosen.is_empty() {
        let channel = |channel: &Channel| format!("{} ({})", channel.topic, channel.message_encoding);
        let have = if headings.is_empty() {
            format!("the channels {}", listed(&seen.channels.values().map(channel).collect::<Vec<_>>()))
        } else {
            listed(&headings)
        };
        return Err(fault(Fault::NoJoints { have }));
    }
    Ok(chosen)
}

/// The unit that a field's name has, and its power of ten.
fn unit_in(field: &str) -> (Said, i32) {
    // A lone `v` is as likely a speed.
    if let Some(power) = volts_in(field).or_else(|| volts_of(field).filter(|_| field.len() > 1)) {
        return (Said::Volts, power);
    }
    let unit = joint_of(field).and_then(|(_, unit)| unit).or_else(|| unit_of(field));
    (unit.map_or(Said::Nothing, Said::Unit), 0)
}

fn object_of(data: &[u8]) -> Result<Map<String, Value>, String> {
    if data.len() > MAX_MESSAGE {
        return Err(format!("{} bytes; allowed are up to {MAX_MESSAGE}", data.len()));
    }
    serde_json::from_slice(data).map_err(|error| {
        format!("is not a JSON object ({error}); allowed is an object such as {{\"left_knee_deg\": 12.5}}")
    })
}

/// Calls `take` with each record, also those in chunks, and the number of bytes read. Returns whether the file ends without an end record.
fn records(
    name: &str,
    bytes: &[u8],
    mut take: impl FnMut(u64, Record<'_>) -> Result<(), TraceError>,
) -> Result<bool, TraceError> {
    let options =
        LinearReaderOptions::default().with_prevalidate_chunk_crcs(true).with_record_length_limit(bytes.len());
    let mut reader = LinearReader::new_with_options(options);
    let mut given = 0;
    loop {
        let fault = |what| TraceError::new(name, None, Fault::Mcap { offset: given as u64, what });
        match reader.next_event() {
            None => return Ok(false),
            Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                let rest = bytes.get(given..).unwrap_or_default();
                let more = wanted.min(rest.len());
                reader.insert(more)[..more].copy_from_slice(&rest[..more]);
                reader.notify_read(more);
                given += more;
            }
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                let record = parse_record(opcode, data).map_err(|error| fault(words(&error)))?;
                take(given as u64, record)?;
            }
            Some(Err(McapError::UnexpectedEof)) => return Ok(true),
            Some(Err(McapError::RecordTooLarge { .. } | McapError::ChunkTooLarge(_))) => {
                return Err(fault(
                    "a record is longer than the whole file; allowed is up to the length of the file (is it cut off?)"
                        .into(),
                ));
            }
            Some(Err(McapError::UnsupportedCompression(how))) => {
                let what = format!(
                    "a chunk is compressed with {how}; allowed are uncompressed chunks: convert it with `mcap compress --compression none`"
                );
                return Err(fault(what));
            }
            Some(Err(error)) => return Err(fault(words(&error))),
        }
    }
}

/// The text of a format error, with its cause.
fn words(error: &McapError) -> String {
    match error {
        McapError::Parse(why) => format!("a record cannot be parsed: {}", short(&why.to_string().replace('\n', " "))),
        McapError::Io(why) => format!("a record cannot be read: {why}"),
        error => error.to_string(),
    }
}
