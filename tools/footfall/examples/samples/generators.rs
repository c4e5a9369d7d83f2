//! A generator and a follower: the walk of the family as a Fourier series.

use super::motion::CADENCE;
use cpg_core::Generator;
use cpg_core::gait::family::Member;
use generator_file::file::GeneratorFile;
use joint_units::{Joint, Period};
use std::f64::consts::TAU;
use std::fmt::Write as _;

const HARMONICS: usize = 6;
/// Points of the stride from which the coefficients are computed.
const POINTS: usize = 1200;

/// A generator file of the kind `shape`.
pub(super) fn shape() -> String {
    file("shape", "")
}

/// A generator file of the kind `follow`, with the sensor on the left hip.
pub(super) fn follower() -> String {
    file("follow", "sensor = \"left_hip\"\nevents = \"none\"\n")
}

fn file(kind: &str, keys: &str) -> String {
    let stride_s = f64::from(120.0 / CADENCE);
    let mut text = format!(
        "schema = 2\ngenerator = \"{kind}\"\n\n[provenance]\n\
         source = \"the gait human-walk at {CADENCE} steps a minute\"\nsource_sha256 = \"\"\n\
         made_by = \"the program that makes samples\"\nsettings = \"{HARMONICS} harmonics\"\n\n\
         [{kind}]\n{keys}stride_s = {stride_s:.4}\n"
    );
    let stride = stride();
    for joint in Joint::ALL {
        let angles: Vec<f64> = stride.iter().map(|row| row[joint as usize]).collect();
        let mean = angles.iter().sum::<f64>() / POINTS as f64;
        let list = |of: fn(f64) -> f64| {
            // Rounded first: what is nearly 0 is not written as -0.
            let one = |harmonic| format!("{:.3}", (coefficient(&angles, harmonic, of) * 1e3).round() / 1e3 + 0.0);
            (1..=HARMONICS).map(one).collect::<Vec<_>>().join(", ")
        };
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n[{kind}.{}]\nmean_deg = {mean:.3}\ncos_deg = [{}]\nsin_deg = [{}]\n",
            joint.name(),
            list(f64::cos),
            list(f64::sin)
        );
    }
    GeneratorFile::parse(kind, &text).expect("a generator file");
    text
}

/// One stride of the walk, degrees.
fn stride() -> Vec<[f64; Joint::COUNT]> {
    let mut walk = Member::Walk.at_cadence(CADENCE).expect("a cadence of the walk");
    // One tick of 1 ms is one point.
    walk.stride_s = POINTS as f32 * 1e-3;
    let mut walk = walk.build(Period::MILLISECOND).expect("a walk");
    let point = |_| {
        let angles = walk.angles().map(|angle| f64::from(angle.degrees()));
        walk.step();
        angles
    };
    (0..POINTS).map(point).collect()
}

fn coefficient(angles: &[f64], harmonic: usize, wave: fn(f64) -> f64) -> f64 {
    let at = |point: usize| wave(TAU * harmonic as f64 * point as f64 / POINTS as f64);
    angles.iter().enumerate().map(|(point, angle)| angle * at(point)).sum::<f64>() * 2.0 / POINTS as f64
}
