//! Checks every angle of the sensor for plausibility and names the fault of an implausible one.
//!
//! | fault | rule | found after (default limits) |
//! |---|---|---|
//! | missing | no valid angle, not finite, or beyond ±200 degrees, for longer than [`PlausibilityConfig::bridge_s`] | 0.02 s |
//! | erratic | steps faster than [`PlausibilityConfig::fastest`] in more than a third of the samples of the last 0.1 s | 0.04 to 0.11 s if all samples are such |
//! | stuck | no change beyond [`PlausibilityConfig::noise`] for [`PlausibilityConfig::stuck_s`], after a motion faster than [`PlausibilityConfig::abrupt`], while the predicted angle moves on | 0.08 s |
//! | amplitude | the fundamental is larger than the upper limit of [`PlausibilityConfig::amplitude`] times the template's | the settling time of the quadrature filter, about 0.35 s, and 0.4 strides |
//! | innovation | the root mean square of measured minus predicted angle exceeds [`PlausibilityConfig::innovation`] times the amplitude, and the joint moves faster than three times its usual rate | 0.2 to 0.4 s |
//!
//! The first three rules are in this file; the last two need the estimator and are applied by [`Follower`](super::Follower).
//!
//! A standing leg is no fault. It differs from a stuck sensor by how the motion ended: a leg slows down over some hundredths of a second,
//! whereas the angle of a stuck sensor or a broken wire stops from one tick to the next. The rule `stuck` therefore compares the rate
//! just before the halt with a limit.
//!
//! Single implausible samples are bridged: the estimator advances without them.

use joint_units::{Period, RadPerSec, Radians};

use crate::error::in_range;
use crate::{BuildError, Field};

/// Limits of what is plausible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlausibilityConfig {
    /// Highest rate of a joint; 5 to 100 rad/s, default 25. Running knees reach 16 rad/s.
    pub fastest: RadPerSec,
    /// Peak noise of a good sensor, quantisation included; 0 to 0.1 rad, default 0.15 degrees (two codes of a 12 bit converter).
    pub noise: Radians,
    /// Time for which samples may be implausible before that is a fault, s; 0 to 0.2, default 0.02.
    pub bridge_s: f32,
    /// Time without change after which a sensor is stuck, s; 0.02 to 1, default 0.08.
    pub stuck_s: f32,
    /// Rate that a leg cannot lose within 20 ms; 0.1 to 10 rad/s, default 1.05 rad/s (60 degrees/s). A halt from a higher rate is the sensor's.
    pub abrupt: RadPerSec,
    /// Least and largest amplitude of the fundamental relative to the template's. Below, the person stands; above, the sensor has a fault.
    /// 0.05 to 1 and 1 to 10, default 0.45 and 2.2.
    pub amplitude: (f32, f32),
    /// Largest root mean square of the innovation (measured minus predicted angle) relative to the amplitude; 0.1 to 2, default 0.55.
    pub innovation: f32,
}

impl Default for PlausibilityConfig {
    /// The default of each field.
    fn default() -> Self {
        Self {
            fastest: RadPerSec(25.0),
            noise: Radians::from_degrees(0.15),
            bridge_s: 0.02,
            stuck_s: 0.08,
            abrupt: RadPerSec(1.05),
            amplitude: (0.45, 2.2),
            innovation: 0.55,
        }
    }
}

impl PlausibilityConfig {
    /// Checks every field against its range. [`FollowerConfig::build`](super::FollowerConfig::build) calls it.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range: `plausibility.noise`.
    pub fn validate(&self) -> Result<(), BuildError> {
        in_range(self.fastest.0, Field::of("plausibility.fastest"), 5.0, 100.0)?;
        in_range(self.noise.0, Field::of("plausibility.noise"), 0.0, 0.1)?;
        in_range(self.bridge_s, Field::of("plausibility.bridge_s"), 0.0, 0.2)?;
        in_range(self.stuck_s, Field::of("plausibility.stuck_s"), 0.02, 1.0)?;
        in_range(self.abrupt.0, Field::of("plausibility.abrupt"), 0.1, 10.0)?;
        in_range(self.amplitude.0, Field::at("plausibility.amplitude", 0), 0.05, 1.0)?;
        in_range(self.amplitude.1, Field::at("plausibility.amplitude", 1), 1.0, 10.0)?;
        in_range(self.innovation, Field::of("plausibility.innovation"), 0.1, 2.0)
    }
}

/// Fault of the sensor that a follower detects, see [`PlausibilityConfig`] for the limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SensorFault {
    /// No valid samples for longer than the bridge.
    Missing,
    /// Many steps faster than a joint can move.
    Erratic,
    /// The angle stopped from one tick to the next, and does not change.
    Stuck,
    /// The amplitude is far above the template's.
    Amplitude,
    /// The angle does not follow the joint's template, and moves faster than a leg.
    Innovation,
}

