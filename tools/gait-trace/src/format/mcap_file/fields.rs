//! What an MCAP file has: its channels, the fields that may be joints, and the field that is chosen for each joint.

use crate::fault::{Fault, TraceError};
use crate::format::angle_unit::AngleUnit;
use crate::format::choice::columns;
use crate::format::joint_names::{joint_of, unit_of};
use crate::format::mcap_file::cdr::Texts;
use crate::format::mcap_file::joint_state::{JointState, Layout, layout_of};
use crate::format::mcap_file::message::object_of;
use crate::format::text_table::{listed, short};
use crate::format::unit::{Said, volts_in, volts_of};
use crate::options::ReadOptions;
use joint_units::Joint;
use mcap::records::{Channel, Record, SchemaHeader};
use serde_json::Value;
use std::collections::{BTreeMap, HashSet};

/// Largest number of fields of all channels together.
const MAX_FIELDS: usize = 4096;
/// Longest name of a topic, bytes.
const MAX_TOPIC: usize = 1024;

/// What the messages of a channel are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// JSON objects.
    Json,
    /// The state of joints of ROS 2.
    JointState(Layout),
    /// Messages that are not read.
    Other,
}

/// A channel: messages of one topic and one kind.
pub(super) struct Source {
    pub(super) topic: String,
    pub(super) kind: Kind,
    /// Kind of its messages in words, for errors.
    words: String,
    pub(super) messages: u64,
    /// Messages of the state of joints that have a stamp.
    pub(super) stamped: u64,
    /// The joints of the last message of the state of joints: nearly always those of the next one.
    last_names: Texts,
}

/// A field of a channel's messages that may be a joint.
struct Field {
    channel: u16,
    name: String,
    heading: String,
}

/// A joint and the field that holds it.
pub(super) struct Chosen {
    pub(super) joint: Joint,
    /// A channel of the topic that holds it.
    pub(super) channel: u16,
    pub(super) field: String,
    pub(super) heading: String,
    pub(super) said: Said,
    /// The numbers are in units of `10^power`.
    pub(super) power: i32,
    pub(super) values: Vec<f64>,
}

/// Channels, fields and counts of a file.
#[derive(Default)]
pub(super) struct Seen {
    schemas: BTreeMap<u16, Result<Option<Layout>, String>>,
    pub(super) sources: BTreeMap<u16, Source>,
    fields: Vec<Field>,
    /// Joints of topics with the state of joints that are among the fields.
    names: HashSet<(String, String)>,
    pub(super) messages: u64,
    pub(super) lost: Option<u64>,
    /// Unix time of the zero of a capture's axis, ns; 0 in other files.
    pub(super) zero_ns: u64,
    pub(super) notes: Vec<String>,
}

