//! Decides for every sample of the sensor whether it is plausible, and names the fault if it is not.
//!
//! | fault | rule | found after |
//! |---|---|---|
//! | missing | flagged invalid, not a number, or beyond ±200 degrees, for longer than the bridge | the bridge |
//! | erratic | steps that no joint can make, in more than a third of the last 0.1 s | 0.04 to 0.11 s if all are |
//! | stuck | no step beyond the noise for a while, the rate before having ended at once, and the template having moved on | 0.08 s |
//! | amplitude | the fundamental is more than so many times the template's | the filter's settling |
//! | innovation | its mean square exceeds a part of the amplitude's | 0.2 to 0.4 s |
//!
//! A leg that stands still is no fault: it slows down before it stands, within what muscles can do, whereas a sensor that
//! sticks or a wire that breaks ends a movement from one tick to the next. So `stuck` asks how fast the joint was just before.
//! Single bad samples are bridged: the estimator goes on for them by itself.

use joint_units::{Period, RadPerSec, Radians};

use crate::error::in_range;
use crate::{BuildError, Field};

/// Limits of what is plausible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlausibilityConfig {
    /// Fastest that a joint moves; 5 to 100 rad/s. Running knees reach 16.
    pub fastest: RadPerSec,
    /// Peak noise of a sound sensor, quantisation included; 0 to 0.1 rad.
    pub noise: Radians,
    /// How long samples may be bad before that is a fault, s; 0 to 0.2.
    pub bridge_s: f32,
    /// How long a sensor must not move to be stuck, s; 0.02 to 1.
    pub stuck_s: f32,
    /// Rate that no leg loses within a few hundredths of a second; 0.1 to 10 rad/s.
    pub abrupt: RadPerSec,
    /// Least and largest amplitude relative to the template: below, the person stands; above, the sensor is at fault. 0.05 to 1, 1 to 10.
    pub amplitude: (f32, f32),
    /// Largest root mean square innovation relative to the amplitude; 0.1 to 2.
    pub innovation: f32,
}

impl Default for PlausibilityConfig {
    /// 25 rad/s, 0.15 degrees (two codes of 12 bits), a bridge of 20 ms, stuck after 80 ms, abrupt from 60 degrees/s, amplitudes of 0.45 to
    /// 2.2, innovation of 0.55.
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
    /// Checks the limits.
    ///
    /// # Errors
    /// Names the field that is out of range.
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

/// What is wrong with the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SensorFault {
    /// No valid samples.
    Missing,
    /// Steps that no joint can make.
    Erratic,
    /// It stopped from one tick to the next.
    Stuck,
    /// The amplitude is far above the template's.
    Amplitude,
    /// The signal is not the joint's waveform.
    Innovation,
}

impl SensorFault {
    /// Every fault.
    pub const ALL: [Self; 5] = [Self::Missing, Self::Erratic, Self::Stuck, Self::Amplitude, Self::Innovation];

    /// A word for people.
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

/// What a sample is good for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Plausibility {
    /// To be used.
    Good(f32),
    /// To be done without.
    Bridged,
    /// Not to be used, nor those after it until they have been good for a while.
    Fault(SensorFault),
}

/// Largest plausible angle, rad: 200 degrees.
const LARGEST_ANGLE: f32 = 3.5;
/// Time constant of the share of erratic samples, s, and the share that is a fault.
const ERRATIC_S: f32 = 0.1;
const ERRATIC_SHARE: f32 = 0.35;
/// Time over which the rate before a halt is taken, in samples of it.
const SPEED_SAMPLES: usize = 6;
const SPEED_STEP_S: f32 = 0.004;
/// How far the template must have moved on for a halt to count as stuck, as a multiple of the noise; at least [`LEAST_TRAVEL`].
const TRAVEL: f32 = 8.0;
/// 1.2 degrees.
const LEAST_TRAVEL: f32 = 0.021;

/// The check and its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlausibilityCheck {
    config: PlausibilityConfig,
    period_s: f32,
    last_good: Option<f32>,
    bad_for: f32,
    erratic: f32,
    /// Where the sensor last left the band of the noise: angle, the prediction then, its rate before.
    still: Still,
    /// Recent angles, `SPEED_STEP_S` apart, the newest first.
    recent: [f32; SPEED_SAMPLES],
    since_recent: f32,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Still {
    angle: f32,
    predicted: f32,
    speed: f32,
    time: f32,
    /// It was found stuck; that holds until it moves.
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

    /// One tick: the sample, and the predicted angle for it.
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

    /// Mean rate over the last 20 ms or so.
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

    /// The first result that is not good after a sound second, and its tick.
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
        // Zero is where it swings fastest.
        let (at, result) = first_bad(500, |_| Some(0.0)).unwrap();
        assert!((79..=83).contains(&at) && result == Plausibility::Fault(SensorFault::Stuck), "{at}: {result:?}");
    }

    /// A wire that breaks: the jump is bridged, and the standstill after it is a fault although no speed was seen in the samples.
    #[test]
    fn a_jump_to_a_standstill_is_stuck() {
        let (at, result) = first_bad(500, |_| Some(-0.6)).unwrap();
        assert!(at < 130 && result == Plausibility::Fault(SensorFault::Stuck), "{at}: {result:?}");
    }

    /// A leg that slows down within a tenth of a second and stands is no fault, for however long, with 12 bits of noise on it.
    #[test]
    fn a_leg_that_stands_is_no_fault() {
        let stands = |tick: u32| {
            let left = 1.0 - ((tick - 1000) as f32 / 100.0).min(1.0);
            let noise = if tick.is_multiple_of(3) { 0.001 } else { 0.0 };
            Some(0.11 * (1.0 - left * left) + noise)
        };
        assert_eq!(first_bad(20_000, stands), None);
    }

    /// Spikes are left out one by one; a sensor that was stuck stays so until it moves.
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
