//! Networks of identical cells whose symmetry determines the gaits: four cells for two legs, eight for four legs (or two legs and two arms).
//!
//! Source: Golubitsky, Stewart, Buono and Collins 1998, 1999 (eight cells); Pinto and Golubitsky 2006 (four cells). The cells here are
//! Stuart-Landau oscillators, complex z, so that each primary gait is an exact circle:
//! ```text
//! z_k' = (lambda + i w - |z_k|^2) z_k + sum over links ( c z_j + d conj(z_k) z_j^2 )
//! ```
//! **Four cells**: 1 and 3 are the two muscle groups of the left leg, 2 and 4 of the right; each cell has one link of each kind,
//! across to the same muscle (1-2, 3-4), across to the other (1-4, 2-3), within the leg (1-3, 2-4). With d = 0 the signs of the three c
//! select slow hop, run, fast hop and walk, of amplitude `sqrt(lambda + |c_12| + |c_14| + |c_13|)`. A negative d makes the phase of a
//! kind of link settle at `cos = -c / (2 d |z|^2)`, away from 0 and 1/2: the symmetry is broken, and the start decides whether left or right
//! leads. These are the secondary gaits: both gallops and the skip. (The thesis exchanges the names of the gallops with respect to its own
//! definitions of run and walk; here the gallop walk has a leg's muscles in phase. Of the two interpretations of the skip, here the right
//! leg repeats the left one half a period later, with two different muscle waves.)
//!
//! **Eight cells**: two rings of four, 1-3-5-7 left and 2-4-6-8 right, each cell driven by the one before it with a lead of m quarter
//! cycles, and pairs across with a sign: pronk, pace, bound, trot, jump and two walks. Amplitude `sqrt(lambda + ring + pair)`.
//!
//! ```
//! use cpg_core::math::first_order::rk4;
//! use cpg_core::network::symmetric_cells::{LegGait, LegNetwork};
//! let (walk, mut z) = (LegNetwork::of(LegGait::Walk), [0.3f32, 0.1, -0.2, 0.4, 0.1, -0.5, 0.2, 0.2]);
//! for _ in 0..20_000 {
//!     rk4(&walk, &mut z, 2e-3);
//! }
//! // On the circle of sqrt(1.9), the legs in antiphase, the muscles of a leg too.
//! assert!((z[0].hypot(z[1]) - 1.378_405).abs() < 1e-4);
//! assert!((z[0] + z[2]).abs() < 1e-3 && (z[0] + z[4]).abs() < 1e-3 && (z[0] - z[6]).abs() < 1e-3);
//! ```

use crate::Scalar;
use crate::math::first_order::Flow;

/// One kind of link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellLink<T = f32> {
    /// Linear coupling c: above 0 pulls into phase, below 0 into antiphase.
    pub linear: T,
    /// Second-harmonic coupling d: 0 for primary gaits, below 0 for a phase in between.
    pub harmonic: T,
}

/// Gaits of the four-cell network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LegGait {
    /// Two-legged hop: all cells in phase.
    SlowHop,
    /// Legs in antiphase, the muscles of a leg in phase.
    Run,
    /// Two-legged jump: legs in phase, the muscles of a leg in antiphase.
    FastHop,
    /// Legs in antiphase, the muscles of a leg in antiphase.
    Walk,
    /// One leg leads by a sixth of a cycle, the muscles of a leg in phase.
    GallopWalk,
    /// One leg leads by a sixth of a cycle, the muscles of a leg in antiphase.
    GallopRun,
    /// Legs in antiphase, the muscles of a leg at a phase in between.
    Skip,
}

impl LegGait {
    /// All gaits.
    pub const ALL: [LegGait; 7] = [
        LegGait::SlowHop,
        LegGait::Run,
        LegGait::FastHop,
        LegGait::Walk,
        LegGait::GallopWalk,
        LegGait::GallopRun,
        LegGait::Skip,
    ];

    /// Phases of cells 1 to 4 in cycles relative to cell 1, where the gait's symmetry fixes them; the secondary gaits for a lead of a
    /// sixth of a cycle.
    #[must_use]
    pub const fn phases(self) -> [f32; 4] {
        match self {
            LegGait::SlowHop => [0.0, 0.0, 0.0, 0.0],
            LegGait::Run => [0.0, 0.5, 0.0, 0.5],
            LegGait::FastHop => [0.0, 0.0, 0.5, 0.5],
            LegGait::Walk => [0.0, 0.5, 0.5, 0.0],
            LegGait::GallopWalk => [0.0, 1.0 / 6.0, 0.0, 1.0 / 6.0],
            LegGait::GallopRun => [0.0, 1.0 / 6.0, 0.5, 2.0 / 3.0],
            LegGait::Skip => [0.0, 0.5, 1.0 / 6.0, 2.0 / 3.0],
        }
    }
}

