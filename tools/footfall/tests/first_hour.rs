//! What a newcomer reads first: the last line of a fit, a refusal, a command without its board, the names of the gaits.

mod common;

use common::{footfall, parts};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples").join(name)
}

fn of_joints(value: &Value, key: &str) -> f64 {
    let errors = value["joints"].as_array().unwrap().iter().map(|joint| joint[key].as_f64().unwrap());
    (errors.map(|error| error * error).sum::<f64>() / 4.0).sqrt()
}

/// Not the error on the strides that were fitted, which says nothing of others.
#[test]
fn a_fit_ends_with_the_held_out_error_and_its_floor() {
    let folder = tempfile::tempdir().unwrap();
    let recording = sample("walk.mot").into_os_string();
    let (_, json, _) = parts(footfall(["fit".into(), recording.clone(), "--json".into()]));
    let value: Value = serde_json::from_str(&json).unwrap();
    let [error, floor, fitted] =
        ["rmse_heldout_deg", "heldout_floor_deg", "rmse_mean_stride_deg"].map(|key| of_joints(&value, key));
    assert!(fitted < 0.1 * error, "the two differ: {fitted} {error}");
    let (code, _, words) = parts(footfall(["fit".into(), recording, "-o".into(), folder.path().join("a.toml").into()]));
    let end: Vec<&str> = words.lines().rev().take(2).collect();
    assert!(code == 0 && end[0].starts_with("next: "), "{words}");
    assert!(
        end[1].starts_with("walk.mot: shape, 11 strides of ") && end[1].ends_with(&format!(": {floor:.2}")),
        "{words}"
    );
    assert!(end[1].contains(&format!("strides that were not fitted: {error:.2} degrees; ")), "{words}");
    let (_, report, _) = parts(footfall(["check".into(), "--trace".into(), sample("walk.mot").into_os_string()]));
    assert!(report.contains(&format!("strides that were not fitted: {error:.2} degrees; ")), "{report}");
}

#[test]
fn the_sample_is_long_enough_for_a_follower_with_corrections() {
    let recording = sample("walk.csv").into_os_string();
    let call = ["fit".into(), recording.clone(), "--follow".into(), "left_hip".into()];
    let (code, generator, words) = parts(footfall(call));
    assert!(
        code == 0 && generator.contains("[follow.corrections.left_hip]") && !words.contains("no corrections"),
        "{generator}{words}"
    );
    let (code, result, words) = parts(footfall(["entrain".into(), recording, "--sensor".into(), "left_hip".into()]));
    let verdict = result.lines().find(|line| line.starts_with("verdict ")).unwrap();
    assert!(code == 0 && !verdict.contains("above") && !verdict.contains("not_known"), "{verdict}{words}");
}

/// How often the reason of a refusal is printed, on both streams.
fn times_said(arguments: &[&str]) -> usize {
    let (code, out, words) = parts(footfall(arguments));
    let error = words.lines().find_map(|line| line.strip_prefix("error: ")).expect("an error");
    assert_ne!(code, 0, "{words}");
    // The reason follows the name of the file, or a word such as `refused`.
    let reason = error.splitn(3, ": ").last().unwrap();
    assert!(reason.len() > 30, "{reason}");
    format!("{out}{words}").matches(reason).count()
}

#[test]
fn check_and_certify_say_once_why_they_refuse() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let text = std::fs::read_to_string(sample("walk.csv")).unwrap();
    std::fs::write(path("short.csv"), text.lines().take(60).collect::<Vec<_>>().join("\n")).unwrap();
    let robot = std::fs::read_to_string(sample("robot.toml")).unwrap();
    std::fs::write(path("narrow.toml"), robot.replace("range_deg = [-30.0, 45.0]", "range_deg = [-3.0, 4.0]")).unwrap();
    assert_eq!(times_said(&["check", "--trace", &path("short.csv")]), 1);
    assert_eq!(times_said(&["check", "--trace", sample("oscilloscope.csv").to_str().unwrap()]), 1);
    assert_eq!(times_said(&["certify", "human-run-unscaled", "--starts", "20"]), 1);
    let generator = sample("generator.toml");
    let narrow = ["certify", generator.to_str().unwrap(), "--starts", "20", "--robot", &path("narrow.toml")];
    let out = path("certificate.json");
    assert_eq!(times_said(&[narrow.as_slice(), &["-o", &out]].concat()), 1);
}

#[test]
fn without_a_board_a_command_says_how_to_name_one() {
    for (arguments, xtask) in
        [(&["watch"][..], "`cargo xtask run`"), (&["record", "-o", "no.csv"], "`cargo xtask run --record FILE`")]
    {
        let (code, out, words) = parts(footfall(arguments));
        assert!(code == 2 && out.is_empty() && words.starts_with("error: name a board: --serial PORT, "), "{words}");
        assert!(words.contains("--rtt SOURCE") && words.contains(xtask), "{words}");
        let (code, _, words) = parts(footfall([arguments, &["--elf", "a.elf"]].concat()));
        assert!(code == 2 && words.contains("--elf without --virtual-board"), "{words}");
    }
}

#[test]
fn the_list_of_parameters_names_the_gaits() {
    let gaits = ["own", "walk", "natural-walk", "human-walk", "human-run"];
    let (_, list, _) = parts(footfall(["set", "--list"]));
    let (_, json, _) = parts(footfall(["set", "--list", "--json"]));
    let line = list.lines().next().unwrap();
    let value: Value = serde_json::from_str(json.lines().next().unwrap()).unwrap();
    assert!(line.starts_with("gait ") && value["name"] == "gait", "{line}");
    for (number, gait) in gaits.into_iter().enumerate() {
        assert!(line.contains(&format!("{number} {gait}")), "{line}");
        assert_eq!(value["names"][number], gait);
    }
}
