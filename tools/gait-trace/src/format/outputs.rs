//! Chooses the outputs of a file that are the angles of the joints, of one subject or trial only.
//!
//! An output is called `SUBJECT:NAME`. The caller's map names outputs by that, by the name alone, or by the number from 1; the joints
//! that it does not name are found by name, among the outputs of the same subject. Without a map all joints must be of one subject.

use crate::fault::Fault;
use crate::format::joint_names::joint_of;
use crate::format::stated;
use crate::format::text_table::{listed, short};
use crate::options::ReadOptions;
use joint_units::Joint;

/// An output of three components or fewer.
pub(crate) struct Output {
    /// The subject or the trial; empty if the file tells none apart.
    pub(crate) group: String,
    /// The name without the group.
    pub(crate) name: String,
    /// Whether it can be an angle by what the file says of it, apart from its name.
    pub(crate) is_angle: bool,
    /// The column of each component, x, y and z.
    pub(crate) columns: [Option<usize>; 3],
}

impl Output {
    /// Group and name.
    pub(crate) fn label(&self) -> String {
        if self.group.is_empty() { self.name.clone() } else { format!("{}:{}", self.group, self.name) }
    }

    /// The joint that its name denotes.
    pub(crate) fn joint(&self) -> Option<Joint> {
        joint_of(&self.name).map(|(joint, _)| joint).filter(|_| self.is_angle)
    }
}

/// The output of each joint that the file has, as an index. `groups` is what the groups are, in the plural.
///
/// # Errors
/// No output is a joint; the map names none or several, or one that states that it is no angle; two outputs are one joint; or the joints
/// are of several groups.
pub(crate) fn choose(
    outputs: &[Output],
    groups: &'static str,
    how: &ReadOptions<'_>,
) -> Result<Vec<(Joint, usize)>, Fault> {
    let mut chosen: Vec<(Joint, usize)> = Vec::new();
    for (joint, wanted) in &how.map {
        let index = mapped(outputs, groups, *joint, wanted)?;
        stated::check(&outputs[index].name, how)?;
        chosen.push((*joint, index));
    }
    let is_bare_joint = |output: &Output| output.group.is_empty() && output.joint().is_some();
    let mapped_group = chosen.iter().map(|&(_, index)| outputs[index].group.as_str()).find(|group| !group.is_empty());
    // Joints without a group are a group too; another output without one says nothing of the group.
    let group = mapped_group.or((!chosen.is_empty() && outputs.iter().any(is_bare_joint)).then_some(""));
    let is_taken = |index: usize| chosen.iter().any(|&(_, taken)| taken == index);
    let found: Vec<(Joint, usize)> = outputs
        .iter()
        .enumerate()
        .filter(|(index, output)| !is_taken(*index) && group.is_none_or(|group| group == output.group))
        .filter_map(|(index, output)| Some((output.joint()?, index)))
        .filter(|(joint, _)| how.column_of(*joint).is_none())
        .collect();
    chosen.extend(found);
    let tells_group = |index: usize| !outputs[index].group.is_empty() || is_bare_joint(&outputs[index]);
    let telling: Vec<(Joint, usize)> = chosen.iter().copied().filter(|&(_, index)| tells_group(index)).collect();
    one_group(outputs, groups, &telling)?;
    chosen.sort_by_key(|&(joint, index)| (joint as usize, index));
    if let Some(pair) = chosen.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(twice(outputs, pair[0].0, pair[0].1, pair[1].1));
    }
    if chosen.is_empty() {
        let have = listed(&outputs.iter().map(Output::label).collect::<Vec<_>>());
        return Err(Fault::NoJoints { have, example: String::new() });
    }
    Ok(chosen)
}

/// The output that the map names.
fn mapped(outputs: &[Output], groups: &'static str, joint: Joint, wanted: &str) -> Result<usize, Fault> {
    let all = |is: &dyn Fn(&Output) -> bool| -> Vec<usize> {
        outputs.iter().enumerate().filter(|(_, output)| is(output)).map(|(index, _)| index).collect()
    };
    let mut found = all(&|output| output.label().eq_ignore_ascii_case(wanted));
    if found.is_empty() {
        found = all(&|output| output.name.eq_ignore_ascii_case(wanted));
    }
    if found.is_empty() {
        let number = wanted.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        found.extend(number.filter(|&index| index < outputs.len()));
    }
    match found.as_slice() {
        [] => {
            let have = listed(&outputs.iter().map(Output::label).collect::<Vec<_>>());
            Err(Fault::MapColumn { joint: joint.name(), wanted: wanted.into(), have })
        }
        &[index] => Ok(index),
        &[first, second, ..] => {
            let found: Vec<(Joint, usize)> = found.iter().map(|&index| (joint, index)).collect();
            one_group(outputs, groups, &found)?;
            Err(twice(outputs, joint, first, second))
        }
    }
}

