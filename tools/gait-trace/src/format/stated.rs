//! What a heading states that is no angle: a unit (`left_hip (mA)`) or a quantity (`left_hip_velocity`).
//!
//! Columns that are found by name have no such word ([`joint_names`](super::joint_names)). A map chooses a column whatever its name is,
//! but not against what its heading states. Volts are no case of this: a calibration converts them.

use crate::fault::Fault;
use crate::format::angle_unit::AngleUnit;
use crate::format::joint_names::is_joint_words;
use crate::format::text_table::short;
use crate::format::unit::volts_of;
use crate::options::ReadOptions;

/// Units of other quantities, in lower case. Those of one letter count in brackets only: `hip_a` may be a name.
const UNITS: [&str; 40] = [
    "a", "ma", "ua", "µa", "n", "kn", "nm", "n.m", "n·m", "nmm", "n.mm", "mnm", "w", "kw", "m", "mm", "cm", "kg", "g",
    "pa", "kpa", "bar", "psi", "hz", "khz", "s", "ms", "us", "%", "pct", "percent", "mrad", "grad", "gon", "turn",
    "turns", "rev", "counts", "lsb", "rpm",
];
/// Units of angular velocity that are one word.
const RATES: [&str; 6] = ["dps", "degs", "rads", "degps", "radps", "radians/s"];
/// Words that name another quantity than an angle.
const QUANTITIES: [&str; 31] = [
    "velocity",
    "velocities",
    "vel",
    "speed",
    "rate",
    "gyro",
    "omega",
    "acceleration",
    "accelerations",
    "accel",
    "acc",
    "torque",
    "torques",
    "moment",
    "moments",
    "force",
    "forces",
    "power",
    "powers",
    "work",
    "energy",
    "current",
    "emg",
    "pressure",
    "temperature",
    "pwm",
    "stiffness",
    "std",
    "sd",
    "deviation",
    "variance",
];
/// Words in brackets behind a name that are no unit.
const REMARKS: [&str; 10] = ["raw", "filtered", "filt", "smooth", "mean", "sensor", "imu", "new", "old", "measured"];
/// Words of an angle, beside which `current` is the present one.
const ANGLES: [&str; 8] = ["angle", "angles", "flexion", "position", "pos", "deg", "rad", "degrees"];

/// Whether a word in lower case names another quantity than an angle.
pub(super) fn is_quantity(word: &str) -> bool {
    QUANTITIES.contains(&word)
}

/// Whether a text is a unit of another quantity than an angle: `Nm/kg`, `deg/s`.
pub(super) fn is_other_unit(text: &str) -> bool {
    let plain = text.trim().to_lowercase().replace([' ', '*', '(', ')', '[', ']'], "");
    UNITS.contains(&plain.as_str()) || RATES.contains(&plain.as_str()) || plain.contains(['/', '^', '²'])
}

/// An error if a column that the map gives a joint states that it is no angle. What is in brackets and unknown is a unit that is not
/// known, unless the caller names one.
pub(crate) fn check(heading: &str, how: &ReadOptions<'_>) -> Result<(), Fault> {
    match stated(heading) {
        Some(Stated::Other(what)) => Err(Fault::NoAngle { column: short(heading), what }),
        Some(Stated::Unknown(what)) if how.unit.is_none() => Err(Fault::UnknownUnit { column: short(heading), what }),
        _ => Ok(()),
    }
}

/// An error if a column that was found by its name has a unit without letters that is no angle: `left_hip [%]`, `left_hip [-]`. Words
/// that are no angle are in no name of a joint.
pub(crate) fn check_found(heading: &str, how: &ReadOptions<'_>) -> Result<(), Fault> {
    let end = bracketed(heading).or_else(|| heading.trim_end().rsplit([' ', '_']).next()).unwrap_or_default().trim();
    match end {
        "%" | "‰" => Err(Fault::NoAngle { column: short(heading), what: format!("the unit `{end}`") }),
        // `Flexion (+) / Extension (-)` names signs, no unit.
        "-" | "–" | "−" if bracketed(heading).is_some() && !heading.contains('+') && how.unit.is_none() => {
            Err(Fault::UnknownUnit { column: short(heading), what: end.into() })
        }
        _ => Ok(()),
    }
}

#[derive(Debug, PartialEq)]
enum Stated {
    /// A unit or a quantity that is no angle, in words.
    Other(String),
    /// A text in brackets that may be a unit.
    Unknown(String),
}

