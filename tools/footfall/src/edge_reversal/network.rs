//! Multiple edge reversal on a graph of any size: the rules of [`cpg_core::edge_reversal::smer`] for numbers of nodes that are known at run time.

use cpg_core::edge_reversal::smer::{MAX_REVERSIBILITY, gcd};

/// An edge between two nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// The nodes, by their numbers.
    pub ends: [usize; 2],
    /// Tokens at each end.
    pub tokens: [u32; 2],
}

/// What is wrong with a graph, with the number of the node or edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// A reversibility out of range.
    #[error("a reversibility is out of range; allowed is 1 to {MAX_REVERSIBILITY}")]
    Reversibility {
        /// The node.
        node: usize,
    },
    /// An edge from a node to itself, or to a node that is not there.
    #[error("an edge from a node to itself; allowed are two different nodes")]
    Ends {
        /// The edge.
        edge: usize,
    },
    /// Two edges between the same nodes.
    #[error("a second edge between these nodes; allowed is one")]
    Twin {
        /// The second edge.
        edge: usize,
        /// The first.
        before: usize,
    },
    /// Tokens that are no state of the edge.
    #[error("tokens that the edge cannot have; allowed are two multiples of {multiple_of} with the sum {sum}")]
    Tokens {
        /// The edge.
        edge: usize,
        /// Tokens that the edge carries, f = r_a + r_b - g.
        sum: u32,
        /// g, the greatest common divisor of both reversibilities.
        multiple_of: u32,
    },
}

/// A graph with its tokens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Network {
    reversibility: Vec<u32>,
    edges: Vec<Edge>,
}

/// Tokens that an edge between nodes of these reversibilities carries: `f = r_a + r_b - g`.
#[must_use]
pub const fn carried(a: u32, b: u32) -> u32 {
    a + b - gcd(a, b)
}

impl Network {
    /// Checks the graph and its tokens; says nothing about liveness.
    ///
    /// # Errors
    /// The first node or edge that breaks a rule.
    pub fn new(reversibility: Vec<u32>, edges: Vec<Edge>) -> Result<Self, NetworkError> {
        if let Some(node) = reversibility.iter().position(|r| !(1..=MAX_REVERSIBILITY).contains(r)) {
            return Err(NetworkError::Reversibility { node });
        }
        let mut seen = std::collections::HashMap::new();
        for (index, Edge { ends: [a, b], tokens }) in edges.iter().enumerate() {
            let (Some(&ra), Some(&rb), false) = (reversibility.get(*a), reversibility.get(*b), a == b) else {
                return Err(NetworkError::Ends { edge: index });
            };
            if let Some(before) = seen.insert((a.min(b), a.max(b)), index) {
                return Err(NetworkError::Twin { edge: index, before });
            }
            let (sum, multiple_of) = (carried(ra, rb), gcd(ra, rb));
            if tokens[0].checked_add(tokens[1]) != Some(sum) || tokens[0] % multiple_of != 0 {
                return Err(NetworkError::Tokens { edge: index, sum, multiple_of });
            }
        }
        Ok(Self { reversibility, edges })
    }

    /// The reversibilities.
    #[must_use]
    pub fn reversibility(&self) -> &[u32] {
        &self.reversibility
    }

    /// The edges with their tokens now.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The end, 0 or 1, to which an edge points: the one that has tokens enough to operate.
    #[must_use]
    pub fn head(&self, edge: &Edge) -> usize {
        usize::from(edge.tokens[0] < self.reversibility[edge.ends[0]])
    }

    /// Whether each node is a sink: every edge of it points to it.
    #[must_use]
    pub fn sinks(&self) -> Vec<bool> {
        let mut sinks = vec![true; self.reversibility.len()];
        for edge in &self.edges {
            sinks[edge.ends[1 - self.head(edge)]] = false;
        }
        sinks
    }

    /// One step: all sinks operate together. Returns which do.
    pub fn step(&mut self) -> Vec<bool> {
        let sinks = self.sinks();
        for edge in &mut self.edges {
            // Neighbours are never sinks together.
            if let Some(end) = edge.ends.iter().position(|&node| sinks[node]) {
                let r = self.reversibility[edge.ends[end]];
                edge.tokens[end] -= r;
                edge.tokens[1 - end] += r;
            }
        }
        sinks
    }

    /// Whether the graph has no cycle, taken without directions.
    #[must_use]
    pub fn is_forest(&self) -> bool {
        self.edges.len() + self.parts().len() == self.reversibility.len()
    }

    /// Whether no cycle is directed.
    #[must_use]
    pub fn is_acyclic(&self) -> bool {
        let mut left = vec![true; self.reversibility.len()];
        loop {
            // Nodes that point to none that is left.
            let mut ends = left.clone();
            for edge in self.edges.iter().filter(|edge| edge.ends.iter().all(|&node| left[node])) {
                ends[edge.ends[1 - self.head(edge)]] = false;
            }
            if !ends.contains(&true) {
                return !left.contains(&true);
            }
            left.iter_mut().zip(ends).for_each(|(left, ends)| *left &= !ends);
        }
    }

    /// A directed cycle: each node points to the next, the last to the first, and so waits for it. `None` if there is none where the search
    /// begins: it always finds one if no node is a sink.
    #[must_use]
    pub fn directed_cycle(&self) -> Option<Vec<usize>> {
        let mut path = vec![0];
        loop {
            let last = *path.last()?;
            let edge = self.edges.iter().find(|edge| edge.ends[1 - self.head(edge)] == last)?;
            let next = edge.ends[self.head(edge)];
            if let Some(start) = path.iter().position(|&node| node == next) {
                return Some(path.split_off(start));
            }
            path.push(next);
        }
    }

    /// The nodes of each connected part, rising; the parts in the order of their first nodes.
    #[must_use]
    pub fn parts(&self) -> Vec<Vec<usize>> {
        let mut neighbours = vec![vec![]; self.reversibility.len()];
        for Edge { ends: [a, b], .. } in &self.edges {
            neighbours[*a].push(*b);
            neighbours[*b].push(*a);
        }
        let mut seen = vec![false; neighbours.len()];
        let mut parts = vec![];
        for start in 0..neighbours.len() {
            let (mut part, mut next) = (vec![], vec![start]);
            while let Some(node) = next.pop() {
                if !std::mem::replace(&mut seen[node], true) {
                    part.push(node);
                    next.extend(&neighbours[node]);
                }
            }
            part.sort_unstable();
            parts.extend((!part.is_empty()).then_some(part));
        }
        parts
    }

    /// The part of the graph between these nodes, numbered in their order.
    #[must_use]
    pub fn between(&self, nodes: &[usize]) -> Self {
        let number = |node: usize| nodes.iter().position(|&other| other == node);
        let inner = self.edges.iter().filter_map(|edge| {
            let [a, b] = edge.ends.map(number);
            Some(Edge { ends: [a?, b?], tokens: edge.tokens })
        });
        Self { reversibility: nodes.iter().map(|&node| self.reversibility[node]).collect(), edges: inner.collect() }
    }
}
