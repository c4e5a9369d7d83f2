//! Tests of the judge: each rule holds for a good run, and fails for a trace in which it is broken.

use super::*;
use crate::modelled_board::Wiring;

fn period(seconds: f64, us: [f64; 4], rail: bool) -> PulsePeriod {
    PulsePeriod { seconds, us: us.map(Some), programmed_us: us.map(Some), rail }
}

fn off(seconds: f64) -> TimedOutputChange {
    TimedOutputChange { seconds, instructions: 0, change: OutputChange::Rail(false) }
}

/// Tested and armed at 0.72 s, with the robot of [`limits::tests::flash`].
fn armed() -> Judge {
    let mut judge = Judge::new(Limits::of_flash(&limits::tests::flash()), Wiring::default().servos);
    operate(&mut judge, 0, 740, 300..700, 100..200);
    judge
}

/// Operates the button and the emergency stop from one millisecond to another.
fn operate(judge: &mut Judge, from: u32, to: u32, button: std::ops::Range<u32>, stop: std::ops::Range<u32>) {
    for ms in from..to {
        judge.observe(f64::from(ms) * 1e-3, button.contains(&ms), !stop.contains(&ms));
    }
}

/// Pulses of these widths, a frame each from 0.74 s on, in words.
fn first_violation(judge: &mut Judge, widths: &[[f64; 4]]) -> Option<String> {
    for (frame, us) in widths.iter().enumerate() {
        judge.take(&period(0.74 + 0.02 * frame as f64, *us, true));
    }
    judge.violations().1.map(str::to_owned)
}

const PARK: [f64; 4] = [1500.0; 4];

#[test]
fn a_motion_within_the_limits_has_no_violation() {
    let mut judge = armed();
    // 1200 us a second are 24 us a frame.
    let widths: Vec<[f64; 4]> = (0..25).map(|n| [1500.0 + 24.0 * f64::from(n), 1500.0, 900.0, 2400.0]).collect();
    assert_eq!(first_violation(&mut judge, &widths), None);
    assert_eq!((judge.judged().pulses, judge.judged().cut), (100, 0));
}

#[test]
fn range_and_rate_are_judged() {
    for (widths, words) in [
        ([[899.0, 1500.0, 1500.0, 1500.0], PARK], "PE9 at 0.7400 s: 899.0 us is outside 900.0 to 2100.0 us"),
        ([PARK, [1500.0, 1527.0, 1500.0, 1500.0]], "PE11 at 0.7600 s: 1500.0 to 1527.0 us in 20.0 ms"),
        ([PARK, [f64::NAN, 1500.0, 1500.0, 1500.0]], "is outside"),
    ] {
        let mut judge = armed();
        // Another servo moves, so that it is no trim.
        judge.take(&period(0.72, [1500.0, 1500.0, 1490.0, 1500.0], true));
        let found = first_violation(&mut judge, &widths).expect(words);
        assert!(found.contains(words), "{found}");
    }
}

#[test]
fn a_servo_without_supply_takes_no_pulse() {
    let mut judge = armed();
    judge.take(&period(0.74, [90.0, 1500.0, 1500.0, 1500.0], false));
    assert_eq!(judge.judged().violations, 0);
    assert_eq!(judge.judged().pulses, 0);
}

#[test]
fn no_pulse_without_a_robot_record() {
    let mut judge = Judge::new(None, Wiring::default().servos);
    operate(&mut judge, 0, 740, 300..700, 100..200);
    assert!(first_violation(&mut judge, &[PARK]).expect("a pulse").contains("without a valid robot record"));
}

#[test]
fn no_pulse_before_a_hold() {
    let mut judge = Judge::new(Limits::of_flash(&limits::tests::flash()), Wiring::default().servos);
    let found = first_violation(&mut judge, &[PARK]).expect("not armed");
    assert_eq!(found, "a pulse at 0.7400 s: no hold of the button armed it");
}

/// A pulse of 1200 us that ends after 1100 us, which is inside the range.
fn cut(seconds: f64) -> PulsePeriod {
    let mut period = period(seconds, PARK, true);
    (period.us[1], period.programmed_us[1]) = (Some(1490.0), Some(1500.0));
    period
}

