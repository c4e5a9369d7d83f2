//! Scheduling by multiple edge reversal (SMER), in integers only: the discrete dynamics behind the oscillatory building blocks.
//!
//! Nodes i have a reversibility r_i. Edge (i, j) carries `f = r_i + r_j - g` tokens, `g = gcd(r_i, r_j)`; each token lies at one end,
//! so `x_ij + x_ji = f`, and x is a multiple of g. Node i is a **sink** if and only if `x_ij >= r_i` on each of its edges. In one step all sinks
//! fire together: each gives r_i of its tokens to the other end of each of its edges.
//!
//! On one edge exactly one end can fire in every state (`x_i >= r_i` xor `x_j >= r_j`), so neighbours never fire together and two
//! nodes never deadlock. On a graph:
//! - a forest is always live;
//! - with equal reversibilities a start is live if and only if its orientation (each edge points to the end that may fire) has no cycle;
//! - with unequal reversibilities on a cycle neither rule suffices: [`Smer::new`] then runs to the repeated state.
//!
//! The integers do not drift: after ten million steps the state is still that of the period. The tokens at the heads of a directed cycle are
//! conserved ([`Smer::circulation`]): a firing node takes as many from the edge that enters it as it gives to the edge that leaves it.
//!
//! Source: Barbosa and Gafni's edge reversal as used by Yang et al. 2014, IOP Conf. Ser. Mater. Sci. Eng. 65 012008, section 2. The
//! paper's stalls at sgn(0) and its floating-point drift do not occur here.

/// Largest reversibility: every token count stays far from overflow.
pub const MAX_REVERSIBILITY: u32 = 1_000_000;

/// Largest number of steps of the proof of liveness.
pub const PROOF_STEPS: u32 = 1_000_000;

/// The nodes that fired in one step: bit n for node n.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Fired(pub u32);

impl Fired {
    /// Whether node `n` fired.
    #[must_use]
    pub const fn contains(self, n: usize) -> bool {
        n < 32 && self.0 >> n & 1 == 1
    }
}

/// One coupling: the two nodes, and the tokens that lie at the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// First end.
    pub a: u8,
    /// Second end.
    pub b: u8,
    /// Tokens at `a`; the rest of f lies at `b`.
    pub tokens_at_a: u32,
}

/// Why a graph was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SmerError {
    /// More than 32 nodes, or none.
    NodeCount,
    /// Reversibility of this node is 0 or above [`MAX_REVERSIBILITY`].
    Reversibility {
        /// The node.
        node: usize,
    },
    /// This edge names a node that does not exist, joins a node to itself, or repeats another edge.
    Edge {
        /// The edge.
        edge: usize,
    },
    /// The tokens of this edge are more than f or no multiple of g.
    Tokens {
        /// The edge.
        edge: usize,
        /// f, the number of tokens that the edge carries.
        carries: u32,
        /// g, of which the count must be a multiple.
        multiple_of: u32,
    },
    /// No node can fire any more after this many steps.
    Deadlock {
        /// Steps until nothing moved.
        step: u32,
    },
    /// This node never fires again, while nodes without a path to it go on.
    NodeStops {
        /// The first such node.
        node: usize,
    },
    /// Neither a repeated state nor a deadlock was found within [`PROOF_STEPS`].
    Undecided,
}

impl core::fmt::Display for SmerError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            SmerError::NodeCount => write!(f, "nodes: 1 to 32 are allowed"),
            SmerError::Reversibility { node } => {
                write!(f, "reversibility of node {node}: 1 to {MAX_REVERSIBILITY} is allowed")
            }
            SmerError::Edge { edge } => {
                write!(f, "edge {edge}: two different existing nodes are allowed, each pair once")
            }
            SmerError::Tokens { edge, carries, multiple_of } => {
                write!(f, "tokens of edge {edge}: multiples of {multiple_of} from 0 to {carries} are allowed")
            }
            SmerError::Deadlock { step } => write!(f, "start: deadlock after {step} steps, no node may fire"),
            SmerError::NodeStops { node } => write!(f, "start: node {node} stops for ever, while others go on"),
            SmerError::Undecided => write!(f, "start: no repeated state was found within {PROOF_STEPS} steps"),
        }
    }
}

