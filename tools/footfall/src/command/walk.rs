//! `footfall walk`: shows a default gait on the host core, with changes during the run: live on a terminal, else as CSV, JSON or a picture. With
//! `--generator`, the generator of a file.

mod generator;
mod outputs;

use clap::Args;
use clap::builder::ArgPredicate;
use cpg_core::Generator;
use cpg_core::gait::named::Gait;
use joint_units::Radians;
use reproduce::charts::motion::{Motion, over_time};
use std::fmt::Write as _;
use std::path::PathBuf;

use crate::failure::Failure;
use crate::file::svg;
use crate::gait_player::asked_speed::AskedSpeed;
use crate::gait_player::{Change, GaitPlayer};
use crate::interrupt;
use crate::options::cadence::Cadence;
use crate::options::overwrite::Overwrite;
use crate::options::terminal::{Keys, shows_screens};
use crate::options::value::number;
use crate::output;
use crate::view::live_gait;

/// Options of `footfall walk`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Changes (--switch):\n  \
    t=5 run          to another gait; in a stand this starts it\n  \
    t=5 speed 1.2    to a factor on the gait's own cadence\n  \
    t=5 cadence 120  to a number of steps a minute\n  \
    t=8 stop         to a stand: legs straight, knees at 5 degrees\n  \
    t=9 start        from a stand to the gait\n\
    A speed or cadence that is asked for in a stand is kept for the next start. One that another gait does not allow is replaced by the nearest \
    that it allows, with a note, and comes back, with a note, with the next gait that allows it.\n\n\
    CSV of a gait: time_s, the angles of left hip, right hip, left knee and right knee in degrees, flexion positive, and the state: walking, stopping (on the way to the stand) or standing.\n\
    CSV of a generator file: time_s, then NAME_deg of each of its joints: left_hip_deg, right_hip_deg, left_knee_deg, right_knee_deg, ... It begins at \
    the generator's own start, which is the boot of a board.\n\n\
    --json, one object a line:\n  \
    t_s          seconds\n  \
    state        walking, stopping or standing\n  \
    gait         its name; in a stand that of the next start\n  \
    cadence      steps a minute; in a stand that of the next start\n  \
    angles_deg   left hip, right hip, left knee, right knee; flexion positive\n  \
    rates_deg_s  their angular velocities\n  \
    phase        of the stride, 0 to 1; it advances in a stand too")]
pub struct Options {
    /// Print the names of all gaits and what they are
    #[arg(long, conflicts_with_all = ["gait", "speed", "cadence", "secs", "switch", "every_ms", "csv", "json", "svg", "force"])]
    pub list: bool,
    /// The gait, one of --list; with --cadence and without this option it is human-walk
    #[arg(
        long,
        value_name = "NAME",
        default_value = "walk",
        default_value_if("cadence", ArgPredicate::IsPresent, "human-walk")
    )]
    pub gait: String,
    /// A generator file of any kind instead of a gait: its columns are time_s and the angle of each joint, left_hip_deg and so on, without a state
    #[arg(long, value_name = "FILE", conflicts_with_all = ["list", "gait", "speed", "cadence", "switch"])]
    pub generator: Option<PathBuf>,
    /// Factor on the gait's own cadence, 0.5 to 1.5; a smaller range where fewer cadences were recorded or a joint would be too fast for the robot
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub speed: f32,
    /// Steps a minute, two a stride: `110`, or `100..130` for an even change from the first second to the last
    #[arg(long, value_name = "STEPS", conflicts_with = "speed")]
    pub cadence: Option<Cadence>,
    /// Seconds to play [default: until q or Ctrl-C on a terminal, else 5]
    #[arg(long, value_name = "S", value_parser = number(0.001..=3600.0_f32, " seconds"))]
    pub secs: Option<f32>,
    /// A change at a time in seconds, as `t=5 run` or `t=8 stop`, see below; may be repeated
    #[arg(long, value_name = "t=S WHAT")]
    pub switch: Vec<String>,
    /// Milliseconds from one line to the next
    #[arg(long, value_name = "MS", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub every_ms: u32,
    /// CSV even on a terminal; with OUT, to this file
    #[arg(long, value_name = "OUT", num_args = 0..=1, conflicts_with = "json")]
    pub csv: Option<Option<PathBuf>>,
    /// One JSON object a line instead of CSV
    #[arg(long)]
    pub json: bool,
    /// Draw joint angles, phase portraits and angular velocities
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Seconds of a run without a terminal, where no option gives them.
const DEFAULT_SECS: f32 = 5.0;

/// Runs the command.
///
/// # Errors
/// Wrong input, or a file that cannot be written.
pub fn run(options: Options) -> Result<(), Failure> {
    let Options { list, gait: name, generator, speed, cadence, secs, switch, every_ms, csv, json, svg, overwrite } =
        options;
    if list {
        let line = |gait: Gait| format!("{:<18} {}\n", gait.name(), gait.description());
        return output::print(&Gait::ALL.map(line).concat());
    }
    let on_screen = generator.is_none() && csv.is_none() && !json && svg.is_none() && shows_screens(Keys::Stdin);
    let outputs = outputs::Outputs { csv: csv.flatten(), json, svg, overwrite };
    outputs.check()?;
    if let Some(generator) = &generator {
        return generator::run(generator, secs.unwrap_or(DEFAULT_SECS), every_ms, &outputs);
    }
    let gait = gait(&name)?;
    let speed = cadence.map_or(AskedSpeed::Factor(speed), |cadence| AskedSpeed::Cadence(cadence.first));
    let mut changes = switch.iter().map(|text| change(text)).collect::<Result<Vec<_>, _>>()?;
    check_ends(&changes, secs, on_screen)?;
    if let Some(cadence) = cadence {
        changes.extend(cadence.sweep(gait, secs.unwrap_or(DEFAULT_SECS), &switch)?);
    }
    let player = GaitPlayer::build(gait, speed, changes)?;
    output::notes(player.notes());
    if on_screen {
        return live_gait::run(player, secs, &*interrupt::flag()?);
    }
    let (text, motion) = play(player, secs.unwrap_or(DEFAULT_SECS), every_ms, json)?;
    outputs
        .write(&text, |path, overwrite| svg::write(path, &format!("{name}, host core"), &over_time(&motion), overwrite))
}

