//! A walker whose stride is known, and legs that follow him.

use core::f32::consts::TAU;

use cpg_core::entrainment::phase_lock::Template;
use cpg_core::entrainment::{Follower, FollowerConfig};
use cpg_core::waveform::shape::Shape;
use cpg_core::{Follow, Generator};
use joint_units::{Joint, Period, Phase, Radians};

/// A hip like a walker's, degrees of harmonics 1 to 4.
pub(crate) fn hip(lead: f32) -> Template {
    series(5.0, [20.0, -4.5, 0.8, 0.3], lead)
}

/// A knee: the second harmonic is two thirds of the first.
fn knee(lead: f32) -> Template {
    series(24.0, [18.0, -12.0, 3.0, 0.8], lead)
}

/// `mean + sum_n a_n cos n (phi + lead)`, degrees and cycles.
fn series(mean: f32, amplitudes: [f32; 4], lead: f32) -> Template {
    let (mut cos, mut sin) = ([0.0; 8], [0.0; 8]);
    for (n, amplitude) in amplitudes.into_iter().enumerate() {
        let turn = TAU * lead * (n + 1) as f32;
        (cos[n], sin[n]) = ((amplitude * turn.cos()).to_radians(), (-amplitude * turn.sin()).to_radians());
    }
    Template::new(Radians::from_degrees(mean), cos, sin).unwrap()
}

pub(crate) fn templates() -> [Template; 4] {
    [hip(0.0), hip(0.5), knee(0.25), knee(0.75)]
}

pub(crate) fn legs(sensor: Joint) -> Follower {
    FollowerConfig::default().build(templates(), sensor, Period::MILLISECOND).unwrap()
}

/// A walker whose stride can be changed, stopped and begun again; the rate of the phase follows within `haste_s`.
pub(crate) struct Walker {
    pub(crate) template: Template,
    pub(crate) cycles: f64,
    pub(crate) rate: f64,
    pub(crate) wanted: f64,
    pub(crate) haste_s: f64,
}

impl Walker {
    pub(crate) fn new(sensor: Joint, stride_s: f64) -> Self {
        Self {
            template: templates()[sensor as usize],
            cycles: 0.0,
            rate: 1.0 / stride_s,
            wanted: 1.0 / stride_s,
            haste_s: 0.0,
        }
    }

    pub(crate) fn tick(&mut self) -> Radians {
        let step = if self.haste_s > 0.0 { 1e-3 / self.haste_s } else { f64::MAX };
        self.rate += (self.wanted - self.rate).clamp(-step, step);
        self.cycles += self.rate * 1e-3;
        Radians(self.template.at(self.phase()).angle)
    }

    pub(crate) fn phase(&self) -> Phase {
        Phase::from_cycles(self.cycles.rem_euclid(1.0) as f32)
    }

    /// Phase error of an estimate in degrees.
    pub(crate) fn off(&self, phase: Phase) -> f32 {
        self.phase().radians_after(phase).0.to_degrees()
    }
}

pub(crate) fn walk(legs: &mut Follower, walker: &mut Walker, ticks: u32) {
    for _ in 0..ticks {
        legs.observe(Some(walker.tick()));
        legs.step();
    }
}
