//! `footfall basin`: maps which attractor each start of an oscillator or generator reaches.

use clap::Args;
use dynamics::basin::{Axis, Map, map};
use dynamics::cycle::Cycle;
use dynamics::settle::{Extent, Motion};
use dynamics::system::System;
use picture::cells::Cells;
use serde_json::json;
use std::fmt::Write as _;

use crate::failure::Failure;
use crate::file::svg::{self, Panel};
use crate::options::system::{Assignment, ResultFiles, Span, SystemArgument, middles, progress};

/// Half the default range of an axis, in amplitudes.
const AROUND: f64 = 1.5;

/// Options of `footfall basin`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "An attractor is an equilibrium (rest), a limit cycle, or an oscillation that does not repeat (irregular); a start can also leave: a state reaches\n\
    its bound. Ends within 5 % of the amplitudes, and of the period, are one attractor.\n\n\
    CSV: the two states of the start, the letter of the attractor, its motion, period and amplitude of the first axis' state."
)]
pub struct Options {
    /// What is analysed
    #[command(flatten)]
    pub system: SystemArgument,
    /// State and range of the horizontal axis [default: the first state, within 1.5 amplitudes]
    #[arg(long, value_name = "STATE=FROM..TO")]
    pub x: Option<Span>,
    /// State and range of the vertical axis [default: the second state; of a network of joints the velocity of the first joint]
    #[arg(long, value_name = "STATE=FROM..TO")]
    pub y: Option<Span>,
    /// Start of another state [default: where the cycle has its phase 0]; may be repeated
    #[arg(long, value_name = "STATE=VALUE")]
    pub at: Vec<Assignment>,
    /// Number of starts along each axis
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(2..=1000))]
    pub cells: u32,
    /// Where the result goes
    #[command(flatten)]
    pub files: ResultFiles,
}

/// Runs the command.
///
/// # Errors
/// Wrong input, or a file that cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let Some(system) = options.system.read()? else { return Ok(()) };
    options.files.check(&options.system)?;
    let count = options.cells as usize;
    let plan = Plan::of(&system, options)?;
    let bar = progress(count * count);
    let map = map(&system, &plan.axes(count), &plan.others, &|| bar.inc(1)).map_err(Failure::input)?;
    bar.finish_and_clear();
    let described: Vec<String> =
        map.attractors.iter().map(|end| plan.in_words(end, &map, system.time_unit())).collect();
    let starts = |index: usize| map.cells.iter().filter(|&&cell| cell == index).count();
    let mut rows = vec![
        ("system".to_owned(), options.system.in_words()),
        ("starts".into(), format!("{count} x {count}: {}", plan.spans.each_ref().map(Span::to_string).join(", "))),
    ];
    rows.extend(
        described
            .iter()
            .enumerate()
            .map(|(index, words)| (letter(index), format!("{} starts: {words}", starts(index)))),
    );
    if let Some(path) = &options.files.svg {
        let panels = [plan.panel(&map, count)];
        svg::write(path, &format!("Basins of {}", options.system.in_words()), &panels, options.files.overwrite)?;
    }
    let attractors: Vec<_> = map
        .attractors
        .iter()
        .enumerate()
        .map(|(index, end)| {
            let (period, amplitude) = plan.size(end, &map);
            let at = if let Motion::Rest { at } = end { Some(at) } else { None };
            json!({ "name": letter(index), "motion": end.word(), "starts": starts(index), "period": period, "amplitude": amplitude, "at": at })
        })
        .collect();
    let object = json!({
        "system": options.system.in_words(),
        "time_unit": system.time_unit(),
        "states": plan.names,
        "attractors": attractors,
        "cells": map.cells.chunks(count).collect::<Vec<_>>(),
    });
    options.files.write(|| plan.csv(&map, count), &object, &rows)
}

impl std::fmt::Display for Span {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} from {:.4} to {:.4}", self.name, self.from, self.to)
    }
}

/// A, B, ... and then numbers.
fn letter(index: usize) -> String {
    u8::try_from(index)
        .ok()
        .filter(|index| *index < 26)
        .map_or(format!("{index}"), |i| char::from(b'A' + i).to_string())
}

/// What varies, and where the rest starts.
struct Plan {
    names: Vec<String>,
    spans: [Span; 2],
    variables: [usize; 2],
    others: Vec<f64>,
}

