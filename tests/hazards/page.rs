//! The page `docs/safety.md` and the tables of the README, as text made of `hazards.toml`.

use std::fmt::Write;

use crate::entry::{Hazard, Hazards, Place, Status};

/// The lines of the README between which the tables of counts and times are.
pub(crate) const MARKS: [&str; 2] = [
    "<!-- Counts and times of hazards.toml, written by a test -->",
    "<!-- End of the counts and times of hazards.toml -->",
];

const HEAD: &str = "\
# Safety

What can go wrong with this controller, how it notices that, what it does about it, and where a test has shown so. This page is made of
`hazards.toml`, in which each hazard has its number, and names the tests. `FOOTFALL_WRITE_DOCS=1` and the test program `hazards` write it again.
It is about the STM32F4 boards. What is shown on the virtual board is shown with the image of the Discovery, in some tests also with that of the Black
Pill; the image of the Nucleo is built, and no test runs it. The [Raspberry Pi Pico](pico.md) has fewer protections, which its page names: what is shown here is not shown for it.
Words such as gate, arm and park pose are in the [glossary](architecture.md#words), the reactions to each fault of a sensor in
[Sensor faults](sensor-faults.md). What H02, H03 and H09 mean to the joints, as angles of modelled servos, is in [Modelled servos](servos.md).
";

const READING: &str = "\
## How to read the table

- **limit**: the longest time from the fault to the start of the reaction. A ramp to the park pose takes up to 304 ms more with the
  default limits, then the pulses end; with slower limits in the robot file up to 0.8 s more, and the pulses may end before the pose is reached.
- **shown on**: *link* is the linker, which refuses the cores if a panic is reachable in them, or a test that reads the names in the linked image;
  *host* the computer that runs the tests; *virtual board* the image that would be flashed, on models of the chip ([what it does not show](virtual-board.md#what-it-does-not-show)).
- **longest**: the longest of these times that a test or the campaign measured on the host or on the virtual board, there with the image of the Discovery,
  rounded up. A test fails when a reaction comes after the limit, or a tenth later than the longest; those of H11, H17 and H18 are exact counts of ticks.
- **hardware**: shown with a board in the hand. *procedure* leads to one below that nobody has carried out yet.
- **status**: *shown*: tests show detection and reaction, or that the effect does not come; *partly*: something is missing, which the
  [list below](#what-is-missing) names; *open*: nothing is done about it, or nothing that can be relied on. Each of these has a test or a bench procedure.
  Hazards that do not apply have [a list of their own](#what-does-not-apply).
";

const BENCH: &str = "\
## Bench procedures

For a board in the hand, after the list [Before the first arming](first-walk.md#before-the-first-arming). A procedure to which the table has a link
has not been carried out yet: one that does not work as written is a finding too.
";

/// The whole page.
pub(crate) fn safety(hazards: &Hazards) -> String {
    let mut page = format!("{HEAD}\n## What the controller must not be used for\n\n");
    for sentence in &hazards.not_for {
        item(&mut page, sentence);
    }
    page.push('\n');
    page += READING;
    page += "\n## Hazards\n\n";
    let on_hardware = hazards.list.iter().filter(|hazard| hazard.shown.contains(&Place::Bench)).count();
    match on_hardware {
        0 => page += "**Nothing of this has been shown on hardware.**\n\n",
        _ => _ = writeln!(page, "On hardware {on_hardware} of {} have been shown.\n", hazards.list.len()),
    }
    page += &counts(hazards);
    page.push('\n');
    page += &table(hazards);
    page += &missing(hazards);
    page += &tests(hazards);
    page += &procedures(hazards);
    page
}

/// How many hazards have each status, and where those of that status have been shown.
pub(crate) fn counts(hazards: &Hazards) -> String {
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

/// The hazards with a time limit, and the times that were measured.
pub(crate) fn times(hazards: &Hazards) -> String {
    let mut table =
        "| hazard | status | limit | longest measured | shown on | on hardware |\n|---|---|---|---|---|---|\n"
            .to_owned();
    for hazard in hazards.list.iter().filter(|hazard| hazard.limit_ms.is_some()) {
        let [limit, longest] = [hazard.limit_ms, hazard.longest_ms].map(milliseconds);
        let (status, places) = (hazard.status.name(), places(hazard));
        let hardware = if hazard.shown.contains(&Place::Bench) { "shown" } else { "not measured" };
        _ = writeln!(
            table,
            "| **{}** {}: {} | {status} | {limit} | {longest} | {places} | {hardware} |",
            hazard.id, hazard.cause, hazard.effect
        );
    }
    table
}

/// The places without hardware where it has been shown.
fn places(hazard: &Hazard) -> String {
    let is_shown = |place: &Place| *place != Place::Bench && hazard.shown.contains(place);
    Place::ALL.into_iter().filter(is_shown).map(Place::name).collect::<Vec<_>>().join(", ")
}

/// A time of a table; short ones in microseconds.
fn milliseconds(time: Option<f64>) -> String {
    match time {
        Some(ms) if ms > 0.0 && ms < 0.1 => format!("{} us", (ms * 1e6).round() / 1e3),
        Some(ms) => format!("{ms} ms"),
        None => String::new(),
    }
}

/// A table with a row for each hazard that applies.
fn table(hazards: &Hazards) -> String {
    let mut table =
        "| hazard | detection | reaction | limit | longest | shown on | hardware | status |\n|---|---|---|---|---|---|---|---|\n"
            .to_owned();
    for hazard in hazards.list.iter().filter(|hazard| hazard.status != Status::DoesNotApply) {
        let text = |text: &Option<String>| text.clone().unwrap_or_else(|| "none".to_owned());
        let [limit, longest] = [hazard.limit_ms, hazard.longest_ms].map(milliseconds);
        let hardware = match (hazard.shown.contains(&Place::Bench), &hazard.bench) {
            (true, _) => "shown".to_owned(),
            (false, Some(_)) => format!("[procedure](#{})", anchor(hazard)),
            (false, None) => String::new(),
        };
        _ = writeln!(
            table,
            "| **{}** {}: {} | {} | {} | {limit} | {longest} | {} | {hardware} | {} |",
            hazard.id,
            hazard.cause,
            hazard.effect,
            text(&hazard.detection),
            text(&hazard.reaction),
            places(hazard),
            hazard.status.name()
        );
    }
    table
}

/// What is missing, and what does not apply.
fn missing(hazards: &Hazards) -> String {
    let mut text = "\n## What is missing\n\n".to_owned();
    for hazard in &hazards.list {
        if let Some(missing) = &hazard.missing {
            item(&mut text, &format!("**{}**, {}: {missing}", hazard.id, hazard.status.name()));
        }
    }
    text += "\n## What does not apply\n\n";
    for hazard in &hazards.list {
        if let Some(why) = &hazard.why {
            item(&mut text, &format!("**{}** {}: {} {why}", hazard.id, hazard.cause, sentence(&hazard.effect)));
        }
    }
    text
}

/// The tests of each hazard and what they measured.
fn tests(hazards: &Hazards) -> String {
    let mut text = "\n## Tests, and what they measured\n\n| hazard | tests | measured |\n|---|---|---|\n".to_owned();
    for hazard in hazards.list.iter().filter(|hazard| !hazard.tests.is_empty()) {
        let names: Vec<String> = hazard.tests.iter().map(|name| format!("`{name}`")).collect();
        let measured = hazard.measured.as_deref().unwrap_or_default();
        _ = writeln!(text, "| {} | {} | {measured} |", hazard.id, names.join("<br>"));
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

/// Text with a full stop at its end.
fn sentence(text: &str) -> String {
    format!("{}.", text.trim_end_matches('.'))
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
