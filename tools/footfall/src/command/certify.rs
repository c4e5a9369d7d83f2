//! `footfall certify`: measures a generator and writes its certificate; refuses one whose perturbed starts diverge or do not return, and a
//! follower that does not lock from every start.

use clap::Args;
use generator_file::certificate::{Certificate, RETURN_STRIDES, certify};
use generator_file::entrainment::Tongue;
use generator_file::file::GeneratorFile;
use joint_loop::LoopConfig;
use std::path::PathBuf;

use crate::failure::Failure;
use crate::options::overwrite::Overwrite;
use crate::output;

/// Options of `footfall certify`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A generator file, or the name of a default: robust, thesis, thesis-double
    #[arg(value_name = "PARAMS")]
    pub params: PathBuf,
    /// Number of random starts
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub starts: u32,
    /// The certificate to write [default: PARAMS with the extension .certificate.json, for a file]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of the table
    #[arg(long)]
    pub json: bool,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command.
///
/// # Errors
/// Wrong input, a generator that is refused, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let default = options.params.to_str().filter(|_| !options.params.exists()).and_then(GeneratorFile::default_of);
    let is_file = default.is_none();
    let file = match default {
        Some(file) => file,
        None => GeneratorFile::read(&options.params).map_err(Failure::input)?,
    };
    let mut progress = |what: &str| eprintln!("measuring: {what}");
    let certificate =
        certify(&file.set, options.starts, &LoopConfig::default_biped(), &mut progress).map_err(Failure::input)?;
    let json = serde_json::to_string(&certificate).map_err(Failure::run)? + "\n";
    let beside = || options.params.with_extension("certificate.json");
    if let Some(path) = options.out.clone().or_else(|| is_file.then(beside)) {
        output::write_text(&path, &json, options.overwrite)?;
        eprintln!("written: {}", path.display());
    }
    output::print(&if options.json { json } else { table(&certificate) })?;
    match &certificate.refused_because {
        Some(because) => Err(Failure::run(format!("refused: {because}"))),
        None => Ok(()),
    }
}

fn table(c: &Certificate) -> String {
    let mut rows = vec![
        ("generator", c.generator.to_string()),
        ("oscillates", if c.oscillates { "yes" } else { "no" }.to_string()),
        ("period", format!("{:.6} s", c.period_s)),
    ];
    if c.starts == 0 {
        rows.push(("starts", "none: only the phase can be perturbed".into()));
    } else {
        rows.extend([
            (
                "random starts",
                format!("{} of {} on the orbit after 60 strides, {} diverged", c.converged, c.starts, c.diverged),
            ),
            ("perturbed starts", perturbed(c)),
            ("settling after a push", c.settling_s.map_or("not within 100 strides".into(), |s| format!("{s:.2} s"))),
            ("Floquet multipliers", c.multipliers.iter().map(|m| format!("{m:.4}")).collect::<Vec<_>>().join(" ")),
        ]);
    }
    rows.push(("entrained by", c.entrainment_by.clone()));
    rows.extend(c.entrainment.iter().map(|tongue| ("", entrained(tongue))));
    match &c.following {
        Some(following) => rows.extend(following.in_words()),
        None => rows.push(("lock on a person", "no follower".into())),
    }
    rows.extend([("largest f32 step", format!("{:.1} ms", c.largest_step_ms))]);
    for joint in &c.joints {
        let inside = if joint.inside_gate { "inside the gate" } else { "BEYOND THE GATE" };
        rows.push((
            joint.name,
            format!(
                "amplitude {:.2} deg, peaks {:.0} deg/s, {:.0} deg/s^2: {inside}",
                joint.amplitude_deg, joint.peak_velocity_deg_s, joint.peak_acceleration_deg_s2
            ),
        ));
    }
    let accepted = if c.accepted { "yes".into() } else { format!("no; {}", c.status.words()) };
    rows.push(("accepted", accepted));
    rows.into_iter().map(|(name, value)| format!("{name:<22} {value}\n")).collect()
}

fn perturbed(c: &Certificate) -> String {
    let (back, all, diverged) = (c.perturbed_locked, c.perturbed, c.perturbed_diverged.len());
    format!("{back} of {all} back with every phase after {RETURN_STRIDES} strides, {diverged} diverged")
}

fn entrained(tongue: &Tongue) -> String {
    match (tongue.range_hz(), tongue.low.zip(tongue.high)) {
        (Some([low_hz, high_hz]), Some((low, high))) => {
            format!("kap {:.2}: {low_hz:.3} to {high_hz:.3} Hz ({low:.3} to {high:.3} of its own)", tongue.strength)
        }
        _ => format!("kap {:.2}: not even at its own frequency", tongue.strength),
    }
}
