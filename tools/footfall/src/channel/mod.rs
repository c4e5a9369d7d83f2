//! Channels of captures and live views: topics, messages and their definitions.

mod cdr;
pub(crate) mod clock;
pub(crate) mod joint_states;
pub(crate) mod objects;
pub(crate) mod robot_description;

use serde_json::Value;

/// A channel: its topic, how its messages are encoded, and their definition.
pub(crate) struct Channel {
    pub(crate) topic: &'static str,
    /// `json` or `cdr`.
    pub(crate) encoding: &'static str,
    pub(crate) schema: Schema,
}

/// The definition of messages.
pub(crate) struct Schema {
    pub(crate) name: &'static str,
    /// `jsonschema` or `ros2msg`.
    pub(crate) encoding: &'static str,
    pub(crate) text: String,
}

impl Channel {
    /// One with messages in JSON.
    pub(crate) fn json(topic: &'static str, name: &'static str, schema: &Value) -> Self {
        Self { topic, encoding: "json", schema: Schema { name, encoding: "jsonschema", text: schema.to_string() } }
    }

    /// One with messages of ROS 2: the name of the message and its definition.
    pub(crate) fn ros(topic: &'static str, (name, text): (&'static str, &str)) -> Self {
        Self { topic, encoding: "cdr", schema: Schema { name, encoding: "ros2msg", text: text.into() } }
    }
}
