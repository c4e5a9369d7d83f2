//! Columns of a CSV file that are components of one thing: `LKneeAngles_X`, `LKneeAngles_Y`, `LKneeAngles_Z (deg)`, `left_knee.w`.
//!
//! Only one component of a joint's angles is flexion, so a reader that takes the first one reads another angle from files of other axes.
//! The component that clearly moves like flexion is taken, the same for all joints. Components whose headings do not say that they are
//! angles are positions of markers, and four components with a `w` are a quaternion; neither is an angle.

use crate::format::angle_unit::AngleUnit;
use crate::format::joint_names::joint_of;
use crate::format::stated;
use crate::format::text_table::{listed, short};
use crate::options::Axis;
use joint_units::Joint;

/// Between a name and its component.
const SIGNS: [char; 6] = ['_', '.', ' ', '-', ':', '/'];
/// Longest heading that is examined, bytes.
const MAX_HEADING: usize = 256;
/// Parts of words that only names of angles have.
const ANGLES: [&str; 8] = ["ang", "ángulo", "ângulo", "winkel", "deg", "flex", "pitch", "sagittal"];
/// Whole words of the same: `fe` is a part of many others.
const WHOLE: [&str; 4] = ["fe", "rad", "radian", "radians"];
const SIGNS_OF_DEGREES: [char; 2] = ['°', 'º'];
/// The letters of components: `x`, `y` and `z` first.
const LETTERS: [char; 4] = ['x', 'y', 'z', 'w'];

/// A column that its name calls a component.
struct Component {
    /// The name without the component, in lower case, without blanks and signs.
    base: String,
    /// The joint that the name without the component denotes.
    joint: Option<Joint>,
    /// The place of the component in [`LETTERS`].
    letter: usize,
}

/// The components among the columns of a header.
pub(crate) struct Components(Vec<Option<Component>>);

/// The columns of the components of one joint, and the values of the second and the third; the first one is the joint's own column.
pub(crate) struct Triple {
    pub(super) columns: [Option<(usize, String)>; 3],
    pub(super) values: [Vec<f64>; 3],
}

impl Triple {
    /// The columns besides the first one, with their values.
    pub(crate) fn others(&mut self) -> impl Iterator<Item = (usize, &mut Vec<f64>)> {
        let others = self.columns.iter().zip(&mut self.values).skip(1);
        others.filter_map(|(column, values)| Some((column.as_ref()?.0, values)))
    }

    /// Whether a column is one of them.
    pub(crate) fn has(&self, index: usize) -> bool {
        self.columns.iter().flatten().any(|(column, _)| *column == index)
    }

    pub(super) fn listed(&self) -> String {
        listed(&self.columns.iter().flatten().map(|(_, heading)| short(heading)).collect::<Vec<_>>())
    }
}

impl Components {
    pub(crate) fn of(headings: &[String]) -> Self {
        Self(headings.iter().map(|heading| component_of(heading)).collect())
    }

    /// The index of the column of each letter that is a component of the same thing; `None` for a column that is no component.
    fn of_same_name(&self, index: usize) -> Option<[Option<usize>; 4]> {
        let own = self.0.get(index)?.as_ref()?;
        let find = |letter: usize| {
            self.0.iter().position(|other| other.as_ref().is_some_and(|o| o.letter == letter && o.base == own.base))
        };
        Some([0, 1, 2, 3].map(find))
    }

    /// The columns of the quaternion of which a column is a component, in words.
    pub(crate) fn quaternion(&self, index: usize, headings: &[String]) -> Option<String> {
        let found = self.of_same_name(index)?;
        let all: Vec<String> = found.iter().flatten().map(|&index| short(&headings[index])).collect();
        (all.len() == LETTERS.len()).then(|| listed(&all))
    }

    /// The components of the joint of a column, if there are several.
    pub(crate) fn triple(&self, index: usize, headings: &[String]) -> Option<Triple> {
        let joint = self.0.get(index)?.as_ref()?.joint?;
        let named = self.of_same_name(index)?;
        // Some programs name the components of one joint in two ways.
        let of_joint = |letter: usize| {
            self.0.iter().position(|c| c.as_ref().is_some_and(|c| c.letter == letter && c.joint == Some(joint)))
        };
        let columns = [0, 1, 2].map(|letter| named[letter].or_else(|| of_joint(letter)));
        let columns = columns.map(|index| index.map(|index| (index, headings[index].clone())));
        (columns.iter().flatten().count() > 1).then_some(Triple { columns, values: Default::default() })
    }

    /// Whether a column has other components beside it and is no angle: of a quaternion, or of a position.
    pub(crate) fn is_no_angle(&self, index: usize, headings: &[String]) -> bool {
        self.quaternion(index, headings).is_some()
            || (!says_angle(&headings[index]) && self.triple(index, headings).is_some())
    }

