//! What a line of text above a table says that the table holds: joint angles, another quantity, or nothing of both.

use crate::format::stated;

/// Words of joint angles, separated by blanks.
const ANGLES: &str = "coordinates coordinate angle angles kinematics ik q flexion winkel gelenkwinkel angoli ángulos";
/// Words that say nothing else, beside those.
const BESIDE: &str = "generalized generalised joint joints inverse result results motion data of the in and from degrees deg radians \
    rad hip hips knee knees trial subject walk walking run running gait solution";
/// Words of other quantities that are in titles of tables, beside those of headings.
const OTHER: &str = "activation activations excitation excitations control controls error errors reaction reactions load loads \
    residual residuals reserve reserves actuation actuator actuators optimization optimisation marker markers \
    momentum jerk multipliers derivatives dudt udot speeds dynamics";
/// Words of titles that OpenSim writes, beside those of a quantity.
const OF_OPENSIM: &str = "joint joints inverse dynamics generalized generalised static muscle muscles net ground model body angular \
    internal contact tendon fiber tool analysis reporter results of and the rra cmc id arm arms position positions";
/// A line of more words is a sentence and no title.
const MOST_WORDS: usize = 8;

fn is_in(list: &str, word: &str) -> bool {
    list.split_whitespace().any(|known| known == word)
}

/// Whether a title says that the table holds joint angles: it has a word of them, and no other word but names with a number.
pub(crate) fn says_angles(title: &str) -> bool {
    let words = stated::words(title);
    let is_angle = |word: &String| is_in(ANGLES, word);
    let is_beside = |word: &String| is_in(BESIDE, word) || word.contains(|c: char| c.is_ascii_digit());
    words.iter().any(is_angle) && words.iter().all(|word| is_angle(word) || is_beside(word))
}

/// The first word of a title that names another quantity than an angle.
pub(crate) fn other_quantity(title: &str) -> Option<String> {
    let is_other = |word: &String| is_in(OTHER, word) || stated::is_quantity(word);
    stated::words(title).into_iter().find(is_other)
}

/// Whether a title has a word of its own, as the name of a trial has: `walk at low speed`, `Control 3`.
pub(crate) fn is_of_trial(title: &str) -> bool {
    let is_known =
        |word: &String| [ANGLES, OTHER, OF_OPENSIM].iter().any(|list| is_in(list, word)) || stated::is_quantity(word);
    !stated::words(title).iter().all(is_known)
}

/// Whether a text names a field that says what is in the table.
fn is_key(text: &str) -> bool {
    const KEYS: &str =
        "quantity type data variable variables signal signals measure content contents title parameter unit units";
    stated::words(text).iter().any(|word| is_in(KEYS, word))
}

/// What a line of text above the header of a CSV file names instead of joint angles, in words: a title (`Joint moments`), or the value of a
/// field of what is in the table (`Quantity: moment`, `Units,Nm`). Other fields, such as `Speed: 1.2 m/s`, describe the trial.
pub(crate) fn other_in_line(fields: &[impl AsRef<str>]) -> Option<String> {
    let filled: Vec<&str> =
        fields.iter().map(|field| field.as_ref().trim()).filter(|field| !field.is_empty()).collect();
    let (key, value) = match filled.as_slice() {
        [one] => match one.split_once([':', '=']) {
            Some((key, value)) => (Some(key), value),
            None => (None, *one),
        },
        [key, value] if is_key(key) => (Some(*key), *value),
        // A number behind a text is a measure of the trial: `Knee moment arm,0.04`.
        [title, rest @ ..] if rest.iter().all(|field| !field.starts_with(|c: char| c.is_ascii_digit())) => {
            (None, *title)
        }
        _ => return None,
    };
    match key {
        Some(key) if !is_key(key) => return None,
        Some(key) if stated::words(key).iter().any(|word| word.starts_with("unit")) && stated::is_other_unit(value) => {
            return Some(format!("the unit `{}`", value.trim()));
        }
        _ => {}
    }
    let words = stated::words(value);
    // `Motion dynamics laboratory` and `Control group` describe the trial.
    const BODY: &str = "joint joints hip hips knee knees leg legs muscle muscles angular";
    let is_title =
        key.is_some() || words.iter().any(|word| is_in(BODY, word)) || !is_of_trial(value) && words.len() == 1;
    let says_angle = !is_title || words.iter().any(|word| is_in(ANGLES, word));
    let other = other_quantity(value).filter(|_| !says_angle && words.len() <= MOST_WORDS);
    other.map(|word| format!("the quantity `{word}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_of_angles_have_words_of_angles_only() {
        for title in [
            "Coordinates",
            "inverse kinematics",
            "q",
            "Generalized coordinates",
            "Inverse Kinematics Results",
            "ik trial",
            "joint angles",
            "IK",
            "subject01 Kinematics_q",
            "Joint angles in degrees",
        ] {
            assert!(says_angles(title), "{title}");
        }
        for title in [
            "controls",
            "PositionErrors",
            "CoordinateErrors",
            "Kinematics_u",
            "Kinematics dudt",
            "Coordinate Accelerations",
            "Static Optimization",
            "walk",
            "",
            "states",
            "Coordinates and forces",
            "angular velocity",
        ] {
            assert!(!says_angles(title), "{title}");
        }
    }

    #[test]
    fn titles_of_other_quantities_are_named() {
        for (title, word) in [
            ("controls", "controls"),
            ("PositionErrors", "errors"),
            ("Speeds", "speeds"),
            ("Inverse Dynamics Generalized Forces", "dynamics"),
            ("Static Optimization", "optimization"),
            ("Joint Reaction Loads", "reaction"),
            ("ActuatorPowers", "actuator"),
            ("Torques", "torques"),
        ] {
            assert_eq!(other_quantity(title).as_deref(), Some(word), "{title}");
        }
        for title in ["Coordinates", "crouch1_gait", "subject01_walk1", "states", ""] {
            assert_eq!(other_quantity(title), None, "{title}");
        }
    }

    #[test]
    fn names_of_trials_have_words_of_their_own() {
        assert!(["walk at low speed", "Control 3", "subject01 forces"].into_iter().all(is_of_trial));
        let titles = [
            "controls",
            "Inverse Dynamics Generalized Forces",
            "Joint Reaction Loads",
            "PositionErrors",
            "Net joint moments",
        ];
        assert!(titles.into_iter().all(|title| !is_of_trial(title)));
    }

    #[test]
    fn lines_above_a_header_name_another_quantity_or_describe_the_trial() {
        for line in [
            &["Joint moments"][..],
            &["Quantity: moment"],
            &["Units", "Nm"],
            &["Angular velocity of hips and knees", ""],
            &["Data: EMG"],
            &["Joint moments", "trial 3"],
        ] {
            assert!(other_in_line(line).is_some(), "{line:?}");
        }
        for line in [
            &["Patient: Max"][..],
            &["Speed: 1.2 m/s"],
            &["Walking speed", "1.2"],
            &["Units", "deg"],
            &["Joint angles, no forces"],
            &["Rate", "100"],
            &["Force plates", "off", "2"],
            &["Trial 3"],
            &["Knee moment arm", "0.04"],
            &["Motion dynamics laboratory"],
            &["Control group"],
            &["Work package 4"],
            &["Data: joint angles"],
        ] {
            assert_eq!(other_in_line(line), None, "{line:?}");
        }
    }
}
