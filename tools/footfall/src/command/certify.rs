//! `footfall certify`: measures a generator and writes its certificate; refuses one that does not come back to its orbit, exceeds the limits of
//! the robot or does not walk on it, and a follower that does not lock from every start.

mod network;
mod return_rows;

use clap::Args;
use generator_file::certificate::{Certificate, certify_subject};
use generator_file::corrected::Corrected;
use generator_file::entrainment::Tongue;
use generator_file::network_file::{HostGenerator, NetworkFile};
use generator_file::subject::Subject;
use joint_loop::LoopConfig;
use joint_units::Joint;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::options::robot::RobotArgument;
use crate::output;
use return_rows::{accepted, return_rows};

/// Options of `footfall certify`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// A generator file, or the name of a default, a gait or a model of the catalogue (see --list)
    #[arg(value_name = "GENERATOR", required_unless_present = "list")]
    pub params: Option<PathBuf>,
    /// Print every name that can be certified, one a line
    #[arg(long, conflicts_with_all = ["params", "out"])]
    pub list: bool,
    /// Number of random starts, of which 95 % must arrive; 20 or more
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(20..=1_000_000))]
    pub starts: u32,
    /// The robot
    #[command(flatten)]
    pub robot: RobotArgument,
    /// The certificate to write [default: GENERATOR with the extension .certificate.json, for a file]
    #[arg(short, long, value_name = "FILE")]
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
    // A file of the name `list` is `./list`.
    let is_list = |params: &Path| options.list || (options.out.is_none() && params.as_os_str() == "list");
    let Some(params) = options.params.as_ref().filter(|params| !is_list(params)) else { return list(options.json) };
    let named = params.to_str().filter(|_| !params.exists()).and_then(Subject::named);
    let is_file = named.is_none();
    let subject = match named {
        Some(subject) => subject,
        // A word without an ending is a name, else the name of a file.
        None if !params.exists() && params.extension().is_none() && params.components().count() == 1 => {
            let names: Vec<&str> = Subject::names().into_iter().map(|(name, _)| name).collect();
            let allowed = names.join(", ");
            return Err(Failure::input(format!(
                "`{}`: allowed is a generator file, or one of {allowed}",
                params.display()
            )));
        }
        None => match HostGenerator::read(params).map_err(Failure::input)? {
            HostGenerator::FourJoints(file) => Subject::Set(file.set),
            HostGenerator::Network(file) => return of_network(options, params, &file),
        },
    };
    let out = options.out.clone().or_else(|| is_file.then(|| beside(params)));
    if let Some(path) = &out {
        let inputs = is_file.then_some(params.as_path()).into_iter().chain(options.robot.robot.as_deref());
        output::check_apart([path.as_path()], inputs)?;
        output::check(path, options.overwrite)?;
    }
    let robot = LoopConfig::of(&options.robot.read()?.robot);
    let mut progress = |what: &str| messages::status(format_args!("measuring: {what}"));
    let certificate = certify_subject(&subject, options.starts, &robot, &mut progress).map_err(Failure::input)?;
    let json = serde_json::to_string(&certificate).map_err(Failure::run)? + "\n";
    if let Some(path) = out {
        output::write_text(&path, &json, options.overwrite)?;
        messages::written(&path);
    }
    output::print(&if options.json { json } else { table(&certificate) })?;
    certificate.refused_because.map_or(Ok(()), |because| Err(Failure::run(format!("refused: {because}"))))
}

/// The certificate of a generator file, where `--out` does not name it.
fn beside(generator: &Path) -> PathBuf {
    generator.with_extension("certificate.json")
}

/// Certifies a network of six or eight joints, for which there is no robot.
fn of_network(options: &Options, generator: &Path, file: &NetworkFile) -> Result<(), Failure> {
    if options.robot.robot.is_some() {
        return Err(Failure::input(format!(
            "--robot with {}, a network of {} joints: no robot has so many, and the ranges are `range_deg` of the file; allowed is --robot with a generator of four joints",
            generator.display(),
            file.set.joints.len()
        )));
    }
    let out = options.out.clone().unwrap_or_else(|| beside(generator));
    let outputs = network::Outputs { generator, out: &out, overwrite: options.overwrite, json: options.json };
    network::run(file, options.starts, &outputs)
}

fn list(json: bool) -> Result<(), Failure> {
    let names = Subject::names();
    if json {
        let names: Vec<_> =
            names.iter().map(|(name, what)| serde_json::json!({ "name": name, "what": what })).collect();
        return output::print(&(serde_json::json!({ "names": names }).to_string() + "\n"));
    }
    output::print(&names.into_iter().map(|(name, what)| format!("{name:<18} {what}\n")).collect::<String>())
}

fn table(c: &Certificate) -> String {
    let mut rows = vec![("generator", c.generator.to_string())];
    rows.extend(return_rows(&c.returns));
    rows.push(("entrained by", c.entrainment_by.clone()));
    rows.extend(c.entrainment.iter().map(|tongue| ("", entrained(tongue))));
    match &c.following {
        Some(following) => rows.extend(following.in_words()),
        None => rows.push(("lock on a person", "no follower".into())),
    }
    rows.extend(c.corrections.iter().flat_map(Corrected::in_words));
    rows.extend([("largest f32 step", format!("{:.1} ms", c.largest_step_ms))]);
    for joint in &c.joints {
        let inside = if joint.inside_gate { "inside the limits" } else { "BEYOND THE LIMITS" };
        rows.push((
            joint.name,
            format!(
                "{:.1} to {:.1} deg, peaks {:.0} deg/s, {:.0} deg/s^2: {inside}",
                joint.least_deg, joint.most_deg, joint.peak_velocity_deg_s, joint.peak_acceleration_deg_s2
            ),
        ));
    }
    rows.extend(c.excesses.iter().map(|excess| ("beyond a limit", excess.to_string())));
    rows.push(("walks", walks(c)));
    rows.push(("accepted", accepted(c.refused_because.as_ref()).into()));
    rows.into_iter().map(|(name, value)| format!("{name:<22} {value}\n")).collect()
}

/// Whether it walks, and what the limits take from it; why it does not, unless the error says it.
fn walks(c: &Certificate) -> String {
    let is_said = |why: &String| c.refused_because.as_ref().is_some_and(|refused| refused.contains(why));
    if c.drive.why_not.as_ref().is_some_and(is_said) {
        return "no".into();
    }
    let mut words = c.drive.in_words();
    if c.drive.walks && c.drive.limited_ticks > 0 {
        let lost = Joint::ALL.iter().zip(c.drive.lost_deg).filter(|(_, lost)| *lost >= 0.005);
        let lost: Vec<String> = lost.map(|(joint, lost)| format!("{} {lost:.2}", joint.name())).collect();
        words += &format!("; they change, RMS degrees: {}", lost.join(", "));
    }
    words
}

fn entrained(tongue: &Tongue) -> String {
    match (tongue.range_hz(), tongue.low.zip(tongue.high)) {
        (Some([low_hz, high_hz]), Some((low, high))) => {
            format!("kap {:.2}: {low_hz:.3} to {high_hz:.3} Hz ({low:.3} to {high:.3} of its own)", tongue.strength)
        }
        _ => format!("kap {:.2}: not even at its own frequency", tongue.strength),
    }
}
