//! A leg at the lowest and at the highest cadence, and both legs at any cadence between.

use crate::gait::fitted::Harmonics;

/// Hip and knee of a leg at the two ends of the cadences.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ends {
    /// Steps a minute.
    pub(super) cadences: [f32; 2],
    /// Hip and knee at either, degrees.
    pub(super) legs: [[Harmonics; 2]; 2],
}

impl Ends {
    /// Left hip, right hip, left knee, right knee between the ends: the first at part 0, the second at part 1.
    pub(super) fn joints(&self, part: f32) -> [Harmonics; 4] {
        let [[slow_hip, slow_knee], [fast_hip, fast_knee]] = &self.legs;
        let (hip, knee) = (between(slow_hip, fast_hip, part), between(slow_knee, fast_knee, part));
        [hip, half_a_stride_later(hip), knee, half_a_stride_later(knee)]
    }
}

/// Coefficients between two sets.
fn between(a: &Harmonics, b: &Harmonics, part: f32) -> Harmonics {
    let mix = |a: f32, b: f32| a + part * (b - a);
    let mut mixed = *a;
    mixed.0 = mix(a.0, b.0);
    for (to, end) in mixed.1.iter_mut().zip(b.1).chain(mixed.2.iter_mut().zip(b.2)) {
        *to = mix(*to, end);
    }
    mixed
}

/// The series of the other leg: odd harmonics change their sign.
fn half_a_stride_later(mut series: Harmonics) -> Harmonics {
    for list in [&mut series.1, &mut series.2] {
        for odd in list.iter_mut().step_by(2) {
            *odd = -*odd;
        }
    }
    series
}
