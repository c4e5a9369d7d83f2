//! A capture as MCAP (<https://mcap.dev/spec>): messages in JSON with JSON Schema, and messages of ROS 2. Opens in Foxglove and
//! PlotJuggler; the joint states move a robot there, see [`crate::channel::joint_states`].
//!
//! | topic | a message for | content |
//! |---|---|---|
//! | `/sensor` | every sample | for each sensor: code, volts, angle of its joint (null unless good), validity; samples lost so far |
//! | `/joints` | every sample with known outputs | four setpoints, four pulses, and their source |
//! | `/sync` | every edge at the synchronisation input | the level after it |
//! | `/state` | every change | state of the supervisor, late and missed ticks |
//! | `/joint_states` | every tenth sample with known outputs | setpoints, as ROS 2 has them |
//! | `/foxglove_joint_states` | the same | setpoints, as Foxglove has them |
//! | `/robot_description` | once | the robot, as URDF |
//!
//! Times are nanoseconds of the Unix epoch: that of the zero of the capture's axis plus the time by the board's own clock, whose tick is in
//! the messages. Metadata: `footfall` (what runs, the calibration), `clock` (`zero_unix_ns`, the Unix time of that zero), `boot 1`,
//! `boot 2`, ... (chip, factory values), `end` (the counts). A chunk is written at once every second: a file without an end is complete up
//! to its last chunk.

use super::header::{SCHEMA, flat};
use super::samples::{EdgeAt, Sample};
use crate::channel::objects::{JOINTS, SENSOR, STATE, joints_schema, number, sensor_schema, state_schema, sync_schema};
use crate::channel::{Channel, joint_states, objects, robot_description};
use crate::file::mcap_writer::McapWriter;
use crate::output;
use hgod_adc::Validity;
use joint_loop::RobotConfig;
use joint_units::Joint;
use serde_json::{Map, Value, json};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

/// Samples in a chunk.
const CHUNK: u32 = 1000;

pub(crate) struct Messages {
    writer: McapWriter<BufWriter<File>>,
    joints: Vec<Joint>,
    /// The robot, as URDF.
    robot: String,
    /// Channels in the order of [`channels`], and the numbers of their next messages.
    channels: [(u16, u32); 7],
    /// Unix time of the zero of the capture's axis, ns.
    zero_ns: u64,
    in_chunk: u32,
    boots: u32,
    state: Option<(u32, &'static str, u32, u32)>,
}

/// The channels of a capture of sensors on these joints.
fn channels(joints: &[Joint]) -> [Channel; 7] {
    [
        Channel::json(SENSOR, "footfall.Sensor", &sensor_schema(joints)),
        Channel::json(JOINTS, "footfall.Joints", &joints_schema()),
        Channel::json(STATE, "footfall.State", &state_schema()),
        Channel::json("/sync", "footfall.Sync", &sync_schema()),
        Channel::ros(joint_states::TOPIC, joint_states::JOINT_STATE),
        Channel::json(joint_states::FOXGLOVE_TOPIC, "foxglove.JointStates", &joint_states::foxglove_schema()),
        Channel::ros(robot_description::TOPIC, robot_description::TEXT),
    ]
}

impl Messages {
    pub(crate) fn begin(path: &Path, joints: &[Joint], robot: &RobotConfig, about: &Value) -> io::Result<Self> {
        let out = BufWriter::new(output::begin(path)?);
        let mut writer = McapWriter::begin(out, concat!("footfall ", env!("CARGO_PKG_VERSION")))?;
        let mut numbers = [(0, 0); 7];
        for (number, channel) in numbers.iter_mut().zip(channels(joints)) {
            let schema = [channel.schema.name, channel.schema.encoding, &channel.schema.text];
            number.0 = writer.add_channel(channel.topic, channel.encoding, schema)?;
        }
        let mut metadata = flat(about);
        metadata.insert("footfall".into(), env!("CARGO_PKG_VERSION").into());
        metadata.insert("schema".into(), SCHEMA.to_string());
        writer.metadata("footfall", metadata)?;
        Ok(Self {
            writer,
            joints: joints.to_vec(),
            robot: robot_description::urdf(robot),
            channels: numbers,
            zero_ns: 0,
            in_chunk: 0,
            boots: 0,
            state: None,
        })
    }

    /// Sets the Unix time of the zero of the axis, before the first message.
    pub(crate) fn set_zero(&mut self, zero_ns: u64) -> io::Result<()> {
        self.zero_ns = zero_ns;
        self.metadata("clock", &json!({ "zero_unix_ns": zero_ns }))?;
        self.bytes(6, 0, &robot_description::text(&self.robot))?;
        self.writer.flush()
    }

    pub(crate) fn boot(&mut self, boot: &Value) -> io::Result<()> {
        self.boots += 1;
        self.metadata(&format!("boot {}", self.boots), boot)
    }

    fn metadata(&mut self, name: &str, value: &Value) -> io::Result<()> {
        self.writer.metadata(name, flat(value))
    }

    pub(crate) fn write(&mut self, samples: &[Sample]) -> io::Result<()> {
        for sample in samples {
            self.sample(sample)?;
            self.in_chunk += 1;
            if self.in_chunk == CHUNK {
                self.writer.flush()?;
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
        sensor.insert("watchdog_hz".into(), sample.call.watchdog_hz.into());
        sensor.insert("lost".into(), sample.lost.into());
        self.message(0, at, &Value::Object(sensor))?;

        let Some(tick) = &sample.output else { return Ok(()) };
        let mut joints = objects::joints(sample.boot, tick);
        joints.insert("known".into(), sample.known.name().into());
        self.message(1, at, &Value::Object(joints))?;
        if sample.tick.is_multiple_of(joint_states::TICKS) {
            self.bytes(4, at, &joint_states::joint_state(self.unix_ns(at), tick.setpoints_rad))?;
            self.message(5, at, &joint_states::foxglove_joint_states(self.unix_ns(at), tick.setpoints_rad))?;
        }

        let state = (sample.boot, tick.state.name(), tick.late, tick.missed);
        if self.state.replace(state) == Some(state) {
            return Ok(());
        }
        self.message(2, at, &objects::state(sample.boot, tick))
    }

    pub(crate) fn edge(&mut self, edge: &EdgeAt) -> io::Result<()> {
        self.message(3, edge.time_ns, &json!({ "level": u8::from(edge.high) }))
    }

    fn message(&mut self, channel: usize, at: u64, value: &Value) -> io::Result<()> {
        self.bytes(channel, at, value.to_string().as_bytes())
    }

    fn bytes(&mut self, channel: usize, at: u64, bytes: &[u8]) -> io::Result<()> {
        let time_ns = self.unix_ns(at);
        let (id, sequence) = &mut self.channels[channel];
        self.writer.message(*id, *sequence, time_ns, bytes)?;
        *sequence = sequence.wrapping_add(1);
        Ok(())
    }

    /// The Unix time of a time on the axis of the capture.
    fn unix_ns(&self, at: u64) -> u64 {
        self.zero_ns.saturating_add(at)
    }

    pub(crate) fn finish(&mut self, counts: &Value) -> io::Result<()> {
        self.metadata("end", counts)?;
        self.writer.finish()
    }
}
