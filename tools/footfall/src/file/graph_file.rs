//! The graph file of `footfall smer`: nodes, reversibilities, edges and tokens as lines of text.
//!
//! ```text
//! # Everything after a number sign is a comment.
//! a = 2        # the reversibility of a node; a node without such a line has 1
//! b = 3
//! a -> b       # an edge that points to b: all its tokens lie at b
//! b c 2 1      # an edge, with the tokens at b and at c
//! ```
//! Lines may stand in any order. A name has 1 to 16 letters, digits, `_`, `.` or `-`, and begins with a letter or a digit. An edge between nodes of
//! reversibilities r_a and r_b carries r_a + r_b - g tokens, g their greatest common divisor; at each end lies a multiple of g.

use cpg_core::edge_reversal::smer::MAX_REVERSIBILITY;
use std::collections::HashMap;
use std::path::Path;

use crate::edge_reversal::network::{Edge, Network, NetworkError, carried};
use crate::file::bounded;

/// Largest number of nodes.
pub const MAX_NODES: usize = 1_000;
/// Largest number of edges.
pub const MAX_EDGES: usize = 2_000;
/// Longest name, in characters.
pub const MAX_NAME: usize = 16;
/// Largest size of a file in bytes.
const MAX_BYTES: u64 = 1 << 20;

const LINES: &str = "`NAME = REVERSIBILITY`, `A -> B`, `A B TOKENS_AT_A TOKENS_AT_B`, and # before a comment";

/// A graph and the names of its nodes, in the order in which the file first has them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Graph {
    /// The names.
    pub names: Vec<String>,
    /// The graph with its tokens.
    pub network: Network,
}

/// What is wrong with a graph file, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GraphError {
    /// Name of the file.
    pub file: String,
    /// Line, counted from 1; `None` if the whole file is wrong.
    pub line: Option<usize>,
    /// What is wrong and what is allowed.
    pub what: String,
}

impl std::fmt::Display for GraphError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}", generator_file::toml_file::place(&self.file, self.line), self.what)
    }
}

impl std::error::Error for GraphError {}

/// Reads a graph file.
///
/// # Errors
/// The file cannot be read, or the first line that is wrong.
pub fn read(path: &Path) -> Result<Graph, GraphError> {
    let file = path.display().to_string();
    let whole = |what: String| GraphError { file: file.clone(), line: None, what };
    let text = bounded::text(path, MAX_BYTES).map_err(|why| whole(why.to_string()))?;
    parse(&file, &text)
}

/// Reads the text of a graph file; `file` is its name in errors.
///
/// # Errors
/// The first line that is wrong.
///
/// ```
/// use footfall::file::graph_file::parse;
/// let graph = parse("path.txt", "b = 3\na -> b\n")?;
/// assert_eq!((graph.names, graph.network.reversibility()), (vec!["b".into(), "a".into()], &[3, 1][..]));
/// let error = parse("path.txt", "b = 3\na b 1 1").unwrap_err().to_string();
/// assert!(error.starts_with("path.txt:2: `a b 1 1`: tokens that the edge cannot have; allowed are two multiples of 1 with the sum 3"));
/// # Ok::<(), footfall::file::graph_file::GraphError>(())
/// ```
pub fn parse(file: &str, text: &str) -> Result<Graph, GraphError> {
    let at = |line: usize, what: String| GraphError { file: file.into(), line: Some(line), what };
    let mut draft = Draft::default();
    for (index, text) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let content = text.split('#').next().unwrap_or_default().trim();
        if !content.is_empty() {
            draft.line(index + 1, content).map_err(|what| at(index + 1, format!("`{content}`: {what}")))?;
        }
    }
    if draft.names.is_empty() {
        let what = format!("has no node; allowed are lines {LINES}");
        return Err(GraphError { file: file.into(), line: None, what });
    }
    draft.build().map_err(|(line, what)| at(line, what))
}

/// An edge as it was written.
struct Written {
    line: usize,
    content: String,
    ends: [usize; 2],
    /// `None` for an arrow.
    tokens: Option<[u32; 2]>,
}

/// What the lines so far say.
#[derive(Default)]
struct Draft {
    names: Vec<String>,
    numbers: HashMap<String, usize>,
    /// Reversibility and line of the nodes that have such a line.
    reversibility: HashMap<usize, (u32, usize)>,
    edges: Vec<Written>,
}

