//! Describes the machine: its processor, its cores, what the search's vectors are, how busy it was, and the commit of what ran.

use std::process::Command;

use anyhow::{Result, ensure};
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

/// An error if parts that were measured before are of another machine: beside each other their numbers say nothing.
pub(crate) fn must_be_same(before: &Value, now: &Value) -> Result<()> {
    for key in ["processor", "family", "model", "cores", "lanes", "system"] {
        ensure!(
            before[key] == now[key],
            "docs/host.json is of another machine ({key} {}, here {}): measure all parts, without --only",
            before[key],
            now[key]
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_another_machine_are_refused() {
        let here = describe();
        let mut later = here.clone();
        (later["commit"], later["load"]) = (json!("another"), json!(7.5));
        assert!(must_be_same(&here, &later).is_ok());
        later["cores"] = json!(1000);
        let why = must_be_same(&here, &later).unwrap_err().to_string();
        assert!(why.contains("cores") && why.contains("1000") && why.contains("--only"), "{why}");
    }
}
