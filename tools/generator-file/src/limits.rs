//! The motion of the joints in `f32` at 1 ms, as the board makes it, against the limits of a robot.

use std::fmt;

use cpg_core::Generator;
use joint_loop::{GateConfig, PoseSense};
use joint_units::{Joint, Period};
use serde::Serialize;

use crate::subject::Subject;

/// Amplitude below which a joint counts as one that does not move, degrees.
pub const STILL_DEG: f64 = 0.5;
/// Strides before the motion is measured: more than the orbit is searched in, since a slow transient can hide the motion that follows it.
pub(crate) const SETTLE_STRIDES: f64 = 220.0;
/// Strides over which it is measured.
const MEASURED_STRIDES: f64 = 20.0;
/// Most ticks of both together.
const MOST_TICKS: f64 = 4e6;

/// Range and peaks of a joint.
#[derive(Debug, Clone, Serialize)]
pub struct JointPeaks {
    /// `left_hip`, `right_hip`, `left_knee` or `right_knee`.
    pub name: &'static str,
    /// Smallest angle, degrees.
    pub least_deg: f64,
    /// Largest angle, degrees.
    pub most_deg: f64,
    /// Half the difference of the two, degrees.
    pub amplitude_deg: f64,
    /// Largest rate, degrees per second.
    pub peak_velocity_deg_s: f64,
    /// Largest acceleration, degrees per second squared.
    pub peak_acceleration_deg_s2: f64,
    /// Whether range, rate and acceleration are within the robot's limits. Poses are of two joints, see [`Excess`].
    pub inside_gate: bool,
}

/// A limit of the robot that the motion exceeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Excess {
    /// The joint, or the sum or difference of two.
    pub of: String,
    /// What is limited.
    pub limit: Limit,
    /// The furthest value, in degrees, deg/s or deg/s^2.
    pub value: f64,
    /// The limit in the same unit.
    pub allowed: f64,
    /// Where in the stride the value is reached, percent; 0 is where the left hip is most flexed.
    pub at_percent: f64,
}

/// What is limited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// The smallest angle of a joint.
    Least,
    /// The largest angle of a joint.
    Most,
    /// The rate of a joint.
    Rate,
    /// The acceleration of a joint.
    Acceleration,
    /// A pose of two joints.
    Pose,
}

impl fmt::Display for Excess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sign, unit) = match self.limit {
            Limit::Least => ("<", "degrees"),
            Limit::Most | Limit::Pose => (">", "degrees"),
            Limit::Rate => (">", "deg/s"),
            Limit::Acceleration => (">", "deg/s^2"),
        };
        let Self { of, value, allowed, at_percent, .. } = self;
        // As many digits as show the difference.
        let digits = (0..4).find(|&n| format!("{value:.n$}") != format!("{allowed:.n$}")).unwrap_or(4);
        let whole =
            if digits == 0 && matches!(self.limit, Limit::Rate | Limit::Acceleration) { 0 } else { digits.max(1) };
        let at = at_percent.round() % 100.0;
        write!(f, "{of} {value:.whole$} {sign} {allowed} {unit} at {at:.0} % of the stride")
    }
}

/// The motion of a generator.
pub(crate) struct Measured {
    /// The joints.
    pub(crate) joints: Vec<JointPeaks>,
    /// The limits that are exceeded: ranges and poses first.
    pub(crate) excesses: Vec<Excess>,
    /// Every state stayed within its bound.
    pub(crate) sound: bool,
}

impl Measured {
    /// The joints that do not move.
    pub(crate) fn still(&self) -> impl Iterator<Item = &JointPeaks> {
        self.joints.iter().filter(|joint| joint.amplitude_deg < STILL_DEG)
    }
}

/// A largest value and the phase at which it was.
#[derive(Clone, Copy)]
struct Peak(f32, f32);

impl Peak {
    const NONE: Self = Self(f32::MIN, 0.0);