impl core::error::Error for SmerError {}

/// The cycle into which a start leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle<const N: usize> {
    /// Steps before the cycle is entered.
    pub transient: u32,
    /// Steps of one period.
    pub period: u32,
    /// How often each node fires in a period: `L / r_i`, L a common multiple of the reversibilities.
    pub operations: [u32; N],
}

/// A graph of N nodes and E edges with its tokens.
///
/// ```
/// use cpg_core::edge_reversal::smer::{Edge, Smer};
/// // Two half-centres, reversibilities 2 and 3: the Christoffel word iijij.
/// let mut pair = Smer::new([2, 3], [Edge { a: 0, b: 1, tokens_at_a: 4 }])?;
/// let word: [char; 10] = core::array::from_fn(|_| if pair.step().contains(0) { 'i' } else { 'j' });
/// assert_eq!(word.iter().collect::<String>(), "iijijiijij");
/// assert_eq!(pair.cycle()?.operations, [3, 2]);
/// # Ok::<(), cpg_core::edge_reversal::smer::SmerError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Smer<const N: usize, const E: usize> {
    reversibility: [u32; N],
    edges: [Edge; E],
    /// f of each edge.
    carries: [u32; E],
}

impl<const N: usize, const E: usize> Smer<N, E> {
    /// Checks the graph, its tokens, and that the start stays live.
    ///
    /// # Errors
    /// The first node or edge that breaks a rule; [`SmerError::Deadlock`] if the start ends in a deadlock, [`SmerError::NodeStops`] if a part
    /// of the graph that is not connected to the rest does.
    pub fn new(reversibility: [u32; N], edges: [Edge; E]) -> Result<Self, SmerError> {
        let smer = Self::unproven(reversibility, edges)?;
        if smer.is_forest() {
            return Ok(smer);
        }
        let is_uniform = reversibility.iter().all(|&r| Some(&r) == reversibility.first());
        if is_uniform && smer.is_acyclic() {
            return Ok(smer);
        }
        match smer.cycle()?.operations.iter().position(|&count| count == 0) {
            Some(node) => Err(SmerError::NodeStops { node }),
            None => Ok(smer),
        }
    }

    /// Like [`Smer::new`] without the proof of liveness: to study starts that end in a deadlock.
    ///
    /// # Errors
    /// The first node or edge that breaks a rule.
    pub fn unproven(reversibility: [u32; N], edges: [Edge; E]) -> Result<Self, SmerError> {
        if N == 0 || N > 32 {
            return Err(SmerError::NodeCount);
        }
        if let Some(node) = reversibility.iter().position(|&r| r == 0 || r > MAX_REVERSIBILITY) {
            return Err(SmerError::Reversibility { node });
        }
        let mut carries = [0; E];
        for (index, (edge, carries)) in edges.iter().zip(&mut carries).enumerate() {
            let ends = (reversibility.get(usize::from(edge.a)), reversibility.get(usize::from(edge.b)));
            let twin = edges
                .iter()
                .take(index)
                .any(|other| (other.a, other.b) == (edge.a, edge.b) || (other.b, other.a) == (edge.a, edge.b));
            let (Some(&ra), Some(&rb), false, true) = (ends.0, ends.1, twin, edge.a != edge.b) else {
                return Err(SmerError::Edge { edge: index });
            };
            let g = gcd(ra, rb);
            *carries = ra.saturating_add(rb).saturating_sub(g);
            if edge.tokens_at_a > *carries || !is_multiple(edge.tokens_at_a, g) {
                return Err(SmerError::Tokens { edge: index, carries: *carries, multiple_of: g });
            }
        }
        Ok(Self { reversibility, edges, carries })
    }

