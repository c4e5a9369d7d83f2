//! One measured point of a calibration table.

use joint_units::{Radians, Volts};

/// Most points that a table may have.
pub const MAX_POINTS: usize = 32;

/// One measured pair of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CalibrationPoint {
    /// Volts at the sensor, 0 to [`crate::MAX_VOLTS`].
    pub volts: Volts,
    /// Angle of the joint, within [`crate::ANATOMY`].
    pub angle: Radians,
}
