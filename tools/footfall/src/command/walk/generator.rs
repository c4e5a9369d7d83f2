//! `footfall walk --generator`: plays the generator of a file on the host, as CSV, JSON or a picture.

use generator_file::file::GeneratorSet;
use generator_file::host_motion::{Moment, four_joints, of_network, of_set};
use generator_file::network_file::HostGenerator;
use std::fmt::Write as _;
use std::path::Path;

use crate::failure::Failure;
use crate::file::svg::{self, Curve, Panel};
use crate::output;

use super::outputs::Outputs;

/// Reads the file, plays its generator from the start and writes a line every `every_ms` milliseconds.
pub(super) fn run(generator: &Path, secs: f32, every_ms: u32, outputs: &Outputs) -> Result<(), Failure> {
    output::check_apart(outputs.files(), [generator])?;
    let secs = f64::from(secs);
    let (names, moments) = match HostGenerator::read(generator).map_err(Failure::input)? {
        HostGenerator::Network(file) => {
            let names: Vec<String> = file.set.joints.iter().map(|joint| joint.name.clone()).collect();
            (names, of_network(&file.set, secs, every_ms))
        }
        HostGenerator::FourJoints(file) => {
            if let GeneratorSet::Follow(follow) = &file.set {
                let stride_s = follow.shape.stride_s;
                output::notes([format!(
                    "a follower: it gets the {} angle of a simulated person who walks its template at strides of {stride_s} s",
                    follow.sensor.name()
                )]);
            }
            (four_joints().iter().map(|name| (*name).to_owned()).collect(), of_set(&file.set, secs, every_ms))
        }
    };
    let moments = moments.map_err(Failure::input)?;
    let title = || format!("{}, host, {} joints", generator.display(), names.len());
    outputs.write(&text(&names, &moments, outputs.json), |path, overwrite| {
        svg::write(path, &title(), &panels(&names, &moments), overwrite)
    })
}

fn text(joints: &[String], moments: &[Moment], json: bool) -> String {
    let names = || joints.iter().map(String::as_str);
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
fn panels(names: &[String], moments: &[Moment]) -> Vec<Panel> {
    let curve = |joint: usize| {
        let points = moments.iter().map(|moment| (moment.time_s, moment.angles_deg[joint])).collect();
        Curve::new(&names[joint], points)
    };
    let pair = |left: usize| {
        let title = names[left].trim_start_matches("left_").to_owned() + "s";
        Panel::curves(&title, "time, s", "angle, deg", vec![curve(left), curve(left + 1)])
    };
    (0..names.len()).step_by(2).map(pair).collect()
}
