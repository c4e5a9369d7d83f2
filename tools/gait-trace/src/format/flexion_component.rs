//! Chooses the component of the joints' angles that is flexion, in tables with a column for each component.

use crate::fault::Fault;
use crate::format::axis;
use crate::format::components::{self, Triple, says_angle};
use crate::format::csv_header::Chosen;
use crate::format::segments::Track;
use crate::format::text_table::short;
use crate::format::unit::Said;
use crate::options::{Axis, ReadOptions};
use crate::raw::Doubt;
use joint_units::Joint;

/// Puts each joint of several components on the one that is flexion. `mapped` are the axes of the columns that the map chose.
///
/// # Errors
/// The components are positions; or it is unclear which one is flexion. With the index of the column.
pub(crate) fn settle(
    chosen: &mut [Chosen],
    mapped: &[Axis],
    how: &ReadOptions<'_>,
    notes: &mut Vec<String>,
    doubts: &mut Vec<Doubt>,
) -> Result<(), (usize, Fault)> {
    let is_position = |c: &Chosen| c.said == Said::Nothing && !says_angle(&c.heading) && how.axis.is_none();
    let Some((first, columns)) = chosen.iter().find_map(|c| Some((c.index, c.triple.as_ref()?.listed()))) else {
        return Ok(());
    };
    if let Some(position) = chosen.iter().find(|c| c.triple.is_some() && is_position(c)) {
        let columns = position.triple.as_ref().map(Triple::listed).unwrap_or_default();
        return Err((position.index, Fault::Positions { columns }));
    }
    let axis = match (how.axis, mapped) {
        (Some(axis), _) => axis,
        (None, [axis]) => {
            notes.push(format!(
                "The joints that the map does not name are read from component {} of the angles, as the map has it; `--axis` takes another.",
                axis.name()
            ));
            *axis
        }
        (None, [_, _, ..]) => {
            let why = "the map takes several components".into();
            return Err((first, Fault::UnclearFlexion { columns, why }));
        }
        (None, []) => {
            let points: Vec<(Joint, usize, Track)> = chosen
                .iter()
                .filter_map(|c| {
                    let [_, y, z] = &c.triple.as_ref()?.values;
                    let at = |values: &[f64], row: usize| values.get(row).copied().unwrap_or(f64::NAN);
                    let rows = c.values.iter().enumerate();
                    Some((c.joint, c.index, rows.map(|(row, &x)| [x, at(y, row), at(z, row)]).collect()))
                })
                .collect();
            let with_components = || chosen.iter().filter(|c| c.triple.is_some());
            let is_plug_in_gait = with_components().all(|c| axis::is_plug_in_gait(&components::parts(&c.heading).0));
            axis::clear(&points, is_plug_in_gait, notes, doubts)
                .map_err(|why| (first, Fault::UnclearFlexion { columns, why }))?
        }
    };
    for one in chosen.iter_mut().filter(|_| axis != Axis::X) {
        let Some(triple) = one.triple.as_mut() else { continue };
        let Some((index, heading)) = triple.columns[axis as usize].take() else {
            let (field, found) = (short(&one.heading), format!("without component {}", axis.name()));
            return Err((one.index, Fault::HeaderField { field, found, allowed: "another `--axis`".into() }));
        };
        (one.index, one.heading) = (index, heading);
        one.values = std::mem::take(&mut triple.values[axis as usize]);
    }
    Ok(())
}
