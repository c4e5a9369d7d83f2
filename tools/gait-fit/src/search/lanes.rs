//! Arithmetic on vectors of individuals, each with its four joints.
//!
//! The equations are written once, over [`Lanes`], and run as plain f64 (the reference), as SIMD vectors of f32 (the search) and as
//! SIMD vectors of f64 (derivatives). `pulp` detects the instruction set at run time: AVX-512, AVX2 with FMA, or none
//! of these.
//!
//! In f32 the joints of an individual are neighbours in a vector, so that 16 lanes hold four individuals: a population fills its vectors,
//! and the numbers of a step stay in the registers. In f64 a lane is an individual, and four vectors hold its joints.
//!
//! A lane computes the same operations in the same order for every vector width, and every sum with a product is a fused multiply-add.
//! So the bits depend neither on the machine nor on the lane of an individual. A processor without fused multiply-add (x86 before
//! 2013) gives the same bits in software, slowly.

use std::ops::Range;

use pulp::bytemuck::{Pod, cast_slice, cast_slice_mut};
use pulp::{Arch, Scalar128b, Simd, WithSimd};

/// Joints of an individual.
const JOINTS: usize = 4;
/// Most vectors of individuals that take turns: with more, their numbers do not stay in the registers.
pub const MOST_VECTORS: usize = 8;

/// Arithmetic on vectors.
pub trait Lanes: Copy {
    /// The four joints of [`Self::INDIVIDUALS`] individuals, one number each.
    type Vector: Copy + Send;
    /// Individuals of a vector.
    const INDIVIDUALS: usize;

    /// The nearest number of the lane type, everywhere.
    fn splat(self, x: f64) -> Self::Vector;
    /// `of(individual, joint)`, each rounded to the lane type.
    fn each(self, of: impl Fn(usize, usize) -> f64) -> Self::Vector;
    /// The number of one joint of one individual.
    fn at(self, v: Self::Vector, individual: usize, joint: usize) -> f64;
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
    /// a + 2 b, rounded once. Two sums: many processors add beside the units that multiply, which are the busy ones, and the double is
    /// exact.
    #[inline(always)]
    fn plus_twice(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        self.add(a, self.add(b, b))
    }
    /// Left and right exchanged: every joint has the number of the same joint of the other side.
    fn other_side(self, v: Self::Vector) -> Self::Vector;
    /// Hip and knee exchanged: every joint has the number of the other joint of its leg.
    fn other_joint(self, v: Self::Vector) -> Self::Vector;
    /// The numbers of four vectors, one vector for each joint with the individuals of all four; [`Self::of_joint`] reads it.
    fn by_joint(self, v: [Self::Vector; JOINTS]) -> [Self::Vector; JOINTS];
    /// The number of one individual, 0 to 4 [`Self::INDIVIDUALS`] - 1, in a vector of one joint.
    fn of_joint(self, v: Self::Vector, individual: usize) -> f64;
}

/// One individual in f64.
#[derive(Clone, Copy)]
pub struct Plain;

impl Lanes for Plain {
    type Vector = [f64; JOINTS];
    const INDIVIDUALS: usize = 1;

    fn splat(self, x: f64) -> [f64; JOINTS] {
        [x; JOINTS]
    }

    fn each(self, of: impl Fn(usize, usize) -> f64) -> [f64; JOINTS] {
        std::array::from_fn(|joint| of(0, joint))
    }

    fn at(self, v: [f64; JOINTS], _: usize, joint: usize) -> f64 {
        v[joint]
    }

    fn add(self, a: [f64; JOINTS], b: [f64; JOINTS]) -> [f64; JOINTS] {
        std::array::from_fn(|i| a[i] + b[i])
    }

    fn sub(self, a: [f64; JOINTS], b: [f64; JOINTS]) -> [f64; JOINTS] {
        std::array::from_fn(|i| a[i] - b[i])
    }

    fn mul(self, a: [f64; JOINTS], b: [f64; JOINTS]) -> [f64; JOINTS] {
        std::array::from_fn(|i| a[i] * b[i])
    }

    // Two roundings: in a plain x86-64 build a fused multiply-add would be computed in software.
    fn mul_add(self, a: [f64; JOINTS], b: [f64; JOINTS], c: [f64; JOINTS]) -> [f64; JOINTS] {
        std::array::from_fn(|i| a[i] * b[i] + c[i])
    }

