//! `footfall obb`: the firing word of an oscillatory building block.

use clap::{Args, ValueEnum};
use cpg_core::obb::{Neuron, Obb, PAPER_POTENTIAL, Reversibilities};
use std::path::PathBuf;

use super::svg::{Curve, Panel};
use crate::failure::Failure;

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
    /// One JSON object instead of the word
    #[arg(long)]
    pub json: bool,
    /// Draw potentials and firing
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

/// Where a block begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Start {
    /// The paper's potentials, flexor 0.35 and extensor 0.65: the first burst is cut short
    Paper,
    /// All tokens at the flexor: the word of the cycle from its first letter
    Full,
}

fn pair(text: &str) -> Option<Reversibilities> {
    let (flexor, extensor) = text.split_once(',')?;
    Reversibilities::build(flexor.trim().parse().ok()?, extensor.trim().parse().ok()?).ok()
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
    let mut switches = super::switches(&options.switch, pair, allowed)?.into_iter().peekable();
    let mut obb = match options.start {
        Start::Paper => Obb::from_potential(reversibilities, PAPER_POTENTIAL).map_err(Failure::input)?,
        Start::Full => Obb::new(reversibilities),
    };
    let mut word = String::new();
    let mut curves = [vec![], vec![], vec![], vec![]];
    for step in 0..options.steps {
        while let Some((_, to)) = switches.next_if(|(at, _)| *at == step) {
            obb.set(to);
        }
        let (flexor, extensor) = obb.potentials();
        let fired = obb.step();
        word.push(fired.letter());
        if options.svg.is_some() {
            let on = |neuron| if fired == neuron { 1.0 } else { 0.0 };
            let values = [f64::from(flexor), f64::from(extensor), on(Neuron::Flexor), on(Neuron::Extensor)];
            for (curve, value) in curves.iter_mut().zip(values) {
                curve.extend([(step as f64, value), (step as f64 + 1.0, value)]);
            }
        }
    }
    if let Some(path) = &options.svg {
        let [flexor, extensor, flexor_on, extensor_on] = curves;
        let panel = |title: &str, a, b| Panel {
            title: title.into(),
            x: "step".into(),
            curves: vec![Curve::new("flexor", a), Curve::new("extensor", b)],
        };
        let panels = [panel("membrane potential", flexor, extensor), panel("firing", flexor_on, extensor_on)];
        super::svg::write(path, "Oscillatory building block", &panels)?;
    }
    if options.json {
        let now = obb.reversibilities();
        let flexor = word.matches('F').count();
        let object = serde_json::json!({
            "word": word,
            "steps": options.steps,
            "reversibility": options.reversibility,
            "period_steps": now.period(),
            "extensor_duty": now.extensor_duty(),
            "flexor_fired": flexor,
            "extensor_fired": word.len() - flexor,
        });
        crate::cli::print(&format!("{object}\n"))
    } else {
        crate::cli::print(&(word + "\n"))
    }
}
