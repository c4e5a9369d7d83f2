//! `footfall smer`: judges a graph of nodes that operate by edge reversal: live or dead, transient, period, operations, concurrency.

use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::edge_reversal::liveness::{Cycle, Part, Reason, Verdict, judge};
use crate::edge_reversal::network::Network;
use crate::failure::Failure;
use crate::file::graph_file::{self, Graph};
use crate::file::svg::{self, Bars, Link, Links, Node, Panel};
use crate::options::overwrite::Overwrite;
use crate::output;

/// Options of `footfall smer`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "The graph file, for example:\n\n    \
    # A triangle. Everything after a number sign is a comment.\n    \
    c = 2        # the reversibility of a node; a node without such a line has 1\n    \
    a -> b       # an edge that points to b: all its tokens lie at b, which may operate first\n    \
    b -> c\n    \
    a c 0 2      # an edge with its tokens at a and at c: multiples of g with the sum r_a + r_c - g,\n                 \
    # g the greatest common divisor of both reversibilities\n\n\
    Exit code 1: a node stops, or it remains undecided. The keys of --json are in docs/generators.md.")]
pub struct Options {
    /// The graph: a line for each edge, and for each reversibility that is not 1 (see below)
    #[arg(value_name = "GRAPH")]
    pub graph: PathBuf,
    /// Print also which nodes operate at each of the first N steps
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub steps: Option<u64>,
    /// Look at this many steps of each connected part for a repeated state, which is found within three times the longer of transient and
    /// period; periods can grow exponentially with the graph
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub search: u64,
    /// Print one JSON object instead of the table
    #[arg(long)]
    pub json: bool,
    /// Draw the step diagram and, up to 24 nodes, the graph
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Whether files may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// Largest number of steps in a picture.
const MOST_DRAWN_STEPS: u64 = 10_000;
/// Largest number of nodes in a step diagram.
const MOST_ROWS: usize = 40;
/// Largest number of nodes in a picture of the graph.
const MOST_NODES_DRAWN: usize = 24;

/// Runs the command.
///
/// # Errors
/// Wrong input, a file that cannot be written, a graph that stops, or one that remains undecided.
pub fn run(options: &Options) -> Result<(), Failure> {
    if let Some(path) = &options.svg {
        output::check_apart([path.as_path()], [options.graph.as_path()])?;
        output::check(path, options.overwrite)?;
    }
    let graph = graph_file::read(&options.graph).map_err(Failure::input)?;
    if options.svg.is_some() {
        if let Some(steps) = options.steps.filter(|steps| *steps > MOST_DRAWN_STEPS) {
            return Err(Failure::input(format!("--steps {steps}: allowed with --svg is up to {MOST_DRAWN_STEPS}")));
        }
        if graph.names.len() > MOST_ROWS {
            let nodes = graph.names.len();
            return Err(Failure::input(format!("--svg: the graph has {nodes} nodes; allowed are up to {MOST_ROWS}")));
        }
    }
    let parts = judge(&graph.network, options.search);
    if let Some(path) = &options.svg {
        draw(path, options, &graph, &parts)?;
    }
    let steps = options.steps.map(|steps| operations(&graph.network, steps));
    if options.json {
        output::print(&format!("{}\n", object(&graph, &parts, options.search, steps.as_deref())))?;
    } else {
        output::print(&table(&graph, &parts, options.search, steps.as_deref()))?;
    }
    match status(&parts) {
        "live" => Ok(()),
        "dead" => Err(Failure::run("dead: there are nodes that stop, see above")),
        _ => Err(Failure::run(format!(
            "undecided: neither a repeated state nor a stop was found within {} steps; look at more with --search",
            options.search
        ))),
    }
}

/// The nodes that operate at each of the first steps.
fn operations(network: &Network, steps: u64) -> Vec<Vec<usize>> {
    let mut network = network.clone();
    let of = |sinks: Vec<bool>| sinks.into_iter().enumerate().filter_map(|(node, sink)| sink.then_some(node)).collect();
    (0..steps).map(|_| of(network.step())).collect()
}

/// Of the whole graph: `live` if every part is.
fn status(parts: &[Part]) -> &'static str {
    let has = |word| parts.iter().any(|part| word_of(&part.verdict) == word);
    if has("dead") {
        "dead"
    } else if has("undecided") {
        "undecided"
    } else {
        "live"
    }
}

