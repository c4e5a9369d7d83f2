//! The thesis' single oscillators: figures 2.4 to 2.8, and what it says about their parameters.

use cpg_core::math::first_order::{Flow, rk4};
use cpg_core::oscillator::rayleigh::{Rayleigh, RayleighConfig};
use cpg_core::{Generator, OscillatorState};
use joint_units::Period;
use picture::{Curve, Panel};

use super::claim::{Claim, Paper, Verdict};
use super::figure::Figure;

/// What a figure of a single oscillator shows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shows {
    Time,
    Portrait,
    Both,
}

/// Name, number, (alpha, p, mu), seconds. Figures 2.4 and 2.5 are of one set.
const FIGURES: [(&str, &str, [f64; 3], f64, Shows); 5] = [
    ("thesis-2-4", "2.4", [1.0, 5.0, 0.5], 60.0, Shows::Time),
    ("thesis-2-5", "2.5", [1.0, 5.0, 0.5], 60.0, Shows::Portrait),
    ("thesis-2-6", "2.6", [1.0, 50.0, 0.5], 60.0, Shows::Both),
    ("thesis-2-7", "2.7", [1.0, 5.0, 1.0], 40.0, Shows::Both),
    ("thesis-2-8", "2.8", [1.0, 1.0, 0.2], 200.0, Shows::Both),
];

/// Parts of the harmonic amplitude at which the courses begin: near rest, and outside of the cycle.
const STARTS: [(&str, f64); 2] = [("from near rest", 0.05), ("from outside", 2.5)];

/// Steps of a drawn course, about.
const POINTS: u64 = 1500;

/// Time, angle and velocity of a course: s, deg, deg/s.
type Course = Vec<(f64, f64, f64)>;

/// The figures.
///
/// # Errors
/// None: the parameters are inside the core's ranges.
pub(super) fn figures() -> Result<Vec<Figure>, String> {
    FIGURES.iter().map(|of| figure(*of)).collect()
}

