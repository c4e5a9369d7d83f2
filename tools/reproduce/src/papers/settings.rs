//! How much is computed.

use std::ops::RangeInclusive;

/// What is computed, and how much.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// First seed of the searches.
    pub seed: u64,
    /// A small budget, for tests and for a first look: the same figures and claims, searches that end early.
    pub quick: bool,
}

impl Settings {
    /// The seeds of the searches: ten, or two.
    pub(super) fn seeds(&self) -> RangeInclusive<u64> {
        let more = if self.quick { 1 } else { 9 };
        self.seed..=self.seed.saturating_add(more)
    }

    /// Generations of the genetic algorithm: those of the thesis, or few.
    pub(super) fn generations(&self) -> usize {
        if self.quick { 20 } else { 1000 }
    }

    /// Evaluations of the other searches.
    pub(super) fn evaluations(&self) -> usize {
        if self.quick { 2_000 } else { 100_000 }
    }

    /// Networks that the fit to a person simulates with alpha and k of Table 1.
    pub(super) fn evaluations_with_table_1(&self) -> usize {
        if self.quick { 1_000 } else { 50_000 }
    }

    /// Networks that the fit to a person simulates with all parameters free.
    pub(super) fn evaluations_for_person(&self) -> usize {
        if self.quick { 1_000 } else { 60_000 }
    }
}
