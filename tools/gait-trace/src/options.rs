//! What the caller knows of a recording's file and the file does not say: columns, unit, calibration.

use crate::format::joint_names::AngleUnit;
use hgod_adc::Calibration;
use joint_units::Joint;

/// What the caller knows of a file and the file does not say.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions<'a> {
    /// Which column each joint is, by name or by number from 1. Joints that are not here are found by the names of columns.
    pub map: Vec<(Joint, String)>,
    /// Which column is the time.
    pub time: Option<String>,
    /// The unit of all angles, whatever the file says.
    pub unit: Option<AngleUnit>,
    /// What makes angles of volts.
    pub calibration: Option<&'a Calibration>,
    /// Which joint a CSV file's only one is, where its name says no side (`knee_deg`): the left one if this is another joint or none.
    pub sideless: Option<Joint>,
}

/// A map that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "map `{text}`: {why}; allowed is `left_hip=COLUMN,left_knee=COLUMN,...` with left_hip, right_hip, left_knee, right_knee and time, each once"
)]
pub struct MapError {
    /// The part of the map that is wrong.
    pub text: String,
    /// What is wrong with it.
    pub why: &'static str,
}

impl ReadOptions<'_> {
    /// Adds to the map what a command line says: `left_hip=COLUMN,time=COLUMN`, columns by name or by number from 1.
    ///
    /// # Errors
    /// A part that is no joint and column, or one that is there twice.
    ///
    /// ```
    /// use gait_trace::ReadOptions;
    /// let mut how = ReadOptions::default();
    /// how.add_map("left_hip=Hip L, time=1")?;
    /// assert_eq!(how.map, [(joint_units::Joint::LeftHip, "Hip L".to_string())]);
    /// assert_eq!(how.time.as_deref(), Some("1"));
    /// assert!(how.add_map("left_hip=2").is_err());
    /// # Ok::<(), gait_trace::options::MapError>(())
    /// ```
    pub fn add_map(&mut self, text: &str) -> Result<(), MapError> {
        for part in text.split(',') {
            let fault = |why| MapError { text: part.trim().into(), why };
            let (joint, column) = part.split_once('=').ok_or_else(|| fault("no `=`"))?;
            let (joint, column) = (joint.trim(), column.trim());
            if column.is_empty() {
                return Err(fault("no column"));
            }
            let joint = match joint {
                "time" if self.time.is_some() => return Err(fault("there twice")),
                "time" => {
                    self.time = Some(column.into());
                    continue;
                }
                _ => {
                    Joint::ALL.into_iter().find(|known| known.name() == joint).ok_or_else(|| fault("no such joint"))?
                }
            };
            if self.map.iter().any(|&(other, _)| other == joint) {
                return Err(fault("there twice"));
            }
            self.map.push((joint, column.into()));
        }
        Ok(())
    }

    /// The column that the map gives a joint.
    pub(crate) fn column_of(&self, joint: Joint) -> Option<&str> {
        self.map.iter().find(|&&(mapped, _)| mapped == joint).map(|(_, column)| column.as_str())
    }
}
