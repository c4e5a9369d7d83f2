//! Initial contact and foot off from joint angles, against the events that the file of a laboratory holds.

use gait_fit::contact::CycleStart;
use gait_trace::format::open;
use gait_trace::stride::cycle::POINTS;
use gait_trace::stride::strides::segment;
use gait_trace::{LowPass, ReadOptions, Rules, Span, condition};
use std::process::ExitCode;
use test_suite::{report, tests, wild_folder};

fn main() -> ExitCode {
    test_suite::run(tests![contact_is_near_the_events_of_the_laboratory(Wild)])
}

/// A file of a healthy person (Plug-in Gait) and its events `Foot Strike` and `Foot Off` of the left and of the right foot, seconds: the parameters
/// CONTEXTS, LABELS and TIMES of the group EVENT, as independent readers give them.
const FILE: &str = "c3dorg_sample23_vicon_analysis.c3d";
const STRIKES: [(&str, &[f64]); 2] = [("left", &[2.15, 3.196, 4.225, 5.25]), ("right", &[1.625, 2.668, 3.708, 4.742])];

const OFFS: [&[f64]; 2] = [&[1.758, 2.775, 3.83, 4.85], &[2.275, 3.296, 4.325, 5.375]];

/// Largest error, percent of the cycle.
const MOST_PERCENT: f64 = 6.0;

fn contact_is_near_the_events_of_the_laboratory() {
    let raw = open::read(&wild_folder().join(FILE), &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let rules = Rules { low_pass: LowPass::Customary, ..Rules::default() };
    let conditioned = condition(&raw, &rules).unwrap_or_else(|error| panic!("{error}"));
    let strides = segment(&conditioned).unwrap_or_else(|error| panic!("{error}"));
    let start = CycleStart::of(&strides.mean(), Some(120.0 / strides.period_s));
    assert!(start.initial_contact, "{}", start.words());
    // Errors of the estimate at a point of the cycle, against the nearest event of each stride, percent of the cycle.
    let errors = |events: &[f64], percent: f64| -> Vec<f64> {
        let error = |span: &Span| {
            let length = span.end_s - span.start_s;
            let found = conditioned.start_s + span.start_s + length * percent / 100.0;
            let apart = events.iter().map(|event| found - event).min_by(|a, b| a.abs().total_cmp(&b.abs()));
            100.0 * apart.expect("an event") / length
        };
        strides.spans.iter().map(error).collect()
    };
    let offs = start.foot_off_percent.expect("estimated with initial contact");
    for (n, (leg, strikes)) in STRIKES.into_iter().enumerate() {
        let contact = 100.0 * start.points[n] as f64 / POINTS as f64;
        let at_contact = errors(strikes, contact);
        let at_off = errors(OFFS[n], (contact + offs[n]) % 100.0);
        report!("{leg} leg: contact {at_contact:+.1?}, foot off {at_off:+.1?} % of the cycle");
        for error in at_contact.iter().chain(&at_off) {
            assert!(error.abs() <= MOST_PERCENT, "{leg}: {at_contact:?} {at_off:?}");
        }
    }
}
