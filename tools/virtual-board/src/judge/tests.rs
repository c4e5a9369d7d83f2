//! Tests of the judge: each rule holds for a good run, and fails for a trace in which it is broken.

use super::*;
use crate::modelled_board::Wiring;

/// A pulse for each servo, which begin together.
fn frame(seconds: f64, us: [f64; 4]) -> [ServoPulse; 4] {
    [0, 1, 2, 3].map(|servo| ServoPulse {
        servo,
        from: seconds,
        to: seconds + us[servo] * 1e-6,
        programmed_us: Some(us[servo]),
        supply: PulseSupply::Whole,
        returned_s: 0.0,
    })
}

fn take(judge: &mut Judge, pulses: [ServoPulse; 4]) {
    pulses.iter().for_each(|pulse| judge.take(pulse));
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
    for (n, us) in widths.iter().enumerate() {
        take(judge, frame(0.74 + 0.02 * n as f64, *us));
    }
    judge.violations().1.map(str::to_owned)
}

const PARK: [f64; 4] = [1500.0; 4];

#[test]
fn a_motion_within_the_limits_has_no_violation() {
    let mut judge = armed();
    // 1200 us a second are 24 us a frame.
    let widths: Vec<[f64; 4]> =
        (0..25).map(|n| 24.0 * f64::from(n)).map(|by| [1500.0 + by, 1500.0, 1500.0 - by, 1500.0 + by]).collect();
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
        take(&mut judge, frame(0.72, [1500.0, 1500.0, 1490.0, 1500.0]));
        let found = first_violation(&mut judge, &widths).expect(words);
        assert!(found.contains(words), "{found}");
    }
}

#[test]
fn a_servo_without_supply_takes_no_pulse() {
    let mut judge = armed();
    let absent = |pulse| ServoPulse { supply: PulseSupply::Absent, ..pulse };
    take(&mut judge, frame(0.74, [90.0, 1500.0, 1500.0, 1500.0]).map(absent));
    assert_eq!((judge.judged().violations, judge.judged().pulses), (0, 0));
}

#[test]
fn the_rate_is_judged_over_a_pause_of_one_servo() {
    // 1200 us a second over 160 ms are 192 us.
    for (us, violations) in [(1690.0, 0), (1700.0, 1)] {
        let mut judge = armed();
        take(&mut judge, frame(0.74, PARK));
        for n in 1..8 {
            frame(0.74 + 0.02 * f64::from(n), PARK)[1..].iter().for_each(|pulse| judge.take(pulse));
        }
        take(&mut judge, frame(0.90, [us, 1500.0, 1500.0, 1500.0]));
        assert_eq!(judge.judged().violations, violations, "{:?}", judge.judged().first);
    }
}

#[test]
fn a_motion_begins_at_the_park_pose_or_at_the_last_pulse() {
    let mut judge = armed();
    let found = first_violation(&mut judge, &[[1700.0, 1500.0, 1500.0, 1500.0]]).expect("elsewhere");
    assert_eq!(found, "PE9 at 0.7400 s: 1700.0 us begins a motion, not at the park pose (1500.0 us)");
    // After a motion that ended at 1740 us at 0.94 s: there, for a minute, from then on or from a reset that keeps the memory.
    for (keeps, at, first, violations) in [
        (Some(true), 1_740, 1740.0, 0),
        (Some(true), 1_740, 1500.0, 1),
        (Some(true), 1_740, 1600.0, 1),
        (Some(true), 1_740, 1860.0, 1),
        (Some(true), 60_960, 1740.0, 0),
        (Some(true), 60_960, 1500.0, 0),
        (Some(true), 61_200, 1740.0, 1),
        (Some(false), 1_740, 1740.0, 1),
        (Some(false), 1_740, 1500.0, 0),
        (None, 1_740, 1740.0, 0),
        (None, 1_740, 1500.0, 1),
        (None, 61_100, 1740.0, 1),
        (None, 61_100, 1500.0, 0),
    ] {
        let mut judge = armed();
        let widths: Vec<[f64; 4]> = (0..=10).map(|n| [1500.0 + 24.0 * f64::from(n); 4]).collect();
        assert_eq!(first_violation(&mut judge, &widths), None);
        if let Some(keeps) = keeps {
            judge.reset(1.0, keeps, false, || Limits::of_flash(&limits::tests::flash()));
        }
        operate(&mut judge, 1_000, at, at - 440..at - 40, 1_100..1_200);
        take(&mut judge, frame(f64::from(at) * 1e-3, [first; 4]));
        assert_eq!(judge.judged().violations, 4 * violations, "{keeps:?} {at} {first}: {:?}", judge.judged().first);
    }
}

