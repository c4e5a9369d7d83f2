//! The servo map from measured points: a straight line, written into the robot file.

use std::fmt;

use joint_units::{Joint, PulseMicros};
use toml_edit::DocumentMut;

use crate::line_fit::line_fit;

/// Least distance of the furthest two angles, degrees: an error of a degree in one of them changes the scale by a tenth.
pub(super) const LEAST_SPAN_DEG: f64 = 10.0;

/// Largest distance of a point from the line, degrees: a servo is straighter, and an angle is read better.
const MOST_MISFIT_DEG: f64 = 5.0;

/// The joint had this angle at this pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub(super) pulse: PulseMicros,
    pub(super) angle_deg: f64,
}

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} us is {} degrees", self.pulse.0, self.angle_deg)
    }
}

/// A measured servo map, as the robot file has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ServoMap {
    neutral_us: u16,
    angle_at_neutral_deg: f64,
    us_per_rad: f64,
    is_mirrored: bool,
    /// Largest distance of a point from the line, degrees; `None` for two points, which every line passes.
    misfit_deg: Option<f64>,
}

/// The line of least squares through the points. Its neutral pulse is that of the angle nearest to zero.
///
/// # Errors
/// In words: fewer than two points, angles too close to each other or in contradiction, or pulses that do not change with them.
pub(super) fn solve(points: &[Point]) -> Result<ServoMap, String> {
    let angles = || points.iter().map(|point| point.angle_deg);
    let span = angles().fold(f64::MIN, f64::max) - angles().fold(f64::MAX, f64::min);
    let Some(neutral) = points.iter().min_by(|a, b| a.angle_deg.abs().total_cmp(&b.angle_deg.abs())) else {
        return Err("no angle was given; allowed are two or more".into());
    };
    if span < LEAST_SPAN_DEG {
        return Err(format!(
            "the angles are {span} degrees apart; allowed are two angles {LEAST_SPAN_DEG} degrees apart or more"
        ));
    }
    let pairs: Vec<(f64, f64)> = points.iter().map(|point| (point.angle_deg, f64::from(point.pulse.0))).collect();
    let (at_zero, us_per_deg) = line_fit(&pairs);
    if us_per_deg == 0.0 {
        return Err("the pulse is the same at every angle; the servo does not turn the joint".into());
    }
    let angle_of = |pulse: PulseMicros| (f64::from(pulse.0) - at_zero) / us_per_deg;
    let misfit = points.iter().map(|point| (angle_of(point.pulse) - point.angle_deg).abs()).fold(0.0, f64::max);
    if misfit > MOST_MISFIT_DEG {
        let all: Vec<String> = points.iter().map(ToString::to_string).collect();
        return Err(format!(
            "the angles contradict each other: one is {misfit:.1} degrees from the line through them, allowed are {MOST_MISFIT_DEG}; `undo` the wrong one \
             ({})",
            all.join(", ")
        ));
    }
    Ok(ServoMap {
        neutral_us: neutral.pulse.0,
        angle_at_neutral_deg: rounded(angle_of(neutral.pulse), 1e3),
        us_per_rad: rounded(us_per_deg.abs().to_degrees(), 1e2),
        is_mirrored: us_per_deg < 0.0,
        misfit_deg: (points.len() > 2).then_some(misfit),
    })
}

/// To so many parts of one, without a negative zero.
fn rounded(number: f64, parts: f64) -> f64 {
    (number * parts).round() / parts + 0.0
}

impl ServoMap {
    /// The text of a robot file with this map in place of the joint's; all else, comments too, is as before.
    ///
    /// # Errors
    /// The text is not TOML.
    pub(super) fn written_into(&self, text: &str, joint: Joint) -> Result<String, toml_edit::TomlError> {
        let mut document: DocumentMut = text.parse()?;
        let table = &mut document[joint.name()];
        let mut put = |key: &str, mut new: toml_edit::Value| {
            // The comment behind a value stays.
            if let Some(old) = table.get(key).and_then(toml_edit::Item::as_value) {
                *new.decor_mut() = old.decor().clone();
            }
            table[key] = toml_edit::Item::Value(new);
        };
        put("neutral_us", i64::from(self.neutral_us).into());
        put("angle_at_neutral_deg", self.angle_at_neutral_deg.into());
        put("us_per_rad", self.us_per_rad.into());
        put("direction", self.direction().into());
        Ok(document.to_string())
    }

