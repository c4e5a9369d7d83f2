//! A folder of what a laboratory has, through `footfall fit`: what is gait is fitted, the rest is named for what it is, and counts add up.

mod common;

use common::{footfall, said, squats, table, walk};
use serde_json::Value;
use std::ffi::OsString;
use std::path::Path;

fn controls() -> String {
    let mut text = String::from(
        "controls\nversion=1\nnRows=200\nnColumns=5\ninDegrees=no\nendheader\ntime\thip_flexion_l\thip_flexion_r\tknee_angle_l\tknee_angle_r\n",
    );
    for row in 0..200 {
        let t = f64::from(row) * 0.01;
        let on = |lead: f64| 0.5 + 0.5 * (7.0 * t + lead).sin().powi(5);
        text += &format!("{t}\t{}\t{}\t{}\t{}\n", on(0.0), on(1.0), on(2.0), on(3.0));
    }
    text
}

fn markers() -> String {
    let mut text = String::from("time_s,LASI_x_mm,LASI_y_mm,LASI_z_mm\n");
    (0..200).for_each(|row| text += &format!("{},{},900.1,1000.2\n", f64::from(row) * 0.01, 100 + row));
    text
}

fn jumps() -> String {
    table(12.0, |t| {
        let bump = |p: f64, from: f64, to: f64| {
            if (from..to).contains(&p) { (std::f64::consts::PI * (p - from) / (to - from)).sin().powi(2) } else { 0.0 }
        };
        let p = t.rem_euclid(2.0);
        let depth = 0.9 * bump(p, 0.1, 0.5) + 0.5 * bump(p, 0.9, 1.6);
        [5.0 + 80.0 * depth, 6.0 + 78.0 * depth, 4.0 + 100.0 * depth, 3.0 + 97.0 * depth]
    })
}

fn fit(from: &Path, to: &Path, more: &[&str]) -> std::process::Output {
    let start: Vec<OsString> = vec!["fit".into(), from.into(), "-o".into(), to.into()];
    footfall(start.into_iter().chain(more.iter().map(Into::into)))
}

/// The numbers of the line with the counts: fitted, known, failed, skipped, files.
fn counts(words: &str) -> [u32; 5] {
    let line = words.lines().find(|line| line.contains(" fitted, ")).unwrap_or_else(|| panic!("{words}"));
    let before = |word: &str| {
        let end = line.find(word)?;
        line[..end].rsplit(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
    };
    [" fitted", " already known", " failed", " skipped", " files;"].map(|word| before(word).unwrap_or(0))
}

/// A column of time stamps is a time, and joints without a recognised time are a failure, not something else than gait.
#[test]
fn recordings_with_another_time_are_not_skipped() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let text = walk(8.0, 1.1, 0.0);
    for (name, heading) in [("stamp.csv", "timestamp,"), ("other.csv", "Uhr,")] {
        std::fs::write(from.path().join(name), text.replacen("time_s,", heading, 1)).unwrap();
    }
    let words = said(&fit(from.path(), to.path(), &[]));
    assert_eq!(counts(&words), [1, 0, 1, 0, 2], "{words}");
    assert!(words.contains("here `--map time=1` if that is `Uhr`"), "{words}");
}

#[test]
fn only_gait_is_fitted_and_the_counts_add_up() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let put = |name: &str, bytes: &[u8]| std::fs::write(from.path().join(name), bytes).unwrap();
    put("walk.csv", walk(8.0, 1.1, 0.0).as_bytes());
    put("squats.csv", squats().as_bytes());
    put("drop_jumps.csv", jumps().as_bytes());
    put("markers.csv", markers().as_bytes());
    put("picture.csv", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01");
    put("pointer.c3d", b"version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 1365568\n");
    put("chart.png", b"\x89PNG\r\n\x1a\n");
    put("standing.csv", table(8.0, |_| [10.0, 11.0, 4.0, 5.0]).as_bytes());
    let output = fit(from.path(), to.path(), &["--jobs", "1"]);
    let words = said(&output);
    let [fitted, known, failed, skipped, files] = counts(&words);
    assert_eq!((fitted, known, files), (1, 0, 7), "{words}");
    assert_eq!(fitted + known + failed + skipped, files, "{words}");
    assert_eq!(output.status.code(), Some(u8::from(failed > 0).into()), "{words}");
    for name in ["squats.csv", "drop_jumps.csv", "markers.csv", "picture.csv", "pointer.c3d", "standing.csv"] {
        let line = words
            .lines()
            .find(|line| (line.starts_with("skipped: ") || line.starts_with("failed: ")) && line.contains(name));
        let line = line.unwrap_or_else(|| panic!("{name} is not named: {words}"));
        assert!(line.len() > name.len() + 20, "no reason: {line}");
        assert!(!to.path().join(format!("{name}.toml")).exists(), "{name} was fitted");
    }
    for name in ["squats.csv", "drop_jumps.csv"] {
        let line = words.lines().find(|line| line.starts_with("skipped: ") && line.contains(name)).unwrap();
        assert!(line.contains("no gait: left and right leg move together"), "{line}");
    }
    assert!(words.contains("not read, because recordings have other extensions: .png 1"), "{words}");
    // The summary has the fitted and the failed ones.
    let summary: Value = serde_json::from_slice(&std::fs::read(to.path().join("summary.json")).unwrap()).unwrap();
    let rows = summary.as_array().unwrap();
    assert_eq!(rows.len() as u32, fitted + failed, "{summary}");
    assert_eq!(rows.iter().filter(|row| row["error"].is_string()).count() as u32, failed, "{summary}");
    assert!(words.contains(&format!("summary of {} recordings, {failed} of them failed", fitted + failed)), "{words}");

    // What was gait and is none any more leaves no generator behind.
    put("walk.csv", squats().as_bytes());
    let words = said(&fit(from.path(), to.path(), &[]));
    assert!(!to.path().join("walk.csv.toml").exists() && !to.path().join("walk.csv.fit.json").exists(), "{words}");
}