    /// The axis of a column that has other components beside it.
    pub(crate) fn axis_of(&self, index: usize) -> Option<Axis> {
        let several = self.of_same_name(index)?.iter().flatten().count() > 1;
        let letter = self.0.get(index)?.as_ref()?.letter;
        Axis::ALL.get(letter).copied().filter(|_| several)
    }
}

/// A heading without component and unit, and its axis: the first where it names none.
pub(crate) fn parts(heading: &str) -> (String, Axis) {
    match component_of(heading) {
        Some(Component { base, letter, .. }) => (base, Axis::ALL.get(letter).copied().unwrap_or(Axis::X)),
        None => (split_unit(heading.trim()).0.to_owned(), Axis::X),
    }
}

/// The component that a heading names at its end, behind which a unit may be.
fn component_of(heading: &str) -> Option<Component> {
    let heading = heading.trim();
    let (stem, unit) = split_unit(heading);
    let last = stem.chars().next_back()?;
    let letter = LETTERS.iter().position(|&letter| letter == last.to_ascii_lowercase())?;
    let before = &stem[..stem.len() - last.len_utf8()];
    // `LHip_qx` is a component of a quaternion.
    let before = before.strip_suffix(['q', 'Q']).filter(|before| before.ends_with(SIGNS)).unwrap_or(before);
    let is_apart = before.ends_with(SIGNS)
        || (last.is_ascii_uppercase() && before.ends_with(char::is_lowercase))
        || joint_of(before).is_some();
    let name = before.trim_end_matches(SIGNS);
    if !is_apart || name.is_empty() {
        return None;
    }
    let base = name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    let joint = joint_of(&format!("{name} {unit}")).map(|(joint, _)| joint);
    Some(Component { base, joint, letter })
}

/// A heading, and the unit of an angle at its end: in brackets, or behind a sign.
fn split_unit(heading: &str) -> (&str, &str) {
    let bare = heading.trim_end_matches([']', ')', '}', ' ', '.']);
    let Some(at) = bare.rfind(['_', '[', '(', '{', ' ', '-', '.']) else { return (heading, "") };
    let unit = bare[at..].trim_start_matches(['_', '[', '(', '{', ' ', '-', '.']);
    let is_bracket = bare.len() < heading.len() && bare[at..].starts_with(['[', '(', '{']);
    match unit.parse::<AngleUnit>() {
        Ok(_) => (bare[..at].trim_end_matches([' ', '_', '.', '-']), unit),
        // `left_knee (x)`: the component itself is in the brackets.
        Err(_) if is_bracket => (bare, ""),
        Err(_) => (heading, ""),
    }
}

/// Whether a heading says that its column is an angle.
pub(crate) fn says_angle(heading: &str) -> bool {
    // A text of any length is no heading.
    let words = if heading.len() <= MAX_HEADING { stated::words(heading) } else { vec![] };
    heading.contains(SIGNS_OF_DEGREES)
        || words.iter().any(|word| WHOLE.contains(&word.as_str()) || ANGLES.iter().any(|angle| word.contains(angle)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn component(heading: &str) -> Option<(String, char)> {
        component_of(heading).map(|found| (found.base, LETTERS[found.letter]))
    }

    #[test]
    fn components_are_recognised_by_name() {
        for (heading, base, letter) in [
            ("LHipAngles_X (deg)", "lhipangles", 'x'),
            ("LHipAngleY [deg]", "lhipangle", 'y'),
            ("left_hip_z_deg", "lefthip", 'z'),
            ("Right Hip X [deg]", "righthip", 'x'),
            ("LHip.W", "lhip", 'w'),
            ("left hip w", "lefthip", 'w'),
            ("LHip_qx", "lhip", 'x'),
            ("left_hip (y)", "lefthip", 'y'),
            ("lkneez", "lknee", 'z'),
        ] {
            assert_eq!(component(heading), Some((base.into(), letter)), "{heading}");
        }
        for heading in ["", "x", "_x", "left_hip_deg", "max", "velocity", "yaw", "left_hip_deg_s", "°)"] {
            assert_eq!(component(heading), None, "{heading}");
        }
    }

    #[test]
    fn an_angle_is_said_by_whole_words() {
        for heading in
            ["LHipAngles_X", "left_knee_x_deg", "hipFE_x", "left_hip_fe_x", "knee x (rad)", "kneeflex_x", "knee x [°]"]
        {
            assert!(says_angle(heading), "{heading}");
        }
        for heading in
            ["left_knee_feature_x", "lower_femur_x", "radius_x", "left_hip_x", "female_hip_x", "left_knee_grade_x"]
        {
            assert!(!says_angle(heading), "{heading}");
        }
    }
}
