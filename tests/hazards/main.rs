//! `hazards.toml` keeps its rules, names tests that exist, and is what `docs/safety.md` says. With `FOOTFALL_WRITE_DOCS=1` the page is written instead.

mod entry;
mod named;
mod page;
mod rules;

use entry::{Hazards, Place};
use footfall_tests::workspace::{assert_none, read, root};
use page::MARKS;
use rules::violations;

/// As many hazards are known, at least: with fewer, the last one has been lost.
const KNOWN: usize = 60;

#[test]
fn every_entry_keeps_the_rules() {
    let hazards = Hazards::of_repository();
    assert!(hazards.list.len() >= KNOWN, "{} hazards of {KNOWN}", hazards.list.len());
    assert_none(&violations(&hazards), &format!("faults of {}", entry::FILE));
}

#[test]
fn the_page_has_the_hazards_of_the_file() {
    const PAGE: &str = "docs/safety.md";
    let found = read(PAGE);
    let [begin, end] = MARKS;
    let (before, rest) = found.split_once(begin).unwrap_or_else(|| panic!("{PAGE} has no line {begin}"));
    let (_, after) = rest.split_once(end).unwrap_or_else(|| panic!("{PAGE} has no line {end}"));
    let page = format!("{before}{begin}\n\n{}\n{end}{after}", page::hazards(&Hazards::of_repository()));
    if std::env::var_os("FOOTFALL_WRITE_DOCS").is_some_and(|value| value == "1") {
        std::fs::write(root().join(PAGE), page).unwrap_or_else(|error| panic!("{PAGE}: {error}"));
        return;
    }
    let differs = found.lines().zip(page.lines()).position(|(found, page)| found != page);
    assert!(
        found == page,
        "{PAGE} differs from {} from line {} on: FOOTFALL_WRITE_DOCS=1 writes it",
        entry::FILE,
        differs.map_or(found.lines().count().min(page.lines().count()) + 1, |line| line + 1)
    );
}

/// A longest time that no test compares with what it measures could be anything. By the text of the file, not of the function; what runs on the host
/// alone counts its ticks exactly.
#[test]
fn each_longest_time_is_named_in_a_file_of_its_tests_that_compares_times() {
    let hazards = Hazards::of_repository();
    let timed = hazards.list.iter().filter(|hazard| hazard.longest_ms.is_some());
    let missing = timed.filter(|hazard| hazard.shown != [Place::Host]).filter(|hazard| {
        let id = format!("\"{}\"", hazard.id);
        let files = hazard.tests.iter().filter_map(|test| test.split_once("::")).map(|(file, _)| read(file));
        !files.into_iter().any(|text| text.contains("assert_in_time(") && text.contains(&id))
    });
    let missing: Vec<String> = missing.map(|hazard| hazard.id.to_string()).collect();
    assert_eq!(missing, [""; 0]);
}

/// A file without a fault, from which the defects below are made.
const SOUND: &str = r#"
[[hazard]]
id = "H01"
cause = "a task hangs"
effect = "the last pulse is repeated"
detection = "watchdog"
reaction = "reset"
limit_ms = 38
longest_ms = 36
status = "shown"
shown = ["virtual-board"]
tests = ["tests/virtual_board.rs::a_task_that_hangs_is_reset_and_boots_disarmed"]
measured = "at most 36 ms"
bench = """
1. Hang it.

Passed if it resets.
"""

[[hazard]]
id = "H02"
cause = "an erase stalls the processor"
effect = "late ticks"
status = "does not apply"
why = "The firmware does not write flash."
"#;

