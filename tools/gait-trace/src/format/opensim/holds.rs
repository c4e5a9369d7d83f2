//! Whether the columns of an OpenSim table are joint angles.
//!
//! Controls, speeds, accelerations, forces, activations and errors are written in columns that are named after coordinates too, under more titles than a
//! list can have. So something must say that a table holds angles:
//!
//! | what | why |
//! |---|---|
//! | the title | its words are of angles: `Coordinates`, `inverse kinematics`, `q` |
//! | paths that end in `/value` | a coordinate has a value and a speed; the value of a rotation is its angle |
//! | speeds beside: `hip_flexion_l`, `hip_flexion_l_u` | states are coordinates and their speeds |
//! | `pelvis_ty` from 0.3 to 2 that moves by less than half of its size | the height of a pelvis in metres; a speed, a force or an error is none |
//! | the caller's unit | a person knows it |
//!
//! A title with a word of another quantity is refused all the same, unless it is that of a trial beside one of the others (`walk at low speed`). Only the
//! unit in degrees, under the name of a trial, is a guess: forces and activations have none, and the speed of a leg in degrees a second is beyond any angle.

use crate::fault::{Fault, TraceError};
use crate::format::angle_unit::AngleUnit;
use crate::format::column::AngleColumn;
use crate::format::text_table::{number_or_missing, short};
use crate::format::title;
use crate::options::ReadOptions;
use crate::raw::Doubt;
use std::borrow::Cow;

/// A height of a pelvis, metres, and its smallest share of the highest.
const HEIGHT_M: (f64, f64) = (0.3, 2.0);
const STEADY: f64 = 0.5;

/// What a table has that says it.
pub(super) struct Holds {
    title: Option<(u64, String)>,
    /// Paths to values, or speeds beside.
    by_columns: bool,
    /// The column of the height of the pelvis, and between which numbers it is.
    height: Option<(usize, f64, f64)>,
}

impl Holds {
    /// From the title with its line, the names of the columns and those of the joints.
    pub(super) fn of(title: Option<(u64, String)>, labels: &[String], joints: &[AngleColumn]) -> Self {
        let are_values = joints.iter().all(|joint| joint.heading.trim_end().ends_with("/value"));
        let has_speed = |joint: &AngleColumn| {
            let speed = format!("{}_u", joint.heading);
            labels.iter().any(|label| label.eq_ignore_ascii_case(&speed))
        };
        let is_height = |label: &String| {
            let name = label.trim().strip_suffix("/value").unwrap_or(label.trim());
            name.rsplit('/').next().is_some_and(|name| name.eq_ignore_ascii_case("pelvis_ty"))
        };
        let height = labels.iter().position(is_height).map(|index| (index, f64::INFINITY, f64::NEG_INFINITY));
        Self { title, by_columns: are_values || joints.iter().all(has_speed), height }
    }

    /// Takes the fields of a row.
    pub(super) fn take(&mut self, fields: &[Cow<'_, str>]) {
        if let Some((index, least, most)) = &mut self.height
            && let Some(Ok(value)) = fields.get(*index).map(|field| number_or_missing(field, false))
        {
            // The least and the most of a number and NaN are the number.
            (*least, *most) = (least.min(value), most.max(value));
        }
    }

    fn has_height(&self) -> bool {
        self.height.is_some_and(|(_, least, most)| least >= HEIGHT_M.0 && most <= HEIGHT_M.1 && least > STEADY * most)
    }

    /// What the title names instead of angles, as an error, unless it is that of a trial and something else may say angles.
    pub(super) fn check_title(&self, file: &str, may_be_angles: bool) -> Result<(), TraceError> {
        let Some((line, title)) = &self.title else { return Ok(()) };
        let Some(word) = title::other_quantity(title) else { return Ok(()) };
        if may_be_angles && title::is_of_trial(title) {
            return Ok(());
        }
        let what = format!("the title line `{}` names another quantity than joint angles (`{word}`)", short(title));
        Err(TraceError::new(file, Some(*line), Fault::NotAngles { what }))
    }

    /// As [`Self::check_title`], before any row.
    pub(super) fn check_header(&self, file: &str) -> Result<(), TraceError> {
        self.check_title(file, self.by_columns || self.height.is_some())
    }

    /// The doubt that is left, if any.
    ///
    /// # Errors
    /// The title names another quantity, or nothing says that the columns are angles.
    pub(super) fn angles(
        &self,
        file: &str,
        unit: Option<AngleUnit>,
        how: &ReadOptions<'_>,
    ) -> Result<Option<Doubt>, TraceError> {
        let (line, title) = self.title.as_ref().map_or((1, ""), |(line, title)| (*line, title.as_str()));
        let refused = |what| Err(TraceError::new(file, Some(line), Fault::NotAngles { what }));
        let by_others = self.by_columns || self.has_height();
        self.check_title(file, by_others)?;
        if by_others || title::says_angles(title) || how.unit.is_some() || how.calibration.is_some() {
            return Ok(None);
        }
        match unit {
            Some(AngleUnit::Degrees) => Ok(Some(Doubt::Quantity)),
            _ if title.is_empty() => {
                refused("the file has no title line, and nothing else says that it holds joint angles".into())
            }
            _ => refused(format!(
                "neither the title line `{}` nor anything else says that the file holds joint angles",
                short(title)
            )),
        }
    }
}
