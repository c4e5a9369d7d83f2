//! A robot file: not the default robot.

use generator_file::robot_file::RobotFile;
use joint_loop::RecordName;
use joint_units::{Joint, PulseMicros, Radians};

/// A small robot: servos with 10 µs for a degree around 1520 µs, mounted as those of the default robot, and less travel.
pub(super) fn small() -> String {
    let mut file = RobotFile::default_biped();
    file.name = RecordName::cut("small biped");
    for joint in Joint::ALL {
        let servo = &mut file.robot.servos[joint as usize];
        servo.neutral = PulseMicros(1520);
        servo.micros_per_radian = 1.0 / Radians::from_degrees(0.1).0;
        file.robot.gate.range[joint as usize].most = Radians::from_degrees(match joint {
            Joint::LeftHip | Joint::RightHip => 45.0,
            Joint::LeftKnee | Joint::RightKnee => 90.0,
        });
    }
    file.to_toml()
}
