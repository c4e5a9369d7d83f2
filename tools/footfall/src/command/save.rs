//! `footfall save`: writes a generator file in which speed, amplitudes and offsets of a running board are the parameters. They are read back
//! from the board, or given.
//!
//! A board leads an angle a to park + factor (a - park) + offset, and runs its generator in another time. Both are changes of parameters of the
//! kinds `phase-coupled`, `shape` and `spline`, up to the rounding of a number; the other kinds have no such parameters.

use clap::{ArgGroup, Args};
use generator_file::file::{Coefficients, GeneratorFile, GeneratorSet};
use joint_loop::store::{generator_record, robot_record};
use joint_loop::tuning::{Parameter, Settings};
use joint_loop::{GeneratorConfig, RecordName, RobotConfig, SupervisorState};
use joint_units::Joint;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use crate::board::at_port::{AtPort, Reported};
use crate::board::requests::{setting, value_in_words};
use crate::failure::Failure;
use crate::messages;
use crate::options::at::At;
use crate::options::overwrite::Overwrite;
use crate::options::robot::RobotArgument;
use crate::output;

/// Options of `footfall save`.
#[derive(Debug, Clone, Args)]
#[command(group(ArgGroup::new("settings").required(true).args(["serial", "rtt", "set"])))]
pub struct Options {
    /// The generator file that the board's record was made from
    #[arg(value_name = "TOML")]
    pub generator: PathBuf,
    /// Read the settings back from the board there; its generator must be the one of the file
    #[command(flatten)]
    pub at: At,
    /// Refuse a board that is not at rest: its flash is to be written next
    #[arg(long, conflicts_with = "set")]
    pub at_rest: bool,
    /// A setting that was in effect on the board: speed, an amplitude or an offset; `footfall set --list` lists them. Repeat for more
    #[arg(long, value_name = "NAME=VALUE", allow_hyphen_values = true)]
    pub set: Vec<String>,
    /// The robot, whose park pose the amplitudes are counted from
    #[command(flatten)]
    pub robot: RobotArgument,
    /// The generator file to write
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Runs the command. `interrupt` is set by a signal that asks it to end.
///
/// # Errors
/// A setting that a generator cannot hold, a generator of another kind, parameters beyond their range, a file that cannot be read or written, a
/// board that is silent or has another generator.
pub fn run(options: &Options, interrupt: &AtomicBool) -> Result<(), Failure> {
    let Options { generator, at, at_rest, set, robot, out, overwrite } = options;
    let mut file = GeneratorFile::read(generator).map_err(Failure::input)?;
    let robot = robot.read()?.robot;
    output::check(out, *overwrite)?;
    let settings = match at.given() {
        None => settings(set)?,
        Some(origin) => {
            let reported = AtPort::open(origin, interrupt)?.report()?;
            read_back(&reported, generator, &file.set.config(), &robot, *at_rest).map_err(Failure::run)?
        }
    };
    let place = generator.display();
    file.set = saved(&file.set, &settings, &robot).map_err(|why| Failure::input(format!("{place}: {why}")))?;
    let words = in_words(&settings);
    let before = &file.provenance.settings;
    file.provenance.settings =
        if before.is_empty() { format!("saved with {words}") } else { format!("{before}; saved with {words}") };
    output::write(out, *overwrite, |target| target.write_all(file.to_toml().as_bytes()))?;
    messages::written(out);
    let out = gait_trace::shell_word(out);
    let robot = options.robot.robot.as_deref();
    let robot = robot.map_or(String::new(), |path| format!(" --robot {}", gait_trace::shell_word(path)));
    messages::next("see whether it walks on the robot", format!("footfall certify {out}{robot}"));
    // What the board has of robot and sensors stays.
    messages::next("write it to the board", format!("cargo xtask flash --keep --generator {out}"));
    Ok(())
}

/// The settings of `NAME=VALUE`, of which a later one of the same name counts.
fn settings(all: &[String]) -> Result<Settings, Failure> {
    let mut settings = Settings::default();
    for text in all {
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| Failure::input(format!("--set {text}: allowed is NAME=VALUE, such as speed=1.2")))?;
        let (parameter, thousandths) = setting(name, value).map_err(Failure::input)?;
        if matches!(parameter, Parameter::Gait | Parameter::Follow | Parameter::RecordRate) {
            return Err(Failure::input(format!(
                "--set {text}: no generator file holds it; allowed are speed, amplitudes and offsets"
            )));
        }
        settings = settings.with(parameter, thousandths).map_err(|refused| Failure::run(refused.name()))?;
    }
    Ok(settings)
}

