//! Eleven runs whose setpoints and pulses keep every bit: what makes the tick cheaper must not change them.
//!
//! The digests are those of commit `bf25f116`, before the tick was made cheaper, where this test was run too. Only the wire that comes off has another one,
//! since commit `3690c07d`: a sensor is tolerated for 48 ms, not 50; and the follower whose person stops was added with the digest of `fa60acf6`, before a
//! follower was made cheaper. A change that is meant to move a setpoint says so in the changelog and has the digests
//! that the failed test prints.

mod support;

use std::f64::consts::TAU;
use std::fmt::Write as _;

use cpg_core::Follow as _;
use cpg_core::entrainment::{Corrections, EventSource, Lock};
use cpg_core::network::thesis::ThesisConfig;
use crc::{CRC_64_XZ, Crc};
use hgod_adc::ReferenceConfig;
use joint_loop::generator::spline::{SPLINE_KNOTS, SplineConfig};
use joint_loop::tuning::{Action, Outcome, Parameter, Request};
use joint_loop::{
    BoardGenerator, FollowConfig, GeneratorConfig, JointLoop, LoopConfig, SERIES_HARMONICS, Sample, SeriesConfig,
    ShapeConfig,
};
use joint_units::{AdcCode, Joint, Period, PulseMicros, Radians};
use support::{OPEN, VREFINT, good, sensor};

static CHECK_SUM: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);
/// Ticks of a run.
const TICKS: u32 = 20_000;
/// The button is held in these ticks, and its release arms.
const HELD: std::ops::Range<u32> = 100..500;

/// Angles like those of a walk: a mean, and two harmonics.
fn series(mean: f32, first: f32, second: f32) -> SeriesConfig {
    let mut cos = [0.0; SERIES_HARMONICS];
    let mut sin = [0.0; SERIES_HARMONICS];
    (cos[0], sin[1]) = (first, second);
    SeriesConfig { mean: Radians(mean), cos, sin }
}

fn shape() -> ShapeConfig {
    let joints = [series(0.1, 0.3, 0.05), series(0.1, -0.3, 0.05), series(0.5, 0.3, 0.1), series(0.5, -0.3, 0.1)];
    ShapeConfig { stride_s: 1.25, joints }
}

fn spline() -> SplineConfig {
    let joint = |mean: f64, size: f64| {
        core::array::from_fn::<_, SPLINE_KNOTS, _>(|knot| {
            let phase = TAU * knot as f64 / SPLINE_KNOTS as f64;
            Radians((mean + size * phase.cos()) as f32)
        })
    };
    SplineConfig { stride_s: 1.5, knots: [joint(0.1, 0.3), joint(0.1, -0.3), joint(0.6, 0.3), joint(0.6, -0.3)] }
}

/// The sensor on a knee that walks: 1.1 s a stride.
fn knee(tick: u32) -> AdcCode {
    AdcCode((1_800.0 + 400.0 * (TAU * f64::from(tick) / 1_100.0).sin()).round() as u16)
}

fn request(number: u16, action: Action) -> Option<Request> {
    Some(Request { number, action })
}

fn set(number: u16, parameter: Parameter, thousandths: i32) -> Option<Request> {
    request(number, Action::Set { parameter, thousandths })
}

/// What a run changes of the good sample of a tick.
type Change = fn(u32, &mut Sample<1>);
type Loop = JointLoop<BoardGenerator, 1>;

