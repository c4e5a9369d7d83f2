//! Which of the three components of a joint's angles is flexion.
//!
//! Plug-in Gait defines it: `LHipAngles`, `RKneeAngles`, ... have flexion first, positive (Vicon, Lower body angles as output from Plug-in Gait).
//! A stiff knee may rotate more than it bends, so the movement changes nothing there; only where another component moves as far as
//! flexion does in gait, and the first one hardly, the angles are of another model with the same names, and the axis is asked for.
//! Other models have flexion second or third. There it is the component that moves most, of a walking knee by about 60
//! degrees while the other two move by 10 to 20; that is a guess, which is reported.

use crate::format::segments::Track;
use crate::format::subjects;
use crate::options::Axis;
use crate::raw::{Doubt, SignSource};
use crate::series::quantile;
use joint_units::Joint;

/// How much more the widest component moves than the next one before it is taken without doubt.
const CLEAR: f64 = 1.3;
/// Components that move less than this show nothing.
const LEAST_RANGE: f64 = 1e-3;
/// From this range on, degrees, a component of a knee moves as flexion does in gait: rotations stay below it.
const FLEXION_DEG: f64 = 40.0;
/// The first component of Plug-in Gait is doubted where another one moves as flexion and so many times as far.
const OTHER_MODEL: f64 = 2.5;

/// The axis of flexion of the joints' angles, with a note or a doubt. The knees decide; the hips only where there is no knee.
///
/// # Errors
/// The angles have the names of Plug-in Gait, and another component than the first moves like flexion: how much each moves, in words.
pub(crate) fn of_flexion(
    points: &[(Joint, usize, Track)],
    is_plug_in_gait: bool,
    notes: &mut Vec<String>,
    doubts: &mut Vec<Doubt>,
) -> Result<Axis, String> {
    let Widest { axis, ranges, moves } = widest(points);
    if is_plug_in_gait {
        let other = ranges[1].max(ranges[2]);
        if other >= FLEXION_DEG && other > OTHER_MODEL * ranges[0] {
            return Err(format!("Plug-in Gait, whose names they have, defines it as x, but {moves} degrees"));
        }
        let although = match axis {
            Some(axis) if axis != Axis::X => format!(", although component {} moves most ({moves})", axis.name()),
            _ => String::new(),
        };
        notes.push(format!(
            "Flexion is read from component x of the angles, as Plug-in Gait defines it{although}; `--axis` takes another."
        ));
        return Ok(Axis::X);
    }
    doubts.push(axis.map_or(Doubt::NoComponent, Doubt::Component));
    notes.push(format!("The knees, or the hips where there are none: {moves}."));
    Ok(axis.unwrap_or(Axis::X))
}

/// The same where one component clearly moves most.
///
/// # Errors
/// Also where none does.
pub(crate) fn clear(
    points: &[(Joint, usize, Track)],
    is_plug_in_gait: bool,
    notes: &mut Vec<String>,
    doubts: &mut Vec<Doubt>,
) -> Result<Axis, String> {
    match widest(points) {
        Widest { axis: None, moves, .. } if !is_plug_in_gait => Err(moves),
        _ => of_flexion(points, is_plug_in_gait, notes, doubts),
    }
}

/// Whether an output has one of the names that Plug-in Gait gives the angles of hips and knees, perhaps behind the name of a subject.
pub(crate) fn is_plug_in_gait(name: &str) -> bool {
    let names = ["LHipAngles", "RHipAngles", "LKneeAngles", "RKneeAngles"];
    names.iter().any(|known| known.eq_ignore_ascii_case(subjects::bare(name).trim()))
}

/// What the name of an output says about the sign of its component: that the first one of Plug-in Gait is flexion.
pub(crate) fn sign_of_plug_in_gait(name: &str, axis: Axis) -> SignSource {
    if is_plug_in_gait(name) && axis == Axis::X {
        SignSource::Format("as Plug-in Gait defines its angles")
    } else {
        SignSource::Model
    }
}

struct Widest {
    /// The component that clearly moves most.
    axis: Option<Axis>,
    /// How much each moves.
    ranges: [f64; 3],
    /// The same in words.
    moves: String,
}