/// The settings of the board, if its generator is that of the file, and its robot the given one.
fn read_back(
    reported: &Reported,
    file: &Path,
    config: &GeneratorConfig,
    robot: &RobotConfig,
    at_rest: bool,
) -> Result<Settings, String> {
    let Reported { settings, state } = reported;
    let (board, place) = (settings.generator, file.display());
    let of_file = generator_record::record_of(config, &RecordName::BUILT_IN).crc();
    if board != of_file {
        return Err(format!(
            "the board runs a generator with the check sum {board:08x}, that of {place} is {of_file:08x}; name the file that the board's record was made from, \
             or write this one to it first: cargo xtask flash --keep --generator {}",
            gait_trace::shell_word(file)
        ));
    }
    if settings.robot != robot_record::record_of(robot, &RecordName::BUILT_IN).crc() {
        return Err("the board has the record of another robot, and amplitudes are counted from the park pose; name its robot file with --robot".into());
    }
    if at_rest && *state != SupervisorState::Disarmed {
        return Err(format!(
            "the board is in the state `{}`; allowed is `disarmed`: end the walk with its button or `footfall set --stop`, then run this again",
            state.name()
        ));
    }
    let values = settings.values;
    if values.gait().is_some() {
        return Err(format!(
            "the board walks the gait `{}`, which is no generator of a file; set its own first: footfall set gait own",
            value_in_words(Parameter::Gait, values.thousandths(Parameter::Gait))
        ));
    }
    let kept =
        |parameter: &Parameter| !matches!(parameter, Parameter::Gait | Parameter::Follow | Parameter::RecordRate);
    let kept = Parameter::ALL.into_iter().filter(kept).try_fold(Settings::default(), |kept, parameter| {
        kept.with(parameter, values.thousandths(parameter)).map_err(|refused| refused.name().to_owned())
    })?;
    if kept == Settings::default() {
        return Err("speed, amplitudes and offsets of the board are the defaults: there is nothing to save".into());
    }
    Ok(kept)
}

fn in_words(settings: &Settings) -> String {
    let changed =
        Parameter::ALL.into_iter().filter(|parameter| settings.thousandths(*parameter) != parameter.range()[2]);
    let words = changed.map(|parameter| {
        format!("{}={}", parameter.name(), value_in_words(parameter, settings.thousandths(parameter)))
    });
    words.collect::<Vec<_>>().join(" ")
}

/// What the settings make of one joint: of angles, and of distances between angles. Degrees.
struct Change {
    factor: f32,
    park: f32,
    offset: f32,
}

impl Change {
    fn angle(&self, degrees: f32) -> f32 {
        self.park + self.factor * (degrees - self.park) + self.offset
    }

    fn distance(&self, degrees: f32) -> f32 {
        self.factor * degrees
    }

    fn coefficients(&self, of: &Coefficients) -> Result<Coefficients, String> {
        let scaled: Vec<f32> = of.iter().map(|degrees| self.distance(*degrees)).collect();
        Coefficients::new(&scaled).ok_or_else(|| "a joint has no coefficients".into())
    }
}

