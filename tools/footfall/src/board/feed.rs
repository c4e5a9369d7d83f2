//! What the board's converter is fed with: a recorded gait as volts at the sensors' pins.

use crate::board::default_loop::SENSOR_PINS;
use crate::failure::Failure;
use gait_trace::ReadOptions;
use gait_trace::format::csv_file;
use gait_trace::format::open;
use gait_trace::{Channel, Fault, LoopError, Quantity, Recording, TraceError};
use gait_trace::{LowPass, Rules, condition};
use joint_loop::{JointSensor, JointSensors};
use serde_json::{Value, json};
use std::path::Path;

/// The recording that ships: a healthy adult walking overground (Fukuchi, Fukuchi and Duarte 2018, CC BY 4.0).
pub const DEFAULT_TRACE: &str = include_str!("../../../../tests/traces/gaitkit_fukuchi_healthy.csv");

/// Its name.
pub const DEFAULT_TRACE_NAME: &str = "gaitkit_fukuchi_healthy.csv";

/// Rate of the volts.
pub const RATE_HZ: f64 = 1000.0;

/// Volts, and how to play them.
#[derive(Debug, Clone, PartialEq)]
pub struct Feed {
    /// Volts at the pins.
    pub volts: Recording,
    /// They are a loop.
    pub repeat: bool,
    /// What they are, for people.
    pub title: String,
    /// What they are, for the record.
    pub about: Value,
    /// What is worth knowing.
    pub notes: Vec<String>,
}

/// The recording that ships, with its name.
///
/// # Errors
/// None in a program that passes its tests.
pub fn default_trace() -> Result<(String, Recording), TraceError> {
    Ok((DEFAULT_TRACE_NAME.into(), csv_file::parse(DEFAULT_TRACE_NAME, DEFAULT_TRACE.as_bytes())?))
}

/// A recording of any format, ready to be played.
#[derive(Debug, Clone, PartialEq)]
pub struct Opened {
    /// The file's name.
    pub name: String,
    /// Its channels.
    pub recording: Recording,
    /// What kind of file it was, where it is no plain CSV of ours.
    pub format: Option<String>,
    /// What the reader decided and what was done about the recording, a sentence each.
    pub notes: Vec<String>,
}

/// Opens a recording: plain CSV of ours as it stands, any other format by its joints, in even steps and flexion positive, short gaps
/// bridged and long ones held as a straight line, each told.
///
/// # Errors
/// The file is not as it must be, or its time axis is a cycle.
pub fn opened(path: &Path) -> Result<Opened, Failure> {
    let name = path.display().to_string();
    let plain = match csv_file::read(path) {
        Ok(recording) => return Ok(Opened { name, recording, format: None, notes: vec![] }),
        Err(error) => error,
    };
    // With a header that is not ours it is another kind of file.
    let separated = match *plain.fault {
        Fault::MissingColumn { hint, .. } => hint.contains("separated"),
        Fault::UnknownColumn | Fault::NoChannels | Fault::NotText { .. } => false,
        _ => return Err(Failure::input(plain)),
    };
    let raw = open::read(path, &ReadOptions::default()).map_err(|error| {
        // Of a plain table our own reader says more shortly what is amiss.
        let is_csv = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let error = if is_csv && !separated { plain } else { error };
        Failure::Input(format!("{error}; `footfall convert` takes what a file does not say, and writes one that does"))
    })?;
    let rules = Rules { low_pass: LowPass::Off, jump_bend_deg: f64::INFINITY, ..Rules::default() };
    let conditioned = condition(&raw, &rules).map_err(Failure::input)?;
    if conditioned.normalised_cycle {
        return Err(Failure::input(format!("{name}: the time axis is a cycle; allowed is a recording in seconds")));
    }
    let notes = raw.notes.into_iter().chain(conditioned.findings.iter().map(ToString::to_string)).collect();
    Ok(Opened { name, recording: conditioned.recording, format: Some(raw.format), notes })
}