fn stated(heading: &str) -> Option<Stated> {
    let words = words(heading);
    let has = |list: &[&str]| words.iter().find(|word| list.contains(&word.as_str()));
    let is_angle = has(&ANGLES).is_some();
    if let Some(quantity) =
        words.iter().find(|word| QUANTITIES.contains(&word.as_str()) && !(is_angle && *word == "current"))
    {
        return Some(Stated::Other(format!("the quantity `{quantity}`")));
    }
    let unit = |text: &str| Some(Stated::Other(format!("the unit `{}`", short(text))));
    // `left_hip_deg_s`, `left_hip rad/s`, `left_hip_deg_per_s`.
    let is_rate = |pair: &[String]| {
        matches!(pair[0].as_str(), "deg" | "rad" | "degrees" | "radians" | "°")
            && matches!(pair[1].as_str(), "s" | "sec" | "s2" | "per" | "ps")
    };
    if words.windows(2).any(is_rate) {
        return Some(Stated::Other("an angle per time".into()));
    }
    if let Some(text) = bracketed(heading) {
        let plain = text.to_lowercase().replace([' ', '*'], "");
        let is_known = plain.parse::<AngleUnit>().is_ok() || volts_of(&plain).is_some();
        let is_remark = || {
            plain.is_empty()
                || plain.chars().all(|c| c.is_ascii_digit())
                || REMARKS.contains(&plain.as_str())
                || is_joint_words(&plain)
                || text.trim().contains(' ')
        };
        return if UNITS.contains(&plain.as_str())
            || RATES.contains(&plain.as_str())
            || plain.contains(['/', '%', '^', '²'])
        {
            unit(text)
        } else if is_known || is_remark() {
            None
        } else {
            Some(Stated::Unknown(short(text)))
        };
    }
    // `mA` is one word here.
    let is_part = |c: char| c.is_alphanumeric() || c == '%';
    let last = heading.trim_end().rsplit(|c| !is_part(c)).next().filter(|last| last.len() < heading.trim().len())?;
    let plain = last.to_lowercase();
    let is_unit = (plain.chars().count() > 1 || plain == "%") && UNITS.contains(&plain.as_str());
    if is_unit || RATES.contains(&plain.as_str()) { unit(last) } else { None }
}

/// The text in brackets at the end of a heading.
fn bracketed(heading: &str) -> Option<&str> {
    let heading = heading.trim_end();
    let close = heading.chars().last()?;
    let open = match close {
        ')' => '(',
        ']' => '[',
        '}' => '{',
        _ => return None,
    };
    let inside = &heading[..heading.len() - 1];
    inside.rsplit_once(open).map(|(_, text)| text)
}

/// The words of a heading in lower case: split at blanks and signs, and where a capital follows a small letter.
pub(crate) fn words(heading: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before_small = false;
    for c in heading.chars() {
        let is_sign = !c.is_alphanumeric() && c != '°' && c != '%';
        if is_sign || (c.is_uppercase() && before_small) {
            words.push(String::new());
        }
        before_small = c.is_lowercase();
        if let Some(word) = words.last_mut().filter(|_| !is_sign) {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_quantities_that_are_no_angles_are_recognised() {
        for heading in [
            "left_hip (mA)",
            "left_hip_mA",
            "left hip [Nm]",
            "left_hip (rad/s)",
            "left_hip (deg/s)",
            "left_hip_deg_s",
            "left_hip rad/s",
            "left_hip_velocity",
            "left_hip_torque",
            "left_hip_torque_nm",
            "Left Hip Moment",
            "LHipMoment",
            "Anna:LKneePower",
            "/jointset/hip_l/hip_flexion_l/speed",
            "knee [%]",
            "knee %",
            "knee (cm)",
            "knee (turns)",
            "knee (N·m/kg)",
            "hip (A)",
            "motor_current",
        ] {
            assert!(matches!(stated(heading), Some(Stated::Other(_))), "{heading}: {:?}", stated(heading));
        }
    }

    #[test]
    fn signs_that_are_no_unit_of_an_angle_are_refused_for_names_of_joints_too() {
        let how = ReadOptions::default();
        for heading in ["left_hip [%]", "left_hip %", "left_hip_%", "left_hip [-]", "left_hip (–)"] {
            assert!(check_found(heading, &how).is_err(), "{heading}");
        }
        for heading in [
            "left_hip",
            "left_hip (°)",
            "left_hip (+)",
            "Left Hip Flexion (+) / Extension (-)",
            "Knee (Flex/Ext) LT",
            "left_hip -",
            "left_hip_deg",
        ] {
            assert!(check_found(heading, &how).is_ok(), "{heading}");
        }
    }

    #[test]
    fn other_headings_state_nothing_against_an_angle() {
        for heading in [
            "left_hip",
            "left_hip_deg",
            "left hip [deg]",
            "knee (°)",
            "goni (V)",
            "knee_mV",
            "CH1",
            "5",
            "goniometer 2 (rad)",
            "hip_a",
            "Channel A",
            "knee (left)",
            "knee (2)",
            "current_knee_angle",
            "LHipAngles",
            "jL5S1",
            "/b.gonio_deg",
            "hip_flexion_l",
            "",
            "(",
            ")",
            "°)",
        ] {
            assert_eq!(stated(heading), None, "{heading}");
        }
    }

    #[test]
    fn what_is_in_brackets_and_unknown_needs_the_unit_from_the_caller() {
        let mut how = ReadOptions::default();
        let error = check("knee (kgf)", &how).unwrap_err().to_string();
        assert!(error.contains("`kgf`") && error.contains("`--unit degrees|radians`"), "{error}");
        how.unit = Some(AngleUnit::Degrees);
        assert!(check("knee (kgf)", &how).is_ok());
        let error = check("knee (mA)", &how).unwrap_err().to_string();
        assert!(error.contains("`knee (mA)` states the unit `mA`") && error.contains("degrees or radians"), "{error}");
    }
}