/// The runs: name, generator, and what happens but for the hold of the button.
fn runs() -> Vec<(&'static str, GeneratorConfig, Change)> {
    let walk = GeneratorConfig::default_walk();
    let follow = FollowConfig {
        sensor: Joint::LeftKnee,
        events: EventSource::Peak,
        shape: shape(),
        corrections: Corrections::NONE,
    };
    vec![
        ("the default walk", walk, |_, _| {}),
        ("the network of the thesis", GeneratorConfig::Thesis(ThesisConfig::set_s()), |_, _| {}),
        ("a shape", GeneratorConfig::Shape(shape()), |_, _| {}),
        ("a spline", GeneratorConfig::Spline(spline()), |_, _| {}),
        ("a follower", GeneratorConfig::Follow(follow), |tick, sample| sample.codes = [knee(tick)]),
        ("a follower whose person stops and walks on", GeneratorConfig::Follow(follow), |tick, sample| {
            let walked = tick - tick.saturating_sub(7_000).min(2_500) - tick.saturating_sub(13_000).min(1_000);
            // The last bit moves, or the sensor would count as stuck.
            sample.codes = [AdcCode(knee(walked).0 + (tick % 2) as u16)];
        }),
        ("stopped by the button, armed again", walk, |tick, sample| {
            sample.button |= (8_000..8_100).contains(&tick) || (11_000..11_400).contains(&tick);
        }),
        ("other gaits, speeds, amplitudes and offsets", walk, |tick, sample| {
            sample.request = match tick {
                5_000 => set(1, Parameter::Gait, 2_000),
                8_000 => set(2, Parameter::Speed, 1_400),
                11_000 => set(3, Parameter::Amplitude(Joint::LeftKnee), 600),
                13_000 => set(4, Parameter::Offset(Joint::RightHip), 5_000),
                16_000 => set(5, Parameter::Gait, 1_000),
                _ => None,
            };
        }),
        ("a wire that comes off", walk, |tick, sample| {
            if tick >= 9_000 {
                sample.codes = [OPEN];
            }
        }),
        ("amplitudes that meet the limits", walk, |tick, sample| {
            sample.request = match tick {
                5_000 => set(1, Parameter::Amplitude(Joint::LeftHip), 1_500),
                6_000 => set(2, Parameter::Amplitude(Joint::RightKnee), 1_500),
                7_000 => set(3, Parameter::Speed, 1_500),
                _ => None,
            };
        }),
        ("a trim", walk, |tick, sample| {
            sample.request = match tick {
                50 => request(1, Action::Trim { joint: Joint::LeftKnee }),
                3_000 => request(2, Action::Jog { pulse: PulseMicros(1_300) }),
                6_000 => request(3, Action::Jog { pulse: PulseMicros(1_100) }),
                9_000 => request(4, Action::Stop),
                _ => None,
            };
        }),
    ]
}

/// CRC-64 over the setpoints and the commanded pulses of every tick; the loop at the end, and how many requests were not taken.
fn digest(config: &GeneratorConfig, change: Change) -> (u64, Loop, usize) {
    let supply = Some(ReferenceConfig::stm32f4(VREFINT).build().expect("valid"));
    let period = Period::MILLISECOND;
    let generator = config.build(period).expect("valid");
    let config = LoopConfig { supply, ..LoopConfig::default_biped() };
    let mut joints = config.build(period, generator, [Some(sensor())]).expect("valid");
    let mut refused = 0;
    let mut sum = CHECK_SUM.digest();
    for tick in 0..TICKS {
        let mut sample = Sample { button: HELD.contains(&tick), ..good(tick) };
        change(tick, &mut sample);
        let command = joints.tick(&sample);
        refused +=
            joints.answers().filter(|answer| !matches!(answer.outcome, Outcome::Staged | Outcome::InEffect)).count();
        let pulses = command.pulses.unwrap_or([PulseMicros(0); 4]).map(|pulse| u32::from(pulse.0));
        for word in joints.frame().setpoints.map(|angle| angle.0.to_bits()).into_iter().chain(pulses) {
            sum.update(&word.to_le_bytes());
        }
    }
    (sum.finalize(), joints, refused)
}

/// Name, digest and last state of each run.
const EXPECTED: &str = "\
the default walk: 5a71647533147563, Walking
the network of the thesis: be981d0e2eaf1873, Walking
a shape: b920961016b5f35a, Walking
a spline: b55ed3533046dde6, Walking
a follower: 60becfaf18f13bec, Walking
a follower whose person stops and walks on: 6d3db2ee30b11ace, Walking
stopped by the button, armed again: 24c78d222a0cac22, Walking
other gaits, speeds, amplitudes and offsets: 1acce77862eda09a, Walking
a wire that comes off: be5f7362ab110f9a, Disarmed
amplitudes that meet the limits: 092e61adfbe6d261, Walking
a trim: 56facc3a5bf2d4c0, TrimReady
";

#[test]
fn every_bit_of_eleven_runs_is_kept() {
    let mut found = String::new();
    for (name, config, change) in runs() {
        let (sum, joints, refused) = digest(&config, change);
        writeln!(found, "{name}: {sum:016x}, {:?}", joints.state()).expect("a string");
        // No request was refused, the limits acted where they should, and the follower has locked.
        assert_eq!(refused, 0, "{name}");
        let frame = joints.frame();
        let meets_limits = name.contains("limits") || name.contains("other gaits");
        assert_eq!(frame.limited_ticks > 0, meets_limits, "{name}: {} ticks", frame.limited_ticks);
        let lock = joints.generator().follow_status().map(|status| status.state);
        assert_eq!(lock, name.starts_with("a follower").then_some(Lock::Locked), "{name}");
    }
    assert!(found == EXPECTED, "found:\n{found}\nexpected:\n{EXPECTED}");
}
