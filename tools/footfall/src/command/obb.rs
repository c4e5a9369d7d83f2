//! `footfall obb`: the firing word of an oscillatory building block.

use clap::{Args, ValueEnum};
use cpg_core::edge_reversal::obb::{Obb, PAPER_POTENTIAL, Reversibilities};
use std::path::PathBuf;

use crate::failure::Failure;
use crate::file::svg::{Bars, Curve, Panel};

/// Options of `footfall obb`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// Reversibilities of flexor and extensor, as `1,5`
    #[arg(long, value_name = "F,E")]
    pub reversibility: String,
    /// How many steps
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub steps: u64,
    /// Where it begins
    #[arg(long, value_enum, default_value_t = Start::Paper)]
    pub start: Start,
    /// Changes, as `54:1,3 100:1,1`: from that step (counted from 0) on, these reversibilities
    #[arg(long, value_name = "STEP:F,E ...", default_value = "")]
    pub switch: String,
    /// One JSON object instead of the word: reversibility, period and duty are those at the end, `stretches` has those from each change
    /// to the next
    #[arg(long)]
    pub json: bool,
    /// Draw membrane potentials, outputs and duty
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Seconds of a step, for the picture's axis: the paper's
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = super::steps::step_seconds)]
    pub step_s: f64,
}

/// Where a block begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Start {
    /// The paper's potentials, flexor 0.35 and extensor 0.65: the first burst is cut short
    Paper,
    /// All tokens at the flexor: the word of the cycle from its first letter
    Full,
}

/// Most steps of a picture.
const MOST_DRAWN: u64 = 10_000;

fn pair(text: &str) -> Option<Reversibilities> {
    let (flexor, extensor) = text.split_once(',')?;
    Reversibilities::new(flexor.trim().parse().ok()?, extensor.trim().parse().ok()?).ok()
}

/// A block stepped through its changes.
pub(crate) struct Course {
    /// A letter a step.
    pub(crate) word: String,
    /// Potentials of flexor and extensor at the beginning of each step, where a picture is wanted.
    potentials: Vec<[f64; 2]>,
    /// Steps of the period that the block has at each step.
    periods: Vec<u32>,
    obb: Obb,
}

impl Course {
    pub(crate) fn of(mut obb: Obb, switches: &[(u64, Reversibilities)], steps: u64, drawn: bool) -> Self {
        let mut course = Self { word: String::new(), potentials: vec![], periods: vec![], obb };
        let mut switches = switches.iter().copied().peekable();
        for step in 0..steps {
            while let Some((_, to)) = switches.next_if(|(at, _)| *at == step) {
                obb.set(to);
            }
            let (flexor, extensor) = obb.potentials();
            if drawn {
                course.potentials.push([f64::from(flexor), f64::from(extensor)]);
                course.periods.push(obb.reversibilities().period());
            }
            course.word.push(obb.step().letter());
        }
        course.obb = obb;
        course
    }

    /// The potentials as the steps that they are.
    pub(crate) fn potentials(&self, step_s: f64, marks: &[(f64, String)]) -> Panel {
        let curve = |name, neuron: usize| {
            let held = self.potentials.iter().enumerate();
            let points = held.flat_map(|(step, m)| [step, step + 1].map(|at| (at as f64 * step_s, m[neuron])));
            Curve::new(name, points.collect())
        };
        let curves = vec![curve("flexor", 0), curve("extensor", 1)];
        Panel::curves("membrane potentials", "time, s", "potential M", curves).marked(marks)
    }

    /// When each neuron is on.
    pub(crate) fn outputs(&self, step_s: f64, marks: &[(f64, String)]) -> Panel {
        let row = |name: &str, letter: char| {
            let on = self.word.chars().enumerate().filter(|(_, fired)| *fired == letter);
            let spans = on.map(|(step, _)| (step as f64 * step_s, (step + 1) as f64 * step_s));
            Bars { name: name.into(), spans: spans.collect() }
        };
        let rows = vec![row("flexor", 'F'), row("extensor", 'E')];
        Panel::bars("outputs: on where a bar is", "time, s", "", rows).marked(marks)
    }

