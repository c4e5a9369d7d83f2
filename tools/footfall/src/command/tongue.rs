//! `footfall tongue`: maps which periodic inputs lock an oscillator or generator (Arnold tongues).

use clap::Args;
use dynamics::cycle::Cycle;
use dynamics::phase_response::{lock_range, response};
use dynamics::tongue::{Cell, LONGEST, Pair, SETTLE, SLIP, Verdict, WATCH, map, unit_force};
use picture::cells::Cells;
use serde_json::json;
use std::fmt::Write as _;

use crate::failure::Failure;
use crate::file::svg::{self, Panel};
use crate::options::system::{ResultFiles, SystemArgument, middles, progress, range};
use crate::options::value::number;

/// Kick of the phase response from which the weak lock ranges are predicted, in amplitudes.
const SMALL_KICK: f64 = 0.05;
/// Phases of that response.
const PHASES: usize = 60;

/// Options of `footfall tongue`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "The input is A cos(2 pi F t), added to the derivative of one state. Its ratio is F divided by the own frequency, its strength is A divided by\n\
    the amplitude of the state and by 2 pi times the own frequency. A cell is locked n:m if the phase against n/m of the input changes by less than\n\
    0.02 of a cycle in 40 cycles of the input or more, after 20: a winding number within 0.0005. It slips if the phase changes by a whole cycle.\n\
    A cell that does neither within 640 cycles is undecided.\n\n\
    CSV: ratio, strength, force A, winding number, verdict (n:m, slips, undecided or leaves)."
)]
pub struct Options {
    /// What is analysed
    #[command(flatten)]
    pub system: SystemArgument,
    /// The state on which the input acts [default: the first; of a network of joints the velocity of the first joint]
    #[arg(long, value_name = "STATE")]
    pub variable: Option<String>,
    /// Frequencies of the input, divided by the own one
    #[arg(long, value_name = "FROM..TO", default_value = "0.4..2.2", value_parser = ratios)]
    pub ratio: (f64, f64),
    /// Largest strength of the input
    #[arg(long, value_name = "S", default_value_t = 0.6, value_parser = number(1e-4..=100.0, ""))]
    pub strength: f64,
    /// Pairs n:m, n cycles to m of the input, separated by commas
    #[arg(long, value_name = "N:M", default_value = "1:1,1:2,2:1,2:3,3:2", value_delimiter = ',', value_parser = pair)]
    pub lock: Vec<Pair>,
    /// Number of ratios
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(2..=2000))]
    pub columns: u32,
    /// Number of strengths
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=2000))]
    pub rows: u32,
    /// Where the result goes
    #[command(flatten)]
    pub files: ResultFiles,
}

fn ratios(text: &str) -> Result<(f64, f64), String> {
    let allowed = "allowed is FROM..TO from 0.05 to 20, with FROM below TO, such as 0.4..2.2";
    range(text).ok().filter(|(from, to)| *from >= 0.05 && *to <= 20.0).ok_or_else(|| allowed.into())
}

