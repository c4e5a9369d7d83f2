//! `phase-response`, `tongue`, `basin` and `bifurcation`: what they print and write, the pictures of `docs/analysis.md`, and wrong input.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

const PAGE: &str = include_str!("../../../docs/analysis.md");

fn footfall(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_footfall")).current_dir(folder).args(arguments).output().expect("it runs")
}

fn json(arguments: &[&str]) -> Value {
    let output = footfall(Path::new("."), &[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one object")
}

/// The pictures of the page are what its lines draw, to the pixel, and its tables have the printed numbers.
#[test]
fn the_pictures_and_numbers_of_the_page_are_what_its_lines_give() {
    let folder = tempfile::tempdir().unwrap();
    let mut drawn = 0;
    for line in PAGE.lines().filter_map(|line| line.strip_prefix("    cargo footfall ")) {
        let Some((_, name)) = line.split_once("--svg ") else { continue };
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let output = footfall(folder.path(), &arguments);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
        let [new, old] = [folder.path().join(name), stored].map(|path| std::fs::read_to_string(path).expect(name));
        assert_eq!(new, old, "docs/{name} is not what `footfall {line}` draws");
        assert!(PAGE.contains(&format!("]({name})")), "docs/analysis.md does not show {name}");
        let said = String::from_utf8_lossy(&output.stdout);
        let quoted = PAGE.split(line).nth(1).and_then(|rest| rest.split("```").nth(1)).expect("a quote");
        for row in quoted.lines().skip(1) {
            assert!(said.contains(row), "`footfall {line}` does not print `{row}` but\n{said}");
        }
        drawn += 1;
    }
    assert_eq!(drawn, 4);
}

/// Every value is in the CSV: a kick that is lost has an empty shift.
#[test]
fn a_lost_kick_is_reported_and_empty_in_the_csv() {
    let folder = tempfile::tempdir().unwrap();
    let output = footfall(
        folder.path(),
        &[
            "phase-response",
            "oscillator:morris-lecar",
            "--set",
            "current=90",
            "--kick",
            "0.5",
            "--phases",
            "24",
            "-o",
            "a.csv",
        ],
    );
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("do not come back"), "{said}");
    let csv = std::fs::read_to_string(folder.path().join("a.csv")).unwrap();
    let lost = csv.lines().filter(|line| line.split(',').nth(2) == Some("")).count();
    assert!(csv.lines().count() == 25 && lost > 0 && said.contains(&format!("{lost} of 24")), "{csv}\n{said}");
}

#[test]
fn a_map_of_locks_says_what_is_undecided() {
    let of = |extra: &[&str]| {
        json(&[&["tongue", "oscillator:hopf", "--lock", "1:1", "--columns", "9", "--rows", "2"], extra].concat())
    };
    let object = of(&["--ratio", "0.55..1.45", "--strength", "0.4"]);
    let cells = object["cells"].as_array().expect("cells");
    let verdict = |ratio: f64, strength: f64| {
        let near = |cell: &&Value| {
            (cell["ratio"].as_f64().unwrap() - ratio).abs() < 1e-6
                && (cell["strength"].as_f64().unwrap() - strength).abs() < 1e-6
        };
        cells.iter().find(near).expect("a cell")["verdict"].as_str().unwrap().to_owned()
    };
    // Adler's equation: it locks within half the strength of its own frequency, for a weak input.
    assert_eq!(
        [verdict(1.0, 0.3), verdict(1.1, 0.3), verdict(1.4, 0.3), verdict(1.2, 0.1)],
        ["1:1", "1:1", "slips", "slips"]
    );
    // Off by less than one cycle in the longest window.
    let near = of(&["--ratio", "1.0005..1.0014", "--strength", "0.0002"]);
    assert_eq!(near["cells"][17]["verdict"], "undecided", "{near}");
}

#[test]
fn a_generator_file_is_analysed_with_its_parameters() {
    let folder = tempfile::tempdir().unwrap();
    let file = generator_file::file::GeneratorFile::default_of("phase-coupled").expect("the walk").to_toml();
    std::fs::write(folder.path().join("walk.toml"), file).unwrap();
    let output = footfall(
        folder.path(),
        &["phase-response", "walk.toml", "--set", "natural_period_s=2", "--phases", "8", "--json"],
    );
    let object: Value = serde_json::from_slice(&output.stdout).expect("one object");
    // 1.014033 times the natural period at eps = kap = 0.5.
    assert!((object["period"].as_f64().unwrap() - 2.028_066).abs() < 1e-4, "{object}");
    assert_eq!(object["variable"], "left_hip.velocity");
}

#[test]
fn wrong_input_is_named_with_what_is_allowed() {
    for (arguments, words) in [
        (&["phase-response", "oscillator:pendulum"][..], "allowed behind `oscillator:` is one of van-der-pol"),
        (&["tongue", "canter"], "allowed is a generator file, or one of oscillator:van-der-pol"),
        (&["basin", "oscillator:hopf", "--x", "z=0..1"], "--x `z`: allowed is one of x, y"),
        (&["basin", "oscillator:hopf", "--x", "y=0..1"], "allowed are two different states"),
        (&["basin", "fourier"], "its only state is a phase"),
        (&["bifurcation", "oscillator:hopf", "--parameter", "gain=-1..1"], "gain = -1: allowed is 0.001 to 100"),
        (&["bifurcation", "oscillator:hopf", "--parameter", "gain=1"], "allowed is NAME=FROM..TO"),
        (&["bifurcation", "hopf", "--parameter", "gain=1..2"], "this generator has no parameters"),
        (
            &["phase-response", "oscillator:hopf", "--set", "mu=2"],
            "`mu`: allowed is one of gain, square_radius, frequency",
        ),
        (&["phase-response", "oscillator:hopf", "--kick", "0"], "allowed is -10 to 10, and not 0"),
        (&["tongue", "oscillator:hopf", "--lock", "1:0"], "allowed is N:M with whole numbers from 1 to 9"),
        (&["tongue", "oscillator:hopf", "--ratio", "2..1"], "allowed is FROM..TO from 0.05 to 20"),
        (&["phase-response", "oscillator:hopf", "--variable", "z"], "--variable `z`: allowed is one of x, y"),
    ] {
        let output = footfall(Path::new("."), arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(words), "{arguments:?}: {:?}: {said}", output.status);
    }
    // Correct input, of a system without a cycle.
    let output = footfall(Path::new("."), &["tongue", "oscillator:fitzhugh-nagumo", "--set", "current=0.1"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("`rest`"), "{said}");
    let output = footfall(Path::new("."), &["phase-response", "thesis"]);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
}
