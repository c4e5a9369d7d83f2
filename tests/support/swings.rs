//! Swings and pauses of one joint, recorded and driven.
//!
//! A phantom stride is a swing of a setpoint of at least half the template's range that the recorded joint (10 degrees or more) does not
//! make within 0.4 s. A pause is 1 s and longer within 12 degrees, standing.

use cpg_core::entrainment::phase_lock::Template;
use gait_fit::following::learn::angle_deg;

/// A top of a series: its tick, and its height.
pub type Top = (usize, f64);

/// Rise to either side of a recorded swing that explains a driven one, degrees.
const RECORDED_DEG: f64 = 10.0;
/// How far a driven swing may be from the recorded one, ticks.
const WITHIN: usize = 400;
/// Range of a joint that stands, degrees.
const STANDING_DEG: f64 = 12.0;

/// From lowest to highest angle of a template, degrees.
#[must_use]
pub fn range_deg(template: &Template) -> f64 {
    let heights = (0..200).map(|n| angle_deg(template, f64::from(n) / 200.0));
    heights.clone().fold(f64::MIN, f64::max) - heights.fold(f64::MAX, f64::min)
}

/// Tops of a series at least `rise` above what lies to either side.
pub fn tops(values: impl Iterator<Item = f64>, rise: f64) -> Vec<Top> {
    let (mut found, mut top, mut trough, mut rising) = (vec![], (0, f64::MIN), f64::MAX, true);
    for (n, value) in values.enumerate() {
        if rising {
            if value > top.1 {
                top = (n, value);
            } else if value < top.1 - rise {
                found.push(top);
                (rising, trough) = (false, value);
            }
        } else if value < trough {
            trough = value;
        } else if value > trough + rise {
            (rising, top) = (true, (n, value));
        }
    }
    found
}

/// The swings among the driven ones that the recorded joint did not make.
#[must_use]
pub fn phantoms(driven: &[Top], recorded: &[f64]) -> Vec<Top> {
    let recorded = tops(recorded.iter().copied(), RECORDED_DEG);
    let is_there = |&(n, _): &Top| recorded.iter().any(|&(m, _)| n.abs_diff(m) <= WITHIN);
    driven.iter().copied().filter(|top| !is_there(top)).collect()
}

/// For each tick of a recorded joint how many ticks it has stood, that one included: 1 where it moves.
#[must_use]
pub fn standing(recorded: &[f64]) -> Vec<usize> {
    let mut from = 0;
    let stood = (0..recorded.len()).map(|n| {
        while recorded[from..=n].iter().fold(f64::MIN, |a, &b| a.max(b))
            - recorded[from..=n].iter().fold(f64::MAX, |a, &b| a.min(b))
            > STANDING_DEG
        {
            from += 1;
        }
        n - from + 1
    });
    stood.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tops_phantoms_and_pauses_of_a_series_made_by_hand() {
        let wave = |n: usize| 30.0 - 30.0 * (std::f64::consts::TAU * n as f64 / 1000.0).cos();
        // Two swings, a pause of 3 s, one swing.
        let walk: Vec<f64> = (0..2000).chain([0; 3000]).chain(0..1000).map(wave).collect();
        let found = tops(walk.iter().copied(), 30.0);
        assert_eq!(found.iter().map(|top| top.0).collect::<Vec<_>>(), [500, 1500, 5500]);
        assert_eq!(phantoms(&found, &walk), []);
        assert_eq!(phantoms(&[(890, 60.0), (3500, 60.0), (5899, 60.0)], &walk), [(3500, 60.0)]);
        let stood = standing(&walk);
        assert!(stood[4999] > 3000 && stood[500] < 400 && stood[5500] < 400, "{} {}", stood[4999], stood[500]);
    }
}
