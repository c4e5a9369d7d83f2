//! The filter against its closed form, and its promises as properties.

use hgod_adc::{Filter, FilterConfig, FilterState};
use joint_units::{Period, Radians};
use proptest::prelude::*;

fn filter(cutoff_hz: f32) -> Filter {
    FilterConfig { cutoff_hz }.build(Period::MILLISECOND).unwrap()
}

/// Feeds the inputs to a fresh filter and gives all outputs.
fn run(filter: Filter, inputs: impl IntoIterator<Item = f32>) -> Vec<f32> {
    let mut state = FilterState::default();
    inputs.into_iter().map(|input| filter.step(&mut state, Radians(input)).0).collect()
}

#[test]
fn the_step_response_is_the_closed_form_one_sample_late() {
    for micros in [333, 1000, 2500] {
        let period = Period::from_micros(micros).unwrap();
        for cutoff in [0.1, 1.0, 20.0, 150.0] {
            let filter = FilterConfig { cutoff_hz: cutoff }.build(period).unwrap();
            // Zero, then one from sample 1 on: the median lets it through from sample 2 on.
            let outputs = run(filter, std::iter::once(0.0).chain(std::iter::repeat_n(1.0, 3000)));
            assert_eq!(outputs[1], 0.0);
            for (n, output) in outputs.iter().skip(1).enumerate() {
                let t = n as f64 * f64::from(micros) * 1e-6;
                let exact = 1.0 - (-2.0 * std::f64::consts::PI * f64::from(cutoff) * t).exp();
                assert!((f64::from(*output) - exact).abs() < 4e-7, "{cutoff} Hz, step {n}: {output}, exactly {exact}");
            }
        }
    }
}

#[test]
fn even_the_slowest_filter_reaches_a_constant_exactly() {
    // 0.01 Hz at 1 kHz gains 6e-5 a sample: an f32 sum without carry stops some 8000 units in the last place short.
    let outputs = run(filter(0.01), std::iter::once(0.0).chain(std::iter::repeat_n(1.3, 600_000)));
    let reached = outputs.iter().position(|&output| output == 1.3).expect("the constant is reached");
    assert!(outputs[reached..].iter().all(|&output| output == 1.3));
}

/// Below 1 an `f32` is twice as fine as above it: what was carried from above is then a whole step too far.
#[test]
fn the_carry_does_not_push_the_output_out_of_the_inputs() {
    let above = 1.0 + 4.0 * f32::EPSILON;
    let outputs = run(filter(312.625), [above, 1.0, 1.0, above]);
    assert!(outputs.iter().all(|output| (1.0..=above).contains(output)), "{outputs:?}");
}

#[test]
fn a_sample_that_is_not_finite_is_not_taken() {
    let filter = filter(20.0);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(run(filter, [0.5, 0.7, bad, bad, 0.6, 0.6])[4..], run(filter, [0.5, 0.7, 0.6, 0.6])[2..]);
        assert_eq!(run(filter, [0.5, bad])[1], 0.5);
        assert_eq!(run(filter, [bad, 0.5])[1], 0.5);
    }
}

#[test]
fn a_bad_cutoff_is_refused_with_its_range() {
    for bad in [f32::NAN, f32::INFINITY, 0.0, 0.009, -20.0, 500.1] {
        let error = FilterConfig { cutoff_hz: bad }.build(Period::MILLISECOND).unwrap_err();
        assert_eq!((error.field, error.min, error.max), ("filter.cutoff_hz", 0.01, 500.0), "{bad}");
    }
    assert!(FilterConfig { cutoff_hz: 500.0 }.build(Period::MILLISECOND).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_single_spike_leaves_no_trace(
        level in -3.0..3.0_f32, spike in -1e6..1e6_f32, at in 1..40_usize, cutoff in 0.1..500.0_f32,
    ) {
        let outputs = run(filter(cutoff), (0..60).map(|n| if n == at { spike } else { level }));
        prop_assert!(outputs.iter().all(|&output| output == level));
    }

    #[test]
    fn a_constant_is_reached_exactly_and_kept(
        from in proptest::collection::vec(-3.0..3.0_f32, 1..20), to in -3.0..3.0_f32, cutoff in 1.0..500.0_f32,
    ) {
        // exp(-2 pi f T n) < 2^-40 after n = 4.5 / (f T); as much again for the carry.
        let enough = (9000.0 / cutoff) as usize + 100;
        let outputs = run(filter(cutoff), from.into_iter().chain(std::iter::repeat_n(to, 2 * enough)));
        prop_assert!(outputs.iter().rev().take(enough).all(|&output| output == to), "{:?}", outputs.last());
    }

    #[test]
    fn outputs_stay_in_the_range_of_the_inputs(
        inputs in proptest::collection::vec(-3.0..3.0_f32, 1..200), cutoff in 0.01..500.0_f32,
    ) {
        let low = inputs.iter().copied().fold(f32::INFINITY, f32::min);
        let high = inputs.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        for output in run(filter(cutoff), inputs) {
            prop_assert!((low..=high).contains(&output));
        }
    }

    /// A wave that is slow against the cut-off passes, one that is fast against it does not.
    #[test]
    fn a_wave_is_weakened_as_the_transfer_function_says(cutoff in 5.0..60.0_f32, hz in 1.0..30.0_f64) {
        let turn = std::f64::consts::TAU * hz * 1e-3;
        let outputs = run(filter(cutoff), (0..4000).map(|n| (turn * f64::from(n)).sin() as f32));
        let peak = outputs[2000..].iter().fold(0.0, |peak: f64, &output| peak.max(f64::from(output).abs()));
        // |H| = a / |1 - (1 - a) exp(-j w T)|; the median takes off the wave's tips: 1 - cos(w T) of it at most.
        let a = 1.0 - (-std::f64::consts::TAU * f64::from(cutoff) * 1e-3).exp();
        let (re, im) = (1.0 - (1.0 - a) * turn.cos(), (1.0 - a) * turn.sin());
        let gain = a / re.hypot(im);
        let slack = 1.0 - turn.cos() + turn * turn / 8.0 + 1e-5;
        prop_assert!((peak - gain).abs() <= gain * slack, "{peak} for {gain} +- {slack}");
    }
}
