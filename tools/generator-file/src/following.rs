//! How a follower locks on a simulated person: the core itself at 1 ms; the person's angle is the template of the sensor's joint.
//!
//! | question | how it is measured |
//! |---|---|
//! | lock time | the person walks at the template's cadence, from [`PHASES`] start phases; the follower's first estimate of the cadence is off by [`MISMATCHES`]; time until it is locked and the estimate stays within [`WITHIN_DEG`] and [`WITHIN_CADENCE`] |
//! | false locks | starts whose status is locked for a second while the phase is off by [`WITHIN_DEG`] or more |
//! | lock range | cadence of the person, from the template's outwards in steps of [`RANGE_STEP`], as long as every start phase locks within [`SOON_S`] seconds (fewer strides at a lower cadence); it ends at the limits of the estimator |
//! | steady phase error | standard deviation of the error of the driven phase over [`STEADY_STRIDES`] strides whose times vary by [`STRIDE_SD`] |
//!
//! The angle has normal noise of [`NOISE_DEG`]. Each start begins with a new follower.

use std::f64::consts::TAU;

use cpg_core::entrainment::phase_lock::Template;
use cpg_core::entrainment::{Follower, Lock};
use cpg_core::{BuildError, Follow, Generator};
use joint_loop::FollowConfig;
use joint_units::Period;
use serde::Serialize;

use crate::led::SimulatedPerson;

/// Start phases.
pub const PHASES: u32 = 12;
/// Errors of the follower's first estimate of the cadence, divided by the person's cadence.
pub const MISMATCHES: [f64; 9] = [-0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4];
/// Largest phase error of a lock, degrees.
pub const WITHIN_DEG: f64 = 18.0;
/// Largest relative error of the cadence of a lock.
pub const WITHIN_CADENCE: f64 = 0.03;
/// Every start has to lock within this time, seconds.
pub const SOON_S: f64 = 4.0;
/// Duration of a start, seconds.
const WATCHED_S: f64 = 6.0;
/// Time for which a lock at the edge of the range has to last, seconds.
const LASTS_S: f64 = 1.0;
/// Step of the lock range, divided by the template's cadence.
pub const RANGE_STEP: f64 = 0.05;
/// Strides over which the steady phase error is measured.
pub const STEADY_STRIDES: f64 = 40.0;
/// Standard deviation of the stride times meanwhile, relative: that of recorded persons.
pub const STRIDE_SD: f64 = 0.015;
pub use crate::led::NOISE_DEG;

/// Measurements of a follower on a simulated person.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Following {
    /// Joint of the sensor.
    pub sensor: &'static str,
    /// Source of stride events beside the angle; the simulated person has no heel strikes.
    pub events: &'static str,
    /// Starts that were tried: phases times mismatches.
    pub starts: u32,
    /// Starts that did not lock within [`SOON_S`].
    pub late: u32,
    /// Start phase in cycles and mismatch of the first late start.
    pub first_late: Option<[f64; 2]>,
    /// Median of the lock times, seconds; none if half of them never lock.
    pub lock_median_s: Option<f64>,
    /// The longest lock time, seconds; none if one start never locks.
    pub lock_worst_s: Option<f64>,
    /// Starts with a false lock.
    pub false_locks: u32,
    /// Lowest and highest cadence, divided by the template's, up to which every start phase locks; none if not even the template's does.
    pub lock_range: Option<[f64; 2]>,
    /// Limits of the estimator, divided by the template's cadence: the largest possible lock range.
    pub clamped_to: [f64; 2],
    /// Standard deviation of the steady phase error, degrees of the stride; none if it does not stay locked.
    pub phase_sd_deg: Option<f64>,
}

impl Following {
    /// Why the follower is refused; none if it is accepted.
    #[must_use]
    pub fn refused_because(&self) -> Option<String> {
        if let Some([phase, mismatch]) = self.first_late {
            return Some(format!(
                "{} of {} starts are not locked after {SOON_S} s, the first from phase {phase:.3} with the cadence off by {:+.0} %",
                self.late,
                self.starts,
                100.0 * mismatch
            ));
        }
        (self.false_locks > 0)
            .then(|| format!("{} of {} starts lock on another phase than the person's", self.false_locks, self.starts))
    }

