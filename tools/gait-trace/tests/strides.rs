//! Strides of synthetic gait whose phase, and the parts without strides, are known.

mod synthetic;

use gait_trace::condition;
use gait_trace::stride::cycle::POINTS;
use gait_trace::stride::{cut, strides};
use gait_trace::{
    Conditioned, Cycle, Finding, FindingKind, LeftOut, Level, RawJoints, Rules, StrideError, Strides, WhyLeftOut,
};
use joint_units::Joint;
use proptest::prelude::*;
use std::f64::consts::TAU;
use synthetic::{angle, column, raw, times, walk};

fn done(raw: &RawJoints) -> Conditioned {
    condition(raw, &Rules::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn of(raw: &RawJoints) -> Strides {
    strides::segment(&done(raw)).unwrap_or_else(|error| panic!("{error}"))
}

/// Kept strides and the rest cover the recording once.
fn tiles(walk: &Strides, end_s: f64, rate_hz: f64) {
    let mut parts: Vec<(f64, f64)> = walk.spans.iter().map(|s| (s.start_s, s.end_s)).collect();
    parts.extend(walk.left_out.iter().map(|l| (l.from_s, l.to_s)));
    parts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut at = 0.0;
    for (from, to) in parts {
        assert!((from - at).abs() < 1.01 / rate_hz, "{at} to {from} is in no part, or in two");
        at = to;
    }
    assert!((at - end_s).abs() < 1.01 / rate_hz, "{at}, not {end_s}");
}

/// Steady phase with strides of the given lengths: its value at a time.
fn phase_of(lengths: &[f64], t: f64) -> f64 {
    let mut from = 0.0;
    for (k, length) in lengths.iter().enumerate() {
        if t < from + length {
            return k as f64 + (t - from) / length;
        }
        from += length;
    }
    lengths.len() as f64 + (t - from) / lengths[lengths.len() - 1]
}

/// Standing, walking from `start` to `stop`, standing: the pose eases in and out over half a second.
fn trip(start: f64, stop: f64, end: f64, period: f64) -> RawJoints {
    raw(times(end, 100.0), |joint, t| {
        let ease = |x: f64| x.clamp(0.0, 1.0) * x.clamp(0.0, 1.0) * (3.0 - 2.0 * x.clamp(0.0, 1.0));
        let share = ease((t - start) / 0.5) * ease((stop - t) / 0.5);
        5.0 + share * (angle(joint, t / period) - 5.0)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Strides of uneven length: all that fit are there, each from the same phase to the same phase.
    #[test]
    fn every_stride_is_cut_at_the_same_phase(
        lengths in prop::collection::vec(0.97_f64..1.03, 4..12), period in 0.65_f64..1.5, rate in 60.0_f64..400.0,
    ) {
        let lengths: Vec<f64> = lengths.iter().map(|length| length * period).collect();
        let end: f64 = lengths.iter().sum();
        let walk = of(&raw(times(end, rate), |joint, t| angle(joint, phase_of(&lengths, t))));
        prop_assert!(walk.spans.len() + 1 >= lengths.len() && walk.spans.len() <= lengths.len(), "{}", walk.spans.len());
        tiles(&walk, (end * rate).floor() / rate, rate);
        let start = phase_of(&lengths, walk.spans[1].start_s) - 1.0;
        for (k, span) in walk.spans.iter().enumerate() {
            for (place, wanted) in [(span.start_s, k as f64), (span.end_s, k as f64 + 1.0)] {
                let off = phase_of(&lengths, place) - start - wanted;
                // The first and the last cut may lie where nothing is known beyond them.
                let edge = wanted == 0.0 || wanted as usize == walk.spans.len();
                prop_assert!(off.abs() < if edge { 0.03 } else { 0.012 }, "stride {k}: {off} of a stride off");
            }
        }
        prop_assert!((walk.period_s / period - 1.0).abs() < 0.03);
    }

    /// A drift is spread: the cycle closes, its mean stays, and how far it was open is said.
    #[test]
    fn a_drift_is_closed(drift in -2.0_f64..2.0, period in 0.8_f64..1.4) {
        let walk = of(&raw(times(12.3 * period, 100.0), |joint, t| angle(joint, t / period) + drift * t));
        for open in walk.closure_deg {
            prop_assert!((open - drift.abs() * period).abs() < 0.5, "{open} for {}", drift * period);
        }
        let steady = of(&raw(times(12.3 * period, 100.0), |joint, t| angle(joint, t / period)));
        for (joint, (a, b)) in walk.mean().0.iter().zip(steady.mean().0).enumerate() {
            // No step at the seam is larger than the largest one inside.
            let step = |k: usize| (a[(k + 1) % POINTS] - a[k]).abs();
            let inside = (0..POINTS - 1).map(step).fold(0.0, f64::max);
            prop_assert!(step(POINTS - 1) <= inside, "joint {joint}");
            // The drift's mean over the recording is in the mean; the shape is not changed by it.
            let middle = |x: &[f64; POINTS]| x.iter().sum::<f64>() / POINTS as f64;
            let mean = drift * (walk.spans[0].start_s + walk.spans[walk.spans.len() - 1].end_s) / 2.0;
            prop_assert!((middle(a) - middle(&b) - mean).abs() < 0.1, "{} {}", middle(a) - middle(&b), mean);
        }
    }

    /// Little more than one stride: it is found, and is that stride.
    #[test]
    fn a_single_stride_is_cut_where_it_closes(strides in 1.22_f64..1.9, phase in 0.0_f64..1.0, period in 0.95_f64..1.4) {
        let out = of(&walk(strides * period, 100.0, period, phase));
        prop_assert_eq!(out.spans.len(), 1);
        prop_assert!((out.period_s / period - 1.0).abs() < 0.02, "{} for {period}", out.period_s);
        let start = out.spans[0].start_s / period + phase;
        let truth = Cycle(Joint::ALL.map(|joint| std::array::from_fn(|k| angle(joint, start + k as f64 / POINTS as f64))));
        for off in out.mean().rmse_deg(&truth) {
            prop_assert!(off < 0.8, "{off} deg");
        }
    }
}

#[test]
fn standing_starting_and_stopping_are_left_out_and_listed() {
    let out = of(&trip(3.0, 12.0, 15.0, 1.1));
    tiles(&out, 15.0, 100.0);
    assert!((6..=8).contains(&out.spans.len()), "{}", out.spans.len());
    assert!(out.spans[0].start_s > 3.0 && out.spans[out.spans.len() - 1].end_s < 12.0, "{:?}", out.spans);
    let standing: Vec<&LeftOut> = out.left_out.iter().filter(|part| part.why == WhyLeftOut::Standing).collect();
    assert_eq!(standing.len(), 2, "{:?}", out.left_out);
    assert!(standing[0].from_s == 0.0 && (2.6..3.4).contains(&standing[0].to_s), "{:?}", out.left_out);
    assert!((11.6..12.4).contains(&standing[1].from_s) && standing[1].to_s == 15.0, "{:?}", out.left_out);
    let why: Vec<WhyLeftOut> = out.left_out.iter().map(|part| part.why).collect();
    assert_eq!(why, [WhyLeftOut::Standing, WhyLeftOut::StartUp, WhyLeftOut::Stop, WhyLeftOut::Standing]);
    assert!(out.left_out[0].to_string().ends_with("left out: standing"));
    // What is kept is steady walking.
    assert!(out.sd_deg().iter().all(|sd| *sd < 1.0), "{:?}", out.sd_deg());
}

/// A hole anywhere leaves the lengths of the strides beside it: what is in the hole says nothing of a cut at its edge.
#[test]
fn a_hole_does_not_make_strides_uneven() {
    let lengths = [1.01, 0.99, 1.0, 1.015, 0.985, 1.005, 0.995, 1.01, 0.99, 1.0, 0.99].map(|length| 1.1 * length);
    let walked = || raw(times(12.0, 100.0), |joint, t| angle(joint, phase_of(&lengths, t)));
    let whole_s = of(&walked()).period_sd_s();
    for rows in [30, 60, 100, 150] {
        for first in (0..1200 - rows).step_by(7) {
            let mut holed = walked();
            for joint in Joint::ALL {
                column(&mut holed, joint)[first..first + rows].fill(f64::NAN);
            }
            let out = of(&holed);
            assert!(out.period_sd_s() < 2.0 * whole_s, "{first}, {rows}: {} s, {whole_s} s without", out.period_sd_s());
            assert!(out.spans.len() >= 6, "{first}, {rows}: {}", out.spans.len());
        }
    }
}

/// The part behind the hole is a little longer than the part in which a period is searched, and begins at any sample.
#[test]
fn a_walk_after_a_hole_is_found_wherever_it_begins() {
    for end in 390..415 {
        let mut holed = walk(12.05, 100.0, 1.1, 0.0);
        for joint in Joint::ALL {
            column(&mut holed, joint)[300..end].fill(f64::NAN);
        }
        let out = of(&holed);
        assert!(
            out.spans.len() >= 8 && (out.period_s - 1.1).abs() < 0.01,
            "{end}: {} of {} s",
            out.spans.len(),
            out.period_s
        );
    }
}

/// Movement that repeats nowhere, larger than the walk, before it or behind it: the walk is cut, and the rest left out.
#[test]
fn a_walk_is_found_beside_larger_movement() {
    let exercise = |joint: Joint, t: f64| {
        let k = 1.0 + 0.2 * f64::from(joint as u8);
        40.0 + 35.0 * (0.5 * k * t + 0.11 * t * t).sin() * (0.3 + (0.77 * k * t).sin())
    };
    for (first, walk_s) in [(true, 8.0), (false, 8.0), (true, 5.0), (false, 5.0)] {
        // Both ease into each other over half a second, as a body does.
        let rest_s = 12.0;
        let both = raw(times(rest_s + walk_s, 100.0), |joint, t| {
            let from_end = if first { t - rest_s } else { walk_s - t };
            let share = (from_end / 0.5 + 0.5).clamp(0.0, 1.0);
            share * angle(joint, t / 1.1) + (1.0 - share) * exercise(joint, t)
        });
        let out = of(&both);
        let (begin, end) = if first { (rest_s, rest_s + walk_s) } else { (0.0, walk_s) };
        assert!((out.period_s - 1.1).abs() < 0.03, "{first}, {walk_s} s: {} s", out.period_s);
        assert!(out.spans.len() as f64 > walk_s / 1.1 - 2.0, "{first}, {walk_s} s: {:?}", out.spans);
        assert!(
            out.spans.iter().all(|s| s.start_s > begin - 0.3 && s.end_s < end + 0.3),
            "{first}, {walk_s} s: {:?}",
            out.spans
        );
    }
}

/// Longer movement about as large as the walk, of which parts look like strides: none of them is kept, although they are more than those of the walk.
#[test]
fn strides_of_another_movement_are_left_out() {
    let movement = |joint: Joint, size: f64, t: f64| {
        let [mean, size] =
            if matches!(joint, Joint::LeftHip | Joint::RightHip) { [8.0, 11.0 * size] } else { [24.0, 16.0 * size] };
        let sine = |hz: f64| (TAU * hz * t + 97.0 * hz * (f64::from(joint as u8) + 1.0)).sin();
        mean + size * [0.3, 0.75, 0.85, 0.95, 1.05].map(sine).iter().sum::<f64>()
    };
    for (rest_s, walk_s, size) in [(30.0, 6.0, 0.5), (60.0, 12.0, 0.5), (30.0, 6.0, 1.0), (60.0, 12.0, 1.0)] {
        let both = raw(times(rest_s + walk_s, 100.0), |joint, t| {
            let share = ((t - rest_s) / 0.5 + 0.5).clamp(0.0, 1.0);
            share * angle(joint, t / 1.1) + (1.0 - share) * movement(joint, size, t)
        });
        let out = of(&both);
        assert!(out.spans.iter().all(|span| span.start_s > rest_s - 0.3), "{rest_s}, {walk_s} s: {:?}", out.spans);
        assert!(out.spans.len() as f64 > walk_s / 1.1 - 2.0, "{rest_s}, {walk_s} s: {:?}", out.spans);
        assert!((out.period_s - 1.1).abs() < 0.02, "{rest_s}, {walk_s} s: {}", out.period_s);
    }
}

/// A person who stands for long, and walks for less than two strides: the one stride is where the person walks, although standing closes better.
#[test]
fn a_single_stride_is_none_of_standing() {
    for stands in [2.0, 9.0, 20.0] {
        let out = of(&trip(stands, stands + 2.4, stands + 2.5, 1.1));
        assert!(out.spans.iter().all(|span| span.start_s > stands - 0.3), "{stands} s: {:?}", out.spans);
        assert!((out.period_s / 1.1 - 1.0).abs() < 0.1, "{stands} s: {}", out.period_s);
    }
}

#[test]
fn strides_unlike_the_others_are_left_out() {
    for (odd, wanted) in [(5..6, WhyLeftOut::Odd), (5..8, WhyLeftOut::Turn)] {
        let range = odd.start as f64..odd.end as f64;
        let smaller = |phase: f64| {
            let inside = (phase - range.start).min(range.end - phase);
            1.0 - 0.6 * (inside / 0.1).clamp(0.0, 1.0)
        };
        let walk = of(&raw(times(14.5 * 1.1, 100.0), |joint, t| {
            let phase = t / 1.1;
            10.0 + smaller(phase) * (angle(joint, phase) - 10.0)
        }));
        let out: Vec<&LeftOut> = walk.left_out.iter().filter(|part| part.why == wanted).collect();
        assert_eq!(out.len(), 1, "{:?}", walk.left_out);
        let (from, to) = (range.start * 1.1, range.end * 1.1);
        assert!(out[0].from_s <= from + 0.3 && out[0].to_s >= to - 0.3, "{:?}", walk.left_out);
        // A stride of this kind may reach into both its neighbours, no further.
        assert!(out[0].from_s >= from - 1.2 && out[0].to_s <= to + 1.2, "{:?}", walk.left_out);
        assert!(walk.sd_deg().iter().all(|sd| *sd < 2.5), "{:?}", walk.sd_deg());
    }
}

#[test]
fn a_stride_with_a_hole_in_it_is_no_stride() {
    let mut gap = walk(8.0, 100.0, 1.1, 0.0);
    for joint in Joint::ALL {
        column(&mut gap, joint)[400..440].fill(f64::NAN);
    }
    let mut glitch = walk(8.0, 100.0, 1.1, 0.0);
    column(&mut glitch, Joint::RightHip)[400..440].iter_mut().for_each(|x| *x += 30.0);
    for (raw, why) in [(gap, WhyLeftOut::Gap), (glitch, WhyLeftOut::Glitch)] {
        let out = of(&raw);
        tiles(&out, 8.0, 100.0);
        assert!((4..=6).contains(&out.spans.len()), "{:?}", out.spans);
        assert!(out.spans.iter().all(|span| span.end_s < 4.01 || span.start_s > 4.38), "{:?}", out.spans);
        let parts: Vec<&LeftOut> = out.left_out.iter().filter(|part| part.why == why).collect();
        assert!(parts.len() == 1 && parts[0].from_s <= 4.0 && parts[0].to_s >= 4.39, "{:?}", out.left_out);
        assert!(out.sd_deg().iter().all(|sd| *sd < 0.2), "{:?}", out.sd_deg());
    }
}

#[test]
fn variability_and_asymmetry_are_what_was_put_in() {
    // Odd and even strides are 2 degrees apart in the left knee: an SD of 1. The right knee moves 1.2 times as far.
    let walk = of(&raw(times(20.3 * 1.1, 200.0), |joint, t| {
        let phase = t / 1.1;
        let sway = (std::f64::consts::TAU * phase / 2.0).sin() * 2f64.sqrt();
        match joint {
            Joint::LeftKnee => angle(joint, phase) + sway,
            Joint::RightKnee => 24.0 + 1.2 * (angle(joint, phase) - 24.0),
            _ => angle(joint, phase),
        }
    }));
    let [lh, rh, lk, rk] = walk.sd_deg();
    assert!(lh < 0.1 && rh < 0.1 && rk < 0.2, "{lh} {rh} {rk}");
    // Closing takes the straight part of each half wave: sin less its line leaves between 0.4 and 1 of its size.
    assert!((0.4..1.05).contains(&lk), "{lk}");
    let [hip, knee] = walk.asymmetry_deg();
    // Harmonics of 20, 16, 5 and 1.5 degrees, a fifth of each.
    let wanted = 0.2 * ((20f64.powi(2) + 16f64.powi(2) + 5f64.powi(2) + 1.5f64.powi(2)) / 2.0).sqrt();
    assert!(hip < 0.1 && (knee - wanted).abs() < 0.1, "{hip} {knee}, not {wanted}");
    assert!(walk.period_sd_s() < 0.005);
}

#[test]
fn means_of_some_strides() {
    let walk = of(&walk(8.0, 100.0, 1.1, 0.0));
    let n = walk.cycles().len();
    assert_eq!(n, walk.spans.len());
    assert_eq!(walk.mean(), walk.mean_of(0..n));
    assert_eq!(walk.mean(), walk.mean_of(0..n + 7));
    assert_eq!(walk.mean_of(2..3), walk.cycles()[2]);
    assert_eq!(walk.mean_of(n..n + 1), Cycle([[0.0; POINTS]; 4]));
    let (first, second) = (walk.mean_of(0..n / 2), walk.mean_of(n / 2..n));
    assert!(first.rmse_deg(&second).iter().all(|d| *d < 0.05));
}

#[test]
fn a_normalised_cycle_is_one_stride() {
    let time_s: Vec<f64> = (0..=50).map(|n| f64::from(n) / 50.0).collect();
    let out = of(&raw(time_s, angle));
    assert_eq!((out.spans.len(), out.left_out.len(), out.period_s), (1, 0, 1.0));
    let truth = Cycle(Joint::ALL.map(|joint| std::array::from_fn(|k| angle(joint, k as f64 / POINTS as f64))));
    assert!(out.mean().rmse_deg(&truth).iter().all(|d| *d < 0.01), "{:?}", out.mean().rmse_deg(&truth));
}

#[test]
fn what_has_no_strides_says_why() {
    let mut three = walk(5.0, 100.0, 1.1, 0.0);
    three.joints[1] = None;
    let error = strides::segment(&done(&three)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "no right_hip; allowed is a recording with both hips and both knees: `--map right_hip=COLUMN` names columns that were not recognised"
    );
    assert!(cut::cut(&done(&three)).unwrap().spans.len() >= 3);

    let mut knee = walk(5.0, 100.0, 1.1, 0.0);
    knee.joints = [None, None, None, knee.joints[3].take()];
    let cuts = cut::cut(&done(&knee)).unwrap();
    assert!((3..=4).contains(&cuts.spans.len()), "{:?}", cuts.spans);

    let ramp = raw(times(5.0, 100.0), |joint, t| (5.0 + f64::from(joint as u8)) * t);
    assert!(matches!(strides::segment(&done(&ramp)), Err(StrideError::NoPeriod { .. })));
    assert!(matches!(strides::segment(&done(&walk(0.5, 100.0, 1.1, 0.0))), Err(StrideError::NoPeriod { .. })));

    // One stride and a bit, with a hole in the middle.
    let mut holed = walk(1.6, 100.0, 1.1, 0.0);
    for joint in Joint::ALL {
        column(&mut holed, joint)[60..100].fill(f64::NAN);
    }
    let out = done(&holed);
    assert!(out.findings.iter().any(|finding| finding.what == FindingKind::Gap));
    assert!(strides::segment(&out).is_err());
}

/// Hours are no more work a stride than minutes are: an hour with a hole in every eighth stride.
#[test]
fn a_long_recording_with_many_holes_is_a_matter_of_seconds() {
    let mut hour = walk(3600.0, 100.0, 1.1, 0.0);
    for joint in Joint::ALL {
        let x = column(&mut hour, joint);
        (300..360_000).step_by(880).for_each(|from| x[from..from + 30].fill(f64::NAN));
    }
    let start = std::time::Instant::now();
    let out = of(&hour);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    assert!(out.spans.len() > 2_400, "{}", out.spans.len());
    let holes = out.left_out.iter().filter(|part| part.why == WhyLeftOut::Gap).count();
    assert_eq!(holes, 409);
}

/// A strap that slips by 3 degrees a second, and a person whose knee flexes 4 degrees more at the end than at the start.
#[test]
fn a_drift_is_a_warning() {
    let drifting = |rate: f64| {
        let mut raw = walk(8.0, 100.0, 1.1, 0.0);
        let times = raw.time_s.clone();
        column(&mut raw, Joint::RightKnee).iter_mut().zip(times).for_each(|(x, t)| *x += rate * t);
        of(&raw).drift()
    };
    let found = drifting(3.0);
    let [Finding { what: FindingKind::Drift { deg }, joint: Some(Joint::RightKnee), from_s, to_s, .. }] = found[..]
    else {
        panic!("{found:?}")
    };
    assert!((deg - 3.0 * (to_s - from_s)).abs() < 0.2 && found[0].level() == Level::Warning, "{found:?}");
    assert!(drifting(0.5).is_empty());
    assert!(drifting(-3.0)[0].to_string().contains("drifts by -"));
}