    fn sub_mul(self, c: [f64; JOINTS], a: [f64; JOINTS], b: [f64; JOINTS]) -> [f64; JOINTS] {
        std::array::from_fn(|i| c[i] - a[i] * b[i])
    }

    fn other_side(self, v: [f64; JOINTS]) -> [f64; JOINTS] {
        other_side(v)
    }

    fn other_joint(self, v: [f64; JOINTS]) -> [f64; JOINTS] {
        other_joint(v)
    }

    fn by_joint(self, v: [[f64; JOINTS]; JOINTS]) -> [[f64; JOINTS]; JOINTS] {
        transposed(v)
    }

    fn of_joint(self, v: [f64; JOINTS], individual: usize) -> f64 {
        v[individual]
    }
}

fn other_side<V>([left_hip, right_hip, left_knee, right_knee]: [V; JOINTS]) -> [V; JOINTS] {
    [right_hip, left_hip, right_knee, left_knee]
}

fn other_joint<V>([left_hip, right_hip, left_knee, right_knee]: [V; JOINTS]) -> [V; JOINTS] {
    [left_knee, right_knee, left_hip, right_hip]
}

fn transposed<V: Copy>(v: [[V; JOINTS]; JOINTS]) -> [[V; JOINTS]; JOINTS] {
    std::array::from_fn(|joint| std::array::from_fn(|vector| v[vector][joint]))
}

/// f32 in the widest vectors of the machine, of four lanes or more: [`dispatch`] sees to it.
#[derive(Clone, Copy)]
pub struct Singles<S>(pub S);

impl<S: Simd> Singles<S> {
    /// Each lane with the number of the lane whose index differs in one bit. The compiler makes one instruction of it.
    #[inline(always)]
    fn exchanged<const BIT: usize>(v: S::f32s) -> S::f32s {
        let (from, mut to) = ([v], [v]);
        let lanes: &[f32] = cast_slice(&from);
        for (lane, to) in cast_slice_mut::<_, f32>(&mut to).iter_mut().enumerate() {
            *to = lanes[lane ^ BIT];
        }
        to[0]
    }
}

impl<S: Simd> Lanes for Singles<S> {
    type Vector = S::f32s;
    const INDIVIDUALS: usize = S::F32_LANES / JOINTS;

    #[inline(always)]
    fn splat(self, x: f64) -> S::f32s {
        self.0.splat_f32s(x as f32)
    }

    #[inline(always)]
    fn each(self, of: impl Fn(usize, usize) -> f64) -> S::f32s {
        let mut out = [self.0.splat_f32s(0.0)];
        for (lane, out) in cast_slice_mut::<_, f32>(&mut out).iter_mut().enumerate() {
            *out = of(lane / JOINTS, lane % JOINTS) as f32;
        }
        out[0]
    }

    #[inline(always)]
    fn at(self, v: S::f32s, individual: usize, joint: usize) -> f64 {
        f64::from(number::<_, f32>(v, individual * JOINTS + joint))
    }

    #[inline(always)]
    fn add(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.add_f32s(a, b)
    }

    #[inline(always)]
    fn sub(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.sub_f32s(a, b)
    }

    #[inline(always)]
    fn mul(self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.mul_f32s(a, b)
    }

    #[inline(always)]
    fn mul_add(self, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
        self.0.mul_add_f32s(a, b, c)
    }

    #[inline(always)]
    fn sub_mul(self, c: S::f32s, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.negate_mul_add_f32s(a, b, c)
    }

    #[inline(always)]
    fn other_side(self, v: S::f32s) -> S::f32s {
        Self::exchanged::<1>(v)
    }

    #[inline(always)]
    fn other_joint(self, v: S::f32s) -> S::f32s {
        Self::exchanged::<2>(v)
    }

    #[inline(always)]
    fn by_joint(self, v: [S::f32s; JOINTS]) -> [S::f32s; JOINTS] {
        self.0.deinterleave_shfl_f32s(v)
    }

    #[inline(always)]
    fn of_joint(self, v: S::f32s, individual: usize) -> f64 {
        // The order of the individuals in a vector of one joint depends on the machine.
        let back = self.0.interleave_shfl_f32s([v; JOINTS]);
        self.at(back[individual / Self::INDIVIDUALS], individual % Self::INDIVIDUALS, 0)
    }
}

fn number<V: Pod, T: Pod>(v: V, lane: usize) -> T {
    cast_slice::<_, T>(&[v])[lane]
}

