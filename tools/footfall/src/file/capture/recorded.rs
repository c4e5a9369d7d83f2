//! Reads captures back: what ran, the boots, and the input and output of every tick.
//!
//! | | CSV | MCAP |
//! |---|---|---|
//! | what ran, the boots | `FILE.json` beside it | its metadata |
//! | a tick | a row | the messages on `/sensor` and `/joints` of one tick, and the last one on `/state` |

use super::{Format, SCHEMA, beside};
use crate::board::lines::bytes_of_hex;
use gait_trace::TraceError;
use gait_trace::format::mcap_file;
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_units::Joint;
use mcap::records::Record;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use wire::{Boot, BrownOut, Call, Flags, LastOutputs, RecordId, Reset};

/// Why a capture cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordedError {
    /// A file cannot be read.
    #[error("{file}: cannot be read: {why}")]
    Unreadable {
        /// The file.
        file: String,
        /// The reason.
        why: String,
    },
    /// The capture has another layout.
    #[error("{file}: schema {found}; allowed is {SCHEMA}: record it again with this version of `footfall`")]
    Schema {
        /// The file that states it.
        file: String,
        /// What it states.
        found: String,
    },
    /// A value is missing or wrong.
    #[error("{place}: `{key}` {why}; record it again")]
    Value {
        /// File and line or message.
        place: String,
        /// The name of the value.
        key: String,
        /// What is wrong.
        why: String,
    },
}

/// What ran.
#[derive(Debug)]
pub struct Recorded {
    /// Generator, sensors and robot, from the records in the capture.
    pub parameters: Parameters,
    /// The boots in order; `None` where the boot record was lost.
    pub boots: Vec<Option<Boot>>,
    /// The capture has an end: its recorder was not stopped.
    pub finished: bool,
}

/// One call of the board's loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Number of boots in the capture, this one included.
    pub boot: u32,
    /// Control periods since that boot.
    pub tick: u32,
    /// Input of the loop.
    pub call: Call,
    /// Output of the loop, where it was known.
    pub output: Option<Output>,
}

/// Output of a tick, as the capture has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// State of the supervisor.
    pub state: String,
    /// Setpoints in joint order, degrees.
    pub setpoints_deg: [f32; Joint::COUNT],
    /// Pulses in joint order, us; 0 is none.
    pub pulses_us: [u16; Joint::COUNT],
    /// Calls of the loop since the boot.
    pub seq: u32,
    /// Limits that acted on the setpoints, bits.
    pub limited: u8,
}

/// Reads a capture and hands each tick on, in order.
///
/// # Errors
/// The first error of the file, with its place.
pub fn read(path: &Path, mut each: impl FnMut(&Recorded, Tick)) -> Result<Recorded, RecordedError> {
    let file = path.display().to_string();
    let unreadable =
        |file: &str, why: &dyn ToString| RecordedError::Unreadable { file: file.into(), why: why.to_string() };
    match Format::of(path).map_err(|why| unreadable(&file, &why))? {
        Format::Csv => {
            let place = beside(path).display().to_string();
            let text = std::fs::read_to_string(beside(path)).map_err(|error| unreadable(&place, &error))?;
            let whole: Value = serde_json::from_str(&text).map_err(|error| unreadable(&place, &error))?;
            let none = Vec::new();
            let boots = whole["boots"].as_array().unwrap_or(&none);
            let finished = whole["finished"] == Value::Bool(true);
            let recorded = recorded(&place, &whole["schema"], &whole["about"], boots, finished)?;
            csv_rows(path, &recorded, &mut each)?;
            Ok(recorded)
        }
        Format::Mcap => {
            let bytes = std::fs::read(path).map_err(|error| unreadable(&file, &error))?;
            let recorded = mcap_metadata(&file, &bytes)?;
            mcap_messages(&file, &bytes, &recorded, &mut each)?;
            Ok(recorded)
        }
    }
}

/// The value of a key, by its place, or what is wrong with it.
struct Values<'a> {
    place: &'a str,
    of: &'a dyn Fn(&str) -> Option<String>,
}