/// What a trim has left outside of the range comes back slowly, without a trim; not further out, not fast, and a neighbour may move meanwhile.
#[test]
fn a_servo_outside_of_its_range_comes_back_slowly() {
    let trimmed = || {
        let mut judge = armed();
        judge.host_sent();
        let widths: Vec<[f64; 4]> = (0..=400).map(|n| [1500.0 + 2.0 * f64::from(n), 1500.0, 1500.0, 1500.0]).collect();
        assert_eq!(first_violation(&mut judge, &widths), None);
        operate(&mut judge, 9_000, 9_960, 9_500..9_900, 0..1);
        judge
    };
    let back = |step: f64, to: f64, beside: f64| {
        let mut judge = trimmed();
        let mut us = 2300.0;
        let mut n = 0.0;
        while us > to {
            take(&mut judge, frame(9.96 + 0.02 * n, [us, 1500.0 + beside * n, 1500.0, 1500.0]));
            (us, n) = (us - step, n + 1.0);
        }
        judge.judged()
    };
    assert_eq!(back(2.0, 1500.0, 0.0).first, [""; 0]);
    assert_eq!(back(2.0, 2110.0, 1.0).first, [""; 0]);
    assert_eq!(back(2.0, 1500.0, 0.0).trimmed.len(), 1, "the trim before");
    assert!(back(5.0, 2110.0, 0.0).first[0].contains("2295.0 us is outside"), "{:?}", back(5.0, 2110.0, 0.0).first);
    let mut judge = trimmed();
    take(&mut judge, frame(9.96, [2300.0, 1500.0, 1500.0, 1500.0]));
    take(&mut judge, frame(9.98, [2302.0, 1505.0, 1500.0, 1500.0]));
    take(&mut judge, frame(10.0, [2304.0, 1510.0, 1500.0, 1500.0]));
    assert!(
        judge.judged().first.iter().any(|what| what.contains("2304.0 us is outside")),
        "{:?}",
        judge.judged().first
    );
}

/// The time of a stop is that of the robot: one that is slow, or that comes from elsewhere, may take as long as its stop does.
#[test]
fn a_stop_takes_as_long_as_the_robot_needs() {
    let with = |stop_s: f64, until: f64| {
        let mut judge = armed();
        judge.limits = judge.limits.take().map(|limits| Limits { stop_s, ..limits });
        take(&mut judge, frame(0.74, PARK));
        let mut at: f64 = 0.76;
        while at < until {
            operate(&mut judge, (at * 1e3) as u32, ((at + 0.02) * 1e3) as u32, 1_000..1_100, 0..1);
            take(&mut judge, frame(at, PARK));
            at += 0.02;
        }
        judge.judged().violations
    };
    assert_eq!((with(1.0, 2.1), with(1.5, 2.6)), (0, 0));
    assert!(with(1.0, 2.4) > 0 && with(1.5, 2.9) > 0);
}

#[test]
fn the_limits_are_those_of_the_last_boot_unless_a_campaign_has_its_own() {
    let mut judge = armed();
    judge.reset(0.75, true, false, || None);
    operate(&mut judge, 750, 1_490, 1_050..1_450, 850..950);
    take(&mut judge, frame(1.49, PARK));
    assert_eq!(judge.judged().violations, 4);
    assert!(judge.violations().1.is_some_and(|what| what.contains("with a damaged parameter sector")));

    let mut judge = armed();
    judge.begin_case(campaign(), 0.0);
    judge.reset(0.75, true, false, || None);
    operate(&mut judge, 750, 1_490, 1_050..1_450, 850..950);
    take(&mut judge, frame(1.49, PARK));
    assert_eq!(judge.judged().violations, 0);
}

