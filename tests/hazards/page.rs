//! The hazards of `docs/safety.md`, as text made of `hazards.toml`.

use std::fmt::Write;

use crate::entry::{Hazard, Hazards, Place, Status};

/// The lines of the page between which the hazards are.
pub(crate) const MARKS: [&str; 2] =
    ["<!-- Hazards of hazards.toml, written by tests/hazards -->", "<!-- End of the hazards of hazards.toml -->"];

const BENCH: &str = "\
## Bench procedures

For a board in the hand, after the list [Before the first arming](first-walk.md#before-the-first-arming). Each arming needs the test of the emergency stop
after a boot, and after a fault a hold that acknowledges it. No procedure has been carried out yet: one that does not work as written is a finding too.
";

/// What stands between the marks.
pub(crate) fn hazards(hazards: &Hazards) -> String {
    let mut page = counts(hazards);
    page.push('\n');
    page += &table(hazards);
    page += &missing(hazards);
    page += &procedures(hazards);
    page
}

/// How many hazards have each status, and where those of that status have been shown.
fn counts(hazards: &Hazards) -> String {
    let places = Place::ALL.map(Place::name).join(" | ");
    let mut table = format!("| status | hazards | {places} |\n|---|---|{}\n", "---|".repeat(Place::ALL.len()));
    let mut row = |name: &str, of: &dyn Fn(&Hazard) -> bool| {
        let of: Vec<&Hazard> = hazards.list.iter().filter(|hazard| of(hazard)).collect();
        let at = |place| of.iter().filter(|hazard| hazard.shown.contains(&place)).count().to_string();
        _ = writeln!(table, "| {name} | {} | {} |", of.len(), Place::ALL.map(at).join(" | "));
    };
    for status in Status::ALL {
        row(status.name(), &|hazard| hazard.status == status);
    }
    row("all", &|_| true);
    table
}

/// A time of a table; short ones in microseconds.
fn milliseconds(ms: f64) -> String {
    if ms > 0.0 && ms < 0.1 { format!("{} us", (ms * 1e6).round() / 1e3) } else { format!("{ms} ms") }
}

/// A table with a row for each hazard that applies.
fn table(hazards: &Hazards) -> String {
    let mut table = "| hazard | detection | reaction | limit (longest) | status |\n|---|---|---|---|---|\n".to_owned();
    for hazard in hazards.list.iter().filter(|hazard| hazard.status != Status::DoesNotApply) {
        let text = |text: &Option<String>| text.clone().unwrap_or_else(|| "none".to_owned());
        let limit = match (hazard.limit_ms, hazard.longest_ms) {
            (Some(limit), Some(longest)) => format!("{} ({})", milliseconds(limit), milliseconds(longest)),
            _ => String::new(),
        };
        let mut status = hazard.status.name().to_owned();
        if !hazard.shown.is_empty() {
            status += &format!(": {}", hazard.shown.iter().map(|place| place.name()).collect::<Vec<_>>().join(", "));
        }
        if hazard.bench.is_some() {
            status += &format!("; [bench](#{})", anchor(hazard));
        }
        _ = writeln!(
            table,
            "| **{}** {}: {} | {} | {} | {limit} | {status} |",
            hazard.id,
            hazard.cause,
            hazard.effect,
            text(&hazard.detection),
            text(&hazard.reaction)
        );
    }
    table
}

/// The part that is missing of each hazard, and which do not apply.
fn missing(hazards: &Hazards) -> String {
    let mut text = "\n## What is missing\n\n".to_owned();
    for hazard in &hazards.list {
        if let Some(missing) = &hazard.missing {
            item(&mut text, &format!("**{}**, {}: {missing}", hazard.id, hazard.status.name()));
        }
    }
    text.push('\n');
    let mut reasons: Vec<&String> = hazards.list.iter().filter_map(|hazard| hazard.why.as_ref()).collect();
    reasons.dedup();
    for why in reasons {
        let of = hazards.list.iter().filter(|hazard| hazard.why.as_ref() == Some(why));
        let ids: Vec<String> = of.map(|hazard| hazard.id.to_string()).collect();
        item(&mut text, &format!("**{}** do not apply: {why}", ids.join(", ")));
    }
    text
}

/// The procedures for a board in the hand.
fn procedures(hazards: &Hazards) -> String {
    let mut text = format!("\n{BENCH}");
    for hazard in &hazards.list {
        if let Some(bench) = &hazard.bench {
            _ = write!(text, "\n### {}\n\n{}\n", heading(hazard), bench.trim());
        }
    }
    text
}

fn heading(hazard: &Hazard) -> String {
    format!("Bench {}", hazard.id)
}

/// The address of a heading in the page, as mdBook and GitHub make it.
fn anchor(hazard: &Hazard) -> String {
    heading(hazard).to_lowercase().replace(' ', "-")
}

/// Longest line of a page.
const WIDTH: usize = 150;

/// Adds an item of a list, in lines that are not too long.
fn item(page: &mut String, text: &str) {
    let mut line = "-".to_owned();
    for word in text.split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > WIDTH {
            _ = writeln!(page, "{line}");
            line = " ".to_owned();
        }
        line.push(' ');
        line += word;
    }
    _ = writeln!(page, "{line}");
}
