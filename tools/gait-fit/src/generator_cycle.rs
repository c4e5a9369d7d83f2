//! Computes one stride of a generator as the board does, and aligns it with a recorded stride.

use cpg_core::Generator;
use gait_trace::stride::cycle::{Cycle, POINTS};
use generator_file::file::GeneratorSet;
use joint_units::{Joint, Period};

/// Strides before the recorded one; oscillators reach their limit cycle within a few.
const SETTLING: f64 = 40.0;

/// Cycles before the recorded stride from which angles are computed: no tick advances so far.
const BEFORE: f64 = 0.5;

/// Largest number of ticks; a generator whose phase has not completed the strides by then is refused.
const MAX_TICKS: u32 = 1_000_000;

/// A stride of a generator.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneratorCycle {
    /// The angles.
    pub cycle: Cycle,
    /// Stride period, seconds.
    pub period_s: f64,
}

/// Steps the generator in `f32` at 1 ms, as the board does, until it is on its limit cycle, and returns one stride: from one wrap of
/// its phase to the next, at equal time steps.
///
/// # Errors
/// The generator cannot be built, or its phase does not complete the strides; the text says which.
pub fn generator_cycle(set: &GeneratorSet) -> Result<GeneratorCycle, String> {
    let mut generator = set.build(Period::MILLISECOND).map_err(|error| error.to_string())?;
    let (mut before, mut cycles) = (generator.phase(), f64::from(generator.phase().cycles()));
    // The last sample before the stride, its samples, and one after; each with the cycles completed.
    let mut samples: Vec<(f64, [f64; Joint::COUNT])> = vec![];
    for _ in 0..MAX_TICKS {
        generator.step();
        let now = generator.phase();
        cycles += f64::from(now.counts_after(before)) / 4_294_967_296.0;
        before = now;
        if cycles < SETTLING - BEFORE {
            continue;
        }
        if cycles < SETTLING {
            samples.clear();
        }
        samples.push((cycles, generator.angles().map(|angle| f64::from(angle.degrees()))));
        if cycles > SETTLING + 1.0 {
            return Ok(between_wraps(&samples, SETTLING));
        }
    }
    Err(format!(
        "its phase has not completed {} cycles within {} s; allowed is a generator whose phase advances",
        SETTLING + 1.0,
        f64::from(MAX_TICKS) * 1e-3
    ))
}

/// One stride of recorded angles, in degrees, at equal time steps of 1 ms: from the first whole number of cycles on. `None` if they
/// are shorter.
#[must_use]
pub fn cycle_of(samples: &[(f64, [f64; Joint::COUNT])]) -> Option<GeneratorCycle> {
    let (first, last) = (samples.first()?.0, samples.last()?.0);
    let begin = first.ceil();
    (begin + 1.0 < last).then(|| between_wraps(samples, begin))
}

/// The stride that begins after so many cycles.
fn between_wraps(samples: &[(f64, [f64; Joint::COUNT])], begin: f64) -> GeneratorCycle {
    // Time at which the phase passed a number of cycles, in ticks after the first sample.
    let when = |cycles: f64| {
        let after = samples.iter().position(|sample| sample.0 >= cycles).unwrap_or(0).max(1);
        let (a, b) = (samples[after - 1].0, samples[after].0);
        (after - 1) as f64 + (cycles - a) / (b - a).max(1e-12)
    };
    let (begin, end) = (when(begin), when(begin + 1.0));
    let at = |ticks: f64, joint: usize| {
        let k = (ticks as usize).min(samples.len() - 2);
        let (a, b) = (samples[k].1[joint], samples[k + 1].1[joint]);
        a + (ticks - k as f64) * (b - a)
    };
    let place = |k: usize| begin + (end - begin) * k as f64 / POINTS as f64;
    let cycle = std::array::from_fn(|joint| std::array::from_fn(|k| at(place(k), joint)));
    GeneratorCycle { cycle: Cycle(cycle), period_s: (end - begin) * 1e-3 }
}

/// Shifts a cycle to fit another best, by one shift for all joints; also returns the shift in cycles.
#[must_use]
pub fn aligned(cycle: &Cycle, to: &Cycle) -> (Cycle, f64) {
    let error = |shift: f64| shifted(cycle, shift).rmse_deg(to).iter().map(|e| e * e).sum::<f64>();
    let whole = (0..POINTS).map(|k| k as f64).min_by(|a, b| error(*a).total_cmp(&error(*b))).unwrap_or(0.0);
    // Ternary search between the points, where the error is smooth.
    let (mut low, mut high) = (whole - 1.0, whole + 1.0);
    for _ in 0..30 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if error(a) < error(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let best = f64::midpoint(low, high);
    (shifted(cycle, best), (best / POINTS as f64).rem_euclid(1.0))
}

/// The cycle shifted by a number of points, with Catmull-Rom interpolation between points.
fn shifted(cycle: &Cycle, points: f64) -> Cycle {
    let whole = points.floor();
    let (first, t) = (whole.rem_euclid(POINTS as f64) as usize, points - whole);
    Cycle(cycle.0.each_ref().map(|joint| {
        std::array::from_fn(|k| {
            let [a, b, c, d] = [POINTS - 1, 0, 1, 2].map(|by| joint[(k + first + by) % POINTS]);
            let bend = 2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a);
            b + 0.5 * t * (c - a + t * bend)
        })
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series;
    use generator_file::file::GeneratorFile;
    use std::f64::consts::TAU;

    fn walk() -> Cycle {
        let joint = |mean: f64, one: f64, two: f64, lead: f64| {
            std::array::from_fn(|k| {
                let phase = TAU * (k as f64 / POINTS as f64 + lead);
                mean + one * phase.cos() + two * (2.0 * phase).sin()
            })
        };
        Cycle([
            joint(5.0, 20.0, 2.0, 0.0),
            joint(5.0, 20.0, 2.0, 0.5),
            joint(30.0, 20.0, 12.0, 0.2),
            joint(30.0, 20.0, 12.0, 0.7),
        ])
    }

    #[test]
    fn a_shape_reproduces_the_cycle_it_was_fitted_to() {
        for stride_s in [0.65, 1.0, 1.2345] {
            let set = GeneratorSet::Shape(series::fit(&walk(), stride_s, 6));
            let own = generator_cycle(&set).unwrap();
            assert!((own.period_s - stride_s).abs() < 1e-5, "{}", own.period_s);
            let (turned, _) = aligned(&own.cycle, &walk());
            assert!(turned.rmse_deg(&walk()).iter().all(|rmse| *rmse < 0.002), "{:?}", turned.rmse_deg(&walk()));
        }
    }

    #[test]
    fn the_default_walk_has_its_stride_period() {
        let own = generator_cycle(&GeneratorFile::default_of("phase-coupled").unwrap().set).unwrap();
        assert!((own.period_s - 1.1).abs() < 2e-4, "{}", own.period_s);
        let knee = own.cycle.0[2].iter().copied().fold(f64::MIN, f64::max);
        assert!((60.0..63.0).contains(&knee), "{knee}");
    }

    #[test]
    fn a_shift_is_found_again() {
        for shift in [0.0, 0.25, 0.3333, 0.9871] {
            let (turned, found) = aligned(&walk(), &shifted(&walk(), shift * POINTS as f64));
            assert!((found - shift).abs() < 1e-3, "{found} for {shift}");
            assert!(turned.rmse_deg(&shifted(&walk(), shift * POINTS as f64)).iter().all(|rmse| *rmse < 0.02));
        }
    }
}
