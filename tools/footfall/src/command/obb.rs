//! `footfall obb`: prints the firing word of an oscillatory building block.

use clap::{Args, ValueEnum};
use cpg_core::edge_reversal::obb::{Obb, PAPER_POTENTIAL, Reversibilities};
use reproduce::charts::block::BlockRun;
use std::path::PathBuf;

use crate::failure::Failure;
use crate::file::svg;
use crate::options::overwrite::Overwrite;
use crate::options::steps::switches;
use crate::options::value::number;
use crate::output;

/// Options of `footfall obb`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Reversibilities of flexor and extensor, as `1,5`: the smaller one is on for longer, here the flexor for 5 of 6 steps
    #[arg(long, value_name = "F,E")]
    pub reversibility: String,
    /// Number of steps
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub steps: u64,
    /// The start
    #[arg(long, value_enum, default_value_t = Start::Paper)]
    pub start: Start,
    /// Changes, as `54:1,3 100:1,1`: a step, counted from 0, and the reversibilities from this step on; tokens are rounded down to a multiple
    /// of the new common divisor
    #[arg(long, value_name = "STEP:F,E ...", default_value = "", hide_default_value = true)]
    pub switch: String,
    /// Print one JSON object instead of the word: reversibility, period and duty at the end, and in `stretches` from each change to the
    /// next, with the flexor's potential at its beginning
    #[arg(long)]
    pub json: bool,
    /// Draw membrane potentials, outputs and duty
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Seconds of a step, for the axis of the picture; 3 as in the paper
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = number(0.05..=60.0, " seconds"))]
    pub step_s: f64,
}

/// The start of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Start {
    /// The paper's potentials, flexor 0.35 and extensor 0.65, rounded to a whole number of tokens: the first burst may be longer or shorter than
    /// the later ones
    Paper,
    /// All tokens at the flexor: the word of the cycle from its first letter
    Full,
}

/// Largest number of steps in a picture.
const MOST_DRAWN: u64 = 10_000;

fn pair(text: &str) -> Option<Reversibilities> {
    let (flexor, extensor) = text.split_once(',')?;
    Reversibilities::new(flexor.trim().parse().ok()?, extensor.trim().parse().ok()?).ok()
}

/// Runs the command.
///
/// # Errors
/// Wrong input, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let allowed = "F,E with whole numbers from 1 to 1000000";
    let Some(reversibilities) = pair(&options.reversibility) else {
        return Err(Failure::input(format!(
            "--reversibility `{}`: allowed is {allowed}, such as 1,5",
            options.reversibility
        )));
    };
    let switches = switches(&options.switch, pair, allowed, options.steps)?;
    if options.svg.is_some() && options.steps > MOST_DRAWN {
        return Err(Failure::input(format!("--steps {}: allowed with --svg is up to {MOST_DRAWN}", options.steps)));
    }
    options.svg.iter().try_for_each(|path| output::check(path, options.overwrite))?;
    let obb = match options.start {
        Start::Paper => Obb::from_potential(reversibilities, PAPER_POTENTIAL).map_err(Failure::input)?,
        Start::Full => Obb::new(reversibilities),
    };
    let course = BlockRun::of(obb, &switches, options.steps, options.svg.is_some());
    if let Some(path) = &options.svg {
        let entries = options.switch.split_whitespace().filter_map(|entry| entry.split_once(':'));
        let marks: Vec<(f64, String)> = switches
            .iter()
            .zip(entries)
            .map(|((at, _), (_, to))| (*at as f64 * options.step_s, format!("({to})")))
            .collect();
        let panels = [
            course.potentials(options.step_s, &marks),
            course.outputs(options.step_s, &marks),
            course.duty(options.step_s, &marks),
        ];
        let title = format!("Oscillatory building block ({}), a step is {} s", options.reversibility, options.step_s);
        svg::write(path, &title, &panels, options.overwrite)?;
    }
    let word = &course.word;
    if options.json {
        let now = course.obb.reversibilities();
        let flexor = word.matches('F').count();
        let names = options.switch.split_whitespace().filter_map(|entry| entry.split_once(':'));
        let names: Vec<&str> = std::iter::once(options.reversibility.as_str()).chain(names.map(|(_, to)| to)).collect();
        let starts = std::iter::once((0, reversibilities)).chain(switches.iter().copied());
        let ends: Vec<u64> = switches.iter().map(|(at, _)| *at).chain([options.steps]).collect();
        let stretch = |(index, (from, with)): (usize, (u64, Reversibilities))| {
            let (to, name, potential) = (ends[index], names[index], course.starts[index]);
            // After a change at step 0 the first stretch is empty.
            let flexor = word.get(from as usize..to as usize).unwrap_or_default().matches('F').count() as u64;
            serde_json::json!({
                "from_step": from,
                "to_step": to,
                "reversibility": name,
                "period_steps": with.period(),
                "extensor_duty": with.extensor_duty(),
                "flexor_potential": potential,
                "flexor_fired": flexor,
                "extensor_fired": to - from - flexor,
            })
        };
        let stretches: Vec<_> = starts.enumerate().map(stretch).collect();
        let object = serde_json::json!({
            "word": word,
            "steps": options.steps,
            "reversibility": names.last(),
            "period_steps": now.period(),
            "extensor_duty": now.extensor_duty(),
            "flexor_fired": flexor,
            "extensor_fired": word.len() - flexor,
            "stretches": stretches,
        });
        output::print(&format!("{object}\n"))
    } else {
        output::print(&format!("{word}\n"))
    }
}
