//! What to do about columns whose names count extension as positive: they are read only where a map names them.

use crate::format::joint_names::extension_of;
use crate::format::text_table::short;
use joint_units::Joint;

/// The columns that count extension as positive, of joints that are not read from another one, with the options that read them; `None` if
/// there are none.
pub(crate) fn advice(headings: &[String], is_read: impl Fn(Joint) -> bool) -> Option<String> {
    let mut found: Vec<(Joint, usize)> = Vec::new();
    for (index, heading) in headings.iter().enumerate() {
        if let Some(joint) = extension_of(heading)
            && !is_read(joint)
            && found.iter().all(|(other, _)| *other != joint)
        {
            found.push((joint, index));
        }
    }
    if found.is_empty() {
        return None;
    }
    let names: Vec<String> = found.iter().map(|&(_, index)| format!("`{}`", short(&headings[index]))).collect();
    let map: Vec<String> = found.iter().map(|(joint, index)| format!("{}={}", joint.name(), index + 1)).collect();
    let is_hip = |(joint, _): &(Joint, usize)| matches!(joint, Joint::LeftHip | Joint::RightHip);
    let mut options = format!("--map {}", map.join(","));
    if found.iter().any(is_hip) {
        options += " --hip-sign extension";
    }
    if !found.iter().all(is_hip) {
        options += " --knee-sign extension";
    }
    let names = names.join(", ");
    Some(format!(
        "{names}: by the name extension is positive, so they are read only where a map names them: `{options}`"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_options_are_those_that_read_the_columns() {
        let headings = ["time", "left_hip_extension_deg", "hip_flexion_r", "RKneeExtension"].map(String::from);
        assert_eq!(
            advice(&headings, |joint| joint == Joint::RightHip).unwrap(),
            "`left_hip_extension_deg`, `RKneeExtension`: by the name extension is positive, so they are read only where a map names them: `--map left_hip=2,right_knee=4 --hip-sign extension --knee-sign extension`"
        );
        assert_eq!(advice(&headings, |_| true), None);
        let others = ["knee_flexion_extension_l", "lumbar_extension", "left_hip_deg"].map(String::from);
        assert_eq!(advice(&others, |_| false), None);
    }
}
