//! Entrainment of a generator: the Arnold tongue of a link from a master oscillator.
//!
//! The master is a clock at frequency F; its link acts on the first joint as a link of R1 does between joints, with lead 0:
//! ```text
//! v' = ... + 2 pi f kap (v_m - v),   u_m = cos(2 pi F t), v_m = -sin(2 pi F t)
//! ```
//! with u and v in amplitudes of the joint and f the generator's own frequency. A frequency locks 1:1 if, after [`SETTLE_CYCLES`]
//! cycles of the master, the phase difference of the master and **every** joint changes by less than [`SLIP`] of a cycle in
//! [`WATCH_CYCLES`] more. The stronger the link, the wider the range; the range over the strength is the tongue. Only half to twice the own frequency is tried, and a range that ends
//! there is open.

use cpg_core::waveform::shape::STRIDE_RANGE_S;
use serde::Serialize;
use std::f64::consts::TAU;

use crate::following::Following;
use crate::model::Model;
use crate::orbit::Orbit;

/// Strengths kap of the link. R1's own links have 0.5.
pub const STRENGTHS: [f64; 3] = [0.1, 0.25, 0.5];
/// Cycles of the master before the lock is tested.
pub const SETTLE_CYCLES: f64 = 100.0;
/// Cycles of the master during which the lock is tested.
pub const WATCH_CYCLES: f64 = 40.0;
/// Largest change of the phase difference meanwhile, in cycles.
pub const SLIP: f64 = 0.02;
/// Lowest and highest frequency that is tried, divided by the generator's own.
pub const TRIED: [f64; 2] = [0.5, 2.0];

/// Range of the stride frequency of a generator whose phase is an input, Hz.
pub const BY_PHASE_HZ: [f64; 2] = [1.0 / STRIDE_RANGE_S.1 as f64, 5.0];

/// The range that one strength of the link locks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tongue {
    /// Strength kap of the link.
    pub strength: f64,
    /// Lowest frequency that locks, Hz; none if not even the generator's own does.
    pub low_hz: Option<f64>,
    /// Highest frequency that locks, Hz.
    pub high_hz: Option<f64>,
    /// `low_hz` divided by the generator's own frequency.
    pub low: Option<f64>,
    /// `high_hz` divided by the generator's own frequency.
    pub high: Option<f64>,
}

impl Tongue {
    /// Lowest and highest frequency, Hz.
    #[must_use]
    pub fn range_hz(&self) -> Option<[f64; 2]> {
        self.low_hz.zip(self.high_hz).map(|(low, high)| [low, high])
    }
}

/// The input of an oscillator, in words.
pub(crate) fn by_link() -> String {
    "a link from a master oscillator to the first joint, 1:1; every joint locks".into()
}

/// Why no range is measured, in words.
pub(crate) fn not_measured(why: &str) -> String {
    format!("not measured: {why}")
}

/// The input of a phase, in words.
pub(crate) fn by_phase() -> String {
    let [low, high] = BY_PHASE_HZ;
    format!(
        "phase and stride are inputs: it follows any frequency from {low:.3} to {high:.3} Hz at once, whatever the strength"
    )
}

/// The input of a follower, in words.
pub(crate) fn by_sensor(found: &Following) -> String {
    format!("the gait sensor on {}", found.sensor)
}

/// The range of each strength.
pub(crate) fn tongues(built: &dyn Model, orbit: &Orbit) -> Vec<Tongue> {
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

/// The last ratio that locks between 1 and `limit`, to 1 in 1000.
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

/// Whether a master at `ratio` times the generator's own frequency locks every joint.
fn locks(built: &dyn Model, orbit: &Orbit, strength: f64, ratio: f64) -> bool {
    let mut model = built.copy();
    model.set_state(&orbit.at(0.0));
    let joints = orbit.dimensions() / 2;
    // The master's velocity has the amplitude of the orbit, so that a master on the orbit exerts no force.
    let sizes: Vec<(f64, f64)> = (0..joints).map(|joint| (orbit.size(joint), orbit.size(joints + joint))).collect();
    let per_step = ratio / orbit.steps;
    let pull = TAU / orbit.steps * strength;
    let first = (SETTLE_CYCLES / per_step) as u32;
    let all = first + (WATCH_CYCLES / per_step) as u32;
    // Phase lead of each joint over the master, in cycles, not wrapped; evaluated once a cycle of the master, because it varies
    // within a cycle with the waveform.
    let mut leads = vec![(0.0, f64::MAX, f64::MIN); joints];
    let mut before = 0.0;
    for step in 0..all {
        let master = (per_step * f64::from(step)).fract();
        let mut state = model.state();
        state[joints] += pull * (-sizes[0].1 * (TAU * master).sin() - state[joints]);
        model.set_state(&state);
        let watched = step >= first && master < before;
        for (joint, (lead, low, high)) in leads.iter_mut().enumerate() {
            let (u_size, v_size) = sizes[joint];
            let phase = (-state[joints + joint] / v_size).atan2(state[joint] / u_size) / TAU;
            *lead += (phase - master - *lead + 0.5).rem_euclid(1.0) - 0.5;
            if watched {
                (*low, *high) = (f64::min(*low, *lead), f64::max(*high, *lead));
                if *high - *low >= SLIP {
                    return false;
                }
            }
        }
        before = master;
        if !model.advance(1) {
            return false;
        }
    }
    true
}
