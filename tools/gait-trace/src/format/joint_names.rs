//! Recognises the joint of a column by its name, in the usual naming schemes of gait laboratories.
//!
//! A name is split into words without regard to case, blanks and signs: `LHipAngles`, `hip_flexion_l`, `Left Knee Flexion (deg)` and
//! `RT Knee Flexion` each consist of one side, one joint and permitted further words, of one of seven languages (`words`). A name with any other word
//! (`hip_adduction_l`, `knee_angle_r_beta`, `hip_moment_l`) is not a joint angle.

use crate::format::angle_unit::AngleUnit;
use crate::format::words::{COMMON, LANGUAGES, Word};
use joint_units::Joint;
use std::borrow::Cow;

/// Longest name that is examined, bytes.
const MAX_NAME: usize = 64;

/// The joint that a column's name denotes, and the unit if the name has one.
///
/// ```
/// use gait_trace::format::angle_unit::AngleUnit;
/// use gait_trace::format::joint_names::joint_of;
/// use joint_units::Joint;
/// assert_eq!(joint_of("left_hip_deg"), Some((Joint::LeftHip, Some(AngleUnit::Degrees))));
/// assert_eq!(joint_of("knee_angle_r"), Some((Joint::RightKnee, None)));
/// assert_eq!(joint_of("/jointset/walker_knee_l/knee_angle_l/value"), Some((Joint::LeftKnee, None)));
/// assert_eq!(joint_of("hip_adduction_l"), None);
/// assert_eq!(joint_of("/jointset/hip_l/hip_flexion_l/speed"), None);
/// ```
#[must_use]
pub fn joint_of(name: &str) -> Option<(Joint, Option<AngleUnit>)> {
    only(readings(name).filter_map(|words| joint_among(&words)))
}

/// The joint of a name that counts extension as positive, for which [`joint_of`] gives none.
pub(crate) fn extension_of(name: &str) -> Option<Joint> {
    let readings = all_readings(name).filter(|words| is_extension(words));
    only(readings.filter_map(|words| joint_among(&words).map(|(joint, _)| joint)))
}

fn joint_among(words: &[Word]) -> Option<(Joint, Option<AngleUnit>)> {
    let joint = match (one_of(words, Word::Left, Word::Right)?, one_of(words, Word::Hip, Word::Knee)?) {
        (Word::Left, Word::Hip) => Joint::LeftHip,
        (Word::Right, Word::Hip) => Joint::RightHip,
        (Word::Left, _) => Joint::LeftKnee,
        _ => Joint::RightKnee,
    };
    Some((joint, unit_among(words)?))
}

/// The left and right joint that a name without a side may denote, and the unit if the name has one.
///
/// ```
/// use gait_trace::format::angle_unit::AngleUnit;
/// use gait_trace::format::joint_names::sideless_of;
/// use joint_units::Joint;
/// assert_eq!(sideless_of("knee_deg"), Some(([Joint::LeftKnee, Joint::RightKnee], Some(AngleUnit::Degrees))));
/// assert_eq!(sideless_of("Hip flexion"), Some(([Joint::LeftHip, Joint::RightHip], None)));
/// assert_eq!(sideless_of("left_knee_deg"), None);
/// assert_eq!(sideless_of("knee_moment"), None);
/// ```
#[must_use]
pub fn sideless_of(name: &str) -> Option<([Joint; 2], Option<AngleUnit>)> {
    only(readings(name).filter_map(|words| {
        if words.iter().any(|word| matches!(word, Word::Left | Word::Right)) {
            return None;
        }
        let joints = match one_of(&words, Word::Hip, Word::Knee)? {
            Word::Hip => [Joint::LeftHip, Joint::RightHip],
            _ => [Joint::LeftKnee, Joint::RightKnee],
        };
        Some((joints, unit_among(&words)?))
    }))
}

/// What all readings of a name agree on; `None` if there is none, or if they differ.
fn only<T: PartialEq>(mut readings: impl Iterator<Item = T>) -> Option<T> {
    let first = readings.next()?;
    readings.all(|other| other == first).then_some(first)
}

