//! The longest control period of a generator in `f32`, as the board runs it.

use cpg_core::Generator;
use joint_units::Period;

use crate::subject::Subject;

/// Longest control period in milliseconds at which the stride period is right within 1 percent; resolution 0.1 ms.
pub(crate) fn largest_step(subject: &Subject, period_s: f64) -> f64 {
    let right = |micros: u32| {
        let Some(mut led) = Period::from_micros(micros).and_then(|period| subject.led(period).ok()) else {
            return false;
        };
        let ticks = |strides: f64| (strides * period_s * 1e6 / f64::from(micros)) as u32;
        for _ in 0..ticks(20.0) {
            led.step();
        }
        let (mut cycles, mut before) = (0.0, f64::from(led.phase().cycles()));
        let count = ticks(20.0);
        for _ in 0..count {
            led.step();
            let now = f64::from(led.phase().cycles());
            cycles += (now - before + 0.5).rem_euclid(1.0) - 0.5;
            before = now;
        }
        let measured = f64::from(count) * f64::from(micros) * 1e-6 / cycles;
        led.check().is_ok() && (measured / period_s - 1.0).abs() < 0.01
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
