//! One phase and a Fourier series per joint in fixed point, for cores without a floating-point unit.
//!
//! The equations are those of [`crate::waveform::shape`]: `a_j = offset_j + mean_j + gain_j (S_j(phi + lead_j) - mean_j)`. The phase is an integer,
//! 2^-64 of a cycle, and so is its step: the period is exact to 2^-32. Coefficients and offsets are [`I4F28`], gains [`I8F24`], sines
//! [`I2F30`], products 64 bits; an angle comes out in units of 2^-16 rad, within one such unit (0.9 millidegrees) of the series.
//!
//! ```
//! use cpg_core::waveform::fixed::FixedPhaseShapeConfig;
//! use cpg_core::waveform::shape::{Adjustment, FourierShape};
//! use joint_units::{Period, Phase, Radians};
//! let hip = FourierShape::new(Radians(0.1), [0.4], [0.0])?;
//! let mut walk = FixedPhaseShapeConfig { shapes: [hip; 2], leads: [Phase(0), Phase(1 << 31)], stride_s: 1.1 }.build(Period::MILLISECOND)?;
//! // 0.5 and -0.3 rad, in units of 2^-16.
//! assert_eq!(walk.fixed_angles().map(|angle| angle.to_bits()), [32_768, -19_661]);
//! walk.adjust(0, Adjustment { gain: 0.5, offset: Radians(0.2), lead: Phase(0) })?;
//! assert_eq!(walk.fixed_angles()[0].to_bits(), 32_768);
//! # Ok::<(), cpg_core::BuildError>(())
//! ```

use fixed::types::{I2F30, I4F28, I8F24, I16F16};
use joint_units::{Period, Phase, RadPerSec, Radians};

use crate::math::fixed_trig::sin_cos;
use crate::waveform::clock::StrideClock;
use crate::waveform::shape::{Adjustment, FourierShape};
use crate::{BuildError, Generator, StateFault};

/// A full turn in 2^-24 rad, times the microseconds of a second.
const TURN: i64 = (core::f64::consts::TAU * 1e6 * 16_777_216.0) as i64;

/// N joints on Fourier series of H harmonics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPhaseShape<const H: usize, const N: usize> {
    shapes: [Coefficients<H>; N],
    uses: [Use; N],
    clock: StrideClock,
    /// 2 pi over the stride time, rad/s in 2^-24.
    turn_rate: i64,
}

/// Adjustment of one joint: [`Adjustment`] in fixed point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Use {
    gain: I8F24,
    offset: I4F28,
    lead: Phase,
}

impl Use {
    /// A number in 2^-44 times the gain; exact for a gain of 1.
    fn scale(&self, value: i64) -> i64 {
        let gain = i64::from(self.gain.to_bits());
        // In two parts: 45 bits of an angle and 26 of a gain do not fit into 64.
        let (high, low) = (value >> 20, value & 0xf_ffff);
        (high.wrapping_mul(gain) >> 4).wrapping_add(low.wrapping_mul(gain) >> 24)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Coefficients<const H: usize> {
    mean: I4F28,
    cos: [I4F28; H],
    sin: [I4F28; H],
}

/// Removes fraction bits, rounded to nearest.
const fn rounded(value: i64, bits: u32) -> i64 {
    value.wrapping_add(1 << (bits - 1)) >> bits
}

fn times(coefficient: I4F28, sine: I2F30) -> i64 {
    // 2^-58 to 2^-44: enough for the sum of any number of harmonics.
    rounded(i64::from(coefficient.to_bits()).wrapping_mul(i64::from(sine.to_bits())), 14)
}

impl<const H: usize> Coefficients<H> {
    fn of(shape: &FourierShape<H>) -> Self {
        // A shape holds its coefficients below 6.3.
        let fixed = |value: f32| I4F28::checked_from_num(value).unwrap_or(I4F28::ZERO);
        let (mean, cos, sin) = shape.coefficients();
        Self { mean: fixed(mean), cos: cos.map(fixed), sin: sin.map(fixed) }
    }

    /// Angle in rad and slope in rad per radian of phase, both in 2^-44.
    fn at(&self, phase: Phase) -> (i64, i64) {
        let (s1, c1) = sin_cos(phase);
        let (mut s, mut c) = (s1, c1);
        let (mut angle, mut slope) = (i64::from(self.mean.to_bits()) << 16, 0i64);
        for (order, (&a, &b)) in (1..).zip(self.cos.iter().zip(&self.sin)) {
            angle = angle.wrapping_add(times(a, c)).wrapping_add(times(b, s));
            slope = slope.wrapping_add(times(b, c).wrapping_sub(times(a, s)).wrapping_mul(order));
            (s, c) = rotate(s, c, s1, c1);
        }
        (angle, slope)
    }
}

/// The next harmonic's sine and cosine.
fn rotate(s: I2F30, c: I2F30, s1: I2F30, c1: I2F30) -> (I2F30, I2F30) {
    let [s, c, s1, c1] = [s, c, s1, c1].map(|x| i64::from(x.to_bits()));
    let sin = s.wrapping_mul(c1).wrapping_add(c.wrapping_mul(s1));
    let cos = c.wrapping_mul(c1).wrapping_sub(s.wrapping_mul(s1));
    (I2F30::from_bits(rounded(sin, 30) as i32), I2F30::from_bits(rounded(cos, 30) as i32))
}

/// 2 pi over the stride time, rad/s in 2^-24.
fn turn_rate(clock: &StrideClock) -> i64 {
    TURN.checked_div(clock.stride_us().into()).unwrap_or(0)
}

/// Shapes, leads and stride of a [`FixedPhaseShape`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPhaseShapeConfig<const H: usize, const N: usize> {
    /// The waveform of each joint.
    pub shapes: [FourierShape<H>; N],
    /// Phase lead of each joint.
    pub leads: [Phase; N],
    /// Stride time in seconds, within [`crate::waveform::clock::STRIDE_RANGE_S`].
    pub stride_s: f32,
}

impl<const H: usize, const N: usize> FixedPhaseShapeConfig<H, N> {
    /// Validates the configuration for a control period; the generator starts at phase 0.
    ///
    /// # Errors
    /// `stride_s` outside [`crate::waveform::clock::STRIDE_RANGE_S`].
    pub fn build(&self, period: Period) -> Result<FixedPhaseShape<H, N>, BuildError> {
        let uses = self.leads.map(|lead| Use { gain: I8F24::ONE, offset: I4F28::ZERO, lead });
        let shapes = self.shapes.each_ref().map(Coefficients::of);
        let clock = StrideClock::new(self.stride_s, period)?;
        Ok(FixedPhaseShape { shapes, uses, clock, turn_rate: turn_rate(&clock) })
    }
}

impl<const H: usize, const N: usize> FixedPhaseShape<H, N> {
    /// Sets the stride time in seconds, to the microsecond. Converts from `f32`, once a change.
    ///
    /// # Errors
    /// `stride_s` outside [`crate::waveform::clock::STRIDE_RANGE_S`]; the old one then stays.
    pub fn set_stride(&mut self, stride_s: f32) -> Result<(), BuildError> {
        self.clock.set_stride(stride_s)?;
        self.turn_rate = turn_rate(&self.clock);
        Ok(())
    }

