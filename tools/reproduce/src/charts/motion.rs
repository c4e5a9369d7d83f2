//! Charts of joint angles and angular velocities over time, and phase portraits.

use joint_units::Joint;

use picture::{Curve, Panel};

/// Time, angle and rate of each joint: s, deg, deg/s.
pub type Motion = [Vec<(f64, f64, f64)>; 4];

/// Angles over time, velocities over time, phase portraits.
#[must_use]
pub fn over_time(motion: &Motion) -> Vec<Panel> {
    let mut panels = vec![angles(motion), velocities(motion)];
    panels.extend(Joint::ALL.into_iter().zip(motion).map(|(joint, points)| portrait(joint.name(), points)));
    panels
}

/// The four joint angles over time.
#[must_use]
pub fn angles(motion: &Motion) -> Panel {
    Panel::curves("joint angles", "time, s", "angle, deg", curves(motion, |point| (point.0, point.1)))
}

/// The four angular velocities over time.
#[must_use]
pub fn velocities(motion: &Motion) -> Panel {
    Panel::curves("angular velocities", "time, s", "velocity, deg/s", curves(motion, |point| (point.0, point.2)))
}

fn curves(motion: &Motion, of: fn(&(f64, f64, f64)) -> (f64, f64)) -> Vec<Curve> {
    let curve = |(joint, points): (Joint, &Vec<_>)| Curve::new(joint.name(), points.iter().map(of).collect());
    Joint::ALL.into_iter().zip(motion).map(curve).collect()
}

/// Velocity over angle of one joint.
#[must_use]
pub fn portrait(name: &str, points: &[(f64, f64, f64)]) -> Panel {
    let curve = Curve::new("", points.iter().map(|p| (p.1, p.2)).collect());
    Panel::curves(&format!("{name}: phase portrait"), "angle, deg", "velocity, deg/s", vec![curve])
}
