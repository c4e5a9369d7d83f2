//! Stride clock: an integer phase with an integer step, whose period is exact for generators in floating and in fixed point.

use joint_units::{Period, Phase};

use crate::error::in_range;
use crate::{BuildError, Field};

/// Shortest and longest stride in seconds.
pub const STRIDE_RANGE_S: (f32, f32) = (0.2, 20.0);

/// A periodic phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StrideClock {
    /// 2^-64 cycles.
    phase: u64,
    /// 2^-64 cycles a tick.
    step: u64,
    stride_us: u32,
    period: Period,
}

impl StrideClock {
    /// A clock at phase 0.
    ///
    /// # Errors
    /// `stride_s` outside [`STRIDE_RANGE_S`].
    pub(crate) fn new(stride_s: f32, period: Period) -> Result<Self, BuildError> {
        let mut built = Self { phase: 0, step: 0, stride_us: 0, period };
        built.set_stride(stride_s)?;
        Ok(built)
    }

    /// Sets the stride time in seconds, to the microsecond.
    ///
    /// # Errors
    /// `stride_s` outside [`STRIDE_RANGE_S`]; the old one then stays.
    pub(crate) fn set_stride(&mut self, stride_s: f32) -> Result<(), BuildError> {
        in_range(stride_s, Field::of("stride_s"), STRIDE_RANGE_S.0, STRIDE_RANGE_S.1)?;
        self.stride_us = (stride_s * 1e6 + 0.5) as u32;
        // Below 2^64: the longest period (0.1 s) is half of the shortest stride.
        let cycle_per_tick = u128::from(self.period.micros()) << 64;
        self.step = cycle_per_tick.checked_div(self.stride_us.into()).unwrap_or(0) as u64;
        Ok(())
    }

    pub(crate) const fn tick(&mut self) {
        self.phase = self.phase.wrapping_add(self.step);
    }

    pub(crate) const fn phase(&self) -> Phase {
        Phase((self.phase >> 32) as u32)
    }

    pub(crate) const fn set_phase(&mut self, phase: Phase) {
        self.phase = (phase.0 as u64) << 32;
    }

    /// Step in 2^-64 cycles a tick.
    #[cfg(feature = "fixed-point")]
    pub(crate) const fn step(&self) -> u64 {
        self.step
    }

    /// The stride that was set, microseconds.
    #[cfg(feature = "fixed-point")]
    pub(crate) const fn stride_us(&self) -> u32 {
        self.stride_us
    }

    /// Cycles a second.
    pub(crate) fn frequency(&self) -> f32 {
        self.step as f32 * (1.0 / 18_446_744_073_709_551_616.0) / self.period.seconds()
    }
}