const fn word_of(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Live { .. } => "live",
        Verdict::Dead { .. } => "dead",
        Verdict::Undecided => "undecided",
    }
}

const fn cycle_of(part: &Part) -> Option<&Cycle> {
    match &part.verdict {
        Verdict::Live { cycle, .. } => cycle.as_ref(),
        _ => None,
    }
}

fn names(graph: &Graph, nodes: &[usize]) -> Vec<String> {
    nodes.iter().map(|&node| graph.names[node].clone()).collect()
}

fn table(graph: &Graph, parts: &[Part], search: u64, steps: Option<&[Vec<usize>]>) -> String {
    // Writing to a String cannot fail.
    let mut out = String::new();
    let _ = writeln!(out, "graph        {} nodes, {} edges", graph.names.len(), graph.network.edges().len());
    for (index, part) in parts.iter().enumerate() {
        if parts.len() > 1 {
            let _ = writeln!(out, "\npart {} of {}, no edge to the others", index + 1, parts.len());
        }
        let _ = writeln!(out, "status       {}", in_words(graph, part, search));
        if let Some(cycle) = cycle_of(part) {
            let (mean, share) = (cycle.concurrency(), cycle.concurrency() / part.nodes.len() as f64);
            let _ = writeln!(out, "transient    {} steps", cycle.transient);
            let _ = writeln!(out, "period       {} steps", cycle.period);
            let _ = writeln!(out, "concurrency  {mean:.3} nodes a step, {share:.3} of all");
        }
        let width = part.nodes.iter().map(|&node| graph.names[node].chars().count()).max().unwrap_or(0).max(4);
        let _ = writeln!(out, "{:width$}  reversibility  operations a period", "node");
        for (place, &node) in part.nodes.iter().enumerate() {
            let count = cycle_of(part).and_then(|cycle| cycle.operations.get(place));
            let count = count.map_or("-".into(), ToString::to_string);
            let _ =
                writeln!(out, "{:width$}  {:13}  {count:>19}", graph.names[node], graph.network.reversibility()[node]);
        }
    }
    if let Some(steps) = steps {
        let word = |nodes: &Vec<usize>| if nodes.is_empty() { "-".into() } else { names(graph, nodes).join("+") };
        let _ = writeln!(out, "\nsteps        {}", steps.iter().map(word).collect::<Vec<_>>().join(" "));
    }
    out
}

fn in_words(graph: &Graph, part: &Part, search: u64) -> String {
    match &part.verdict {
        Verdict::Live { reason, cycle } => {
            let because = match reason {
                Reason::Forest => "the graph has no cycle",
                Reason::Acyclic => "all reversibilities are equal and no cycle is directed",
                Reason::Repeats => "a state comes back",
            };
            let unknown =
                format!("; period unknown: no repeated state was found within {search} steps, --search looks at more");
            format!("live: {because}{}", if cycle.is_some() { "" } else { &unknown })
        }
        Verdict::Dead { stops_after, waiting } => {
            let mut cycle = names(graph, waiting);
            cycle.extend(cycle.first().cloned());
            format!("dead: nothing moves after {stops_after} steps; each waits for the next: {}", cycle.join(" > "))
        }
        Verdict::Undecided => {
            format!(
                "undecided: no repeated state was found within {search} steps, and it did not stop; --search looks at more"
            )
        }
    }
}

