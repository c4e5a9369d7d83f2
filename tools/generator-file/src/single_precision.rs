//! Measurements of a generator in `f32`, as the board runs it: peaks against the gate's limits, and the longest control period.

use cpg_core::Generator;
use joint_loop::LoopConfig;
use joint_units::{Joint, Period};
use serde::Serialize;

use crate::file::GeneratorSet;
use crate::following::Led;

/// Amplitude and peaks of a joint.
#[derive(Debug, Clone, Serialize)]
pub struct JointPeaks {
    /// `left_hip`, `right_hip`, `left_knee` or `right_knee`.
    pub name: &'static str,
    /// Half the difference of the extremes, degrees.
    pub amplitude_deg: f64,
    /// Largest rate, degrees per second.
    pub peak_velocity_deg_s: f64,
    /// Largest acceleration, degrees per second squared.
    pub peak_acceleration_deg_s2: f64,
    /// Whether neither peak is above the gate's limit.
    pub inside_gate: bool,
}

/// Longest control period in milliseconds at which the stride period is right within 1 percent; resolution 0.1 ms.
pub(crate) fn largest_step(set: &GeneratorSet, period_s: f64) -> f64 {
    let right = |micros: u32| {
        let Some(mut led) = Period::from_micros(micros).and_then(|period| Led::new(set, period).ok()) else {
            return false;
        };
        let ticks = |strides: f64| (strides * period_s * 1e6 / f64::from(micros)) as u32;
        for _ in 0..ticks(20.0) {
            led.step();
        }
        let (mut cycles, mut before) = (0.0, f64::from(led.generator.phase().cycles()));
        let count = ticks(20.0);
        for _ in 0..count {
            led.step();
            let now = f64::from(led.generator.phase().cycles());
            cycles += (now - before + 0.5).rem_euclid(1.0) - 0.5;
            before = now;
        }
        let measured = f64::from(count) * f64::from(micros) * 1e-6 / cycles;
        led.generator.check().is_ok() && (measured / period_s - 1.0).abs() < 0.01
    };
    let (mut good, mut bad) = (0, Period::MAX_MICROS);
    for micros in [100, 500, 1000, 2000, 5000, 10_000, 15_000, 20_000, 30_000, 50_000, Period::MAX_MICROS] {
        if right(micros) {
            good = micros;
        } else {
            bad = micros;
            break;
        }
    }
    while bad.saturating_sub(good) > 100 {
        let middle = good + (bad - good) / 2;
        if right(middle) { good = middle } else { bad = middle }
    }
    f64::from(good) * 1e-3
}

/// Peaks over five strides after twenty, in f32 at 1 ms, and whether every state stayed within its bound.
pub(crate) fn peaks(set: &GeneratorSet, gate: &LoopConfig) -> Result<(Vec<JointPeaks>, bool), String> {
    let mut led = Led::new(set, Period::MILLISECOND)?;
    let stride = (set.stride_guess_s() * 1e3) as u32;
    for _ in 0..20 * stride {
        led.step();
    }
    let (mut low, mut high, mut rate, mut acceleration) = ([f32::MAX; 4], [f32::MIN; 4], [0.0f32; 4], [0.0f32; 4]);
    let mut before = led.generator.rates();
    for _ in 0..5 * stride {
        led.step();
        let (angles, rates) = (led.generator.angles(), led.generator.rates());
        for joint in 0..4 {
            low[joint] = low[joint].min(angles[joint].0);
            high[joint] = high[joint].max(angles[joint].0);
            rate[joint] = rate[joint].max(rates[joint].0.abs());
            acceleration[joint] = acceleration[joint].max((rates[joint].0 - before[joint].0).abs() * 1e3);
        }
        before = rates;
    }
    let peaks = Joint::ALL.map(|joint| {
        let j = joint as usize;
        JointPeaks {
            name: joint.name(),
            amplitude_deg: f64::from((high[j] - low[j]) / 2.0).to_degrees(),
            peak_velocity_deg_s: f64::from(rate[j]).to_degrees(),
            peak_acceleration_deg_s2: f64::from(acceleration[j]).to_degrees(),
            inside_gate: rate[j] <= gate.gate.rate.0 && acceleration[j] <= gate.gate.acceleration.0,
        }
    });
    Ok((peaks.to_vec(), led.generator.check().is_ok()))
}
