//! `footfall walk --generator`: plays a network of six or eight joints on the host, as CSV, JSON or a picture.

use generator_file::network_file::{HostGenerator, NetworkSet};
use generator_file::network_motion::{Moment, motion};
use std::fmt::Write as _;
use std::path::Path;

use crate::failure::Failure;
use crate::file::svg::{self, Curve, Panel};
use crate::options::overwrite::Overwrite;
use crate::output;

/// Reads the file, plays its network from the start and prints every `every_ms` milliseconds; `picture` is drawn too.
pub(super) fn run(
    generator: &Path,
    secs: f32,
    every_ms: u32,
    json: bool,
    picture: Option<&Path>,
    overwrite: Overwrite,
) -> Result<(), Failure> {
    if let Some(path) = picture {
        output::check_apart([path], [generator])?;
        output::check(path, overwrite)?;
    }
    let file = match HostGenerator::read(generator).map_err(Failure::input)? {
        HostGenerator::Network(file) => file,
        HostGenerator::FourJoints(_) => {
            return Err(Failure::input(format!(
                "{0}: is a generator of four joints; allowed with `walk --generator` is a network of six or eight joints: `cargo xtask run --generator {0}` runs this file",
                generator.display()
            )));
        }
    };
    let moments = motion(&file.set, f64::from(secs), every_ms).map_err(Failure::input)?;
    if let Some(path) = picture {
        let title = format!("{}, host, {} joints", generator.display(), file.set.joints.len());
        svg::write(path, &title, &panels(&file.set, &moments), overwrite)?;
    }
    output::print(&text(&file.set, &moments, json))
}

fn text(set: &NetworkSet, moments: &[Moment], json: bool) -> String {
    let names = || set.joints.iter().map(|joint| joint.name.as_str());
    let mut out = String::new();
    if !json {
        let columns: String = names().map(|name| format!(",{name}_deg")).collect();
        out = format!("time_s{columns}\n");
    }
    for Moment { time_s, phase, angles_deg } in moments {
        // Writing to a String cannot fail.
        let _ = if json {
            let angles: serde_json::Map<_, _> =
                names().zip(angles_deg).map(|(name, angle)| (name.to_owned(), (*angle).into())).collect();
            writeln!(out, "{}", serde_json::json!({ "t_s": time_s, "phase": phase, "angles_deg": angles }))
        } else {
            let angles: String = angles_deg.iter().map(|angle| format!(",{angle:.4}")).collect();
            writeln!(out, "{time_s:.3}{angles}")
        };
    }
    out
}

/// One panel for each pair of joints: left and right over time.
fn panels(set: &NetworkSet, moments: &[Moment]) -> Vec<Panel> {
    let curve = |joint: usize| {
        let points = moments.iter().map(|moment| (moment.time_s, moment.angles_deg[joint])).collect();
        Curve::new(&set.joints[joint].name, points)
    };
    let pair = |left: usize| {
        let title = set.joints[left].name.trim_start_matches("left_").to_owned() + "s";
        Panel::curves(&title, "time, s", "angle, deg", vec![curve(left), curve(left + 1)])
    };
    (0..set.joints.len()).step_by(2).map(pair).collect()
}
