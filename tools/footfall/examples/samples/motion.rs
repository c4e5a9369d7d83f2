//! A synthetic person: the walk of the family at a cadence that changes, with the noise of a sensor.

use super::random::Noise;
use cpg_core::Generator;
use cpg_core::gait::family::Member;
use joint_units::{Joint, Period, Radians};
use std::f64::consts::TAU;

/// Mean cadence, steps a minute.
pub(crate) const CADENCE: f32 = 110.0;
/// Rows a second of every recording.
pub(crate) const RATE_HZ: f64 = 100.0;
/// Standard deviation of the noise of an angle, degrees.
const NOISE_DEG: f64 = 0.15;
/// The cadence is higher and lower for so long by turns, s.
const SPELL_S: f64 = 3.7;
/// Share by which it is higher and lower.
const SPELL_SHARE: f64 = 0.015;

/// Angles in degrees, in the order of [`Joint::ALL`], one row each 10 ms.
pub(crate) fn rows(seconds: f64, seed: u64) -> Vec<[f64; Joint::COUNT]> {
    let walk = Member::Walk.at_cadence(CADENCE).expect("a cadence of the walk");
    let mut walk = walk.build(Period::MILLISECOND).expect("a walk");
    // Ticks at the mean cadence; what is between two of them is interpolated.
    let mut ticks: Vec<[f64; Joint::COUNT]> = Vec::new();
    let mut at = move |time_s: f64| {
        let place = time_s * 1e3;
        while ticks.len() < place as usize + 2 {
            ticks.push(walk.angles().map(|angle: Radians| f64::from(angle.degrees())));
            walk.step();
        }
        let (before, part) = (place as usize, place - place.floor());
        std::array::from_fn::<f64, { Joint::COUNT }, _>(|joint| {
            let [a, b] = [ticks[before][joint], ticks[before + 1][joint]];
            a + part * (b - a)
        })
    };
    let mut noise = Noise::new(seed);
    let row = |row: u32| at(course(f64::from(row) / RATE_HZ)).map(|angle| angle + noise.normal(NOISE_DEG));
    (0..(seconds * RATE_HZ) as u32).map(row).collect()
}

/// Mean of an ankle, and cosine and sine of harmonics 1 to 3 over the stride from heel strike on, degrees, dorsiflexion positive: made up, with
/// the usual order of a small plantarflexion, dorsiflexion in stance and a large plantarflexion at push-off.
const ANKLE: (f64, [(f64, f64); 3]) = (-0.2, [(-1.1, 4.9), (1.1, -5.9), (-2.2, 0.9)]);
/// Part of the stride from the largest flexion of the left hip, where the walk begins, to the left heel strike.
const HEEL_STRIKE: f64 = 0.1;

/// Left and right ankle in degrees for the same rows as [`rows`].
pub(crate) fn ankles(seconds: f64, seed: u64) -> Vec<[f64; 2]> {
    let (mean, harmonics) = ANKLE;
    let angle = |part: f64| {
        let terms = (1_u8..).zip(harmonics).map(|(harmonic, (cos, sin))| {
            let turn = TAU * f64::from(harmonic) * part;
            cos * turn.cos() + sin * turn.sin()
        });
        mean + terms.sum::<f64>()
    };
    let mut noise = Noise::new(seed);
    let row = |row: u32| {
        let strides = course(f64::from(row) / RATE_HZ) * f64::from(CADENCE) / 120.0;
        [0.0, 0.5].map(|leg| angle(strides - HEEL_STRIKE + leg) + noise.normal(NOISE_DEG))
    };
    (0..(seconds * RATE_HZ) as u32).map(row).collect()
}

/// Time on the course of the mean cadence: a triangle wave is added, so that the cadence is higher and lower by turns.
fn course(time_s: f64) -> f64 {
    let spell = (time_s / SPELL_S).floor();
    let within = time_s - spell * SPELL_S;
    let gained = if spell % 2.0 == 0.0 { within } else { SPELL_S - within };
    time_s + SPELL_SHARE * gained
}
