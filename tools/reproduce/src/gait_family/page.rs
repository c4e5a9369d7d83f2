//! What the study gives: the numbers of `cpg-core` as Rust, the tables of `docs/gaits.md` and the picture beside them.

use std::fmt::Write as _;
use std::path::Path;

use cpg_core::gait::family::Member;
use gait_fit::generator_cycle::aligned;
use gait_fit::series::Series;
use gait_trace::stride::cycle::POINTS;
use picture::{Band, Bars, Curve, Panel, draw};

use crate::gait_family::errors::{JointErrors, Prediction, over_all, predictions};
use crate::gait_family::leg::Leg;
use crate::gait_family::limits::{Inside, inside};
use crate::gait_family::model::{Dependence, Model};
use crate::gait_family::recorded::{Recorded, recorded};
use crate::gait_family::start::{Change, start_and_stop};

/// A member that was fitted.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Its recordings, the slowest first.
    pub recordings: Vec<Recorded>,
    /// Lowest and highest cadence, rounded into the recorded range, steps a minute.
    pub cadences: [f64; 2],
    /// The legs at these.
    pub ends: [Leg; 2],
    /// Phase 0 on a leg whose phase is that of [`Leg::of`], in cycles: where the hip is most flexed at the middle of the cadences.
    pub origin: f64,
    /// The errors on what was not fitted.
    pub predictions: Vec<Prediction>,
    /// The same without the mean of each joint.
    pub without_means: Vec<Prediction>,
}

/// The study.
#[derive(Debug, Clone)]
pub struct Study {
    /// The walk.
    pub walk: Fitted,
    /// The run as recorded.
    pub run: Fitted,
    /// The run inside the limits of the default robot, at both ends.
    pub inside: [Inside; 2],
    /// The recorded start and stop.
    pub changes: [Change; 2],
}

/// Does the whole study.
///
/// # Errors
/// A recording is missing or cannot be used; the text names it.
pub fn study(folder: &Path) -> Result<Study, String> {
    let walk = fitted(folder, Member::Walk)?;
    let run = fitted(folder, Member::RunUnscaled)?;
    let [slow, fast] = &run.ends;
    let inside = [inside(slow, run.cadences[0])?, inside(fast, run.cadences[1])?];
    let changes = start_and_stop(folder, walk.origin)?;
    Ok(Study { walk, run, inside, changes })
}

fn fitted(folder: &Path, member: Member) -> Result<Fitted, String> {
    let recordings = recorded(folder, member)?;
    let (Some(slowest), Some(fastest)) = (recordings.first(), recordings.last()) else {
        return Err("no recordings".into());
    };
    let cadences = [(slowest.cadence * 10.0).ceil() / 10.0, (fastest.cadence * 10.0).floor() / 10.0];
    let model = Model::of(&recordings.iter().collect::<Vec<_>>(), Dependence::Linear);
    let origin = model.at(f64::midpoint(cadences[0], cadences[1])).hip.peak();
    let ends = cadences.map(|cadence| model.at(cadence).from_phase(origin));
    let predictions = [false, true].map(|level| predictions(&recordings, level));
    let [predictions, without_means] = predictions;
    Ok(Fitted { cadences, ends, origin, predictions, without_means, recordings })
}

/// The file `cpg-core/src/gait/family/numbers.rs`.
#[must_use]
pub fn numbers(study: &Study) -> String {
    let mut text = String::from(
        "//! The numbers of the family. Written by `cargo run -p reproduce --example gait_family -- --write`; do not change them by hand.\n\n\
         use crate::gait::family::Ends;\n",
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

/// The part of `docs/gaits.md` that is computed: the errors of walk and run, the limits, start and stop.
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
    let legs = study.inside.each_ref().map(|inside| &inside.leg);
    for n in 0..2 {
        let cadence = study.run.cadences[n];
        let [hip, knee] = study.inside[n].cost_deg;
        let (before, after) = (&study.run.ends[n], legs[n]);
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

/// The picture: the family at both ends of its cadences before what was recorded, and the errors without the person.
///
/// The bands are the recordings below and above the middle of the cadences, from the lowest to the highest angle, each recording at the phase of
/// the family and at its mean angle.
///
/// # Errors
/// The message of the drawing library.
pub fn picture(study: &Study) -> Result<String, String> {
    let both = [("walk", &study.walk), ("run", &study.run)];
    let mut panels: Vec<Panel> = both
        .iter()
        .flat_map(|(name, fitted)| {
            [(0, "left hip"), (2, "left knee")].map(|(index, joint)| angles(name, fitted, index, joint))
        })
        .collect();
    for (name, fitted) in both {
        let [_, _, family, mean] = over_all(&fitted.recordings, &fitted.without_means);
        let bar = |name: &str, errors: JointErrors, left: usize| {
            let pooled = (0.5 * (errors[left].powi(2) + errors[left + 1].powi(2))).sqrt();
            Bars { name: name.into(), spans: vec![(0.0, pooled)] }
        };
        let rows = vec![
            bar("hip, family", family, 0),
            bar("hip, mean", mean, 0),
            bar("knee, family", family, 2),
            bar("knee, mean", mean, 2),
        ];
        panels.push(Panel::bars(&format!("{name}, without the person"), "RMSE of the shape, deg", "", rows));
    }
    draw("Walks and runs of persons, and the family", &panels, 2)
}

/// One joint of the family at both ends, before the recordings.
fn angles(name: &str, fitted: &Fitted, index: usize, joint: &str) -> Panel {
    let percent = |k: usize| 100.0 * k as f64 / POINTS as f64;
    let curve = |end: usize| {
        let values = fitted.ends[end].cycle().0[index];
        Curve::new(
            &format!("{} /min", fitted.cadences[end]),
            values.iter().enumerate().map(|(k, y)| (percent(k), *y)).collect(),
        )
    };
    let middle = f64::midpoint(fitted.cadences[0], fitted.cadences[1]);
    let band = |end: usize| {
        let family = fitted.ends[end].cycle();
        let level = |values: &[f64; POINTS]| values.iter().sum::<f64>() / POINTS as f64;
        let of_end = fitted.recordings.iter().filter(|one| (one.cadence > middle) == (end == 1));
        let own: Vec<[f64; POINTS]> = of_end
            .map(|one| {
                let values = aligned(&one.mean, &family).0.0[index];
                let shift = level(&family.0[index]) - level(&values);
                values.map(|angle| angle + shift)
            })
            .collect();
        let edge = |k: usize| {
            let at = own.iter().map(|values| values[k]);
            (percent(k), at.clone().fold(f64::MAX, f64::min), at.fold(f64::MIN, f64::max))
        };
        Band((0..POINTS).map(edge).collect())
    };
    Panel::curves(&format!("{name}, {joint}"), "% of the stride", "deg", vec![curve(0), curve(1)])
        .banded(vec![band(0), band(1)])
}

/// The comments around the computed part of `docs/gaits.md`.
const MARKS: [&str; 2] = ["<!-- computed -->\n", "<!-- end of computed -->\n"];

/// A page with its computed part replaced.
///
/// # Errors
/// The page has no comments that mark the part.
pub fn with_tables(page: &str, tables: &str) -> Result<String, String> {
    let wrong = || format!("the page has no part between `{}` and `{}`", MARKS[0].trim(), MARKS[1].trim());
    let (before, rest) = page.split_once(MARKS[0]).ok_or_else(wrong)?;
    let (_, after) = rest.split_once(MARKS[1]).ok_or_else(wrong)?;
    Ok(format!("{before}{}\n{tables}\n{}{after}", MARKS[0], MARKS[1]))
}