/// Actuator controls whose columns have the names of joints: the title line says what they are.
#[test]
fn controls_are_not_fitted() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    std::fs::write(from.path().join("controls.sto"), controls()).unwrap();
    std::fs::write(from.path().join("walk.csv"), walk(8.0, 1.1, 0.0)).unwrap();
    let words = said(&fit(from.path(), to.path(), &[]));
    let [fitted, _, failed, skipped, files] = counts(&words);
    assert_eq!((fitted, failed + skipped, files), (1, 1, 2), "{words}");
    assert!(!to.path().join("controls.sto.toml").exists(), "{words}");
}

#[test]
fn a_warning_is_an_error_with_strict_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("late_leg.csv");
    // The right leg was counted from its own heel strike: nearly half a stride off.
    std::fs::write(&file, walk(8.0, 1.1, 0.52)).unwrap();
    let call = |command: &[&str], more: &[&str]| {
        let start = command.iter().map(OsString::from).chain([file.clone().into()]);
        let output = footfall(start.chain(more.iter().map(Into::into)));
        (output.status.code(), said(&output))
    };
    for command in [&["fit"][..], &["check", "--trace"]] {
        let (code, words) = call(command, &[]);
        assert!(code == Some(0) && words.contains("warning"), "{command:?}: {words}");
        if command[0] == "check" {
            assert!(words.contains("good: `fit` takes it, ") && words.contains(", 2 warnings\n"), "{words}");
        }
        let (code, words) = call(command, &["--strict"]);
        assert!(
            code == Some(1) && words.contains("--strict allows no warning: left and right hips are"),
            "{command:?}: {words}"
        );
    }
    let out = folder.path().join("out");
    let batch = fit(folder.path(), &out, &["--strict"]);
    assert!(
        batch.status.code() == Some(1) && said(&batch).contains("0 fitted, 0 already known, 1 failed"),
        "{}",
        said(&batch)
    );
    // A walk without warning is as good with it.
    std::fs::write(&file, walk(8.0, 1.1, 0.0)).unwrap();
    assert_eq!(call(&["fit"], &["--strict"]).0, Some(0));
}

/// What may not be what it seems is in the lines, in the count and in the summaries of a folder, also of results that were known.
#[test]
fn warnings_are_in_the_summary_of_a_folder() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for (name, lead) in [("late_leg.csv", 0.52), ("walk.csv", 0.0)] {
        std::fs::write(from.path().join(name), walk(8.0, 1.1, lead)).unwrap();
    }
    for line in ["fitted: late_leg.csv, 2 warnings", "known: late_leg.csv, 2 warnings"] {
        let words = said(&fit(from.path(), to.path(), &[]));
        assert!(words.contains(line) && words.contains(": walk.csv\n"), "{words}");
        assert!(words.contains("warning: 1 of the fitted recordings have warnings; "), "{words}");
    }
    let read = |name: &str| std::fs::read_to_string(to.path().join(name)).unwrap();
    let summary: Value = serde_json::from_str(&read("summary.json")).unwrap();
    let warnings = |n: usize| summary[n]["warnings"].as_array().unwrap().len();
    assert_eq!([warnings(0), warnings(1)], [2, 0], "{summary}");
    let table = read("summary.csv");
    assert!(table.lines().next().unwrap().ends_with(",warnings,error"), "{table}");
    assert!(table.lines().nth(1).unwrap().contains("left and right hips are"), "{table}");
    let page = read("summary.html");
    assert!(page.contains("<h2>Warnings</h2>") && page.contains("left and right hips are"), "{page}");
    assert!(page.contains("fitted, with a warning"), "{page}");
}

