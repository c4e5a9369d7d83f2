//! Freezes every bit of every generator of the catalogue: a change that only moves code must change no line of `tests/golden/generator-bits.txt`.
//!
//! `FOOTFALL_WRITE_GOLDEN=1 cargo test -p cpg-core --test golden` writes the file; without the variable the test compares.

mod common;

use std::fmt::Write as _;
use std::path::Path;

use common::micros;
use cpg_core::entrainment::FollowerConfig;
use cpg_core::entrainment::phase_lock::Template;
use cpg_core::gait::catalogue::{self, Visitor};
use cpg_core::gait::default_walk::default_config;
use cpg_core::gait::named::Gait;
use cpg_core::joints::features::Features;
use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled::Robust;
use cpg_core::network::thesis::{Thesis, ThesisConfig};
use cpg_core::waveform::shape::Shape;
use cpg_core::{BuildError, Follow, Generator, SemiImplicitEuler};
use joint_units::{Joint, Period, Phase, Radians};

/// Steps of each generator: more than four strides at 1 ms.
const STEPS: u32 = 5_000;
/// Steps of the follower, which has to find its person first.
const FOLLOWED: u32 = 20_000;
/// Control periods, in microseconds.
const PERIODS: [u32; 2] = [1_000, 2_000];

/// FNV-1a of 64 bits.
struct Hash(u64);

impl Hash {
    fn take(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

/// Hash of angles, rates, phase, amplitude and check after each step; `before` runs ahead of each step.
fn hash_of<G: Generator<N>, const N: usize>(mut generator: G, steps: u32, mut before: impl FnMut(&mut G, u32)) -> u64 {
    let mut hash = Hash(0xcbf2_9ce4_8422_2325);
    for step in 0..steps {
        before(&mut generator, step);
        generator.step();
        generator.angles().iter().for_each(|angle| hash.take(angle.0.to_bits()));
        generator.rates().iter().for_each(|rate| hash.take(rate.0.to_bits()));
        hash.take(generator.phase().0);
        hash.take(generator.amplitude().to_bits());
        hash.take(generator.check().is_ok().into());
    }
    hash.0
}

/// One line a generator and period.
struct Lines {
    period: Period,
    text: String,
}

impl Lines {
    fn add(&mut self, name: &str, hash: Result<u64, BuildError>) {
        let period = self.period.micros();
        match hash {
            Ok(hash) => writeln!(self.text, "{name}, {period} us: {hash:016x}").expect("a string"),
            Err(error) => writeln!(self.text, "{name}, {period} us: {error}").expect("a string"),
        }
    }
}

impl Visitor for Lines {
    fn generator<G: Generator<4> + Features + Clone>(&mut self, name: &'static str, built: Result<G, BuildError>) {
        self.add(name, built.map(|generator| hash_of(generator, STEPS, |_, _| {})));
    }
}

/// A follower whose person walks, loses the sensor, stands and walks on.
fn follower(period: Period) -> Result<u64, BuildError> {
    let joint = |mean: f32, size: f32, lead: f32| {
        let (mut cos, mut sin) = ([0.0; 8], [0.0; 8]);
        for (n, part) in [1.0, -0.2, 0.05].into_iter().enumerate() {
            let turn = core::f32::consts::TAU * lead * (n + 1) as f32;
            (cos[n], sin[n]) = (size * part * turn.cos(), -size * part * turn.sin());
        }
        Template::new(Radians(mean), cos, sin)
    };
    let hips = [joint(0.1, 0.35, 0.0)?, joint(0.1, 0.35, 0.5)?];
    let knees = [joint(0.45, 0.35, 0.25)?, joint(0.45, 0.35, 0.75)?];
    let templates = [hips[0], hips[1], knees[0], knees[1]];
    let person = templates[Joint::LeftKnee as usize];
    let built = FollowerConfig::default().build(templates, Joint::LeftKnee, period)?;
    let (mut cycles, mut followed) = (0.0_f32, 0);
    let hash = hash_of(built, FOLLOWED, |follower, step| {
        followed += u32::from(follower.amplitude() == 1.0);
        let moment = step * 100 / FOLLOWED;
        if !(70..80).contains(&moment) {
            cycles = (cycles + period.seconds() / 1.05).fract();
        }
        let angle = Radians(person.at(Phase::from_cycles(cycles)).angle);
        follower.observe(if (60..63).contains(&moment) { None } else { Some(angle) });
    });
    assert!(followed > FOLLOWED / 4, "it followed for {followed} steps");
    Ok(hash)
}

fn all() -> String {
    let mut lines = Lines { period: Period::MILLISECOND, text: String::new() };
    for period in PERIODS.map(micros) {
        lines.period = period;
        catalogue::each(period, &mut lines);
        let robust: Result<Robust<Biped, 4, 4, f32, SemiImplicitEuler>, _> = default_config().build(period);
        lines.add("robust by semi-implicit Euler", robust.map(|built| hash_of(built, STEPS, |_, _| {})));
        let thesis: Result<Thesis<f32, SemiImplicitEuler>, _> = ThesisConfig::set_s().build(period);
        lines.add("thesis by semi-implicit Euler", thesis.map(|built| hash_of(built, STEPS, |_, _| {})));
        for gait in Gait::ALL {
            lines.add(
                &format!("gait {}", gait.name()),
                gait.build(1.0, period).map(|built| hash_of(built, STEPS, |_, _| {})),
            );
        }
        lines.add("follower", follower(period));
    }
    lines.text
}

#[test]
fn no_generator_has_changed_a_bit() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/generator-bits.txt");
    let found = all();
    if std::env::var_os("FOOTFALL_WRITE_GOLDEN").is_some() {
        std::fs::write(&file, &found).expect("written");
    }
    let kept = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    for (found, kept) in found.lines().zip(kept.lines()) {
        assert_eq!(found, kept);
    }
    assert_eq!(found, kept);
}
