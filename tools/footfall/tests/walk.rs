//! `footfall walk` through the program: columns and keys, cadences, and what changes do in a stand and at the limits of a gait.

mod common;

use common::{footfall, parts, said};
use cpg_core::Generator;
use generator_file::file::GeneratorFile;
use joint_units::Period;
use serde_json::Value;

/// Exit code, standard output, standard error.
fn walk(arguments: &[&str]) -> (i32, String, String) {
    parts(footfall(["walk"].iter().chain(arguments).copied()))
}

/// The data of a run that must succeed without a message.
fn data(arguments: &[&str]) -> String {
    let (code, out, talk) = walk(arguments);
    assert_eq!((code, talk.as_str()), (0, ""), "{arguments:?}");
    out
}

/// The lines of a run with changes, in 10 ms, and its notes.
fn lines(arguments: &[&str], changes: &[&str]) -> (Vec<Value>, String) {
    let changes: Vec<&str> = changes.iter().flat_map(|change| ["--switch", change]).collect();
    let (code, out, talk) = walk(&[&["--json"], arguments, &changes].concat());
    assert_eq!(code, 0, "{talk}");
    (out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect(), talk)
}

fn cadence(line: &Value) -> f64 {
    line["cadence"].as_f64().expect("a number")
}

fn states(lines: &[Value]) -> Vec<&str> {
    let mut states: Vec<&str> = lines.iter().map(|line| line["state"].as_str().expect("a word")).collect();
    states.dedup();
    states
}

#[test]
fn a_walk_without_a_terminal_is_csv() {
    let table = data(&["--secs", "1", "--every-ms", "100"]);
    assert!(
        table.starts_with("time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg,state\n0.000,"),
        "{table}"
    );
    assert!(table.lines().count() == 12 && table.lines().skip(1).all(|line| line.ends_with(",walking")), "{table}");
    let (gaits, _) = lines(&["--gait", "natural-walk", "--secs", "3"], &["t=1 run", "t=2 stop"]);
    assert_eq!((gaits[50]["gait"].as_str(), gaits[150]["gait"].as_str()), (Some("natural-walk"), Some("run")));
    // A second after the stop: nothing but the knees' 5 degrees.
    let last = gaits.last().expect("a line")["angles_deg"].as_array().expect("angles").clone();
    assert!((last[0].as_f64().unwrap()).abs() < 0.5 && (last[2].as_f64().unwrap() - 5.0).abs() < 0.5, "{last:?}");
}

#[test]
fn all_gaits_are_listed_and_nothing_else_is_asked() {
    let list = data(&["--list"]);
    assert_eq!(list.lines().count(), 13);
    assert!(
        list.lines().any(|line| line.starts_with("human-run ") && line.contains("scaled into the limits")),
        "{list}"
    );
    for beside in [
        &["--speed", "9"][..],
        &["--gait", "walk"],
        &["--cadence", "1"],
        &["--secs", "1"],
        &["--switch", "x"],
        &["--every-ms", "5"],
        &["--csv"],
        &["--json"],
        &["--svg", "x.svg"],
        &["--force"],
    ] {
        let (code, out, talk) = walk(&[&["--list"], beside].concat());
        assert!(code == 2 && out.is_empty() && talk.contains("cannot be used with"), "{beside:?}: {talk}");
    }
    let (code, _, talk) = walk(&["--gait", "list"]);
    assert!(code == 2 && talk.contains("--list says what they are"), "{talk}");
}

/// The keys that `--help` describes are those of a line, and the columns those of the table.
#[test]
fn help_describes_every_key_and_column() {
    let help = data(&["--help"]);
    let (line, _) = lines(&["--secs", "0.1"], &[]);
    for key in line[0].as_object().expect("an object").keys() {
        assert!(help.lines().any(|line| line.split_whitespace().next() == Some(key)), "{key}: {help}");
    }
    for word in ["time_s", "walking", "stopping", "standing", "stop", "start", "cadence 120", "speed 1.2"] {
        assert!(help.contains(word), "{word}: {help}");
    }
}

/// Times at which the left knee passes 40 degrees upward, by line of 10 ms.
fn strides(lines: &[Value]) -> Vec<usize> {
    let knee = |line: &Value| line["angles_deg"][2].as_f64().expect("an angle");
    (1..lines.len()).filter(|&n| knee(&lines[n - 1]) < 40.0 && knee(&lines[n]) >= 40.0).collect()
}

