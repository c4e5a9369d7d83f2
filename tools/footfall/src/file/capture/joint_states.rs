//! The setpoints of a capture as ROS 2 messages, and a robot to show them on, so that a leg moves in a viewer.
//!
//! | topic | message | content |
//! |---|---|---|
//! | `/joint_states` | `sensor_msgs/msg/JointState`, 100 a second | the four setpoints, in radians (ROS REP 103), as `set_left_hip` and so on |
//! | `/robot_description` | `std_msgs/msg/String`, once | a URDF of four joints with the ranges of the robot |
//!
//! The messages are in the Common Data Representation, little endian (OMG DDSI-RTPS 2.3, 10.5).

use joint_loop::RobotConfig;
use joint_units::Joint;
use std::fmt::Write as _;

/// Name and definition of the message with the state of joints.
pub(super) const JOINT_STATE: (&str, &str) = (
    "sensor_msgs/msg/JointState",
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n\
     ================================================================================\n\
     MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
     ================================================================================\n\
     MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
);

/// Name and definition of the message with a text.
pub(super) const TEXT: (&str, &str) = ("std_msgs/msg/String", "string data\n");

/// One message in this many ticks.
pub(super) const TICKS: u32 = 10;

/// Lengths of the drawn robot, metres: a desk robot.
const THIGH_M: f64 = 0.20;
const SHANK_M: f64 = 0.20;
const FOOT_M: f64 = 0.09;
const HIP_TO_HIP_M: f64 = 0.12;

/// A message that is written from its beginning.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    /// A number lies at a multiple of its size, counted from behind the first four bytes.
    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        while !(self.0.len() - 4).is_multiple_of(N) {
            self.0.push(0);
        }
        self.0.extend(bytes);
    }

    fn count(&mut self, count: usize) {
        self.number((count as u32).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }
}

/// The name of a joint in both messages: what is commanded, not what a sensor measures.
fn name_of(joint: Joint) -> String {
    format!("set_{}", joint.name())
}

/// The setpoints of a tick, radians.
pub(super) fn joint_state(time_ns: u64, setpoints_rad: [f32; Joint::COUNT]) -> Vec<u8> {
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

/// A text as a message.
pub(super) fn text(text: &str) -> Vec<u8> {
    let mut message = Cdr::new();
    message.text(text);
    message.0
}

/// A robot of a pelvis, two thighs and two shanks as URDF, with x forward, y to the left and z up. Only the ranges and rates of the joints
/// are those of the robot.
pub(super) fn urdf(robot: &RobotConfig) -> String {
    let mut text = String::from("<?xml version=\"1.0\"?>\n<robot name=\"biped\">\n");
    // Writing to a string cannot fail.
    let _ = link(&mut text, "pelvis", [0.06, HIP_TO_HIP_M, 0.04], [0.0, 0.0, 0.0], None);
    for (side, y) in [("left", HIP_TO_HIP_M / 2.0), ("right", -HIP_TO_HIP_M / 2.0)] {
        let [thigh, shank] = ["thigh", "shank"].map(|part| format!("{side}_{part}"));
        let foot = Some(([FOOT_M, 0.04, 0.012], [FOOT_M / 3.0, 0.0, -SHANK_M]));
        let _ = link(&mut text, &thigh, [0.03, 0.03, THIGH_M], [0.0, 0.0, -THIGH_M / 2.0], None);
        let _ = link(&mut text, &shank, [0.025, 0.025, SHANK_M], [0.0, 0.0, -SHANK_M / 2.0], foot);
        let (hip, knee) =
            if side == "left" { (Joint::LeftHip, Joint::LeftKnee) } else { (Joint::RightHip, Joint::RightKnee) };
        // Flexion is positive: it swings the thigh forward and the shank backward.
        let _ = joint(&mut text, robot, hip, ["pelvis", &thigh], [0.0, y, 0.0], "0 -1 0");
        let _ = joint(&mut text, robot, knee, [&thigh, &shank], [0.0, 0.0, -THIGH_M], "0 1 0");
    }
    text + "</robot>\n"
}

type Shape = ([f64; 3], [f64; 3]);

fn link(out: &mut String, name: &str, size: [f64; 3], at: [f64; 3], more: Option<Shape>) -> std::fmt::Result {
    writeln!(out, "  <link name=\"{name}\">")?;
    for ([length, width, height], [x, y, z]) in std::iter::once((size, at)).chain(more) {
        writeln!(
            out,
            "    <visual><origin xyz=\"{x} {y} {z}\"/><geometry><box size=\"{length} {width} {height}\"/></geometry></visual>"
        )?;
    }
    writeln!(out, "  </link>")
}

fn joint(
    out: &mut String,
    robot: &RobotConfig,
    joint: Joint,
    [parent, child]: [&str; 2],
    [x, y, z]: [f64; 3],
    axis: &str,
) -> std::fmt::Result {
    let (range, rate) = (robot.gate.range[joint as usize], robot.gate.rate[joint as usize]);
    writeln!(
        out,
        "  <joint name=\"{}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"{x} {y} {z}\"/><axis xyz=\"{axis}\"/><limit lower=\"{}\" upper=\"{}\" velocity=\"{}\" effort=\"1\"/></joint>",
        name_of(joint),
        range.least.0,
        range.most.0,
        rate.0
    )
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

    #[test]
    fn the_robot_has_its_own_ranges() {
        let mut robot = RobotConfig::default_biped();
        robot.gate.range[Joint::RightKnee as usize].most = joint_units::Radians(1.25);
        let text = urdf(&robot);
        assert_eq!(text.matches("<joint ").count(), 4);
        let knee = text.lines().find(|line| line.contains("\"set_right_knee\"")).unwrap();
        assert!(knee.contains("upper=\"1.25\"") && knee.contains("<child link=\"right_shank\"/>"), "{knee}");
    }
}
