//! Sine, cosine and the angle of a point in integers, for chips without a floating-point unit.
//!
//! Fixed-point numbers are those of the crate `fixed`; sines are [`I2F30`]. Bounds that the tests enforce, over 200 000 points each:
//!
//! | function | largest error |
//! |---|---|
//! | [`sin_cos`] | 2e-9, two units in the last place |
//! | [`angle`] | 2e-8 cycles, for points at least 2^-4 from the origin |

use fixed::types::{I2F30, I16F16};
use joint_units::Phase;

/// pi / 2 in 2^-30.
const HALF_PI: i64 = 1_686_629_713;

/// Product of two numbers in 2^-30, rounded. Both are at most 2 in size, so 64 bits hold it.
const fn mul30(a: i64, b: i64) -> i64 {
    (a.wrapping_mul(b).wrapping_add(1 << 29)) >> 30
}

/// Sine and cosine of a phase. Integer arithmetic only.
///
/// ```
/// use cpg_core::math::fixed_trig::sin_cos;
/// use joint_units::Phase;
/// let (sin, cos) = sin_cos(Phase(1 << 30));
/// assert_eq!((sin.to_num::<f32>(), cos.to_num::<f32>()), (1.0, 0.0));
/// ```
#[must_use]
pub const fn sin_cos(phase: Phase) -> (I2F30, I2F30) {
    // Nearest quarter of the circle, and what is left of it in radians: at most pi/4 to either side.
    let quarter = phase.0.wrapping_add(1 << 29) >> 30;
    let rest = phase.0.wrapping_sub(quarter << 30) as i32;
    let x = mul30(rest as i64, HALF_PI);
    let z = mul30(x, x);
    // Taylor's series; the first term left out is below 2^-37 at pi/4.
    let sin = mul30(z, 2_959 - mul30(z, 27));
    let sin = mul30(z, -213_044 + sin);
    let sin = mul30(z, 8_947_849 + sin);
    let sin = mul30(z, -178_956_971 + sin);
    let sin = x + mul30(x, sin);
    let cos = mul30(z, -296 + mul30(z, 2));
    let cos = mul30(z, 26_631 + cos);
    let cos = mul30(z, -1_491_308 + cos);
    let cos = mul30(z, 44_739_243 + cos);
    let cos = mul30(z, -536_870_912 + cos);
    let (sin, cos) = (sin as i32, (cos + (1 << 30)) as i32);
    let (sin, cos) = match quarter & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    };
    (I2F30::from_bits(sin), I2F30::from_bits(cos))
}

/// atan(2^-k) as a phase.
const TURNS: [u32; 25] = [
    536_870_912,
    316_933_406,
    167_458_907,
    85_004_756,
    42_667_331,
    21_354_465,
    10_679_838,
    5_340_245,
    2_670_163,
    1_335_087,
    667_544,
    333_772,
    166_886,
    83_443,
    41_722,
    20_861,
    10_430,
    5_215,
    2_608,
    1_304,
    652,
    326,
    163,
    81,
    41,
];

/// The angle of the point (`x`, `y`) as a phase: anticlockwise from the x axis; 0 at the origin. By CORDIC: shifts and additions only.
///
/// ```
/// use cpg_core::math::fixed_trig::angle;
/// use fixed::types::I16F16;
/// let phase = angle(I16F16::ONE, -I16F16::ONE);
/// assert!((phase.cycles() - 0.375).abs() < 2e-7);
/// ```
#[must_use]
pub fn angle(y: I16F16, x: I16F16) -> Phase {
    // Fine enough that the shifts lose nothing that the result has.
    let (mut x, mut y) = (i64::from(x.to_bits()) << 24, i64::from(y.to_bits()) << 24);
    let mut phase = 0u32;
    if x == 0 && y == 0 {
        return Phase(0);
    }
    if x < 0 {
        (x, y) = (-x, -y);
        phase = 1 << 31;
    }
    for (shift, turn) in TURNS.into_iter().enumerate() {
        let (dx, dy) = (y >> shift, x >> shift);
        if y > 0 {
            (x, y) = (x + dx, y - dy);
            phase = phase.wrapping_add(turn);
        } else {
            (x, y) = (x - dx, y + dy);
            phase = phase.wrapping_sub(turn);
        }
    }
    Phase(phase)
}
