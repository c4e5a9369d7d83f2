//! One tick of a follower that is played over a recording.

use cpg_core::entrainment::{Lock, SensorFault};
use joint_units::{Joint, Phase};

/// Ticks a second.
pub const TICKS_PER_S: f64 = 1000.0;

/// One tick of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Setpoints, degrees.
    pub angles: [f64; Joint::COUNT],
    /// Rates of the setpoints, degrees per second.
    pub rates: [f64; Joint::COUNT],
    /// Phase of the setpoints.
    pub phase: Phase,
    /// Estimated phase of the person.
    pub estimate: Phase,
    /// Amplitude factor.
    pub amplitude: f32,
    /// State.
    pub state: Lock,
    /// Fault of the sensor.
    pub fault: Option<SensorFault>,
    /// Estimated angular frequency, rad/s.
    pub frequency: f64,
}

/// Phase error of a tick in degrees: the person's phase less that of the setpoints.
#[must_use]
pub fn phase_error_deg(tick: &Tick, cycles: f64) -> f64 {
    let person = Phase::from_cycles(cycles.rem_euclid(1.0) as f32);
    f64::from(person.radians_after(tick.phase).0).to_degrees()
}
