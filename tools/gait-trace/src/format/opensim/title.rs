//! What an OpenSim file holds, by its title: files of controls, speeds, forces or markers have columns named after joints too.
//!
//! Joint angles are in files with the titles `Coordinates`, `inverse kinematics`, `q`, `Generalized coordinates`, `states` (columns
//! that end in `/value`), with the name of a model or of a trial, and with no title at all.

use crate::fault::{Fault, TraceError};
use crate::format::text_table::short;

/// Titles of files without joint angles, in lower case without blanks and signs, and what these files hold.
const OTHER: [(&str, &str); 38] = [
    ("controls", "actuator controls"),
    ("excitations", "muscle excitations"),
    ("activations", "muscle activations"),
    ("positionerrors", "position errors"),
    ("coordinateerrors", "position errors"),
    ("ikmarkererrors", "errors of markers"),
    ("modelmarkererrors", "errors of markers"),
    ("markererrors", "errors of markers"),
    ("speeds", "joint speeds"),
    ("generalizedspeeds", "joint speeds"),
    ("velocities", "joint speeds"),
    ("u", "joint speeds"),
    ("accelerations", "joint accelerations"),
    ("generalizedaccelerations", "joint accelerations"),
    ("udot", "joint accelerations"),
    ("dudt", "joint accelerations"),
    ("inversedynamics", "joint moments and forces"),
    ("inversedynamicsforces", "joint moments and forces"),
    ("inversedynamicsgeneralizedforces", "joint moments and forces"),
    ("generalizedforces", "joint moments and forces"),
    ("jointmoments", "joint moments and forces"),
    ("jointreactions", "joint reactions"),
    ("jointreactionloads", "joint reactions"),
    ("modelmarkerlocations", "places of markers"),
    ("markerlocations", "places of markers"),
    ("modelforces", "forces"),
    ("forcereporter", "forces"),
    ("actuatorforces", "forces of actuators"),
    ("actuatorspeeds", "speeds of actuators"),
    ("actuatorpowers", "powers of actuators"),
    ("groundreactionforces", "ground reaction forces"),
    ("externalloads", "ground reaction forces"),
    ("momentarms", "moment arms"),
    ("torques", "joint moments and forces"),
    ("moments", "joint moments and forces"),
    ("powers", "joint powers"),
    ("jointpowers", "joint powers"),
    ("forces", "forces"),
];

/// What the file holds instead of joint angles; `None` if the title is of joint angles, or anything else.
fn other_than_angles(title: &str) -> Option<&'static str> {
    let plain: String = title.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    let singular = |word: &str| word.strip_suffix('s').unwrap_or(word).to_owned();
    OTHER.iter().find(|(known, _)| singular(known) == singular(&plain)).map(|&(_, holds)| holds)
}

/// An error if the title is one of a file without joint angles.
pub(super) fn check(name: &str, title: Option<&(u64, String)>) -> Result<(), TraceError> {
    let Some((line, title)) = title else { return Ok(()) };
    match other_than_angles(title) {
        Some(holds) => Err(TraceError::new(name, Some(*line), Fault::NotAngles { holds, title: short(title) })),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_of_other_quantities_are_recognised() {
        for (title, holds) in [
            ("controls", "actuator controls"),
            ("PositionErrors", "position errors"),
            ("Speeds", "joint speeds"),
            ("Accelerations", "joint accelerations"),
            ("Inverse Dynamics Generalized Forces", "joint moments and forces"),
            ("ModelMarkerLocations", "places of markers"),
            ("Speed", "joint speeds"),
            ("acceleration", "joint accelerations"),
            ("Torques", "joint moments and forces"),
            ("Powers", "joint powers"),
        ] {
            assert_eq!(other_than_angles(title), Some(holds), "{title}");
        }
    }

    #[test]
    fn titles_of_angles_and_names_of_trials_are_not() {
        for title in [
            "Coordinates",
            "inverse kinematics",
            "q",
            "Generalized coordinates",
            "states",
            "crouch1_gait",
            "subject01_walk1",
            "walk at controlled speed",
            "",
        ] {
            assert_eq!(other_than_angles(title), None, "{title}");
        }
    }
}
