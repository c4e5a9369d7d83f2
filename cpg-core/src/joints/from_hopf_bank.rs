//! Hips and knees from one bank of Hopf oscillators at the stride's harmonics.
//!
//! ```text
//! a_j = offset_j + sum_i w_ji x_i + v_ji y_i,   (x_i, y_i) oscillator i of a bank that no longer learns
//! ```
//! The bank is that of [`crate::waveform::hopf_bank`] while playing, with the frequencies 1 to H times that of the stride. Its phase coupling
//! synchronises the oscillators; it also enlarges the circle of each but the first, by about 6 percent in the mean. All joints share one bank:
//! with a bank for each joint, the joints would drift apart by the learning errors of the frequencies.
//!
//! ```
//! use cpg_core::Generator;
//! use cpg_core::gait::catalogue;
//! let mut walk = catalogue::programmable(joint_units::Period::MILLISECOND)?;
//! let start = walk.angles();
//! for _ in 0..11_000 {
//!     walk.step();
//! }
//! // Ten strides later to the tick: the harmonics have not come apart.
//! assert!(walk.angles().iter().zip(start).all(|(after, before)| (after.0 - before.0).abs() < 0.01));
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::error::{all_in_range, allow_period, in_range};
use crate::joints::features::{Features, fill};
use crate::math::trig::angle;
use crate::waveform::clock::STRIDE_RANGE_S;
use crate::waveform::hopf_bank::{ProgrammableConfig, ProgrammableCpg};
use crate::{BuildError, Field, Generator, StateFault};

/// Largest distance of an oscillator from its centre: the circle has radius 1.
const BOUND: f32 = 3.0;

/// Stride, start and read-out of a [`BankWalk`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BankWalkConfig<const H: usize> {
    /// Stride in seconds, within [`STRIDE_RANGE_S`].
    pub stride_s: f32,
    /// Point of each oscillator where the gait phase is 0, each coordinate within ±2.
    pub start: [[f32; 2]; H],
    /// Weights of (x, y) of each oscillator for each joint, in rad, up to ±100.
    pub weights: [[[f32; 2]; H]; 4],
    /// Offset of each joint in the order of [`joint_units::Joint::ALL`], rad, within ±2 pi.
    pub offsets: [Radians; 4],
}

/// Four joints on a bank of H oscillators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BankWalk<const H: usize> {
    config: BankWalkConfig<H>,
    bank: ProgrammableCpg<H>,
    /// Phase of the first oscillator at the start.
    start_phase: Phase,
}

impl<const H: usize> BankWalkConfig<H> {
    /// Validates the configuration for a control period; the generator starts at the configured points.
    ///
    /// # Errors
    /// [`BuildError`] names the field that is out of range (`start` also if H is not 1 to 64); [`BuildError::PeriodTooLong`] for fewer than 50
    /// ticks in the fastest oscillator's cycle, or above 20 ms.
    pub fn build(&self, period: Period) -> Result<BankWalk<H>, BuildError> {
        in_range(H as f32, Field::of("start"), 1.0, 64.0)?;
        in_range(self.stride_s, Field::of("stride_s"), STRIDE_RANGE_S.0, STRIDE_RANGE_S.1)?;
        all_in_range(self.start.into_iter().flatten(), "start", -2.0, 2.0)?;
        all_in_range(self.weights.into_iter().flatten().flatten(), "weights", -100.0, 100.0)?;
        let turn = core::f32::consts::TAU;
        all_in_range(self.offsets.map(|offset| offset.0), "offsets", -turn, turn)?;
        let max_micros = (self.stride_s * 1e6 / (50.0 * H as f32)).min(20_000.0) as u32;
        allow_period(period, max_micros)?;
        let frequencies = ProgrammableConfig::harmonics_of(1.0 / self.stride_s);
        let mut walk =
            BankWalk { config: *self, bank: frequencies.build(period)?, start_phase: first_phase(&self.start) };
        walk.reset();
        Ok(walk)
    }
}

impl<const H: usize> BankWalk<H> {
    /// The bank.
    #[must_use]
    pub const fn bank(&self) -> &ProgrammableCpg<H> {
        &self.bank
    }

    /// Sets the point of each oscillator, limited to ±2: where a kick has moved it.
    pub fn set_points(&mut self, points: [[f32; 2]; H]) {
        self.bank.set_points(points);
    }

    fn weighted(&self, points: &[[f32; 2]; H]) -> [f32; 4] {
        self.config.weights.map(|row| {
            row.iter().flatten().zip(points.iter().flatten()).fold(0.0, |sum, (weight, value)| sum + weight * value)
        })
    }
}

/// Phase of the first oscillator, anticlockwise as it runs.
fn first_phase<const H: usize>(points: &[[f32; 2]; H]) -> Phase {
    points.first().map_or(Phase(0), |&[x, y]| angle(y, x))
}

impl<const H: usize> Generator<4> for BankWalk<H> {
    fn step(&mut self) {
        self.bank.play();
    }

    fn angles(&self) -> [Radians; 4] {
        let mut angles = self.config.offsets;
        for (angle, part) in angles.iter_mut().zip(self.weighted(&self.bank.points())) {
            angle.0 += part;
        }
        angles
    }

    fn rates(&self) -> [RadPerSec; 4] {
        self.weighted(&self.bank.velocities()).map(RadPerSec)
    }

    fn phase(&self) -> Phase {
        first_phase(&self.bank.points()) - self.start_phase
    }

    /// Radius of the first oscillator, 1 on its cycle.
    fn amplitude(&self) -> f32 {
        self.bank.points().first().map_or(0.0, |&[x, y]| libm::sqrtf(x * x + y * y))
    }

    fn check(&self) -> Result<(), StateFault> {
        for (index, point) in self.bank.points().iter().enumerate() {
            if point.iter().any(|coordinate| !coordinate.is_finite()) {
                return Err(StateFault::NotFinite { state: Field::at("points", index) });
            }
            if point.iter().any(|coordinate| coordinate.abs() >= BOUND) {
                return Err(StateFault::OutOfBounds { state: Field::at("points", index) });
            }
        }
        Ok(())
    }

    fn reset(&mut self) {
        self.bank.set_points(self.config.start);
    }
}

/// x and y of each oscillator.
impl<const H: usize> Features for BankWalk<H> {
    const COUNT: usize = 2 * H;

    fn features(&self, out: &mut [f32]) {
        fill(out, self.bank.points().into_iter().flatten());
    }
}
