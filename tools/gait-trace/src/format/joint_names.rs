//! Recognises the joint of a column by its name, in the usual naming schemes of gait laboratories.
//!
//! A name is split into words without regard to case, blanks and signs: `LHipAngles`, `hip_flexion_l`, `Left Knee Flexion (deg)` and
//! `RT Knee Flexion` each consist of one side, one joint and permitted further words. A name with any other word
//! (`hip_adduction_l`, `knee_angle_r_beta`, `hip_moment_l`) is not a joint angle.

use joint_units::Joint;
use std::borrow::Cow;

/// The unit of angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AngleUnit {
    /// 360 per turn.
    Degrees,
    /// 2 pi per turn.
    Radians,
}

impl AngleUnit {
    /// Converts an angle of this unit to degrees.
    ///
    /// ```
    /// use gait_trace::format::joint_names::AngleUnit;
    /// assert_eq!(AngleUnit::Radians.degrees(std::f64::consts::PI), 180.0);
    /// ```
    #[must_use]
    pub fn degrees(self, value: f64) -> f64 {
        match self {
            Self::Degrees => value,
            Self::Radians => value.to_degrees(),
        }
    }

    /// Name of the unit.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Degrees => "degrees",
            Self::Radians => "radians",
        }
    }
}

impl std::str::FromStr for AngleUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        // `Grad` is the German word for degrees; `grad` is a hundredth of a right angle.
        if text == "Grad" {
            return Ok(Self::Degrees);
        }
        match text.to_lowercase().as_str() {
            "deg" | "degree" | "degrees" | "°" | "º" | "grado" | "grados" | "degre" | "degres" | "degré" | "degrés" => {
                Ok(Self::Degrees)
            }
            "rad" | "radian" | "radians" => Ok(Self::Radians),
            _ => Err(format!("unit `{text}`; allowed are degrees, radians")),
        }
    }
}

/// Meaning of a word in a name.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Word {
    Left,
    Right,
    Hip,
    Knee,
    Unit(AngleUnit),
    Flexion,
    Extension,
    Other,
}

const WORDS: [(&str, Word); 36] = [
    ("left", Word::Left),
    ("right", Word::Right),
    ("lt", Word::Left),
    ("rt", Word::Right),
    ("l", Word::Left),
    ("r", Word::Right),
    ("hip", Word::Hip),
    ("knee", Word::Knee),
    ("degrees", Word::Unit(AngleUnit::Degrees)),
    ("degree", Word::Unit(AngleUnit::Degrees)),
    ("deg", Word::Unit(AngleUnit::Degrees)),
    ("°", Word::Unit(AngleUnit::Degrees)),
    ("º", Word::Unit(AngleUnit::Degrees)),
    ("grado", Word::Unit(AngleUnit::Degrees)),
    ("grados", Word::Unit(AngleUnit::Degrees)),
    ("degre", Word::Unit(AngleUnit::Degrees)),
    ("degres", Word::Unit(AngleUnit::Degrees)),
    ("degré", Word::Unit(AngleUnit::Degrees)),
    ("degrés", Word::Unit(AngleUnit::Degrees)),
    ("radians", Word::Unit(AngleUnit::Radians)),
    ("radian", Word::Unit(AngleUnit::Radians)),
    ("rad", Word::Unit(AngleUnit::Radians)),
    ("flexion", Word::Flexion),
    ("flex", Word::Flexion),
    ("fe", Word::Flexion),
    ("extension", Word::Extension),
    ("ext", Word::Extension),
    ("angles", Word::Other),
    ("angle", Word::Other),
    ("ang", Word::Other),
    ("joint", Word::Other),
    ("pitch", Word::Other),
    ("sagittal", Word::Other),
    ("plane", Word::Other),
    ("x", Word::Other),
    ("ik", Word::Other),
];

/// Longest name that is examined, bytes.
const MAX_NAME: usize = 64;