impl Values<'_> {
    fn wrong(&self, key: &str, why: impl Into<String>) -> RecordedError {
        RecordedError::Value { place: self.place.into(), key: key.into(), why: why.into() }
    }

    fn text(&self, key: &str) -> Result<String, RecordedError> {
        (self.of)(key).ok_or_else(|| self.wrong(key, "is missing"))
    }

    fn number<T: std::str::FromStr>(&self, key: &str) -> Result<T, RecordedError> {
        let text = self.text(key)?;
        text.parse().map_err(|_| self.wrong(key, format!("is `{text}`, no number of its range")))
    }

    /// The input of a tick; the codes are in the order of the channels.
    fn call(&self, joints: &[Joint]) -> Result<Call, RecordedError> {
        let flags = self.number("flags")?;
        let flags =
            Flags::from_bits(flags).ok_or_else(|| self.wrong("flags", format!("is {flags}, which has no meaning")))?;
        let codes = joints.iter().map(|joint| self.number(&format!("{}_code", joint.name())));
        let codes = codes.collect::<Result<_, _>>()?;
        let request = (self.of)("request")
            .map(|text| text.parse().map_err(|error| self.wrong("request", format!("is `{text}`, {error}"))));
        let request = request.transpose()?;
        let watchdog_hz = (self.of)("watchdog_hz").map(|_| self.number("watchdog_hz")).transpose()?;
        let (reference, elapsed) = (self.number("vrefint")?, self.number("elapsed")?);
        Ok(Call { codes, reference, elapsed, flags, watchdog_hz, request })
    }

    fn output(&self, state: String) -> Result<Output, RecordedError> {
        let mut setpoints_deg = [0.0; Joint::COUNT];
        let mut pulses_us = [0; Joint::COUNT];
        for joint in Joint::ALL {
            setpoints_deg[joint as usize] = self.number(&format!("set_{}_deg", joint.name()))?;
            pulses_us[joint as usize] = self.number(&format!("{}_us", joint.name()))?;
        }
        let (seq, limited) = (self.number("seq")?, self.number("limited")?);
        Ok(Output { state, setpoints_deg, pulses_us, seq, limited })
    }
}

fn text_of(value: &Value) -> Option<String> {
    match value {
        Value::Null => None,
        Value::String(text) => Some(text.clone()),
        // A number has the digits with which it was written.
        value => Some(value.to_string()),
    }
}

fn recorded(
    file: &str,
    schema: &Value,
    about: &Value,
    boots: &[Value],
    finished: bool,
) -> Result<Recorded, RecordedError> {
    if schema.as_u64() != Some(SCHEMA.into()) {
        return Err(RecordedError::Schema { file: file.into(), found: schema.to_string() });
    }
    let wrong = |key: &str, why: String| RecordedError::Value { place: file.into(), key: key.into(), why };
    let record = |key: &str| {
        let bytes = about["records"][key].as_str().and_then(bytes_of_hex);
        bytes.ok_or_else(|| wrong(key, "is no flash record in hexadecimal digits".into()))
    };
    let erased = |key: &str| wrong(key, "is erased".into());
    let generator =
        generator_record::read(&record("generator")?).map_err(|error| wrong("generator", error.to_string()))?;
    let sensors = sensor_record::read(&record("sensors")?).map_err(|error| wrong("sensors", error.to_string()))?;
    let robot = robot_record::read(&record("robot")?).map_err(|error| wrong("robot", error.to_string()))?;
    let generator = generator.ok_or_else(|| erased("generator"))?.config;
    let sensors = sensors.ok_or_else(|| erased("sensors"))?.sensors;
    let robot = robot.ok_or_else(|| erased("robot"))?.robot;
    let parameters = Parameters::with_defaults(Some(generator), Some(sensors), robot)
        .map_err(|error| wrong("records", error.to_string()))?;
    let boots = boots.iter().enumerate().map(|(index, value)| {
        let place = format!("{file}: boot {}", index + 1);
        boot(&Values { place: &place, of: &|key| text_of(&value[key]) }, value)
    });
    Ok(Recorded { parameters, boots: boots.collect::<Result<_, _>>()?, finished })
}

