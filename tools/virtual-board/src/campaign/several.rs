//! Several faults at once, drawn at random from those of a campaign.

use super::{Campaign, Fault};
use crate::random::Random;

/// Faults in a case, at least and at most.
const FAULTS: std::ops::RangeInclusive<u64> = 2..=4;
/// The last fault begins this long after the state's time at most, s.
const SPREAD_S: f64 = 0.2;

/// How many cases, and the seed of the first; the next case has the next seed. A case with its seed is always the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Several {
    /// Cases.
    pub(crate) cases: u64,
    /// Seed of the first.
    pub(crate) seed: u64,
}

/// One case: a state, and faults with their times after the state's, s, in the order of time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Draw<'a> {
    /// Its seed.
    pub(crate) seed: u64,
    /// Name of the state.
    pub(crate) state: &'a str,
    /// The faults.
    pub(crate) faults: Vec<(f64, &'a Fault)>,
}

impl Several {
    /// All cases.
    pub(crate) fn draws(self, campaign: &Campaign) -> impl Iterator<Item = Draw<'_>> {
        (0..self.cases).map(move |n| draw(self.seed.wrapping_add(n), campaign))
    }
}

/// The case of a seed. Faults are drawn from those that apply in its state; one may come twice, which takes a changed bit back.
fn draw(seed: u64, campaign: &Campaign) -> Draw<'_> {
    let mut random = Random(seed);
    let mut below = |limit: usize| (random.number() % limit.max(1) as u64) as usize;
    let states: Vec<&str> = (campaign.runs.iter().flat_map(|run| &run.states))
        .map(|state| state.name.as_str())
        .filter(|name| campaign.faults.iter().any(|fault| fault.applies_in(name)))
        .collect();
    let state = states.get(below(states.len())).copied().unwrap_or_default();
    let fitting: Vec<&Fault> = campaign.faults.iter().filter(|fault| fault.applies_in(state)).collect();
    let count = *FAULTS.start() as usize + below((FAULTS.end() - FAULTS.start() + 1) as usize);
    /// Times are whole microseconds.
    const PARTS: usize = (SPREAD_S * 1e6) as usize;
    let mut faults: Vec<(f64, &Fault)> =
        (0..count).filter_map(|_| Some((below(PARTS) as f64 * 1e-6, *fitting.get(below(fitting.len()))?))).collect();
    faults.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    Draw { seed, state, faults }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_case_is_that_of_its_seed() {
        let campaign = Campaign::parse(
            "phases = 1\n[limits]\nleast_us = [0, 0, 0, 0]\nmost_us = [9, 9, 9, 9]\nus_per_s = [1, 1, 1, 1]\npark_us = [9, 9, 9, 9]\n\
             [[run]]\nname = \"a\"\nstate = [{ name = \"x\", at_s = 1, outputs = true, says = \"x (none)\" }, { name = \"y\", at_s = 2, outputs = true, says = \"y (none)\" }]\n\
             [[register]]\nname = \"r\"\naddress = 0\nbits = [0, 1, 2, 3, 4, 5, 6, 7]\nstates = [\"y\", \"x\"]\n\
             expect = { reaction = \"none\", within_ms = 1 }\n\
             [[fault]]\nname = \"x alone\"\ninject = \"panic\"\nstates = [\"x\"]\nexpect = { reaction = \"none\", within_ms = 1 }\n",
            |_| None,
        )
        .unwrap();
        let all: Vec<Draw> = Several { cases: 300, seed: 7 }.draws(&campaign).collect();
        assert_eq!(Several { cases: 1, seed: 107 }.draws(&campaign).next().unwrap(), all[100]);
        let counts: BTreeSet<usize> = all.iter().map(|draw| draw.faults.len()).collect();
        let states: BTreeSet<&str> = all.iter().map(|draw| draw.state).collect();
        assert_eq!((counts, states), (BTreeSet::from([2, 3, 4]), BTreeSet::from(["x", "y"])));
        for draw in &all {
            assert!(draw.faults.is_sorted_by(|(a, _), (b, _)| a <= b));
            assert!(
                draw.faults.iter().all(|(at_s, fault)| (0.0..SPREAD_S).contains(at_s) && fault.applies_in(draw.state))
            );
        }
        assert!(all.iter().any(|draw| draw.faults.iter().any(|(_, fault)| fault.name == "x alone")));
    }
}
