//! The motion of the joints in `f32` at 1 ms, as the board makes it, against the limits of a robot: from the first tick after the boot, over the
//! whole way to the orbit and 20 strides of it.

use std::fmt;

use cpg_core::Generator;
use joint_loop::{GateConfig, PoseSense};
use joint_units::{Joint, Period};
use serde::Serialize;

use crate::orbit;
use crate::subject::Subject;

/// Amplitude below which a joint counts as one that does not move, degrees.
pub const STILL_DEG: f64 = 0.5;
/// Strides after which the orbit of a generator without states is measured, and before the later armings of [`crate::drive`].
pub(crate) const SETTLE_STRIDES: f64 = 220.0;
/// Strides over which the motion on the orbit is measured.
const MEASURED_STRIDES: f64 = 20.0;
/// A limit of the orbit that is exceeded so soon after the start is exceeded from the start on, s.
const SOON_S: f64 = 2.0;
/// Least time from the start to the end of the measurement, s.
const LEAST_S: f64 = 120.0;

/// The way of a generator from its own start to its orbit, and a part of the orbit, in ticks of 1 ms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way {
    /// Ticks to the orbit: with all strides in which an orbit is searched for.
    pub(crate) to_orbit: u32,
    /// Ticks on the orbit.
    on_orbit: u32,
}

impl Way {
    /// # Errors
    /// The generator cannot be built; the text says why.
    pub(crate) fn of(subject: &Subject) -> Result<Self, String> {
        let stride = subject.stride_guess_s() * 1e3;
        let (strides, least) = match subject.model(Period::MILLISECOND)? {
            Some(_) => (orbit::MOST_STRIDES as f64, LEAST_S * 1e3),
            // It is on its orbit, or a follower, which locks within strides.
            None => (SETTLE_STRIDES, 0.0),
        };
        let on_orbit = MEASURED_STRIDES * stride;
        Ok(Self { to_orbit: (strides * stride).max(least - on_orbit) as u32, on_orbit: on_orbit as u32 })
    }

    /// All ticks.
    pub(crate) fn ticks(self) -> u32 {
        self.to_orbit + self.on_orbit
    }
}

/// Range and peaks of a joint on the orbit.
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
    /// Whether range, rate and acceleration are within the robot's limits, from the start on. Poses are of two joints, see [`Excess`].
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
    /// When the limit is exceeded for the first time, seconds after the start of the generator, which is the boot of a board.
    pub first_s: f64,
    /// When it is exceeded for the last time; of a limit that the orbit exceeds, in the last stride that was measured.
    pub last_s: f64,
    /// Whether the orbit exceeds it, else only the way from the start to the orbit.
    pub on_orbit: bool,
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
        write!(f, "{of} {value:.whole$} {sign} {allowed} {unit} at {at:.0} % of the stride")?;
        let [first, last] = [self.first_s, self.last_s];
        match self.on_orbit {
            true if first < SOON_S => return Ok(()),
            true => return write!(f, ", from {first:.1} s after its start on"),
            false => {}
        }
        if last - first < 0.1 {
            return write!(f, ", on the way to its orbit, {first:.2} s after its start");
        }
        write!(f, ", on the way to its orbit, {first:.1} to {last:.1} s after its start")
    }
}

/// The motion of a generator.
pub(crate) struct Measured {
    /// The joints.
    pub(crate) joints: Vec<JointPeaks>,
    /// The limits that are exceeded, see [`excesses`].
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

/// A value that has a limit, and the ticks in which it is beyond it.
#[derive(Clone, Copy)]
struct Watched {
    allowed: f32,
    largest: f32,
    /// Where in the stride it is largest, 0 to 1.
    phase: f32,
    /// The first and the last tick beyond the limit.
    beyond: Option<(u32, u32)>,
}

impl Watched {
    const fn of(allowed: f32) -> Self {
        Self { allowed, largest: f32::MIN, phase: 0.0, beyond: None }
    }

    fn take(&mut self, value: f32, tick: u32, phase: f32) {
        if value > self.largest {
            (self.largest, self.phase) = (value, phase);
        }
        // A stop at the limit itself is inside it.
        if value > self.allowed {
            self.beyond = Some((self.beyond.map_or(tick, |(first, _)| first), tick));
        }
    }