    /// One step: all sinks fire together.
    pub fn step(&mut self) -> Fired {
        let sinks = self.sinks();
        for (edge, &carries) in self.edges.iter_mut().zip(&self.carries) {
            // At most one end fires: each could only with more tokens than the edge carries.
            if sinks.contains(usize::from(edge.a)) {
                let r = self.reversibility.get(usize::from(edge.a)).copied().unwrap_or(0);
                edge.tokens_at_a = edge.tokens_at_a.saturating_sub(r);
            } else if sinks.contains(usize::from(edge.b)) {
                let r = self.reversibility.get(usize::from(edge.b)).copied().unwrap_or(0);
                edge.tokens_at_a = edge.tokens_at_a.saturating_add(r).min(carries);
            }
        }
        sinks
    }

    /// The nodes that will fire in the next step.
    #[must_use]
    pub fn sinks(&self) -> Fired {
        let mut sinks = all_nodes(N);
        for (edge, &carries) in self.edges.iter().zip(&self.carries) {
            let enabled =
                |node: u8, tokens: u32| self.reversibility.get(usize::from(node)).is_some_and(|&r| tokens >= r);
            if !enabled(edge.a, edge.tokens_at_a) {
                sinks &= !bit(edge.a);
            }
            if !enabled(edge.b, carries.saturating_sub(edge.tokens_at_a)) {
                sinks &= !bit(edge.b);
            }
        }
        Fired(sinks)
    }

    /// The edges with their tokens now.
    #[must_use]
    pub fn edges(&self) -> &[Edge; E] {
        &self.edges
    }

    /// The reversibilities.
    #[must_use]
    pub fn reversibility(&self) -> &[u32; N] {
        &self.reversibility
    }

    /// Whether the graph has no cycle (edges taken both ways): such a graph is live from every start.
    #[must_use]
    pub fn is_forest(&self) -> bool {
        // Remove leaves repeatedly: a forest becomes empty.
        let mut left = all_nodes(N);
        loop {
            let mut leaves = 0;
            for node in 0..N as u8 {
                let degree = self
                    .edges
                    .iter()
                    .filter(|e| (e.a == node || e.b == node) && left & bit(e.a) != 0 && left & bit(e.b) != 0)
                    .count();
                if left & bit(node) != 0 && degree <= 1 {
                    leaves |= bit(node);
                    // One node at a time, because the two ends of the last edge are leaves of each other.
                    break;
                }
            }
            if leaves == 0 {
                return left == 0;
            }
            left &= !leaves;
        }
    }

    /// Whether the orientation (each edge points to the end that may fire) has no directed cycle.
    #[must_use]
    pub fn is_acyclic(&self) -> bool {
        self.is_acyclic_among(all_nodes(N))
    }

    /// [`Smer::is_acyclic`] for the part of the graph between these nodes (bit n for node n).
    #[must_use]
    pub fn is_acyclic_among(&self, nodes: u32) -> bool {
        let mut left = nodes & all_nodes(N);
        loop {
            // Nodes that no remaining edge leaves.
            let mut ends = left;
            for edge in &self.edges {
                if left & bit(edge.a) == 0 || left & bit(edge.b) == 0 {
                    continue;
                }
                let points_to_a = self.reversibility.get(usize::from(edge.a)).is_some_and(|&r| edge.tokens_at_a >= r);
                ends &= !bit(if points_to_a { edge.b } else { edge.a });
            }
            if ends == 0 {
                return left == 0;
            }
            left &= !ends;
        }
    }

