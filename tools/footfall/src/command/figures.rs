//! `footfall figures`: draws the figures of the two papers, computed by the core.
//!
//! Thesis: single Rayleigh oscillators (figures 2.4 to 2.8) and the network with Table 1, set S (5.1 to 5.6). Yang et al. 2014: the
//! membrane potentials and outputs of the building block through (1,5), (1,3), (1,1) (figure 3), its duty (figure 4), and the steps of
//! the hexapod through the same three gaits.

use clap::Args;
use cpg_core::Generator;
use cpg_core::OscillatorState;
use cpg_core::edge_reversal::hexapod::Hexapod;
use cpg_core::edge_reversal::obb::{Obb, PAPER_POTENTIAL, Reversibilities};
use cpg_core::gait::named::Gait;
use cpg_core::oscillator::rayleigh::{Rayleigh, RayleighConfig};
use joint_units::{Joint, Period};
use picture::draw;
use std::path::PathBuf;

use crate::edge_reversal::{BlockRun, step_diagram, swings};
use crate::failure::Failure;
use crate::file::svg::{Curve, Panel};
use crate::options::overwrite::Overwrite;
use crate::output;
use crate::view::gait_charts::{self, Motion};

/// Options of `footfall figures`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The folder to write to; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub out: PathBuf,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command.
///
/// # Errors
/// A file exists and may not be replaced, or it cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    let folder = &options.out;
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::input(format!("{}: cannot be made: {error}", folder.display())))?;
    let mut figures = vec![];
    single_oscillators(&mut figures)?;
    network(&mut figures)?;
    block(&mut figures)?;
    let switches = [(54, 3), (100, 1)];
    let mut legs = Hexapod::new(5).map_err(Failure::run)?;
    let diagram = step_diagram(&swings(&mut legs, &switches, 120)?, &switches);
    figures.push(Figure { name: "hexapod-steps".into(), title: "Hexapod: step diagram".into(), panels: vec![diagram] });

    let path = |figure: &Figure| folder.join(format!("{}.svg", figure.name));
    figures.iter().try_for_each(|figure| output::check(&path(figure), options.overwrite))?;
    // These are listed on standard output.
    for figure in &figures {
        let picture = draw(&figure.title, &figure.panels, 1).map_err(Failure::run)?;
        output::write_text(&path(figure), &picture, options.overwrite)?;
    }
    output::print(&figures.iter().map(|figure| format!("{}\n", path(figure).display())).collect::<String>())
}

/// One picture.
struct Figure {
    /// The name of its file, without extension.
    name: String,
    title: String,
    panels: Vec<Panel>,
}

/// What a picture of a single oscillator shows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shows {
    Time,
    Portrait,
    Both,
}

/// Figure, (alpha, p, mu), seconds. 2.4 and 2.5 are of one set.
const SINGLE: [(&str, [f32; 3], f32, Shows); 5] = [
    ("2-4", [1.0, 5.0, 0.5], 60.0, Shows::Time),
    ("2-5", [1.0, 5.0, 0.5], 60.0, Shows::Portrait),
    ("2-6", [1.0, 50.0, 0.5], 60.0, Shows::Both),
    ("2-7", [1.0, 5.0, 1.0], 40.0, Shows::Both),
    ("2-8", [1.0, 1.0, 0.2], 200.0, Shows::Both),
];

fn single_oscillators(figures: &mut Vec<Figure>) -> Result<(), Failure> {
    for (figure, [alpha, p, mu], seconds, shows) in SINGLE {
        let config = RayleighConfig { alpha, p, mu, offset: 0.0 };
        // From near rest and from beyond the cycle: both end on it.
        let inside = single(config, 0.05, seconds)?;
        let outside = single(config, 2.5, seconds)?;
        let over_time = |title: &str, y: &str, of: fn(&(f64, f64, f64)) -> f64| {
            let curve =
                |name, points: &[(f64, f64, f64)]| Curve::new(name, points.iter().map(|p| (p.0, of(p))).collect());
            Panel::curves(title, "time, s", y, vec![curve("from near rest", &inside), curve("from outside", &outside)])
        };
        let angle = over_time("angle", "angle, deg", |p| p.1);
        let velocity = over_time("angular velocity", "velocity, deg/s", |p| p.2);
        let curve = |name, points: &[(f64, f64, f64)]| Curve::new(name, points.iter().map(|p| (p.1, p.2)).collect());
        let curves = vec![curve("from near rest", &inside), curve("from outside", &outside)];
        let portrait = Panel::curves("limit cycle", "angle, deg", "velocity, deg/s", curves);
        let panels = match shows {
            Shows::Time => vec![angle, velocity],
            Shows::Portrait => vec![portrait],
            Shows::Both => vec![angle, velocity, portrait],
        };
        let title =
            format!("Rayleigh oscillator, alpha = {alpha}, p = {p}, mu = {mu} (thesis, figure {})", dotted(figure));
        figures.push(Figure { name: format!("thesis-{figure}"), title, panels });
    }
    Ok(())
}

fn dotted(figure: &str) -> String {
    figure.replace('-', ".")
}

