//! Chooses the column of each joint where a file has one column a joint: by the caller's map, else by name.

use crate::fault::Fault;
use crate::format::joint_names::joint_of;
use crate::format::stated;
use crate::format::text_table::{column_called, listed, short};
use crate::options::ReadOptions;
use joint_units::Joint;

/// The joints that are found, each with the index of its column. A map may use a column's heading or its name, which is the part of the
/// heading that says the joint.
///
/// # Errors
/// A column of the map is missing or states that it is no angle, two columns have one joint, or there is none.
pub(crate) fn columns(headings: &[&str], names: &[&str], how: &ReadOptions<'_>) -> Result<Vec<(Joint, usize)>, Fault> {
    let mut chosen = Vec::new();
    for joint in Joint::ALL {
        let index = match how.column_of(joint) {
            Some(wanted) => {
                let index = column_called(headings, wanted).or_else(|| column_called(names, wanted));
                let index = index.ok_or_else(|| Fault::MapColumn {
                    joint: joint.name(),
                    wanted: wanted.into(),
                    have: listed(headings),
                })?;
                stated::check(names[index], how)?;
                Some(index)
            }
            None => {
                let is_joint = |index: &usize| joint_of(names[*index]).is_some_and(|(found, _)| found == joint);
                let mut found = (0..names.len()).filter(is_joint);
                let index = found.next();
                if let (Some(index), Some(other)) = (index, found.next()) {
                    let (first, second) = (short(headings[index]), short(headings[other]));
                    return Err(Fault::TwoColumns { joint: joint.name(), first, second });
                }
                index
            }
        };
        chosen.extend(index.map(|index| (joint, index)));
    }
    Ok(chosen)
}
