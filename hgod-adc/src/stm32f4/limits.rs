//! Supply and reference voltages of the chip; the table in [`super`] names the sources.

use joint_units::Volts;

/// Lowest supply at which the chip works.
pub const MIN_SUPPLY: Volts = Volts(1.8);
/// Highest supply at which the chip works: a reading above is taken for a fault.
pub const MAX_SUPPLY: Volts = Volts(3.6);
/// Supply at which the factory read the internal reference and the temperature sensor.
pub const SUPPLY_AT_CAL: Volts = Volts(3.3);
/// Least and greatest volts of the internal reference that a factory code may imply: 1.18 to 1.24 V in the data sheets, and 80 and 60 mV
/// beyond. An erased (0xFFFF) or unreadable (0) factory word falls outside.
pub const REFERENCE_VOLTS: (Volts, Volts) = (Volts(1.1), Volts(1.3));
