//! Reads MCAP (<https://mcap.dev/spec>): joint angles in JSON messages, such as the `/sensor` messages of a capture, and the state of
//! joints that ROS 2 records.
//!
//! A channel has a joint if its first message is a JSON object with a number (or null) of a joint's name (`left_knee_deg`), or if its
//! messages are `sensor_msgs/msg/JointState` in CDR and name a joint (`left_knee_joint`). Other channels are skipped. The column is called
//! `/topic.field`; a map may also use `field` alone. The time is the message's log time, or the stamp in the header of the state of joints;
//! messages of the same time make one row. The times of a capture of the board begin with the zero of its own axis, which it states in its
//! metadata. A null is a missing value, and so is a joint that a message does not name.
//!
//! A file that ends early because its recorder was stopped is read up to its last complete chunk, with a note. The check sum of each
//! chunk is verified before it is used. Chunks may be compressed with zstd or lz4.

mod cdr;
mod chunk;
mod fields;
mod joint_state;
mod message;
mod records;

pub use records::records;

use crate::fault::{Fault, TraceError};
use crate::format::angle_columns::{AngleColumn, Place, in_degrees};
use crate::format::description::{Description, SIGNS};
use crate::format::row_lines::RowLines;
use crate::format::text_table::{check_rows, short};
use crate::format::unit::scaled;
use crate::options::ReadOptions;
use crate::raw::{RawJoints, SignSource};
use cdr::Texts;
use fields::{Chosen, Kind, Seen, Source};
use joint_state::{JointState, Layout};
use joint_units::Joint;
use mcap::records::{MessageHeader, Record};
use message::{check_length, object_of};
use serde_json::Value;
use std::collections::BTreeMap;

/// The row of the table of formats.
pub(crate) const DESCRIPTION: Description = Description {
    name: "MCAP with JSON messages, such as a capture of the board, or with `sensor_msgs/msg/JointState` of ROS 2 (`.mcap`)",
    recognised: "the magic bytes of MCAP; the definition of the messages decides, where there is none the name of the schema",
    units: "a field's end (`left_knee_deg`, `knee_mV`); volts need a calibration; `JointState` is in radians",
    axes: "one field or joint name a joint",
    signs: SIGNS,
    rate: "the log times of the messages; of `JointState` the stamps of their headers",
    options: &["--map", "--topic", "--unit", "--calibration", "--hip-sign", "--knee-sign", "--mirror", "--stride-time"],
};

/// Whether the bytes begin with the magic bytes of MCAP.
#[must_use]
pub fn looks_like(bytes: &[u8]) -> bool {
    bytes.starts_with(mcap::MAGIC)
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
    notes.append(&mut seen.notes);
    let chosen = seen.choose(name, how)?;
    let channels = channels(&seen, &chosen);
    let mut table = Table { seen: &seen, channels, chosen, time_s: Vec::new(), last_ns: None };
    records(name, bytes, |at, record| {
        let Record::Message { header, data } = record else { return Ok(()) };
        table.take(&header, &data).map_err(|fault| match fault {
            Why::Message(what) => TraceError::new(name, None, Fault::Mcap { offset: at, what }),
            Why::Fault(fault) => TraceError::new(name, None, fault),
        })
    })?;
    let (kind, received) = table.describe(&mut notes);
    let Table { chosen, time_s, .. } = table;
    if time_s.len() < 2 {
        return Err(TraceError::new(name, None, Fault::TooFewRows { rows: time_s.len() }));
    }
    let columns = chosen.into_iter().enumerate().map(|(index, chosen)| {
        let Chosen { joint, heading, said, values, .. } = chosen;
        AngleColumn { joint, heading, index, said, sign: SignSource::Unknown, values }
    });
    let place = Place { file: name, header: None, lines: &RowLines::default() };
    let joints = in_degrees(&place, columns.collect(), how, &mut notes)?;
    let count = joints.iter().flatten().count();
    let format = format!("MCAP, {kind}, {count} joints of {} channels", seen.sources.len());
    Ok(RawJoints { file: name.into(), format, time_s, received, joints, notes, doubts: vec![] })
}

/// A channel of which messages are read.
struct OfChannel {
    kind: Kind,
    /// Whether any message of its topic has a stamp.
    has_stamps: bool,
    /// The joints that are chosen from it, by their index.
    joints: Vec<usize>,
    /// The joints of the last message of the state of joints, and the place of each that is chosen among them.
    last_names: Texts,
    places: Vec<Option<usize>>,
    /// Messages with names of joints and no positions.
    without_positions: u64,
}

impl OfChannel {
    /// Stamp and positions of the joints that are chosen; `None` if the message has none of them.
    fn state_of(&mut self, chosen: &[Chosen], data: &[u8], layout: Layout) -> Result<Option<(i64, Values)>, String> {
        check_length(data)?;
        let JointState { stamp_ns, new_names, positions } = JointState::parse(data, layout, &self.last_names)?;
        if let Some(names) = new_names {
            let place = |&n: &usize| names.texts.iter().position(|name| *name == chosen[n].field);
            self.places = self.joints.iter().map(place).collect();
            self.last_names = names;
        }
        if positions.is_empty() {
            self.without_positions += u64::from(!self.last_names.texts.is_empty());
            return Ok(None);
        }
        let mut values = Values::default();
        for (&n, place) in self.joints.iter().zip(&self.places) {
            values[n] = place.map(|place| positions[place]);
        }
        Ok(values.iter().any(Option::is_some).then_some((stamp_ns, values)))
    }
}