fn figure(
    (name, number, [alpha, p, mu], seconds, shows): (&'static str, &str, [f64; 3], f64, Shows),
) -> Result<Figure, String> {
    let courses = STARTS.iter().map(|(name, part)| Ok((*name, course([alpha, p, mu], *part, seconds)?)));
    let courses: Vec<(&str, Course)> = courses.collect::<Result<_, String>>()?;
    let curves = |of: fn(&(f64, f64, f64)) -> (f64, f64)| -> Vec<Curve> {
        courses.iter().map(|(name, points)| Curve::new(name, points.iter().map(of).collect())).collect()
    };
    let angle = Panel::curves("angle", "time, s", "angle, deg", curves(|p| (p.0, p.1)));
    let velocity = Panel::curves("angular velocity", "time, s", "velocity, deg/s", curves(|p| (p.0, p.2)));
    let portrait = Panel::curves("limit cycle", "angle, deg", "velocity, deg/s", curves(|p| (p.1, p.2)));
    let panels = match shows {
        Shows::Time => vec![angle, velocity],
        Shows::Portrait => vec![portrait],
        Shows::Both => vec![angle, velocity, portrait],
    };
    Ok(Figure::new(
        name,
        &format!("Thesis, figure {number}: Rayleigh oscillator, alpha = {alpha}, p = {p}, mu = {mu}"),
        "One oscillator from near rest and from outside of its limit cycle: both courses end on the same cycle.",
        &format!(
            "a'' - alpha (1 - p a'^2) a' + mu^2 a = 0 with alpha = {alpha} 1/s, p = {p} (s/deg)^2, mu = {mu} rad/s; starts at rest at {} and {} of \
             the harmonic amplitude 2/(sqrt(3 p) mu); Runge-Kutta, order 4, 1 ms, f64",
            STARTS[0].1, STARTS[1].1
        ),
        panels,
    ))
}

fn course([alpha, p, mu]: [f64; 3], part: f64, seconds: f64) -> Result<Course, String> {
    let config = RayleighConfig { alpha, p, mu, offset: 0.0 };
    let mut oscillator: Rayleigh<f64> = config.build(Period::MILLISECOND).map_err(|error| error.to_string())?;
    let OscillatorState { displacement: [built], .. } = oscillator.state();
    oscillator
        .set_state(&OscillatorState { displacement: [part * built], velocity: [0.0] })
        .map_err(|error| error.to_string())?;
    let ticks = (seconds * 1e3) as u64;
    let every = (ticks / POINTS).max(1);
    let mut points = vec![];
    for tick in 0..=ticks {
        if tick % every == 0 {
            let OscillatorState { displacement: [angle], velocity: [rate] } = oscillator.state();
            points.push((tick as f64 * 1e-3, angle, rate));
        }
        oscillator.step();
    }
    Ok(points)
}

/// The limit cycle on which an oscillator settles.
#[derive(Debug, Clone, Copy)]
struct LimitCycle {
    /// s.
    period: f64,
    /// deg.
    amplitude: f64,
}

/// The cycle from a start over five periods, after the time in which a deviation falls to about 1e-6: it falls with alpha.
fn limit_cycle([alpha, p, mu]: [f64; 3], part: f64) -> Result<LimitCycle, String> {
    let harmonic = std::f64::consts::TAU / mu;
    let config = RayleighConfig { alpha, p, mu, offset: 0.0 };
    let mut oscillator: Rayleigh<f64> = config.build(Period::MILLISECOND).map_err(|error| error.to_string())?;
    let OscillatorState { displacement: [built], .. } = oscillator.state();
    let start = OscillatorState { displacement: [part * built], velocity: [0.0] };
    oscillator.set_state(&start).map_err(|error| error.to_string())?;
    for _ in 0..(1e3 * (10.0 * harmonic + 14.0 / alpha)) as u64 {
        oscillator.step();
    }
    let (mut crossings, mut amplitude, mut tick) = (vec![], 0.0_f64, 0_u64);
    let mut before = oscillator.state().displacement[0];
    while crossings.len() < 6 {
        oscillator.step();
        let now = oscillator.state().displacement[0];
        if before < 0.0 && now >= 0.0 {
            crossings.push((tick as f64 - before / (now - before)) * 1e-3);
        }
        amplitude = amplitude.max(now.abs());
        (before, tick) = (now, tick + 1);
    }
    Ok(LimitCycle { period: (crossings[5] - crossings[0]) / 5.0, amplitude })
}

/// Equation 2 as the thesis prints it, with the sign that makes the cycle repelling.
struct AsPrinted;

impl Flow<f64, 2> for AsPrinted {
    fn derivative(&self, &[y, z]: &[f64; 2]) -> [f64; 2] {
        [z, (y * y - 1.0) * z - y]
    }
}

/// The largest |y| in the last ten seconds of 60, or the time at which |y| passes 1000.
fn as_printed(start: f64) -> Result<f64, f64> {
    let (mut state, mut largest) = ([start, 0.0], 0.0_f64);
    for step in 0..600_000_u32 {
        if state[0].abs() > 1e3 {
            return Err(f64::from(step) * 1e-4);
        }
        if step > 500_000 {
            largest = largest.max(state[0].abs());
        }
        rk4(&AsPrinted, &mut state, 1e-4);
    }
    Ok(largest)
}

/// The claims about single oscillators.
///
/// # Errors
/// None: the parameters are inside the core's ranges.
pub(super) fn claims() -> Result<Vec<Claim>, String> {
    let claim = |id, place, statement, number| Claim::new(Paper::Thesis, id, place, statement, number);
    let of = |set| limit_cycle(set, 0.5);
    let (inside, outside) = (limit_cycle([1.0, 5.0, 0.5], 0.05)?, limit_cycle([1.0, 5.0, 0.5], 2.5)?);
    let (base, wide, fast) = (of([1.0, 5.0, 0.5])?, of([1.0, 50.0, 0.5])?, of([1.0, 5.0, 1.0])?);
    let (slow, weak) = (of([1.0, 1.0, 0.2])?, of([0.01, 5.0, 1.0])?);
    let decays = as_printed(1.9);
    let grows = as_printed(2.1);
    let printed = match (decays, grows) {
        (Ok(rest), Err(at)) => format!("from 1.9 to {rest:.3}; from 2.1 beyond 1000 at t = {at:.2}"),
        other => format!("{other:?}"),
    };
    let ratio = wide.amplitude / base.amplitude;
    let same = (inside.amplitude / outside.amplitude - 1.0).abs() < 1e-6;
    Ok(vec![
        claim("van-der-pol-sign", "eq. 2", "the van der Pol equation as printed has an attracting cycle", "not stated")
            .found(
                printed,
                Verdict::of(decays.is_ok_and(|rest| rest > 0.1) && grows.is_ok()),
                "The sign of the damping is reversed, so the cycle is repelling; with (1 - y^2) it attracts.",
            ),
        claim(
            "rayleigh-limit-cycle",
            "figures 2.4, 2.5",
            "an oscillator with (1, 5, 0.5) has a limit cycle",
            "not stated",
        )
        .found(
            format!(
                "amplitude {:.4} deg from inside, {:.4} deg from outside, period {:.3} s",
                inside.amplitude, outside.amplitude, base.period
            ),
            Verdict::of(same),
            "Both starts end on one cycle, which has the closed form of the van der Pol equation.",
        ),
        claim("rayleigh-p-amplitude", "figure 2.6", "p controls the amplitude", "not stated").found(
            format!("p from 5 to 50: amplitude times {ratio:.4}, period times {:.4}", wide.period / base.period),
            Verdict::of((ratio - 0.1_f64.sqrt()).abs() < 1e-4 && (wide.period / base.period - 1.0).abs() < 1e-5),
            "The amplitude goes with 1/sqrt(p), exactly; the period does not change.",
        ),
        claim("rayleigh-mu-frequency", "figure 2.7", "a larger mu makes the oscillation faster", "not stated").found(
            format!("mu from 0.5 to 1: frequency times {:.3}", base.period / fast.period),
            Verdict::of(fast.period < base.period),
            "The frequency rises with mu, but not in proportion, because alpha/mu changes too.",
        ),
        claim("rayleigh-mu-is-frequency", "figure 2.8", "mu is the frequency, so the period is 2 pi/mu", "31.42 s")
            .found(
                format!(
                    "{:.2} s at (1, 1, 0.2); {:.5} s at (0.01, 5, 1), where 2 pi/mu is 6.28319 s",
                    slow.period, weak.period
                ),
                Verdict::of((slow.period / 31.415_927 - 1.0).abs() < 0.01),
                "It holds for alpha much smaller than mu only; here alpha/mu is 5.",
            ),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the closed forms by the van der Pol equation, integrated elsewhere with an eighth-order method.
    #[test]
    fn the_cycles_are_those_of_the_closed_forms() {
        for (set, period, amplitude) in [
            ([1.0, 5.0, 0.5], 15.259_748_96, 1.350_366_06),
            ([1.0, 50.0, 0.5], 15.259_748_96, 0.427_023_24),
            ([1.0, 5.0, 1.0], 6.663_286_86, 0.560_992_26),
            ([1.0, 1.0, 0.2], 58.061_153_34, 12.630_200_36),
            ([0.01, 5.0, 1.0], 6.283_224_58, 0.516_402_35),
        ] {
            for part in [0.3, 2.5] {
                let found = limit_cycle(set, part).unwrap();
                assert!((found.period - period).abs() < 2e-5 * period, "{set:?}: {found:?}");
                assert!((found.amplitude - amplitude).abs() < 2e-5 * amplitude, "{set:?}: {found:?}");
            }
        }
    }

    #[test]
    fn the_printed_equation_repels() {
        assert!(as_printed(1.9).is_ok_and(|rest| rest < 1e-3));
        assert!(as_printed(2.1).is_err_and(|at| (at - 2.81).abs() < 0.01));
    }

    /// What is drawn ends on the cycle, in angle and velocity, from inside and outside.
    #[test]
    fn the_drawn_courses_end_on_the_cycle() {
        for (set, seconds, amplitude, velocity) in
            [([1.0, 5.0, 0.5], 60.0, 1.350_366, 0.521_534), ([1.0, 1.0, 0.2], 200.0, 12.630_2, 1.167_118)]
        {
            for (_, part) in STARTS {
                let points = course(set, part, seconds).unwrap();
                let late = || points.iter().filter(|point| point.0 > seconds / 2.0);
                let most = |of: fn(&(f64, f64, f64)) -> f64| late().map(|point| of(point).abs()).fold(0.0, f64::max);
                assert!((most(|p| p.1) / amplitude - 1.0).abs() < 2e-3, "{set:?}: {}", most(|p| p.1));
                assert!((most(|p| p.2) / velocity - 1.0).abs() < 2e-3, "{set:?}: {}", most(|p| p.2));
            }
        }
    }
}
