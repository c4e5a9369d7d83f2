//! Every command line of the pages and of the help texts is run as it is written, or stands in [`NOT_RUN`] with the reason.
//!
//! The lines of a page are run from top to bottom in one folder, which has copies of `samples` and `tests/traces`; a line may use a file
//! that an earlier one has made.
#![cfg(unix)]

#[path = "documented/not_run.rs"]
mod not_run;
#[path = "documented/pages.rs"]
mod pages;
#[path = "documented/shell.rs"]
mod shell;

use footfall::cli::examples::EXAMPLES;
use not_run::{FAILS, NOT_RUN};
use pages::{Page, command_lines, pages};
use shell::{Shell, root};
use std::collections::BTreeSet;
use std::sync::Mutex;

/// The examples of each command's help, as pages.
fn helps() -> Vec<Page> {
    let lines = |examples: &[(&str, &str)]| examples.iter().map(|(_, line)| (*line).to_owned()).collect();
    EXAMPLES.iter().map(|(name, examples)| Page { name: format!("help of {name}"), lines: lines(examples) }).collect()
}

/// Runs the lines of a page; gives those that do not end as they should.
fn run(page: &Page) -> Vec<String> {
    let shell = Shell::new();
    let mut wrong = Vec::new();
    for line in page.lines.iter().filter(|line| !is_listed(line)) {
        let output = shell.run(line);
        let expected = FAILS.iter().find(|(fails, ..)| fails == line).map_or(0, |(_, code, _)| *code);
        if output.status.code() != Some(expected) {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            wrong.push(format!("{}: `{line}`: {}, {expected} is expected:\n{said}", page.name, output.status));
        }
    }
    wrong
}

fn is_listed(line: &str) -> bool {
    NOT_RUN.iter().any(|(_, lines)| lines.contains(&line))
}

#[test]
fn every_line_runs_as_it_is_written() {
    let pages: Vec<Page> = pages(&root()).into_iter().chain(helps()).collect();
    let run_lines: usize = pages.iter().map(|page| page.lines.iter().filter(|line| !is_listed(line)).count()).sum();
    assert!(run_lines > 60, "{run_lines} lines");
    let (waiting, wrong) = (Mutex::new(pages), Mutex::new(Vec::new()));
    let next = || waiting.lock().unwrap().pop();
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(page) = next() {
                    let of_page = run(&page);
                    wrong.lock().unwrap().extend(of_page);
                }
            });
        }
    });
    let mut wrong = wrong.into_inner().unwrap();
    wrong.sort();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What pages quote, in a block behind the lines that print it; the pages, each with the least number of quoted lines.
#[test]
fn quoted_output_is_printed() {
    for (page, least) in [("docs/from-your-lab.md", 6), ("docs/fitting.md", 6)] {
        let quoted = quoted_lines(&std::fs::read_to_string(root().join(page)).unwrap());
        assert!(quoted >= least, "{page}: {quoted} lines");
    }
}

/// Runs the lines before each quote of a page; gives how many lines are quoted.
fn quoted_lines(page: &str) -> usize {
    let shell = Shell::new();
    let blocks: Vec<&str> = page.split("\n```").skip(1).step_by(2).collect();
    let mut quoted = 0;
    for pair in blocks.windows(2) {
        let (Some(lines), Some(quote)) = (pair[0].strip_prefix("sh\n"), pair[1].strip_prefix("text\n")) else {
            continue;
        };
        let outputs = command_lines(&format!("```sh\n{lines}\n```\n")).into_iter().map(|line| shell.run(&line));
        let printed: String = outputs
            .map(|output| {
                [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat()
            })
            .collect();
        for line in quote.lines() {
            assert!(printed.contains(line), "not printed: {line}\n{printed}");
            quoted += 1;
        }
    }
    quoted
}

#[test]
fn the_lists_have_no_line_that_no_page_has() {
    let pages: Vec<Page> = pages(&root()).into_iter().chain(helps()).collect();
    let lines: BTreeSet<&str> = pages.iter().flat_map(|page| page.lines.iter().map(String::as_str)).collect();
    let listed = NOT_RUN.iter().flat_map(|(_, lines)| lines.iter()).chain(FAILS.iter().map(|(line, ..)| line));
    let left_over: Vec<&&str> = listed.clone().filter(|line| !lines.contains(**line)).collect();
    assert!(left_over.is_empty(), "no page has these lines any more: {left_over:#?}");
    let once: BTreeSet<&&str> = listed.clone().collect();
    assert_eq!(once.len(), listed.count(), "a line is listed twice");
    assert!(
        NOT_RUN.iter().all(|(reason, _)| !reason.is_empty()) && FAILS.iter().all(|(_, _, reason)| !reason.is_empty())
    );
}

#[test]
fn command_lines_are_found_where_pages_have_them() {
    let page = "# A\n\nText with `cargo footfall walk --secs 1`, `footfall walk`, `cargo xtask`, `x` and `cargo\ntest -p a`.\n\n\
                ```sh\n# a comment\nfootfall fit a.csv   # why\n\ncp a b\n```\n\n```text\nfootfall no\n```\n\n    \
                cargo footfall obb --svg \"a # b.svg\"  # why\n    other\n\n| `footfall merge fits`, `footfall fit` |\n";
    let wanted = [
        "cargo footfall walk --secs 1",
        "cargo test -p a",
        "footfall fit a.csv",
        "cp a b",
        "cargo footfall obb --svg \"a # b.svg\"",
        "footfall merge fits",
    ];
    assert_eq!(command_lines(page), wanted);
    let console = "```console\n$ footfall one \\\n      --two\noutput\n$ footfall three\n```\n";
    assert_eq!(command_lines(console), ["footfall one --two", "footfall three"]);
}
