//! The normative band of the reports: hip and knee of healthy adults who walk, mean and standard deviation over persons, over the cycle of
//! each leg from its initial contact on.
//!
//! Each person is the mean of that person's recordings and of both legs; the standard deviation is that of the persons (n - 1). The
//! recordings are those of the walk of [`cpg_core::gait::family`], whose licences allow it; their names, licences and SHA-256 are in
//! [`cpg_core::gait::family::SOURCES`]. Contact is estimated as in [`crate::contact`], for the band and for what is compared with it.
//!
//! The numbers are made by `cargo run -p reproduce --example normative_band -- --write`, and a test makes them again.

mod curve;
mod numbers;

use std::collections::{BTreeMap, BTreeSet};

use cpg_core::gait::family::{Member, SOURCES, Source};
use joint_units::Joint;

pub use curve::{Band, POINTS};

/// The band of a joint.
#[must_use]
pub const fn band(joint: Joint) -> &'static Band {
    match joint {
        Joint::LeftHip | Joint::RightHip => &numbers::HIP,
        Joint::LeftKnee | Joint::RightKnee => &numbers::KNEE,
    }
}

/// Number of persons.
pub const PERSONS: usize = numbers::PERSONS;

/// Lowest and highest cadence of the recordings, steps a minute.
pub const CADENCES: (f64, f64) = numbers::CADENCES;

/// The recordings.
pub fn sources() -> impl Iterator<Item = Source> {
    SOURCES.into_iter().filter(|source| source.member == Member::Walk)
}

/// What the band is and what it is not.
#[must_use]
pub fn words() -> String {
    let mut by_licence: BTreeMap<&str, (usize, BTreeSet<&str>)> = BTreeMap::new();
    for source in sources() {
        let (count, origins) = by_licence.entry(source.licence).or_default();
        *count += 1;
        // Several recordings have an origin in common.
        origins.extend(source.origin.split("; "));
    }
    let from = |(licence, (count, origins)): (&str, (usize, BTreeSet<&str>))| {
        format!("{count} under {licence} from {}", origins.into_iter().collect::<Vec<_>>().join(", "))
    };
    let counted: Vec<String> = by_licence.into_iter().map(from).collect();
    format!(
        "Normative band: mean plus and minus one standard deviation over {PERSONS} healthy adults who walk at {:.0} to {:.0} steps a minute \
         ({} recordings: {}). So few persons are no reference of a population. Laboratories define the zero of the hip differently: of the \
         band's width, a standard deviation of {:.1} degrees at the hip and {:.1} at the knee is that of the persons' mean angles.",
        CADENCES.0,
        CADENCES.1,
        sources().count(),
        counted.join("; "),
        band(Joint::LeftHip).level_sd_deg,
        band(Joint::LeftKnee).level_sd_deg
    )
}