    /// Runs a copy until a state is repeated: transient, period and number of firings of each node in a period.
    ///
    /// # Errors
    /// [`SmerError::Deadlock`] if nothing moves any more, [`SmerError::Undecided`] after [`PROOF_STEPS`].
    pub fn cycle(&self) -> Result<Cycle<N>, SmerError> {
        // Brent's cycle search needs no list of visited states.
        let mut power: u32 = 1;
        let mut period: u32 = 1;
        let mut tortoise = self.clone();
        let mut hare = self.clone();
        let mut steps: u32 = 1;
        if hare.step().0 == 0 {
            return Err(SmerError::Deadlock { step: 0 });
        }
        while tortoise.edges != hare.edges {
            if power == period {
                tortoise.edges = hare.edges;
                power = power.saturating_mul(2);
                period = 0;
            }
            if hare.step().0 == 0 {
                return Err(SmerError::Deadlock { step: steps });
            }
            period = period.saturating_add(1);
            steps = steps.saturating_add(1);
            if steps > PROOF_STEPS {
                return Err(SmerError::Undecided);
            }
        }
        let mut operations = [0u32; N];
        for _ in 0..period {
            let fired = hare.step();
            for (node, count) in operations.iter_mut().enumerate() {
                *count = count.saturating_add(u32::from(fired.contains(node)));
            }
        }
        let mut start = self.clone();
        let mut ahead = self.clone();
        for _ in 0..period {
            ahead.step();
        }
        let mut transient: u32 = 0;
        while start.edges != ahead.edges {
            start.step();
            ahead.step();
            transient = transient.saturating_add(1);
        }
        Ok(Cycle { transient, period, operations })
    }

    /// Tokens at the heads of the edges of a directed cycle of nodes, less those at the tails: conserved by every step.
    /// `None` if two neighbours of the cycle share no edge.
    #[must_use]
    pub fn circulation(&self, cycle: &[u8]) -> Option<i64> {
        let (&last, mut sum) = (cycle.last()?, 0i64);
        let mut tail = last;
        for &head in cycle {
            let (edge, carries) = self
                .edges
                .iter()
                .zip(&self.carries)
                .find(|(e, _)| (e.a, e.b) == (tail, head) || (e.b, e.a) == (tail, head))?;
            let at_a = i64::from(edge.tokens_at_a);
            let at_b = i64::from(carries.saturating_sub(edge.tokens_at_a));
            let net = if edge.a == head { at_a.saturating_sub(at_b) } else { at_b.saturating_sub(at_a) };
            sum = sum.saturating_add(net);
            tail = head;
        }
        Some(sum)
    }
}

const fn bit(node: u8) -> u32 {
    if node < 32 { 1 << node } else { 0 }
}

const fn all_nodes(n: usize) -> u32 {
    if n >= 32 { u32::MAX } else { (1 << n) - 1 }
}

/// Greatest common divisor, by Euclid; that of 0 and x is x.
#[must_use]
pub const fn gcd(mut a: u32, mut b: u32) -> u32 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

