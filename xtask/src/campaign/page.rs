//! The part of docs/campaign.md that a run of the campaign writes: commit, machine, counts, table.

use std::path::Path;

use anyhow::{Context, Result};

use super::table::Table;
use crate::shell;

const PAGE: &str = "docs/campaign.md";
const BEGIN: &str = "<!-- Written by cargo xtask campaign --write -->\n";
const END: &str = "<!-- End of what is written -->";

/// Writes what came of a campaign to the page.
pub(super) fn write(table: &Table, every: u32) -> Result<()> {
    let page = Path::new(PAGE);
    let text = std::fs::read_to_string(page).with_context(|| format!("reading {PAGE}"))?;
    let said = |arguments: &[&str]| {
        shell::stdout_of(shell::command("git").args(arguments)).context("asking git for the commit")
    };
    let commit = said(&["rev-parse", "--short", "HEAD"])?;
    // The page itself is written by this command.
    let changed = said(&["status", "--porcelain", "--", ".", ":!docs"])?;
    let commit = format!("`{}`{}", commit.trim(), if changed.trim().is_empty() { "" } else { " with changes" });
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let written = with_block(&text, &block(table, every, &commit, cores))?;
    std::fs::write(page, written).with_context(|| format!("writing {PAGE}"))
}

fn block(table: &Table, every: u32, commit: &str, cores: usize) -> String {
    let part = if every == 1 { "Every case".to_owned() } else { format!("One case of {every}, and each fault once") };
    let (minutes, seconds) = ((table.seconds / 60.0) as u32, table.seconds % 60.0);
    format!(
        "\n{part} at commit {commit}: **{}**, in {minutes} min {seconds:.0} s by the clock on {cores} cores.\n\n{}.\n\n{}\n",
        table.counts(),
        table.speed(),
        table.rows()
    )
}

/// The page with another block.
fn with_block(text: &str, block: &str) -> Result<String> {
    let (before, rest) = text.split_once(BEGIN).with_context(|| format!("{PAGE} has no line `{}`", BEGIN.trim()))?;
    let (_, after) = rest.split_once(END).with_context(|| format!("{PAGE} has no line `{END}` after it"))?;
    Ok(format!("{before}{BEGIN}{block}{END}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_between_the_marks_changes() {
        let page = format!("a\n{BEGIN}old\n{END}\nb\n");
        assert_eq!(with_block(&page, "new\n").unwrap(), page.replace("old", "new"));
        assert!(with_block("a\n", "new").unwrap_err().to_string().contains("has no line"));
        let mut table = Table::default();
        table.add(&serde_json::json!({ "type": "end", "seconds": 412.4 }));
        let text = block(&table, 1, "`1234567`", 2);
        assert!(
            text.contains("Every case at commit `1234567`: **0 cases of 0 faults, 0 wrong;")
                && text.contains("6 min 52 s"),
            "{text}"
        );
        assert!(block(&Table::default(), 7, "", 2).contains("One case of 7, and each fault once"));
    }
}
