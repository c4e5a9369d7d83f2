//! Kuo's pendulum against its closed form, and what noise and a lost sensor do to each kind of control.

#[path = "../examples/kuo.rs"]
mod example;

use cpg_core::oscillator::kuo::{Cycle, Drive, Kuo, KuoConfig, Measurement, Pendulum};
use example::{DAMPING, Gauss, Noise, Peaks, Sensor, TICK, hybrid, trial};
use proptest::prelude::*;

/// Of the runs with noise: about 8400 peaks each, neighbours correlated by 0.5, so a standard deviation is known within 1.4 percent.
const TIME: f64 = 20_000.0;
const SEEDS: [u64; 2] = [11, 12];
const BOTH: Noise = Noise { process: 0.05, sensor: 0.02 };
const QUIET: Noise = Noise { process: 0.0, sensor: 0.0 };

fn limb() -> Pendulum<f64> {
    Pendulum::new(DAMPING).unwrap()
}

fn control(drive: Drive<f64>, tick: f64) -> Kuo<f64> {
    KuoConfig { damping: DAMPING, amplitude: 1.0, drive }.build(tick).unwrap()
}

/// Angle and rate after `t`, in closed form.
fn free(state: [f64; 2], z: f64, t: f64) -> [f64; 2] {
    let w = (1.0 - z * z).sqrt();
    let (a, b) = (state[0], (state[1] + z * state[0]) / w);
    let (s, c) = (w * t).sin_cos();
    let fade = (-z * t).exp();
    [fade * (a * c + b * s), fade * ((b * w - z * a) * c - (a * w + z * b) * s)]
}

fn mean_over_seeds(drive: Drive<f64>, noise: Noise, sensor: Sensor) -> Peaks {
    let runs = SEEDS.map(|seed| trial(drive, noise, sensor, seed, TIME));
    let n = SEEDS.len() as f64;
    Peaks {
        mean: runs.iter().map(|run| run.mean).sum::<f64>() / n,
        deviation: runs.iter().map(|run| run.deviation).sum::<f64>() / n,
        count: runs.iter().map(|run| run.count).sum(),
        last: runs.iter().map(|run| run.last).fold(0.0, f64::max),
    }
}

#[test]
fn impulse_and_period_are_the_closed_form() {
    let Cycle { impulse, half_period } = limb().cycle(1.0);
    assert!((impulse - 0.887_899_49).abs() < 6e-9, "{impulse}");
    assert!((half_period - 2.383_610_05).abs() < 6e-9, "{half_period}");
    assert!((2.0 * half_period - 4.767_220_10).abs() < 6e-9);
    let single = Pendulum::<f32>::new(0.1).unwrap().cycle(1.0);
    assert!((single.impulse - 0.887_899_5).abs() < 2e-5, "{single:?}");
}

proptest! {
    /// After an impulse at an extreme, the closed form is at rest at the other after the half period.
    #[test]
    fn the_cycle_closes(z in 0.01f64..0.5, amplitude in 0.01f64..10.0) {
        let Cycle { impulse, half_period } = Pendulum::new(z).unwrap().cycle(amplitude);
        let [angle, rate] = free([amplitude, -impulse], z, half_period);
        prop_assert!((angle + amplitude).abs() < 1e-8 * amplitude, "{angle}");
        prop_assert!(rate.abs() < 1e-8 * amplitude, "{rate}");
    }

    /// No configuration of finite or other numbers panics, and what is built stays finite whatever the sensor says.
    #[test]
    fn any_measurement_leaves_a_finite_estimate(
        z in 0.01f32..0.5, l1 in 0.0f32..10.0, l2 in 0.0f32..10.0,
        angles in prop::collection::vec(prop_oneof![4 => -2.0f32..2.0, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)], 200),
    ) {
        for drive in [Drive::FeedForward, Drive::Feedback, Drive::Hybrid { gain: [l1, l2] }] {
            let mut control = KuoConfig { damping: z, amplitude: 1.0, drive }.build(0.05f32).unwrap();
            for &angle in &angles {
                let kick = control.step(&Measurement { angle, rate: -angle, valid: true });
                prop_assert!(control.estimate().iter().all(|x| x.is_finite() && x.abs() < 1e3));
                prop_assert!(kick.is_none_or(|kick| (0.0..=0.05).contains(&kick.at)));
            }
        }
    }
}

