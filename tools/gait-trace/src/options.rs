//! What the caller knows of a recording's file and the file does not say: columns, unit, calibration, rate, axis.

use crate::format::angle_unit::AngleUnit;
use hgod_adc::Calibration;
use joint_units::Joint;
use std::fmt;

/// What the caller knows of a file and the file does not say.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions<'a> {
    /// Column of each joint, by name or by number from 1. Joints that are not listed are found by the names of the columns.
    pub map: Vec<(Joint, String)>,
    /// Column of the time, by name or by number from 1.
    pub time: Option<String>,
    /// Unit of all angles; overrides the file's own.
    pub unit: Option<AngleUnit>,
    /// Calibration of the sensor, for columns in volts and for columns without unit. A file without such a column is refused.
    pub calibration: Option<&'a Calibration>,
    /// Volts at the sensor for one volt at the pin of a board, for columns named after a pin (`PA1`); 1 if this is `None`.
    pub divider: Option<f32>,
    /// Frames a second, for a column that counts frames, for rows at equal time steps without a time, or in place of times that are too coarse.
    /// Times that do not agree with it are an error, and so is a format that has its own rate.
    pub rate_hz: Option<f64>,
    /// Rows of a CSV file that are read: those with these values.
    pub only: Vec<RowFilter>,
    /// Axis of flexion of the angles of a C3D file; the one that moves most if this is `None`.
    pub axis: Option<Axis>,
    /// Topic of an MCAP file that holds the joints; any one if this is `None`.
    pub topic: Option<String>,
    /// Joint of a CSV file whose only joint column names no side (`knee_deg`); the left one if this is `None` or does not fit the name.
    pub sideless: Option<Joint>,
}

/// Rows with one value in one column: those of one subject, or of one trial.
///
/// ```
/// use gait_trace::RowFilter;
/// let rows: RowFilter = "subject=S01".parse()?;
/// assert_eq!((rows.column.as_str(), rows.value.as_str()), ("subject", "S01"));
/// assert!(rows.takes("S01") && !rows.takes("S02"));
/// // Numbers are compared as numbers, and `*` is any value.
/// assert!("trial=1".parse::<RowFilter>()?.takes("1.0") && "trial=*".parse::<RowFilter>()?.takes("2"));
/// assert!("subject".parse::<RowFilter>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowFilter {
    /// The column, by name or by number from 1.
    pub column: String,
    /// The value; `*` for any one: the column does not tell recordings apart.
    pub value: String,
}

impl RowFilter {
    /// Whether a row with this field is read.
    #[must_use]
    pub fn takes(&self, field: &str) -> bool {
        let same_number = || matches!((self.value.parse::<f64>(), field.parse::<f64>()), (Ok(a), Ok(b)) if a == b);
        self.takes_all() || self.value == field || same_number()
    }

    /// Whether it takes all rows.
    #[must_use]
    pub fn takes_all(&self) -> bool {
        self.value == "*"
    }
}

impl std::str::FromStr for RowFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('=').map(|(column, value)| (column.trim(), value.trim())) {
            Some((column, value)) if !column.is_empty() && !value.is_empty() => {
                Ok(Self { column: column.into(), value: value.into() })
            }
            _ => Err(format!("`{text}`; allowed is COLUMN=VALUE, such as subject=S01, or COLUMN=* for any value")),
        }
    }
}

impl fmt::Display for RowFilter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.column, self.value)
    }
}

/// One of the three components of a joint's angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

impl Axis {
    /// All axes, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Name of the axis.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

/// A map of columns that cannot be read.
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
    /// Adds the columns of a command line's text: `left_hip=COLUMN,time=COLUMN`, by name or by number from 1.
    ///
    /// # Errors
    /// A part is not `JOINT=COLUMN`, or a joint or a column occurs twice.
    ///
    /// ```
    /// use gait_trace::ReadOptions;
    /// let mut how = ReadOptions::default();
    /// how.add_map("left_hip=Hip L, time=1")?;
    /// assert_eq!(how.map, [(joint_units::Joint::LeftHip, "Hip L".to_string())]);
    /// assert_eq!(how.time.as_deref(), Some("1"));
    /// assert!(how.add_map("left_hip=2").is_err() && how.add_map("right_hip=Hip L").is_err());
    /// # Ok::<(), gait_trace::options::MapError>(())
    /// ```
    pub fn add_map(&mut self, text: &str) -> Result<(), MapError> {
        for part in text.split(',') {
            let fault = |why| MapError { text: part.trim().into(), why };
            let (joint, column) = part.split_once('=').ok_or_else(|| fault("`=` is missing"))?;
            let (joint, column) = (joint.trim(), column.trim());
            if column.is_empty() {
                return Err(fault("the column is missing"));
            }
            if self.time.iter().chain(self.map.iter().map(|(_, column)| column)).any(|other| other == column) {
                return Err(fault("this column has another meaning already"));
            }
            let joint = match joint {
                "time" if self.time.is_some() => return Err(fault("this joint occurs twice")),
                "time" => {
                    self.time = Some(column.into());
                    continue;
                }
                _ => {
                    Joint::ALL.into_iter().find(|known| known.name() == joint).ok_or_else(|| fault("no such joint"))?
                }
            };
            if self.map.iter().any(|&(other, _)| other == joint) {
                return Err(fault("this joint occurs twice"));
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
