//! The data of a whole capture, as JSON: in `FILE.json`, and in the metadata of an MCAP file.

use super::samples::{Booted, Counts};
use crate::board::default_loop::SENSOR_PINS;
use crate::board::image::Image;
use generator_file::degrees::shortest;
use hgod_adc::Interpolation;
use joint_loop::setup::default_loop::Parameters;
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_loop::{JointSensor, JointSensors, RecordName, SENSORS};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use wire::{LastOutputs, RecordId};

/// Version of the layout of captures and of the file beside them.
///
/// Version 4 has `validity` instead of `verdict`, `generator_file` instead of `params`, `result` instead of `summary`, and `boot_record`
/// instead of `heard`. Version 5 has name and check sum of each record at each boot, where the board reports them,
/// version 6 the records themselves, version 7 the requests of a host. Version 8 has times of the Unix epoch in MCAP, and their zero,
/// version 9 how the outputs of the run before ended, and the measured clock of the watchdog.
pub const SCHEMA: u32 = 9;

/// What runs on the board: image (where it is known), generator, sensors, their records and that of the robot in hexadecimal digits; and `more` about the run.
#[must_use]
pub fn about(
    elf: Option<&Path>,
    image: Option<&Image>,
    generator_file: Option<&Path>,
    parameters: &Parameters,
    more: Value,
) -> Value {
    let Parameters { generator, sensors, robot, .. } = parameters;
    // The board's own names are in its boot record.
    let name = RecordName::cut("capture");
    let mut about = json!({
        "elf": elf,
        "elf_sha256": image.map(|image| &image.sha256),
        "generator_file": generator_file,
        "generator": generator.name(),
        "sensors": about_sensors(sensors, image.map_or(SENSOR_PINS, Image::sensor_pins)),
        "records": {
            "generator": hex(generator_record::record_of(generator, &name).bytes()),
            "sensors": hex(sensor_record::record_of(sensors, &name).bytes()),
            "robot": hex(robot_record::record_of(robot, &name).bytes()),
        },
    });
    if let (Some(about), Value::Object(more)) = (about.as_object_mut(), more) {
        about.extend(more);
    }
    about
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn about_sensors(sensors: &JointSensors, pins: [&str; SENSORS]) -> Value {
    sensors.iter().zip(pins).map(|(sensor, pin)| about_sensor(sensor, pin)).collect()
}

fn about_sensor(sensor: &JointSensor, pin: &str) -> Value {
    let calibration = &sensor.calibration;
    let points: Vec<Value> =
        calibration.points().iter().map(|point| json!([point.volts.0, shortest(point.angle)])).collect();
    json!({
        "joint": sensor.joint.name(),
        "pin": pin,
        "divider": sensor.divider,
        "interpolation": match calibration.interpolation() {
            Interpolation::Linear => "linear",
            Interpolation::MonotoneCubic => "monotone_cubic",
        },
        "points_v_deg": points,
        "units": { "time": "s, by the board's own clock", "code": "12 bit", "volts": "V at the sensor", "angle": "degrees, flexion positive", "pulse": "us" },
    })
}

/// A boot.
pub(crate) fn boot(booted: &Booted) -> Value {
    let time_s = booted.time_ns as f64 / 1e9;
    let id = |id: &Option<RecordId>| {
        id.as_ref().map(|RecordId { name, crc }| json!({ "name": name.as_str(), "crc": format!("{crc:08x}") }))
    };
    let Some(boot) = &booted.boot else { return json!({ "time_s": time_s, "boot_record": false }) };
    json!({
        "time_s": time_s,
        "boot_record": true,
        "board": boot.board.as_str(),
        "chip": boot.chip.as_str(),
        "reset": boot.reset.name(),
        "streak": boot.streak,
        "vrefint_cal": boot.reference_cal,
        "min_supply_v": boot.min_supply_v,
        "sensor_required": boot.sensor_required,
        "generator": id(&boot.generator),
        "sensors": id(&boot.sensors),
        "robot": id(&boot.robot),
        "shadow": boot.shadow,
        "last_outputs": boot.last_outputs.map(|LastOutputs { pulses_us, on, cut }| {
            json!({ "pulses_us": pulses_us, "on": on, "cut": cut })
        }),
        "sealed": boot.sealed,
        "brown_out": { "level": boot.brown_out.level, "wanted": boot.brown_out.wanted },
    })
}

/// The counts of a capture.
pub(crate) fn counts(counts: &Counts) -> Value {
    let gap =
        |&(boot, after, found): &(u32, u32, u32)| json!({ "boot": boot, "after_tick": after, "next_tick": found });
    json!({
        "samples": counts.samples,
        "lost_samples": counts.lost,
        "periods_before": counts.before,
        "gaps": counts.gaps.iter().map(gap).collect::<Vec<_>>(),
        "missed_periods": counts.missed,
        "dropped_by_the_board": counts.board_dropped,
        "confirmed_ticks": counts.confirmed,
        "different_ticks": counts.different,
        "differences": counts.differences.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "sync_edges": counts.edges,
        "sync_edges_lost": counts.edges_lost,
        "malformed_frames": counts.malformed,
        "no_replay": counts.why_no_replay,
    })
}

/// An object as the text-to-text map of MCAP metadata.
pub(crate) fn flat(value: &Value) -> BTreeMap<String, String> {
    let none = Map::new();
    let object = value.as_object().unwrap_or(&none);
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    object.iter().map(|(key, value)| (key.clone(), text(value))).collect()
}
