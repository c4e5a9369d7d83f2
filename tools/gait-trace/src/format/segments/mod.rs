//! Computes hip and knee angles from the positions of hip, knee and ankle, for C3D and TRC files.
//!
//! With `up` and the person's `forward`, the angle of a segment from `a` down to `b` is `atan2((b - a).forward, (a - b).up)`: 0 when
//! it is vertical, positive when its lower end is in front. The hip angle is that of the thigh (the tilt of the pelvis is not
//! included), the knee angle is thigh minus shank. Both are positive in flexion.
//!
//! `up` is the axis along which the ankles are below the hips. `forward` is level and square to the line between the hips,
//! left to right, averaged over [`WINDOW_S`] so that it follows a person who turns and not the pelvis within each stride. With one
//! leg only, it is the direction from the hip's first to its last position.

mod names;
mod pelvis;
mod vector;

use crate::fault::Fault;
use crate::format::angle_columns::AngleColumn;
use crate::format::unit::Said;
use crate::raw::{Doubt, SignSource};
use joint_units::Joint;
use names::Place;
pub(crate) use names::{FoundLegs, Leg, candidates, find, find_seen, one_leg};
pub(crate) use pelvis::LengthUnit;
pub(crate) use vector::Track;
use vector::{add, cross, dot, length, mean_track, scale, square_to, sub, unit};

/// Width of the moving average of the line between the hips, seconds: about a stride.
const WINDOW_S: f64 = 1.2;
/// The line from ankles to hips must be within 30 degrees of an axis: cosine of that angle.
const UPRIGHT: f64 = 0.866;
/// Largest mean lean of the legs from the vertical, degrees, to the front, the back or the side; of a person who turns, and leans to the inside.
const MOST_LEAN_DEG: f64 = 8.0;
const MOST_LEAN_IN_TURN_DEG: f64 = 14.0;
/// From this angle to the mean direction on, degrees, a person turns.
const TURNED_DEG: f64 = 30.0;

/// The trajectories of the legs.
///
/// # Errors
/// A hip is computed from the pelvis, and the unit of length is unknown or wrong.
pub(crate) fn tracks(
    legs: FoundLegs,
    mut track: impl FnMut(usize) -> Track,
    length_unit: LengthUnit<'_>,
    notes: &mut Vec<String>,
) -> Result<[Option<Leg<Track>>; 2], Fault> {
    let mut moving = [None, None];
    for (moving, leg) in moving.iter_mut().zip(legs) {
        let Some(Leg { places, name, markers }) = leg else { continue };
        let mut tracks: [Track; 3] = Default::default();
        for (found, place) in tracks.iter_mut().zip(&places) {
            *found = match place {
                Place::Mean(points) => mean_track(points, &mut track),
                Place::InPelvis(pelvis) => pelvis.hip(&mut track, length_unit, notes)?,
            };
        }
        *moving = Some(Leg { places: tracks, name, markers });
    }
    Ok(moving)
}

pub(crate) fn is_seen(point: &[f64; 3]) -> bool {
    point.iter().all(|value| !value.is_nan())
}

/// The mean of the points that are not missing.
fn mean(points: impl Iterator<Item = [f64; 3]>) -> Option<[f64; 3]> {
    let (sum, count) =
        points.filter(is_seen).fold(([0.0; 3], 0_usize), |(sum, count), point| (add(sum, point), count + 1));
    (count > 0).then(|| scale(sum, 1.0 / count as f64))
}

/// The angles of the legs that are present.
pub(crate) fn angles(
    legs: &[Option<Leg<Track>>; 2],
    rate_hz: f64,
    screen_up: Option<&str>,
    notes: &mut Vec<String>,
    doubts: &mut Vec<Doubt>,
) -> Result<Vec<AngleColumn>, Fault> {
    let (up, lean_deg) = up(legs, screen_up, notes)?;
    let (forward, turned_deg) = forward(legs, up, rate_hz, notes)?;
    if lean_deg > if turned_deg > TURNED_DEG { MOST_LEAN_IN_TURN_DEG } else { MOST_LEAN_DEG } {
        doubts.push(Doubt::Vertical { lean_deg });
    }
    let mut columns = Vec::new();
    for (leg, [hip, knee]) in legs.iter().zip([[Joint::LeftHip, Joint::LeftKnee], [Joint::RightHip, Joint::RightKnee]])
    {
        let Some(Leg { places: [hips, knees, ankles], name, markers }) = leg else { continue };
        let lean = |above: [f64; 3], below: [f64; 3], forward: [f64; 3]| {
            let down = sub(below, above);
            dot(down, forward).atan2(-dot(down, up)).to_degrees()
        };
        let thigh: Vec<f64> = (0..hips.len()).map(|n| lean(hips[n], knees[n], forward[n])).collect();
        let bend = (0..hips.len()).map(|n| turn(thigh[n] - lean(knees[n], ankles[n], forward[n]))).collect();
        for (joint, values) in [(hip, thigh), (knee, bend)] {
            let heading = format!("{} from {name}", joint.name());
            columns.push(AngleColumn {
                joint,
                heading,
                index: 0,
                said: Said::Computed,
                sign: SignSource::Computed,
                values,
            });
        }
        notes.push(format!(
            "{} and {} are computed from {name}: the hip is the thigh against the vertical (without the pelvis), the knee is thigh minus shank, flexion positive.",
            hip.name(),
            knee.name()
        ));
        if !markers.is_empty() {
            notes.push(format!("The points {} are used as joint centres; a marker beside a joint displaces its angles by some degrees, about the same in all frames.", markers.join(", ")));
        }
    }
    Ok(columns)
}