    /// The share of the last period that each neuron was on.
    pub(crate) fn duty(&self, step_s: f64, marks: &[(f64, String)]) -> Panel {
        let letters: Vec<char> = self.word.chars().collect();
        let curve = |name, letter: char| {
            let ends = (1..=letters.len()).filter(|&end| end >= self.periods[end - 1] as usize);
            let points = ends.map(|end| {
                let last = &letters[end - self.periods[end - 1] as usize..end];
                let on = last.iter().filter(|fired| **fired == letter).count();
                (end as f64 * step_s, on as f64 / last.len() as f64)
            });
            Curve::new(name, points.collect())
        };
        let curves = vec![curve("flexor", 'F'), curve("extensor", 'E')];
        Panel::curves("duty over the last period", "time, s", "duty factor", curves).marked(marks)
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, or the picture cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let allowed = "F,E with whole numbers from 1 to 1000000";
    let Some(reversibilities) = pair(&options.reversibility) else {
        return Err(Failure::input(format!(
            "--reversibility `{}`: allowed is {allowed}, such as 1,5",
            options.reversibility
        )));
    };
    let switches = super::steps::switches(&options.switch, pair, allowed)?;
    if let Some((at, _)) = switches.iter().find(|(at, _)| *at >= options.steps) {
        let last = options.steps - 1;
        return Err(Failure::input(format!(
            "--switch at step {at}, --steps {}: allowed are changes at step {last} or before, or more steps",
            options.steps
        )));
    }
    if options.svg.is_some() && options.steps > MOST_DRAWN {
        return Err(Failure::input(format!("--steps {}: allowed with --svg is up to {MOST_DRAWN}", options.steps)));
    }
    let obb = match options.start {
        Start::Paper => Obb::from_potential(reversibilities, PAPER_POTENTIAL).map_err(Failure::input)?,
        Start::Full => Obb::new(reversibilities),
    };
    let course = Course::of(obb, &switches, options.steps, options.svg.is_some());
    if let Some(path) = &options.svg {
        let entries = options.switch.split_whitespace().filter_map(|entry| entry.split_once(':'));
        let marks: Vec<(f64, String)> = switches
            .iter()
            .zip(entries)
            .filter(|((at, _), _)| *at < options.steps)
            .map(|((at, _), (_, to))| (*at as f64 * options.step_s, format!("({to})")))
            .collect();
        let panels = [
            course.potentials(options.step_s, &marks),
            course.outputs(options.step_s, &marks),
            course.duty(options.step_s, &marks),
        ];
        let title = format!("Oscillatory building block ({}), a step is {} s", options.reversibility, options.step_s);
        crate::file::svg::write(path, &title, &panels)?;
    }
    let word = course.word;
    if options.json {
        let now = course.obb.reversibilities();
        let flexor = word.matches('F').count();
        let names = options.switch.split_whitespace().filter_map(|entry| entry.split_once(':'));
        let names: Vec<&str> = std::iter::once(options.reversibility.as_str()).chain(names.map(|(_, to)| to)).collect();
        let starts = std::iter::once((0, reversibilities)).chain(switches.iter().copied());
        let ends = switches.iter().map(|(at, _)| *at).chain([options.steps]);
        let stretch = |(((from, with), to), name): (((u64, Reversibilities), u64), &&str)| {
            // A change at step 0 leaves nothing of the beginning.
            let flexor = word.get(from as usize..to as usize).unwrap_or_default().matches('F').count() as u64;
            serde_json::json!({
                "from_step": from,
                "to_step": to,
                "reversibility": name,
                "period_steps": with.period(),
                "extensor_duty": with.extensor_duty(),
                "flexor_fired": flexor,
                "extensor_fired": to - from - flexor,
            })
        };
        let stretches: Vec<_> = starts.zip(ends).zip(&names).map(stretch).collect();
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
        crate::cli::print(&format!("{object}\n"))
    } else {
        crate::cli::print(&(word + "\n"))
    }
}