/// The four-cell network; the state is (Re z_1, Im z_1, Re z_2, ...).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegNetwork<T = f32> {
    /// lambda, the growth rate at rest.
    pub growth: T,
    /// w in radians per unit of time.
    pub frequency: T,
    /// Links 1-2 and 3-4.
    pub across_same: CellLink<T>,
    /// Links 1-4 and 2-3.
    pub across_other: CellLink<T>,
    /// Links 1-3 and 2-4.
    pub within: CellLink<T>,
}

impl<T: Scalar> LegNetwork<T> {
    /// The network whose attractor is a gait: lambda 1, couplings of size 0.3, w = 2 pi (one cycle per unit of time).
    #[must_use]
    pub fn of(gait: LegGait) -> Self {
        let plain = |sign: f32| CellLink { linear: T::from_f32(0.3 * sign), harmonic: T::ZERO };
        // A sixth of a cycle: cos = 1/2 = -c / (2 d r^2), with r^2 = 1 + 0.3 + 4 (0.3 / 2) = 1.9 on that gait.
        let between = |sign: f32| CellLink { linear: T::from_f32(0.3 * sign), harmonic: -T::ratio(3, 19) };
        let (across_same, across_other, within) = match gait {
            LegGait::SlowHop => (plain(1.0), plain(1.0), plain(1.0)),
            LegGait::Run => (plain(-1.0), plain(-1.0), plain(1.0)),
            LegGait::FastHop => (plain(1.0), plain(-1.0), plain(-1.0)),
            LegGait::Walk => (plain(-1.0), plain(1.0), plain(-1.0)),
            LegGait::GallopWalk => (between(1.0), between(1.0), plain(1.0)),
            LegGait::GallopRun => (between(1.0), between(-1.0), plain(-1.0)),
            LegGait::Skip => (plain(-1.0), between(-1.0), between(1.0)),
        };
        Self { growth: T::ONE, frequency: T::TAU, across_same, across_other, within }
    }
}

impl<T: Scalar> Flow<T, 8> for LegNetwork<T> {
    fn derivative(&self, s: &[T; 8]) -> [T; 8] {
        let &[x1, y1, x2, y2, x3, y3, x4, y4] = s;
        let cell = |own: (T, T), same: (T, T), other: (T, T), within: (T, T)| {
            let local = local(self.growth, self.frequency, own);
            let (a, b, c) = (
                linked(&self.across_same, own, same),
                linked(&self.across_other, own, other),
                linked(&self.within, own, within),
            );
            (local.0 + a.0 + b.0 + c.0, local.1 + a.1 + b.1 + c.1)
        };
        let (z1, z2, z3, z4) = ((x1, y1), (x2, y2), (x3, y3), (x4, y4));
        let d1 = cell(z1, z2, z4, z3);
        let d2 = cell(z2, z1, z3, z4);
        let d3 = cell(z3, z4, z2, z1);
        let d4 = cell(z4, z3, z1, z2);
        [d1.0, d1.1, d2.0, d2.1, d3.0, d3.1, d4.0, d4.1]
    }
}

/// The same four cells as FitzHugh-Nagumo neurons, linked by `c (v_j - v_k)`; the state is (v_1, w_1, v_2, ...).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeuronLegNetwork<T = f32> {
    /// The cell.
    pub neuron: crate::oscillator::fitzhugh_nagumo::FitzHughNagumo<T>,
    /// Coupling c of the links 1-2 and 3-4, of 1-4 and 2-3, and of 1-3 and 2-4.
    pub couplings: [T; 3],
}

impl<T: Scalar> Flow<T, 8> for NeuronLegNetwork<T> {
    fn derivative(&self, s: &[T; 8]) -> [T; 8] {
        let &[v1, w1, v2, w2, v3, w3, v4, w4] = s;
        let [a, b, c] = self.couplings;
        let cell = |v: T, w: T, same: T, other: T, within: T| {
            let [dv, dw] = self.neuron.derivative(&[v, w]);
            (dv + a * (same - v) + b * (other - v) + c * (within - v), dw)
        };
        let d1 = cell(v1, w1, v2, v4, v3);
        let d2 = cell(v2, w2, v1, v3, v4);
        let d3 = cell(v3, w3, v4, v2, v1);
        let d4 = cell(v4, w4, v3, v1, v2);
        [d1.0, d1.1, d2.0, d2.1, d3.0, d3.1, d4.0, d4.1]
    }
}