/// A cadence alone is a walk of the family; a sweep changes it evenly from the first to the last; a switch changes it at once.
#[test]
fn a_walk_has_the_cadence_that_is_asked() {
    let lines = |arguments: &[&str]| -> Vec<Value> {
        let text = data(&[&["--json"], arguments].concat());
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
    };
    let even = lines(&["--cadence", "120", "--secs", "10"]);
    assert!(even.iter().all(|line| line["gait"] == "human-walk" && line["cadence"] == 120.0), "{}", even[0]);
    let at = strides(&even);
    assert!(at.len() == 10 && at.windows(2).all(|pair| pair[1].abs_diff(pair[0] + 100) <= 1), "{at:?}");

    let sweep = lines(&["--cadence", "100..130", "--secs", "20"]);
    assert!((cadence(&sweep[0]) - 100.0).abs() < 1e-3 && (cadence(&sweep[2000]) - 130.0).abs() < 1e-3);
    assert!((cadence(&sweep[1000]) - 115.0).abs() < 0.02);
    // 20 s at 115 on average: 19.2 strides, the first of 1.2 s and the last of 0.92 s.
    let at = strides(&sweep);
    assert!((18..=20).contains(&at.len()), "{at:?}");
    assert!((at[1] - at[0]).abs_diff(120) <= 3 && (at[at.len() - 1] - at[at.len() - 2]).abs_diff(93) <= 3, "{at:?}");

    let changes = ["t=2 cadence 125", "t=2.5 cadence 115", "t=3 human-run"];
    let (switched, _) = self::lines(&["--cadence", "100", "--secs", "4"], &changes);
    let (before, after) = (cadence(&switched[199]), cadence(&switched[201]));
    assert!((before - 100.0).abs() < 1e-3 && (after - 125.0).abs() < 1e-3);
    assert_eq!(switched[350]["gait"], "human-run");
    // From a stand the left leg swings first, whatever the phase was.
    for at in ["t=2.0 human-walk", "t=2.3 human-walk", "t=2.6 human-walk"] {
        let started = lines(&["--cadence", "110", "--secs", "4", "--switch", "t=0.5 stop", "--switch", at]);
        let first = |joint: usize| {
            let bent = |line: &Value| line["angles_deg"][joint].as_f64().expect("an angle") > 45.0;
            started[200..].iter().position(bent).expect("it bends")
        };
        assert!(first(2) + 20 < first(3), "{at}: {} {}", first(2), first(3));
    }
    // Any gait has a cadence.
    assert!((cadence(&lines(&["--gait", "walk", "--cadence", "100", "--secs", "1"])[0]) - 100.0).abs() < 1e-3);
}

/// What would be too fast for a joint is refused before anything is played, with the joint, both rates and the largest speed.
#[test]
fn a_speed_beyond_the_rate_limits_is_refused_with_the_largest() {
    let (code, out, talk) = walk(&["--gait", "fast-hop", "--speed", "1.5"]);
    let words = "left_knee of fast-hop would reach 565 deg/s, its limit is 500 deg/s: allowed is up to 1.326";
    assert!(code == 2 && out.is_empty() && talk.contains(words), "{code}: {talk}");
    assert_eq!(walk(&["--gait", "fast-hop", "--speed", "1.326", "--secs", "1"]).0, 0);
    let (code, out, talk) = walk(&["--gait", "natural-walk", "--switch", "t=2 speed 1.2"]);
    let words = "--switch at t=2: speed = 1.2: left_knee of natural-walk would reach 556 deg/s";
    assert!(code == 2 && out.is_empty() && talk.contains(words), "{code}: {talk}");
}

/// A speed or a cadence in a stand does not start the robot. It is kept, with a note, for the next start, by `start` or by a gait.
#[test]
fn a_speed_in_a_stand_waits_for_the_start() {
    for (first, next, after) in [("speed 1.2", "start", 1.2), ("speed 1.2", "walk", 1.2), ("cadence 120", "start", 1.1)]
    {
        let at = |seconds: f64, what: &str| format!("t={seconds} {what}");
        let changes = [at(1.0, "stop"), at(3.0, first), at(4.0, next)];
        let (lines, talk) = lines(&["--secs", "6"], &changes.each_ref().map(String::as_str));
        let kept = if first == "speed 1.2" { "speed 1.2" } else { "a cadence of 120 steps a minute" };
        assert_eq!(talk, format!("note: t=3: {kept} is kept for the next start\n"), "{first}, {next}");
        assert_eq!(states(&lines), ["walking", "stopping", "standing", "walking"], "{first}, {next}");
        let stand = &lines[300..=399];
        assert!(stand.iter().all(|line| line["state"] == "standing"), "{first}, {next}");
        let off = |line: &Value, joint: usize, pose: f64| (line["angles_deg"][joint].as_f64().unwrap() - pose).abs();
        let pose = [0.0, 0.0, 5.0, 5.0];
        assert!(stand.iter().all(|line| (0..4).all(|joint| off(line, joint, pose[joint]) < 1e-5)), "{}", stand[99]);
        assert!((cadence(&lines[350]) - after * 120.0 / 1.1).abs() < 1e-3, "{}", lines[350]);
        let strides = |from: usize, to: usize| {
            (lines[to]["phase"].as_f64().unwrap() - lines[from]["phase"].as_f64().unwrap()).rem_euclid(1.0)
        };
        // Half a second, after the start settled: so many strides.
        assert!((strides(500, 550) - 0.5 * after / 1.1).abs() < 0.02, "{first}, {next}: {}", strides(500, 550));
    }
    // Without a start it stands to the end.
    let (lines, talk) = lines(&["--secs", "4"], &["t=1 stop", "t=3 speed 1.2"]);
    assert!(
        states(&lines) == ["walking", "stopping", "standing"] && talk.contains("kept for the next start"),
        "{talk}"
    );
}

