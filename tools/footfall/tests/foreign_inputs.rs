//! Inputs that stopped a command, or that it took for something else: pipes, long names, times and angles in another unit, guesses with `--strict`.
#![cfg(unix)]

mod common;

use common::{footfall, said, walk};
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn command(words: &[&str], path: &Path) -> Command {
    let argument = |word: &&str| if *word == "FILE" { path.as_os_str().to_owned() } else { OsString::from(*word) };
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.args(words.iter().map(argument)).stdin(Stdio::null());
    command
}

fn run(words: &[&str], path: &Path) -> Output {
    command(words, path).output().expect("footfall runs")
}

/// The same, for what might wait for ever.
fn run_soon(words: &[&str], path: &Path) -> Output {
    let mut child = command(words, path).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("footfall runs");
    let began = Instant::now();
    while child.try_wait().expect("its state").is_none() {
        if began.elapsed() > Duration::from_secs(30) {
            child.kill().expect("ended");
            panic!("{words:?} waits");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().expect("its output")
}

/// A named pipe that nobody writes into.
#[test]
fn a_pipe_is_refused_and_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("walk.csv");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let out = folder.path().join("out.csv");
    let out = out.to_str().unwrap();
    for words in [
        &["check", "--trace", "FILE"][..],
        &["volts", "--trace", "FILE"],
        &["convert", "FILE", "-o", out],
        &["fit", "FILE", "-o", out],
    ] {
        let output = run_soon(words, &pipe);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains("is no regular file; allowed is a recording on disk"), "{}", said(&output));
    }
}

#[test]
fn long_names_are_fitted_and_the_batch_goes_on() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let deep = from.path().join("d".repeat(150)).join("e".repeat(150));
    std::fs::create_dir_all(&deep).unwrap();
    let text = walk(8.0, 1.1, 0.0);
    let long = format!("{}.csv", "n".repeat(250));
    std::fs::write(from.path().join(&long), &text).unwrap();
    // Of the same beginning, and of characters of two bytes.
    std::fs::write(from.path().join(format!("{}m.csv", "n".repeat(249))), walk(8.0, 1.2, 0.0)).unwrap();
    std::fs::write(from.path().join(format!("{}.csv", "é".repeat(124))), walk(8.0, 1.3, 0.0)).unwrap();
    std::fs::write(deep.join("walk.csv"), walk(8.0, 1.0, 0.0)).unwrap();
    std::fs::write(from.path().join("walk.csv"), &text).unwrap();
    let report = to.path().join("pages");
    let fit = || {
        let start: Vec<OsString> = vec!["fit".into(), from.path().into(), "-o".into(), to.path().into()];
        footfall(start.into_iter().chain(["--report".into(), report.clone().into_os_string()]))
    };
    let output = fit();
    let words = said(&output);
    assert_eq!(output.status.code(), Some(0), "{words}");
    assert!(words.contains("5 fitted, 0 already known, 0 failed"), "{words}");
    assert_eq!(words.matches("its name is too long for a file of results").count(), 4, "{words}");
    assert_eq!(std::fs::read_dir(&report).unwrap().count(), 5);
    // They are known the next time.
    assert!(said(&fit()).contains("0 fitted, 5 already known"), "{}", said(&fit()));
}

#[test]
fn a_table_of_radians_called_degrees_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |scale: f64, heading: &str| {
        let mut text = format!("{heading},volts\n");
        (0..12).for_each(|n| {
            text += &format!("{:.4},{:.4}\n", scale * (f64::from(n) * 10.0 - 20.0), 0.4 + 0.2 * f64::from(n))
        });
        text
    };
    for (scale, heading, is_warned) in [
        (1.0, "angle_deg", false),
        (1_f64.to_radians(), "angle_deg", true),
        (1_f64.to_radians(), "angle_rad", false),
        (0.05, "angle_deg", true),
    ] {
        let file = folder.path().join("rows.csv");
        std::fs::write(&file, rows(scale, heading)).unwrap();
        let out = folder.path().join("sensor.toml");
        let output = run(&["calibrate", "FILE", "-o", out.to_str().unwrap(), "--force"], &file);
        let words = said(&output);
        assert_eq!(output.status.code(), Some(0), "{words}");
        assert_eq!(
            words.contains("warning: the table covers") && words.contains("radians?"),
            is_warned,
            "{scale} {heading}: {words}"
        );
    }
}

#[test]
fn convert_judges_the_unit_of_the_times_as_check_does() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("walk.csv");
    let out = folder.path().join("out.csv");
    let text = walk(12.0, 1.1, 0.0);
    std::fs::write(&file, text.replacen("time_s", "time_ms", 1)).unwrap();
    for words in [&["convert", "FILE", "-o", out.to_str().unwrap()][..], &["check", "--trace", "FILE"]] {
        let output = run(words, &file);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(
            said(&output).contains("no leg is that fast") && said(&output).contains("under `time_s`"),
            "{}",
            said(&output)
        );
    }
    assert!(!out.exists());
}

#[test]
fn strict_refuses_a_guess_and_an_option_confirms_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("trial.mot");
    let angles: Vec<String> = walk(8.0, 1.1, 0.0).lines().skip(1).map(|row| row.replace(',', "\t")).collect();
    let head = format!(
        "trial 7\nversion=1\nnRows={}\nnColumns=5\ninDegrees=yes\nendheader\ntime\thip_flexion_l\thip_flexion_r\tknee_angle_l\tknee_angle_r\n",
        angles.len()
    );
    std::fs::write(&file, head + &angles.join("\n") + "\n").unwrap();
    let plain = run(&["check", "--trace", "FILE"], &file);
    assert!(plain.status.success() && said(&plain).contains("`--unit degrees` confirms it"), "{}", said(&plain));
    let strict = run(&["check", "--strict", "--trace", "FILE"], &file);
    assert_eq!(strict.status.code(), Some(1), "{}", said(&strict));
    assert!(run(&["check", "--strict", "--unit", "degrees", "--trace", "FILE"], &file).status.success());
}
