//! A robot to show setpoints on, as URDF: four joints with the ranges of the robot that runs.

use super::cdr::Cdr;
use super::joint_states::name_of;
use joint_loop::RobotConfig;
use joint_units::Joint;
use std::fmt::Write as _;

/// The topic.
pub(crate) const TOPIC: &str = "/robot_description";

/// Name and definition of the message with a text.
pub(crate) const TEXT: (&str, &str) = ("std_msgs/msg/String", "string data\n");

/// Lengths of the drawn robot, metres: a desk robot.
const THIGH_M: f64 = 0.20;
const SHANK_M: f64 = 0.20;
const FOOT_M: f64 = 0.09;
const HIP_TO_HIP_M: f64 = 0.12;

/// A text as a message.
pub(crate) fn text(text: &str) -> Vec<u8> {
    let mut message = Cdr::new();
    message.text(text);
    message.0
}

/// A robot of a pelvis, two thighs and two shanks as URDF, with x forward, y to the left and z up. Only the ranges and rates of the joints
/// are those of the robot.
pub(crate) fn urdf(robot: &RobotConfig) -> String {
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