fn boot(values: &Values<'_>, value: &Value) -> Result<Option<Boot>, RecordedError> {
    if value["boot_record"] != Value::Bool(true) {
        return Ok(None);
    }
    let id = |key: &str| -> Result<Option<RecordId>, RecordedError> {
        let Some(id) = value[key].as_object() else { return Ok(None) };
        let crc = id.get("crc").and_then(Value::as_str).and_then(|crc| u32::from_str_radix(crc, 16).ok());
        let name = id.get("name").and_then(Value::as_str);
        match (name, crc) {
            (Some(name), Some(crc)) => Ok(Some(RecordId::new(name, crc))),
            _ => Err(values.wrong(key, "has no name and check sum")),
        }
    };
    let flag = |key: &str| value[key].as_bool().ok_or_else(|| values.wrong(key, "is neither true nor false"));
    let reset = values.text("reset")?;
    Ok(Some(Boot {
        version: wire::VERSION,
        board: values.text("board")?.as_str().try_into().unwrap_or_default(),
        chip: values.text("chip")?.as_str().try_into().unwrap_or_default(),
        reset: Reset::ALL
            .into_iter()
            .find(|known| known.name() == reset)
            .ok_or_else(|| values.wrong("reset", format!("is `{reset}`")))?,
        streak: values.number("streak")?,
        reference_cal: values.number("vrefint_cal")?,
        min_supply_v: values.number("min_supply_v")?,
        sensor_required: flag("sensor_required")?,
        generator: id("generator")?,
        sensors: id("sensors")?,
        robot: id("robot")?,
        shadow: flag("shadow")?,
        last_outputs: last_outputs(values, &value["last_outputs"])?,
        sealed: value["sealed"].as_bool(),
        brown_out: brown_out(values, &value["brown_out"])?,
    }))
}

/// A capture of a version before 9 has none: then a board armed only at level 3.
fn brown_out(values: &Values<'_>, value: &Value) -> Result<BrownOut, RecordedError> {
    if value.is_null() {
        return Ok(BrownOut { level: 3, wanted: 3 });
    }
    let level = |key: &str| u8::try_from(value[key].as_u64()?).ok();
    let levels = level("level").zip(level("wanted")).map(|(level, wanted)| BrownOut { level, wanted });
    levels.ok_or_else(|| values.wrong("brown_out", "is not `level` and `wanted`"))
}

fn last_outputs(values: &Values<'_>, value: &Value) -> Result<Option<LastOutputs>, RecordedError> {
    if value.is_null() {
        return Ok(None);
    }
    let of = || {
        let pulses: Vec<u16> = serde_json::from_value(value["pulses_us"].clone()).ok()?;
        let cut = u32::try_from(value["cut"].as_u64()?).ok()?;
        Some(LastOutputs { pulses_us: pulses.try_into().ok()?, on: value["on"].as_bool()?, cut })
    };
    of().map(Some).ok_or_else(|| values.wrong("last_outputs", "is not four pulses, `on` and `cut`"))
}

fn joints(recorded: &Recorded) -> Vec<Joint> {
    recorded.parameters.sensors.iter().map(|sensor| sensor.joint).collect()
}

fn csv_rows(path: &Path, recorded: &Recorded, each: &mut impl FnMut(&Recorded, Tick)) -> Result<(), RecordedError> {
    let file = path.display().to_string();
    let unreadable = |why: &dyn ToString| RecordedError::Unreadable { file: file.clone(), why: why.to_string() };
    let opened = File::open(path).map_err(|error| unreadable(&error))?;
    // Half a row at the end is what a program leaves that is killed.
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(opened);
    let header = reader.headers().map_err(|error| unreadable(&error))?.clone();
    let columns: BTreeMap<&str, usize> = header.iter().enumerate().map(|(index, name)| (name, index)).collect();
    let joints = joints(recorded);
    let mut row = csv::StringRecord::new();
    while reader.read_record(&mut row).map_err(|error| unreadable(&error))? {
        if row.len() < header.len() && reader.is_done() {
            break;
        }
        let place = format!("{file}:{}", row.position().map_or(0, csv::Position::line));
        let of = |key: &str| columns.get(key).and_then(|index| row.get(*index)).filter(|text| !text.is_empty());
        let of = |key: &str| of(key).map(str::to_owned);
        let values = Values { place: &place, of: &of };
        let output = of("state").map(|state| values.output(state)).transpose()?;
        let (boot, tick) = (values.number("boot")?, values.number("tick")?);
        each(recorded, Tick { boot, tick, call: values.call(&joints)?, output });
    }
    Ok(())
}

