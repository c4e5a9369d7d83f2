//! `footfall hexapod`: which legs swing at each step.

use clap::Args;
use cpg_core::hexapod::{Hexapod, Leg};
use std::path::PathBuf;

use super::svg::{Curve, Panel};
use crate::failure::Failure;

/// Options of `footfall hexapod`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Reversibility of the flexors: 5 wave, 3 middle gait, 1 tripod
    #[arg(long, value_name = "R", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub reversibility: u32,
    /// How many steps
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub steps: u64,
    /// Changes, as `54:3 100:1`: from that step (counted from 0) on, this reversibility
    #[arg(long, value_name = "STEP:R ...", default_value = "")]
    pub switch: String,
    /// One JSON object instead of the words
    #[arg(long)]
    pub json: bool,
    /// Draw the step diagram
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or the picture cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let reversibility = |text: &str| text.parse().ok().filter(|r| (1..=1_000_000).contains(r));
    let mut switches = super::switches(&options.switch, reversibility, "R with a whole number from 1 to 1000000")?
        .into_iter()
        .peekable();
    let mut hexapod = Hexapod::build(options.reversibility).map_err(Failure::input)?;
    let mut steps = vec![];
    for step in 0..options.steps {
        while let Some((_, to)) = switches.next_if(|(at, _)| *at == step) {
            hexapod.set_reversibility(to).map_err(Failure::run)?;
        }
        steps.push(hexapod.step());
    }
    if let Some(path) = &options.svg {
        let panels = Leg::ALL.map(|leg| {
            let swings = steps.iter().enumerate().flat_map(|(step, swings)| {
                let up = if swings.contains(leg) { 1.0 } else { 0.0 };
                [(step as f64, up), (step as f64 + 1.0, up)]
            });
            Panel { title: leg.name().into(), x: "step".into(), curves: vec![Curve::new("swing", swings.collect())] }
        });
        super::svg::write(path, "Hexapod: swing of each leg", &panels)?;
    }
    if options.json {
        let legs: Vec<Vec<&str>> = steps.iter().map(|swings| swings.legs().map(Leg::name).collect()).collect();
        let object = serde_json::json!({ "steps": legs, "reversibility": hexapod.reversibility() });
        crate::cli::print(&format!("{object}\n"))
    } else {
        let words: Vec<String> = steps.iter().map(ToString::to_string).collect();
        crate::cli::print(&(words.join(" ") + "\n"))
    }
}
