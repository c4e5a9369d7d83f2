//! `footfall phase-response`: measures by how much a kick shifts the phase of an oscillator or generator, at every phase.

use clap::Args;
use dynamics::cycle::Cycle;
use dynamics::phase_response::{BACK, MOST_CYCLES, Response, lock_range, response};
use dynamics::tongue::unit_force;
use serde_json::json;
use std::fmt::Write as _;

use crate::failure::Failure;
use crate::file::svg::{self, Curve, Panel};
use crate::messages;
use crate::options::system::{ResultFiles, SystemArgument};

/// Options of `footfall phase-response`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Phase 0 is where the first state is largest. A shift is a part of the cycle, positive if the kick advances the phase.\n\
    A kick that does not come back to the limit cycle has no shift: it is reported, and empty in the CSV.\n\n\
    CSV: kick, phase, shift, distance from the cycle at the end in amplitudes."
)]
pub struct Options {
    /// What is analysed
    #[command(flatten)]
    pub system: SystemArgument,
    /// The state that is kicked [default: the first; of a network of joints the velocity of the first joint]
    #[arg(long, value_name = "STATE")]
    pub variable: Option<String>,
    /// Sizes of the kicks in parts of the state's amplitude on the cycle, separated by commas
    #[arg(long, value_name = "PARTS", default_value = "0.1", value_delimiter = ',', allow_hyphen_values = true, value_parser = kick)]
    pub kick: Vec<f64>,
    /// Number of phases
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(4..=10_000))]
    pub phases: u32,
    /// Where the result goes
    #[command(flatten)]
    pub files: ResultFiles,
}

fn kick(text: &str) -> Result<f64, String> {
    let allowed = "allowed is -10 to 10, and not 0";
    text.parse().ok().filter(|size: &f64| size.abs() <= 10.0 && *size != 0.0).ok_or_else(|| allowed.into())
}

/// Runs the command.
///
/// # Errors
/// Wrong input, a system without a limit cycle, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let Some(system) = options.system.read()? else { return Ok(()) };
    options.files.check(&options.system)?;
    let variable = system.kicked(options.variable.as_deref()).map_err(Failure::input)?;
    let cycle = Cycle::of(&system).map_err(Failure::run)?;
    let (name, amplitude) = (&cycle.model.names()[variable], cycle.orbit.amplitude[variable]);
    let curves: Vec<(f64, Vec<Response>)> = options
        .kick
        .iter()
        .map(|&kick| (kick, response(&cycle, variable, kick * amplitude, options.phases as usize)))
        .collect();
    let unit = system.time_unit();
    let mut rows = vec![
        ("system".to_owned(), options.system.in_words()),
        ("period".into(), format!("{:.6} {unit}", cycle.period())),
        ("kicked state".into(), format!("{name}, amplitude {amplitude:.4}")),
    ];
    for (kick, points) in &curves {
        let lost = points.iter().filter(|point| point.shift.is_none()).count();
        if lost > 0 {
            messages::warning(format_args!(
                "{lost} of {} kicks of {kick} amplitudes do not come back within {BACK} amplitudes of the cycle in {MOST_CYCLES} cycles; they have no shift",
                points.len()
            ));
        }
        rows.push((format!("kick of {kick}"), extremes(points)));
    }
    let (least, points) = curves.iter().min_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).expect("at least one kick");
    // In parts of the ratio, for strength 1.
    let weak = lock_range(points, least * amplitude, 1)
        .map(|range| range.map(|r| r * unit_force(&cycle, variable) * cycle.period()));
    if let Some([low, high]) = weak {
        let words = format!("from 1 {low:+.4} S to 1 {high:+.4} S of its own frequency, at strength S");
        rows.push(("a weak input locks 1:1".into(), words));
    }
    if let Some(path) = &options.files.svg {
        let panels = [panel(&curves, name)];
        svg::write(
            path,
            &format!("Phase response of {}", options.system.in_words()),
            &panels,
            options.files.overwrite,
        )?;
    }
    let of_kick = |(kick, points): &(f64, Vec<Response>)| {
        let points: Vec<_> = points
            .iter()
            .map(|p| json!({ "phase": p.phase, "shift": p.shift, "distance": p.distance.is_finite().then_some(p.distance) }))
            .collect();
        json!({ "kick": kick, "points": points })
    };
    let object = json!({
        "system": options.system.in_words(),
        "period": cycle.period(),
        "time_unit": unit,
        "variable": name,
        "amplitude": amplitude,
        "responses": curves.iter().map(of_kick).collect::<Vec<_>>(),
        "weak_lock_per_strength": weak,
    });
    options.files.write(|| csv(&curves), &object, &rows)
}

/// Largest delay and advance, and how many kicks are lost.
fn extremes(points: &[Response]) -> String {
    let found = || points.iter().filter_map(|point| Some((point.shift?, point.phase)));
    let lost = points.iter().filter(|point| point.shift.is_none()).count();
    let lost = if lost > 0 { format!("; {lost} of {} lost", points.len()) } else { String::new() };
    let least = found().min_by(|a, b| a.0.total_cmp(&b.0));
    let most = found().max_by(|a, b| a.0.total_cmp(&b.0));
    match (least, most) {
        (Some(least), Some(most)) => {
            format!("shift {:+.4} at phase {:.3} to {:+.4} at phase {:.3}{lost}", least.0, least.1, most.0, most.1)
        }
        _ => format!("every one of {} lost", points.len()),
    }
}

fn csv(curves: &[(f64, Vec<Response>)]) -> String {
    let mut text = String::from("kick,phase,shift,distance\n");
    for (kick, points) in curves {
        for point in points {
            let shift = point.shift.map_or(String::new(), |shift| format!("{shift:.6}"));
            // A String takes everything.
            let _ = writeln!(text, "{kick},{:.6},{shift},{:.6}", point.phase, point.distance);
        }
    }
    text
}

/// The shifts over the phase, and in grey where any kick is lost.
fn panel(curves: &[(f64, Vec<Response>)], variable: &str) -> Panel {
    let mut shades = vec![];
    let lines = curves
        .iter()
        .map(|(kick, points)| {
            let half = 0.5 / points.len() as f64;
            let mut line: Vec<(f64, f64)> = vec![];
            for point in points {
                match point.shift {
                    None => shades.push(((point.phase - half).max(0.0), (point.phase + half).min(1.0))),
                    Some(shift) => {
                        // A shift of more than half a cycle goes on where it is.
                        let before = line.last().map_or(shift, |last| last.1);
                        line.push((point.phase, shift - (shift - before).round()));
                    }
                }
            }
            Curve::new(&format!("kick {kick}"), line)
        })
        .collect();
    let title = format!("kicks of {variable}, in parts of its amplitude; grey: a kick does not come back");
    Panel::curves(&title, "phase of the kick, cycles", "shift of the phase, cycles", lines).shaded(&shades)
}
