//! One evaluation of the search in other programs: GNU Octave, SciPy and Numba.

use crate::extent::Extent;
use crate::times::{median, rounded};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::Command;

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

/// Seconds of an evaluation in each, medians of the runs; or why it is missing.
pub(crate) fn measure(extent: Extent) -> Value {
    let mut found: Vec<(String, Vec<f64>)> = Vec::new();
    let mut missing = Vec::new();
    for peer in PEERS {
        let is_octave = peer.program == "octave-cli";
        if is_octave && extent.runs == 1 {
            missing.push(json!({ "name": peer.name, "missing": "left out of a quick run, because it takes a minute" }));
            continue;
        }
        // Its script has medians of its own.
        let runs = if is_octave { 1 } else { extent.runs };
        for _ in 0..runs {
            match run(&peer) {
                Ok(times) => {
                    for (name, seconds) in times {
                        let name = format!("{}, {name}", peer.name);
                        match found.iter_mut().find(|(known, _)| *known == name) {
                            Some((_, all)) => all.push(seconds),
                            None => found.push((name, vec![seconds])),
                        }
                    }
                }
                Err(why) => {
                    missing.push(json!({ "name": peer.name, "missing": why }));
                    break;
                }
            }
        }
    }
    let times = found.into_iter().map(|(name, all)| json!({ "name": name, "seconds": rounded(median(all)) }));
    Value::Array(times.chain(missing).collect())
}

fn run(peer: &Peer) -> Result<Vec<(String, f64)>, String> {
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..").join(peer.script);
    // Another interpreter, such as that of a virtual environment with the packages.
    let program = std::env::var("FOOTFALL_BENCH_PYTHON").ok().filter(|_| peer.program == "python3");
    let mut command = Command::new(program.as_deref().unwrap_or(peer.program));
    if peer.program == "octave-cli" {
        command.args(["--no-gui", "--quiet"]);
    }
    let output = command
        .arg(&script)
        .output()
        .map_err(|_| format!("`{}` is not on the path ({})", peer.program, peer.install))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let of_line = |line: &str| {
        let (name, seconds) = line.rsplit_once(' ')?;
        Some((name.replace('_', " "), seconds.parse().ok()?))
    };
    let times: Vec<(String, f64)> = text.lines().filter_map(of_line).collect();
    if times.is_empty() {
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        let last = errors.trim().lines().last().unwrap_or("it printed nothing").to_owned();
        return Err(format!("{last} ({})", peer.install));
    }
    Ok(times)
}