#[test]
fn no_pulse_with_a_damaged_sector() {
    let mut judge = Judge::new(None, Wiring::default().servos);
    operate(&mut judge, 0, 740, 300..700, 100..200);
    assert!(first_violation(&mut judge, &[PARK]).expect("a pulse").contains("with a damaged parameter sector"));
}

#[test]
fn no_pulse_before_a_hold() {
    let mut judge = Judge::new(Limits::of_flash(&limits::tests::flash()), Wiring::default().servos);
    let found = first_violation(&mut judge, &[PARK]).expect("not armed");
    assert_eq!(found, "PE9 at 0.7400 s: no hold of the button armed it");
}

/// A pulse of 1200 us that ends after 1100 us, which is inside the range.
fn cut(seconds: f64) -> [ServoPulse; 4] {
    let mut pulses = frame(seconds, PARK);
    pulses[1].to = seconds + 1490e-6;
    pulses
}

#[test]
fn a_cut_pulse_needs_a_cause_and_takes_the_supply_with_it() {
    let with = |cause: fn(&mut Judge), rail: Option<f64>| {
        let mut judge = armed();
        take(&mut judge, frame(0.74, PARK));
        cause(&mut judge);
        take(&mut judge, cut(0.76));
        if let Some(seconds) = rail {
            judge.change(&off(seconds));
        }
        (judge.judged().violations, judge.judged().cut)
    };
    let stop = |judge: &mut Judge| judge.observe(0.7615, false, false);
    assert_eq!(with(stop, Some(0.7615)), (0, 1));
    assert_eq!(with(|judge| judge.reset(0.7615, true, false, || None), Some(0.7615)), (0, 1));
    assert_eq!(with(|judge| judge.injected(0.76, WITHOUT_EFFECT_S), Some(0.7615)), (0, 1));
    assert_eq!(with(stop, None), (1, 0), "the supply stays");
    assert_eq!(with(stop, Some(0.7617)), (1, 0), "the supply goes too late");
    assert_eq!(
        with(|judge| judge.injected(0.76, WITHOUT_EFFECT_S), Some(0.7617)),
        (0, 1),
        "the program finds an injected fault in its tick"
    );
    assert_eq!(with(|judge| judge.injected(0.76, WITHOUT_EFFECT_S), Some(0.763)), (1, 0), "the supply goes too late");
    assert_eq!(with(|judge| judge.observe(0.761, false, false), Some(0.7615)), (1, 0), "the stop was earlier");
    assert_eq!(with(|_| (), Some(0.7615)), (1, 0), "nothing had stopped it");
    assert_eq!(with(|judge| judge.injected(0.77, WITHOUT_EFFECT_S), Some(0.7615)), (1, 0), "the fault came later");
}

#[test]
fn the_words_of_a_cut_say_both_widths() {
    let mut judge = armed();
    take(&mut judge, cut(0.74));
    assert_eq!(judge.violations(), (1, Some("PE11 at 0.7400 s: 1490.0 us of 1500 us: cut short")));
}

