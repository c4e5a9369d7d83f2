//! A capture as MCAP (<https://mcap.dev/spec>): messages in JSON with JSON Schema, time stamps in nanoseconds of the board's own
//! clock. Opens in Foxglove and PlotJuggler; the messages of ROS 2 move a robot there, see [`super::joint_states`].
//!
//! | topic | a message for | content |
//! |---|---|---|
//! | `/sensor` | every sample | for each sensor: code, volts, angle of its joint (null unless good), validity; samples lost so far |
//! | `/joints` | every sample with known outputs | four setpoints, four pulses, and their source |
//! | `/sync` | every edge at the synchronisation input | the level after it |
//! | `/state` | every change | state of the supervisor, late and missed ticks |
//! | `/joint_states` | every tenth sample with known outputs | setpoints, as ROS 2 has them |
//! | `/robot_description` | once | the robot, as URDF |
//!
//! Metadata: `footfall` (what runs, the calibration), `boot 1`, `boot 2`, ... (chip, factory values), `end` (the counts).
//! A chunk is written at once every second: a file without an end is complete up to its last chunk.

use super::header::{SCHEMA, flat};
use super::joint_states;
use super::samples::{EdgeAt, Sample};
use crate::output;
use hgod_adc::Validity;
use joint_loop::RobotConfig;
use joint_units::Joint;
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions, Writer};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

/// Samples in a chunk.
const CHUNK: u32 = 1000;

pub(crate) struct Messages {
    writer: Writer<BufWriter<File>>,
    joints: Vec<Joint>,
    /// Channels `/sensor`, `/joints`, `/state`, `/sync`, `/joint_states`.
    channels: [u16; 5],
    sequences: [u32; 5],
    in_chunk: u32,
    boots: u32,
    state: Option<(u32, &'static str, u32, u32)>,
}

impl Messages {
    pub(crate) fn begin(path: &Path, joints: &[Joint], robot: &RobotConfig, about: &Value) -> io::Result<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .profile("")
            .library(concat!("footfall ", env!("CARGO_PKG_VERSION")))
            .chunk_size(None)
            // A chunk is then written in one piece, with its length: a killed program leaves whole chunks.
            .disable_seeking(true);
        let mut writer = options.create(BufWriter::new(output::begin(path)?)).map_err(io)?;
        let mut add = |topic: &str, (name, definition): (&str, &str), [language, encoding]: [&str; 2]| {
            let schema = writer.add_schema(name, language, definition.as_bytes()).map_err(io)?;
            writer.add_channel(schema, topic, encoding, &BTreeMap::new()).map_err(io)
        };
        let mut channel =
            |topic: &str, name: &str, schema: Value| add(topic, (name, &schema.to_string()), ["jsonschema", "json"]);
        let json = [
            channel("/sensor", "footfall.Sensor", sensor_schema(joints))?,
            channel("/joints", "footfall.Joints", joints_schema())?,
            channel("/state", "footfall.State", state_schema())?,
            channel("/sync", "footfall.Sync", sync_schema())?,
        ];
        let ros = ["ros2msg", "cdr"];
        let joint_states = add("/joint_states", joint_states::JOINT_STATE, ros)?;
        let description = add("/robot_description", joint_states::TEXT, ros)?;
        let [sensor, joint, state, sync] = json;
        let channels = [sensor, joint, state, sync, joint_states];
        let mut metadata = flat(about);
        metadata.insert("footfall".into(), env!("CARGO_PKG_VERSION").into());
        metadata.insert("schema".into(), SCHEMA.to_string());
        writer.write_metadata(&Metadata { name: "footfall".into(), metadata }).map_err(io)?;
        let header = MessageHeader { channel_id: description, sequence: 0, log_time: 0, publish_time: 0 };
        let robot = joint_states::text(&joint_states::urdf(robot));
        writer.write_to_known_channel(&header, &robot).map_err(io)?;
        writer.flush().map_err(io)?;
        Ok(Self { writer, joints: joints.to_vec(), channels, sequences: [0; 5], in_chunk: 0, boots: 0, state: None })
    }