    /// What exceeds the limit, for `of`.
    fn excess(&self, of: String, limit: Limit, to_orbit: u32) -> Option<Excess> {
        let (first, last) = self.beyond?;
        let sign = if limit == Limit::Least { -1.0 } else { 1.0 };
        let seconds = |tick: u32| f64::from(tick) * 1e-3;
        Some(Excess {
            of,
            limit,
            value: sign * degrees(self.largest),
            // Rounded: 75 degrees, not the nearest f32 of it in radians.
            allowed: (sign * degrees(self.allowed) * 1e3).round() / 1e3,
            at_percent: 100.0 * f64::from(self.phase),
            first_s: seconds(first),
            last_s: seconds(last),
            on_orbit: last > to_orbit,
        })
    }
}

fn degrees(radians: f32) -> f64 {
    f64::from(radians).to_degrees()
}

/// The limits of a robot that the motion of a generator exceeds, from its own start to its orbit: those of the orbit first,
/// of these ranges and poses.
///
/// # Errors
/// It cannot be built; the text says why.
pub fn excesses(subject: &Subject, gate: &GateConfig) -> Result<Vec<Excess>, String> {
    Ok(measure(subject, gate)?.excesses)
}

/// Measures the motion from the start on.
pub(crate) fn measure(subject: &Subject, gate: &GateConfig) -> Result<Measured, String> {
    let mut led = subject.led(Period::MILLISECOND)?;
    let way = Way::of(subject)?;
    let mut sound = true;
    let mut least = gate.range.map(|range| Watched::of(-range.least.0));
    let mut most = gate.range.map(|range| Watched::of(range.most.0));
    let mut rate = gate.rate.map(|rate| Watched::of(rate.0));
    let mut acceleration = gate.acceleration.map(|acceleration| Watched::of(acceleration.0));
    let mut poses = gate.pose.map(|limit| limit.map(|limit| (limit, Watched::of(limit.most.0))));
    // Smallest and largest angle, largest rate and acceleration on the orbit.
    let mut orbit = [[f32::MIN; 4]; Joint::COUNT];
    let mut before = led.rates();
    for tick in 1..=way.ticks() {
        led.step();
        sound &= led.check().is_ok();
        let (angles, rates, phase) = (led.angles(), led.rates(), led.phase().cycles());
        for joint in 0..Joint::COUNT {
            let faster = (rates[joint].0 - before[joint].0).abs() * 1e3;
            let values = [-angles[joint].0, angles[joint].0, rates[joint].0.abs(), faster];
            for (watched, value) in [&mut least, &mut most, &mut rate, &mut acceleration].into_iter().zip(values) {
                watched[joint].take(value, tick, phase);
            }
            if tick > way.to_orbit {
                for (peak, value) in orbit[joint].iter_mut().zip(values) {
                    *peak = peak.max(value);
                }
            }
        }
        for (limit, watched) in poses.iter_mut().flatten() {
            watched.take(limit.of(&angles).0, tick, phase);
        }
        before = rates;
    }
    let of_joints = |watched: [Watched; Joint::COUNT], limit: Limit| {
        let each = Joint::ALL.into_iter().zip(watched);
        each.map(move |(joint, watched)| watched.excess(joint.name().into(), limit, way.to_orbit))
    };
    let ranges =
        of_joints(least, Limit::Least).zip(of_joints(most, Limit::Most)).flat_map(|(least, most)| [least, most]);
    let of_poses = poses.into_iter().flatten().map(|(limit, watched)| {
        let sign = if limit.sense == PoseSense::Sum { '+' } else { '-' };
        watched.excess(format!("{} {sign} {}", limit.first.name(), limit.second.name()), Limit::Pose, way.to_orbit)
    });
    let speeds = of_joints(rate, Limit::Rate)
        .zip(of_joints(acceleration, Limit::Acceleration))
        .flat_map(|(rate, acceleration)| [rate, acceleration]);
    let mut excesses: Vec<Excess> = ranges.chain(of_poses).chain(speeds).flatten().collect();
    excesses.sort_by_key(|excess| !excess.on_orbit);
    let joints = Joint::ALL.into_iter().zip(orbit).map(|(joint, [least, most, rate, acceleration])| JointPeaks {
        name: joint.name(),
        least_deg: -degrees(least),
        most_deg: degrees(most),
        amplitude_deg: 0.5 * (degrees(most) + degrees(least)),
        peak_velocity_deg_s: degrees(rate),
        peak_acceleration_deg_s2: degrees(acceleration),
        inside_gate: excesses.iter().all(|excess| excess.of != joint.name()),
    });
    Ok(Measured { joints: joints.collect(), excesses, sound })
}