#[test]
fn a_trim_moves_one_servo_slowly_within_its_pulses() {
    // Up to 2450 us: beyond the range of the joint, at 2 us a frame.
    let slow = |to: f64| -> Vec<[f64; 4]> {
        let frames = ((to - 1500.0) / 2.0) as u32;
        (0..=frames).map(|n| [1500.0 + 2.0 * f64::from(n), 1500.0, 1500.0, 1500.0]).collect()
    };
    let armed = || {
        let mut judge = armed();
        judge.host_sent();
        judge
    };
    let mut judge = armed();
    assert_eq!(first_violation(&mut judge, &slow(2450.0)), None);
    assert_eq!(judge.judged().trimmed, ["PE9"]);

    assert!(first_violation(&mut armed(), &slow(2454.0)).expect("beyond the servo").contains("2452.0 us is outside"));
    let without_host = first_violation(&mut super::tests::armed(), &slow(2200.0)).expect("nobody asked for it");
    assert!(without_host.contains("2102.0 us is outside"), "{without_host}");
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
fn a_line_that_stays_high_is_found() {
    let high = |ms: f64, supply: PulseSupply| ServoPulse {
        servo: 0,
        from: 0.76,
        to: 0.76 + ms * 1e-3,
        programmed_us: Some(1500.0),
        supply,
        returned_s: 0.0,
    };
    let long = "PE9 at 0.7600 s: high for 34.00 ms";
    // It falls with the supply on, with the supply off since then, with a reset that takes both, and not at all.
    for (ms, supply, is_end, resets, violation) in [
        (34.0, PulseSupply::Whole, false, false, Some(long)),
        (40.0, PulseSupply::Until(0.794), false, true, Some(long)),
        (34.0, PulseSupply::Until(0.794), false, true, Some(long)),
        (34.0, PulseSupply::Whole, true, false, Some(long)),
        (34.0, PulseSupply::Absent, false, false, None),
        (34.0, PulseSupply::Absent, true, false, None),
        (1.4, PulseSupply::Whole, true, false, None),
        (
            1.4,
            PulseSupply::Until(0.761),
            false,
            false,
            Some("PE9 at 0.7600 s: 1400.0 us of 1500 us: cut short, while its supply fell"),
        ),
        (1.5, PulseSupply::Until(0.761), false, false, None),
    ] {
        let mut judge = armed();
        take(&mut judge, frame(0.74, PARK));
        if resets {
            judge.reset(0.794, true, false, || None);
        }
        let pulse = high(ms, supply);
        if is_end {
            judge.end(&pulse)
        } else {
            judge.take(&pulse)
        }
        judge.change(&off(pulse.to));
        assert_eq!(judge.judged().first.first().map(String::as_str), violation, "{ms} {supply:?} {is_end}");
    }
    // The supply comes, or comes back, while the line is high.
    for (supply, returned_s, violation) in [
        (PulseSupply::Absent, 0.016, Some("PE9 at 0.7600 s: high for 16.00 ms")),
        (PulseSupply::Until(0.77), 0.024, Some(long)),
        (PulseSupply::Absent, 0.0014, None),
    ] {
        for is_end in [false, true] {
            let mut judge = armed();
            take(&mut judge, frame(0.74, PARK));
            let pulse = ServoPulse { returned_s, ..high(40.0, supply) };
            if is_end {
                judge.end(&pulse)
            } else {
                judge.take(&pulse)
            }
            assert_eq!(judge.judged().first.first().map(String::as_str), violation, "{supply:?} {is_end}");
        }
    }
    // Nobody armed: a line that rises, and is high at the end of the run.
    let mut judge = Judge::new(Some(campaign()), Wiring::default().servos);
    judge.end(&high(0.5, PulseSupply::Whole));
    assert_eq!(judge.judged().first, ["PE9 at 0.7600 s: no hold of the button armed it"]);
    let mut judge = armed();
    judge.begin_case(campaign(), 0.036);
    take(&mut judge, frame(0.74, PARK));
    judge.take(&high(34.0, PulseSupply::Whole));
    assert_eq!(judge.violations(), (0, None), "declared");
    judge.take(&high(34.0, PulseSupply::Whole));
    assert_eq!(judge.violations().0, 1, "once for each servo");
    judge.begin_case(campaign(), 0.036);
    judge.take(&high(37.0, PulseSupply::Whole));
    assert_eq!(judge.violations().0, 1, "longer than declared");
}

/// Limits of a campaign.
fn campaign() -> Limits {
    Limits {
        least_us: [1400.0; 4],
        most_us: [1600.0; 4],
        us_per_s: [1000.0; 4],
        park_us: PARK,
        trim_us: None,
        stop_s: 1.0,
    }
}

#[test]
fn a_case_of_a_campaign_begins_without_violations() {
    let mut judge = armed();
    take(&mut judge, cut(0.74));
    judge.begin_case(campaign(), 0.0);
    assert_eq!(judge.violations(), (0, None));
    take(&mut judge, frame(0.76, [1390.0, 1500.0, 1500.0, 1500.0]));
    assert!(judge.violations().1.is_some_and(|what| what.contains("1390.0 us is outside 1400.0 to 1600.0 us")));
}