/// The joint that a column's name denotes, and the unit if the name has one.
///
/// ```
/// use gait_trace::format::joint_names::{AngleUnit, joint_of};
/// use joint_units::Joint;
/// assert_eq!(joint_of("left_hip_deg"), Some((Joint::LeftHip, Some(AngleUnit::Degrees))));
/// assert_eq!(joint_of("knee_angle_r"), Some((Joint::RightKnee, None)));
/// assert_eq!(joint_of("/jointset/walker_knee_l/knee_angle_l/value"), Some((Joint::LeftKnee, None)));
/// assert_eq!(joint_of("hip_adduction_l"), None);
/// assert_eq!(joint_of("/jointset/hip_l/hip_flexion_l/speed"), None);
/// ```
#[must_use]
pub fn joint_of(name: &str) -> Option<(Joint, Option<AngleUnit>)> {
    let words = words_in(name)?;
    let joint = match (one_of(&words, Word::Left, Word::Right)?, one_of(&words, Word::Hip, Word::Knee)?) {
        (Word::Left, Word::Hip) => Joint::LeftHip,
        (Word::Right, Word::Hip) => Joint::RightHip,
        (Word::Left, _) => Joint::LeftKnee,
        _ => Joint::RightKnee,
    };
    Some((joint, unit_among(&words)?))
}

/// The left and right joint that a name without a side may denote, and the unit if the name has one.
///
/// ```
/// use gait_trace::format::joint_names::{AngleUnit, sideless_of};
/// use joint_units::Joint;
/// assert_eq!(sideless_of("knee_deg"), Some(([Joint::LeftKnee, Joint::RightKnee], Some(AngleUnit::Degrees))));
/// assert_eq!(sideless_of("Hip flexion"), Some(([Joint::LeftHip, Joint::RightHip], None)));
/// assert_eq!(sideless_of("left_knee_deg"), None);
/// assert_eq!(sideless_of("knee_moment"), None);
/// ```
#[must_use]
pub fn sideless_of(name: &str) -> Option<([Joint; 2], Option<AngleUnit>)> {
    let words = words_in(name)?;
    if words.iter().any(|word| matches!(word, Word::Left | Word::Right)) {
        return None;
    }
    let joints = match one_of(&words, Word::Hip, Word::Knee)? {
        Word::Hip => [Joint::LeftHip, Joint::RightHip],
        _ => [Joint::LeftKnee, Joint::RightKnee],
    };
    Some((joints, unit_among(&words)?))
}

/// The words of a joint angle's name; `None` for any other name and for one that counts extension as positive.
fn words_in(name: &str) -> Option<Vec<Word>> {
    let name = coordinate_of(name)?;
    // `Grad` in lower case would be another unit.
    let end = name.trim_end_matches([']', ')', '}', ' ']);
    let before = end.strip_suffix("Grad").filter(|before| before.ends_with(['[', '(', '{', ' ', '_']));
    let name = before.map_or(Cow::Borrowed(name), |before| Cow::Owned(format!("{before}deg")));
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric() || *c == '°').collect();
    if plain.len() > MAX_NAME {
        return None;
    }
    let words = words_of(&plain)?;
    let extension = words.contains(&Word::Extension) && !words.contains(&Word::Flexion);
    (!extension).then_some(words)
}

/// Whether a text in lower case, without blanks and signs, has only words of the names of joint angles.
pub(crate) fn is_joint_words(plain: &str) -> bool {
    plain.len() <= MAX_NAME && words_of(plain).is_some()
}

/// The one of two words that occurs; `None` if both or none do.
fn one_of(words: &[Word], a: Word, b: Word) -> Option<Word> {
    let mut found = words.iter().filter(|&&word| word == a || word == b);
    let first = found.next().copied()?;
    found.all(|&word| word == first).then_some(first)
}

/// The unit among the words, if any; `None` if there are two.
fn unit_among(words: &[Word]) -> Option<Option<AngleUnit>> {
    let has = |wanted| words.contains(&wanted);
    let (degrees, radians) = (has(Word::Unit(AngleUnit::Degrees)), has(Word::Unit(AngleUnit::Radians)));
    match (degrees, radians) {
        (true, true) => None,
        (true, false) => Some(Some(AngleUnit::Degrees)),
        (false, true) => Some(Some(AngleUnit::Radians)),
        (false, false) => Some(None),
    }
}

/// The unit at the end of a heading (`hip angle [rad]`), for columns that only the map assigns to a joint.
///
/// ```
/// use gait_trace::format::joint_names::{AngleUnit, unit_of};
/// assert_eq!(unit_of("goniometer 2 (rad)"), Some(AngleUnit::Radians));
/// assert_eq!(unit_of("grad"), None);
/// ```
#[must_use]
pub fn unit_of(name: &str) -> Option<AngleUnit> {
    let name = name.trim_end_matches([']', ')', '}', ' ', '"', '.']);
    let last = name.rsplit(['_', '[', '(', '{', ' ', '/', '-']).next()?;
    if last.len() == name.len() && !last.starts_with('°') {
        return None;
    }
    last.parse().ok()
}