impl Draft {
    fn line(&mut self, line: usize, content: &str) -> Result<(), String> {
        let spaced = content.replace("->", " -> ").replace('=', " = ");
        let words: Vec<&str> = spaced.split_whitespace().collect();
        match words[..] {
            [name, "=", value] => {
                let node = self.node(name)?;
                let r = value.parse().ok().filter(|r| (1..=MAX_REVERSIBILITY).contains(r));
                let r = r.ok_or(format!(
                    "reversibility `{value}`; allowed is a whole number from 1 to {MAX_REVERSIBILITY}"
                ))?;
                match self.reversibility.insert(node, (r, line)) {
                    Some((_, before)) => Err(format!("{name} has a reversibility since line {before}; allowed is one")),
                    None => Ok(()),
                }
            }
            [a, "->", b] => self.edge(line, content, [a, b], None),
            [a, b, at_a, at_b] if ![a, b, at_a, at_b].iter().any(|word| ["=", "->"].contains(word)) => {
                let tokens =
                    |word: &str| word.parse().map_err(|_| format!("tokens `{word}`; allowed is a whole number from 0"));
                self.edge(line, content, [a, b], Some([tokens(at_a)?, tokens(at_b)?]))
            }
            _ => Err(format!("is no line of a graph; allowed are {LINES}")),
        }
    }

    fn node(&mut self, name: &str) -> Result<usize, String> {
        if let Some(&node) = self.numbers.get(name) {
            return Ok(node);
        }
        let is_allowed = name.starts_with(char::is_alphanumeric)
            && name.chars().count() <= MAX_NAME
            && name.chars().all(|c| c.is_alphanumeric() || "_.-".contains(c));
        if !is_allowed {
            let rule = "letters, digits, _ . and -, a letter or a digit first";
            return Err(format!("name `{name}`; allowed are 1 to {MAX_NAME} {rule}"));
        }
        if self.names.len() == MAX_NODES {
            return Err(format!("one node more than the {MAX_NODES} that are allowed"));
        }
        self.names.push(name.into());
        self.numbers.insert(name.into(), self.names.len() - 1);
        Ok(self.names.len() - 1)
    }

    fn edge(&mut self, line: usize, content: &str, ends: [&str; 2], tokens: Option<[u32; 2]>) -> Result<(), String> {
        if self.edges.len() == MAX_EDGES {
            return Err(format!("one edge more than the {MAX_EDGES} that are allowed"));
        }
        let ends = [self.node(ends[0])?, self.node(ends[1])?];
        self.edges.push(Written { line, content: content.into(), ends, tokens });
        Ok(())
    }

    fn build(self) -> Result<Graph, (usize, String)> {
        let of = |node: usize| self.reversibility.get(&node).map_or(1, |&(r, _)| r);
        let reversibility: Vec<u32> = (0..self.names.len()).map(of).collect();
        let edge = |written: &Written| {
            let [a, b] = written.ends;
            let all_at_b = [0, carried(reversibility[a], reversibility[b])];
            Edge { ends: written.ends, tokens: written.tokens.unwrap_or(all_at_b) }
        };
        let edges = self.edges.iter().map(edge).collect();
        let network = Network::new(reversibility.clone(), edges).map_err(|error| {
            let line = |edge: usize| self.edges[edge].line;
            let content = |edge: usize| &self.edges[edge].content;
            match error {
                NetworkError::Reversibility { node } => {
                    (self.reversibility.get(&node).map_or(1, |&(_, line)| line), error.to_string())
                }
                NetworkError::Ends { edge } => (line(edge), format!("`{}`: {error}", content(edge))),
                NetworkError::Twin { edge, before } => {
                    (line(edge), format!("`{}`: {error}; the first is on line {}", content(edge), line(before)))
                }
                NetworkError::Tokens { edge, .. } => {
                    let [a, b] = self.edges[edge].ends.map(|node| (&self.names[node], reversibility[node]));
                    let because = format!("because {} has reversibility {} and {} has {}", a.0, a.1, b.0, b.1);
                    (line(edge), format!("`{}`: {error}, {because}", content(edge)))
                }
            }
        })?;
        Ok(Graph { names: self.names, network })
    }
}
