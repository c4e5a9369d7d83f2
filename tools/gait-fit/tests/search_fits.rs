//! Fits of the oscillator networks to a stride: what the core then runs is what the fit reported.

use cpg_core::Generator as _;
use gait_fit::search::{Dynamics, SearchSettings, fit_phase_coupled, fit_thesis};
use gait_trace::stride::cycle::{Cycle, POINTS};
use generator_file::file::GeneratorSet;
use generator_file::returns::comes_back;
use joint_units::Period;

/// A stride with harmonics of the size of human walking; left half a stride after right.
fn stride() -> Cycle {
    Cycle(std::array::from_fn(|joint| {
        std::array::from_fn(|k| {
            let phase = std::f64::consts::TAU * (k as f64 / POINTS as f64 + 0.5 * (joint % 2) as f64);
            let wave = |a: f64, n: f64, lead: f64| a * (n * phase + lead).cos();
            match joint / 2 {
                0 => 8.0 + wave(20.0, 1.0, -0.2) + wave(3.0, 2.0, 1.9),
                _ => 22.0 + wave(19.0, 1.0, 1.5) + wave(14.0, 2.0, 2.9),
            }
        })
    }))
}

#[test]
fn a_fit_has_the_same_orbit_on_the_core() {
    let target = stride();
    let settings = SearchSettings { seed: 2, evaluations: 6000, ..SearchSettings::default() };
    let fit = fit_thesis(&target, 1.1, &settings, &mut |_| ());
    // Accepted or not: the word is that of the certificate.
    let word = comes_back(&GeneratorSet::Thesis(fit.set), 100);
    assert_eq!(fit.refused_because, word.err());
    println!("{:?}", fit.refused_because);
    assert!((fit.period_s / 1.1 - 1.0).abs() < 0.01, "{}", fit.period_s);
    // Better than the constant mean (14.2 degrees in the hips, 16.7 in the knees).
    assert!(fit.rmse_deg.iter().all(|rmse| *rmse < 12.0), "{:?}", fit.rmse_deg);
    assert!(fit.history.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 > w[1].1));
    // The core's f32 network follows the reported cycle after it has settled.
    let mut generator = GeneratorSet::Thesis(fit.set).build(Period::MILLISECOND).expect("it was checked");
    for _ in 0..300 * 1100 {
        generator.step();
    }
    let mut worst = [f64::MAX; POINTS];
    for _ in 0..1100 {
        generator.step();
        let angles = generator.angles().map(|a| f64::from(a.degrees()));
        for (k, worst) in worst.iter_mut().enumerate() {
            let off = (0..4).map(|i| (angles[i] - fit.best_cycle.0[i][k]).abs()).fold(0.0, f64::max);
            *worst = worst.min(off);
        }
    }
    assert!(worst.iter().all(|off| *off < 1.0), "{worst:?}");
    assert_eq!(fit, fit_thesis(&target, 1.1, &settings, &mut |_| ()));
}

/// A network that is only compared is searched with a third of the evaluations: its error is hardly above that of the whole search.
#[test]
fn a_third_of_the_evaluations_has_the_same_error() {
    let error = |target: &Cycle, evaluations: usize| -> f64 {
        let settings = SearchSettings { evaluations, ..SearchSettings::default() };
        gait_trace::root_mean_square(&fit_thesis(target, 1.1, &settings, &mut |_| ()).rmse_deg)
    };
    let ratios: Vec<f64> = [1.0, 0.7, 0.4]
        .map(|knees| {
            let mut target = stride();
            target.0[2..].as_flattened_mut().iter_mut().for_each(|x| *x = 22.0 + (*x - 22.0) * knees);
            let (few, all) = (error(&target, 20_000), error(&target, 60_000));
            println!("{few:.3} and {all:.3} degrees");
            few / all
        })
        .into();
    assert!(ratios.iter().sum::<f64>() / 3.0 < 1.05 && ratios.iter().all(|ratio| *ratio < 1.15), "{ratios:?}");
}

/// Without budget, stride or valid period the fit is refused with the reason.
#[test]
fn a_bad_input_is_refused_with_the_reason() {
    let settings = SearchSettings { evaluations: 0, ..SearchSettings::default() };
    let fit = fit_thesis(&stride(), 1.1, &settings, &mut |_| ());
    assert!(fit.evaluations == 0 && !fit.accepted && fit.refused_because.is_some());
    let mut broken = stride();
    broken.0[2][7] = f64::NAN;
    for (target, period_s, reason) in
        [(broken, 1.1, "left knee"), (stride(), 0.0, "0.2 to 20 s"), (stride(), f64::NAN, "0.2 to 20 s")]
    {
        let fit = fit_thesis(&target, period_s, &SearchSettings::default(), &mut |_| ());
        assert!(!fit.accepted && fit.evaluations == 0);
        assert!(fit.refused_because.as_ref().is_some_and(|why| why.contains(reason)), "{:?}", fit.refused_because);
    }
}

#[test]
fn r1_is_fitted_and_has_the_same_cycle_on_the_core() {
    let target = stride();
    for dynamics in [Dynamics::Fixed(0.5, 0.5), Dynamics::Free] {
        let fit = fit_phase_coupled(&target, 0.9, dynamics, &mut |_| ());
        // One sinusoid a joint leaves its second harmonic: 3/sqrt(2) and 14/sqrt(2) degrees.
        for (joint, rmse) in fit.rmse_deg.iter().enumerate() {
            let left = [3.0, 3.0, 14.0, 14.0][joint] / 2f64.sqrt();
            assert!((rmse - left).abs() < 0.25, "{dynamics:?}: {:?}", fit.rmse_deg);
        }
        assert!(fit.evaluations <= 410 && (fit.period_s - 0.9).abs() < 1e-6);
        let mut generator = GeneratorSet::PhaseCoupled(fit.set).build(Period::MILLISECOND).expect("in range");
        for _ in 0..30_000 {
            generator.step();
        }
        let mut off = [f64::MAX; POINTS];
        for _ in 0..900 {
            generator.step();
            let angles = generator.angles().map(|a| f64::from(a.degrees()));
            for (k, off) in off.iter_mut().enumerate() {
                let now = (0..4).map(|i| (angles[i] - fit.best_cycle.0[i][k]).abs()).fold(0.0, f64::max);
                *off = off.min(now);
            }
        }
        assert!(off.iter().all(|off| *off < 0.3), "{dynamics:?}: {off:?}");
    }
}