const fn is_multiple(x: u32, g: u32) -> bool {
    match x.checked_rem(g) {
        Some(rest) => rest == 0,
        None => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every assignment of tokens to the edges of a graph.
    fn all_starts<const N: usize, const E: usize>(r: [u32; N], ends: [(u8, u8); E]) -> Vec<[Edge; E]> {
        let mut starts = vec![[Edge { a: 0, b: 0, tokens_at_a: 0 }; E]];
        for (i, (a, b)) in ends.into_iter().enumerate() {
            let (ra, rb) = (r[a as usize], r[b as usize]);
            let g = gcd(ra, rb);
            let counts = (0..=(ra + rb - g)).step_by(g as usize);
            starts = counts
                .flat_map(|tokens_at_a| {
                    starts.iter().map(move |s| {
                        let mut s = *s;
                        s[i] = Edge { a, b, tokens_at_a };
                        s
                    })
                })
                .collect();
        }
        starts
    }

    struct Census {
        live: usize,
        dead: usize,
        acyclic: usize,
        acyclic_dead: usize,
        /// (period, operations) of the live starts.
        cycles: Vec<(u32, Vec<u32>)>,
    }

    fn census<const N: usize, const E: usize>(r: [u32; N], ends: [(u8, u8); E]) -> Census {
        let mut census = Census { live: 0, dead: 0, acyclic: 0, acyclic_dead: 0, cycles: vec![] };
        for start in all_starts(r, ends) {
            let smer = Smer::unproven(r, start).unwrap();
            let acyclic = smer.is_acyclic();
            census.acyclic += usize::from(acyclic);
            match smer.cycle() {
                Ok(cycle) => {
                    census.live += 1;
                    census.cycles.push((cycle.period, cycle.operations.to_vec()));
                    assert!(Smer::new(r, start).is_ok());
                }
                Err(SmerError::Deadlock { .. }) => {
                    census.dead += 1;
                    census.acyclic_dead += usize::from(acyclic);
                    assert!(matches!(Smer::new(r, start), Err(SmerError::Deadlock { .. })));
                }
                Err(other) => panic!("{other}"),
            }
        }
        census
    }

    const EDGE: [(u8, u8); 1] = [(0, 1)];
    const PATH: [(u8, u8); 2] = [(0, 1), (1, 2)];
    const TRIANGLE: [(u8, u8); 3] = [(0, 1), (1, 2), (2, 0)];
    const RING4: [(u8, u8); 4] = [(0, 1), (1, 2), (2, 3), (3, 0)];
    const RING5: [(u8, u8); 5] = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)];
    const K4: [(u8, u8); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

    fn numbers(c: &Census) -> [usize; 4] {
        [c.live, c.dead, c.acyclic, c.acyclic_dead]
    }

    #[test]
    fn census_of_small_graphs_over_all_starts() {
        let c = census([1, 3], EDGE);
        assert_eq!(numbers(&c), [4, 0, 4, 0]);
        assert!(c.cycles.iter().all(|x| *x == (4, vec![3, 1])));
        let c = census([2, 3], EDGE);
        assert_eq!(numbers(&c), [5, 0, 5, 0]);
        assert!(c.cycles.iter().all(|x| *x == (5, vec![3, 2])));
        let c = census([1, 2, 3], PATH);
        assert_eq!(numbers(&c), [15, 0, 15, 0]);
        assert!(c.cycles.iter().all(|x| *x == (9, vec![6, 3, 2])));
        let c = census([1, 1, 1], TRIANGLE);
        assert_eq!(numbers(&c), [6, 2, 6, 0]);
        assert!(c.cycles.iter().all(|x| *x == (3, vec![1, 1, 1])));
        let c = census([1, 1, 2], TRIANGLE);
        assert_eq!(numbers(&c), [10, 8, 14, 4]);
        assert!(c.cycles.iter().all(|x| *x == (5, vec![2, 2, 1])));
        let c = census([1, 2, 3], TRIANGLE);
        assert_eq!(numbers(&c), [22, 38, 48, 26]);
        assert!(c.cycles.iter().all(|x| *x == (11, vec![6, 3, 2])));
        let c = census([2, 3, 5], TRIANGLE);
        assert_eq!(numbers(&c), [62, 218, 220, 158]);
        assert!(c.cycles.iter().all(|x| *x == (31, vec![15, 10, 6])));
        let c = census([1; 4], RING4);
        assert_eq!(numbers(&c), [14, 2, 14, 0]);
        assert_eq!(c.cycles.iter().filter(|x| x.0 == 2).count(), 6);
        assert_eq!(c.cycles.iter().filter(|x| x.0 == 4).count(), 8);
        let c = census([1; 5], RING5);
        assert_eq!(numbers(&c), [30, 2, 30, 0]);
        assert_eq!(c.cycles.iter().filter(|x| x.1 == vec![1; 5]).count(), 10);
        assert_eq!(c.cycles.iter().filter(|x| x.1 == vec![2; 5]).count(), 20);
        let c = census([1, 2, 1, 2], RING4);
        assert_eq!(numbers(&c), [63, 18, 73, 10]);
        assert!(c.cycles.iter().all(|x| (3..=6).contains(&x.0)));
        let c = census([1; 4], K4);
        assert_eq!(numbers(&c), [24, 40, 24, 0]);
        assert!(c.cycles.iter().all(|x| x.0 == 4));
    }

    #[test]
    fn operations_are_a_common_multiple_over_the_reversibility() {
        for start in all_starts([2, 3, 5], TRIANGLE) {
            if let Ok(smer) = Smer::new([2, 3, 5], start) {
                let ops = smer.cycle().unwrap().operations;
                assert!(ops[0] * 2 == ops[1] * 3 && ops[1] * 3 == ops[2] * 5, "{ops:?}");
            }
        }
    }

    #[test]
    fn neighbours_never_fire_together_and_circulation_is_conserved() {
        for start in all_starts([2, 3, 5], TRIANGLE) {
            let mut smer = Smer::unproven([2, 3, 5], start).unwrap();
            let circulation = smer.circulation(&[0, 1, 2]).unwrap();
            for _ in 0..100 {
                let fired = smer.step();
                assert!(fired.0.count_ones() <= 1, "all three are neighbours");
                assert_eq!(smer.circulation(&[0, 1, 2]), Some(circulation));
            }
        }
        assert_eq!(Smer::unproven([1; 3], all_starts([1; 3], TRIANGLE)[0]).unwrap().circulation(&[0, 0]), None);
    }

    #[test]
    fn ten_million_steps_end_where_the_period_says() {
        let start = Smer::new([77, 463], [Edge { a: 0, b: 1, tokens_at_a: 500 }]).unwrap();
        let cycle = start.cycle().unwrap();
        assert_eq!((cycle.period, cycle.operations), (540, [463, 77]));
        let mut long = start.clone();
        for _ in 0..10_000_000 {
            long.step();
        }
        let mut short = start;
        for _ in 0..10_000_000 % 540 {
            short.step();
        }
        assert_eq!(long, short);
    }

    /// A triangle whose orientation is a cycle, beside an edge that goes on: live as a whole it would seem.
    #[test]
    fn a_part_that_stops_is_dead() {
        let edges = [(0, 1, 0), (1, 2, 0), (2, 0, 0), (3, 4, 0)].map(|(a, b, tokens_at_a)| Edge { a, b, tokens_at_a });
        for reversibility in [[1, 1, 1, 1, 1], [1, 1, 1, 1, 2]] {
            assert_eq!(Smer::new(reversibility, edges), Err(SmerError::NodeStops { node: 0 }), "{reversibility:?}");
        }
    }

    #[test]
    fn bad_graphs_are_refused_by_name() {
        let e = |a, b, tokens_at_a| Edge { a, b, tokens_at_a };
        assert_eq!(Smer::new([0, 1], [e(0, 1, 0)]), Err(SmerError::Reversibility { node: 0 }));
        assert_eq!(Smer::new([1, MAX_REVERSIBILITY + 1], [e(0, 1, 0)]), Err(SmerError::Reversibility { node: 1 }));
        for bad in [e(0, 0, 0), e(0, 2, 0), e(1, 0, 0)] {
            assert_eq!(Smer::new([1, 1], [e(0, 1, 0), bad]), Err(SmerError::Edge { edge: 1 }), "{bad:?}");
        }
        let tokens = SmerError::Tokens { edge: 0, carries: 4, multiple_of: 2 };
        assert_eq!(Smer::new([2, 4], [e(0, 1, 3)]), Err(tokens));
        assert_eq!(Smer::new([2, 4], [e(0, 1, 6)]), Err(tokens));
        assert_eq!(Smer::new([] as [u32; 0], []), Err(SmerError::NodeCount));
        assert_eq!(Smer::new([1; 3], [e(0, 1, 0), e(1, 2, 0), e(2, 0, 0)]), Err(SmerError::Deadlock { step: 0 }));
        assert!(tokens.to_string().contains("multiples of 2 from 0 to 4"));
    }
}