/// The coordinate in an OpenSim path; the name itself if it is not a path; `None` for a speed.
fn coordinate_of(name: &str) -> Option<&str> {
    if !name.trim_start().starts_with('/') {
        return Some(name);
    }
    let mut parts = name.trim().rsplit('/');
    match parts.next() {
        Some("value") => parts.next(),
        _ => None,
    }
}

/// Splits a name completely into words of [`WORDS`]; `None` if a part is not in the list.
fn words_of(plain: &str) -> Option<Vec<Word>> {
    // `after[n]` is a split of the first n bytes: the word that ends there, and where it starts.
    let mut after: Vec<Option<(Word, usize)>> = vec![None; plain.len() + 1];
    for end in 1..=plain.len() {
        // The longest word wins, so that `left` is a side and not an `l` before an unknown word.
        after[end] = WORDS
            .iter()
            .filter_map(|&(text, word)| {
                let start = end.checked_sub(text.len())?;
                let fits = plain.as_bytes()[start..end] == *text.as_bytes() && (start == 0 || after[start].is_some());
                fits.then_some((word, start))
            })
            .min_by_key(|&(_, start)| start);
    }
    let mut words = Vec::new();
    let mut end = plain.len();
    while end > 0 {
        let (word, start) = after[end]?;
        words.push(word);
        end = start;
    }
    Some(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_laboratories_are_recognised() {
        use Joint::{LeftHip, LeftKnee, RightHip, RightKnee};
        for (name, joint) in [
            ("left_hip_deg", LeftHip),
            ("RKneeAngles", RightKnee),
            ("LHipAngles_X", LeftHip),
            ("hip_flexion_r", RightHip),
            ("knee_angle_l", LeftKnee),
            ("Left Knee Flexion (deg)", LeftKnee),
            ("RT Hip Flexion (°)", RightHip),
            ("Knee Flexion/Extension LT", LeftKnee),
            ("L.Knee.Angle", LeftKnee),
            ("kneer", RightKnee),
            ("hipFE_l", LeftHip),
            ("/jointset/hip_r/hip_flexion_r/value", RightHip),
            ("left_hip/left_hip_rad", LeftHip),
            ("left_hip_pitch_joint", LeftHip),
            ("RKneePitch", RightKnee),
        ] {
            assert_eq!(joint_of(name).map(|(joint, _)| joint), Some(joint), "{name}");
        }
    }

    #[test]
    fn other_names_are_not_joint_angles() {
        for name in [
            "",
            "hip",
            "left",
            "left_ankle_deg",
            "hip_adduction_l",
            "hip_rotation_r",
            "knee_angle_r_beta",
            "LHipMoment",
            "LHipAngles_Y",
            "left_right_hip",
            "left_hip_knee",
            "knee_extension_l",
            "left_knee_deg_rad",
            "hip_flexion_l_vel",
            "/jointset/hip_r/hip_flexion_r/speed",
            "LHJC",
            "PA1",
            "/",
            "//value",
            "lumbar_extension",
            "L_HIP_Z",
            "LHipYawPitch",
            "left_hip_roll_joint",
        ] {
            assert_eq!(joint_of(name), None, "{name}");
        }
        assert_eq!(joint_of(&"left".repeat(1000)), None);
    }

    #[test]
    fn units_are_read_from_names() {
        assert_eq!(joint_of("left_hip_rad").unwrap().1, Some(AngleUnit::Radians));
        assert_eq!(joint_of("left hip [deg]").unwrap().1, Some(AngleUnit::Degrees));
        assert_eq!(joint_of("kneer").unwrap().1, None);
        for name in ["left_hip [Grad]", "left_hip_Grad", "left_hip [grados]", "left_hip [degrés]", "left_hip [º]"] {
            assert_eq!(joint_of(name).unwrap().1, Some(AngleUnit::Degrees), "{name}");
        }
        assert_eq!(joint_of("left_hip [grad]"), None);
        for (name, unit) in [("a_deg", Some(AngleUnit::Degrees)), ("a [rad]", Some(AngleUnit::Radians)), ("trad", None)]
        {
            assert_eq!(unit_of(name), unit, "{name}");
        }
    }
}
