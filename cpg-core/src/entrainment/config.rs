//! Parameters, states and status of the follower.

use core::f32::consts::TAU;

use joint_units::{RadPerSec2, Radians};

use super::events::EventSource;
use super::plausibility::{PlausibilityConfig, SensorFault};
use crate::entrainment::phase_lock::PhaseLockConfig;
use crate::error::{all_in_range, in_range};
use crate::{BuildError, Field};

/// Parameters of a [`Follower`](super::Follower).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowerConfig {
    /// The estimator of phase and stride frequency.
    pub lock: PhaseLockConfig,
    /// Limits of plausible samples.
    pub plausibility: PlausibilityConfig,
    /// Age of a sample when it is observed, that is the delay of the sensor's filter, s; 0 to 0.05, default 0. The joints lead the estimate by
    /// this time.
    pub delay_s: f32,
    /// Pose of the joints while the amplitude is 0, rad, in the order of [`joint_units::Joint::ALL`]; within ±2 pi. Default: hips 0, knees
    /// 5 degrees.
    pub stand: [Radians; 4],
    /// Longest time for which the joints continue to walk during a fault of the sensor, s; 0 to 2, default 2.
    pub freewheel_s: f32,
    /// Time for which samples must be good after a fault before they are used, s; 0.1 to 10, default 1.
    pub good_s: f32,
    /// Time for which the phase error must be small before the joints begin to walk, s; 0.05 to 5, default 0.3.
    pub settle_s: f32,
    /// Largest acceleration of the driven phase while it follows the estimate; 5 to 200 rad/s^2, default 50. It halts with twice as much.
    pub phase_acceleration: RadPerSec2,
    /// Stiffness k with which the driven phase follows the estimate, 1/s: near the estimate its distance falls with two poles at 2k; 2 to
    /// 30, default 12.
    pub stiffness: f32,
    /// Largest acceleration of the amplitude, 1/s^2; 2 to 200, default 100, at which the amplitude falls from 1 to 0 within 0.3 s.
    pub amplitude_acceleration: f32,
    /// Largest drift of the measured joint's mean that its angle takes up; 0 to 0.2 rad, default 4 degrees, 0 takes up none.
    pub drift_limit: Radians,
    /// Source of stride events beside the angle; default none.
    pub events: EventSource,
}

impl Default for FollowerConfig {
    /// The default of each field.
    fn default() -> Self {
        Self {
            lock: PhaseLockConfig::default(),
            plausibility: PlausibilityConfig::default(),
            delay_s: 0.0,
            stand: [Radians(0.0), Radians(0.0), Radians::from_degrees(5.0), Radians::from_degrees(5.0)],
            freewheel_s: 2.0,
            good_s: 1.0,
            settle_s: 0.3,
            phase_acceleration: RadPerSec2(50.0),
            stiffness: 12.0,
            amplitude_acceleration: 100.0,
            drift_limit: Radians::from_degrees(4.0),
            events: EventSource::None,
        }
    }
}

impl FollowerConfig {
    pub(super) fn validate(&self) -> Result<(), BuildError> {
        self.plausibility.validate()?;
        in_range(self.delay_s, Field::of("delay_s"), 0.0, 0.05)?;
        all_in_range(self.stand.map(|angle| angle.0), "stand", -TAU, TAU)?;
        in_range(self.freewheel_s, Field::of("freewheel_s"), 0.0, 2.0)?;
        in_range(self.good_s, Field::of("good_s"), 0.1, 10.0)?;
        in_range(self.settle_s, Field::of("settle_s"), 0.05, 5.0)?;
        in_range(self.phase_acceleration.0, Field::of("phase_acceleration"), 5.0, 200.0)?;
        in_range(self.stiffness, Field::of("stiffness"), 2.0, 30.0)?;
        in_range(self.amplitude_acceleration, Field::of("amplitude_acceleration"), 2.0, 200.0)?;
        in_range(self.drift_limit.0, Field::of("drift_limit"), 0.0, 0.2)
    }
}

/// State of the tracking, see the table of the [module](crate::entrainment).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Lock {
    /// The person stands, or there is no signal.
    Stopped,
    /// The person moves; phase and stride frequency are not known yet.
    Seeking,
    /// Phase and stride frequency are known.
    Locked,
    /// The sensor has a fault; the joints continue at the stride frequency from before it.
    Holding,
}

impl Lock {
    /// Every state.
    pub const ALL: [Self; 4] = [Self::Stopped, Self::Seeking, Self::Locked, Self::Holding];

    /// Name in messages and recordings: `stopped`, `seeking`, `locked`, `holding`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stopped => "stopped",
            Self::Seeking => "seeking",
            Self::Locked => "locked",
            Self::Holding => "holding",
        }
    }
}

/// Status of the tracking.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FollowStatus {
    /// The state.
    pub state: Lock,
    /// Fault of the sensor; `None` if it has none.
    pub fault: Option<SensorFault>,
    /// Phase of the person according to the quadrature filter minus the estimated phase (the far error of
    /// [`crate::entrainment::phase_lock`]), -pi to pi.
    pub phase_error: Radians,
    /// Estimated stride time, s.
    pub stride_s: f32,
    /// Agreement of measured and predicted angle, 0 to 1: 1 minus the root mean square of their difference relative to
    /// [`PlausibilityConfig::innovation`]. 0 during a fault and while stopped.
    pub confidence: f32,
}