/// Feedback from a perfect sensor, started at amplitude 0.3: the return map, and its slope at the fixed point.
#[test]
fn return_map() {
    let mut control = control(Drive::Feedback, TICK);
    let limb = limb();
    let mut state = [0.3, 1e-12];
    let mut extremes = Vec::new();
    while extremes.len() < 13 {
        let kick = control.step(&Measurement { angle: state[0], rate: state[1], valid: true });
        if let Some(kick) = &kick {
            let mut extreme = state;
            limb.advance(&mut extreme, kick.at, None);
            extremes.push(extreme[0].abs());
        }
        limb.advance(&mut state, TICK, kick.as_ref());
    }
    println!("{extremes:?}");
    let map = [0.3, 0.757_61, 0.886_579, 0.944_181, 0.971_99, 0.985_82, 0.992_791];
    for (extreme, wanted) in extremes.iter().zip(map) {
        assert!((extreme - wanted).abs() < 1e-5, "{extreme} for {wanted}");
    }
    // The slope of the map is .5095 there, and in the limit that of the closed form: how a start further out ends further out.
    let slope = |n: usize| (1.0 - extremes[n + 1]) / (1.0 - extremes[n]);
    let half = limb.cycle(1.0).half_period;
    let limit = -free([1.0, 0.0], DAMPING, half)[0];
    assert!((slope(6) - 0.5095).abs() < 1e-4, "{}", slope(6));
    assert!((slope(11) - limit).abs() < 2e-4, "{} {limit}", slope(11));
}

#[test]
fn undriven_decay() {
    let limb = limb();
    let mut state = [1.0, 0.0];
    // Half a damped cycle: pi / sqrt(1 - z^2).
    let half = 3.157_419_42;
    for _ in 0..1000 {
        limb.advance(&mut state, half / 1000.0, None);
    }
    assert!((state[0] + 0.729_247_61).abs() < 1e-8 && state[1].abs() < 1e-8, "{state:?}");
}

/// Every drive, without noise, keeps amplitude 1 and the period over 1000 half cycles, also in f32.
#[test]
fn every_drive_holds_the_cycle() {
    fn hold<T: cpg_core::Scalar>(drive: Drive<T>, tick: f32, tolerance: f32) {
        let limb = Pendulum::new(T::from_f32(0.1)).unwrap();
        let config = KuoConfig { damping: T::from_f32(0.1), amplitude: T::ONE, drive };
        let dt = T::from_f32(tick);
        let mut control = config.build(dt).unwrap();
        let mut state = control.estimate();
        let (mut first, mut last, mut kicks, mut peak) = (None, 0.0, 0, 0.0f32);
        for n in 0..(2390.0 / tick) as u32 {
            let kick = control.step(&Measurement { angle: state[0], rate: state[1], valid: true });
            limb.advance(&mut state, dt, kick.as_ref());
            if let Some(kick) = kick {
                last = f64::from(n) * f64::from(tick) + f64::from(kick.at.to_f32());
                first = first.or(Some(last));
                kicks += 1;
            }
            peak = if n > 1000 { peak.max(state[0].to_f32().abs()) } else { 0.0 };
        }
        let period = (last - first.unwrap()) / f64::from(kicks - 1);
        assert!((period - 2.383_610_05).abs() < f64::from(tolerance), "{period}");
        assert!((peak - 1.0).abs() < tolerance + tick * tick, "{peak}");
    }
    for tick in [0.01, 0.05] {
        let single = [Drive::FeedForward, Drive::Feedback, Drive::Hybrid { gain: [1.0f32, 1.0] }];
        single.into_iter().for_each(|drive| hold(drive, tick, 2e-4));
    }
    for drive in [Drive::FeedForward, Drive::Feedback, Drive::Hybrid { gain: [1.0f64, 1.0] }] {
        hold(drive, 0.01, 1e-6);
    }
}

/// Each cell within 8 percent of the table's standard deviation and 0.03 of its mean.
#[test]
fn noise_rows() {
    let rows = [
        ("feed-forward", Drive::FeedForward, 0.02, 1.001, 0.082),
        ("feedback, perfect sensor", Drive::Feedback, 0.0, 1.02, 0.064),
        ("L = 0.2", hybrid(0.2), 0.02, 1.0, 0.075),
        ("L = 1", hybrid(1.0), 0.02, 1.0, 0.069),
        ("L = 3", hybrid(3.0), 0.02, 1.0, 0.066),
        ("L = (10, 30)", Drive::Hybrid { gain: [10.0, 30.0] }, 0.02, 0.87, 0.106),
    ];
    for (name, drive, sensor, mean, deviation) in rows {
        let peaks = mean_over_seeds(drive, Noise { process: 0.05, sensor }, Sensor::Good);
        println!("{name}: {:.3} +- {:.4} for {mean} +- {deviation}", peaks.mean, peaks.deviation);
        assert!((peaks.mean - mean).abs() < 0.03, "{name}: {peaks:?}");
        assert!((peaks.deviation / deviation - 1.0).abs() < 0.08, "{name}: {peaks:?}");
        assert!(peaks.count > 16_000, "{name}: {peaks:?}");
    }
}

/// A noisy sensor alone triggers falsely: the peaks fall to about 0.6 and scatter over more than 0.2.
#[test]
fn noise_breaks_pure_feedback() {
    let peaks = mean_over_seeds(Drive::Feedback, BOTH, Sensor::Good);
    assert!((peaks.mean - 0.60).abs() < 0.06 && peaks.deviation > 0.2, "{peaks:?}");
}

