//! The hexapod of Yang et al. 2014: its graph (figure 2), the steps of the three gaits, and what the paper says about them.

use cpg_core::edge_reversal::hexapod::{Hexapod, Leg, Swings};
use cpg_core::edge_reversal::ladder::EDGES;
use cpg_core::edge_reversal::smer::{Edge, Smer, SmerError};
use picture::Panel;
use picture::links::{Link, Links, Node};

use super::block::STEP_S;
use super::claim::{Claim, Paper, Verdict};
use super::figure::Figure;
use crate::charts::legs::{step_diagram, swings};

/// Changes of the flexors' reversibility at 160 s and 300 s.
const CHANGES: [(u64, u32); 2] = [(54, 3), (100, 1)];

/// The figures.
///
/// # Errors
/// None: the reversibilities are in range.
pub(super) fn figures() -> Result<Vec<Figure>, SmerError> {
    let steps = swings(&mut Hexapod::new(5)?, &CHANGES, 120)?;
    let wanted = "flexors have the reversibility R = 5 (wave), from step 54 R = 3, from step 100 R = 1 (tripod), extensors 1; a step is 3 s; integers. Also: \
                  footfall hexapod --steps 120 --switch \"54:3 100:1\" --svg FILE";
    let printed = printed_roles().take(60).collect::<Vec<_>>();
    Ok(vec![
        graph(),
        Figure::new(
            "hexapod-steps",
            "Yang et al.: the hexapod through the wave, the middle gait and the tripod",
            "A leg swings while its flexor is on. The wave moves one leg at a time, the tripod three.",
            wanted,
            vec![step_diagram(&steps, &CHANGES)],
        ),
        Figure::new(
            "hexapod-printed-roles",
            "Yang et al.: the hexapod with the roles of Table 1",
            "With the flexors at 1 and the extensors at 5 neighbouring flexors alternate: the pattern is that of the tripod, not of a slow wave.",
            "flexors 1, extensors 5, otherwise as the wave; a step is 3 s; integers",
            vec![step_diagram(&printed, &[])],
        ),
    ])
}

/// The graph of figure 2: a ladder of six flexors, each with an extensor.
fn graph() -> Figure {
    let note = |kind: &str, r: u32| format!("{kind}, r = {r}");
    let flexors = Leg::ALL.map(|leg| Node { name: leg.name().into(), note: note("flexor", 5) });
    let extensors = Leg::ALL.map(|leg| Node { name: format!("{} e", leg.name()), note: note("extensor", 1) });
    let wave = Hexapod::new(5).map(|hexapod| *hexapod.graph().edges());
    let link = |edge: &Edge| {
        let ends = [usize::from(edge.a), usize::from(edge.b)];
        // To the end that operates first.
        let first = if ends[1] >= Leg::ALL.len() { edge.tokens_at_a >= 5 } else { edge.tokens_at_a > 0 };
        Link { ends: if first { [ends[1], ends[0]] } else { ends }, labels: Default::default() }
    };
    let links = wave.iter().flatten().map(link).collect();
    let nodes = flexors.into_iter().chain(extensors).collect();
    Figure::new(
        "yang-2",
        "Yang et al., figure 2: the graph of the hexapod",
        "Six flexors (T top, M middle, B bottom; L left, R right) on a ladder, each joined to its extensor; an arrow points to the node that operates first.",
        "flexors R = 5, extensors 1, the start of the wave. Also: footfall hexapod --orientation dd-dd-lll",
        vec![Panel::links("start of the wave", Links { nodes, links })],
    )
}

/// The graph of figure 2 with the roles of Table 1: flexors 1, extensors 5, flexors oriented as in the wave.
fn with_printed_roles() -> Result<Smer<12, 13>, SmerError> {
    let of_wave = *Hexapod::new(5)?.graph().edges();
    let edges = of_wave.map(|edge| {
        let is_leg = usize::from(edge.b) >= Leg::ALL.len();
        // Of f = r_i + r_j - 1 tokens: one between flexors, five to an extensor, all at the flexor.
        Edge { tokens_at_a: if is_leg { 5 } else { u32::from(edge.tokens_at_a > 0) }, ..edge }
    });
    Smer::new(std::array::from_fn(|node| if node < Leg::ALL.len() { 1 } else { 5 }), edges)
}

/// The legs that swing in each step with the printed roles.
fn printed_roles() -> impl Iterator<Item = Swings> {
    let mut graph = with_printed_roles().ok();
    std::iter::from_fn(move || graph.as_mut().map(|graph| Swings::of(graph.step())))
}

/// Steps until a gait repeats after a change, the most over every step of the old gait.
fn longest_transient(from: u32, to: u32) -> Result<usize, SmerError> {
    let period = to as usize + 1;
    let settled = |phase: u64| -> Result<usize, SmerError> {
        let steps = swings(&mut Hexapod::new(from)?, &[(24 + phase, to)], 24 + phase + 60)?;
        let after = &steps[(24 + phase) as usize..];
        Ok((0..40).find(|&k| (k..60 - period).all(|i| after[i] == after[i + period])).unwrap_or(40))
    };
    (0..u64::from(from) + 1).try_fold(0, |longest, phase| Ok(longest.max(settled(phase)?)))
}

