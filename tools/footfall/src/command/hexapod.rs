//! `footfall hexapod`: prints which legs swing at each step, the joint angles of the legs, or the list of all live orientations.

use clap::Args;
use cpg_core::Generator;
use cpg_core::edge_reversal::hexapod::{Hexapod, HexapodError, Leg, Orientation, Swings};
use cpg_core::joints::hexapod_legs::HexapodWalkConfig;
use joint_units::{Period, Radians};
use reproduce::charts::legs::{step_diagram, swings};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::edge_reversal::LadderGait;
use crate::failure::Failure;
use crate::file::svg;
use crate::options::overwrite::Overwrite;
use crate::options::steps::switches;
use crate::options::value::number;
use crate::output;

/// Options of `footfall hexapod`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Reversibility of the flexors: 5 wave, 3 middle gait, 1 tripod [default: 5; with --list 1, where the orientation alone decides the gait]
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub reversibility: Option<u32>,
    /// Where the edges of the ladder point: left side, right side (u up, d down), rungs (l left, r right), each from the top; of two legs the
    /// one to which their edge points swings first. One of the 98 of --list
    #[arg(long, value_name = "SIDE-SIDE-RUNGS", default_value_t = Orientation::WAVE)]
    pub orientation: Orientation,
    /// List the 98 live orientations: circulations of ring, upper and lower cycle (the class), period, and the steps of a period
    #[arg(long, conflicts_with_all = ["orientation", "steps", "switch", "svg", "force", "walk"])]
    pub list: bool,
    /// Number of steps
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub steps: u64,
    /// Changes, as `54:3 100:1`: a step, counted from 0, and the reversibility from this step on
    #[arg(long, value_name = "STEP:R ...", default_value = "", hide_default_value = true)]
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

/// Largest reversibility for --list: the list prints whole periods.
const MOST_LISTED: u32 = 1_000;

/// Columns of the setpoints, in the order of [`Leg::ALL`].
const COLUMNS: [&str; 6] =
    ["top_left_deg", "middle_left_deg", "bottom_left_deg", "top_right_deg", "middle_right_deg", "bottom_right_deg"];

/// Runs the command.
///
/// # Errors
/// Wrong input, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    if options.list {
        return list(options.reversibility.unwrap_or(1), options.json);
    }
    let reversibility = |text: &str| text.parse().ok().filter(|r| (1..=1_000_000).contains(r));
    let allowed = "R with a whole number from 1 to 1000000";
    let switches = switches(&options.switch, reversibility, allowed, options.steps)?;
    if (options.svg.is_some() || options.walk) && options.steps > MOST_SHOWN {
        let steps = options.steps;
        return Err(Failure::input(format!("--steps {steps}: allowed with --svg and --walk is up to {MOST_SHOWN}")));
    }
    options.svg.iter().try_for_each(|path| output::check(path, options.overwrite))?;
    let mut hexapod = start(options)?;
    if options.walk {
        let out = setpoints(options, &switches)?;
        if let Some(path) = &options.svg {
            let steps = swings(&mut hexapod, &switches, options.steps).map_err(Failure::run)?;
            draw(path, options, &steps, &switches)?;
        }
        return output::print(&out);
    }
    let circulation = hexapod.circulation();
    let steps = swings(&mut hexapod, &switches, options.steps).map_err(Failure::run)?;
    if let Some(path) = &options.svg {
        draw(path, options, &steps, &switches)?;
    }
    if options.json {
        let object = serde_json::json!({
            "steps": steps.iter().map(leg_names).collect::<Vec<_>>(),
            "reversibility": hexapod.reversibility(),
            "period_steps": hexapod.period(),
            "orientation": options.orientation.to_string(),
            "circulation": {
                "ring": circulation.ring(),
                "upper": circulation.upper,
                "lower": circulation.lower,
            },
        });
        output::print(&format!("{object}\n"))
    } else {
        let words: Vec<String> = steps.iter().map(ToString::to_string).collect();
        output::print(&(words.join(" ") + "\n"))
    }
}

fn reversibility(options: &Options) -> u32 {
    options.reversibility.unwrap_or(5)
}

fn start(options: &Options) -> Result<Hexapod, Failure> {
    Hexapod::with_orientation(reversibility(options), options.orientation).map_err(|error| match error {
        HexapodError::Dead { .. } => {
            Failure::input(format!("--orientation: {error}; `footfall hexapod --list` lists them"))
        }
        other => Failure::input(format!("--reversibility: {other}")),
    })
}

fn leg_names(swings: &Swings) -> Vec<&'static str> {
    swings.legs().map(Leg::name).collect()
}

fn list(reversibility: u32, json: bool) -> Result<(), Failure> {
    if reversibility > MOST_LISTED {
        let allowed = format!("allowed with --list is up to {MOST_LISTED}");
        return Err(Failure::input(format!("--reversibility {reversibility}: {allowed}")));
    }
    let gaits = LadderGait::all(reversibility)?;
    if json {
        let objects = gaits.iter().map(|gait| {
            serde_json::json!({
                "orientation": gait.orientation.to_string(),
                "circulation": {
                    "ring": gait.circulation.ring(),
                    "upper": gait.circulation.upper,
                    "lower": gait.circulation.lower,
                },
                "transient_steps": gait.transient,
                "period_steps": gait.period.len(),
                "steps": gait.period.iter().map(leg_names).collect::<Vec<_>>(),
            })
        });
        let object = serde_json::json!({ "reversibility": reversibility, "orientations": objects.collect::<Vec<_>>() });
        return output::print(&format!("{object}\n"));
    }
    let mut out = String::from("orientation  ring  upper  lower  period  swings\n");
    for LadderGait { orientation, circulation, period, .. } in &gaits {
        let steps: Vec<String> = period.iter().map(ToString::to_string).collect();
        let [ring, upper, lower] = [circulation.ring(), circulation.upper, circulation.lower];
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "{:11}  {ring:4}  {upper:5}  {lower:5}  {:6}  {}",
            orientation.to_string(),
            period.len(),
            steps.join(" ")
        );
    }
    output::print(&out)
}

fn draw(path: &Path, options: &Options, steps: &[Swings], switches: &[(u64, u32)]) -> Result<(), Failure> {
    let title = match options.orientation {
        Orientation::WAVE => "Hexapod: step diagram".into(),
        other => format!("Hexapod: step diagram, orientation {other}"),
    };
    svg::write(path, &title, &[step_diagram(steps, switches)], options.overwrite)
}

fn setpoints(options: &Options, switches: &[(u64, u32)]) -> Result<String, Failure> {
    let config = HexapodWalkConfig {
        reversibility: reversibility(options),
        orientation: options.orientation,
        step_s: options.step_s as f32,
        ..HexapodWalkConfig::default()
    };
    let mut walk = config.build(Period::MILLISECOND).map_err(Failure::input)?;
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
