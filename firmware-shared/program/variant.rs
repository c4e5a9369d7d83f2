//! Variants of the program, chosen by Cargo features.

/// The feature `no-sensor` lets the legs walk without a sensor: the validity of its samples is reported and has no other effect.
pub(crate) const SENSOR_REQUIRED: bool = cfg!(not(feature = "no-sensor"));

/// The feature `no-debugger` refuses an attached debugger: the board stops and does not arm. Without it, it is reported.
pub(crate) const DEBUGGER_REFUSED: bool = cfg!(feature = "no-debugger");

/// The feature `require-seal` refuses an image that nobody sealed: the board does not arm. Without it, it arms and warns.
pub(crate) const SEAL_REQUIRED: bool = cfg!(feature = "require-seal");

/// The feature `shadow` runs everything and drives nothing: the servo pins stay low, and the timer's main output is never switched on.
pub(crate) const SHADOW: bool = cfg!(feature = "shadow");