fn object(graph: &Graph, parts: &[Part], search: u64, steps: Option<&[Vec<usize>]>) -> Value {
    let part = |part: &Part| {
        let cycle = cycle_of(part);
        let operations = cycle.map(|cycle| {
            let counts = part.nodes.iter().zip(&cycle.operations);
            counts.map(|(&node, count)| (graph.names[node].clone(), json!(count))).collect::<serde_json::Map<_, _>>()
        });
        let (stops_after, waiting) = match &part.verdict {
            Verdict::Dead { stops_after, waiting } => (Some(stops_after), Some(names(graph, waiting))),
            _ => (None, None),
        };
        let because = match &part.verdict {
            Verdict::Live { reason: Reason::Forest, .. } => Some("no_cycle"),
            Verdict::Live { reason: Reason::Acyclic, .. } => Some("no_directed_cycle"),
            Verdict::Live { reason: Reason::Repeats, .. } => Some("repeated_state"),
            _ => None,
        };
        json!({
            "nodes": names(graph, &part.nodes),
            "status": word_of(&part.verdict),
            "live_because": because,
            "transient_steps": cycle.map(|cycle| cycle.transient),
            "period_steps": cycle.map(|cycle| cycle.period),
            "operations": operations,
            "concurrency": cycle.map(Cycle::concurrency),
            "stops_after_steps": stops_after,
            "waiting_cycle": waiting,
        })
    };
    let mut object = json!({
        "status": status(parts),
        "nodes": graph.names,
        "reversibility": graph.network.reversibility(),
        "searched_steps": search,
        "parts": parts.iter().map(part).collect::<Vec<_>>(),
    });
    if let (Some(steps), Some(object)) = (steps, object.as_object_mut()) {
        object.insert("steps".into(), steps.iter().map(|nodes| names(graph, nodes)).collect());
    }
    object
}

/// Steps of the picture without --steps: the transients and two periods, at least 12 and at most 60.
fn steps_drawn(parts: &[Part]) -> u64 {
    let of = |part: &Part| match &part.verdict {
        Verdict::Live { cycle: Some(cycle), .. } => cycle.transient.saturating_add(cycle.period.saturating_mul(2)),
        Verdict::Dead { stops_after, .. } => *stops_after,
        _ => 60,
    };
    parts.iter().map(of).max().unwrap_or(0).clamp(12, 60)
}

fn draw(path: &Path, options: &Options, graph: &Graph, parts: &[Part]) -> Result<(), Failure> {
    let steps = operations(&graph.network, options.steps.unwrap_or_else(|| steps_drawn(parts)));
    let row = |(node, name): (usize, &String)| {
        let at = steps.iter().enumerate().filter(|(_, nodes)| nodes.contains(&node));
        Bars { name: name.clone(), spans: at.map(|(step, _)| (step as f64, step as f64 + 1.0)).collect() }
    };
    let rows = graph.names.iter().enumerate().map(row).collect();
    let mut panels = vec![Panel::bars("a bar where the node operates", "step", "", rows)];
    if graph.names.len() <= MOST_NODES_DRAWN {
        panels.push(Panel::links(
            "start: arrows point to the node that may operate first; tokens at both ends",
            links(graph),
        ));
    }
    let name = options.graph.file_name().unwrap_or(options.graph.as_os_str()).to_string_lossy();
    let title = format!("{name}: {}", status(parts));
    svg::write(path, &title, &panels, options.overwrite)
}

fn links(graph: &Graph) -> Links {
    let network = &graph.network;
    let nodes = graph.names.iter().zip(network.reversibility());
    let nodes = nodes.map(|(name, r)| Node { name: name.clone(), note: format!("r = {r}") });
    let link = |edge| {
        let (crate::edge_reversal::network::Edge { ends, tokens }, head) = (edge, network.head(edge));
        let order = [1 - head, head];
        Link { ends: order.map(|end| ends[end]), labels: order.map(|end| tokens[end].to_string()) }
    };
    Links { nodes: nodes.collect(), links: network.edges().iter().map(link).collect() }
}
