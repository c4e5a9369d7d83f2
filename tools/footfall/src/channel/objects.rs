//! The messages in JSON that captures and live views share: their JSON Schemas, and what they are made from.

use hgod_adc::Validity;
use joint_units::Joint;
use serde_json::{Map, Value, json};
use wire::Frame;

/// Readings of the sensors.
pub(crate) const SENSOR: &str = "/sensor";
/// Setpoints and pulses.
pub(crate) const JOINTS: &str = "/joints";
/// State of the supervisor.
pub(crate) const STATE: &str = "/state";

/// With as many digits as its neighbours require, as the board prints it, not the longer ones of its double.
pub(crate) fn number(value: Option<f32>) -> Value {
    value.and_then(|value| value.to_string().parse::<f64>().ok()).map_or(Value::Null, Value::from)
}

/// Setpoints and pulses of a tick.
pub(crate) fn joints(boot: u32, tick: &Frame) -> Map<String, Value> {
    let mut joints = Map::new();
    joints.insert("boot".into(), boot.into());
    joints.insert("tick".into(), tick.tick.into());
    for (joint, angle) in Joint::ALL.into_iter().zip(tick.setpoints_deg()) {
        joints.insert(format!("set_{}_deg", joint.name()), number(Some(angle)));
    }
    for (joint, pulse) in Joint::ALL.into_iter().zip(tick.pulses_us) {
        joints.insert(format!("{}_us", joint.name()), pulse.into());
    }
    joints.insert("seq".into(), tick.seq.into());
    joints.insert("limited".into(), tick.limited.into());
    joints
}

/// The readings of the sensors, of these joints, in a frame of the board.
pub(crate) fn readings(boot: u32, sensors: &[Joint], tick: &Frame) -> Map<String, Value> {
    let mut readings = Map::new();
    readings.insert("boot".into(), boot.into());
    readings.insert("tick".into(), tick.tick.into());
    for (joint, reading) in sensors.iter().zip(&tick.sensors) {
        let good = reading.filter(|reading| reading.validity == Validity::Good);
        readings.insert(format!("{}_deg", joint.name()), number(good.map(|reading| reading.angle_deg())));
        readings.insert(format!("{}_validity", joint.name()), reading.map(|reading| reading.validity.name()).into());
    }
    readings
}

/// State of the supervisor and counters of the loop at a tick.
pub(crate) fn state(boot: u32, tick: &Frame) -> Value {
    json!({ "boot": boot, "tick": tick.tick, "state": tick.state.name(), "late": tick.late, "missed": tick.missed })
}

fn object(properties: &[(&str, &str, &str)]) -> Value {
    let property = |&(name, kind, about): &(&str, &str, &str)| {
        let kind: Vec<&str> = kind.split('|').collect();
        (name.to_owned(), json!({ "type": kind, "description": about }))
    };
    json!({ "type": "object", "properties": properties.iter().map(property).collect::<Map<_, _>>() })
}

/// Name, type and description of a field.
type Field = (String, &'static str, &'static str);

fn place_fields() -> [Field; 2] {
    [
        ("boot".into(), "integer", "number of boots so far, this one included"),
        ("tick".into(), "integer", "control periods of 1 ms since the boot"),
    ]
}

fn reading_fields(joint: &str) -> [Field; 2] {
    [
        (format!("{joint}_deg"), "number|null", "angle in degrees, flexion positive; null unless the validity is good"),
        (format!("{joint}_validity"), "string|null", "validity of the sample"),
    ]
}

/// Of [`SENSOR`] in a live view, which has the readings of the board's frames.
#[cfg(feature = "analysis")]
pub(crate) fn readings_schema(joints: &[Joint]) -> Value {
    let readings = joints.iter().flat_map(|joint| reading_fields(joint.name()));
    object_of(&place_fields().into_iter().chain(readings).collect::<Vec<_>>())
}

/// Of [`SENSOR`] in a capture.
pub(crate) fn sensor_schema(joints: &[Joint]) -> Value {
    let mut fields: Vec<Field> = place_fields().into();
    fields.push(("vrefint".into(), "integer", "code of the internal reference in the same tick"));
    for joint in joints {
        let name = joint.name();
        fields.extend(reading_fields(name));
        fields.extend([
            (format!("{name}_code"), "integer", "code of the sensor, 12 bit"),
            (format!("{name}_volts"), "number|null", "V at the sensor"),
        ]);
    }
    fields.extend([
        ("elapsed".into(), "integer", "control periods since the previous call"),
        (
            "flags".into(),
            "integer",
            "bit 0 button, bit 1 late, bits 2 to 7 faults of the board, bit 8 foot switch closed, bit 9 a debugger is attached, bit 10 it is refused, bit 11 the program in flash is not proven",
        ),
        ("request".into(), "string|null", "what a host asked for in this tick: `7 set speed 1.25`, `7 undo`, `7 stop`"),
        ("watchdog_hz".into(), "integer|null", "Hz, a new measurement of the clock of the watchdog; 0: it stands still"),
        ("lost".into(), "integer", "samples lost since the start of the capture"),
    ]);
    object_of(&fields)
}

/// Of `/sync` in a capture.
pub(crate) fn sync_schema() -> Value {
    object(&[("level", "integer", "level of the synchronisation input after the edge: 0 or 1")])
}

/// The same for names that are made.
fn object_of(fields: &[Field]) -> Value {
    let fields: Vec<(&str, &str, &str)> =
        fields.iter().map(|(name, kind, about)| (name.as_str(), *kind, *about)).collect();
    object(&fields)
}

/// Of [`JOINTS`].
pub(crate) fn joints_schema() -> Value {
    let mut fields: Vec<Field> = place_fields().into();
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

/// Of [`STATE`].
pub(crate) fn state_schema() -> Value {
    let mut fields: Vec<Field> = place_fields().into();
    fields.extend([
        ("state".into(), "string", "state of the supervisor"),
        ("late".into(), "integer", "ticks that ended late so far"),
        ("missed".into(), "integer", "control periods without a tick so far"),
    ]);
    object_of(&fields)
}
