//! Least, median, 99th percentile and most of a cost.

use serde::{Deserialize, Serialize};

/// Instructions and modelled cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cost {
    /// Instructions.
    pub instructions: u64,
    /// Modelled cycles without those of `stalls`.
    pub cycles: u64,
    /// Modelled cycles in which the core waits for the flash.
    pub stalls: u64,
}

impl Cost {
    /// Nothing.
    pub const NONE: Self = Self { instructions: 0, cycles: 0, stalls: 0 };

    /// All cycles.
    #[must_use]
    pub const fn all_cycles(&self) -> u64 {
        self.cycles + self.stalls
    }

    /// Adds another cost.
    pub const fn add(&mut self, other: Self) {
        self.instructions += other.instructions;
        self.cycles += other.cycles;
        self.stalls += other.stalls;
    }

    /// What was added since.
    #[must_use]
    pub const fn since(self, before: Self) -> Self {
        Self {
            instructions: self.instructions - before.instructions,
            cycles: self.cycles - before.cycles,
            stalls: self.stalls - before.stalls,
        }
    }
}

/// How a number is distributed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// The least.
    pub min: u64,
    /// At least half of the numbers are not above it.
    pub median: u64,
    /// At least 99 of 100 numbers are not above it.
    pub p99: u64,
    /// The most.
    pub max: u64,
}

impl Spread {
    /// Of these numbers; `None` if there are none.
    #[must_use]
    pub fn of(mut numbers: Vec<u64>) -> Option<Self> {
        numbers.sort_unstable();
        let rank = |percent: usize| numbers.get((numbers.len() * percent).div_ceil(100).saturating_sub(1)).copied();
        Some(Self { min: *numbers.first()?, median: rank(50)?, p99: rank(99)?, max: *numbers.last()? })
    }
}

/// A part of the program with its cost.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Its name.
    pub part: String,
    /// How often it ran.
    pub count: u64,
    /// Instructions each time.
    pub instructions: Spread,
    /// Modelled cycles each time.
    pub cycles: Spread,
    /// Of these, the cycles in which the core waits for the flash.
    pub stalls: Spread,
}

impl Row {
    /// Of these costs; `None` if there are none.
    #[must_use]
    pub fn of(part: &str, costs: &[Cost]) -> Option<Self> {
        let spread = |number: fn(&Cost) -> u64| Spread::of(costs.iter().map(number).collect());
        Some(Self {
            part: part.to_owned(),
            count: costs.len() as u64,
            instructions: spread(|cost| cost.instructions)?,
            cycles: spread(Cost::all_cycles)?,
            stalls: spread(|cost| cost.stalls)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ranks_are_numbers_that_occurred() {
        let of = |numbers: &[u64]| Spread::of(numbers.to_vec()).unwrap();
        assert_eq!(of(&[7]), Spread { min: 7, median: 7, p99: 7, max: 7 });
        assert_eq!(of(&[4, 1, 3, 2]), Spread { min: 1, median: 2, p99: 4, max: 4 });
        let hundred: Vec<u64> = (1..=100).rev().collect();
        assert_eq!(of(&hundred), Spread { min: 1, median: 50, p99: 99, max: 100 });
        assert_eq!(Spread::of(vec![]), None);
    }
}