impl Plan {
    fn of(system: &System, options: &Options) -> Result<Self, Failure> {
        let (model, _) = system.model().map_err(Failure::input)?;
        let (names, scale) = (model.names(), system.scale().map_err(Failure::input)?);
        // A system without a cycle begins at its own start.
        let cycle = Cycle::of(system).ok();
        let mut others = cycle.as_ref().map_or_else(|| model.state(), |cycle| cycle.at_start().state());
        let index =
            |option: &str, name: &str| system.variable(name).map_err(|why| Failure::input(format!("{option} {why}")));
        for Assignment { name, value } in &options.at {
            others[index("--at", name)?] = *value;
        }
        let second = if model.has_joint_states() { names.len() / 2 } else { 1 };
        let span = |option: &str, given: &Option<Span>, default: usize| -> Result<(usize, Span), Failure> {
            match given {
                Some(span) => Ok((index(option, &span.name)?, span.clone())),
                None => {
                    let (middle, around) = cycle.as_ref().map_or((model.state()[default], scale[default]), |cycle| {
                        (cycle.orbit.middle[default], cycle.orbit.amplitude[default])
                    });
                    let (from, to) = (middle - AROUND * around, middle + AROUND * around);
                    Ok((default, Span { name: names[default].clone(), from, to }))
                }
            }
        };
        let (x, x_span) = span("--x", &options.x, 0)?;
        let (y, y_span) = span("--y", &options.y, second)?;
        if x == y {
            return Err(Failure::input(format!("--x and --y `{}`: allowed are two different states", x_span.name)));
        }
        Ok(Self { names, spans: [x_span, y_span], variables: [x, y], others })
    }

    fn values(&self, axis: usize, count: usize) -> Vec<f64> {
        middles(self.spans[axis].from, self.spans[axis].to, count)
    }

    fn axes(&self, count: usize) -> [Axis; 2] {
        [0, 1].map(|axis| Axis { variable: self.variables[axis], values: self.values(axis, count) })
    }

    /// Period, and amplitude of the first axis' state.
    fn size(&self, end: &Motion, map: &Map) -> (Option<f64>, Option<f64>) {
        match end {
            Motion::Cycle(extent) | Motion::Irregular(extent) => {
                let Extent { steps, least, most, .. } = extent;
                (Some(steps * map.step), Some(0.5 * (most[self.variables[0]] - least[self.variables[0]])))
            }
            _ => (None, None),
        }
    }

    fn in_words(&self, end: &Motion, map: &Map, unit: &str) -> String {
        let name = &self.names[self.variables[0]];
        match (end, self.size(end, map)) {
            (Motion::Rest { at }, _) => {
                let at: Vec<String> = self.names.iter().zip(at).map(|(name, x)| format!("{name} {x:.4}")).collect();
                format!("rest at {}", at.join(", "))
            }
            (_, (Some(period), Some(amplitude))) => {
                format!("{}, period {period:.4} {unit}, amplitude of {name} {amplitude:.4}", end.word())
            }
            _ => end.word().into(),
        }
    }

    fn csv(&self, map: &Map, count: usize) -> String {
        let [x, y] = [0, 1].map(|axis| self.values(axis, count));
        let mut text = format!("{},{},attractor,motion,period,amplitude\n", self.spans[0].name, self.spans[1].name);
        let shown = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.6}"));
        for (index, &cell) in map.cells.iter().enumerate() {
            let end = &map.attractors[cell];
            let (period, amplitude) = self.size(end, map);
            let (x, y) = (x[index % count], y[index / count]);
            // A String takes everything.
            let _ =
                writeln!(text, "{x:.6},{y:.6},{},{},{},{}", letter(cell), end.word(), shown(period), shown(amplitude));
        }
        text
    }

    fn panel(&self, map: &Map, count: usize) -> Panel {
        let names = map.attractors.iter().enumerate().map(|(index, end)| format!("{}: {}", letter(index), end.word()));
        let [x, y] = self.spans.each_ref().map(|span| (span.from, span.to));
        let classes = map.cells.iter().map(|&cell| Some(cell)).collect();
        let cells = Cells { x, y, columns: count, classes, names: names.collect(), lines: vec![] };
        let [x, y] = self.spans.each_ref().map(|span| format!("{} at the start", span.name));
        Panel::cells("the attractor that each start reaches", &x, &y, cells)
    }
}