/// Hands on the records of a file, up to its end or to where its recorder was stopped.
fn records(
    file: &str,
    bytes: &[u8],
    mut each: impl FnMut(Record<'_>) -> Result<(), RecordedError>,
) -> Result<(), RecordedError> {
    let mut result = Ok(());
    let read = mcap_file::records(file, bytes, |_, record| {
        if result.is_ok() {
            result = each(record);
        }
        Ok(())
    });
    result?;
    let unreadable = |error: TraceError| RecordedError::Unreadable { file: file.into(), why: error.to_string() };
    read.map(drop).map_err(unreadable)
}

fn mcap_metadata(file: &str, bytes: &[u8]) -> Result<Recorded, RecordedError> {
    let (mut about, mut boots, mut finished) = (Value::Null, Vec::new(), false);
    records(file, bytes, |record| {
        let Record::Metadata(metadata) = record else { return Ok(()) };
        // Texts and numbers as they are; objects are JSON in a text.
        let value = |text: &String| serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.clone()));
        let object: Map<String, Value> =
            metadata.metadata.iter().map(|(key, text)| (key.clone(), value(text))).collect();
        match metadata.name.as_str() {
            "footfall" => about = Value::Object(object),
            "end" => finished = true,
            name if name.starts_with("boot ") => boots.push(Value::Object(object)),
            _ => {}
        }
        Ok(())
    })?;
    recorded(file, &about["schema"], &about, &boots, finished)
}

fn mcap_messages(
    file: &str,
    bytes: &[u8],
    recorded: &Recorded,
    each: &mut impl FnMut(&Recorded, Tick),
) -> Result<(), RecordedError> {
    let joints = joints(recorded);
    let mut topics = BTreeMap::new();
    let mut waiting: Option<Tick> = None;
    let mut state = String::new();
    let mut hand_on = |waiting: &mut Option<Tick>, state: &str| {
        if let Some(mut tick) = waiting.take() {
            tick.output.iter_mut().for_each(|output| state.clone_into(&mut output.state));
            each(recorded, tick);
        }
    };
    records(file, bytes, |record| {
        let (header, data) = match record {
            Record::Channel(channel) => {
                topics.insert(channel.id, channel.topic);
                return Ok(());
            }
            Record::Message { header, data } => (header, data),
            _ => return Ok(()),
        };
        let topic = topics.get(&header.channel_id).map(String::as_str);
        let Some(topic) = topic.filter(|topic| ["/sensor", "/joints", "/state"].contains(topic)) else { return Ok(()) };
        let place = format!("{file}: message {} on {topic}", header.sequence);
        let value: Value = serde_json::from_slice(&data)
            .map_err(|error| RecordedError::Unreadable { file: place.clone(), why: error.to_string() })?;
        let values = Values { place: &place, of: &|key| text_of(&value[key]) };
        match topic {
            "/sensor" => {
                hand_on(&mut waiting, &state);
                let (boot, tick) = (values.number("boot")?, values.number("tick")?);
                waiting = Some(Tick { boot, tick, call: values.call(&joints)?, output: None });
            }
            "/joints" => {
                let of = (values.number("boot")?, values.number("tick")?);
                if let Some(tick) = waiting.as_mut().filter(|tick| (tick.boot, tick.tick) == of) {
                    tick.output = Some(values.output(String::new())?);
                }
            }
            "/state" => state = values.text("state")?,
            _ => {}
        }
        Ok(())
    })?;
    hand_on(&mut waiting, &state);
    Ok(())
}
