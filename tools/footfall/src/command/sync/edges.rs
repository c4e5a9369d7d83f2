//! Reads edges of a line: CSV with the header `time_s,level`, one edge a row, in the order of time; level 1 after a
//! rising edge, 0 after a falling one; up to [`MOST_EDGES`] of them. A last row that is cut short, as a program leaves it that is killed while it writes, is left out,
//! with a note.

use std::path::Path;

use crate::file::bounded;

/// Most bytes of a file.
pub const MOST_BYTES: u64 = 16 << 20;

/// Most edges of a file: more than 13 hours of a board's synchronisation output.
pub const MOST_EDGES: usize = 1_000_000;

/// Most edges of each of two files that are paired: five hours of a pulse a second. Regular pulses take longest, a millisecond each.
pub const MOST_PAIRED: usize = 40_000;

/// A change of the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Time, s.
    pub time_s: f64,
    /// True for a rising edge.
    pub rising: bool,
}

/// A rising edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Time, s.
    pub time_s: f64,
    /// Duration of the high level, s; `None` without a falling edge.
    pub width_s: Option<f64>,
}

/// A file of edges.
#[derive(Debug, Clone, PartialEq)]
pub struct Edges {
    /// In the order of time.
    pub edges: Vec<Edge>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Reads a file of edges.
///
/// # Errors
/// The first error, with its line.
pub fn read(path: &Path) -> Result<Edges, String> {
    let at = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let text = bounded::text(path, MOST_BYTES).map_err(|error| at(&error))?;
    let mut edges = parse(&text).map_err(|error| format!("{}:{error}", path.display()))?;
    edges.notes.iter_mut().for_each(|note| *note = at(note));
    Ok(edges)
}

/// Reads the text of a file of edges; an error begins with the number of the line.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str) -> Result<Edges, String> {
    let mut lines = text.lines().enumerate();
    let header = lines.next().map_or("", |(_, line)| line.trim());
    if header != "time_s,level" {
        return Err(format!("1: the header is `{header}`; allowed is `time_s,level`"));
    }
    let mut edges: Vec<Edge> = Vec::new();
    let mut notes = Vec::new();
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty()).peekable();
    while let Some((index, line)) = lines.next() {
        let row = index + 1;
        let has_level = line.split_once(',').is_some_and(|(_, level)| !level.trim().is_empty());
        if !has_level && lines.peek().is_none() && !text.ends_with('\n') {
            notes.push(format!("the last row is cut short (line {row}): it is left out"));
            break;
        }
        let (time, level) = line.split_once(',').ok_or_else(|| format!("{row}: two columns are wanted: `{line}`"))?;
        let time_s = time.trim().parse::<f64>().ok().filter(|time| time.is_finite());
        let time_s = time_s.ok_or_else(|| format!("{row}: field `time_s`: `{time}` is no finite number"))?;
        let rising = match level.trim() {
            "1" => true,
            "0" => false,
            other => return Err(format!("{row}: field `level`: `{other}`; allowed is 0 or 1")),
        };
        if let Some(before) = edges.last().filter(|before| before.time_s >= time_s) {
            return Err(format!("{row}: field `time_s`: {time_s} does not come after {}", before.time_s));
        }
        if edges.len() == MOST_EDGES {
            return Err(format!(
                "{row}: the file has more than {MOST_EDGES} edges; allowed are up to that: cut the list"
            ));
        }
        edges.push(Edge { time_s, rising });
    }
    Ok(Edges { edges, notes })
}

/// All rising edges.
#[must_use]
pub fn pulses(edges: &[Edge]) -> Vec<Pulse> {
    let next = edges.iter().skip(1).map(Some).chain([None]);
    let rising = edges.iter().zip(next).filter(|(edge, _)| edge.rising);
    let width = |from: f64, next: Option<&Edge>| next.filter(|next| !next.rising).map(|next| next.time_s - from);
    rising.map(|(edge, next)| Pulse { time_s: edge.time_s, width_s: width(edge.time_s, next) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_edges_than_allowed_are_refused() {
        let text = |edges: usize| {
            let rows: String = (0..edges).map(|n| format!("{n},{}\n", n % 2)).collect();
            format!("time_s,level\n{rows}")
        };
        assert_eq!(parse(&text(MOST_EDGES)).unwrap().edges.len(), MOST_EDGES);
        let error = parse(&text(MOST_EDGES + 1)).unwrap_err();
        assert!(error.starts_with("1000002: the file has more than 1000000 edges; allowed"), "{error}");
    }

    #[test]
    fn bad_files_are_refused_with_their_line() {
        for (text, words) in [
            ("", "1: the header is ``"),
            ("time,level\n", "allowed is `time_s,level`"),
            ("time_s,level\n1\n", "2: two columns"),
            ("time_s,level\n1,1\nx,0\n", "3: field `time_s`: `x`"),
            ("time_s,level\n1,2\n", "2: field `level`: `2`; allowed is 0 or 1"),
            ("time_s,level\n1,1\n1,0\n", "3: field `time_s`: 1 does not come after 1"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(words), "{text:?}: {error}");
        }
        let read = parse("time_s,level\n0.5,1\n").unwrap();
        assert_eq!(read, Edges { edges: vec![Edge { time_s: 0.5, rising: true }], notes: vec![] });
    }

    #[test]
    fn half_a_row_at_the_end_is_left_out() {
        let whole = "time_s,level\n0.5,1\n1.25,0";
        for end in whole.len() - 5..whole.len() {
            let read = parse(&whole[..end]).unwrap();
            assert_eq!((read.edges.len(), read.notes.len()), (1, 1), "{end}");
            assert_eq!(read.notes[0], "the last row is cut short (line 3): it is left out");
        }
        assert_eq!(parse(whole).unwrap().edges.len(), 2);
        assert!(parse("time_s,level\n0.5\n1.25,0").is_err() && parse("time_s,level\n0.5,1\n1.25\n").is_err());
    }

    #[test]
    fn a_pulse_whose_end_was_lost_has_no_width() {
        let Edges { edges, .. } = parse("time_s,level\n0,0\n1,1\n1.5,0\n2,1\n3,1\n3.25,0\n4,1\n").unwrap();
        let widths: Vec<_> = pulses(&edges).iter().map(|pulse| (pulse.time_s, pulse.width_s)).collect();
        assert_eq!(widths, [(1.0, Some(0.5)), (2.0, None), (3.0, Some(0.25)), (4.0, None)]);
    }
}
