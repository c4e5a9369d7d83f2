//! One tick of a follower that is played over a recording.

use cpg_core::Generator;
use cpg_core::entrainment::{Follower, Lock, SensorFault};
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

impl Tick {
    /// A follower after a step, with these setpoints in degrees and rates in degrees per second: its own, or those behind a control loop.
    #[must_use]
    pub fn of(follower: &Follower, angles: [f64; Joint::COUNT], rates: [f64; Joint::COUNT]) -> Self {
        let status = follower.status();
        Self {
            angles,
            rates,
            phase: follower.phase(),
            estimate: follower.phase_lock().phase(),
            amplitude: follower.amplitude(),
            state: status.state,
            fault: status.fault,
            frequency: f64::from(follower.phase_lock().frequency().0),
        }
    }
}

/// Phase error of a tick in degrees: the person's phase less that of the setpoints.
#[must_use]
pub fn phase_error_deg(tick: &Tick, cycles: f64) -> f64 {
    let person = Phase::from_cycles(cycles.rem_euclid(1.0) as f32);
    f64::from(person.radians_after(tick.phase).0).to_degrees()
}
