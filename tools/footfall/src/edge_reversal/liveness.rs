//! Whether the connected parts of a network live: by theorem, or by running to a repeated state or to the stop.
//!
//! A part goes on as a whole or stops as a whole: the neighbours of a node that stops give it tokens that never come back, and so they stop.

use crate::edge_reversal::network::Network;

/// Why a part lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It has no cycle: every start of such a graph lives.
    Forest,
    /// All reversibilities are equal and no cycle is directed.
    Acyclic,
    /// A repeated state was found.
    Repeats,
}

/// The repeated steps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cycle {
    /// Steps before the first state that comes back.
    pub transient: u64,
    /// Steps until it comes back.
    pub period: u64,
    /// How often each node operates in a period.
    pub operations: Vec<u64>,
}

impl Cycle {
    /// Concurrency: the mean number of nodes that operate in a step.
    #[must_use]
    pub fn concurrency(&self) -> f64 {
        self.operations.iter().sum::<u64>() as f64 / self.period as f64
    }
}

/// What was found out about a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// Every node operates again and again.
    Live {
        /// Why.
        reason: Reason,
        /// The cycle; `None` if no repeated state was found within the steps that were looked at.
        cycle: Option<Cycle>,
    },
    /// No node operates any more.
    Dead {
        /// Steps until then.
        stops_after: u64,
        /// Nodes of which each waits for the next, the last for the first.
        waiting: Vec<usize>,
    },
    /// Within the steps that were looked at no repeated state was found, and it did not stop. A state may have come back: it is found
    /// within three times the longer of transient and period.
    Undecided,
}

/// A connected part of a network and what was found out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its nodes, by their numbers in the whole network, rising. `operations` are in this order, `waiting` has numbers of the whole network.
    pub nodes: Vec<usize>,
    /// What was found out.
    pub verdict: Verdict,
}

/// Judges each part; looks at no more than so many steps of each before it ends the search for a repeated state.
#[must_use]
pub fn judge(network: &Network, most_steps: u64) -> Vec<Part> {
    let parts = network.parts().into_iter();
    parts.map(|nodes| Part { verdict: judge_part(&network.between(&nodes), &nodes, most_steps), nodes }).collect()
}

fn judge_part(part: &Network, nodes: &[usize], most_steps: u64) -> Verdict {
    let is_uniform = part.reversibility().windows(2).all(|pair| pair[0] == pair[1]);
    let theorem = match (part.is_forest(), is_uniform && part.is_acyclic()) {
        (true, _) => Some(Reason::Forest),
        (false, true) => Some(Reason::Acyclic),
        (false, false) => None,
    };
    match (search(part, most_steps), theorem) {
        (Search::Cycle(cycle), _) => Verdict::Live { reason: theorem.unwrap_or(Reason::Repeats), cycle: Some(cycle) },
        (Search::Stop { after, state }, _) => {
            let waiting = state.directed_cycle().unwrap_or_default();
            Verdict::Dead { stops_after: after, waiting: waiting.into_iter().map(|node| nodes[node]).collect() }
        }
        (Search::Nothing, Some(reason)) => Verdict::Live { reason, cycle: None },
        (Search::Nothing, None) => Verdict::Undecided,
    }
}

enum Search {
    Cycle(Cycle),
    Stop { after: u64, state: Network },
    Nothing,
}

/// Brent's search for a repeated state, which keeps two states only; or the step at which nothing moves. It compares with the states after
/// 1, 3, 7, 15, ... steps, so a state that comes back is found only once such a state lies on the cycle and the cycle fits before the next.
fn search(start: &Network, most_steps: u64) -> Search {
    let (mut kept, mut ahead) = (start.clone(), start.clone());
    let (mut power, mut period) = (1u64, 0u64);
    for step in 0..most_steps {
        if !ahead.step().contains(&true) {
            return Search::Stop { after: step, state: ahead };
        }
        period += 1;
        if kept == ahead {
            return Search::Cycle(cycle(start, ahead, period));
        }
        if period == power {
            kept.clone_from(&ahead);
            (power, period) = (power * 2, 0);
        }
    }
    Search::Nothing
}

/// Counts the operations of the cycle on which `state` is, and the steps from `start` to it.
fn cycle(start: &Network, mut state: Network, period: u64) -> Cycle {
    let mut operations = vec![0; start.reversibility().len()];
    for _ in 0..period {
        let sinks = state.step();
        operations.iter_mut().zip(sinks).for_each(|(count, sink)| *count += u64::from(sink));
    }
    let (mut behind, mut ahead) = (start.clone(), start.clone());
    for _ in 0..period {
        ahead.step();
    }
    let mut transient = 0;
    while behind != ahead {
        behind.step();
        ahead.step();
        transient += 1;
    }
    Cycle { transient, period, operations }
}