/// Refuses changes after the end. On a screen without `--secs` there is no end.
fn check_ends(changes: &[(f32, Change)], secs: Option<f32>, on_screen: bool) -> Result<(), Failure> {
    let end = if on_screen { secs } else { Some(secs.unwrap_or(DEFAULT_SECS)) };
    let latest = changes.iter().map(|(at, _)| *at).reduce(f32::max);
    match (end, latest) {
        (Some(end), Some(late)) if late > end => {
            let how = if secs.is_some() { "--secs" } else { "without --secs the end is at" };
            Err(Failure::input(format!(
                "--switch at t={late}, {how} {end}: allowed are changes up to the end, or a later end"
            )))
        }
        _ => Ok(()),
    }
}

/// The gait of a name.
fn gait(name: &str) -> Result<Gait, Failure> {
    let names: Vec<&str> = Gait::ALL.into_iter().map(Gait::name).collect();
    Gait::from_name(name).ok_or_else(|| {
        Failure::input(format!("gait `{name}`: allowed is one of {}; --list says what they are", names.join(", ")))
    })
}

/// Parses a change and its time in seconds.
fn change(text: &str) -> Result<(f32, Change), Failure> {
    let wrong = || {
        Failure::input(format!(
            "--switch `{text}`: allowed is `t=S GAIT`, `t=S speed FACTOR`, `t=S cadence STEPS`, `t=S stop` or `t=S start`"
        ))
    };
    let mut words = text.split_whitespace();
    let at = words.next().and_then(|word| word.strip_prefix("t=")).and_then(|s| s.parse::<f32>().ok());
    let at = at.filter(|s| (0.0..=1e6).contains(s)).ok_or_else(wrong)?;
    let change = match (words.next(), words.next(), words.next()) {
        (Some("stop"), None, None) => Change::Stop,
        (Some("start"), None, None) => Change::Start,
        (Some("speed"), Some(factor), None) => Change::Speed(AskedSpeed::Factor(factor.parse().map_err(|_| wrong())?)),
        (Some("cadence"), Some(steps), None) => Change::Speed(AskedSpeed::Cadence(steps.parse().map_err(|_| wrong())?)),
        (Some(name), None, None) => Change::To(gait(name)?),
        _ => return Err(wrong()),
    };
    Ok((at, change))
}

/// Plays the gait; gives the lines of text, and the motion for the picture.
fn play(mut player: GaitPlayer, until_s: f32, every_ms: u32, json: bool) -> Result<(String, Motion), Failure> {
    let mut out = String::new();
    if !json {
        out += "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg,state\n";
    }
    let mut motion: Motion = Default::default();
    let last = (until_s * 1e3) as u32;
    while player.tick() <= last {
        player.make_due_changes()?;
        if player.tick().is_multiple_of(every_ms) {
            let smooth = player.motion();
            let (t, angles, rates) = (player.t_s(), smooth.angles(), smooth.rates());
            let state = player.state().name();
            // Writing to a String cannot fail.
            let _ = if json {
                let object = serde_json::json!({
                    "t_s": t,
                    "state": state,
                    "gait": player.gait().name(),
                    "cadence": player.cadence(),
                    "angles_deg": angles.map(Radians::degrees),
                    "rates_deg_s": rates.map(|rate| rate.0.to_degrees()),
                    "phase": smooth.phase().cycles(),
                });
                writeln!(out, "{object}")
            } else {
                let [a, b, c, d] = angles.map(Radians::degrees);
                writeln!(out, "{t:.3},{a:.4},{b:.4},{c:.4},{d:.4},{state}")
            };
            for (curve, (angle, rate)) in motion.iter_mut().zip(angles.iter().zip(rates)) {
                curve.push((t, f64::from(angle.degrees()), f64::from(rate.0.to_degrees())));
            }
        }
        player.step();
    }
    Ok((out, motion))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_read_and_wrong_ones_refused() {
        assert_eq!(change("t=5 run").unwrap(), (5.0, Change::To(Gait::from_name("run").unwrap())));
        assert_eq!(change("t=0.5 speed 1.2").unwrap(), (0.5, Change::Speed(AskedSpeed::Factor(1.2))));
        assert_eq!(change("t=8 stop").unwrap(), (8.0, Change::Stop));
        assert_eq!(change("t=9 start").unwrap(), (9.0, Change::Start));
        assert_eq!(change("t=5 cadence 120").unwrap(), (5.0, Change::Speed(AskedSpeed::Cadence(120.0))));
        for bad in
            ["", "run", "t=x run", "t=1", "t=1 canter", "t=-1 run", "t=1 speed fast", "t=1 cadence", "t=1 stop now"]
        {
            let failure = change(bad).unwrap_err();
            assert!(failure.exit_code() == 2 && failure.to_string().contains("allowed"), "{bad}: {failure}");
        }
    }
}