/// A change of the text above, and what is said of it.
const DEFECTS: [(&str, &str, &str); 27] = [
    ("H02", "H03", "H03: the number before it is H01"),
    ("H02", "H01", "H01: the number before it is H01"),
    ("H02", "X2", "`X2` is no ID"),
    ("detection = \"watchdog\"\n", "", "it needs `detection`"),
    ("reaction = \"reset\"\n", "", "it needs `reaction`"),
    ("reaction = \"reset\"", "reaction = \"\"", "`reaction` is no single line"),
    ("\"reset\"", "\"a | b\"", "a vertical bar is not allowed"),
    ("why = \"The firmware does not write flash.\"\n", "", "it needs `why`"),
    ("limit_ms = 38", "limit_ms = 0", "`limit_ms` is not above 0"),
    ("longest_ms = 36\n", "", "it has `limit_ms` and needs `longest_ms`"),
    ("longest_ms = 36", "longest_ms = 39", "`longest_ms` is 39; allowed are 0 to `limit_ms`, 38"),
    ("limit_ms = 38\n", "", "`longest_ms` needs `limit_ms`"),
    ("limit_ms = 38", "limit_s = 38", "unknown field `limit_s`"),
    ("limit_ms = 38", "missing = \"much\"", "it has no `missing`"),
    ("\"shown\"", "\"done\"", "unknown variant `done`"),
    ("\"virtual-board\"", "\"moon\"", "unknown variant `moon`"),
    ("\"virtual-board\"", "\"host\"", "where none of its tests runs"),
    ("\"virtual-board\"", "\"host\"", "a test runs in VirtualBoard"),
    ("[\"virtual-board\"]", "[\"virtual-board\", \"virtual-board\"]", "has VirtualBoard twice"),
    ("a_task_that_hangs", "a_task_that_stands", "the file has no function"),
    (
        "disarmed\"]",
        "disarmed\", \"tests/virtual_board.rs::a_task_that_hangs_is_reset_and_boots_disarmed\"]",
        "is there twice",
    ),
    ("[\"virtual-board\"]", "[\"virtual-board\", \"bench\"]\nwhy = \"x\"", "it has no `why`"),
    ("virtual_board.rs::a", "nowhere.rs::a", "there is no file tests/nowhere.rs"),
    ("a_task_that_hangs_is_reset_and_boots_disarmed", "main", "the function is no test"),
    ("tests = [\"tests/virtual_board.rs::a_task_that_hangs_is_reset_and_boots_disarmed\"]\n", "", "it needs `tests`"),
    ("at most 36 ms", "quick", "`measured` needs a test, a number and a unit"),
    ("\nPassed if it resets.\n", "", "`bench` has no paragraph"),
];

#[test]
fn each_defect_is_found() {
    let faults = |text: &str| match Hazards::parse(text) {
        Ok(hazards) => violations(&hazards).join("\n"),
        Err(error) => error,
    };
    assert_eq!(faults(SOUND), "");
    for (text, defect, words) in DEFECTS {
        assert!(SOUND.contains(text), "{text}");
        let found = faults(&SOUND.replacen(text, defect, 1));
        assert!(found.contains(words), "`{text}` -> `{defect}`: {words} is expected, found:\n{found}");
    }
    let (before, _) = SOUND.split_once("bench = ").expect("a procedure");
    let found = faults(&before.replacen("[\"virtual-board\"]", "[\"virtual-board\", \"bench\"]", 1));
    assert!(found.contains("shown on the bench without a procedure"), "{found}");
    // A hazard that is only partly handled, without a test and without a procedure.
    let partly = SOUND.replacen("\"shown\"", "\"partly\"\nmissing = \"much\"", 1);
    assert_eq!(faults(&partly), "");
    let bare: Vec<&str> =
        partly.lines().filter(|line| !["tests", "shown", "measured"].iter().any(|key| line.starts_with(key))).collect();
    assert_eq!(faults(&bare.join("\n")), "");
    let (before, rest) = bare.split_at(bare.iter().position(|line| line.starts_with("bench")).expect("a procedure"));
    let after = rest.iter().position(|line| *line == "\"\"\"").map(|end| &rest[end + 1..]).expect("its end");
    let found = faults(&[before, after].concat().join("\n"));
    assert_eq!(found, "H01: it has neither `tests` nor a procedure `bench`");
    // Other statuses refuse what the first one has.
    for (status, words) in [("partly", "it needs `missing`"), ("open", "it has no `limit_ms`")] {
        let found = faults(&SOUND.replacen("\"shown\"", &format!("\"{status}\""), 1));
        assert!(found.contains(words), "{status}: {found}");
    }
}
