//! How long an analogue servo is driven after a pulse.

/// An analogue servo is driven for so long after a pulse at most, s. Its torque fades when pulses come more than 20 ms apart (D. Buckley, ServoNotes,
/// 2008), since each pulse is stretched to a drive of a few milliseconds (Xtreme Power Systems, X24 manual, page 53).
pub(crate) const DRIVE_S: f64 = 0.02;
/// Without a pulse for so long an analogue servo has no torque, s ("after 50 ms of no pulse seen, the servo relaxes", Parallax forum 90233).
pub(crate) const RELAXED_S: f64 = 0.05;