impl Seen {
    pub(super) fn take(&mut self, name: &str, at: u64, record: Record<'_>) -> Result<(), TraceError> {
        let fault = |what| TraceError::new(name, None, Fault::Mcap { offset: at, what });
        match record {
            Record::Schema { header: SchemaHeader { id, name, encoding }, data } => {
                self.schemas.entry(id).or_insert_with(|| layout_of(&name, &encoding, &data));
            }
            Record::Channel(channel) => self.take_channel(channel).map_err(fault)?,
            Record::Metadata(metadata) if metadata.name == "end" => {
                self.lost = metadata.metadata.get("lost_samples").and_then(|text| text.parse().ok());
            }
            Record::Metadata(metadata) if metadata.name == "clock" => {
                let zero = metadata.metadata.get("zero_unix_ns").and_then(|text| text.parse().ok());
                self.zero_ns = zero.unwrap_or(0);
            }
            Record::Message { header, data } => {
                self.messages += 1;
                let channel = header.channel_id;
                let Some(source) = self.sources.get_mut(&channel) else {
                    return Err(fault(format!("a message of channel {channel}, which no earlier record defines")));
                };
                source.messages += 1;
                let fields = match source.kind {
                    Kind::Json if source.messages == 1 => numbers_of(&data),
                    // A message that cannot be read is an error where it is used.
                    Kind::JointState(layout) => match JointState::parse(&data, layout, &source.last_names) {
                        Ok(state) => {
                            source.stamped += u64::from(state.stamp_ns != 0);
                            state.new_names.map_or_else(Vec::new, |names| {
                                source.last_names = names;
                                let is_new =
                                    |name: &&String| self.names.insert((source.topic.clone(), (*name).clone()));
                                source.last_names.texts.iter().filter(is_new).cloned().collect()
                            })
                        }
                        Err(_) => Vec::new(),
                    },
                    _ => Vec::new(),
                };
                for name in fields {
                    if self.fields.len() == MAX_FIELDS {
                        return Err(fault(format!("more than {MAX_FIELDS} fields; allowed are up to that")));
                    }
                    let heading = format!("{}.{name}", source.topic);
                    self.fields.push(Field { channel, name, heading });
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn take_channel(&mut self, channel: Channel) -> Result<(), String> {
        let Channel { id, topic, schema_id, message_encoding, .. } = channel;
        if topic.len() > MAX_TOPIC {
            return Err(format!("the name of a topic has {} bytes; allowed are up to {MAX_TOPIC}", topic.len()));
        }
        if self.sources.contains_key(&id) {
            return Ok(());
        }
        let kind = match (message_encoding.as_str(), self.schemas.get(&schema_id)) {
            ("json", _) => Kind::Json,
            ("cdr", Some(Ok(Some(layout)))) => Kind::JointState(*layout),
            ("cdr", Some(Err(why))) => {
                self.notes.push(format!("`{}` is not read: {why}.", short(&topic)));
                Kind::Other
            }
            _ => Kind::Other,
        };
        let words = short(&message_encoding);
        self.sources.insert(id, Source { topic, kind, words, messages: 0, stamped: 0, last_names: Texts::default() });
        Ok(())
    }

    /// Whether two channels have one topic and one kind of messages.
    pub(super) fn are_one(&self, a: u16, b: u16) -> bool {
        let is_state = |source: &Source| matches!(source.kind, Kind::JointState(_));
        match (self.sources.get(&a), self.sources.get(&b)) {
            _ if a == b => true,
            (Some(a), Some(b)) => a.topic == b.topic && is_state(a) && is_state(b),
            _ => false,
        }
    }

    /// Chooses the field of each joint.
    pub(super) fn choose(&self, name: &str, how: &ReadOptions<'_>) -> Result<Vec<Chosen>, TraceError> {
        let fault = |fault| TraceError::new(name, None, fault);
        let topic_of = |field: &&Field| self.sources.get(&field.channel).map_or("", |source| source.topic.as_str());
        let fields: Vec<&Field> = match &how.topic {
            None => self.fields.iter().collect(),
            Some(topic) => self.fields.iter().filter(|field| topic_of(field) == topic).collect(),
        };
        if let Some(topic) = how.topic.as_deref().filter(|_| fields.is_empty()) {
            return Err(fault(Fault::NoTopic { wanted: short(topic), have: listed(&self.topics()) }));
        }
        if how.topic.is_none() && how.map.is_empty() {
            let has_joints = |topic: &&String| {
                self.fields.iter().any(|field| topic_of(&field) == *topic && joint_of(&field.name).is_some())
            };
            let state = |source: &&Source| matches!(source.kind, Kind::JointState(_));
            let mut topics: Vec<&String> = self.sources.values().filter(state).map(|source| &source.topic).collect();
            topics.sort();
            topics.dedup();
            topics.retain(has_joints);
            if topics.len() > 1 {
                return Err(fault(Fault::SeveralTopics { have: listed(&topics) }));
            }
        }
        let headings: Vec<&str> = fields.iter().map(|field| field.heading.as_str()).collect();
        let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
        let chosen = columns(&headings, &names, how).map_err(fault)?;
        if chosen.is_empty() {
            let have = if headings.is_empty() {
                format!("the channels {}", listed(&self.topics()))
            } else {
                listed(&headings)
            };
            return Err(fault(Fault::NoJoints { have, example: String::new() }));
        }
        let chosen = chosen.into_iter().map(|(joint, index)| {
            let Field { channel, name, heading } = fields[index];
            let is_state = self.sources.get(channel).is_some_and(|source| matches!(source.kind, Kind::JointState(_)));
            let (said, power) =
                if is_state { (Said::Format(AngleUnit::Radians, "by REP 103"), 0) } else { unit_in(name) };
            let (field, heading) = (name.clone(), heading.clone());
            Chosen { joint, channel: *channel, field, heading, said, power, values: Vec::new() }
        });
        Ok(chosen.collect())
    }

    /// The topics with the encoding of their messages.
    fn topics(&self) -> Vec<String> {
        self.sources.values().map(|source| format!("{} ({})", short(&source.topic), source.words)).collect()
    }
}

/// The names of an object's fields that are numbers or null; none if it is no object.
fn numbers_of(message: &[u8]) -> Vec<String> {
    let Ok(object) = object_of(message) else { return Vec::new() };
    let numbers = object.into_iter().filter(|(_, value)| matches!(value, Value::Number(_) | Value::Null));
    numbers.map(|(name, _)| name).collect()
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
