//! What the study gives: the numbers of `cpg-core` as Rust, and tables of the errors.

use std::fmt::Write as _;

use gait_fit::series::Series;
use gait_trace::stride::cycle::POINTS;

use crate::gait_family::errors::{JointErrors, over_all};
use crate::gait_family::leg::Leg;
use crate::gait_family::limits::Inside;
use crate::gait_family::start::Change;
use crate::gait_family::study::Study;

/// The file `cpg-core/src/gait/family/numbers.rs`.
#[must_use]
pub fn numbers(study: &Study) -> String {
    let mut text = String::from(
        "//! The numbers of the family. Written by `cargo run -p reproduce --example gait_family -- --write`; do not change them by hand.\n\n\
         use crate::gait::family::ends::Ends;\n",
    );
    let inside = study.inside.each_ref().map(|inside| inside.leg.clone());
    for (name, cadences, legs) in [
        ("WALK", study.walk.cadences, &study.walk.ends),
        ("RUN", study.run.cadences, &inside),
        ("RUN_UNSCALED", study.run.cadences, &study.run.ends),
    ] {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\npub(super) const {name}: Ends = Ends {{\n    cadences: {cadences:?},\n    legs: [");
        for leg in legs {
            let _ = writeln!(text, "        [\n{}{}        ],", joint(&leg.hip), joint(&leg.knee));
        }
        let _ = writeln!(text, "    ],\n}};");
    }
    for (name, change) in ["START", "STOP"].into_iter().zip(&study.changes) {
        let counts = (change.phase * 4_294_967_296.0) as u32;
        let _ = writeln!(text, "\npub(super) const {name}_COUNTS: u32 = {};", grouped(counts));
    }
    text
}

/// Mean, cosines and sines of a joint, to 0.001 degrees.
fn joint(series: &Series) -> String {
    let list =
        |of: fn(&(f64, f64)) -> f64| series.terms.iter().map(|term| rounded(of(term))).collect::<Vec<_>>().join(", ");
    let (cos, sin) = (list(|term| term.0), list(|term| term.1));
    format!("            ({}, [{cos}], [{sin}]),\n", rounded(series.mean))
}

fn rounded(value: f64) -> String {
    // Without a minus before zero.
    format!("{:?}", (value * 1e3).round() / 1e3 + 0.0)
}

/// A number with underscores between its thousands.
fn grouped(number: u32) -> String {
    let digits = number.to_string();
    let places = digits.len();
    digits.chars().enumerate().fold(String::new(), |mut text, (n, digit)| {
        if n > 0 && (places - n).is_multiple_of(3) {
            text.push('_');
        }
        text.push(digit);
        text
    })
}

/// The errors of walk and run, the limits, start and stop, in Markdown.
#[must_use]
pub fn tables(study: &Study) -> String {
    let mut text = String::new();
    for (name, fitted) in [("walk", &study.walk), ("run", &study.run)] {
        let _ = writeln!(
            text,
            "| {name} | person | steps a minute | strides | family | mean of the others | family, without the person | mean of the other persons |"
        );
        let _ = writeln!(text, "|---|---|---|---|---|---|---|---|");
        for (one, prediction) in fitted.recordings.iter().zip(&fitted.predictions) {
            let columns = prediction.columns().map(|errors| cell(&errors));
            let source = &one.source;
            let _ = writeln!(
                text,
                "| {} | {} | {:.1} | {} | {} |",
                source.name,
                source.person,
                one.cadence,
                one.strides,
                columns.join(" | ")
            );
        }
        for (words, of) in
            [("all", &fitted.predictions), ("all, without the mean of each joint", &fitted.without_means)]
        {
            let columns = over_all(&fitted.recordings, of).map(|errors| cell(&errors));
            let _ = writeln!(text, "| **{words}** | | | | {} |", columns.join(" | "));
        }
        text.push('\n');
    }
    let _ = writeln!(
        text,
        "| run, inside the limits | hips apart | knees' rate | change of hip / knee |\n|---|---|---|---|"
    );
    for ((cadence, before), inside) in study.run.cadences.into_iter().zip(&study.run.ends).zip(&study.inside) {
        let Inside { leg: after, cost_deg: [hip, knee] } = inside;
        let _ = writeln!(
            text,
            "| {cadence} steps a minute | {:.1} → {:.1} deg | {:.0} → {:.0} deg/s | {hip:.1} / {knee:.1} deg |",
            apart(before),
            apart(after),
            knee_rate(before, cadence),
            knee_rate(after, cadence)
        );
    }
    let _ = writeln!(
        text,
        "\n| recorded | at | phase | error | at the worst phase | best settling time, error with it |\n|---|---|---|---|---|---|"
    );
    for (name, change) in ["start", "stop"].into_iter().zip(&study.changes) {
        let Change { at_s, phase, rmse_deg, worst_rmse_deg, other: (settling_s, other_deg) } = change;
        let _ = writeln!(
            text,
            "| {name} | {at_s:.2} s | {phase:.3} | {rmse_deg:.1} | {worst_rmse_deg:.1} | {settling_s} s, {other_deg:.1} |"
        );
    }
    text
}

/// Left hip, right hip, left knee, right knee.
fn cell(errors: &JointErrors) -> String {
    errors.map(|error| format!("{error:.1}")).join(" ")
}

/// Largest difference of the hips, degrees.
fn apart(leg: &Leg) -> f64 {
    let cycle = leg.cycle();
    (0..POINTS).map(|k| (cycle.0[0][k] - cycle.0[1][k]).abs()).fold(0.0, f64::max)
}

/// Largest rate of a knee, degrees per second.
fn knee_rate(leg: &Leg, cadence: f64) -> f64 {
    let knee = leg.cycle().0[2];
    let step = |k: usize| (knee[(k + 1) % POINTS] - knee[k]).abs();
    (0..POINTS).map(step).fold(0.0, f64::max) * POINTS as f64 * cadence / 120.0
}
