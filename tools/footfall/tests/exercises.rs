//! The exercises of the book: their lines are run, and each result is within the range that the page gives for it.
#![cfg(unix)]

#[path = "exercises/measured.rs"]
mod measured;
#[path = "documented/pages.rs"]
#[allow(dead_code, reason = "one page is read here")]
mod pages;
#[path = "documented/shell.rs"]
mod shell;

use measured::measured;
use pages::command_lines;
use shell::{Shell, root};

/// A result of an exercise, and its range.
struct Expected {
    exercise: usize,
    result: String,
    range: std::ops::RangeInclusive<f64>,
}

/// The section of the exercises.
fn page() -> String {
    let page = std::fs::read_to_string(root().join("docs/analysis.md")).unwrap();
    page.split_once("\n## Exercises\n").expect("the section").1.to_owned()
}

/// The rows of the tables of results.
fn expected(page: &str) -> Vec<Expected> {
    let mut exercise = 0;
    let mut all = Vec::new();
    for line in page.lines() {
        if let Some(title) = line.strip_prefix("### ") {
            exercise = title.split('.').next().and_then(|number| number.parse().ok()).expect("a number");
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [result, range] = cells[..] else { continue };
        let Some((low, high)) = range.split_once(" to ") else { continue };
        let [low, high] = [low, high].map(|number| number.parse().unwrap_or_else(|_| panic!("{line}: no number")));
        all.push(Expected { exercise, result: result.to_owned(), range: low..=high });
    }
    all
}

#[test]
fn every_result_is_within_its_range() {
    let (page, shell) = (page(), Shell::new());
    // How each line ends is what another test asserts: see `documented.rs`.
    for line in command_lines(&page).iter().filter(|line| !line.starts_with("cargo test")) {
        shell.run(line);
    }
    let results = measured(&shell);
    let expected = expected(&page);
    let rows: Vec<_> = expected.iter().map(|row| (row.exercise, row.result.as_str())).collect();
    let names: Vec<_> = results.iter().map(|&(exercise, result, _)| (exercise, result)).collect();
    assert_eq!(rows, names, "the page has other results than this test measures");
    let wrong: Vec<String> = expected
        .iter()
        .zip(&results)
        .filter(|(row, (.., value))| !row.range.contains(value))
        .map(|(row, (.., value))| format!("{}. {}: {value} is not in {:?}", row.exercise, row.result, row.range))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
