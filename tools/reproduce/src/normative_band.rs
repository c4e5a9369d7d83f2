//! The study behind `gait_fit::normative`: hip and knee of persons who walk, from initial contact on, as mean and standard deviation.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use cpg_core::gait::family::Member;
use gait_fit::contact::CycleStart;
use gait_fit::measures::sample_sd;
use gait_fit::normative::{Band, POINTS};
use gait_trace::stride::cycle::POINTS as CYCLE;
use joint_units::Joint;

use crate::gait_family::recorded::recorded;

/// The bands of all persons.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// The hip.
    pub hip: Band,
    /// The knee.
    pub knee: Band,
    /// Number of persons.
    pub persons: usize,
    /// Lowest and highest cadence, steps a minute.
    pub cadences: (f64, f64),
}

type Curve = [f64; POINTS];

/// Computes the bands from the recordings in a folder.
///
/// # Errors
/// A recording is missing, cannot be used, or has no initial contact; the text names it.
pub fn study(folder: &Path) -> Result<Study, String> {
    let recordings = recorded(folder, Member::Walk)?;
    // Of each person the curves of hips and knees, of all recordings and both legs.
    let mut persons: BTreeMap<&str, [Vec<Curve>; 2]> = BTreeMap::new();
    for one in &recordings {
        let start = CycleStart::of(&one.mean, Some(one.cadence));
        if !start.initial_contact {
            return Err(format!("{}: {}", one.source.name, start.words()));
        }
        let of_person = persons.entry(one.source.person).or_default();
        for joint in Joint::ALL {
            let own = start.own_cycle(&one.mean, joint);
            let curve = std::array::from_fn(|k| own[k * (CYCLE / POINTS)]);
            of_person[usize::from(matches!(joint, Joint::LeftKnee | Joint::RightKnee))].push(curve);
        }
    }
    let means = |which: usize| -> Vec<Curve> { persons.values().map(|curves| mean(&curves[which])).collect() };
    let cadence = |k: usize| recordings.get(k).map_or(f64::NAN, |one| one.cadence);
    Ok(Study {
        hip: band(&means(0))?,
        knee: band(&means(1))?,
        persons: persons.len(),
        cadences: (cadence(0), cadence(recordings.len().saturating_sub(1))),
    })
}

fn mean(curves: &[Curve]) -> Curve {
    std::array::from_fn(|k| curves.iter().map(|curve| curve[k]).sum::<f64>() / curves.len() as f64)
}

fn band(persons: &[Curve]) -> Result<Band, String> {
    let sd = |of: &dyn Fn(&Curve) -> f64| {
        sample_sd(&persons.iter().map(of).collect::<Vec<_>>()).ok_or("one person has no standard deviation")
    };
    let mut sd_deg = [0.0; POINTS];
    for (k, value) in sd_deg.iter_mut().enumerate() {
        *value = sd(&|curve| curve[k])?;
    }
    let range =
        |curve: &Curve| curve.iter().copied().fold(f64::MIN, f64::max) - curve.iter().copied().fold(f64::MAX, f64::min);
    let mean_range = persons.iter().map(range).sum::<f64>() / persons.len() as f64;
    Ok(Band {
        mean_deg: mean(persons),
        sd_deg,
        level_sd_deg: sd(&|curve| curve.iter().sum::<f64>() / POINTS as f64)?,
        range_deg: (mean_range, sd(&range)?),
    })
}

/// The file `tools/gait-fit/src/normative/numbers.rs`, to 0.01 degrees.
#[must_use]
pub fn numbers(study: &Study) -> String {
    let mut text = String::from(
        "//! The numbers of the normative band. Written by `cargo run -p reproduce --example normative_band -- --write`; do not change them by hand.\n\n\
         use super::Band;\n\n",
    );
    // Writing to a String cannot fail.
    let _ = writeln!(text, "pub(super) const PERSONS: usize = {};\n", study.persons);
    let (least, most) = study.cadences;
    let _ = writeln!(text, "pub(super) const CADENCES: (f64, f64) = ({}, {});", rounded(least), rounded(most));
    for (name, band) in [("HIP", &study.hip), ("KNEE", &study.knee)] {
        let _ = writeln!(
            text,
            "\npub(super) const {name}: Band = Band {{\n    mean_deg: [\n{}    ],\n    sd_deg: [\n{}    ],\n    level_sd_deg: {},\n    range_deg: ({}, {}),\n}};",
            rows(&band.mean_deg),
            rows(&band.sd_deg),
            rounded(band.level_sd_deg),
            rounded(band.range_deg.0),
            rounded(band.range_deg.1)
        );
    }
    text
}

/// Ten values a line.
fn rows(values: &Curve) -> String {
    let line = |values: &[f64]| {
        format!("        {},\n", values.iter().map(|value| rounded(*value)).collect::<Vec<_>>().join(", "))
    };
    values.chunks(10).map(line).collect()
}

fn rounded(value: f64) -> String {
    format!("{:?}", (value * 1e2).round() / 1e2 + 0.0)
}