/// The words of a joint angle's name, in each language that has them all; none for any other name and for one that counts extension as
/// positive.
fn readings(name: &str) -> impl Iterator<Item = Vec<Word>> {
    all_readings(name).filter(|words| !is_extension(words))
}

/// The words of a joint angle's name, in each language that has them all.
fn all_readings(name: &str) -> impl Iterator<Item = Vec<Word>> {
    let plain = plain(name).unwrap_or_default();
    LANGUAGES.iter().filter_map(move |language| words_of(&plain, language))
}

fn is_extension(words: &[Word]) -> bool {
    words.contains(&Word::Extension) && !words.contains(&Word::Flexion)
}

/// A name in lower case without blanks and signs; `None` for one that is too long, and for a speed.
fn plain(name: &str) -> Option<String> {
    let name = coordinate_of(name)?;
    // `Grad` in lower case would be another unit.
    let end = name.trim_end_matches([']', ')', '}', ' ']);
    let before = end.strip_suffix("Grad").filter(|before| before.ends_with(['[', '(', '{', ' ', '_']));
    let name = before.map_or(Cow::Borrowed(name), |before| Cow::Owned(format!("{before}deg")));
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric() || *c == '°').collect();
    (plain.len() <= MAX_NAME).then_some(plain)
}

/// Whether a text in lower case, without blanks and signs, has only words of the names of joint angles.
pub(crate) fn is_joint_words(plain: &str) -> bool {
    plain.len() <= MAX_NAME && LANGUAGES.iter().any(|language| words_of(plain, language).is_some())
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
/// use gait_trace::format::angle_unit::AngleUnit;
/// use gait_trace::format::joint_names::unit_of;
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

/// Splits a name completely into words of a language; `None` if a part is not among them.
fn words_of(plain: &str, language: &[(&str, Word)]) -> Option<Vec<Word>> {
    // `after[n]` is a split of the first n bytes: the word that ends there, and where it starts.
    let mut after: Vec<Option<(Word, usize)>> = vec![None; plain.len() + 1];
    for start in 0..plain.len() {
        if start > 0 && after[start].is_none() {
            continue;
        }
        let rest = &plain.as_bytes()[start..];
        for &(text, word) in language.iter().chain(&COMMON).filter(|(text, _)| rest.starts_with(text.as_bytes())) {
            // The longest word wins, so that `left` is a side and not an `l` before an unknown word.
            after[start + text.len()].get_or_insert((word, start));
        }
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
    fn names_in_other_languages_are_recognised() {
        for names in [
            ["Hüfte links [°]", "Hüfte rechts [°]", "Knie links [°]", "Knie rechts [°]"],
            ["Hüftflexion_li", "Hüftflexion_re", "Knieflexion_li", "Knieflexion_re"],
            ["Hueftwinkel_L", "Hueftwinkel_R", "Kniewinkel_L", "Kniewinkel_R"],
            ["Heup links", "Heup rechts", "Kniehoek links", "Kniehoek rechts"],
            ["Hanche_G", "Hanche_D", "Genou_G", "Genou_D"],
            ["hanche gauche", "hanche droite", "genou gauche", "genou droit"],
            ["Cadera Izq (°)", "Cadera Der (°)", "Rodilla Izq (°)", "Rodilla Der (°)"],
            ["cadera izquierda", "cadera derecha", "ángulo de la rodilla izquierda", "rodilla derecha"],
            ["anca_sx", "anca_dx", "ginocchio_sx", "ginocchio_dx"],
            ["anca sinistra", "anca destra", "ginocchio sinistro", "flessione ginocchio destro [gradi]"],
            ["quadril esquerdo", "quadril direito", "joelho esq", "joelho dir (graus)"],
        ] {
            assert_eq!(names.map(|name| joint_of(name).map(|(joint, _)| joint)), Joint::ALL.map(Some), "{names:?}");
        }
        assert_eq!(sideless_of("Kniewinkel [Grad]").unwrap().1, Some(AngleUnit::Degrees));
        // Words of two languages, both sides, and a side that is none in its language.
        for name in ["hip_der", "rodilla_left", "cadera_izq_der", "hip_d", "knee_g", "hanche_sx", "Kniestreckung_li"] {
            assert_eq!(joint_of(name), None, "{name}");
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
