//! Hip and knee of one leg over a stride, as Fourier coefficients in degrees. Both legs move alike, half a stride apart.

use gait_fit::series::Series;
use gait_trace::stride::cycle::{Cycle, POINTS};

/// Harmonics of each joint.
pub const HARMONICS: usize = 6;
/// Coefficients of a joint: mean, cosines, sines.
pub const OF_A_JOINT: usize = 1 + 2 * HARMONICS;
/// Coefficients of a leg: those of the hip, then those of the knee.
pub const COEFFICIENTS: usize = 2 * OF_A_JOINT;

/// One leg.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// Hip, flexion positive.
    pub hip: Series,
    /// Knee, flexion positive.
    pub knee: Series,
}

impl Leg {
    /// The mean of both legs of a stride, the right one taken half a stride later. Phase 0 is the maximum of the hip's first harmonic.
    #[must_use]
    pub fn of(cycle: &Cycle) -> Self {
        let both = |left: usize| {
            let right = Series::through(&cycle.0[left + 1], HARMONICS).from_phase(0.5);
            mean(&Series::through(&cycle.0[left], HARMONICS), &right)
        };
        let leg = Self { hip: both(0), knee: both(2) };
        let (cos, sin) = leg.hip.terms[0];
        leg.from_phase(sin.atan2(cos) / std::f64::consts::TAU)
    }

    /// The same leg with its phase counted from `origin`, in cycles.
    #[must_use]
    pub fn from_phase(&self, origin: f64) -> Self {
        Self { hip: self.hip.from_phase(origin), knee: self.knee.from_phase(origin) }
    }

    /// All coefficients, degrees.
    #[must_use]
    pub fn coefficients(&self) -> [f64; COEFFICIENTS] {
        std::array::from_fn(|n| {
            let joint = if n < OF_A_JOINT { &self.hip } else { &self.knee };
            match n % OF_A_JOINT {
                0 => joint.mean,
                k if k <= HARMONICS => joint.terms[k - 1].0,
                k => joint.terms[k - 1 - HARMONICS].1,
            }
        })
    }

    /// The leg of these coefficients.
    #[must_use]
    pub fn from_coefficients(all: &[f64; COEFFICIENTS]) -> Self {
        let joint = |from: usize| Series {
            mean: all[from],
            terms: (1..=HARMONICS).map(|k| (all[from + k], all[from + k + HARMONICS])).collect(),
        };
        Self { hip: joint(0), knee: joint(OF_A_JOINT) }
    }

    /// A stride of both legs.
    #[must_use]
    pub fn cycle(&self) -> Cycle {
        let joint = |series: &Series, lead: f64| std::array::from_fn(|k| series.at(k as f64 / POINTS as f64 + lead));
        Cycle([joint(&self.hip, 0.0), joint(&self.hip, 0.5), joint(&self.knee, 0.0), joint(&self.knee, 0.5)])
    }

    /// How far the knee's first harmonic is ahead of the hip's, in degrees of the stride, -180 to 180.
    #[must_use]
    pub fn knee_lead_deg(&self) -> f64 {
        let [hip, knee] = [&self.hip, &self.knee].map(|joint| joint.terms[0].1.atan2(joint.terms[0].0).to_degrees());
        (hip - knee + 180.0).rem_euclid(360.0) - 180.0
    }
}

/// The mean of two series.
#[must_use]
pub fn mean(a: &Series, b: &Series) -> Series {
    let terms = a.terms.iter().zip(&b.terms).map(|(a, b)| (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1)));
    Series { mean: 0.5 * (a.mean + b.mean), terms: terms.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric gait comes back; one with unlike legs gives their mean.
    #[test]
    fn both_legs_are_averaged_half_a_stride_apart() {
        let all: [f64; COEFFICIENTS] =
            std::array::from_fn(|n| if n == 1 + HARMONICS { 0.0 } else { 20.0 / (n + 1) as f64 });
        let leg = Leg::from_coefficients(&all);
        assert_eq!(leg.coefficients(), all);
        let again = Leg::of(&leg.from_phase(0.3).cycle()).coefficients();
        assert!(again.iter().zip(all).all(|(a, b)| (a - b).abs() < 1e-9), "{again:?}");
        let mut unlike = leg.cycle();
        unlike.0[3].iter_mut().for_each(|angle| *angle += 4.0);
        assert!((Leg::of(&unlike).knee.mean - leg.knee.mean - 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_knee_that_leads_has_a_positive_lead() {
        let wave = |lead: f64| Series { mean: 0.0, terms: vec![(10.0, 0.0)] }.from_phase(lead);
        let leg = Leg { hip: wave(0.1), knee: wave(0.1 + 80.0 / 360.0) };
        assert!((leg.knee_lead_deg() - 80.0).abs() < 1e-9, "{}", leg.knee_lead_deg());
    }
}
