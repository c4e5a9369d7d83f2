//! `footfall hexapod`: prints which legs swing at each step, or the joint angles of the legs.

use clap::Args;
use cpg_core::Generator;
use cpg_core::edge_reversal::hexapod::{Hexapod, Leg, Swings};
use cpg_core::joints::hexapod_legs::HexapodWalkConfig;
use joint_units::{Period, Radians};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::edge_reversal::{step_diagram, swings};
use crate::failure::Failure;
use crate::file::svg;
use crate::options::overwrite::Overwrite;
use crate::options::steps::switches;
use crate::options::value::number;
use crate::output;

/// Options of `footfall hexapod`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Reversibility of the flexors: 5 wave, 3 middle gait, 1 tripod
    #[arg(long, value_name = "R", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub reversibility: u32,
    /// Number of steps
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub steps: u64,
    /// Changes, as `54:3 100:1`: a step, counted from 0, and the reversibility from this step on
    #[arg(long, value_name = "STEP:R ...", default_value = "")]
    pub switch: String,
    /// Print one JSON object instead of the words
    #[arg(long)]
    pub json: bool,
    /// Draw the step diagram
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Print the angles of the six legs instead of the words: CSV, or with --json one object a line
    #[arg(long)]
    pub walk: bool,
    /// Seconds of a step, for --walk
    #[arg(long, value_name = "S", default_value_t = 0.5, value_parser = number(0.05..=60.0, " seconds"), requires = "walk")]
    pub step_s: f64,
    /// Milliseconds from one line to the next, for --walk
    #[arg(long, value_name = "MS", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000), requires = "walk")]
    pub every_ms: u32,
}

/// Largest number of steps for a picture or for --walk.
const MOST_SHOWN: u64 = 10_000;

/// Columns of the setpoints, in the order of [`Leg::ALL`].
const COLUMNS: [&str; 6] =
    ["top_left_deg", "middle_left_deg", "bottom_left_deg", "top_right_deg", "middle_right_deg", "bottom_right_deg"];

/// Runs the command.
///
/// # Errors
/// Wrong input, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let reversibility = |text: &str| text.parse().ok().filter(|r| (1..=1_000_000).contains(r));
    let switches = switches(&options.switch, reversibility, "R with a whole number from 1 to 1000000")?;
    if (options.svg.is_some() || options.walk) && options.steps > MOST_SHOWN {
        let steps = options.steps;
        return Err(Failure::input(format!("--steps {steps}: allowed with --svg and --walk is up to {MOST_SHOWN}")));
    }
    options.svg.iter().try_for_each(|path| output::check(path, options.overwrite))?;
    let mut hexapod = Hexapod::new(options.reversibility).map_err(Failure::input)?;
    if options.walk {
        let out = setpoints(options, &switches)?;
        if let Some(path) = &options.svg {
            let steps = swings(&mut hexapod, &switches, options.steps)?;
            draw(path, &steps, &switches, options.overwrite)?;
        }
        return output::print(&out);
    }
    let steps = swings(&mut hexapod, &switches, options.steps)?;
    if let Some(path) = &options.svg {
        draw(path, &steps, &switches, options.overwrite)?;
    }
    if options.json {
        let legs: Vec<Vec<&str>> = steps.iter().map(|swings| swings.legs().map(Leg::name).collect()).collect();
        let object = serde_json::json!({ "steps": legs, "reversibility": hexapod.reversibility() });
        output::print(&format!("{object}\n"))
    } else {
        let words: Vec<String> = steps.iter().map(ToString::to_string).collect();
        output::print(&(words.join(" ") + "\n"))
    }
}

fn draw(path: &Path, steps: &[Swings], switches: &[(u64, u32)], overwrite: Overwrite) -> Result<(), Failure> {
    svg::write(path, "Hexapod: step diagram", &[step_diagram(steps, switches)], overwrite)
}

fn setpoints(options: &Options, switches: &[(u64, u32)]) -> Result<String, Failure> {
    let config = HexapodWalkConfig { step_s: options.step_s as f32, ..HexapodWalkConfig::default() };
    let mut walk = HexapodWalkConfig { reversibility: options.reversibility, ..config }
        .build(Period::MILLISECOND)
        .map_err(Failure::input)?;
    let ticks_of = |step: u64| (step as f64 * options.step_s * 1e3).round() as u64;
    let mut switches = switches.iter().peekable();
    let mut out = String::new();
    if !options.json {
        let _ = writeln!(out, "time_s,{}", COLUMNS.join(","));
    }
    for tick in 0..=ticks_of(options.steps) {
        while let Some((_, to)) = switches.next_if(|(at, _)| ticks_of(*at) <= tick) {
            walk.set_reversibility(*to).map_err(Failure::run)?;
        }
        if tick % u64::from(options.every_ms) == 0 {
            let (t, angles) = (tick as f64 * 1e-3, walk.angles().map(Radians::degrees));
            // Writing to a String cannot fail.
            let _ = if options.json {
                let object = serde_json::json!({
                    "t_s": t,
                    "reversibility": walk.ladder().reversibility(),
                    "angles_deg": angles,
                    "rates_deg_s": walk.rates().map(|rate| rate.0.to_degrees()),
                });
                writeln!(out, "{object}")
            } else {
                writeln!(out, "{t:.3},{}", angles.map(|angle| format!("{angle:.4}")).join(","))
            };
        }
        walk.step();
    }
    Ok(out)
}