impl SensorFault {
    /// Every fault.
    pub const ALL: [Self; 5] = [Self::Missing, Self::Erratic, Self::Stuck, Self::Amplitude, Self::Innovation];

    /// Name in messages and recordings: `missing`, `erratic`, `stuck`, `amplitude`, `innovation`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Erratic => "erratic",
            Self::Stuck => "stuck",
            Self::Amplitude => "amplitude",
            Self::Innovation => "innovation",
        }
    }
}

/// Result of the check of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Plausibility {
    /// Plausible: the angle, rad.
    Good(f32),
    /// Implausible, but not for long: the estimator advances without it.
    Bridged,
    /// A fault: samples are not used until they have been good for [`FollowerConfig::good_s`](super::FollowerConfig::good_s).
    Fault(SensorFault),
}

/// Largest plausible angle, rad: 200 degrees.
const LARGEST_ANGLE: f32 = 3.5;
/// Time constant of the share of erratic samples, s, and the share that is a fault.
const ERRATIC_S: f32 = 0.1;
const ERRATIC_SHARE: f32 = 0.35;
/// Angles that are kept for the rate before a halt, and the time between them, s: a rate over 20 ms.
const SPEED_SAMPLES: usize = 6;
const SPEED_STEP_S: f32 = 0.004;
/// Travel of the predicted angle since the halt from which on the sensor is stuck, as a multiple of the noise; at least [`LEAST_TRAVEL`].
const TRAVEL: f32 = 8.0;
/// Least such travel, rad: 1.2 degrees.
const LEAST_TRAVEL: f32 = 0.021;

/// The check and its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlausibilityCheck {
    config: PlausibilityConfig,
    period_s: f32,
    /// Last plausible angle, rad.
    last_good: Option<f32>,
    /// Time since it, s.
    bad_for: f32,
    /// Low-passed share of erratic samples, 0 to 1.
    erratic: f32,
    still: Still,
    /// Recent angles, `SPEED_STEP_S` apart, the newest first.
    recent: [f32; SPEED_SAMPLES],
    /// Time since the newest of them, s.
    since_recent: f32,
}

/// The last change of the angle by more than the noise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Still {
    /// Angle after it, rad.
    angle: f32,
    /// Predicted angle then, rad.
    predicted: f32,
    /// Absolute rate before it, rad/s.
    speed: f32,
    /// Time since it, s.
    time: f32,
    /// The sensor was found stuck, which holds until the angle changes.
    stuck: bool,
}

impl PlausibilityCheck {
    pub(crate) const fn new(config: PlausibilityConfig, period: Period) -> Self {
        Self {
            config,
            period_s: period.seconds(),
            last_good: None,
            bad_for: 0.0,
            erratic: 0.0,
            still: Still { angle: 0.0, predicted: 0.0, speed: 0.0, time: 0.0, stuck: false },
            recent: [0.0; SPEED_SAMPLES],
            since_recent: 0.0,
        }
    }

    /// Checks the sample of one tick; `predicted` is the angle predicted for it, rad.
    pub(crate) fn judge(&mut self, sample: Option<Radians>, predicted: f32) -> Plausibility {
        let t = self.period_s;
        let plausible = sample.map(|angle| angle.0).filter(|y| y.is_finite() && y.abs() <= LARGEST_ANGLE);
        let Some(y) = plausible else {
            self.bad_for += t;
            return if self.bad_for > self.config.bridge_s {
                self.last_good = None;
                Plausibility::Fault(SensorFault::Missing)
            } else {
                Plausibility::Bridged
            };
        };
        let step = self.last_good.map_or(0.0, |last| (y - last).abs());
        let possible = self.config.fastest.0 * (t + self.bad_for) + 2.0 * self.config.noise.0;
        let erratic = step > possible;
        self.erratic += (if erratic { 1.0 } else { 0.0 } - self.erratic) * (t / ERRATIC_S).min(1.0);
        if erratic {
            self.bad_for += t;
            return if self.erratic > ERRATIC_SHARE {
                self.last_good = Some(y);
                Plausibility::Fault(SensorFault::Erratic)
            } else {
                Plausibility::Bridged
            };
        }
        self.bad_for = 0.0;
        self.keep(y);
        self.last_good = Some(y);
        if self.erratic > ERRATIC_SHARE {
            return Plausibility::Fault(SensorFault::Erratic);
        }
        if self.is_stuck(y, predicted) {
            return Plausibility::Fault(SensorFault::Stuck);
        }
        Plausibility::Good(y)
    }

    fn is_stuck(&mut self, y: f32, predicted: f32) -> bool {
        if (y - self.still.angle).abs() > self.config.noise.0 {
            self.still = Still { angle: y, predicted, speed: self.speed(y), time: 0.0, stuck: false };
            return false;
        }
        self.still.time += self.period_s;
        let travelled = (predicted - self.still.predicted).abs();
        self.still.stuck |= self.still.time >= self.config.stuck_s
            && self.still.speed > self.config.abrupt.0
            && travelled > (TRAVEL * self.config.noise.0).max(LEAST_TRAVEL);
        self.still.stuck
    }