    /// The rows of a table for people: name and text.
    #[must_use]
    pub fn in_words(&self) -> [(&'static str, String); 3] {
        let time = |time: Option<f64>| time.map_or("never".into(), |s| format!("{s:.2} s"));
        let [low, high] = self.clamped_to;
        let lock = format!(
            "{} median, {} worst of {} starts, {} false; events: {}",
            time(self.lock_median_s),
            time(self.lock_worst_s),
            self.starts,
            self.false_locks,
            self.events
        );
        let range = self.lock_range.map_or("none: not even at its own cadence".into(), |[from, to]| {
            format!("{from:.2} to {to:.2} of its own cadence within {SOON_S} s; clamped to {low:.2} to {high:.2}")
        });
        let steady = self.phase_sd_deg.map_or("it does not stay locked".into(), |sd| {
            format!("{sd:.2} deg sd, with stride times that vary by {:.1} %", 100.0 * STRIDE_SD)
        });
        [("lock on a person", lock), ("lock range", range), ("steady phase error", steady)]
    }
}

/// The result of a start.
struct Start {
    /// Lock time, seconds.
    locked_s: Option<f64>,
    /// Whether there was a false lock.
    falsely: bool,
}

impl Start {
    /// Runs a follower on a person for `watched_s` seconds, or until a lock has lasted for `lasts_s` seconds.
    fn of(mut follower: Follower, mut person: SimulatedPerson, watched_s: f64, lasts_s: f64) -> Self {
        let cadence = TAU * 1e3 * person.rate;
        let (mut last_bad, mut wrong_for, mut falsely) = (0, 0, false);
        let (ticks, lasts) = ((watched_s * 1e3) as u32, (lasts_s * 1e3) as u32);
        for tick in 1..=ticks {
            follower.observe(Some(person.tick()));
            follower.step();
            let lock = follower.phase_lock();
            let off = person.off(lock.phase()).abs() >= WITHIN_DEG;
            let locked = follower.status().state == Lock::Locked;
            wrong_for = if off && locked { wrong_for + 1 } else { 0 };
            falsely |= wrong_for >= 1000;
            if off || !locked || (f64::from(lock.frequency().0) / cadence - 1.0).abs() >= WITHIN_CADENCE {
                last_bad = tick;
            } else if tick - last_bad >= lasts {
                break;
            }
        }
        Self { locked_s: (last_bad < ticks).then_some(f64::from(last_bad) / 1e3), falsely }
    }

    fn is_soon(&self) -> bool {
        self.locked_s.is_some_and(|locked| locked <= SOON_S)
    }
}

fn phases() -> impl Iterator<Item = f64> {
    (0..PHASES).map(|n| f64::from(n) / f64::from(PHASES))
}

struct Bench {
    config: FollowConfig,
    shapes: [Template; 4],
    stride_s: f64,
}

impl Bench {
    /// A follower whose first estimate of the stride is `stride_s`.
    fn follower_of(&self, stride_s: f64) -> Result<Follower, BuildError> {
        let mut config = self.config.entrained();
        config.lock.stride_s = stride_s as f32;
        config.build(self.shapes, self.config.sensor, Period::MILLISECOND)
    }

    fn simulated_person(&self, phase: f64, stride_s: f64) -> SimulatedPerson {
        SimulatedPerson::new(self.shapes[self.config.sensor as usize], phase, stride_s)
    }

    /// Whether every start phase locks soon if the person's cadence is `ratio` times the template's.
    fn locks(&self, follower: &Follower, ratio: f64) -> bool {
        phases().all(|phase| {
            let start =
                Start::of(*follower, self.simulated_person(phase, self.stride_s / ratio), SOON_S + LASTS_S, LASTS_S);
            start.is_soon() && !start.falsely
        })
    }

    /// The outermost step towards `limit` that locks.
    fn edge(&self, follower: &Follower, limit: f64) -> f64 {
        let step = if limit > 1.0 { RANGE_STEP } else { -RANGE_STEP };
        let steps = ((limit - 1.0) / step + 1e-3) as u32;
        // Rounded to the step: 0.85, not 0.8500000001.
        let ratio = |n: u32| (100.0 * (1.0 + step * f64::from(n))).round() / 100.0;
        (1..=steps).map(ratio).take_while(|&ratio| self.locks(follower, ratio)).last().unwrap_or(1.0)
    }

