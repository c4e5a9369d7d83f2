//! Which of the three components of a joint's angles is flexion.
//!
//! Plug-in Gait has flexion first, other models second or third. Flexion is the component that moves most: of a walking knee by about 60
//! degrees, while the other two move by 10 to 20.

use crate::format::segments::Track;
use crate::options::Axis;
use crate::raw::SignSource;
use crate::series::quantile;
use joint_units::Joint;

/// How much more the widest component moves than the next one before it is taken without doubt.
const CLEAR: f64 = 1.3;
/// Components that move less than this show nothing.
const LEAST_RANGE: f64 = 1e-3;

/// The axis of flexion of the joints' angles, with a note. The knees decide; the hips only where there is no knee.
pub(crate) fn of_flexion(points: &[(Joint, usize, Track)], notes: &mut Vec<String>) -> Axis {
    let (widest, moves) = widest(points);
    notes.push(match widest {
        Some(axis) => format!(
            "Flexion is read from component {} of the angles, which moves most ({moves}); `--axis` takes another.",
            axis.name()
        ),
        None => format!(
            "No component of the angles clearly moves like flexion ({moves}); x is read, as in Plug-in Gait; `--axis` takes another."
        ),
    });
    widest.unwrap_or(Axis::X)
}

/// The axis of flexion where one component clearly moves most, with a note.
///
/// # Errors
/// None does; how much each moves, in words.
pub(crate) fn clear(points: &[(Joint, usize, Track)], notes: &mut Vec<String>) -> Result<Axis, String> {
    match widest(points) {
        (Some(_), _) => Ok(of_flexion(points, notes)),
        (None, moves) => Err(moves),
    }
}

/// The first axis, which is flexion where Plug-in Gait named the angles, with a note that says whether another one moves most.
pub(crate) fn of_plug_in_gait(points: &[(Joint, usize, Track)], notes: &mut Vec<String>) -> Axis {
    let although = match widest(points) {
        (Some(axis), moves) if axis != Axis::X => {
            format!(", although component {} moves most ({moves})", axis.name())
        }
        _ => String::new(),
    };
    notes.push(format!(
        "Flexion is read from component x of the angles, as Plug-in Gait defines it{although}; `--axis` takes another."
    ));
    Axis::X
}

/// What the name of an output says about the sign of its component: the first component of a hip of Plug-in Gait is flexion
/// (Vicon, Lower body angles as output from Plug-in Gait).
pub(crate) fn sign_of_plug_in_gait(name: &str, axis: Axis) -> SignSource {
    let is_hip = ["LHipAngles", "RHipAngles"].iter().any(|hip| hip.eq_ignore_ascii_case(name));
    SignSource::by_format(is_hip && axis == Axis::X, "as Plug-in Gait defines `LHipAngles` and `RHipAngles`")
}

/// The component that clearly moves most, and how much each moves, in words.
fn widest(points: &[(Joint, usize, Track)]) -> (Option<Axis>, String) {
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
    ((most >= LEAST_RANGE && most >= CLEAR * next).then_some(first), moves)
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

    #[test]
    fn the_component_that_moves_like_flexion_is_taken() {
        for axis in Axis::ALL {
            let mut notes = Vec::new();
            // A hip that moves more about another axis does not decide.
            let points = [(Joint::LeftHip, 0, moving(Axis::Y, 80.0)), (Joint::LeftKnee, 1, moving(axis, 30.0))];
            assert_eq!(of_flexion(&points, &mut notes), axis);
            let words = format!("component {} of the angles, which moves most", axis.name());
            assert!(notes[0].contains(&words) && notes[0].contains("--axis"), "{notes:?}");
        }
    }

    #[test]
    fn plug_in_gait_has_flexion_first_and_doubt_is_said() {
        let mut notes = Vec::new();
        assert_eq!(of_plug_in_gait(&[(Joint::LeftKnee, 0, moving(Axis::X, 30.0))], &mut notes), Axis::X);
        assert_eq!(of_plug_in_gait(&[(Joint::LeftKnee, 0, moving(Axis::Y, 30.0))], &mut notes), Axis::X);
        assert!(notes[0].contains("as Plug-in Gait defines it; `--axis`"), "{notes:?}");
        assert!(notes[1].contains("although component y moves most"), "{notes:?}");
    }

    #[test]
    fn without_a_clear_component_it_is_the_first() {
        let mut notes = Vec::new();
        assert_eq!(of_flexion(&[(Joint::LeftKnee, 0, moving(Axis::Z, 1.0))], &mut notes), Axis::X);
        assert!(notes[0].contains("No component of the angles clearly moves like flexion"), "{notes:?}");
    }
}