fn pair(text: &str) -> Result<Pair, String> {
    let parts = text.split_once(':').and_then(|(n, m)| Some((n.parse().ok()?, m.parse().ok()?)));
    let allowed = "allowed is N:M with whole numbers from 1 to 9, such as 1:2";
    parts.filter(|(n, m)| (1..=9).contains(n) && (1..=9).contains(m)).ok_or_else(|| allowed.into())
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
    let (columns, rows) = (options.columns as usize, options.rows as usize);
    let ratios = middles(options.ratio.0, options.ratio.1, columns);
    let strengths = middles(0.0, options.strength, rows);
    let bar = progress(columns * rows);
    let cells = map(&cycle, variable, &ratios, &strengths, &options.lock, &|| bar.inc(1));
    bar.finish_and_clear();
    let name = &cycle.model.names()[variable];
    if let Some(path) = &options.files.svg {
        let panels = [panel(options, &cycle, variable, &cells)];
        svg::write(path, &format!("Lock ranges of {}", options.system.in_words()), &panels, options.files.overwrite)?;
    }
    let (unit, force) = (system.time_unit(), unit_force(&cycle, variable));
    let mut table = vec![
        ("system".to_owned(), options.system.in_words()),
        ("period".into(), format!("{:.6} {unit}", cycle.period())),
        ("input".into(), format!("on {name}; strength 1 is a force of {force:.6}")),
        (
            "locked".into(),
            format!(
                "winding number within {:.4} over {WATCH} to {LONGEST} cycles of the input, after {SETTLE}",
                SLIP / WATCH
            ),
        ),
    ];
    for (index, (n, m)) in options.lock.iter().enumerate() {
        let locked: Vec<&Cell> = cells.iter().filter(|cell| cell.verdict == Verdict::Locked(index)).collect();
        let words = match locked.last().map(|last| last.input.strength) {
            None => "no cell".into(),
            Some(strongest) => {
                let top = locked.iter().filter(|cell| cell.input.strength == strongest).map(|cell| cell.input.ratio);
                let (low, high) = top.fold((f64::MAX, f64::MIN), |(low, high), r| (low.min(r), high.max(r)));
                format!("{} cells; at strength {strongest:.3} the ratios {low:.3} to {high:.3}", locked.len())
            }
        };
        table.push((format!("{n}:{m}"), words));
    }
    let undecided = cells.iter().filter(|cell| cell.verdict == Verdict::Undecided).count();
    table.push(("undecided".into(), format!("{undecided} of {} cells", cells.len())));
    let verdict = |cell: &Cell| match cell.verdict {
        Verdict::Locked(index) => format!("{}:{}", options.lock[index].0, options.lock[index].1),
        Verdict::Slips => "slips".into(),
        Verdict::Undecided => "undecided".into(),
        Verdict::Leaves => "leaves".into(),
    };
    let object = json!({
        "system": options.system.in_words(),
        "period": cycle.period(),
        "time_unit": unit,
        "variable": name,
        "force_of_strength_1": force,
        "cells": cells.iter().map(|cell| json!({
            "ratio": cell.input.ratio,
            "strength": cell.input.strength,
            "winding": cell.winding.is_finite().then_some(cell.winding),
            "verdict": verdict(cell),
        })).collect::<Vec<_>>(),
    });
    let csv = || {
        let mut text = String::from("ratio,strength,force,winding,verdict\n");
        for cell in &cells {
            let winding = if cell.winding.is_finite() { format!("{:.6}", cell.winding) } else { String::new() };
            let (input, a) = (cell.input, cell.input.force(&cycle));
            // A String takes everything.
            let _ = writeln!(text, "{:.6},{:.6},{a:.6},{winding},{}", input.ratio, input.strength, verdict(cell));
        }
        text
    };
    options.files.write(csv, &object, &table)
}

/// The map, with the borders that the phase response predicts for a weak input.
fn panel(options: &Options, cycle: &Cycle, variable: usize, cells: &[Cell]) -> Panel {
    let mut names: Vec<String> = options.lock.iter().map(|(n, m)| format!("{n}:{m}")).collect();
    names.push("undecided".into());
    if cells.iter().any(|cell| cell.verdict == Verdict::Leaves) {
        names.push("leaves".into());
    }
    let pairs = options.lock.len();
    let class = |cell: &Cell| match cell.verdict {
        Verdict::Locked(index) => Some(index),
        Verdict::Slips => None,
        Verdict::Undecided => Some(pairs),
        Verdict::Leaves => Some(pairs + 1),
    };
    let size = SMALL_KICK * cycle.orbit.amplitude[variable];
    let points = response(cycle, variable, size, PHASES);
    let borders = options.lock.iter().filter(|(n, _)| *n == 1).filter_map(|&(_, m)| {
        let range = lock_range(&points, size, m)?;
        let slopes = range.map(|range| range * unit_force(cycle, variable) * cycle.period());
        Some(slopes.map(|slope| {
            (0..=100).map(|k| f64::from(k) / 100.0 * options.strength).map(|s| (f64::from(m) + slope * s, s)).collect()
        }))
    });
    let map = Cells {
        x: options.ratio,
        y: (0.0, options.strength),
        columns: options.columns as usize,
        classes: cells.iter().map(class).collect(),
        names,
        lines: borders.flatten().collect(),
    };
    let title = "n:m, n cycles to m of the input; black: borders for a weak input, from the phase response";
    Panel::cells(title, "frequency of the input / own frequency", "strength of the input", map)
}