    /// Adds an angle to the recent ones.
    fn keep(&mut self, y: f32) {
        self.since_recent += self.period_s;
        if self.last_good.is_none() {
            self.recent = [y; SPEED_SAMPLES];
        } else if self.since_recent >= SPEED_STEP_S {
            self.since_recent = 0.0;
            self.recent.rotate_right(1);
            if let Some(newest) = self.recent.first_mut() {
                *newest = y;
            }
        }
    }

    /// Mean absolute rate over about the last 20 ms, rad/s.
    fn speed(&self, y: f32) -> f32 {
        let oldest = self.recent.last().copied().unwrap_or(y);
        let steps = (SPEED_SAMPLES - 1) as f32 * SPEED_STEP_S.max(self.period_s);
        (y - oldest).abs() / (steps + self.since_recent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate() -> PlausibilityCheck {
        PlausibilityCheck::new(PlausibilityConfig::default(), Period::MILLISECOND)
    }

    /// A hip that swings at 1 Hz, radians.
    fn swing(tick: u32) -> f32 {
        0.35 * (tick as f32 * 1e-3 * core::f32::consts::TAU).sin()
    }

    /// The first result that is neither good nor bridged, after one second of good samples, and its tick.
    fn first_bad(ticks: u32, sample: impl Fn(u32) -> Option<f32>) -> Option<(u32, Plausibility)> {
        let mut gate = gate();
        for tick in 0..1000 {
            assert_eq!(
                gate.judge(Some(Radians(swing(tick))), swing(tick)),
                Plausibility::Good(swing(tick)),
                "tick {tick}"
            );
        }
        (1000..1000 + ticks).find_map(|tick| {
            let result = gate.judge(sample(tick).map(Radians), swing(tick));
            (!matches!(result, Plausibility::Good(_) | Plausibility::Bridged)).then_some((tick - 1000, result))
        })
    }

    #[test]
    fn each_fault_is_found_in_its_time() {
        assert_eq!(first_bad(5000, |tick| Some(swing(tick))), None);
        for lost in [None, Some(f32::NAN), Some(4.0)] {
            let (at, result) = first_bad(500, |_| lost).unwrap();
            assert!((19..=20).contains(&at) && result == Plausibility::Fault(SensorFault::Missing), "{at}: {result:?}");
        }
        let noisy = |tick: u32| Some(swing(tick) + if tick.is_multiple_of(2) { 0.3 } else { -0.3 });
        let (at, result) = first_bad(500, noisy).unwrap();
        assert!(at < 120 && result == Plausibility::Fault(SensorFault::Erratic), "{at}: {result:?}");
        // The swing is fastest at 0.
        let (at, result) = first_bad(500, |_| Some(0.0)).unwrap();
        assert!((79..=83).contains(&at) && result == Plausibility::Fault(SensorFault::Stuck), "{at}: {result:?}");
    }

    /// A broken wire: the jump is bridged, and the constant angle after it is a fault, although no sample shows the motion.
    #[test]
    fn a_jump_to_a_standstill_is_stuck() {
        let (at, result) = first_bad(500, |_| Some(-0.6)).unwrap();
        assert!(at < 130 && result == Plausibility::Fault(SensorFault::Stuck), "{at}: {result:?}");
    }

    /// A leg that slows down within a tenth of a second and then stands for 20 s is no fault, with noise of 0.001 rad.
    #[test]
    fn a_leg_that_stands_is_no_fault() {
        let stands = |tick: u32| {
            let left = 1.0 - ((tick - 1000) as f32 / 100.0).min(1.0);
            let noise = if tick.is_multiple_of(3) { 0.001 } else { 0.0 };
            Some(0.11 * (1.0 - left * left) + noise)
        };
        assert_eq!(first_bad(20_000, stands), None);
    }

    /// Single spikes are bridged; a stuck sensor stays stuck until its angle changes.
    #[test]
    fn spikes_are_bridged_and_a_stuck_sensor_stays_stuck() {
        let mut gate = gate();
        for tick in 0..5000u32 {
            let spike = tick > 0 && tick % 50 == 0;
            let result = gate.judge(Some(Radians(swing(tick) + if spike { 0.7 } else { 0.0 })), swing(tick));
            assert_eq!(
                result,
                if spike { Plausibility::Bridged } else { Plausibility::Good(swing(tick)) },
                "tick {tick}"
            );
        }
        let last = swing(4999);
        let results: Vec<Plausibility> =
            (5000..9000).map(|tick| gate.judge(Some(Radians(last)), swing(tick))).collect();
        assert!(results[100..].iter().all(|&result| result == Plausibility::Fault(SensorFault::Stuck)));
        assert_eq!(gate.judge(Some(Radians(last + 0.01)), last), Plausibility::Good(last + 0.01));
    }
}
