//! Coupling graph: the pairs of linked oscillators, known when the program is compiled.
//!
//! The list is part of the type: the compiler unrolls it, and every index is a checked constant.

use crate::Scalar;

/// `E` links between `N` oscillators.
///
/// ```
/// use cpg_core::Graph;
/// /// Hips, knees and ankles.
/// struct SixJoints;
/// impl Graph<6, 7> for SixJoints {
///     const EDGES: [(usize, usize); 7] = [(0, 1), (2, 3), (4, 5), (0, 2), (1, 3), (2, 4), (3, 5)];
/// }
/// let () = SixJoints::VALID;
/// // Every joint is linked: the ends of the links name all six.
/// let mut named: Vec<_> = SixJoints::EDGES.iter().flat_map(|&(a, b)| [a, b]).collect();
/// named.sort_unstable();
/// named.dedup();
/// assert_eq!(named, [0, 1, 2, 3, 4, 5]);
/// ```
pub trait Graph<const N: usize, const E: usize> {
    /// The pairs of linked oscillators, counted from 0. Each is one link; the model defines its effect in either direction.
    const EDGES: [(usize, usize); E];

    /// Checks at compile time that every pair names two different oscillators below `N`. Use it once (`let () = MyGraph::VALID;`), or the compiler
    /// does not evaluate it.
    ///
    /// ```compile_fail,E0080
    /// use cpg_core::Graph;
    /// struct Triangle;
    /// impl Graph<3, 3> for Triangle {
    ///     const EDGES: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 3)];
    /// }
    /// let () = <Triangle as Graph<3, 3>>::VALID;
    /// ```
    const VALID: () = {
        let mut e = 0;
        while e < E {
            let (i, j) = Self::EDGES[e];
            assert!(i < N && j < N && i != j, "a link must join two different oscillators of the network");
            e += 1;
        }
    };
}

/// Left to right and hip to knee, the four links of the thesis: 1-2, 3-4, 1-3, 2-4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Biped;

impl Graph<4, 4> for Biped {
    const EDGES: [(usize, usize); 4] = [(0, 1), (2, 3), (0, 2), (1, 3)];
}

/// The links of [`Biped`] between left and right: hips, knees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LeftRight;

impl Graph<4, 2> for LeftRight {
    const EDGES: [(usize, usize); 2] = [(0, 1), (2, 3)];
}

/// The links of [`Biped`] inside a leg, hip to knee: left, right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HipKnee;

impl Graph<4, 2> for HipKnee {
    const EDGES: [(usize, usize); 2] = [(0, 2), (1, 3)];
}

/// The value of oscillator `i`. `Graph::VALID` makes the zero unreachable; this form contains no panic.
pub(crate) fn value<T: Scalar, const N: usize>(values: &[T; N], i: usize) -> T {
    values.get(i).copied().unwrap_or(T::ZERO)
}

/// Adds `amount` to the value of oscillator `i`.
pub(crate) fn add<T: Scalar, const N: usize>(values: &mut [T; N], i: usize, amount: T) {
    if let Some(value) = values.get_mut(i) {
        *value += amount;
    }
}