fn widest(points: &[(Joint, usize, Track)]) -> Widest {
    let is_knee = |joint: Joint| matches!(joint, Joint::LeftKnee | Joint::RightKnee);
    let any_knee = points.iter().any(|(joint, ..)| is_knee(*joint));
    let ranges = Axis::ALL.map(|axis| {
        let tracks = points.iter().filter(|(joint, ..)| is_knee(*joint) == any_knee);
        tracks.map(|(.., track)| range(track, axis)).fold(0.0, f64::max)
    });
    let mut order = Axis::ALL;
    order.sort_by(|a, b| ranges[*b as usize].total_cmp(&ranges[*a as usize]));
    let [first, second, _] = order;
    let [most, next] = [ranges[first as usize], ranges[second as usize]];
    let moves = format!("the components move by {:.1}, {:.1} and {:.1}", ranges[0], ranges[1], ranges[2]);
    let axis = (most >= LEAST_RANGE && most >= CLEAR * next).then_some(first);
    Widest { axis, ranges, moves }
}

/// Between which angles a component moves, without the outermost hundredths; 0 if it is missing.
fn range(track: &Track, axis: Axis) -> f64 {
    let values = || track.iter().map(|point| point[axis as usize]).filter(|value| value.is_finite());
    quantile(values(), 0.99) - quantile(values(), 0.01)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving(axis: Axis, by: f64) -> Track {
        let point = |n: usize| {
            let mut point = [1.0, 2.0 + (n as f64 * 0.2).cos(), 3.0 - (n as f64 * 0.1).cos()];
            point[axis as usize] = 30.0 + by * (n as f64 * 0.1).sin();
            point
        };
        (0..200).map(point).collect()
    }

    fn of(points: &[(Joint, usize, Track)], is_plug_in_gait: bool) -> Result<(Axis, Vec<String>, Vec<Doubt>), String> {
        let (mut notes, mut doubts) = (Vec::new(), Vec::new());
        of_flexion(points, is_plug_in_gait, &mut notes, &mut doubts).map(|axis| (axis, notes, doubts))
    }

    #[test]
    fn the_component_that_moves_like_flexion_is_a_guess() {
        for axis in Axis::ALL {
            // A hip that moves more about another axis does not decide.
            let points = [(Joint::LeftHip, 0, moving(Axis::Y, 80.0)), (Joint::LeftKnee, 1, moving(axis, 30.0))];
            let (found, _, doubts) = of(&points, false).unwrap();
            assert_eq!((found, doubts), (axis, vec![Doubt::Component(axis)]));
        }
        let (found, _, doubts) = of(&[(Joint::LeftKnee, 0, moving(Axis::Z, 1.0))], false).unwrap();
        assert_eq!((found, doubts), (Axis::X, vec![Doubt::NoComponent]));
    }

    /// A knee that bends by 2 degrees may rotate by 20 or 30; by 60 it does not, and what bends by 30 may rotate by as much.
    #[test]
    fn plug_in_gait_has_flexion_first_whatever_moves() {
        for (x, other, is_x) in
            [(60.0, 15.0, true), (2.0, 20.0, true), (6.0, 38.0, true), (20.0, 45.0, true), (4.0, 60.0, false)]
        {
            for axis in [Axis::Y, Axis::Z] {
                let mut track = moving(axis, other / 2.0);
                for (n, point) in track.iter_mut().enumerate() {
                    point[0] = 30.0 + x / 2.0 * (n as f64 * 0.1).sin();
                }
                match of(&[(Joint::LeftKnee, 0, track)], true) {
                    Ok((found, notes, doubts)) => {
                        assert!(is_x && found == Axis::X && doubts.is_empty(), "{x} {other}");
                        assert!(notes[0].contains("as Plug-in Gait defines it"), "{notes:?}");
                        assert_eq!(notes[0].contains("although"), other > CLEAR * x, "{notes:?}");
                    }
                    Err(moves) => assert!(!is_x && moves.contains("the components move by"), "{moves}"),
                }
            }
        }
    }

    #[test]
    fn names_of_plug_in_gait_are_recognised() {
        assert!(["LKneeAngles", "Anna:RHipAngles", "rkneeangles"].into_iter().all(is_plug_in_gait));
        assert!(
            ["LKneeAngle", "L_Knee_Angles", "LKneeMoment", "LAnkleAngles"]
                .into_iter()
                .all(|name| !is_plug_in_gait(name))
        );
    }
}