    const fn direction(&self) -> &'static str {
        if self.is_mirrored { "mirrored" } else { "forward" }
    }
}

/// As lines of the robot file.
impl fmt::Display for ServoMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "neutral_us = {}", self.neutral_us)?;
        writeln!(f, "angle_at_neutral_deg = {:?}", self.angle_at_neutral_deg)?;
        writeln!(f, "us_per_rad = {:?}", self.us_per_rad)?;
        writeln!(f, "direction = {:?}", self.direction())?;
        match self.misfit_deg {
            Some(misfit) => writeln!(f, "# no point is further than {misfit:.1} degrees from this line"),
            None => writeln!(f, "# two points: a third one would show how straight the servo is"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use generator_file::robot_file::RobotFile;
    use joint_loop::{Direction, RobotConfig};

    fn point(pulse: u16, angle_deg: f64) -> Point {
        Point { pulse: PulseMicros(pulse), angle_deg }
    }

    #[test]
    fn two_points_give_the_map_of_their_servo() {
        // 10 us a degree, mirrored, 0 degrees at 1480 us.
        let map = solve(&[point(1_480, 0.0), point(1_180, 30.0)]).unwrap();
        assert_eq!(
            map.to_string(),
            "neutral_us = 1480\nangle_at_neutral_deg = 0.0\nus_per_rad = 572.96\ndirection = \"mirrored\"\n# two points: a third one would \
             show how straight the servo is\n"
        );
        // Forward, and no point at zero: the nearest one is the neutral.
        let map = solve(&[point(2_000, 95.0), point(1_100, 5.0)]).unwrap();
        assert!(map.to_string().starts_with(
            "neutral_us = 1100\nangle_at_neutral_deg = 5.0\nus_per_rad = 572.96\ndirection = \"forward\""
        ));
    }

    #[test]
    fn a_third_point_shows_the_misfit() {
        let map = solve(&[point(1_000, 0.0), point(1_330, 30.0), point(1_600, 60.0)]).unwrap();
        // Least squares by hand: slope 10 us a degree, 1010 us at zero; the middle point is 2 degrees off.
        assert!(map.to_string().contains("# no point is further than 2.0 degrees"), "{map}");
        assert!(map.to_string().contains("angle_at_neutral_deg = -1.0\nus_per_rad = 572.96\n"), "{map}");
    }

    #[test]
    fn what_is_no_map_is_refused_in_words() {
        for (points, words) in [
            (&[][..], "no angle was given"),
            (&[point(1_500, 0.0)], "0 degrees apart; allowed are two angles 10 degrees apart or more"),
            (&[point(1_500, 0.0), point(1_600, 9.0)], "9 degrees apart"),
            (&[point(1_500, 0.0), point(1_500, 30.0)], "the servo does not turn the joint"),
            (&[point(1_500, 0.0), point(1_560, 30.0), point(1_550, 5.0)], "one is 15.7 degrees from the line"),
        ] {
            assert!(solve(points).unwrap_err().contains(words), "{words}");
        }
    }

    #[test]
    fn the_rest_of_a_file_stays_as_it_was() {
        let before =
            RobotFile::default_biped().to_toml().replace("us_per_rad = 636.62\n", "us_per_rad = 636.62 # measured\n");
        let map = solve(&[point(1_450, 5.0), point(1_150, 35.0)]).unwrap();
        let after = map.written_into(&before, Joint::LeftHip).unwrap();
        let (changed, kept): (Vec<_>, Vec<_>) = before.lines().zip(after.lines()).partition(|(was, is)| was != is);
        assert_eq!(before.lines().count(), after.lines().count());
        assert!(changed.len() == 4 && kept.len() > 30, "{changed:?}");
        assert!(changed.iter().any(|(_, is)| *is == "us_per_rad = 572.96 # measured"), "{changed:?}");
        let mut robot = RobotConfig::default_biped();
        let servo = &mut robot.servos[Joint::LeftHip as usize];
        (servo.neutral, servo.direction, servo.micros_per_radian) = (PulseMicros(1_450), Direction::Mirrored, 572.96);
        servo.angle_at_neutral = joint_units::Radians::from_degrees(5.0);
        assert_eq!(RobotFile::parse("after", &after).map(|file| file.robot.servos).ok(), Some(robot.servos), "{after}");
    }
}
