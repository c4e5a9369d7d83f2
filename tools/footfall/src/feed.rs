//! What the board's converter is fed with: a recorded gait as volts at the sensor's pin.

use crate::calibration_file::WiredSensor;
use crate::failure::Failure;
use crate::shipped::SENSOR_PIN;
use gait_trace::condition::{LowPass, Rules, condition};
use gait_trace::open::{self, ReadOptions};
use gait_trace::{Channel, Fault, LoopError, Quantity, Recording, TraceError, csv_file};
use joint_units::Joint;
use serde_json::{Value, json};
use std::path::Path;

/// The recording that ships: a healthy adult walking overground (Fukuchi, Fukuchi and Duarte 2018, CC BY 4.0).
pub const SHIPPED_TRACE: &str = include_str!("../../../tests/traces/gaitkit_fukuchi_healthy.csv");

/// Its name.
pub const SHIPPED_NAME: &str = "gaitkit_fukuchi_healthy.csv";

/// Rate of the volts.
pub const RATE_HZ: f64 = 1000.0;

/// Volts, and how to play them.
#[derive(Debug, Clone, PartialEq)]
pub struct Feed {
    /// Volts at the pin.
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

/// Reads a recording, the shipped one without a name.
///
/// # Errors
/// The file is not as it must be.
pub fn recording(file: Option<&Path>) -> Result<(String, Recording), TraceError> {
    match file {
        Some(path) => Ok((path.display().to_string(), csv_file::read(path)?)),
        None => Ok((SHIPPED_NAME.into(), csv_file::parse(SHIPPED_NAME, SHIPPED_TRACE.as_bytes())?)),
    }
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

/// Turns a recording of a joint into volts for a run of so many seconds, or for one without end.
///
/// A recording that lasts as long as the run is played as it is; a shorter one is cut to whole strides and repeated. One that
/// does not repeat itself is played once, and its last angle held. A recording of volts at the sensor's pin is taken as it is.
///
/// # Errors
/// The recording has no channel of the sensor's joint, or angles that the calibration does not reach.
pub fn feed(
    name: &str,
    recording: &Recording,
    joint: Joint,
    sensor: &WiredSensor,
    secs: Option<f64>,
) -> Result<Feed, Failure> {
    let input = |why: String| Failure::input(format!("{name}: {why}"));
    let channel = match recording.channel(SENSOR_PIN) {
        Ok(pin) => pin,
        Err(_) => recording.of_joint(joint).map_err(|error| input(error.to_string()))?,
    };
    let mut notes = Vec::new();
    let mut about = json!({
        "file": name,
        "channel": channel.column(),
        "start_s": 0.0,
        "semi_synthetic": channel.quantity() == Quantity::Angle,
    });
    let volts_of = |recording: &Recording, channel: &Channel| match channel.quantity() {
        Quantity::PinVolts => Ok(recording.clone()),
        Quantity::Angle => recording
            .semi_synthetic_volts(channel, &sensor.calibration, sensor.divider, SENSOR_PIN)
            .map_err(|error| input(error.to_string())),
    };
    // Before it is cut, so that an angle out of reach is told with the file's own time.
    volts_of(recording, channel)?;
    let one = recording.only(channel.name()).map_err(|error| input(error.to_string()))?;
    let long_enough = secs.is_some_and(|secs| secs <= one.duration_s());
    // The cut is chosen by all channels: two poses are alike when all joints are.
    let (played, repeat) = match if long_enough { None } else { Some(recording.looped(RATE_HZ)) } {
        Some(Ok(looped)) => {
            about["strides"] = json!(looped.strides);
            about["start_s"] = json!(looped.start_s);
            (looped.recording.only(channel.name()).map_err(|error| input(error.to_string()))?, true)
        }
        Some(Err(error @ (LoopError::NoStride { .. } | LoopError::TooShort { .. }))) => {
            notes.push(format!("{name} cannot be repeated ({error}): it is played once and its last value held"));
            (one, false)
        }
        Some(Err(error @ LoopError::Rate(_))) => return Err(input(error.to_string())),
        None => (one, false),
    };
    about["repeated"] = json!(repeat);
    about["duration_s"] = json!(played.duration_s());
    let channel = &played.channels()[0];
    let volts = volts_of(&from_zero(&played), channel)?;
    let how = if repeat { "looped" } else { "once" };
    let title = format!("{} of {name}, {how}, {}", channel.name(), kind(channel.quantity()));
    Ok(Feed { volts, repeat, title, about, notes })
}

const fn kind(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Angle => "semi-synthetic volts",
        Quantity::PinVolts => "recorded volts",
    }
}

/// The recording with its first row at time 0, where the board begins.
fn from_zero(recording: &Recording) -> Recording {
    let start = recording.time_s()[0];
    let times = recording.time_s().iter().map(|time| time - start).collect();
    // Differences of increasing times increase, unless the times are huge; then the recording stays as it is.
    Recording::build(times, recording.channels().to_vec()).unwrap_or_else(|_| recording.clone())
}