/// What the gait at hand does not allow is refused in a stand too, and a word that changes nothing says so.
#[test]
fn changes_in_a_stand_are_checked() {
    let (code, out, talk) = walk(&["--switch", "t=1 stop", "--switch", "t=2 cadence 300"]);
    assert!(
        code == 2 && out.is_empty() && talk.contains("--switch at t=2: cadence = 300: must be from 54.6 to 163.6"),
        "{talk}"
    );
    let (lines, talk) = lines(&["--secs", "4"], &["t=1 start", "t=2 stop", "t=2.5 stop", "t=3 start"]);
    let notes = "note: t=1: `start` changes nothing, as it walks already\nnote: t=2.5: `stop` changes nothing, as it is stopped already\n";
    assert!(talk == notes && lines[400]["state"] == "walking", "{talk}");
    // A second stop does not disturb the first one.
    let angles = |changes: &[&str]| -> Vec<Value> {
        self::lines(&["--secs", "4"], changes).0.iter().map(|line| line["angles_deg"].clone()).collect()
    };
    assert_eq!(angles(&["t=2 stop", "t=2.1 stop"]), angles(&["t=2 stop"]));
    assert_eq!(angles(&["t=1 start"]), angles(&[]));
}

/// A speed that a gait does not allow is not forgotten: the next gait that allows it has it again, with a note.
#[test]
fn a_speed_that_was_asked_for_comes_back() {
    let (course, talk) =
        lines(&["--speed", "1.2", "--secs", "4"], &["t=1 natural-walk", "t=2 fast-hop", "t=3 natural-walk"]);
    let notes = "note: t=1: natural-walk at speed 1.078, the nearest to 1.2 that it allows\n\
        note: t=2: fast-hop at speed 1.2 again, as asked for before\n\
        note: t=3: natural-walk at speed 1.078, the nearest to 1.2 that it allows\n";
    assert_eq!(talk, notes);
    let speeds = [(50, 1.2, 1.1), (150, 1.078, 1.084), (250, 1.2, 0.5), (350, 1.078, 1.084)];
    assert!(speeds.iter().all(|(n, speed, stride)| (cadence(&course[*n]) - speed * 120.0 / stride).abs() < 1e-3));
    // What was asked for after the note is what counts.
    let (course, talk) = lines(&["--speed", "1.2", "--secs", "4"], &["t=1 natural-walk", "t=2 speed 1.05", "t=3 walk"]);
    assert!(talk.lines().count() == 1 && (cadence(&course[350]) - 1.05 * 120.0 / 1.1).abs() < 1e-3, "{talk}");
}

/// A cadence stays a cadence through changes of gait, and notes are in steps a minute.
#[test]
fn a_cadence_that_was_asked_for_comes_back() {
    let changes = ["t=1 human-run", "t=2 stop", "t=4 human-walk", "t=5 walk", "t=6 natural-walk"];
    let (course, talk) = lines(&["--cadence", "125", "--secs", "7"], &changes);
    let notes = "note: t=1: human-run at a cadence of 154.9 steps a minute, the nearest to 125 that it allows\n\
        note: t=4: human-walk at a cadence of 125 steps a minute again, as asked for before\n\
        note: t=6: natural-walk at a cadence of 119.3 steps a minute, the nearest to 125 that it allows\n";
    assert_eq!(talk, notes);
    for (line, wanted) in [(50, 125.0), (150, 154.9), (350, 154.9), (450, 125.0), (550, 125.0), (650, 119.3)] {
        assert!((cadence(&course[line]) - wanted).abs() < 1e-4, "{}", course[line]);
    }
    let (code, _, talk) = walk(&["--gait", "natural-walk", "--cadence", "125"]);
    let words = "cadence = 125: left_knee of natural-walk would reach 523 deg/s, its limit is 500 deg/s: allowed is up to 119.3";
    assert!(code == 2 && talk.contains(words), "{talk}");
    assert_eq!(walk(&["--gait", "natural-walk", "--cadence", "119.3", "--secs", "0.1"]).0, 0);
}

