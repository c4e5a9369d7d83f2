//! How far a generator can be led: the Arnold tongue of a link from a master oscillator.
//!
//! The master is a clock at frequency F; its link acts on the first joint as a link of R1 does between joints, with lead 0:
//! ```text
//! v' = ... + 2 pi f kap (v_m - v),   u_m = cos(2 pi F t), v_m = -sin(2 pi F t)
//! ```
//! with u and v in amplitudes of the joint and f the generator's own frequency. A frequency locks 1:1 if, after [`SETTLE_CYCLES`]
//! cycles of the master, generator and master do not come apart by more than [`SLIP`] of a cycle in [`WATCH_CYCLES`] more. The
//! stronger the link, the wider the range: drawn over the strength it is the tongue. Below half and above twice its own frequency
//! nothing is tried, and a range that ends there is open.

use cpg_core::waveform::shape::STRIDE_RANGE_S;
use serde::Serialize;
use std::f64::consts::TAU;

use crate::certificate::{Orbit, Specimen};
use crate::following::Following;

/// Strengths kap of the link. R1's own links have 0.5.
pub const STRENGTHS: [f64; 3] = [0.1, 0.25, 0.5];
/// Cycles of the master that a lock is given to form.
pub const SETTLE_CYCLES: f64 = 100.0;
/// Cycles of the master over which it must hold.
pub const WATCH_CYCLES: f64 = 40.0;
/// How far generator and master may come apart meanwhile, in cycles.
pub const SLIP: f64 = 0.02;
/// Lowest and highest frequency that is tried, in parts of the generator's own.
pub const TRIED: [f64; 2] = [0.5, 2.0];

/// Where the phase is the input, the strides that it can be set to, Hz.
pub const BY_PHASE_HZ: [f64; 2] = [1.0 / STRIDE_RANGE_S.1 as f64, 5.0];

/// The range that one strength of the link locks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tongue {
    /// kap of the link.
    pub strength: f64,
    /// Lowest frequency that locks, Hz; none where not even the generator's own does.
    pub low_hz: Option<f64>,
    /// Highest.
    pub high_hz: Option<f64>,
    /// The same in parts of the generator's own frequency.
    pub low: Option<f64>,
    /// See `low`.
    pub high: Option<f64>,
}

impl Tongue {
    /// Lowest and highest frequency, Hz.
    #[must_use]
    pub fn range_hz(&self) -> Option<[f64; 2]> {
        self.low_hz.zip(self.high_hz).map(|(low, high)| [low, high])
    }
}

/// What leads an oscillator, in words.
pub(crate) fn by_link() -> String {
    "a link from a master oscillator to the first joint, 1:1".into()
}

/// What leads a phase, in words.
pub(crate) fn by_phase() -> String {
    let [low, high] = BY_PHASE_HZ;
    format!(
        "phase and stride are inputs: it follows any frequency from {low:.3} to {high:.3} Hz at once, whatever the strength"
    )
}

/// What leads a follower, in words.
pub(crate) fn by_sensor(found: &Following) -> String {
    format!("the gait sensor on {}", found.sensor)
}

/// The range of each strength.
pub(crate) fn tongues(built: &dyn Specimen, orbit: &Orbit) -> Vec<Tongue> {
    let own = 1.0 / orbit.period_s;
    let range = |strength: f64| {
        let locked = |ratio: f64| locks(built, orbit, strength, ratio);
        locked(1.0).then(|| [edge(&locked, TRIED[0]), edge(&locked, TRIED[1])])
    };
    let tongue = |strength: f64| {
        let range = range(strength);
        let [low, high] = [range.map(|r| r[0]), range.map(|r| r[1])];
        Tongue { strength, low, high, low_hz: low.map(|r| r * own), high_hz: high.map(|r| r * own) }
    };
    STRENGTHS.into_iter().map(tongue).collect()
}

/// The last ratio that locks on the way from 1 to `limit`, to 1 in 1000.
fn edge(locked: &impl Fn(f64) -> bool, limit: f64) -> f64 {
    let step = if limit > 1.0 { 1.05 } else { 1.0 / 1.05 };
    let reached = |ratio: f64| if limit > 1.0 { ratio >= limit } else { ratio <= limit };
    let (mut inside, mut outside) = (1.0, step);
    while locked(outside) {
        inside = outside;
        if reached(outside) {
            return limit;
        }
        outside *= step;
    }
    while (outside - inside).abs() > 1e-3 {
        let middle = 0.5 * (inside + outside);
        if locked(middle) { inside = middle } else { outside = middle }
    }
    inside
}

/// Whether a master at this part of the generator's own frequency carries it along.
fn locks(built: &dyn Specimen, orbit: &Orbit, strength: f64, ratio: f64) -> bool {
    let mut specimen = built.copy();
    specimen.set_state(&orbit.points[0]);
    let joints = orbit.points[0].len() / 2;
    // The velocity's amplitude is that of its own orbit, so that a master at the own frequency would pull at nothing.
    let (u_size, v_size) = (orbit.size(0), orbit.size(joints));
    let per_step = ratio / orbit.steps;
    let pull = TAU / orbit.steps * strength;
    let first = (SETTLE_CYCLES / per_step) as u32;
    let all = first + (WATCH_CYCLES / per_step) as u32;
    // Lead of the generator over the master in cycles, counted on through every turn; told once a cycle of the master, because
    // within one it wavers with the waveform.
    let (mut lead, mut low, mut high) = (0.0, f64::MAX, f64::MIN);
    let mut before = 0.0;
    for step in 0..all {
        let master = (per_step * f64::from(step)).fract();
        let mut state = specimen.state();
        state[joints] += pull * (-v_size * (TAU * master).sin() - state[joints]);
        if !specimen.set_state(&state) {
            return false;
        }
        let phase = (-state[joints] / v_size).atan2(state[0] / u_size) / TAU;
        lead += (phase - master - lead + 0.5).rem_euclid(1.0) - 0.5;
        if step >= first && master < before {
            (low, high) = (f64::min(low, lead), f64::max(high, lead));
        }
        before = master;
        specimen.step();
    }
    specimen.sound() && high - low < SLIP
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certificate::certify;
    use crate::file::{GeneratorFile, GeneratorSet};
    use joint_loop::LoopConfig;

    /// The stronger the link, the wider the range, at both ends; it begins at the generator's own frequency.
    #[test]
    fn the_range_of_the_default_walk_is_a_tongue() {
        let set: GeneratorSet = GeneratorFile::default_of("phase-coupled").unwrap().set;
        let got = certify(&set, 1, &LoopConfig::default_biped(), &mut |_| ()).unwrap();
        assert_eq!(got.entrainment.len(), STRENGTHS.len());
        let mut inner = [1.0, 1.0];
        for (tongue, strength) in got.entrainment.iter().zip(STRENGTHS) {
            let (low, high) = (tongue.low.unwrap(), tongue.high.unwrap());
            assert!(tongue.strength == strength && low < inner[0] - 0.003 && high > inner[1] + 0.003, "{tongue:?}");
            assert!((tongue.low_hz.unwrap() * got.period_s - low).abs() < 1e-9);
            inner = [low, high];
        }
        assert_eq!(got.entrainment_hz, got.entrainment.last().unwrap().range_hz());
    }
}
