//! What belongs to a capture as a whole, as JSON: in `FILE.json`, and in the metadata of an MCAP file.

use super::samples::{Booted, Counts};
use crate::board::default_loop::SENSOR_PINS;
use crate::file::degrees::shortest;
use hgod_adc::Interpolation;
use joint_loop::{JointSensor, JointSensors};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// The sensors by which the board measures: where each is worn, its pin, and the whole of its calibration.
#[must_use]
pub fn about_sensors(worn: &JointSensors) -> Value {
    worn.iter().zip(SENSOR_PINS).map(|(sensor, pin)| about_sensor(sensor, pin)).collect()
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
    let crc = |crc: Option<u32>| crc.map(|crc| format!("{crc:08x}"));
    let Some(boot) = &booted.boot else { return json!({ "time_s": time_s, "heard": false }) };
    json!({
        "time_s": time_s,
        "heard": true,
        "board": boot.board.as_str(),
        "chip": boot.chip.as_str(),
        "reset": boot.reset.name(),
        "streak": boot.streak,
        "vrefint_cal": boot.reference_cal,
        "min_supply_v": boot.min_supply_v,
        "sensor_required": boot.sensor_required,
        "generator_crc": crc(boot.generator_crc),
        "sensors_crc": crc(boot.sensors_crc),
        "shadow": boot.shadow,
    })
}

/// What a capture came to.
pub(crate) fn counts(counts: &Counts) -> Value {
    let gap =
        |&(boot, after, found): &(u32, u32, u32)| json!({ "boot": boot, "after_tick": after, "next_tick": found });
    json!({
        "samples": counts.samples,
        "lost_samples": counts.lost,
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

/// An object as the text-to-text map that MCAP's metadata is.
pub(crate) fn flat(value: &Value) -> BTreeMap<String, String> {
    let none = Map::new();
    let object = value.as_object().unwrap_or(&none);
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    object.iter().map(|(key, value)| (key.clone(), text(value))).collect()
}
