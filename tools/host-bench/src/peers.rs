//! Other programs beside our own: one evaluation of the search in GNU Octave, SciPy and Numba, and recordings in Python's packages.

use crate::extent::Extent;
use crate::search;
use crate::times::{median, rounded};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A program that measures itself: it prints `name seconds` lines.
struct Peer {
    name: &'static str,
    program: &'static str,
    script: &'static str,
    install: &'static str,
}

const PEERS: [Peer; 2] = [
    Peer {
        name: "GNU Octave",
        program: "octave-cli",
        script: "benches/octave/thesis_ga.m",
        install: "Debian: octave, octave-ga",
    },
    Peer {
        name: "Python",
        program: "python3",
        script: "benches/python/thesis_network.py",
        install: "pip: scipy, numba",
    },
];

/// Seconds of an evaluation in each, and its ratio to one of the search here just before, medians of the runs; or why it is missing.
pub(crate) fn measure(extent: Extent) -> Value {
    let of = |peer: &Peer| {
        let is_slow = peer.program == "octave-cli";
        let rows = if is_slow && extent.runs == 1 {
            Err("left out of a quick run, because it takes ten seconds".to_owned())
        } else {
            in_turns(peer, extent.runs)
        };
        rows.unwrap_or_else(|why| vec![json!({ "name": peer.name, "missing": why })])
    };
    Value::Array(PEERS.iter().flat_map(of).collect())
}

/// The rows of a program; one that fails in a run has none.
fn in_turns(peer: &Peer, runs: usize) -> Result<Vec<Value>, String> {
    let mut found: Vec<(String, Vec<[f64; 2]>)> = Vec::new();
    for _ in 0..runs {
        let own_s = [1, 5].map(search::individual_s);
        for (name, seconds) in run(peer)? {
            // Where a program chooses its steps, ours are of 1 ms.
            let pair = [seconds, seconds / own_s[usize::from(name.ends_with(" 5 ms"))]];
            match found.iter_mut().find(|(known, _)| *known == name) {
                Some((_, all)) => all.push(pair),
                None => found.push((name, vec![pair])),
            }
        }
    }
    let row = |(name, all): (String, Vec<[f64; 2]>)| {
        let [seconds, ratio] = [0, 1].map(|i| rounded(median(all.iter().map(|pair| pair[i]))));
        json!({ "name": format!("{}, {name}", peer.name), "seconds": seconds, "ratio": ratio })
    };
    Ok(found.into_iter().map(row).collect())
}

fn run(peer: &Peer) -> Result<Vec<(String, f64)>, String> {
    let output = output_of(peer, &[])?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let of_line = |line: &str| {
        let (name, seconds) = line.rsplit_once(' ')?;
        Some((name.replace('_', " "), seconds.parse().ok()?))
    };
    let times: Vec<(String, f64)> = text.lines().filter_map(of_line).collect();
    if times.is_empty() { Err(no_result(peer, &output)) } else { Ok(times) }
}

fn output_of(peer: &Peer, arguments: &[&OsStr]) -> Result<Output, String> {
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..").join(peer.script);
    // Another interpreter, such as that of a virtual environment with the packages.
    let program = std::env::var("FOOTFALL_BENCH_PYTHON").ok().filter(|_| peer.program == "python3");
    let mut command = Command::new(program.as_deref().unwrap_or(peer.program));
    if peer.program == "octave-cli" {
        command.args(["--no-gui", "--quiet"]);
    }
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.arg(&script).args(arguments).output();
    output.map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => format!("`{name}` is not on the path ({})", peer.install),
        _ => format!("`{name}` cannot be started: {error}"),
    })
}

fn no_result(peer: &Peer, output: &Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let last = errors.trim().lines().last().unwrap_or("it printed no result").replace('|', "/");
    format!("{last} ({})", peer.install)
}

/// What Python's packages do with a recording.
const RECORDINGS: Peer = Peer {
    name: "Python",
    program: "python3",
    script: "benches/python/recordings.py",
    install: "pip: pandas, ezc3d, mcap, mcap-ros2-support, scipy",
};

/// A run of another program with a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Other {
    /// What ran.
    pub(crate) name: String,
    /// Without the start of the program.
    pub(crate) seconds: f64,
    /// Rows of the recording.
    pub(crate) rows: u64,
}

impl Other {
    /// Runs Python with this task and file.
    ///
    /// # Errors
    /// Why there is no result, in words for the page.
    pub(crate) fn run(task: &[&str], file: &Path) -> Result<Self, String> {
        let arguments: Vec<&OsStr> = task.iter().map(OsStr::new).chain([file.as_os_str()]).collect();
        let output = output_of(&RECORDINGS, &arguments)?;
        let found = Self::of_line(&String::from_utf8_lossy(&output.stdout)).filter(|_| output.status.success());
        found.ok_or_else(|| no_result(&RECORDINGS, &output))
    }

    /// Of `SECONDS ROWS NAME`.
    fn of_line(line: &str) -> Option<Self> {
        let mut words = line.trim().splitn(3, ' ');
        let (seconds, rows) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        Some(Self { name: words.next()?.to_owned(), seconds, rows })
    }
}

/// Runs of our own program, with one of the other after each.
#[derive(Debug, Default)]
pub(crate) struct InTurns {
    pairs: Vec<(f64, Other)>,
    missing: Option<String>,
}

impl InTurns {
    /// Adds a run of our own and what runs after it; one that failed is not tried again.
    pub(crate) fn add(&mut self, own_s: f64, own_rows: u64, other: impl FnOnce() -> Result<Other, String>) {
        if self.missing.is_some() {
            return;
        }
        match other() {
            Ok(other) if other.rows == own_rows => self.pairs.push((own_s, other)),
            Ok(other) => self.missing = Some(format!("{} finds {} rows, not {own_rows}", other.name, other.rows)),
            Err(why) => self.missing = Some(why),
        }
    }

    /// Medians: the seconds of the other program, and their ratio to those of our run before it; or why they are missing.
    pub(crate) fn result(&self) -> Value {
        match (&self.missing, self.pairs.first()) {
            (None, Some((_, first))) => json!({
                "name": first.name,
                "seconds": rounded(median(self.pairs.iter().map(|(_, other)| other.seconds))),
                "ratio": rounded(median(self.pairs.iter().map(|(own_s, other)| other.seconds / own_s))),
            }),
            (missing, _) => json!({ "missing": missing.as_deref().unwrap_or("nothing was run") }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ratio_is_that_of_neighbours_and_other_rows_are_no_result() {
        let other = |seconds, rows| Ok(Other { name: "a".into(), seconds, rows });
        let mut turns = InTurns::default();
        for (own, seconds) in [(1.0, 2.0), (10.0, 30.0), (1.0, 4.0)] {
            turns.add(own, 7, || other(seconds, 7));
        }
        assert_eq!(turns.result(), json!({ "name": "a", "seconds": 4.0, "ratio": 3.0 }));
        turns.add(1.0, 7, || other(1.0, 8));
        assert_eq!(turns.result(), json!({ "missing": "a finds 8 rows, not 7" }));
        let mut none = InTurns::default();
        none.add(1.0, 7, || Err("no pandas".into()));
        none.add(1.0, 7, || panic!("it is not tried again"));
        assert_eq!(none.result(), json!({ "missing": "no pandas" }));
        let line = Other::of_line("0.5 7 a b\n");
        assert_eq!(line, Some(Other { name: "a b".into(), seconds: 0.5, rows: 7 }));
        assert_eq!((Other::of_line(""), Other::of_line("x 7 a")), (None, None));
    }
}
