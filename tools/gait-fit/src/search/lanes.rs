//! Arithmetic on SIMD vectors with one individual of a population in each lane.
//!
//! The equations are written once, over [`Lanes`], and run as plain f64 (the reference), as SIMD vectors of f32 (the search) and as
//! SIMD vectors of f64 (derivatives). `pulp` detects the instruction set at run time: AVX-512, AVX2 with FMA, or none
//! of these.
//!
//! A lane computes the same operations in the same order for every vector width, and every sum with a product is a fused multiply-add.
//! So the bits depend neither on the machine nor on the lane of an individual. A processor without fused multiply-add (x86 before
//! 2013) gives the same bits in software, slowly.

use pulp::Simd;
use pulp::bytemuck::{cast_slice, cast_slice_mut};

/// Arithmetic on vectors.
pub trait Lanes: Copy {
    /// One number.
    type Scalar: Copy + Send + Sync;
    /// One number for each lane.
    type Vector: Copy + Send;
    /// Number of lanes.
    const WIDTH: usize;

    /// The nearest number of the lane type.
    fn scalar(x: f64) -> Self::Scalar;
    /// The same number in each lane.
    fn splat(self, x: Self::Scalar) -> Self::Vector;
    /// `of(lane)` in each lane.
    fn each(self, of: impl Fn(usize) -> f64) -> Self::Vector;
    /// The value of one lane.
    fn lane(self, v: Self::Vector, lane: usize) -> f64;
    /// a + b.
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a - b.
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a b.
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// a b + c, rounded once.
    fn mul_add(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;
    /// c - a b, rounded once.
    fn sub_mul(self, c: Self::Vector, a: Self::Vector, b: Self::Vector) -> Self::Vector;
}

/// One individual in f64.
#[derive(Clone, Copy)]
pub struct Plain;

impl Lanes for Plain {
    type Scalar = f64;
    type Vector = f64;
    const WIDTH: usize = 1;

    fn scalar(x: f64) -> f64 {
        x
    }

    fn splat(self, x: f64) -> f64 {
        x
    }

    fn each(self, of: impl Fn(usize) -> f64) -> f64 {
        of(0)
    }

    fn lane(self, v: f64, _: usize) -> f64 {
        v
    }

    fn add(self, a: f64, b: f64) -> f64 {
        a + b
    }

    fn sub(self, a: f64, b: f64) -> f64 {
        a - b
    }

    fn mul(self, a: f64, b: f64) -> f64 {
        a * b
    }

    // Two roundings: in a plain x86-64 build a fused multiply-add would be computed in software.
    fn mul_add(self, a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }

    fn sub_mul(self, c: f64, a: f64, b: f64) -> f64 {
        c - a * b
    }
}

/// f32 in the widest vectors of the machine.
#[derive(Clone, Copy)]
pub struct Singles<S>(pub S);

/// f64 in the widest vectors of the machine.
#[derive(Clone, Copy)]
pub struct Doubles<S>(pub S);

macro_rules! simd_lanes {
    ($name:ident, $scalar:ty, $vector:ident, $width:ident, $splat:ident, $add:ident, $sub:ident, $mul:ident, $fma:ident, $fnma:ident) => {
        impl<S: Simd> Lanes for $name<S> {
            type Scalar = $scalar;
            type Vector = S::$vector;
            const WIDTH: usize = S::$width;

            fn scalar(x: f64) -> $scalar {
                x as $scalar
            }

            #[inline(always)]
            fn splat(self, x: $scalar) -> S::$vector {
                self.0.$splat(x)
            }

            #[inline(always)]
            fn each(self, of: impl Fn(usize) -> f64) -> S::$vector {
                let mut out = [self.0.$splat(0.0)];
                for (lane, out) in cast_slice_mut::<_, $scalar>(&mut out).iter_mut().enumerate() {
                    *out = of(lane) as $scalar;
                }
                out[0]
            }

            #[inline(always)]
            fn lane(self, v: S::$vector, lane: usize) -> f64 {
                f64::from(cast_slice::<_, $scalar>(&[v])[lane])
            }

            #[inline(always)]
            fn add(self, a: S::$vector, b: S::$vector) -> S::$vector {
                self.0.$add(a, b)
            }

            #[inline(always)]
            fn sub(self, a: S::$vector, b: S::$vector) -> S::$vector {
                self.0.$sub(a, b)
            }

            #[inline(always)]
            fn mul(self, a: S::$vector, b: S::$vector) -> S::$vector {
                self.0.$mul(a, b)
            }

            #[inline(always)]
            fn mul_add(self, a: S::$vector, b: S::$vector, c: S::$vector) -> S::$vector {
                self.0.$fma(a, b, c)
            }

            #[inline(always)]
            fn sub_mul(self, c: S::$vector, a: S::$vector, b: S::$vector) -> S::$vector {
                self.0.$fnma(a, b, c)
            }
        }
    };
}

simd_lanes!(Singles, f32, f32s, F32_LANES, splat_f32s, add_f32s, sub_f32s, mul_f32s, mul_add_f32s, negate_mul_add_f32s);
simd_lanes!(Doubles, f64, f64s, F64_LANES, splat_f64s, add_f64s, sub_f64s, mul_f64s, mul_add_f64s, negate_mul_add_f64s);