/// f64 in the widest vectors of the machine. `AS_CORE`: every operation is rounded by itself, in the order in which `cpg_core` has them, so
/// that the bits are those of its generators in f64.
#[derive(Clone, Copy)]
pub struct Doubles<S, const AS_CORE: bool>(pub S);

impl<S: Simd, const AS_CORE: bool> Doubles<S, AS_CORE> {
    /// The greater of `a` and the size of `b`; `a` where `b` is not a number.
    #[inline(always)]
    pub(crate) fn greater_size(self, a: [S::f64s; JOINTS], b: [S::f64s; JOINTS]) -> [S::f64s; JOINTS] {
        std::array::from_fn(|i| self.0.max_f64s(self.0.abs_f64s(b[i]), a[i]))
    }
}

impl<S: Simd, const AS_CORE: bool> Lanes for Doubles<S, AS_CORE> {
    type Vector = [S::f64s; JOINTS];
    const INDIVIDUALS: usize = S::F64_LANES;

    #[inline(always)]
    fn splat(self, x: f64) -> Self::Vector {
        [self.0.splat_f64s(x); JOINTS]
    }

    #[inline(always)]
    fn each(self, of: impl Fn(usize, usize) -> f64) -> Self::Vector {
        let mut out = self.splat(0.0);
        for (joint, out) in out.iter_mut().enumerate() {
            for (individual, out) in cast_slice_mut::<_, f64>(std::slice::from_mut(out)).iter_mut().enumerate() {
                *out = of(individual, joint);
            }
        }
        out
    }

    #[inline(always)]
    fn at(self, v: Self::Vector, individual: usize, joint: usize) -> f64 {
        number(v[joint], individual)
    }

    #[inline(always)]
    fn add(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        std::array::from_fn(|i| self.0.add_f64s(a[i], b[i]))
    }

    #[inline(always)]
    fn sub(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        std::array::from_fn(|i| self.0.sub_f64s(a[i], b[i]))
    }

    #[inline(always)]
    fn mul(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        std::array::from_fn(|i| self.0.mul_f64s(a[i], b[i]))
    }

    #[inline(always)]
    fn mul_add(self, a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector {
        if AS_CORE {
            return self.add(c, self.mul(a, b));
        }
        std::array::from_fn(|i| self.0.mul_add_f64s(a[i], b[i], c[i]))
    }

    #[inline(always)]
    fn sub_mul(self, c: Self::Vector, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        if AS_CORE {
            return self.sub(c, self.mul(a, b));
        }
        std::array::from_fn(|i| self.0.negate_mul_add_f64s(a[i], b[i], c[i]))
    }

    #[inline(always)]
    fn plus_twice(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        if AS_CORE { self.add(self.add(a, b), b) } else { self.add(a, self.add(b, b)) }
    }

    #[inline(always)]
    fn other_side(self, v: Self::Vector) -> Self::Vector {
        other_side(v)
    }

    #[inline(always)]
    fn other_joint(self, v: Self::Vector) -> Self::Vector {
        other_joint(v)
    }

    #[inline(always)]
    fn by_joint(self, v: [Self::Vector; JOINTS]) -> [Self::Vector; JOINTS] {
        transposed(v)
    }

    #[inline(always)]
    fn of_joint(self, v: Self::Vector, individual: usize) -> f64 {
        number(v[individual / S::F64_LANES], individual % S::F64_LANES)
    }
}

/// Runs `op` with the widest vectors of this machine, of at least four lanes of f32.
pub fn dispatch<Op: WithSimd>(op: Op) -> Op::Output {
    match Arch::new() {
        Arch::Scalar => op.with_simd(Scalar128b),
        arch => arch.dispatch(op),
    }
}

/// Splits `individuals` into ranges of whole f32 vectors of this machine, except the last: at most [`MOST_VECTORS`] each, about as many in
/// each, and as many ranges for each thread of the pool.
#[must_use]
pub fn blocks(individuals: usize) -> Vec<Range<usize>> {
    struct Individuals;
    impl WithSimd for Individuals {
        type Output = usize;
        fn with_simd<S: Simd>(self, _: S) -> usize {
            Singles::<S>::INDIVIDUALS
        }
    }
    let of_vector = dispatch(Individuals);
    let vectors = individuals.div_ceil(of_vector);
    let threads = rayon::current_num_threads();
    let blocks = (threads * vectors.div_ceil(threads).div_ceil(MOST_VECTORS)).min(vectors);
    let end = |block: usize| (block * vectors / blocks * of_vector).min(individuals);
    (0..blocks).map(|block| end(block)..end(block + 1)).collect()
}