/// The channels that hold joints that are chosen.
fn channels(seen: &Seen, chosen: &[Chosen]) -> BTreeMap<u16, OfChannel> {
    let of_source = |(&channel, source): (&u16, &Source)| {
        let joints: Vec<usize> = (0..chosen.len()).filter(|&n| seen.are_one(chosen[n].channel, channel)).collect();
        let of = OfChannel {
            kind: source.kind,
            has_stamps: has_stamps(seen, source),
            joints,
            last_names: Texts::default(),
            places: Vec::new(),
            without_positions: 0,
        };
        (!of.joints.is_empty()).then_some((channel, of))
    };
    seen.sources.iter().filter_map(of_source).collect()
}

/// Whether any message of a topic has a stamp.
fn has_stamps(seen: &Seen, source: &Source) -> bool {
    seen.sources.values().any(|other| other.topic == source.topic && other.stamped > 0)
}

/// The rows that are read.
struct Table<'a> {
    seen: &'a Seen,
    channels: BTreeMap<u16, OfChannel>,
    chosen: Vec<Chosen>,
    time_s: Vec<f64>,
    /// Time of the last row, nanoseconds.
    last_ns: Option<i128>,
}

/// Numbers of a message by the index of the joint that is chosen; none for a joint that it does not have.
type Values = [Option<f64>; Joint::COUNT];

/// What is wrong with a message, or with the table.
enum Why {
    Message(String),
    Fault(Fault),
}

impl Table<'_> {
    fn take(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), Why> {
        let Some(channel) = self.channels.get_mut(&header.channel_id) else { return Ok(()) };
        let message = |why| Why::Message(format!("message: {why}"));
        let (time_ns, values) = match channel.kind {
            Kind::JointState(layout) => {
                let Some((stamp_ns, values)) = channel.state_of(&self.chosen, data, layout).map_err(message)? else {
                    return Ok(());
                };
                (if channel.has_stamps { i128::from(stamp_ns) } else { i128::from(header.log_time) }, values)
            }
            Kind::Json => {
                let values = object_values(&self.chosen, &channel.joints, data)?;
                (i128::from(header.log_time) - i128::from(self.seen.zero_ns), values)
            }
            Kind::Other => return Ok(()),
        };
        let taken = |chosen: &Chosen| {
            chosen.values.len() == self.time_s.len() && chosen.values.last().is_some_and(|v| !v.is_nan())
        };
        let has = |(value, chosen): (Option<f64>, &Chosen)| value.is_some() && taken(chosen);
        let joins = self.last_ns == Some(time_ns) && !values.into_iter().zip(&self.chosen).any(has);
        if !joins {
            check_rows(self.time_s.len()).map_err(Why::Fault)?;
            self.time_s.push(time_ns as f64 / 1e9);
            for chosen in &mut self.chosen {
                chosen.values.push(f64::NAN);
            }
            self.last_ns = Some(time_ns);
        }
        for (value, chosen) in values.into_iter().zip(&mut self.chosen) {
            if let (Some(value), Some(last)) = (value, chosen.values.last_mut()) {
                *last = value;
            }
        }
        Ok(())
    }

    /// The kind of the messages that were read, and whether their times are those of receipt, with notes on those that were not read.
    fn describe(&self, notes: &mut Vec<String>) -> (&'static str, bool) {
        let is_read = |channel: u16| self.chosen.iter().any(|chosen| self.seen.are_one(chosen.channel, channel));
        let sources = || self.seen.sources.iter().map(|(&channel, source)| (is_read(channel), source));
        let states = |(is_read, source): &(bool, &Source)| *is_read && matches!(source.kind, Kind::JointState(_));
        if !sources().any(|source| states(&source)) {
            return ("JSON", false);
        }
        let mut without_stamps: Vec<&str> = sources()
            .filter(states)
            .filter(|(_, source)| !has_stamps(self.seen, source))
            .map(|(_, source)| &*source.topic)
            .collect();
        without_stamps.dedup();
        let received = !without_stamps.is_empty();
        for topic in without_stamps {
            let topic = short(topic);
            notes.push(format!(
                "No header of `{topic}` has a stamp; the times are those at which the messages were received."
            ));
        }
        let without_positions: u64 = self.channels.values().map(|channel| channel.without_positions).sum();
        if without_positions > 0 {
            notes.push(format!("{without_positions} messages have no positions and are left out."));
        }
        let mut others: BTreeMap<&str, u64> = BTreeMap::new();
        for (_, source) in sources().filter(|(is_read, source)| !is_read && source.messages > 0) {
            *others.entry(&source.topic).or_default() += source.messages;
        }
        let ignored: u64 = others.values().sum();
        match others.keys().collect::<Vec<_>>().as_slice() {
            [] => {}
            [topic] => notes.push(format!("{ignored} messages of `{}` are not read.", short(topic))),
            topics => notes.push(format!("{ignored} messages of {} other topics are not read.", topics.len())),
        }
        ("ROS 2 JointState", received)
    }
}

/// The numbers of the fields that are chosen; NaN for a field that is missing.
fn object_values(chosen: &[Chosen], of: &[usize], data: &[u8]) -> Result<Values, Why> {
    let object = object_of(data).map_err(|why| Why::Message(format!("message: {why}")))?;
    let mut values = Values::default();
    for &n in of {
        let chosen = &chosen[n];
        values[n] = Some(match object.get(&chosen.field) {
            None | Some(Value::Null) => f64::NAN,
            Some(Value::Number(number)) => scaled(&number.to_string(), false, chosen.power).unwrap_or(f64::NAN),
            Some(other) => {
                let found = short(&other.to_string());
                return Err(Why::Message(format!("`{}` is {found}; allowed is a number or null", chosen.heading)));
            }
        });
    }
    Ok(values)
}