    pub(crate) fn boot(&mut self, boot: &Value) -> io::Result<()> {
        self.boots += 1;
        self.metadata(&format!("boot {}", self.boots), boot)
    }

    fn metadata(&mut self, name: &str, value: &Value) -> io::Result<()> {
        self.writer.write_metadata(&Metadata { name: name.into(), metadata: flat(value) }).map_err(io)
    }

    pub(crate) fn write(&mut self, samples: &[Sample]) -> io::Result<()> {
        for sample in samples {
            self.sample(sample)?;
            self.in_chunk += 1;
            if self.in_chunk == CHUNK {
                self.writer.flush().map_err(io)?;
                self.in_chunk = 0;
            }
        }
        Ok(())
    }

    fn sample(&mut self, sample: &Sample) -> io::Result<()> {
        let at = sample.time_ns;
        let mut sensor = Map::new();
        sensor.insert("boot".into(), sample.boot.into());
        sensor.insert("tick".into(), sample.tick.into());
        sensor.insert("vrefint".into(), sample.call.reference.into());
        for ((joint, reading), code) in self.joints.iter().zip(&sample.readings).zip(sample.call.sample().codes) {
            let good = reading.filter(|reading| reading.validity == Validity::Good);
            let mut insert = |what: &str, value: Value| sensor.insert(format!("{}_{what}", joint.name()), value);
            insert("deg", number(good.map(|reading| reading.angle.degrees())));
            insert("validity", reading.map(|reading| reading.validity.name()).into());
            insert("code", code.0.into());
            insert("volts", number(reading.map(|reading| reading.volts.0)));
        }
        sensor.insert("elapsed".into(), sample.call.elapsed.into());
        sensor.insert("flags".into(), sample.call.flags.bits().into());
        sensor.insert("request".into(), sample.call.request.map(|request| request.to_string()).into());
        sensor.insert("lost".into(), sample.lost.into());
        self.message(0, at, &Value::Object(sensor))?;

        let Some(tick) = &sample.output else { return Ok(()) };
        let mut joints = Map::new();
        joints.insert("boot".into(), sample.boot.into());
        joints.insert("tick".into(), sample.tick.into());
        for (joint, angle) in Joint::ALL.into_iter().zip(tick.setpoints_deg()) {
            joints.insert(format!("set_{}_deg", joint.name()), number(Some(angle)));
        }
        for (joint, pulse) in Joint::ALL.into_iter().zip(tick.pulses_us) {
            joints.insert(format!("{}_us", joint.name()), pulse.into());
        }
        joints.insert("known".into(), sample.known.name().into());
        joints.insert("seq".into(), tick.seq.into());
        joints.insert("limited".into(), tick.limited.into());
        self.message(1, at, &Value::Object(joints))?;
        if sample.tick.is_multiple_of(joint_states::TICKS) {
            self.bytes(4, at, &joint_states::joint_state(at, tick.setpoints_rad))?;
        }

        let state = (sample.boot, tick.state.name(), tick.late, tick.missed);
        if self.state.replace(state) == Some(state) {
            return Ok(());
        }
        let (boot, name, late, missed) = state;
        let state = json!({ "boot": boot, "tick": sample.tick, "state": name, "late": late, "missed": missed });
        self.message(2, at, &state)
    }

    pub(crate) fn edge(&mut self, edge: &EdgeAt) -> io::Result<()> {
        self.message(3, edge.time_ns, &json!({ "level": u8::from(edge.high) }))
    }

    fn message(&mut self, channel: usize, at: u64, value: &Value) -> io::Result<()> {
        self.bytes(channel, at, value.to_string().as_bytes())
    }

    fn bytes(&mut self, channel: usize, at: u64, bytes: &[u8]) -> io::Result<()> {
        let sequence = self.sequences[channel];
        self.sequences[channel] = sequence.wrapping_add(1);
        let header = MessageHeader { channel_id: self.channels[channel], sequence, log_time: at, publish_time: at };
        self.writer.write_to_known_channel(&header, bytes).map_err(io)
    }