/// With noise on both sides the best gain is neither the smallest nor the largest: the same noise for each gain.
#[test]
fn the_best_gain_is_inside() {
    let deviation = |gain| mean_over_seeds(hybrid(gain), BOTH, Sensor::Good).deviation;
    let [clock, low, best, high] = [0.0, 0.2, 3.0, 50.0].map(deviation);
    println!("{clock:.4} {low:.4} {best:.4} {high:.4}");
    // Each gap is more than five times the 0.001 that such a deviation is known to, the smallest one (clock to 0.2) at least twice.
    assert!(best < 0.9 * low && low < 0.97 * clock && best < 0.9 * high, "{clock} {low} {best} {high}");
}

#[test]
fn a_clock_needs_no_sensor() {
    let with = trial(Drive::FeedForward, BOTH, Sensor::Good, 3, 2000.0);
    let (dead, flagged) = (
        trial(Drive::FeedForward, QUIET, Sensor::Dead, 3, 2000.0),
        trial(Drive::FeedForward, QUIET, Sensor::Flagged, 3, 2000.0),
    );
    assert!((dead.mean - 1.0).abs() < 1e-4 && dead == flagged && (with.mean - 1.0).abs() < 0.02, "{with:?} {dead:?}");
}

/// Undriven, the limb is below 1e-4 after 100 time units.
#[test]
fn pure_feedback_stops_with_its_sensor() {
    for sensor in [Sensor::Dead, Sensor::Flagged] {
        let peaks = trial(Drive::Feedback, QUIET, sensor, 1, 2000.0);
        assert!(peaks.last < 1e-12, "{peaks:?}");
    }
}

/// Why the flag is mandatory: believed, the dead sensor takes 43 percent of the amplitude; flagged, nothing.
#[test]
fn a_dead_sensor_must_be_flagged() {
    let believed = mean_over_seeds(hybrid(0.5), BOTH, Sensor::Dead);
    let flagged = mean_over_seeds(hybrid(0.5), BOTH, Sensor::Flagged);
    assert!((believed.mean - 0.57).abs() < 0.02, "{believed:?}");
    assert!((flagged.mean - 1.005).abs() < 0.02, "{flagged:?}");
    // Not a number counts as flagged, whatever the flag says.
    let mut control = control(hybrid(0.5), TICK);
    let mut other = control;
    for _ in 0..1000 {
        control.step(&Measurement { angle: f64::NAN, rate: 0.0, valid: true });
        other.step(&Measurement { angle: 0.0, rate: 0.0, valid: false });
    }
    assert_eq!(control, other);
}

/// After a fault of 50 time units the observer finds a disturbed limb again.
#[test]
fn the_observer_recovers_when_the_sensor_returns() {
    let mut control = control(hybrid(1.0), TICK);
    let limb = limb();
    let mut state = [-0.2, 0.6];
    for n in 0..20_000 {
        let valid = n > 5000;
        let kick = control.step(&Measurement { angle: state[0], rate: state[1], valid });
        limb.advance(&mut state, TICK, kick.as_ref());
    }
    let [angle, rate] = control.estimate();
    assert!((angle - state[0]).abs() < 1e-9 && (rate - state[1]).abs() < 1e-9, "{state:?} {angle} {rate}");
    control.reset();
    assert_eq!(control.estimate(), [1.0, -control.impulse()]);
}

#[test]
fn bad_fields_are_named() {
    let good = KuoConfig { damping: 0.1f32, amplitude: 1.0, drive: Drive::Hybrid { gain: [1.0, 1.0] } };
    let refused = |config: KuoConfig, dt: f32| config.build(dt).unwrap_err().to_string();
    assert!(refused(KuoConfig { damping: 0.0, ..good }, 0.01).contains("damping"));
    assert!(refused(KuoConfig { damping: f32::NAN, ..good }, 0.01).contains("damping"));
    assert!(refused(KuoConfig { amplitude: -1.0, ..good }, 0.01).contains("amplitude"));
    assert!(refused(KuoConfig { drive: Drive::Hybrid { gain: [1.0, -1.0] }, ..good }, 0.01).contains("gain[1]"));
    assert!(refused(KuoConfig { drive: Drive::Hybrid { gain: [60.0, 1.0] }, ..good }, 0.01).contains("gain[0]"));
    assert!(refused(good, 0.1).contains("dt"));
}

#[test]
fn the_noise_is_gaussian() {
    let mut gauss = Gauss(5);
    let (mut sum, mut squares, mut fourth) = (0.0, 0.0, 0.0);
    let n = 200_000;
    for _ in 0..n {
        let x = gauss.next();
        (sum, squares, fourth) = (sum + x, squares + x * x, fourth + x.powi(4));
    }
    let n = f64::from(n);
    assert!((sum / n).abs() < 0.01 && (squares / n - 1.0).abs() < 0.015 && (fourth / n - 3.0).abs() < 0.15);
}