/// An error if the outputs are of several groups.
fn one_group(outputs: &[Output], groups: &'static str, chosen: &[(Joint, usize)]) -> Result<(), Fault> {
    let mut names: Vec<&str> = chosen.iter().map(|&(_, index)| outputs[index].group.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    match chosen.first() {
        Some(&(joint, index)) if names.len() > 1 => Err(Fault::SeveralGroups {
            what: groups,
            have: listed_groups(&names),
            example: format!("{}={}", joint.name(), short(&outputs[index].label())),
        }),
        _ => Ok(()),
    }
}

/// The names of groups, in quotes; outputs without a group are named by that.
fn listed_groups(names: &[&str]) -> String {
    let named: Vec<&str> = names.iter().copied().filter(|name| !name.is_empty()).collect();
    let rest = if named.len() < names.len() { " and outputs without a name in front" } else { "" };
    format!("{}{rest}", listed(&named))
}

fn twice(outputs: &[Output], joint: Joint, first: usize, second: usize) -> Fault {
    let [first, second] = [first, second].map(|index| short(&outputs[index].label()));
    Fault::TwoColumns { joint: joint.name(), first, second }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn output(label: &str) -> Output {
        let (group, name) = label.rsplit_once(':').unwrap_or(("", label));
        Output { group: group.into(), name: name.into(), is_angle: true, columns: [Some(0), None, None] }
    }

    fn chosen(labels: &[&str], map: &str) -> Result<Vec<(Joint, usize)>, String> {
        let outputs: Vec<Output> = labels.iter().map(|label| output(label)).collect();
        let mut how = ReadOptions::default();
        if !map.is_empty() {
            how.add_map(map).unwrap();
        }
        choose(&outputs, "subjects", &how).map_err(|fault| fault.to_string())
    }

    const TWO: [&str; 5] =
        ["Anna:LHipAngles", "Anna:LKneeAngles", "Anna:LHipMoment", "Bert:LHipAngles", "Bert:LKneeAngles"];

    #[test]
    fn several_subjects_are_refused_and_the_map_chooses_one() {
        let error = chosen(&TWO, "").unwrap_err();
        assert!(error.contains("several subjects: `Anna`, `Bert`"), "{error}");
        assert!(error.contains("`--map left_hip=Anna:LHipAngles`"), "{error}");
        let bert = vec![(Joint::LeftHip, 3), (Joint::LeftKnee, 4)];
        assert_eq!(chosen(&TWO, "left_hip=bert:lhipangles").unwrap(), bert);
        assert_eq!(chosen(&TWO, "left_hip=4").unwrap(), bert);
        assert!(chosen(&TWO, "left_hip=LHipAngles").unwrap_err().contains("several subjects"));
        assert!(chosen(&TWO, "left_hip=1,left_knee=5").unwrap_err().contains("several subjects"));
    }

    #[test]
    fn outputs_without_a_subject_are_a_group_too() {
        let error = chosen(&["LHipAngles", "Bert:LKneeAngles"], "").unwrap_err();
        assert!(error.contains("several subjects: `Bert` and outputs without a name in front; allowed"), "{error}");
        assert!(error.contains("`--map left_hip=LHipAngles`"), "{error}");
        assert_eq!(chosen(&["LHipAngles", "Bert:LHipAngles"], "left_hip=LHipAngles").unwrap(), [(Joint::LeftHip, 0)]);
    }

    #[test]
    fn an_output_of_no_subject_goes_with_those_of_the_only_one() {
        let found = chosen(&["mine", "Anna:LKneeAngles"], "left_hip=mine").unwrap();
        assert_eq!(found, [(Joint::LeftHip, 0), (Joint::LeftKnee, 1)]);
        assert!(chosen(&["mine", "Anna:LKneeAngles", "Bert:RKneeAngles"], "left_hip=mine").is_err());
        let found = chosen(&["LHipAngles", "Anna:LKneeAngles"], "left_hip=LHipAngles").unwrap();
        assert_eq!(found, [(Joint::LeftHip, 0)]);
    }

    #[test]
    fn a_map_does_not_make_a_moment_an_angle() {
        let error = chosen(&TWO, "left_hip=Anna:LHipMoment").unwrap_err();
        assert!(error.contains("`LHipMoment` states the quantity `moment`, which is no angle"), "{error}");
    }

    #[test]
    fn a_joint_is_one_output() {
        assert_eq!(chosen(&["LKneeAngles", "x"], "").unwrap(), [(Joint::LeftKnee, 0)]);
        assert_eq!(chosen(&["LKneeAngles", "x"], "left_knee=X").unwrap(), [(Joint::LeftKnee, 1)]);
        // A column that the map gave away is not taken again.
        assert_eq!(chosen(&["LKneeAngles", "x"], "left_hip=1").unwrap(), [(Joint::LeftHip, 0)]);
        let error = chosen(&["LKneeAngles", "L_Knee_Angle"], "").unwrap_err();
        assert!(error.contains("`LKneeAngles` and `L_Knee_Angle` are both recognised as `left_knee`"), "{error}");
        assert!(chosen(&["PELO", "LKneeForce"], "").unwrap_err().contains("there are `PELO`, `LKneeForce`"));
        let error = chosen(&["PELO"], "left_hip=LHip").unwrap_err();
        assert!(error.contains("the map takes `left_hip` from `LHip`; the file has `PELO`"), "{error}");
    }
}