    pub(crate) fn finish(&mut self, counts: &Value) -> io::Result<()> {
        self.metadata("end", counts)?;
        self.writer.finish().map_err(io)?;
        Ok(())
    }
}

/// With as many digits as its neighbours require, as the board prints it, not the longer ones of its double.
fn number(value: Option<f32>) -> Value {
    value.and_then(|value| value.to_string().parse::<f64>().ok()).map_or(Value::Null, Value::from)
}

fn io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}

fn object(properties: &[(&str, &str, &str)]) -> Value {
    let property = |&(name, kind, about): &(&str, &str, &str)| {
        let kind: Vec<&str> = kind.split('|').collect();
        (name.to_owned(), json!({ "type": kind, "description": about }))
    };
    json!({ "type": "object", "properties": properties.iter().map(property).collect::<Map<_, _>>() })
}

fn sensor_schema(joints: &[Joint]) -> Value {
    let mut fields: Vec<(String, &str, &str)> = vec![
        ("boot".into(), "integer", "number of boots in the capture, this one included"),
        ("tick".into(), "integer", "control periods of 1 ms since the boot"),
        ("vrefint".into(), "integer", "code of the internal reference in the same tick"),
    ];
    for joint in joints {
        let name = joint.name();
        fields.extend([
            (
                format!("{name}_deg"),
                "number|null",
                "angle in degrees, flexion positive; null unless the validity is good",
            ),
            (format!("{name}_validity"), "string|null", "validity of the sample"),
            (format!("{name}_code"), "integer", "code of the sensor, 12 bit"),
            (format!("{name}_volts"), "number|null", "V at the sensor"),
        ]);
    }
    fields.extend([
        ("elapsed".into(), "integer", "control periods since the previous call"),
        (
            "flags".into(),
            "integer",
            "bit 0 button, bit 1 late, bits 2 to 7 faults of the board, bit 8 foot switch closed",
        ),
        ("request".into(), "string|null", "what a host asked for in this tick: `7 set speed 1.25`, `7 undo`, `7 stop`"),
        ("lost".into(), "integer", "samples lost since the start of the capture"),
    ]);
    object_of(&fields)
}

fn sync_schema() -> Value {
    object(&[("level", "integer", "level of the synchronisation input after the edge: 0 or 1")])
}

/// The same for names that are made.
fn object_of(fields: &[(String, &str, &str)]) -> Value {
    let fields: Vec<(&str, &str, &str)> =
        fields.iter().map(|(name, kind, about)| (name.as_str(), *kind, *about)).collect();
    object(&fields)
}

fn joints_schema() -> Value {
    let mut fields: Vec<(String, &str, &str)> = vec![
        ("boot".into(), "integer", "number of boots in the capture, this one included"),
        ("tick".into(), "integer", "control periods of 1 ms since the boot"),
    ];
    let of = |prefix: &str, suffix: &str| Joint::ALL.map(|joint| format!("{prefix}{}_{suffix}", joint.name()));
    fields.extend(of("set_", "deg").map(|name| (name, "number", "setpoint in degrees, flexion positive")));
    fields.extend(of("", "us").map(|name| (name, "integer", "commanded pulse in microseconds; 0 is none")));
    fields.extend([
        ("known".into(), "string", "source: replay is the host's copy of the loop, line is the board's own frame"),
        ("seq".into(), "integer", "calls of the loop since the boot"),
        ("limited".into(), "integer", "limits that acted on the setpoints, bits"),
    ]);
    object_of(&fields)
}

fn state_schema() -> Value {
    object(&[
        ("boot", "integer", "number of boots in the capture, this one included"),
        ("tick", "integer", "control periods of 1 ms since the boot"),
        ("state", "string", "state of the supervisor"),
        ("late", "integer", "ticks that ended late so far"),
        ("missed", "integer", "control periods without a tick so far"),
    ])
}
