//! The certificate of a network of six or eight joints: measured, written and printed as a table.

use generator_file::network_certificate::{JointRange, NetworkCertificate, certify_network};
use generator_file::network_file::NetworkFile;
use std::path::Path;

use super::return_rows::{accepted, return_rows};
use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::output;

/// Where the certificate of a network goes.
pub(super) struct Outputs<'a> {
    /// The generator file.
    pub(super) generator: &'a Path,
    /// The file to write.
    pub(super) out: &'a Path,
    /// Whether it may be replaced.
    pub(super) overwrite: Overwrite,
    /// Print JSON instead of the table.
    pub(super) json: bool,
}

/// Measures the network; an error if it is refused.
pub(super) fn run(file: &NetworkFile, starts: u32, outputs: &Outputs<'_>) -> Result<(), Failure> {
    output::check_apart([outputs.out], [outputs.generator])?;
    output::check(outputs.out, outputs.overwrite)?;
    let mut progress = |what: &str| messages::status(format_args!("measuring: {what}"));
    let certificate = certify_network(&file.set, starts, &mut progress).map_err(Failure::input)?;
    let json = serde_json::to_string(&certificate).map_err(Failure::run)? + "\n";
    output::write_text(outputs.out, &json, outputs.overwrite)?;
    messages::written(outputs.out);
    output::print(&if outputs.json { json } else { table(&certificate) })?;
    match &certificate.refused_because {
        Some(because) => Err(Failure::run(format!("refused: {because}"))),
        None => Ok(()),
    }
}

fn table(c: &NetworkCertificate) -> String {
    let count = c.joints.len();
    let mut rows = vec![("generator", format!("{}, {count} joints, on the host only", c.generator))];
    rows.extend(return_rows(&c.returns));
    rows.extend(c.joints.iter().map(|joint| (joint.name.as_str(), in_words(joint))));
    rows.push(("accepted", accepted(c.refused_because.as_ref()).into()));
    rows.into_iter().map(|(name, value)| format!("{name:<22} {value}\n")).collect()
}

fn in_words(joint: &JointRange) -> String {
    let [least, most] = joint.range_deg;
    let [low, high] = joint.way_deg;
    let inside = if joint.inside { "inside" } else { "BEYOND" };
    format!(
        "{:.1} to {:.1} deg, peak {:.0} deg/s, from its start on {low:.1} to {high:.1} deg: {inside} {least} to {most} deg",
        joint.least_deg, joint.most_deg, joint.peak_velocity_deg_s
    )
}
