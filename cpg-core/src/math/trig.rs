//! Sine, cosine and the angle of a point in `f32`, without a table and without `f64`; the same bits on every IEEE 754 machine.
//!
//! Minimax polynomials (Remez exchange, 40 digits, coefficients rounded to `f32`) on one octant; the rest is exact symmetry.
//! Bounds that the tests enforce, over a million points each:
//!
//! | function | largest error |
//! |---|---|
//! | [`sin_cos`] | 1.5e-7, absolute |
//! | [`atan2`] | 4e-7 rad, absolute |
//! | [`angle`] | 1e-7 cycles |
//!
//! The `f32` versions of libm go through `f64`, which a core with a single-precision floating-point unit computes in software, about fifty
//! times slower.

use core::f32::consts::{FRAC_PI_2, PI};

use joint_units::Phase;

/// Radians per unit of [`Phase`].
const RADIANS_PER_COUNT: f32 = (core::f64::consts::TAU / 4_294_967_296.0) as f32;

/// Sine and cosine of a phase.
///
/// ```
/// use cpg_core::math::trig::sin_cos;
/// use joint_units::Phase;
/// let (sin, cos) = sin_cos(Phase::from_cycles(1.0 / 12.0));
/// assert!((sin - 0.5).abs() < 1.5e-7 && (cos - 0.866_025_4).abs() < 1.5e-7);
/// ```
#[must_use]
pub fn sin_cos(phase: Phase) -> (f32, f32) {
    // Nearest quarter of the circle, and what is left of it: at most an eighth to either side. Integer arithmetic, so exact.
    let quarter = phase.0.wrapping_add(1 << 29) >> 30;
    let rest = phase.0.wrapping_sub(quarter << 30) as i32;
    let x = rest as f32 * RADIANS_PER_COUNT;
    let z = x * x;
    // sin x = x - x^3/6 ..., cos x = 1 - x^2/2 + ...
    let sin = x + x * z * (-0.166_666_51 + z * (0.008_332_036 + z * -0.000_195_040_22));
    let cos = 1.0 - z * 0.5 + z * z * (0.041_666_646 + z * (-0.001_388_737_8 + z * 2.443_948_3e-5));
    match quarter & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// The angle of the point (`x`, `y`) in rad, -pi to pi, anticlockwise from the x axis; 0 at the origin. Finite arguments only.
///
/// ```
/// use cpg_core::math::trig::atan2;
/// assert!((atan2(-1.0, -1.0) + 3.0 * core::f32::consts::FRAC_PI_4).abs() < 4e-7);
/// ```
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (across, along) = (y.abs(), x.abs());
    let (small, large) = if across > along { (along, across) } else { (across, along) };
    if large == 0.0 {
        return 0.0;
    }
    let t = small / large;
    let z = t * t;
    let series = 0.999_999_9
        + z * (-0.333_326_52
            + z * (0.199_865_49
                + z * (-0.141_648_47
                    + z * (0.105_100_915
                        + z * (-0.072_547_08 + z * (0.039_985_16 + z * (-0.014_513_533 + z * 0.002_482_299)))))));
    let octant = t * series;
    let quadrant = if across > along { FRAC_PI_2 - octant } else { octant };
    let upper = if x < 0.0 { PI - quadrant } else { quadrant };
    if y < 0.0 { -upper } else { upper }
}

/// The angle of the point (`x`, `y`) as a phase: anticlockwise from the x axis; 0 at the origin. Finite arguments only.
///
/// ```
/// use cpg_core::math::trig::angle;
/// assert!((angle(-1.0, 0.0).cycles() - 0.75).abs() < 1e-7);
/// ```
#[must_use]
pub fn angle(y: f32, x: f32) -> Phase {
    Phase::from_cycles(atan2(y, x) * (1.0 / core::f32::consts::TAU))
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: u64 = 1_000_000;

    #[test]
    fn sin_cos_within_its_bound_all_around() {
        let mut worst = 0.0_f64;
        for i in 0..POINTS {
            // Not a divisor of the circle, so that every quarter is met at other places.
            let phase = Phase((i * 4_294_967_291 / POINTS) as u32);
            let exact = f64::from(phase.0) / 4_294_967_296.0 * core::f64::consts::TAU;
            let (sin, cos) = sin_cos(phase);
            worst = worst.max((f64::from(sin) - exact.sin()).abs()).max((f64::from(cos) - exact.cos()).abs());
        }
        assert!(worst < 1.5e-7, "{worst:e}");
    }

    #[test]
    fn quarters_are_exact() {
        assert_eq!(
            [0, 1 << 30, 1 << 31, 3 << 30].map(|phase| sin_cos(Phase(phase))),
            [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]
        );
    }

    #[test]
    fn atan2_within_its_bound_at_every_angle_and_size() {
        let (mut worst, mut worst_cycles) = (0.0_f64, 0.0_f64);
        for i in 0..POINTS {
            let turn = i as f64 / POINTS as f64 * core::f64::consts::TAU;
            let radius = 10f64.powi((i % 61) as i32 - 30);
            let (y, x) = ((radius * turn.sin()) as f32, (radius * turn.cos()) as f32);
            let exact = f64::from(y).atan2(f64::from(x));
            worst = worst.max((f64::from(atan2(y, x)) - exact).abs());
            let cycles = f64::from(angle(y, x).0) / 4_294_967_296.0 - exact / core::f64::consts::TAU;
            worst_cycles = worst_cycles.max((cycles - cycles.round()).abs());
        }
        assert!(worst < 4e-7, "{worst:e} rad");
        assert!(worst_cycles < 1e-7, "{worst_cycles:e} cycles");
    }

    #[test]
    fn axes_and_origin() {
        let cases = [
            ((0.0, 1.0), 0),
            ((1.0, 0.0), 1 << 30),
            ((0.0, -1.0), 1 << 31),
            ((-1.0, 0.0), 3 << 30),
            ((0.0, 0.0), 0),
            ((-0.0, 0.0), 0),
        ];
        for ((y, x), want) in cases {
            let off = angle(y, x).0.wrapping_sub(want) as i32;
            assert!(off.unsigned_abs() <= 256, "({y}, {x}): {off} counts");
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
    }
}
