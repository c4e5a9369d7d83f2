//! Networks of any size against the core's, against a published formula and against the numbers of small graphs.

use cpg_core::edge_reversal::smer::{Edge as CoreEdge, Smer, SmerError, gcd};
use footfall::edge_reversal::liveness::{Part, Reason, Verdict, judge};
use footfall::edge_reversal::network::{Edge, Network, NetworkError, carried};

const PATH: [(u8, u8); 2] = [(0, 1), (1, 2)];
const TRIANGLE: [(u8, u8); 3] = [(0, 1), (1, 2), (2, 0)];
const RING4: [(u8, u8); 4] = [(0, 1), (1, 2), (2, 3), (3, 0)];
const RING5: [(u8, u8); 5] = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)];
const K4: [(u8, u8); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

/// The edges of a graph, by the numbers of the nodes.
type Ends<'a> = &'a [(u8, u8)];

/// Every assignment of tokens to the edges: the tokens at the first ends.
fn all_starts(r: &[u32], ends: &[(u8, u8)]) -> Vec<Vec<u32>> {
    ends.iter().fold(vec![vec![]], |starts, &(a, b)| {
        let (a, b) = (r[usize::from(a)], r[usize::from(b)]);
        let counts: Vec<u32> = (0..=carried(a, b)).step_by(gcd(a, b) as usize).collect();
        starts.iter().flat_map(|start| counts.iter().map(|&count| [start.as_slice(), &[count]].concat())).collect()
    })
}

fn network(r: &[u32], ends: &[(u8, u8)], tokens: &[u32]) -> Network {
    let edge = |(&(a, b), &at_a): (&(u8, u8), &u32)| {
        let ends = [a, b].map(usize::from);
        Edge { ends, tokens: [at_a, carried(r[ends[0]], r[ends[1]]) - at_a] }
    };
    Network::new(r.to_vec(), ends.iter().zip(tokens).map(edge).collect()).unwrap()
}

/// The only part of a connected graph.
fn verdict(network: &Network) -> Verdict {
    let mut parts = judge(network, 100_000);
    assert_eq!(parts.len(), 1);
    parts.remove(0).verdict
}

/// Runs every start of a graph here and in the core: same sinks at every step, same verdict, same cycle. Returns how many live and how many stop.
fn compare<const N: usize, const E: usize>(r: [u32; N], ends: [(u8, u8); E]) -> (usize, usize) {
    let (mut live, mut dead) = (0, 0);
    for tokens in all_starts(&r, &ends) {
        let edges: [_; E] = std::array::from_fn(|e| CoreEdge { a: ends[e].0, b: ends[e].1, tokens_at_a: tokens[e] });
        let (mut core, mut here) = (Smer::unproven(r, edges).unwrap(), network(&r, &ends, &tokens));
        let start = here.clone();
        assert_eq!((core.is_forest(), core.is_acyclic()), (here.is_forest(), here.is_acyclic()), "{r:?} {tokens:?}");
        match (core.cycle(), verdict(&here)) {
            (Ok(cycle), Verdict::Live { cycle: Some(found), .. }) => {
                live += 1;
                assert_eq!((found.transient, found.period), (cycle.transient.into(), cycle.period.into()));
                assert_eq!(found.operations, cycle.operations.map(u64::from), "{r:?} {tokens:?}");
                // L / r of a common multiple L: all products are the same.
                let products: Vec<u64> = found.operations.iter().zip(r).map(|(n, r)| n * u64::from(r)).collect();
                assert!(products.iter().all(|product| *product == products[0] && *product > 0), "{products:?}");
            }
            (Err(SmerError::Deadlock { step }), Verdict::Dead { stops_after, waiting }) => {
                dead += 1;
                assert_eq!(u64::from(step), stops_after, "{r:?} {tokens:?}");
                let mut stopped = start.clone();
                (0..stops_after).for_each(|_| drop(stopped.step()));
                for (&from, &to) in waiting.iter().zip(waiting.iter().cycle().skip(1)) {
                    let is_waiting = |edge: &&Edge| {
                        let head = stopped.head(edge);
                        (edge.ends[1 - head], edge.ends[head]) == (from, to)
                    };
                    assert!(stopped.edges().iter().any(|edge| is_waiting(&edge)), "{r:?} {tokens:?}: {waiting:?}");
                }
            }
            (core, here) => panic!("{r:?} {tokens:?}: {core:?} and {here:?}"),
        }
        for step in 0..60 {
            let (fired, sinks) = (core.step(), here.step());
            assert!((0..N).all(|node| fired.contains(node) == sinks[node]), "{r:?} {tokens:?} step {step}");
        }
        assert!(core.edges().iter().zip(here.edges()).all(|(a, b)| a.tokens_at_a == b.tokens[0]));
    }
    (live, dead)
}

/// All starts of the small graphs of Barbosa's and Yang's papers: live, dead.
#[test]
fn every_start_of_small_graphs_agrees_with_the_core() {
    assert_eq!(compare([1, 3], [(0, 1)]), (4, 0));
    assert_eq!(compare([1, 2, 3], PATH), (15, 0));
    assert_eq!(compare([1, 1, 1], TRIANGLE), (6, 2));
    assert_eq!(compare([1, 1, 2], TRIANGLE), (10, 8));
    assert_eq!(compare([1, 2, 3], TRIANGLE), (22, 38));
    assert_eq!(compare([2, 3, 5], TRIANGLE), (62, 218));
    assert_eq!(compare([4, 6, 10], TRIANGLE), (62, 218));
    assert_eq!(compare([1, 2, 1, 2], RING4), (63, 18));
    assert_eq!(compare([1; 4], RING4), (14, 2));
    assert_eq!(compare([1; 5], RING5), (30, 2));
    assert_eq!(compare([1; 4], K4), (24, 40));
}

/// Barbosa and Gafni 1989: with equal reversibilities each node operates in a share of the steps that is the least, over all cycles, of the
/// edges that point one way over all edges, and 1/2 without a cycle.
#[test]
fn concurrency_is_that_of_barbosa_and_gafni() {
    let two_by_three = [(0, 1), (1, 2), (3, 4), (4, 5), (0, 3), (1, 4), (2, 5)];
    let graphs: [(Ends<'_>, &[&[usize]]); 5] = [
        (&PATH, &[]),
        (&TRIANGLE, &[&[0, 1, 2]]),
        (&RING5, &[&[0, 1, 2, 3, 4]]),
        (&K4, &[&[0, 1, 2], &[0, 1, 3], &[0, 2, 3], &[1, 2, 3], &[0, 1, 2, 3], &[0, 1, 3, 2], &[0, 2, 1, 3]]),
        (&two_by_three, &[&[0, 1, 4, 3], &[1, 2, 5, 4], &[0, 1, 2, 5, 4, 3]]),
    ];
    for (ends, cycles) in graphs {
        let nodes = usize::from(ends.iter().map(|&(a, b)| a.max(b)).max().unwrap()) + 1;
        for tokens in all_starts(&vec![1; nodes], ends) {
            let network = network(&vec![1; nodes], ends, &tokens);
            let share = cycles.iter().map(|cycle| {
                let steps = cycle.iter().zip(cycle.iter().cycle().skip(1));
                let along = steps.filter(|&(&from, &to)| {
                    network.edges().iter().any(|edge| {
                        let head = network.head(edge);
                        (edge.ends[1 - head], edge.ends[head]) == (from, to)
                    })
                });
                let along = along.count();
                along.min(cycle.len() - along) as f64 / cycle.len() as f64
            });
            let share = share.fold(0.5, f64::min);
            match verdict(&network) {
                Verdict::Live { reason, cycle: Some(cycle) } => {
                    let of_all = cycle.concurrency() / nodes as f64;
                    assert!((of_all - share).abs() < 1e-12, "{ends:?} {tokens:?}: {of_all}, not {share}");
                    assert_eq!(reason, if cycles.is_empty() { Reason::Forest } else { Reason::Acyclic });
                }
                Verdict::Dead { .. } => assert_eq!(share, 0.0, "{ends:?} {tokens:?}"),
                other => panic!("{ends:?} {tokens:?}: {other:?}"),
            }
        }
    }
}

/// A part that stops is found beside parts that go on, and nodes keep their numbers.
#[test]
fn parts_are_judged_apart() {
    let ends = [(4, 0), (1, 2), (2, 3), (3, 1)];
    // The triangle 1 2 3 is a directed cycle; 5 is alone.
    let parts = judge(&network(&[1, 1, 1, 1, 2, 7], &ends, &[0, 0, 0, 0]), 1000);
    let nodes: Vec<&[usize]> = parts.iter().map(|part| part.nodes.as_slice()).collect();
    assert_eq!(nodes, [&[0, 4][..], &[1, 2, 3], &[5]]);
    assert_eq!(parts[1].verdict, Verdict::Dead { stops_after: 0, waiting: vec![1, 2, 3] });
    let operations = |part: &Part| match &part.verdict {
        Verdict::Live { cycle: Some(cycle), .. } => (cycle.period, cycle.operations.clone()),
        other => panic!("{other:?}"),
    };
    assert_eq!(operations(&parts[0]), (3, vec![2, 1]));
    assert_eq!(operations(&parts[2]), (1, vec![1]));
}

/// A period longer than the search: a forest is live nevertheless, a graph with a cycle undecided, and neither takes long.
#[test]
fn a_search_that_ends_says_so() {
    let path = network(&[999_983, 999_979, 999_961], &PATH, &[0, 0]);
    assert_eq!(verdict(&path), Verdict::Live { reason: Reason::Forest, cycle: None });
    let mut is_undecided = false;
    for start in 0..50 {
        let tokens = [40_000 * start, 1_000_000, 700_000 + start];
        is_undecided |= verdict(&network(&[999_983, 999_979, 999_961], &TRIANGLE, &tokens)) == Verdict::Undecided;
    }
    assert!(is_undecided);
}

#[test]
fn bad_networks_are_refused() {
    let edge = |ends, tokens| Edge { ends, tokens };
    let refused = |r: [u32; 2], edges: Vec<Edge>| Network::new(r.to_vec(), edges).unwrap_err();
    assert_eq!(refused([1, 0], vec![]), NetworkError::Reversibility { node: 1 });
    assert_eq!(refused([1, 1_000_001], vec![]), NetworkError::Reversibility { node: 1 });
    for ends in [[0, 0], [0, 2]] {
        assert_eq!(refused([1, 1], vec![edge(ends, [0, 1])]), NetworkError::Ends { edge: 0 });
    }
    let twice = vec![edge([0, 1], [0, 1]), edge([1, 0], [0, 1])];
    assert_eq!(refused([1, 1], twice), NetworkError::Twin { edge: 1, before: 0 });
    for tokens in [[1, 3], [2, 4], [u32::MAX, 5]] {
        let wrong = NetworkError::Tokens { edge: 0, sum: 4, multiple_of: 2 };
        assert_eq!(refused([2, 4], vec![edge([0, 1], tokens)]), wrong, "{tokens:?}");
    }
}