    fn steady(&self, mut follower: Follower) -> Option<f64> {
        let mut person = self.simulated_person(0.0, self.stride_s);
        let mut errors = vec![];
        let settled = WATCHED_S * 1e3;
        let mut tick = 0.0;
        while person.cycles < STEADY_STRIDES + settled * 1e-3 / self.stride_s {
            let before = person.cycles.floor();
            follower.observe(Some(person.tick()));
            follower.step();
            if person.cycles.floor() > before {
                let varied = (1.0 + STRIDE_SD * person.random.normal()).clamp(0.9, 1.1);
                person.rate = 1e-3 / (self.stride_s * varied);
            }
            tick += 1.0;
            if tick > settled {
                if follower.status().state != Lock::Locked {
                    return None;
                }
                errors.push(person.off(follower.phase()));
            }
        }
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        Some((errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / count).sqrt())
    }
}

/// Measures a follower.
///
/// # Errors
/// It cannot be built; the text says why.
pub fn following(config: &FollowConfig) -> Result<Following, String> {
    let words = |error: BuildError| error.to_string();
    let bench = Bench {
        config: *config,
        shapes: config.shape.shapes().map_err(words)?,
        stride_s: f64::from(config.shape.stride_s),
    };
    let follower = bench.follower_of(bench.stride_s).map_err(words)?;

    let mut times = vec![];
    let (mut late, mut first_late, mut false_locks) = (0, None, 0);
    for mismatch in MISMATCHES {
        // A stride out of the estimator's range is left out.
        let Ok(follower) = bench.follower_of(bench.stride_s / (1.0 + mismatch)) else { continue };
        for phase in phases() {
            let start = Start::of(follower, bench.simulated_person(phase, bench.stride_s), WATCHED_S, WATCHED_S);
            if !start.is_soon() {
                late += 1;
                first_late = first_late.or(Some([phase, mismatch]));
            }
            false_locks += u32::from(start.falsely);
            times.push(start.locked_s.unwrap_or(f64::INFINITY));
        }
    }
    times.sort_by(f64::total_cmp);
    let finite = |time: Option<&f64>| time.copied().filter(|time| time.is_finite());
    // Rounded: 0.3, not the nearest f32.
    let range = config.entrained().lock.frequency_range;
    let [low, high] = [range.0, range.1].map(|factor| (1e3 * f64::from(factor)).round() / 1e3);
    Ok(Following {
        sensor: config.sensor.name(),
        events: config.events.name(),
        starts: times.len() as u32,
        late,
        first_late,
        lock_median_s: finite(times.get(times.len() / 2)),
        lock_worst_s: finite(times.last()),
        false_locks,
        lock_range: bench.locks(&follower, 1.0).then(|| [bench.edge(&follower, low), bench.edge(&follower, high)]),
        clamped_to: [low, high],
        phase_sd_deg: bench.steady(follower),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::entrainment::{Corrections, EventSource};
    use cpg_core::waveform::shape::Shape as _;
    use joint_loop::{SERIES_HARMONICS, SeriesConfig, ShapeConfig};
    use joint_units::{Joint, Radians};

    /// Amplitudes of the first harmonics in degrees, hips and knees half a stride apart.
    fn config(sensor: Joint, hip: [f32; 3], knee: [f32; 3]) -> FollowConfig {
        let series = |mean: f32, amplitudes: [f32; 3], lead: f32| {
            let (mut cos, mut sin) = ([0.0; SERIES_HARMONICS], [0.0; SERIES_HARMONICS]);
            for (n, amplitude) in amplitudes.into_iter().enumerate() {
                let (s, c) = (std::f32::consts::TAU * lead * (n + 1) as f32).sin_cos();
                (cos[n], sin[n]) = ((amplitude * c).to_radians(), (-amplitude * s).to_radians());
            }
            SeriesConfig { mean: Radians::from_degrees(mean), cos, sin }
        };
        let joints = [series(5.0, hip, 0.0), series(5.0, hip, 0.5), series(24.0, knee, 0.25), series(24.0, knee, 0.75)];
        FollowConfig {
            sensor,
            events: EventSource::None,
            shape: ShapeConfig { stride_s: 1.1, joints },
            corrections: Corrections::NONE,
        }
    }

    const HIP: [f32; 3] = [20.0, -4.5, 0.8];
    const KNEE: [f32; 3] = [18.0, -10.0, 3.0];

    /// A hip locks from every start; the report agrees with single starts.
    #[test]
    fn a_hip_locks_from_every_start_and_over_a_range() {
        let config = config(Joint::RightHip, HIP, KNEE);
        let got = following(&config).unwrap();
        assert_eq!((got.starts, got.late, got.false_locks, got.refused_because()), (108, 0, 0, None));
        let (median, worst) = (got.lock_median_s.unwrap(), got.lock_worst_s.unwrap());
        assert!((1.0..2.5).contains(&median) && (median..=SOON_S).contains(&worst), "{got:?}");
        let [low, high] = got.lock_range.unwrap();
        assert!((0.5..=0.9).contains(&low) && (1.4..=2.5).contains(&high) && got.clamped_to == [0.3, 2.5], "{got:?}");
        // Stride times that vary by 5.4 degrees of a stride cause a smaller phase error, but not none.
        assert!(got.phase_sd_deg.is_some_and(|sd| (0.3..3.0).contains(&sd)), "{got:?}");

        let bench = Bench { config, shapes: config.shape.shapes().unwrap(), stride_s: 1.1 };
        let follower = bench.follower_of(1.1).unwrap();
        assert!(bench.locks(&follower, low) && !bench.locks(&follower, low - RANGE_STEP), "{got:?}");
        let alone = Start::of(follower, bench.simulated_person(0.25, 1.1), 20.0, 20.0).locked_s.unwrap();
        assert!(alone <= worst, "{alone} s");
    }

    /// A waveform with two nearly equal waves a stride locks only by chance: refused, with the reason.
    #[test]
    fn a_waveform_that_cannot_be_locked_on_is_refused() {
        let got = following(&config(Joint::LeftHip, [1.0, 20.0, 0.0], KNEE)).unwrap();
        assert!(got.late > 50 && got.lock_range.is_none(), "{got:?}");
        let because = got.refused_because().unwrap();
        assert!(because.contains("of 108 starts are not locked after 4 s, the first from phase 0."), "{because}");
        assert!(because.ends_with(" %"), "{because}");
    }

    /// While it locks, from any start, a follower is between its stand and its template: no joint leaves the range of the two, and no sum or difference of
    /// two joints theirs. So a limit of range or pose that the template keeps is kept; rates are higher while it catches up.
    #[test]
    fn a_lock_keeps_to_the_ranges_and_poses_of_stand_and_template() {
        let config = config(Joint::LeftHip, HIP, KNEE);
        let bench = Bench { config, shapes: config.shape.shapes().unwrap(), stride_s: 1.1 };
        // Angles, sums and differences of a pose, degrees.
        let values = |angles: [Radians; 4]| -> Vec<f64> {
            let angle = angles.map(|angle| f64::from(angle.degrees()));
            let pairs = (0..4).flat_map(|a| (0..4).filter(move |b| *b != a).map(move |b| (a, b)));
            let combined = pairs.flat_map(|(a, b)| [angle[a] + angle[b], angle[a] - angle[b]]);
            angle.into_iter().chain(combined).collect()
        };
        let stand = bench.follower_of(1.1).unwrap().angles();
        let (mut least, mut most) = (values(stand), values(stand));
        let mut widen = |found: Vec<f64>| {
            for ((least, most), value) in least.iter_mut().zip(&mut most).zip(found) {
                (*least, *most) = (least.min(value), most.max(value));
            }
        };
        for k in 0..4000 {
            let phase = joint_units::Phase::from_cycles(k as f32 / 4000.0);
            widen(values(bench.shapes.each_ref().map(|shape| Radians(shape.at(phase).angle))));
        }
        let (mut furthest, mut fastest) = (0.0f64, 0.0f32);
        for mismatch in MISMATCHES {
            for phase in phases() {
                let mut follower = bench.follower_of(1.1 / (1.0 + mismatch)).unwrap();
                let mut person = bench.simulated_person(phase, 1.1);
                for _ in 0..6000 {
                    follower.observe(Some(person.tick()));
                    follower.step();
                    for ((value, least), most) in values(follower.angles()).into_iter().zip(&least).zip(&most) {
                        furthest = furthest.max(value - most).max(least - value);
                    }
                    fastest = follower.rates().iter().fold(fastest, |most, rate| most.max(rate.0.abs().to_degrees()));
                }
            }
        }
        println!("furthest beyond {furthest:.3} degrees, fastest {fastest:.0} deg/s");
        assert!(furthest < 0.1, "{furthest} degrees");
    }

    /// A joint that hardly moves is refused before anything is measured.
    #[test]
    fn a_joint_that_hardly_moves_is_refused_by_name() {
        let error = following(&config(Joint::LeftKnee, HIP, [0.4, 0.1, 0.0])).unwrap_err();
        assert!(error.contains("template.fundamental"), "{error}");
    }
}
