//! Describes the machine: its processor, its cores, what the search's vectors are, how busy it was, and the commit of what ran.

use std::process::Command;

use serde_json::{Value, json};

/// The commit, with `-dirty` behind it if files were changed; `None` outside of a repository.
fn commit() -> Option<String> {
    let git = Command::new("git").args(["describe", "--always", "--dirty", "--exclude", "*"]).output().ok()?;
    let text = String::from_utf8(git.stdout).ok()?;
    Some(text.trim().to_owned()).filter(|text| git.status.success() && !text.is_empty())
}

/// Processor, cores, vectors, load and commit.
pub(crate) fn describe() -> Value {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or("unknown processor", |(_, model)| model.trim());
    let field = |name: &str| {
        let line = info.lines().find(|line| line.split(':').next().is_some_and(|key| key.trim() == name))?;
        line.split_once(':').map(|(_, value)| value.trim().to_owned())
    };
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load: Option<f64> = load.split_whitespace().next().and_then(|first| first.parse().ok());
    json!({
        "processor": model,
        "family": field("cpu family"),
        "model": field("model"),
        "cores": std::thread::available_parallelism().map_or(1, usize::from),
        "lanes": crate::search::lanes(),
        "load": load,
        "system": std::env::consts::OS,
        "commit": commit(),
    })
}
