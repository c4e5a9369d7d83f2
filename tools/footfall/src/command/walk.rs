//! `footfall walk`: a shipped gait on the host core, live on a terminal, else as CSV, JSON or a picture, with changes on the way.

use clap::Args;
use cpg_core::Generator;
use cpg_core::gait::named::{DefaultGait, Gait};
use cpg_core::transition::{Smooth, TransitionConfig};
use joint_units::{Joint, Period, Radians};
use std::fmt::Write as _;
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::failure::Failure;
use crate::file::svg::{Curve, Panel};
use crate::view::live_gait;

/// Options of `footfall walk`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The gait; `list` names them all
    #[arg(long, value_name = "NAME", default_value = "walk")]
    pub gait: String,
    /// Factor on the gait's own cadence, 0.5 to 1.5
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub speed: f32,
    /// Seconds [default: until q or Ctrl-C on a terminal, else 5]
    #[arg(long, value_name = "S")]
    pub secs: Option<f32>,
    /// A change, as `t=5 run`, `t=5 speed 1.2` or `t=8 stop`; may be repeated
    #[arg(long, value_name = "t=S WHAT")]
    pub switch: Vec<String>,
    /// A line every so many milliseconds
    #[arg(long, value_name = "MS", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub every_ms: u32,
    /// CSV even on a terminal
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,
    /// One JSON object a line instead of CSV
    #[arg(long)]
    pub json: bool,
    /// Draw joint angles, phase portraits and angular velocities
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

/// Seconds without a terminal, where nobody says how many.
const DEFAULT_SECS: f32 = 5.0;

/// What happens at a change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Change {
    /// Another gait.
    To(Gait),
    /// Another speed.
    Speed(f32),
    /// A stand.
    Stop,
}

/// Where a stop stands: legs straight but for a little at the knees.
const STAND: [Radians; 4] = [Radians(0.0), Radians(0.0), Radians::from_degrees(5.0), Radians::from_degrees(5.0)];

/// A gait under way, which any change leaves smooth.
pub(crate) struct Walking {
    /// Gait now.
    pub(crate) gait: Gait,
    /// Speed now.
    pub(crate) speed: f32,
    /// Standing, or on the way to it.
    pub(crate) stopped: bool,
    /// The motion.
    pub(crate) smooth: Smooth<DefaultGait, 4>,
    /// Ticks so far.
    pub(crate) tick: u32,
    /// Changes to come, the next one last.
    changes: Vec<(f32, Change)>,
}

const PERIOD: Period = Period::MILLISECOND;

impl Walking {
    /// As the options say.
    ///
    /// # Errors
    /// Says what is wrong with them.
    pub(crate) fn begin(options: &Options) -> Result<Self, Failure> {
        let gait = gait(&options.gait)?;
        let mut changes = options.switch.iter().map(|text| change(text)).collect::<Result<Vec<_>, _>>()?;
        changes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let built = gait.build(options.speed, PERIOD).map_err(Failure::input)?;
        let smooth = TransitionConfig::default().build(built, PERIOD).map_err(Failure::run)?;
        Ok(Self { gait, speed: options.speed, stopped: false, smooth, tick: 0, changes })
    }

    /// Carries a change out.
    ///
    /// # Errors
    /// A speed that is out of range; the walk then goes on as it was.
    pub(crate) fn change(&mut self, change: Change) -> Result<(), Failure> {
        let (gait, speed) = match change {
            Change::To(next) => (next, self.speed),
            Change::Speed(factor) => (self.gait, factor),
            Change::Stop => {
                self.smooth.stop(STAND);
                self.stopped = true;
                return Ok(());
            }
        };
        let next = gait.build(speed, PERIOD).map_err(Failure::input)?;
        (self.gait, self.speed, self.stopped) = (gait, speed, false);
        self.smooth.resume();
        self.smooth.change(|gait| *gait = next.aligned(gait.phase(), PERIOD));
        Ok(())
    }

    /// Carries out the changes that are due.
    ///
    /// # Errors
    /// As [`Walking::change`].
    pub(crate) fn due(&mut self) -> Result<(), Failure> {
        while let Some((_, change)) = self.changes.pop_if(|(at, _)| (*at * 1e3) as u32 <= self.tick) {
            self.change(change)?;
        }
        Ok(())
    }

    /// A millisecond.
    pub(crate) fn step(&mut self) {
        self.smooth.step();
        self.tick = self.tick.saturating_add(1);
    }

    /// Seconds so far.
    pub(crate) fn t_s(&self) -> f64 {
        f64::from(self.tick) * 1e-3
    }
}

fn gait(name: &str) -> Result<Gait, Failure> {
    let names: Vec<&str> = Gait::ALL.into_iter().map(Gait::name).collect();
    Gait::from_name(name)
        .ok_or_else(|| Failure::input(format!("gait `{name}`: allowed is one of {}", names.join(", "))))
}

fn change(text: &str) -> Result<(f32, Change), Failure> {
    let wrong =
        || Failure::input(format!("--switch `{text}`: allowed is `t=S GAIT`, `t=S speed FACTOR` or `t=S stop`"));
    let mut words = text.split_whitespace();
    let at = words.next().and_then(|word| word.strip_prefix("t=")).and_then(|s| s.parse::<f32>().ok());
    let at = at.filter(|s| (0.0..=1e6).contains(s)).ok_or_else(wrong)?;
    let change = match (words.next(), words.next(), words.next()) {
        (Some("stop"), None, None) => Change::Stop,
        (Some("speed"), Some(factor), None) => Change::Speed(factor.parse().map_err(|_| wrong())?),
        (Some(name), None, None) => Change::To(gait(name)?),
        _ => return Err(wrong()),
    };
    Ok((at, change))
}