/// An angle brought to -180 to 180 degrees.
fn turn(degrees: f64) -> f64 {
    if degrees > 180.0 {
        degrees - 360.0
    } else if degrees < -180.0 {
        degrees + 360.0
    } else {
        degrees
    }
}

fn axis_name(axis: [f64; 3]) -> String {
    let largest = (0..3).fold(0, |best, n| if axis[n].abs() > axis[best].abs() { n } else { best });
    format!("{}{}", if axis[largest] < 0.0 { '-' } else { '+' }, ['X', 'Y', 'Z'][largest])
}

/// The axis along which the hips are above the ankles, and by how many degrees the mean line between them leans from it.
fn up(
    legs: &[Option<Leg<Track>>; 2],
    screen_up: Option<&str>,
    notes: &mut Vec<String>,
) -> Result<([f64; 3], f64), Fault> {
    let fault = || Fault::NoFrameOfReference {
        what: "the vertical",
        allowed: "hips above ankles along one axis of the laboratory, within 30 degrees",
    };
    let rise = |leg: &Leg<Track>| {
        let [hips, _, ankles] = &leg.places;
        mean(hips.iter().zip(ankles).map(|(&hip, &ankle)| sub(hip, ankle)))
    };
    let rise = mean(legs.iter().flatten().filter_map(rise)).and_then(unit).ok_or_else(fault)?;
    let largest = (0..3).fold(0, |best, n| if rise[n].abs() > rise[best].abs() { n } else { best });
    if rise[largest].abs() < UPRIGHT {
        return Err(fault());
    }
    let mut up = [0.0; 3];
    up[largest] = rise[largest].signum();
    let lean_deg = rise[largest].abs().min(1.0).acos().to_degrees();
    let name = axis_name(up);
    let screen = screen_up.map(|text| text.trim().to_uppercase()).filter(|text| !text.is_empty());
    notes.push(match screen {
        Some(screen) if screen.trim_start_matches('+') == name.trim_start_matches('+') => {
            format!("Up is {name}: the hips are above the ankles along it, and POINT:Y_SCREEN agrees.")
        }
        Some(screen) => {
            format!(
                "Up is {name}: the hips are above the ankles along it. POINT:Y_SCREEN names {screen} and is ignored."
            )
        }
        None => format!("Up is {name}: the hips are above the ankles along it."),
    });
    Ok((up, lean_deg))
}

/// Forward in each frame, and by how many degrees it turns from the mean direction.
fn forward(
    legs: &[Option<Leg<Track>>; 2],
    up: [f64; 3],
    rate_hz: f64,
    notes: &mut Vec<String>,
) -> Result<(Vec<[f64; 3]>, f64), Fault> {
    let fault = || Fault::NoFrameOfReference {
        what: "the direction of walking",
        allowed: "both hips, or one leg that moves farther than its own length",
    };
    let first_leg = legs.iter().flatten().next().ok_or_else(fault)?;
    let [hips, _, ankles] = &first_leg.places;
    let leg_length = mean(hips.iter().zip(ankles).map(|(&hip, &ankle)| sub(hip, ankle))).map_or(0.0, length);
    let mut seen = hips.iter().copied().filter(is_seen);
    let start = seen.next().ok_or_else(fault)?;
    let way = square_to(sub(seen.next_back().unwrap_or(start), start), up);
    let walked = (length(way) > leg_length).then_some(way).and_then(unit);

    let [Some(left), Some(right)] = legs else {
        let forward = walked.ok_or_else(fault)?;
        notes.push(format!(
            "Forward is close to {}: the direction from the hip's first to its last position.",
            axis_name(forward)
        ));
        return Ok((vec![forward; hips.len()], 0.0));
    };
    let across = left.places[0].iter().zip(&right.places[0]).map(|(&left, &right)| square_to(sub(left, right), up));
    let frames = across.len();
    let half = ((WINDOW_S / 2.0 * rate_hz) as usize).min(frames);
    // Running sums of the known points: each window is a difference of two sums.
    let mut sums = vec![([0.0; 3], 0_usize)];
    for point in across {
        let (sum, count) = sums[sums.len() - 1];
        sums.push(if is_seen(&point) { (add(sum, point), count + 1) } else { (sum, count) });
    }
    let total = sums[frames].0;
    let overall = unit(cross(total, up)).ok_or_else(fault)?;
    let forward: Vec<[f64; 3]> = (0..frames)
        .map(|n| {
            let (from, to) = (sums[n.saturating_sub(half)], sums[(n + half + 1).min(frames)]);
            let window = (to.1 > from.1).then(|| cross(sub(to.0, from.0), up)).and_then(unit);
            window.unwrap_or(overall)
        })
        .collect();
    let agrees = match walked.map(|walked| dot(walked, overall)) {
        Some(cosine) if cosine < 0.0 => {
            "; but the hips move the opposite way: walking backwards, or left and right exchanged".to_owned()
        }
        Some(_) => ", and the hips move that way".to_owned(),
        None => ", and the person stays in place, as on a treadmill".to_owned(),
    };
    let turned = forward.iter().map(|&now| dot(now, overall)).fold(1.0, f64::min).acos().to_degrees();
    notes.push(format!(
        "Forward is close to {}, perpendicular to the line between the hips{agrees}.",
        axis_name(overall)
    ));
    if turned > TURNED_DEG {
        notes.push(format!(
            "The person turns by up to {turned:.0} degrees from the mean direction; forward turns with the person."
        ));
    }
    Ok((forward, turned))
}
