//! `footfall walk`: a shipped gait on the host core, as CSV, JSON or a picture, with changes on the way.

use clap::Args;
use cpg_core::Generator;
use cpg_core::gaits::Gait;
use cpg_core::transition::{Smooth, TransitionConfig};
use joint_units::{Joint, Period, Radians};
use std::fmt::Write as _;
use std::path::PathBuf;

use super::svg::{Curve, Panel};
use crate::failure::Failure;

/// Options of `footfall walk`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The gait; `list` names them all
    #[arg(long, value_name = "NAME", default_value = "walk")]
    pub gait: String,
    /// Factor on the gait's own cadence, 0.5 to 1.5
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub speed: f32,
    /// Seconds
    #[arg(long, value_name = "S", default_value_t = 5.0)]
    pub secs: f32,
    /// A change, as `t=5 run`, `t=5 speed 1.2` or `t=8 stop`; may be repeated
    #[arg(long, value_name = "t=S WHAT")]
    pub switch: Vec<String>,
    /// A line every so many milliseconds
    #[arg(long, value_name = "MS", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub every_ms: u32,
    /// One JSON object a line instead of CSV
    #[arg(long)]
    pub json: bool,
    /// Draw joint angles, phase portraits and angular velocities
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

/// What happens at a change.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    To(Gait),
    Speed(f32),
    Stop,
}

/// Where a stop stands: legs straight but for a little at the knees.
const STAND: [Radians; 4] = [Radians(0.0), Radians(0.0), Radians::from_degrees(5.0), Radians::from_degrees(5.0)];

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

/// Runs the command.
///
/// # Errors
/// Bad input, or the picture cannot be written.
pub fn run(options: &Options) -> Result<(), Failure> {
    if options.gait == "list" {
        return crate::cli::print(&Gait::ALL.map(|gait| format!("{}\n", gait.name())).concat());
    }
    if !(0.001..=3600.0).contains(&options.secs) {
        return Err(Failure::input(format!("--secs {}: allowed is 0.001 to 3600", options.secs)));
    }
    let period = Period::MILLISECOND;
    let (mut name, mut speed) = (gait(&options.gait)?, options.speed);
    let mut changes = options.switch.iter().map(|text| change(text)).collect::<Result<Vec<_>, _>>()?;
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut changes = changes.into_iter().peekable();
    let built = name.build(speed, period).map_err(Failure::input)?;
    let mut smooth = Smooth::build(built, TransitionConfig::default(), period).map_err(Failure::run)?;

    let mut out = String::new();
    if !options.json {
        out += "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n";
    }
    let mut curves: [Vec<(f64, f64, f64)>; 4] = Default::default();
    for tick in 0..=(options.secs * 1e3) as u32 {
        while let Some((_, change)) = changes.next_if(|(at, _)| (at * 1e3) as u32 <= tick) {
            match change {
                Change::To(next) => name = next,
                Change::Speed(factor) => speed = factor,
                Change::Stop => {
                    smooth.stop(STAND);
                    continue;
                }
            }
            let next = name.build(speed, period).map_err(Failure::input)?;
            smooth.resume();
            smooth.change(|gait| *gait = next.aligned(gait.phase(), period));
        }
        if tick % options.every_ms == 0 {
            let (t, angles, rates) = (f64::from(tick) * 1e-3, smooth.angles(), smooth.rates());
            // Writing to a String cannot fail.
            let _ = if options.json {
                let object = serde_json::json!({
                    "t_s": t,
                    "gait": name.name(),
                    "angles_deg": angles.map(Radians::degrees),
                    "rates_deg_s": rates.map(|rate| rate.0.to_degrees()),
                    "phase": smooth.phase().cycles(),
                });
                writeln!(out, "{object}")
            } else {
                let [a, b, c, d] = angles.map(Radians::degrees);
                writeln!(out, "{t:.3},{a:.4},{b:.4},{c:.4},{d:.4}")
            };
            for (curve, (angle, rate)) in curves.iter_mut().zip(angles.iter().zip(rates)) {
                curve.push((t, f64::from(angle.degrees()), f64::from(rate.0.to_degrees())));
            }
        }
        smooth.step();
    }
    if let Some(path) = &options.svg {
        super::svg::write(path, &format!("{}, host core", options.gait), &panels(&curves))?;
    }
    crate::cli::print(&out)
}

/// Angles over time, a phase portrait a joint, velocities over time.
fn panels(curves: &[Vec<(f64, f64, f64)>; 4]) -> Vec<Panel> {
    let joints = || Joint::ALL.into_iter().zip(curves);
    let over_time = |title: &str, of: fn(&(f64, f64, f64)) -> (f64, f64)| Panel {
        title: title.into(),
        x: "s".into(),
        curves: joints().map(|(joint, points)| Curve::new(joint.name(), points.iter().map(of).collect())).collect(),
    };
    let mut panels = vec![over_time("joint angles, deg", |p| (p.0, p.1))];
    panels.extend(joints().map(|(joint, points)| Panel {
        title: format!("{}: deg/s over deg", joint.name()),
        x: "deg".into(),
        curves: vec![Curve::new("", points.iter().map(|p| (p.1, p.2)).collect())],
    }));
    panels.push(over_time("angular velocities, deg/s", |p| (p.0, p.2)));
    panels
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