/// Runs the command. `interrupt` gives what a signal that asks it to end sets; without a screen nobody needs it.
///
/// # Errors
/// Bad input, or the picture cannot be written.
pub fn run(options: &Options, interrupt: fn() -> Result<Arc<AtomicBool>, Failure>) -> Result<(), Failure> {
    if options.gait == "list" {
        return crate::cli::print(&Gait::ALL.map(|gait| format!("{}\n", gait.name())).concat());
    }
    if let Some(secs) = options.secs.filter(|secs| !(0.001..=3600.0).contains(secs)) {
        return Err(Failure::input(format!("--secs {secs}: allowed is 0.001 to 3600")));
    }
    let walking = Walking::begin(options)?;
    let terminal = io::stdout().is_terminal() && io::stdin().is_terminal();
    let on_screen = terminal && !options.csv && !options.json && options.svg.is_none();
    // On a screen it goes on until somebody ends it.
    let end = if on_screen { options.secs } else { Some(options.secs.unwrap_or(DEFAULT_SECS)) };
    if let (Some(end), Some(late)) = (end, walking.changes.first().map(|(at, _)| *at))
        && late > end
    {
        let said = if options.secs.is_some() { "--secs" } else { "without --secs the end is at" };
        return Err(Failure::input(format!(
            "--switch at t={late}, {said} {end}: allowed are changes up to the end, or a later end"
        )));
    }
    if on_screen {
        return live_gait::run(walking, options.secs, &*interrupt()?);
    }
    let (out, motion) = in_lines(walking, options)?;
    if let Some(path) = &options.svg {
        crate::file::svg::write(path, &format!("{}, host core", options.gait), &over_time(&motion))?;
    }
    crate::cli::print(&out)
}

/// Time, angle and rate of each joint: s, deg, deg/s.
pub(crate) type Motion = [Vec<(f64, f64, f64)>; 4];

fn in_lines(mut walking: Walking, options: &Options) -> Result<(String, Motion), Failure> {
    let mut out = String::new();
    if !options.json {
        out += "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n";
    }
    let mut motion: Motion = Default::default();
    let last = (options.secs.unwrap_or(DEFAULT_SECS) * 1e3) as u32;
    while walking.tick <= last {
        walking.due()?;
        if walking.tick.is_multiple_of(options.every_ms) {
            let smooth = &walking.smooth;
            let (t, angles, rates) = (walking.t_s(), smooth.angles(), smooth.rates());
            // Writing to a String cannot fail.
            let _ = if options.json {
                let object = serde_json::json!({
                    "t_s": t,
                    "gait": walking.gait.name(),
                    "angles_deg": angles.map(Radians::degrees),
                    "rates_deg_s": rates.map(|rate| rate.0.to_degrees()),
                    "phase": smooth.phase().cycles(),
                });
                writeln!(out, "{object}")
            } else {
                let [a, b, c, d] = angles.map(Radians::degrees);
                writeln!(out, "{t:.3},{a:.4},{b:.4},{c:.4},{d:.4}")
            };
            for (curve, (angle, rate)) in motion.iter_mut().zip(angles.iter().zip(rates)) {
                curve.push((t, f64::from(angle.degrees()), f64::from(rate.0.to_degrees())));
            }
        }
        walking.step();
    }
    Ok((out, motion))
}

/// Angles over time, velocities over time, phase portraits.
fn over_time(motion: &Motion) -> Vec<Panel> {
    let mut panels = vec![angles(motion), velocities(motion)];
    panels.extend(Joint::ALL.into_iter().zip(motion).map(|(joint, points)| portrait(joint.name(), points)));
    panels
}

/// The four joint angles over time.
pub(crate) fn angles(motion: &Motion) -> Panel {
    let curves = Joint::ALL.into_iter().zip(motion);
    let curves = curves.map(|(joint, points)| Curve::new(joint.name(), points.iter().map(|p| (p.0, p.1)).collect()));
    Panel::curves("joint angles", "time, s", "angle, deg", curves.collect())
}

/// The four angular velocities over time.
pub(crate) fn velocities(motion: &Motion) -> Panel {
    let curves = Joint::ALL.into_iter().zip(motion);
    let curves = curves.map(|(joint, points)| Curve::new(joint.name(), points.iter().map(|p| (p.0, p.2)).collect()));
    Panel::curves("angular velocities", "time, s", "velocity, deg/s", curves.collect())
}

/// Velocity over angle of one joint.
pub(crate) fn portrait(name: &str, points: &[(f64, f64, f64)]) -> Panel {
    let curve = Curve::new("", points.iter().map(|p| (p.1, p.2)).collect());
    Panel::curves(&format!("{name}: phase portrait"), "angle, deg", "velocity, deg/s", vec![curve])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_read_and_bad_ones_refused_by_what_is_allowed() {
        assert_eq!(change("t=5 run").unwrap(), (5.0, Change::To(Gait::from_name("run").unwrap())));
        assert_eq!(change("t=0.5 speed 1.2").unwrap(), (0.5, Change::Speed(1.2)));
        assert_eq!(change("t=8 stop").unwrap(), (8.0, Change::Stop));
        for bad in ["", "run", "t=x run", "t=1", "t=1 canter", "t=-1 run", "t=1 speed fast", "t=1 stop now"] {
            let failure = change(bad).unwrap_err();
            assert!(failure.exit_code() == 2 && failure.to_string().contains("allowed"), "{bad}: {failure}");
        }
    }
}
