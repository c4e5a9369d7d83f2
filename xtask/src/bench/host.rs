//! `cargo xtask bench host`: builds `footfall` and `host-bench`, and runs the latter, which measures and writes its page.

use std::process::ExitCode;

use anyhow::Result;

use crate::shell;
use crate::workspace::Workspace;

/// Options of `cargo xtask bench host`.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Options {
    /// One JSON object instead of the page
    #[arg(long)]
    json: bool,
    /// Only these parts: search, peers, fit, readers, folder; the others are those of docs/host.json
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Small files, few recordings, one run of each: whether everything works, no measurement
    #[arg(long, conflicts_with = "write")]
    quick: bool,
    /// Write docs/host.json, docs/host.md and docs/host-growth.svg
    #[arg(long)]
    write: bool,
}

/// Runs the bench.
pub(crate) fn bench(options: &Options) -> Result<ExitCode> {
    let workspace = Workspace::open()?;
    let [footfall, host_bench] = workspace.footfall_and_host_bench()?;
    let mut run = shell::command(host_bench);
    run.arg("--footfall").arg(footfall).arg("--folder").arg(workspace.target_dir.join("bench/host"));
    for part in &options.only {
        run.args(["--only", part]);
    }
    for (flag, is_set) in [("--json", options.json), ("--quick", options.quick), ("--write", options.write)] {
        if is_set {
            run.arg(flag);
        }
    }
    shell::replace_with(&mut run)
}