#[test]
fn a_cut_pulse_needs_a_cause_and_takes_the_supply_with_it() {
    let with = |cause: fn(&mut Judge), rail: Option<f64>| {
        let mut judge = armed();
        judge.take(&period(0.74, PARK, true));
        cause(&mut judge);
        judge.take(&cut(0.76));
        if let Some(seconds) = rail {
            judge.change(&off(seconds));
        }
        (judge.judged().violations, judge.judged().cut)
    };
    let stop = |judge: &mut Judge| judge.observe(0.7615, false, false);
    assert_eq!(with(stop, Some(0.7615)), (0, 1));
    assert_eq!(with(|judge| judge.reset(0.7615), Some(0.7615)), (0, 1));
    assert_eq!(with(|judge| judge.injected(0.76), Some(0.7615)), (0, 1));
    assert_eq!(with(stop, None), (1, 0), "the supply stays");
    assert_eq!(with(stop, Some(0.7617)), (1, 0), "the supply goes too late");
    assert_eq!(
        with(|judge| judge.injected(0.76), Some(0.7617)),
        (0, 1),
        "the program finds an injected fault in its tick"
    );
    assert_eq!(with(|judge| judge.injected(0.76), Some(0.763)), (1, 0), "the supply goes too late");
    assert_eq!(with(|judge| judge.observe(0.761, false, false), Some(0.7615)), (1, 0), "the stop was earlier");
    assert_eq!(with(|_| (), Some(0.7615)), (1, 0), "nothing had stopped it");
    assert_eq!(with(|judge| judge.injected(0.77), Some(0.7615)), (1, 0), "the fault came later");
}

#[test]
fn the_words_of_a_cut_say_both_widths() {
    let mut judge = armed();
    judge.take(&cut(0.74));
    assert_eq!(judge.violations(), (1, Some("PE11 at 0.7400 s: 1490.0 us of 1500 us: cut short")));
}

#[test]
fn a_trim_moves_one_servo_slowly_within_its_pulses() {
    // Up to 2450 us: beyond the range of the joint, at 2 us a frame.
    let slow = |to: f64| -> Vec<[f64; 4]> {
        let frames = ((to - 1500.0) / 2.0) as u32;
        (0..=frames).map(|n| [1500.0 + 2.0 * f64::from(n), 1500.0, 1500.0, 1500.0]).collect()
    };
    let mut judge = armed();
    assert_eq!(first_violation(&mut judge, &slow(2450.0)), None);
    assert_eq!(judge.judged().trimmed, ["PE9"]);

    assert!(first_violation(&mut armed(), &slow(2454.0)).expect("beyond the servo").contains("2452.0 us is outside"));
    let mut fast = slow(2200.0);
    fast[10][0] += 10.0;
    assert!(first_violation(&mut armed(), &fast).expect("too fast").contains("is outside"));
    let mut beside = slow(2200.0);
    beside.iter_mut().skip(10).for_each(|us| us[2] = 1502.0);
    assert!(first_violation(&mut armed(), &beside).expect("two servos").contains("is outside"));
    let mut late = slow(2200.0);
    late.iter_mut().skip(340).for_each(|us| us[2] = 1502.0);
    assert!(first_violation(&mut armed(), &late).expect("two servos").contains("moves beside a trim"));
}

#[test]
fn a_pin_that_stays_high_is_found_at_the_end() {
    let mut judge = armed();
    judge.end(1.0, [Some(0.9985), None, None, None], true);
    assert_eq!(judge.judged().violations, 0);
    judge.end(1.0, [Some(0.9), None, None, None], false);
    assert_eq!(judge.judged().violations, 0, "no supply");
    judge.end(1.0, [Some(0.9), None, None, None], true);
    assert_eq!(judge.judged().first, ["PE9 is high since 0.9000 s, for 100000 us"]);
}

#[test]
fn a_case_of_a_campaign_begins_without_violations() {
    let mut judge = armed();
    judge.take(&cut(0.74));
    let limits = Limits { least_us: [1400.0; 4], most_us: [1600.0; 4], us_per_s: [1000.0; 4], trim_us: None };
    judge.begin_case(limits);
    assert_eq!(judge.violations(), (0, None));
    judge.take(&period(0.76, [1390.0, 1500.0, 1500.0, 1500.0], true));
    assert!(judge.violations().1.is_some_and(|what| what.contains("1390.0 us is outside 1400.0 to 1600.0 us")));
}