/// Turns a recording into volts for a run of so many seconds, or for one without end: of the joint of each worn sensor, at its pin.
///
/// A recording that lasts as long as the run is played as it is; a shorter one is cut to whole strides and repeated. One that
/// does not repeat itself is played once, and its last angles held. Volts that were recorded at a sensor's pin are taken as they are.
///
/// # Errors
/// The recording has no channel of a sensor's joint, or angles that its calibration does not reach.
pub fn feed(name: &str, recording: &Recording, worn: &JointSensors, secs: Option<f64>) -> Result<Feed, Failure> {
    let input = |why: String| Failure::input(format!("{name}: {why}"));
    let one = |(sensor, pin): (&JointSensor, &'static str)| match recording.channel(pin) {
        Ok(channel) => Ok(Source { channel: channel.clone(), sensor: sensor.clone(), pin }),
        Err(_) => match recording.of_joint(sensor.joint) {
            Ok(channel) => Ok(Source { channel: channel.clone(), sensor: sensor.clone(), pin }),
            Err(error) => Err(input(error.to_string())),
        },
    };
    let sources = worn.iter().zip(SENSOR_PINS).map(one).collect::<Result<Vec<_>, _>>()?;
    let columns: Vec<String> = sources.iter().map(|source| source.channel.column()).collect();
    let is_semi_synthetic = sources.iter().any(|source| source.channel.quantity() == Quantity::Angle);
    let mut notes = Vec::new();
    let mut about = json!({
        "file": name,
        "channels": columns,
        "pins": sources.iter().map(|source| source.pin).collect::<Vec<_>>(),
        "start_s": 0.0,
        "semi_synthetic": is_semi_synthetic,
    });
    let volts_of = |recording: &Recording| volts_of(recording, &sources).map_err(input);
    // Before it is cut, so that an angle out of reach is told with the file's own time.
    volts_of(recording)?;
    let long_enough = secs.is_some_and(|secs| secs <= recording.duration_s());
    // The cut is chosen by all channels: two poses are alike when all joints are.
    let (played, repeat) = match if long_enough { None } else { Some(recording.looped(RATE_HZ)) } {
        Some(Ok(looped)) => {
            about["strides"] = json!(looped.strides);
            about["start_s"] = json!(looped.start_s);
            (looped.recording, true)
        }
        Some(Err(error @ (LoopError::NoStride { .. } | LoopError::TooShort { .. }))) => {
            notes.push(format!("{name} cannot be repeated ({error}): it is played once and its last value held"));
            (recording.clone(), false)
        }
        Some(Err(error @ LoopError::Rate(_))) => return Err(input(error.to_string())),
        None => (recording.clone(), false),
    };
    about["repeated"] = json!(repeat);
    about["duration_s"] = json!(played.duration_s());
    let volts = volts_of(&from_zero(&played))?;
    let how = if repeat { "looped" } else { "once" };
    let kind = if is_semi_synthetic { "semi-synthetic volts" } else { "recorded volts" };
    let names: Vec<&str> = sources.iter().map(|source| source.channel.name()).collect();
    let title = format!("{} of {name}, {how}, {kind}", names.join(", "));
    Ok(Feed { volts, repeat, title, about, notes })
}

/// Where a sensor's volts come from.
struct Source {
    channel: Channel,
    sensor: JointSensor,
    pin: &'static str,
}

/// The volts at every sensor's pin while a recording with the sources' channels is played.
fn volts_of(recording: &Recording, sources: &[Source]) -> Result<Recording, String> {
    let mut channels = Vec::new();
    for Source { channel, sensor, pin } in sources {
        let channel = recording.channel(channel.name()).map_err(|error| error.to_string())?;
        channels.push(match channel.quantity() {
            Quantity::PinVolts => channel.clone(),
            Quantity::Angle => {
                let volts = recording.semi_synthetic_volts(channel, &sensor.calibration, sensor.divider, pin);
                volts.map_err(|error| error.to_string())?.channels()[0].clone()
            }
        });
    }
    Recording::build(recording.time_s().to_vec(), channels).map_err(|error| error.to_string())
}

/// The recording with its first row at time 0, where the board begins.
fn from_zero(recording: &Recording) -> Recording {
    let start = recording.time_s()[0];
    let times = recording.time_s().iter().map(|time| time - start).collect();
    // Differences of increasing times increase, unless the times are huge; then the recording stays as it is.
    Recording::build(times, recording.channels().to_vec()).unwrap_or_else(|_| recording.clone())
}