/// Time, angle and velocity of an oscillator that begins at a part of its harmonic amplitude, 1000 points or so.
fn single(config: RayleighConfig, part: f32, seconds: f32) -> Result<Vec<(f64, f64, f64)>, Failure> {
    let mut oscillator: Rayleigh = config.build(Period::MILLISECOND).map_err(Failure::run)?;
    let OscillatorState { displacement: [built], .. } = oscillator.state();
    let start = OscillatorState { displacement: [part * built], velocity: [0.0] };
    oscillator.set_state(&start).map_err(Failure::run)?;
    let ticks = (seconds * 1e3) as u32;
    let every = (ticks / 1500).max(1);
    let mut points = vec![];
    for tick in 0..=ticks {
        if tick % every == 0 {
            let ([angle], [rate]) = (oscillator.angles(), oscillator.rates());
            points.push((f64::from(tick) * 1e-3, f64::from(angle.degrees()), f64::from(rate.0.to_degrees())));
        }
        oscillator.step();
    }
    Ok(points)
}

fn network(figures: &mut Vec<Figure>) -> Result<(), Failure> {
    let mut gait = Gait::Thesis.build(1.0, Period::MILLISECOND).map_err(Failure::run)?;
    let mut motion: Motion = Default::default();
    for tick in 0..=5000_u32 {
        if tick % 5 == 0 {
            for (curve, (angle, rate)) in motion.iter_mut().zip(gait.angles().iter().zip(gait.rates())) {
                curve.push((f64::from(tick) * 1e-3, f64::from(angle.degrees()), f64::from(rate.0.to_degrees())));
            }
        }
        gait.step();
    }
    let mut panels = vec![("5-1", gait_charts::angles(&motion))];
    let portraits =
        Joint::ALL.into_iter().zip(&motion).map(|(joint, points)| gait_charts::portrait(joint.name(), points));
    panels.extend(["5-2", "5-3", "5-4", "5-5"].into_iter().zip(portraits));
    panels.push(("5-6", gait_charts::velocities(&motion)));
    for (figure, panel) in panels {
        let title = format!("The thesis' network, Table 1, set S (thesis, figure {})", dotted(figure));
        figures.push(Figure { name: format!("thesis-{figure}"), title, panels: vec![panel] });
    }
    Ok(())
}

/// A step of the building block, seconds: periods of 18, 12 and 6 s are 6, 4 and 2 steps.
const STEP_S: f64 = 3.0;

fn block(figures: &mut Vec<Figure>) -> Result<(), Failure> {
    let pair = |flexor, extensor| Reversibilities::new(flexor, extensor).map_err(Failure::run);
    let start = Obb::from_potential(pair(1, 5)?, PAPER_POTENTIAL).map_err(Failure::run)?;
    // The changes at 160 s and 300 s act with the next step.
    let switches = [(54, pair(1, 3)?), (100, pair(1, 1)?)];
    let course = BlockRun::of(start, &switches, 120, true);
    let marks = [(162.0, "(1,3) from 160 s".to_owned()), (300.0, "(1,1)".to_owned())];
    let title = |what: &str| format!("Building block (1,5), (1,3), (1,1): {what}");
    for (figure, what, panels) in [
        (
            "obb-3",
            "potentials and outputs (figure 3)",
            vec![course.potentials(STEP_S, &marks), course.outputs(STEP_S, &marks)],
        ),
        ("obb-4", "duty (figure 4)", vec![course.outputs(STEP_S, &marks), course.duty(STEP_S, &marks)]),
    ] {
        figures.push(Figure { name: figure.into(), title: title(what), panels });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is drawn is the cycle of the closed forms: period and amplitudes in angle and velocity, from inside and outside.
    #[test]
    fn the_single_oscillators_have_the_period_and_amplitude_of_their_sets() {
        for (figure, period_s, amplitude, velocity) in [
            ("2-4", 15.259_75, 1.350_366, 0.521_534),
            ("2-6", 15.259_75, 0.427_023, 0.164_923),
            ("2-7", 6.663_287, 0.560_992, 0.518_623),
            ("2-8", 58.061_15, 12.630_2, 1.167_118),
        ] {
            let (_, [alpha, p, mu], seconds, _) = SINGLE.into_iter().find(|of| of.0 == figure).expect("drawn");
            for part in [0.05, 2.5] {
                let config = RayleighConfig { alpha, p, mu, offset: 0.0 };
                let points = single(config, part, seconds).unwrap();
                let late: Vec<_> = points.iter().filter(|p| p.0 > f64::from(seconds) / 2.0).collect();
                let most = |of: fn(&(f64, f64, f64)) -> f64| late.iter().map(|p| of(p).abs()).fold(0.0, f64::max);
                assert!((most(|p| p.1) / amplitude - 1.0).abs() < 2e-3, "{figure}: {}", most(|p| p.1));
                assert!((most(|p| p.2) / velocity - 1.0).abs() < 2e-3, "{figure}: {}", most(|p| p.2));
                let up: Vec<f64> =
                    points.windows(2).filter(|w| w[0].1 < 0.0 && w[1].1 >= 0.0).map(|w| w[1].0).collect();
                // The first one may still be on the way to the cycle.
                let found = (up[up.len() - 1] - up[1]) / (up.len() - 2) as f64;
                assert!(up.len() > 2 && (found / period_s - 1.0).abs() < 0.01, "{figure}: {found}");
            }
        }
    }
}