/// Gaits of the eight-cell network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuadrupedGait {
    /// All legs together.
    Pronk,
    /// Left against right.
    Pace,
    /// Front against hind.
    Bound,
    /// Diagonal pairs.
    Trot,
    /// Pairs across, a quarter cycle along the rings.
    Jump,
    /// One leg after the other.
    Walk,
    /// One leg after the other, in the reverse order.
    ReverseWalk,
}

impl QuadrupedGait {
    /// All gaits.
    pub const ALL: [QuadrupedGait; 7] = [
        QuadrupedGait::Pronk,
        QuadrupedGait::Pace,
        QuadrupedGait::Bound,
        QuadrupedGait::Trot,
        QuadrupedGait::Jump,
        QuadrupedGait::Walk,
        QuadrupedGait::ReverseWalk,
    ];

    /// Quarter cycles of lead along a ring, and whether the pairs across are in phase.
    #[must_use]
    pub const fn symmetry(self) -> (u8, bool) {
        match self {
            QuadrupedGait::Pronk => (0, true),
            QuadrupedGait::Pace => (0, false),
            QuadrupedGait::Bound => (2, true),
            QuadrupedGait::Trot => (2, false),
            QuadrupedGait::Jump => (1, true),
            QuadrupedGait::Walk => (1, false),
            QuadrupedGait::ReverseWalk => (3, false),
        }
    }

    /// Phases of cells 1 to 8 in cycles relative to cell 1.
    #[must_use]
    pub fn phases(self) -> [f32; 8] {
        let (quarters, in_phase) = self.symmetry();
        let mut phases = [0.0; 8];
        for (k, phase) in (0u8..).zip(&mut phases) {
            let across = if k % 2 == 1 && !in_phase { 2 } else { 0 };
            *phase = f32::from((k / 2 * quarters + across) % 4) / 4.0;
        }
        phases
    }
}

/// The eight-cell network; the state is (Re z_1, Im z_1, Re z_2, ...).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadrupedNetwork<T = f32> {
    /// lambda, the growth rate at rest.
    pub growth: T,
    /// w in radians per unit of time.
    pub frequency: T,
    /// Strength of the drive along a ring.
    pub ring: T,
    /// Strength of the link across.
    pub pair: T,
    /// The gait that the couplings select.
    pub gait: QuadrupedGait,
}

impl<T: Scalar> QuadrupedNetwork<T> {
    /// lambda 1, ring 0.5, pair 0.3, one cycle per unit of time.
    #[must_use]
    pub fn of(gait: QuadrupedGait) -> Self {
        Self { growth: T::ONE, frequency: T::TAU, ring: T::ratio(1, 2), pair: T::ratio(3, 10), gait }
    }
}

impl<T: Scalar> Flow<T, 16> for QuadrupedNetwork<T> {
    fn derivative(&self, s: &[T; 16]) -> [T; 16] {
        let (quarters, in_phase) = self.gait.symmetry();
        let pair = if in_phase { self.pair } else { -self.pair };
        let z = |k: usize| (part(s, 2 * k), part(s, 2 * k + 1));
        let mut out = [T::ZERO; 16];
        for (k, slope) in out.chunks_exact_mut(2).enumerate() {
            let own = z(k);
            let local = local(self.growth, self.frequency, own);
            let (x, y) = z((k + 6) % 8);
            // A lead of a quarter cycle is a multiplication by i.
            let ahead = match quarters {
                0 => (x, y),
                1 => (-y, x),
                2 => (-x, -y),
                _ => (y, -x),
            };
            let across = z(k ^ 1);
            if let [re, im] = slope {
                *re = local.0 + self.ring * ahead.0 + pair * across.0;
                *im = local.1 + self.ring * ahead.1 + pair * across.1;
            }
        }
        out
    }
}

/// The oscillator's own part, (lambda + i w - |z|^2) z.
fn local<T: Scalar>(growth: T, frequency: T, (x, y): (T, T)) -> (T, T) {
    let radial = growth - (x * x + y * y);
    (radial * x - frequency * y, radial * y + frequency * x)
}

/// c z_j + d conj(z_k) z_j^2.
fn linked<T: Scalar>(link: &CellLink<T>, (x, y): (T, T), (u, v): (T, T)) -> (T, T) {
    let (square_re, square_im) = (u * u - v * v, u * v + u * v);
    (
        link.linear * u + link.harmonic * (x * square_re + y * square_im),
        link.linear * v + link.harmonic * (x * square_im - y * square_re),
    )
}

/// Element k; every k here is below D.
fn part<T: Scalar, const D: usize>(s: &[T; D], k: usize) -> T {
    s.get(k).copied().unwrap_or(T::ZERO)
}