/// Acyclic starts of a triangle with three reversibilities, and those of them that end in a deadlock.
fn triangle(r: [u32; 3]) -> Result<(usize, usize), SmerError> {
    let carries = |a: usize, b: usize| r[a] + r[b] - cpg_core::edge_reversal::smer::gcd(r[a], r[b]);
    let counts =
        |a: usize, b: usize| (0..=carries(a, b)).step_by(cpg_core::edge_reversal::smer::gcd(r[a], r[b]) as usize);
    let (mut acyclic, mut dead) = (0, 0);
    for x in counts(0, 1) {
        for y in counts(1, 2) {
            for z in counts(0, 2) {
                let edges = [(0, 1, x), (1, 2, y), (0, 2, z)].map(|(a, b, tokens_at_a)| Edge { a, b, tokens_at_a });
                let start = Smer::unproven(r, edges)?;
                if start.is_acyclic() {
                    acyclic += 1;
                    dead += usize::from(start.cycle().is_err());
                }
            }
        }
    }
    Ok((acyclic, dead))
}

/// The claims about the hexapod and its graph.
///
/// # Errors
/// None: the reversibilities are in range.
pub(super) fn claims() -> Result<Vec<Claim>, SmerError> {
    let claim = |id, place, statement, number| Claim::new(Paper::Yang, id, place, statement, number);
    let of_flexor = |leg: Leg| {
        let links = EDGES.iter().filter(|(a, b)| *a == leg || *b == leg).count();
        // And its extensor.
        links + 1
    };
    let (middle, end) = (of_flexor(Leg::MiddleLeft), of_flexor(Leg::TopLeft));
    let printed = with_printed_roles()?.cycle()?;
    let share = f64::from(printed.operations[0]) / f64::from(printed.period);
    let wave = Hexapod::new(5)?;
    let cycle = wave.graph().cycle()?;
    let order: Vec<String> = swings(&mut Hexapod::new(5)?, &[], 6)?.iter().map(ToString::to_string).collect();
    let (to_middle, to_tripod, direct) = (longest_transient(5, 3)?, longest_transient(3, 1)?, longest_transient(5, 1)?);
    let (acyclic, dead) = triangle([2, 3, 5])?;
    let equal = triangle([1, 1, 1])?;
    let seconds = f64::from(cycle.period) * STEP_S;
    Ok(vec![
        claim("graph-degrees", "figure 2", "a flexor is coupled to 3 or 4 neurons", "3 or 4").found(
            format!("{end} at top and bottom, {middle} in the middle"),
            Verdict::of((end, middle) == (3, 4)),
            "A ladder of six flexors with three rungs, and an extensor at each flexor.",
        ),
        claim(
            "hexapod-printed-roles",
            "figure 2, Table 1",
            "flexors with 1 and extensors with 5 give the slow gait",
            "on for 3 of 18 s",
        )
        .found(
            format!("period {} steps, a flexor on for {share:.2} of the time, as in the tripod", printed.period),
            Verdict::of((share - 1.0 / 6.0).abs() < 0.01),
            "Neighbouring flexors with equal reversibility alternate strictly, whatever the extensors have.",
        ),
        claim(
            "hexapod-wave",
            "Table 1, text",
            "the slow gait swings one leg at a time, each for 3 of 18 s",
            "3 of 18 s",
        )
        .found(
            format!("{} repeating, period {seconds:.0} s, each leg once", order.join(" ")),
            Verdict::of(cycle.period == 6 && cycle.operations[..6].iter().all(|swings| *swings == 1)),
            "With the roles exchanged: flexors 5, extensors 1.",
        ),
        claim(
            "hexapod-changes",
            "text",
            "the hexapod changes from the wave to the middle gait to the tripod",
            "not stated",
        )
        .found(
            format!("settles within {to_middle}, {to_tripod} and {direct} steps: 5 to 3, 3 to 1, 5 to 1"),
            Verdict::of([to_middle, to_tripod, direct].iter().all(|steps| *steps <= 3)),
            "From every step of the old gait, by the rule of docs/generators.md; no change stops a leg.",
        ),
        claim("acyclic-is-live", "text", "an acyclic start keeps every node operating", "all").found(
            format!(
                "{dead} of {acyclic} acyclic starts of a triangle (2, 3, 5) stop; {} of {} of (1, 1, 1)",
                equal.1, equal.0
            ),
            Verdict::of(dead == 0),
            "It is so for equal reversibilities and for graphs without a cycle; else the start has to be tried.",
        ),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counted elsewhere over every state of the tokens.
    #[test]
    fn acyclic_starts_are_counted_as_elsewhere() {
        assert_eq!(triangle([2, 3, 5]), Ok((220, 158)));
        assert_eq!(triangle([1, 2, 3]), Ok((48, 26)));
        assert_eq!(triangle([1, 1, 2]), Ok((14, 4)));
        assert_eq!(triangle([1, 1, 1]), Ok((6, 0)));
    }

    /// With the roles of Table 1 the flexors keep the tripod, and each extensor operates once for five swings.
    #[test]
    fn the_printed_roles_give_the_tripod() {
        let cycle = with_printed_roles().unwrap().cycle().unwrap();
        assert_eq!((cycle.period, cycle.operations[0], cycle.operations[6]), (10, 5, 1));
        let steps: Vec<_> = printed_roles().skip(20).take(2).collect();
        assert_eq!(steps.iter().map(|swings| swings.legs().count()).collect::<Vec<_>>(), [3, 3]);
    }
}
