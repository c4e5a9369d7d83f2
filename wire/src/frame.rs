//! A reported tick: everything that [`joint_loop::Frame`] holds.

use cpg_core::entrainment::{self, Lock, SensorFault};
use hgod_adc::Validity;
use joint_loop::{Cause, SENSORS, SupervisorState};
use joint_units::{Joint, Radians};
use serde::{Deserialize, Serialize};

use crate::number;

/// What one tick measured and commanded. A board sends every tenth; a gap of `seq` is a lost frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Control periods since the boot, missed ones included, wrapping.
    pub tick: u32,
    /// Calls of the loop since the boot, wrapping.
    pub seq: u32,
    /// State of the supervisor.
    #[serde(with = "number")]
    pub state: SupervisorState,
    /// Why the last motion ended or was refused.
    #[serde(with = "number")]
    pub cause: Cause,
    /// Each channel's sensor; `None` where the board has none.
    pub sensors: [Option<Reading>; SENSORS],
    /// Tracking status of a follower; `None` for other generators.
    pub following: Option<Follow>,
    /// Setpoints in joint order, radians, flexion positive; every bit as the board computed it.
    pub setpoints_rad: [f32; Joint::COUNT],
    /// Commanded pulse widths in joint order, us; 0 is no pulse.
    pub pulses_us: [u16; Joint::COUNT],
    /// Ticks that began too late, so far, wrapping.
    pub late: u32,
    /// Control periods without a call, so far, wrapping.
    pub missed: u32,
    /// Ticks with an overrun of the converter, so far, wrapping.
    pub overruns: u32,
    /// Limits that changed a setpoint in this tick, as [`joint_loop::GateStatus::bits`].
    pub limited: u8,
    /// Ticks in which a limit changed a setpoint, so far, wrapping.
    pub limited_ticks: u32,
    /// [`joint_loop::SetpointHash`] of all ticks so far.
    #[serde(with = "postcard::fixint::le")]
    pub setpoint_hash: u64,
}

/// One sensor in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Filtered angle, radians, flexion positive; the last good one where `validity` is not good.
    pub angle_rad: f32,
    /// Validity of the sample.
    #[serde(with = "number")]
    pub validity: Validity,
}

/// State of the phase lock between a person and a generator that follows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Follow {
    /// State of the lock.
    #[serde(with = "number")]
    pub state: Lock,
    /// Fault of the sensor, if it has one.
    #[serde(with = "number::option")]
    pub fault: Option<SensorFault>,
    /// Phase of the person minus the estimated phase, rad of the cycle, -pi to pi.
    pub phase_error_rad: f32,
    /// The person's stride time as estimated, s.
    pub stride_s: f32,
    /// Agreement of the sensor with the template: 1 full, 0 none.
    pub confidence: f32,
}

impl Frame {
    /// Setpoints in joint order, degrees.
    #[must_use]
    pub fn setpoints_deg(&self) -> [f32; Joint::COUNT] {
        self.setpoints_rad.map(|angle| Radians(angle).degrees())
    }
}

impl Reading {
    /// The angle in degrees.
    #[must_use]
    pub const fn angle_deg(&self) -> f32 {
        Radians(self.angle_rad).degrees()
    }
}

impl Follow {
    /// The phase error in degrees of the cycle.
    #[must_use]
    pub const fn phase_error_deg(&self) -> f32 {
        Radians(self.phase_error_rad).degrees()
    }
}

impl From<&entrainment::FollowStatus> for Follow {
    fn from(status: &entrainment::FollowStatus) -> Self {
        Self {
            state: status.state,
            fault: status.fault,
            phase_error_rad: status.phase_error.0,
            stride_s: status.stride_s,
            confidence: status.confidence,
        }
    }
}

impl From<&joint_loop::Frame<SENSORS>> for Frame {
    fn from(frame: &joint_loop::Frame<SENSORS>) -> Self {
        let mut sensors = [None; SENSORS];
        for (sensor, (angle, validity)) in sensors.iter_mut().zip(frame.measured.iter().zip(&frame.validity)) {
            *sensor = validity.map(|validity| Reading { angle_rad: angle.0, validity });
        }
        Self {
            tick: frame.tick,
            seq: frame.seq,
            state: frame.state,
            cause: frame.cause,
            sensors,
            following: frame.following.as_ref().map(Follow::from),
            setpoints_rad: frame.setpoints.map(|angle| angle.0),
            pulses_us: frame.pulses.map(|pulse| pulse.0),
            late: frame.late,
            missed: frame.missed,
            overruns: frame.overruns,
            limited: frame.limited.bits(),
            limited_ticks: frame.limited_ticks,
            setpoint_hash: frame.setpoint_hash,
        }
    }
}