    fn take(&mut self, value: f32, phase: f32) {
        if value > self.0 {
            *self = Self(value, phase);
        }
    }
}

/// Measures the motion on the orbit.
pub(crate) fn measure(subject: &Subject, gate: &GateConfig) -> Result<Measured, String> {
    let mut led = subject.led(Period::MILLISECOND)?;
    let stride = (subject.stride_guess_s() * 1e3).min(MOST_TICKS / (SETTLE_STRIDES + MEASURED_STRIDES));
    let mut sound = true;
    for _ in 0..(SETTLE_STRIDES * stride) as u32 {
        led.step();
        sound &= led.check().is_ok();
    }
    let [mut least, mut most, mut rate, mut acceleration] = [[Peak::NONE; 4]; 4];
    let mut poses = gate.pose.map(|_| Peak::NONE);
    let mut before = led.rates();
    for _ in 0..(MEASURED_STRIDES * stride) as u32 {
        led.step();
        sound &= led.check().is_ok();
        let (angles, rates, phase) = (led.angles(), led.rates(), led.phase().cycles());
        for joint in 0..4 {
            least[joint].take(-angles[joint].0, phase);
            most[joint].take(angles[joint].0, phase);
            rate[joint].take(rates[joint].0.abs(), phase);
            acceleration[joint].take((rates[joint].0 - before[joint].0).abs() * 1e3, phase);
        }
        for (peak, limit) in poses.iter_mut().zip(&gate.pose) {
            if let Some(limit) = limit {
                peak.take(limit.of(&angles).0, phase);
            }
        }
        before = rates;
    }
    let degrees = |x: f32| f64::from(x).to_degrees();
    let mut excesses = vec![];
    let mut exceeds = |of: String, limit: Limit, peak: Peak, allowed: f32| {
        // A stop at the limit itself is inside it.
        if peak.0 > allowed {
            let sign = if limit == Limit::Least { -1.0 } else { 1.0 };
            excesses.push(Excess {
                of,
                limit,
                value: sign * degrees(peak.0),
                // Rounded: 75 degrees, not the nearest f32 of it in radians.
                allowed: (sign * degrees(allowed) * 1e3).round() / 1e3,
                at_percent: 100.0 * f64::from(peak.1),
            });
        }
    };
    let range = |joint: Joint| gate.range[joint as usize];
    for joint in Joint::ALL {
        let name = || joint.name().to_string();
        exceeds(name(), Limit::Least, least[joint as usize], -range(joint).least.0);
        exceeds(name(), Limit::Most, most[joint as usize], range(joint).most.0);
    }
    for (peak, limit) in poses.iter().zip(&gate.pose) {
        if let Some(limit) = limit {
            let sign = if limit.sense == PoseSense::Sum { '+' } else { '-' };
            let of = format!("{} {sign} {}", limit.first.name(), limit.second.name());
            exceeds(of, Limit::Pose, *peak, limit.most.0);
        }
    }
    for joint in Joint::ALL {
        let name = || joint.name().to_string();
        exceeds(name(), Limit::Rate, rate[joint as usize], gate.rate[joint as usize].0);
        exceeds(name(), Limit::Acceleration, acceleration[joint as usize], gate.acceleration[joint as usize].0);
    }
    let joints = Joint::ALL.map(|joint| {
        let j = joint as usize;
        JointPeaks {
            name: joint.name(),
            least_deg: -degrees(least[j].0),
            most_deg: degrees(most[j].0),
            amplitude_deg: 0.5 * (degrees(most[j].0) + degrees(least[j].0)),
            peak_velocity_deg_s: degrees(rate[j].0),
            peak_acceleration_deg_s2: degrees(acceleration[j].0),
            inside_gate: excesses.iter().all(|excess| excess.of != joint.name()),
        }
    });
    Ok(Measured { joints: joints.to_vec(), excesses, sound })
}