/// Hips that are 90 degrees apart are beyond the robot's poses: no generator is written, and `check` does not call it good.
#[test]
fn what_does_not_walk_is_not_good() {
    let folder = tempfile::tempdir().unwrap();
    let [file, out] = ["strides.csv", "generator.toml"].map(|name| folder.path().join(name));
    let wide = table(8.0, |t| {
        let p = std::f64::consts::TAU * t / 1.1;
        let knee = |p: f64| 32.0 + 22.0 * (p + 1.4).cos() + 6.0 * (2.0 * p).cos();
        let hip = |p: f64| 15.0 + 45.0 * p.cos() + 1.5 * (2.0 * p + 2.6).cos();
        [hip(p), hip(p + std::f64::consts::PI), knee(p), knee(p + std::f64::consts::PI)]
    });
    std::fs::write(&file, wide).unwrap();
    let checked = footfall(["check".into(), "--trace".into(), OsString::from(&file)]);
    let words = said(&checked);
    assert!(
        checked.status.code() == Some(1) && words.contains("walks: no: ") && !words.contains(": good: "),
        "{words}"
    );
    let fit = |more: &[&str]| {
        let start: Vec<OsString> = vec!["fit".into(), (&file).into(), "-o".into(), (&out).into()];
        let fitted = footfall(start.into_iter().chain(more.iter().map(Into::into)));
        (fitted.status.code(), said(&fitted), out.exists())
    };
    let (code, words, written) = fit(&[]);
    assert!(code == Some(1) && words.contains("walks: no: ") && !written, "{words}");
    let (code, words, written) = fit(&["--fit-limits"]);
    assert!(code == Some(0) && words.contains("walks: yes") && written, "{words}");
    let (code, words, written) = fit(&["--force-write", "--force"]);
    assert!(code == Some(1) && words.contains("walks: no: ") && written, "{words}");
}

/// A follower that is refused is written only on request, and its joint must move.
#[test]
fn a_follower_that_does_not_lock_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let [file, out] = ["slow.csv", "generator.toml"].map(|name| folder.path().join(name));
    let slow = |hip: fn(f64) -> f64| {
        table(40.0, move |t| {
            let p = std::f64::consts::TAU * t / 2.2;
            let knee = |p: f64| 32.0 + 22.0 * (p + 1.4).cos() + 12.0 * (2.0 * p).cos();
            [hip(p), 15.0 + 20.0 * (p + std::f64::consts::PI).cos(), knee(p), knee(p + std::f64::consts::PI)]
        })
    };
    std::fs::write(&file, slow(|p| 15.0 + 20.0 * p.cos())).unwrap();
    let fit = |more: &[&str]| {
        let start: Vec<OsString> = vec!["fit".into(), (&file).into(), "-o".into(), (&out).into()];
        let fitted = footfall(start.into_iter().chain(more.iter().map(Into::into)));
        (fitted.status.code(), said(&fitted), out.exists())
    };
    let (code, words, written) = fit(&["--follow", "left_knee"]);
    let wanted = "starts are not locked after 4 s";
    assert!(
        code == Some(1) && !written && words.contains("refused as a follower: ") && words.contains(wanted),
        "{words}"
    );
    assert!(words.contains("no generator is written") && !words.contains("next: "), "{words}");
    let (code, words, written) = fit(&["--follow", "left_knee", "--force-write"]);
    assert!(code == Some(1) && written && words.contains("the generator is written all the same"), "{words}");
    std::fs::write(&file, slow(|_| 12.0)).unwrap();
    let (code, words, _) = fit(&["--follow", "left_hip", "--force"]);
    assert!(code == Some(2) && words.contains("left_hip does not move (range 0.00 degrees)"), "{words}");
}

/// What `check` calls good, `fit` takes, and the other way round.
#[test]
fn check_says_what_fit_does() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    put("walk.csv", &walk(8.0, 1.1, 0.0));
    put("short.csv", &walk(0.8, 1.1, 0.0));
    put("squats.csv", &squats());
    put("knee.csv", &walk(8.0, 1.1, 0.0).replace("left_hip_deg", "speed").replace("right_hip_deg", "load"));
    put("unnamed.csv", &walk(8.0, 1.1, 0.0).replace("left_hip_deg", "a").replace("left_knee_deg", "b"));
    put("standing.csv", &table(8.0, |_| [10.0, 11.0, 4.0, 5.0]));
    put("empty.csv", "");
    let map: &[&str] = &["--map", "left_hip=a,left_knee=b", "--unit", "degrees"];
    for (name, more, good) in [
        ("walk.csv", &[][..], true),
        ("short.csv", &[], false),
        ("squats.csv", &[], false),
        ("knee.csv", &[], false),
        ("unnamed.csv", &[], false),
        ("unnamed.csv", map, true),
        ("standing.csv", &[], false),
        ("empty.csv", &[], false),
    ] {
        let call = |command: &[&str]| {
            let start = command.iter().map(OsString::from).chain([folder.path().join(name).into()]);
            footfall(start.chain(more.iter().map(Into::into)))
        };
        let (checked, fitted) = (call(&["check", "--trace"]), call(&["fit"]));
        assert_eq!(checked.status.code(), fitted.status.code(), "{name}: {} {}", said(&checked), said(&fitted));
        assert_eq!(
            (fitted.status.code(), said(&checked).contains(": good: ")),
            (Some(if good { 0 } else { 2 }), good),
            "{name}"
        );
        if !good {
            let error = String::from_utf8_lossy(&fitted.stderr).into_owned();
            let why = error.lines().last().and_then(|line| line.strip_prefix("error: ")).unwrap().to_owned();
            assert!(said(&checked).contains(&why), "{name}: {why}: {}", said(&checked));
        }
    }
}
