//! The setpoints of a tick as the state of joints, in radians (ROS REP 103), so that a leg moves in a viewer: for ROS 2, and for Foxglove.

use super::cdr::Cdr;
use joint_units::Joint;
use serde_json::{Value, json};

/// The topic for ROS 2.
pub(crate) const TOPIC: &str = "/joint_states";
/// The topic for Foxglove.
pub(crate) const FOXGLOVE_TOPIC: &str = "/foxglove_joint_states";

/// Name and definition of the message with the state of joints.
pub(crate) const JOINT_STATE: (&str, &str) = (
    "sensor_msgs/msg/JointState",
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
     ================================================================================\n\
     MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
     ================================================================================\n\
     MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
);

/// One message in this many ticks, in a capture.
pub(crate) const TICKS: u32 = 10;

/// The name of a joint in these messages and in the robot description: what is commanded, not what a sensor measures.
pub(super) fn name_of(joint: Joint) -> String {
    format!("set_{}", joint.name())
}

/// The setpoints of a tick, radians.
pub(crate) fn joint_state(time_ns: u64, setpoints_rad: [f32; Joint::COUNT]) -> Vec<u8> {
    let mut message = Cdr::new();
    message.number(((time_ns / 1_000_000_000) as i32).to_le_bytes());
    message.number(((time_ns % 1_000_000_000) as u32).to_le_bytes());
    message.text("");
    message.count(Joint::COUNT);
    for joint in Joint::ALL {
        message.text(&name_of(joint));
    }
    message.count(Joint::COUNT);
    for angle in setpoints_rad {
        message.number(f64::from(angle).to_le_bytes());
    }
    message.count(0);
    message.count(0);
    message.0
}

/// The same as `foxglove.JointStates`, in JSON.
pub(crate) fn foxglove_joint_states(time_ns: u64, setpoints_rad: [f32; Joint::COUNT]) -> Value {
    let joint = |(joint, angle)| json!({ "name": name_of(joint), "position": f64::from(angle) });
    json!({
        "timestamp": { "sec": time_ns / 1_000_000_000, "nsec": time_ns % 1_000_000_000 },
        "joints": Joint::ALL.into_iter().zip(setpoints_rad).map(joint).collect::<Vec<_>>(),
    })
}

/// The JSON Schema of `foxglove.JointStates`: of Foxglove's definition (npm `@foxglove/schemas` 2.1), the fields that are written.
pub(crate) fn foxglove_schema() -> Value {
    let whole = json!({ "type": "integer", "minimum": 0 });
    let joint = json!({
        "title": "foxglove.JointState",
        "type": "object",
        "properties": { "name": { "type": "string" }, "position": { "type": "number", "description": "radians" } },
        "required": ["name"],
    });
    json!({
        "title": "foxglove.JointStates",
        "type": "object",
        "properties": {
            "timestamp": { "type": "object", "title": "time", "properties": { "sec": whole, "nsec": whole } },
            "joints": { "type": "array", "items": joint },
        },
        "required": ["timestamp", "joints"],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the rules of the representation, written out by hand.
    #[test]
    fn a_message_is_laid_out_as_ros_2_has_it() {
        let message = joint_state(3_000_000_007, [0.5, -1.0, 0.25, 2.0]);
        assert_eq!(message[..16], [0, 1, 0, 0, 3, 0, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0]);
        // An empty frame, three bytes to the next number, four names.
        assert_eq!(message[16..28], [0, 0, 0, 0, 4, 0, 0, 0, 13, 0, 0, 0]);
        assert_eq!(&message[28..41], b"set_left_hip\0");
        let end = message.len();
        let doubles: Vec<f64> = message[end - 8 - 32..end - 8]
            .chunks(8)
            .map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()))
            .collect();
        assert_eq!(doubles, [0.5, -1.0, 0.25, 2.0]);
        assert_eq!((end - 8 - 32 - 4) % 8, 0, "a double lies at a multiple of 8 behind the first four bytes");
        assert_eq!(message[end - 8..], [0; 8]);
    }
}
