//! Parameters, states and status of the follower.

use core::f32::consts::TAU;

use joint_units::{RadPerSec2, Radians};

use super::events::EventSource;
use super::plausibility::{PlausibilityConfig, SensorFault};
use crate::entrainment::phase_lock::PhaseLockConfig;
use crate::error::{all_in_range, in_range};
use crate::{BuildError, Field};

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowerConfig {
    /// The estimator.
    pub lock: PhaseLockConfig,
    /// Limits of plausible samples.
    pub plausibility: PlausibilityConfig,
    /// How old a sample is when it comes, s: what the sensor's filter delays. The joints are led ahead of the estimate by as much; 0 to 0.05.
    pub delay_s: f32,
    /// Where the joints stand while the amplitude is 0; up to ±2 pi.
    pub stand: [Radians; 4],
    /// How long a fault is walked through, s; 0 to 2.
    pub freewheel_s: f32,
    /// How long samples must be good after a fault, s; 0.1 to 10.
    pub good_s: f32,
    /// How long the phase error must be small before the joints begin to walk, s; 0.05 to 5.
    pub settle_s: f32,
    /// Phase acceleration that the estimator may cause; 5 to 200 rad/s^2.
    pub phase_acceleration: RadPerSec2,
    /// How stiffly the driven phase follows, k in 1/s; 2 to 30.
    pub stiffness: f32,
    /// Acceleration of the amplitude, 1/s^2: 100 stops within 0.3 s; 2 to 200.
    pub amplitude_acceleration: f32,
    /// Source of stride events beside the angle.
    pub events: EventSource,
}

impl Default for FollowerConfig {
    /// No delay; stands straight, walks through 2 s of fault, tracks again after 1 s of good samples, uses the angle only.
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
        in_range(self.amplitude_acceleration, Field::of("amplitude_acceleration"), 2.0, 200.0)
    }
}

/// State of the tracking.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Lock {
    /// The person stands, or there is no signal.
    Stopped,
    /// Phase and cadence are being searched.
    Seeking,
    /// Phase and cadence are known.
    Locked,
    /// The sensor is at fault; the joints go on at the last cadence.
    Holding,
}

impl Lock {
    /// Every state.
    pub const ALL: [Self; 4] = [Self::Stopped, Self::Seeking, Self::Locked, Self::Holding];

    /// A word for people.
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
    /// What is wrong with the sensor, if something is.
    pub fault: Option<SensorFault>,
    /// Phase of the person as filtered from the sensor, less the estimated one, -pi to pi.
    pub phase_error: Radians,
    /// Estimated stride time, s.
    pub stride_s: f32,
    /// 1 if the sensor agrees with the prediction, 0 if the difference is a fault or there is no sensor.
    pub confidence: f32,
}