/// Both ends of a range that a message prints are accepted.
#[test]
fn a_printed_limit_can_be_typed_in() {
    for (gait, option, wrong) in [
        ("human-walk", "--cadence", "90"),
        ("human-run", "--cadence", "90"),
        ("human-run", "--speed", "1.2"),
        ("walk", "--cadence", "900"),
        ("natural-walk", "--speed", "3"),
    ] {
        let (code, _, talk) = walk(&["--gait", gait, option, wrong]);
        let words: Vec<&str> = talk.split_whitespace().collect();
        let after = |word: &str| words[words.iter().position(|w| *w == word).unwrap() + 1];
        assert!(code == 2 && talk.contains("must be from"), "{talk}");
        for end in [after("from"), after("to")] {
            let output = footfall(["walk", "--gait", gait, option, end, "--secs", "0.1"]);
            assert!(output.status.success(), "{gait} {option} {end}: {}", said(&output));
        }
    }
}

/// The angles of a generator, stepped here as a board steps it, in the digits of the table.
fn stepped(mut generator: impl Generator<4>, ticks: u32, every: u32) -> String {
    let mut table = String::from("time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n");
    for tick in 0..=ticks {
        if tick % every == 0 {
            let [a, b, c, d] = generator.angles().map(|angle| angle.degrees());
            table += &format!("{:.3},{a:.4},{b:.4},{c:.4},{d:.4}\n", f64::from(tick) * 1e-3);
        }
        generator.step();
    }
    table
}

/// Every kind of generator file: the default walk, the thesis' network, a shape. The angles are those of the core's steps at 1 ms.
#[test]
fn a_generator_file_is_played_as_the_core_steps_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = |kind: &str| {
        let path = folder.path().join(format!("{kind}.toml"));
        std::fs::write(&path, GeneratorFile::default_of(kind).expect("a default").to_toml()).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let shape = concat!(env!("CARGO_MANIFEST_DIR"), "/../../samples/generator.toml");
    let (walk_file, thesis) = (file("phase-coupled"), file("thesis"));
    let default_walk = cpg_core::gait::default_walk::default_walk(Period::MILLISECOND).unwrap();
    assert_eq!(data(&["--generator", &walk_file, "--secs", "20", "--every-ms", "7"]), stepped(default_walk, 20_000, 7));
    for path in [shape, &thesis] {
        let set = GeneratorFile::read(path.as_ref()).unwrap().set;
        let built = set.build(Period::MILLISECOND).unwrap();
        assert_eq!(data(&["--generator", path, "--secs", "3", "--csv"]), stepped(built, 3_000, 10), "{path}");
    }

    // To a file, which is kept if it is there, and which other commands read.
    let out = folder.path().join("angles.csv");
    let name = out.to_str().unwrap();
    let (code, printed, talk) = walk(&["--generator", &walk_file, "--secs", "20", "--csv", name]);
    assert_eq!((code, printed.as_str(), talk), (0, "", format!("written: {name}\n")));
    let default_walk = cpg_core::gait::default_walk::default_walk(Period::MILLISECOND).unwrap();
    assert_eq!(std::fs::read_to_string(&out).unwrap(), stepped(default_walk, 20_000, 10));
    let (code, _, talk) = walk(&["--generator", &walk_file, "--csv", name]);
    assert!(code == 2 && talk.contains("exists already and is kept"), "{talk}");
    let (code, _, talk) = walk(&["--generator", &walk_file, "--csv", &walk_file, "--force"]);
    assert!(code == 2 && talk.contains("is an input of this command"), "{talk}");
    let (code, printed, talk) = parts(footfall(["check", "--trace", name]));
    assert!(code == 0 && printed.contains("good: `fit` takes it"), "{printed}{talk}");
    // A gait too.
    let gait = folder.path().join("gait.csv");
    let (code, _, talk) = walk(&["--gait", "run", "--secs", "1", "--csv", gait.to_str().unwrap()]);
    assert_eq!(code, 0, "{talk}");
    assert_eq!(std::fs::read_to_string(&gait).unwrap(), data(&["--gait", "run", "--secs", "1", "--csv"]));
}

/// A follower moves with a simulated person, which a note says.
#[test]
fn a_follower_is_played_with_a_simulated_person() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../samples/follower.toml");
    let (code, table, talk) = walk(&["--generator", file, "--secs", "20", "--every-ms", "10"]);
    assert_eq!(code, 0, "{talk}");
    assert!(talk.starts_with("note: a follower: it gets the left_hip angle of a simulated person"), "{talk}");
    let knee = |line: &str| line.split(',').nth(3).unwrap().parse::<f64>().unwrap();
    let late: Vec<f64> = table.lines().skip(1502).map(knee).collect();
    let range =
        |all: &[f64]| all.iter().copied().fold(f64::MIN, f64::max) - all.iter().copied().fold(f64::MAX, f64::min);
    assert!(late.len() == 500 && range(&late) > 30.0, "{}", range(&late));
}
