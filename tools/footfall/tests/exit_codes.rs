//! The table of exit codes: a row for each command that has more ways to end with 1 than a file, and codes that the program has.

use footfall::cli::program;
use std::path::Path;
use std::process::{Command, Stdio};

fn code(arguments: &[&str]) -> Option<i32> {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples");
    let mut footfall = Command::new(env!("CARGO_BIN_EXE_footfall"));
    let footfall = footfall.current_dir(samples).args(arguments).stdin(Stdio::null());
    footfall.stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap().code()
}

/// The commands of the page's table, with the meaning of 1.
fn rows() -> Vec<(String, String)> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/toolchains.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, table) = page.split_once("| `footfall` | 1 means |\n|---|---|\n").unwrap();
    let rows = table.lines().take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let (name, means) = row.trim_matches(['|', ' ']).split_once(" | ").unwrap();
        (name.trim_matches('`').to_owned(), means.to_owned())
    })
    .collect()
}

#[test]
fn rows_name_commands_and_each_command_refuses_an_unknown_option_with_2() {
    let named: Vec<String> = rows().into_iter().map(|(name, _)| name).collect();
    let program = program();
    let commands: Vec<&str> = program.get_subcommands().map(clap::Command::get_name).collect();
    let in_order: Vec<&str> =
        commands.iter().copied().filter(|command| named.iter().any(|name| name == command)).collect();
    assert_eq!(named, in_order);
    for command in commands {
        assert_eq!(code(&[command, "--no-such-option"]), Some(2), "{command}");
    }
}

#[test]
fn the_rows_are_true_for_what_needs_no_board() {
    for (arguments, wanted) in [
        (&["check", "--generator", "generator.toml"][..], 0),
        (&["check", "--generator", "missing.toml"], 2),
        (&["smer", "graph.txt"], 0),
        (&["convert", "missing.csv", "-o", "never.csv"], 2),
        (&["pack", "generator.toml", "--rust"], 0),
        (&["pack", "robot.toml", "--rust"], 2),
        (&["replay", "walk.csv"], 2),
        (&["sample", "graph.txt"], 0),
    ] {
        assert_eq!(code(arguments), Some(wanted), "{arguments:?}");
    }
    let graph = tempfile::NamedTempFile::new().unwrap();
    // Three nodes in a circle: none is ever one that all its edges point to.
    std::fs::write(graph.path(), "a -> b\nb -> c\nc -> a\n").unwrap();
    let circle = graph.path().to_str().unwrap();
    assert_eq!(code(&["smer", circle]), Some(1));
}

/// Input that is correct, and a result that is not sound.
#[test]
fn the_rows_are_true_for_what_makes_1_without_a_board() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples");
    let robot = std::fs::read_to_string(samples.join("robot.toml")).unwrap();
    let narrow = robot.replace("range_deg = [-30.0, 45.0]", "range_deg = [-3.0, 4.0]");
    assert_ne!(narrow, robot);
    std::fs::write(path("narrow.toml"), narrow).unwrap();
    // One of two recordings has no stride.
    std::fs::create_dir(path("walks")).unwrap();
    std::fs::copy(samples.join("walk.csv"), path("walks/walk.csv")).unwrap();
    let rows = (0..2000).map(|n| format!("{},{},0,5,5\n", f64::from(n) * 0.01, n / 100 % 10)).collect::<String>();
    let names = "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n";
    std::fs::write(path("walks/stairs.csv"), format!("{names}{rows}")).unwrap();
    // A system at rest has no cycle, though its parameters are allowed.
    let at_rest = ["oscillator:hopf", "--set", "square_radius=-1"];
    for arguments in [
        &["certify", "generator.toml", "--starts", "20", "--robot", &path("narrow.toml"), "-o", &path("one.json")][..],
        &["fit", &path("walks"), "-o", &path("fits")],
        &["merge", &path("fits")],
        &["sync", "edges.csv", "--against", "line-recorder.csv"],
        &[["phase-response"].as_slice(), &at_rest].concat(),
        &[["tongue"].as_slice(), &at_rest].concat(),
    ] {
        assert_eq!(code(arguments), Some(1), "{arguments:?}");
    }
}
