//! The input of the board's converter: a recorded gait as volts at the sensors' pins.

use crate::failure::Failure;
use crate::file::bounded;
use crate::file::recording;
use gait_trace::ReadOptions;
use gait_trace::format::converted::Conversion;
use gait_trace::format::csv_file;
use gait_trace::format::open;
use gait_trace::{Channel, Fault, LoopError, Quantity, Recording, TraceError};
use gait_trace::{LowPass, Rules, condition};
use joint_loop::{JointSensor, JointSensors, SENSORS};
use serde_json::{Value, json};
use std::path::Path;

/// The default recording: a healthy adult walking overground (Fukuchi, Fukuchi and Duarte 2018, CC BY 4.0).
pub const DEFAULT_TRACE: &str = include_str!("../../../../tests/traces/gaitkit_fukuchi_healthy.csv");

/// Its file name.
pub const DEFAULT_TRACE_NAME: &str = "gaitkit_fukuchi_healthy.csv";

/// Sampling rate of the volts.
pub const RATE_HZ: f64 = 1000.0;

/// Volts at the pins, and how they are played.
#[derive(Debug, Clone, PartialEq)]
pub struct Feed {
    /// Volts at the pins.
    pub volts: Recording,
    /// They are repeated.
    pub repeat: bool,
    /// Title for the user.
    pub title: String,
    /// Source and duration, for the file beside a capture.
    pub about: Value,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// The default recording with its name.
///
/// # Errors
/// None; a test reads it.
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
    /// The kind of file; `None` for CSV of this program.
    pub format: Option<String>,
    /// Decisions of the reader and changes to the recording, one sentence each.
    pub notes: Vec<String>,
}

/// Opens a recording. CSV of this program without gaps is taken unchanged. Of any other file the joints are read, with equal time steps and
/// flexion positive; short gaps are bridged, long ones become a straight line, and each is noted.
///
/// # Errors
/// The file is wrong, or its time axis is a cycle.
pub fn opened(path: &Path) -> Result<Opened, Failure> {
    recording::check_regular(path)?;
    let name = path.display().to_string();
    let plain = match csv_file::read(path) {
        Ok(recording) => return Ok(Opened { name, recording, format: None, notes: vec![] }),
        Err(error) => error,
    };
    // Another header means another kind of file, and a file of `footfall convert` may have gaps.
    let separated = match *plain.fault {
        Fault::MissingColumn { hint, .. } => hint.contains("separated"),
        Fault::UnknownColumn | Fault::NoChannels | Fault::NotText { .. } => false,
        Fault::NotANumber { .. } if is_converted(path) => true,
        ref fault if csv_file::is_missing_value(fault) => false,
        _ => return Err(Failure::input(plain)),
    };
    let raw = open::read(path, &ReadOptions::default()).map_err(|error| {
        // For a plain table the error of the own reader is shorter; another kind of file is named.
        let is_csv = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let is_named = matches!(
            *error.fault,
            Fault::Unsupported { .. } | Fault::SeveralGroups { .. } | Fault::NoModelOutputs { .. }
        );
        let error = if is_csv && !separated && !is_named { plain } else { error };
        Failure::Input(format!(
            "{error}; `footfall convert` has options for what the file does not state, and writes a complete one"
        ))
    })?;
    let rules = Rules { low_pass: LowPass::Off, jump_bend_deg: f64::INFINITY, ..Rules::default() };
    let conditioned = condition(&raw, &rules).map_err(Failure::input)?;
    if conditioned.normalised_cycle {
        return Err(Failure::input(format!("{name}: the time axis is a cycle; allowed is a recording in seconds")));
    }
    let notes = raw.notes.into_iter().chain(conditioned.findings.iter().map(ToString::to_string)).collect();
    Ok(Opened { name, recording: conditioned.recording, format: Some(raw.format), notes })
}

/// The file has the record of `footfall convert`.
fn is_converted(path: &Path) -> bool {
    bounded::bytes(path, csv_file::MAX_BYTES).is_ok_and(|bytes| matches!(Conversion::of_bytes(&bytes), Ok(Some(_))))
}

/// Converts a recording to volts at the pin of each sensor, for a run of `secs` seconds or without end. `pins`: those of the board, from channel 1 on.
///
/// A recording that lasts as long as the run is played unchanged; a shorter one is cut to whole strides and repeated. One without a
/// period is played once, and its last angles are held. Volts that were recorded at a sensor's pin are taken unchanged.
///
/// # Errors
/// The recording has no channel of a sensor's joint, or angles outside of its calibration.
pub fn feed(
    name: &str,
    recording: &Recording,
    sensors: &JointSensors,
    pins: [&'static str; SENSORS],
    secs: Option<f64>,
) -> Result<Feed, Failure> {
    let input = |why: String| Failure::input(format!("{name}: {why}"));
    let one = |(sensor, pin): (&JointSensor, &'static str)| match recording.channel(pin) {
        Ok(channel) => Ok(Source { channel: channel.clone(), sensor: sensor.clone(), pin }),
        Err(_) => match recording.of_joint(sensor.joint) {
            Ok(channel) if channel.quantity() == Quantity::PinVolts => Err(input(format!(
                "`{}` are volts at another pin than {pin}, where the sensor of {} is; name the column {pin} if they are its",
                channel.name(),
                sensor.joint.name()
            ))),
            Ok(channel) => Ok(Source { channel: channel.clone(), sensor: sensor.clone(), pin }),
            Err(error) => Err(input(format!(
                "{error}: allowed is a recording of {0}, or a sensor on a joint that it has (--sensor JOINT); `footfall convert --map {0}=COLUMN` names a column",
                sensor.joint.name()
            ))),
        },
    };
    let sources = sensors.iter().zip(pins).map(one).collect::<Result<Vec<_>, _>>()?;
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
    // Before the cut, so that an error has the time of the file.
    volts_of(recording)?;
    let long_enough = secs.is_some_and(|secs| secs <= recording.duration_s());
    // The cut is made where the pose of all channels repeats.
    let (played, repeat) = match if long_enough { None } else { Some(recording.looped(RATE_HZ)) } {
        Some(Ok(looped)) => {
            about["strides"] = json!(looped.strides);
            about["start_s"] = json!(looped.start_s);
            (looped.recording, true)
        }
        Some(Err(error @ (LoopError::NoStride { .. } | LoopError::TooShort { .. }))) => {
            notes.push(format!("{name} cannot be repeated ({error}): it is played once and its last value is held"));
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

/// Source of a sensor's volts.
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

/// The recording with its first row at time 0, as on the board.
fn from_zero(recording: &Recording) -> Recording {
    let start = recording.time_s()[0];
    let times = recording.time_s().iter().map(|time| time - start).collect();
    // Differences of increasing times increase, unless the times are huge; then the recording stays unchanged.
    Recording::build(times, recording.channels().to_vec()).unwrap_or_else(|_| recording.clone())
}