/// The generator with these settings as its own parameters.
fn saved(set: &GeneratorSet, settings: &Settings, robot: &RobotConfig) -> Result<GeneratorSet, String> {
    let changes = Joint::ALL.map(|joint| Change {
        factor: settings.value(Parameter::Amplitude(joint)),
        park: robot.park[joint as usize].degrees(),
        offset: settings.value(Parameter::Offset(joint)),
    });
    let speed = settings.value(Parameter::Speed);
    let mut saved = set.clone();
    match &mut saved {
        GeneratorSet::PhaseCoupled(network) => {
            // Every rate of the network is one of the natural period.
            network.natural_period_s /= speed;
            for (joint, change) in network.joints.iter_mut().zip(&changes) {
                joint.amplitude_deg = change.distance(joint.amplitude_deg);
                joint.offset_deg = change.angle(joint.offset_deg);
            }
        }
        GeneratorSet::Shape(shape) => {
            shape.stride_s /= speed;
            for (joint, change) in shape.joints.iter_mut().zip(&changes) {
                joint.mean_deg = change.angle(joint.mean_deg);
                joint.cos_deg = change.coefficients(&joint.cos_deg)?;
                joint.sin_deg = change.coefficients(&joint.sin_deg)?;
            }
        }
        GeneratorSet::Spline(spline) => {
            spline.stride_s /= speed;
            let joints = [&mut spline.left_hip, &mut spline.right_hip, &mut spline.left_knee, &mut spline.right_knee];
            for (joint, change) in joints.into_iter().zip(&changes) {
                joint.knots_deg = joint.knots_deg.map(|degrees| change.angle(degrees));
            }
        }
        other => {
            return Err(format!(
                "a generator of the kind `{}` has no parameters for these settings; allowed are phase-coupled, shape and spline",
                other.name()
            ));
        }
    }
    saved.check().map_err(|error| format!("with these settings: {error}"))?;
    Ok(saved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use generator_file::file::{PhaseCoupledSet, ShapeJoint, ShapeSet};
    use joint_loop::generator::spline::{SplineJoint, SplineSet};
    use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop};
    use joint_loop::tuning::{Action, Request};
    use joint_loop::{BoardFaults, GeneratorConfig, Sample, WatchdogHz};
    use joint_units::{AdcCode, Volts};

    /// The control loop of a board with this generator, armed, with these requests made at rest; every setpoint, degrees.
    fn setpoints(generator: GeneratorConfig, settings: &Settings) -> Vec<[f32; 4]> {
        let parameters = Parameters::with_defaults(Some(generator), None, RobotConfig::default_biped()).unwrap();
        let mut joints: BoardLoop = board_loop(&parameters, AdcCode(1501), Volts(2.7), false).unwrap();
        let mut all = Vec::new();
        for tick in 0..8_000_u16 {
            let parameter = Parameter::ALL.get(usize::from(tick)).copied();
            let request = parameter.map(|parameter| Request {
                number: tick,
                action: Action::Set { parameter, thousandths: settings.thousandths(parameter) },
            });
            // A set of codes inside the supply; the emergency stop is tested, and the button held for 0.4 s.
            let request =
                request.filter(|request| !matches!(request.action, Action::Set { parameter: Parameter::Follow, .. }));
            let sample = Sample {
                codes: [AdcCode(2200); 4],
                vrefint: AdcCode(1652),
                button: (100..500).contains(&tick),
                faults: if (30..60).contains(&tick) { BoardFaults::BREAK_INPUT } else { BoardFaults::NONE },
                request,
                watchdog_clock: Some(WatchdogHz(32_000)),
                ..Sample::default()
            };
            joints.tick(&sample);
            all.push(joints.frame().setpoints.map(|angle| angle.degrees()));
        }
        all
    }

    /// Largest difference of two motions over the last strides, at the best of some delays, ticks: one may begin a little later.
    fn difference(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
        let at = |delay: usize| {
            let pairs = a[4_000..7_500].iter().zip(&b[4_000 - 30 + delay..]);
            pairs.flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs())).fold(0.0, f32::max)
        };
        (0..60).map(at).fold(f32::INFINITY, f32::min)
    }

    fn shape() -> ShapeSet {
        let joint = |mean_deg: f32, first: f32| ShapeJoint {
            mean_deg,
            cos_deg: Coefficients::new(&[first, 2.0]).unwrap(),
            sin_deg: Coefficients::new(&[1.0, -1.5]).unwrap(),
        };
        ShapeSet { stride_s: 1.2, joints: [joint(8.0, 15.0), joint(8.0, -15.0), joint(28.0, 14.0), joint(28.0, -14.0)] }
    }

    fn spline() -> SplineSet {
        let joint = |mean: f32, size: f32| SplineJoint {
            knots_deg: std::array::from_fn(|k| mean + size * (std::f32::consts::FRAC_PI_6 * k as f32).cos()),
        };
        let [left_hip, right_hip] = [joint(5.0, 14.0), joint(5.0, -14.0)];
        SplineSet { stride_s: 1.3, left_hip, right_hip, left_knee: joint(30.0, 18.0), right_knee: joint(30.0, -18.0) }
    }

    /// The board with the settings and the board with the saved generator move alike; without the settings they do not.
    #[test]
    fn a_saved_generator_moves_as_the_board_did() {
        let texts = [
            "speed=1.15",
            "amplitude_left_hip=0.8",
            "amplitude_right_knee=0.9",
            "offset_left_knee=2.5",
            "offset_right_hip=-1",
        ];
        let settings = settings(&texts.map(str::to_owned)).unwrap();
        let network = PhaseCoupledSet::rounded(&cpg_core::gait::default_walk::default_config());
        for set in [GeneratorSet::PhaseCoupled(network), GeneratorSet::Shape(shape()), GeneratorSet::Spline(spline())] {
            let robot = RobotConfig::default_biped();
            let tuned = setpoints(set.config(), &settings);
            let kept = setpoints(saved(&set, &settings, &robot).unwrap().config(), &Settings::default());
            let untouched = setpoints(set.config(), &Settings::default());
            let name = set.name();
            assert!(difference(&tuned, &kept) < 0.4, "{name}: {}", difference(&tuned, &kept));
            assert!(difference(&tuned, &untouched) > 2.0, "{name}: {}", difference(&tuned, &untouched));
        }
    }

    #[test]
    fn settings_are_read_back_from_the_board_that_has_this_generator_and_robot() {
        let (config, robot) = (GeneratorConfig::default_walk(), RobotConfig::default_biped());
        let sums = [
            generator_record::record_of(&config, &RecordName::BUILT_IN).crc(),
            robot_record::record_of(&robot, &RecordName::BUILT_IN).crc(),
        ];
        let with = |changes: &[(Parameter, i32)]| {
            changes.iter().fold(Settings::default(), |all, (of, value)| all.with(*of, *value).unwrap())
        };
        let read = |changes: &[(Parameter, i32)], [generator, robot_sum]: [u32; 2], state, at_rest| {
            let settings = wire::Settings { tick: 1, generator, robot: robot_sum, values: with(changes) };
            read_back(&Reported { settings, state }, Path::new("walk.toml"), &config, &robot, at_rest)
        };
        use SupervisorState::{Disarmed, Walking};
        let faster = [(Parameter::Speed, 1_250), (Parameter::RecordRate, 10_000)];
        assert_eq!(read(&faster, sums, Walking, false), Ok(with(&faster[..1])));
        assert_eq!(read(&faster, sums, Disarmed, true), Ok(with(&faster[..1])));
        for (changes, sums, state, words) in [
            (
                &faster[..],
                [1, sums[1]],
                Disarmed,
                "write this one to it first: cargo xtask flash --keep --generator walk.toml",
            ),
            (&faster, [sums[0], 1], Disarmed, "another robot"),
            (&faster, sums, Walking, "allowed is `disarmed`"),
            (&[(Parameter::Gait, 1_000)], sums, Disarmed, "walks the gait `walk`"),
            (&faster[1..], sums, Disarmed, "nothing to save"),
        ] {
            let error = read(changes, sums, state, true).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }

    /// A board without a generator record has the generator of `footfall defaults generator`.
    #[test]
    fn the_file_of_the_default_walk_is_that_of_the_board() {
        let file = GeneratorFile::default_of("phase-coupled").unwrap();
        let sum = |config: &GeneratorConfig| generator_record::record_of(config, &RecordName::BUILT_IN).crc();
        assert_eq!(sum(&file.set.config()), sum(&GeneratorConfig::default_walk()));
    }

    #[test]
    fn what_a_generator_cannot_hold_is_refused() {
        for (text, words) in [
            ("gait=walk", "no generator file holds it"),
            ("follow=off", "no generator file holds it"),
            ("speed", "allowed is NAME=VALUE"),
            ("speed=9", "allowed are 0.5 to 1.5"),
            ("arm=1", "`arm` is no parameter"),
        ] {
            let error = settings(&[text.into()]).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(words), "{error}");
        }
        let robot = RobotConfig::default_biped();
        let thesis = GeneratorFile::default_of("thesis").unwrap().set;
        let error = saved(&thesis, &Settings::default(), &robot).unwrap_err();
        assert!(error.contains("the kind `thesis`") && error.contains("spline"), "{error}");
        let beyond = ShapeSet { stride_s: 1e-3, ..shape() };
        let error = saved(&GeneratorSet::Shape(beyond), &Settings::default(), &robot).unwrap_err();
        assert!(error.contains("stride_s"), "{error}");
    }
}