    /// Sets gain, offset and lead of a joint, as [`crate::waveform::shape::PhaseShape::adjust`] does; joints that do not exist are ignored.
    /// Converts from `f32`, once a change.
    ///
    /// # Errors
    /// `gain` or `offset` out of range; the old adjustment then stays.
    pub fn adjust(&mut self, joint: usize, adjustment: Adjustment) -> Result<(), BuildError> {
        adjustment.validate()?;
        if let Some(place) = self.uses.get_mut(joint) {
            *place = Use {
                gain: I8F24::checked_from_num(adjustment.gain).unwrap_or(I8F24::ONE),
                offset: I4F28::checked_from_num(adjustment.offset.0).unwrap_or(I4F28::ZERO),
                lead: adjustment.lead,
            };
        }
        Ok(())
    }

    /// Sets the phase.
    pub const fn set_phase(&mut self, phase: Phase) {
        self.clock.set_phase(phase);
    }

    /// Step of the phase in 2^-64 cycles a tick.
    #[must_use]
    pub const fn phase_step(&self) -> u64 {
        self.clock.step()
    }

    /// Wanted joint angles now, in units of 2^-16 rad. No floating point.
    #[must_use]
    pub fn fixed_angles(&self) -> [I16F16; N] {
        self.each(|(angle, _)| rounded(angle, 28))
    }

    /// Their time derivatives now, in units of 2^-16 rad/s. No floating point.
    #[must_use]
    pub fn fixed_rates(&self) -> [I16F16; N] {
        // Slope in 2^-24 times rad/s in 2^-24.
        self.each(|(_, slope)| rounded(rounded(slope, 20).wrapping_mul(self.turn_rate), 32))
    }

    fn each(&self, read: impl Fn((i64, i64)) -> i64) -> [I16F16; N] {
        let mut out = [I16F16::ZERO; N];
        let phase = self.phase();
        for ((out, shape), adjusted) in out.iter_mut().zip(&self.shapes).zip(&self.uses) {
            let (angle, slope) = shape.at(phase + adjusted.lead);
            let mean = i64::from(shape.mean.to_bits()) << 16;
            let rest = mean.wrapping_add(i64::from(adjusted.offset.to_bits()) << 16);
            let value = read((rest.wrapping_add(adjusted.scale(angle.wrapping_sub(mean))), adjusted.scale(slope)));
            *out = I16F16::from_bits(value.clamp(i32::MIN.into(), i32::MAX.into()) as i32);
        }
        out
    }
}

impl<const H: usize, const N: usize> Generator<N> for FixedPhaseShape<H, N> {
    fn step(&mut self) {
        self.clock.tick();
    }

    fn angles(&self) -> [Radians; N] {
        self.fixed_angles().map(|angle| Radians(angle.to_num()))
    }

    fn rates(&self) -> [RadPerSec; N] {
        self.fixed_rates().map(|rate| RadPerSec(rate.to_num()))
    }

    fn phase(&self) -> Phase {
        self.clock.phase()
    }

    fn amplitude(&self) -> f32 {
        1.0
    }

    fn check(&self) -> Result<(), StateFault> {
        Ok(())
    }

    fn reset(&mut self) {
        self.clock.set_phase(Phase(0));
    }
}
