//! `footfall smer` and the hexapod's orientations through the program: reports, exit codes, refusals, pictures.

mod common;

use common::{footfall, said};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A start of the triangle 1, 2, 3 that lives: 11 steps, in which the nodes operate 6, 3 and 2 times.
const TRIANGLE: &str = "# reversibilities 1, 2 and 3\nb = 2\nc=3\n\na b 2 0  # at a, at b\nb c 2 2\na c 3 0\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn with(text: &str) -> (Self, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("graph.txt");
        std::fs::write(&path, text).unwrap();
        (Self(folder), path)
    }
}

fn smer(path: &Path, more: &[&str]) -> (i32, String) {
    let arguments = ["smer".into(), path.into()].into_iter().chain(more.iter().map(Into::into));
    let output = footfall::<std::ffi::OsString>(arguments);
    (output.status.code().unwrap(), said(&output))
}

fn data(arguments: &[&str]) -> String {
    let output = footfall(arguments.iter().copied());
    assert!(output.status.success() && output.stderr.is_empty(), "{arguments:?}: {}", said(&output));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_live_graph_is_reported() {
    let (_folder, path) = Folder::with(TRIANGLE);
    let (code, text) = smer(&path, &["--steps", "3"]);
    assert_eq!(code, 0, "{text}");
    for line in ["graph        3 nodes, 3 edges", "status       live: a state comes back", "period       11 steps"] {
        assert!(text.lines().any(|found| found == line), "{line}: {text}");
    }
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
    for row in [["b", "2", "3"], ["c", "3", "2"], ["a", "1", "6"]] {
        assert!(rows.iter().any(|found| *found == row), "{row:?}: {text}");
    }
    assert!(text.contains("concurrency  1.000 nodes a step, 0.333 of all"), "{text}");
    assert!(text.ends_with("steps        a a b\n"), "{text}");
    let (code, text) = smer(&path, &["--json", "--steps", "11"]);
    let object: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(
        (code, object["status"].as_str(), object["searched_steps"].as_u64()),
        (0, Some("live"), Some(1_000_000))
    );
    let part = &object["parts"][0];
    assert_eq!((part["period_steps"].as_u64(), part["live_because"].as_str()), (Some(11), Some("repeated_state")));
    assert_eq!(
        (&part["operations"]["a"], &part["operations"]["b"], &part["operations"]["c"]),
        (&6.into(), &3.into(), &2.into())
    );
    assert_eq!(object["steps"].as_array().unwrap().len(), 11);
}

/// A dead graph, one with a part that stops, and one that is too long to be decided: exit code 1, and the report all the same.
#[test]
fn what_stops_or_stays_undecided_ends_with_1() {
    let (_folder, path) = Folder::with("a -> b\nb -> c\nc -> a\nx -> y\n");
    let (code, text) = smer(&path, &[]);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("part 1 of 2") && text.contains("dead: nothing moves after 0 steps"), "{text}");
    assert!(text.contains("each waits for the next: a > b > c > a") && text.contains("live: the graph has no cycle"));
    let (code, text) = smer(&path, &["--json"]);
    let object: Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
    assert_eq!(
        (code, object["status"].as_str(), object["parts"][1]["status"].as_str()),
        (1, Some("dead"), Some("live"))
    );
    assert_eq!(object["parts"][0]["waiting_cycle"], serde_json::json!(["a", "b", "c"]));
    let (_folder, path) = Folder::with(TRIANGLE);
    let (code, text) = smer(&path, &["--search", "9"]);
    assert!(code == 1 && text.contains("undecided: no repeated state was found within 9 steps"), "{text}");
    // The start comes back after 11 steps. Brent's method compares with it until step 1, then with the states after 1, 3, 7 and 15 steps, the
    // last of which it sees again at step 26: until then nothing is found, which is not that nothing came back.
    let (code, text) = smer(&path, &["--search", "25"]);
    assert!(code == 1 && text.contains("nor a stop was found within 25 steps"), "{text}");
    let (code, text) = smer(&path, &["--search", "26"]);
    assert!(code == 0 && text.contains("transient    0 steps\nperiod       11 steps"), "{text}");
    // A graph without a cycle is live whatever its period is.
    let (_folder, path) = Folder::with("a = 999983\nb = 999979\na -> b\n");
    let (code, text) = smer(&path, &["--search", "1000"]);
    assert!(code == 0 && text.contains("live: the graph has no cycle; period unknown"), "{text}");
}

#[test]
fn bad_lines_are_refused_with_line_and_rule() {
    for (text, line, words) in [
        ("", 0, "has no node; allowed are lines `NAME = REVERSIBILITY`, `A -> B`"),
        ("a -> b\na b\n", 2, "`a b`: is no line of a graph; allowed are `NAME = REVERSIBILITY`"),
        ("a -> b c\n", 1, "is no line of a graph"),
        ("a = 0\n", 1, "reversibility `0`; allowed is a whole number from 1 to 1000000"),
        ("a = 1.5\n", 1, "reversibility `1.5`; allowed is a whole number"),
        ("a = 1\n\na = 2\n", 3, "a has a reversibility since line 1; allowed is one"),
        ("a -> a\n", 1, "an edge from a node to itself; allowed are two different nodes"),
        ("a -> b\nb -> a\n", 2, "a second edge between these nodes; allowed is one; the first is on line 1"),
        ("a b 1 -1\n", 1, "tokens `-1`; allowed is a whole number from 0"),
        ("a b 1 4\na = 2\nb = 4\n", 1, "two multiples of 2 with the sum 4, because a has reversibility 2 and b has 4"),
        ("a,b -> c\n", 1, "name `a,b`; allowed are 1 to 16 letters, digits"),
        ("abcdefghijklmnopq -> c\n", 1, "name `abcdefghijklmnopq`; allowed are 1 to 16"),
    ] {
        let (_folder, path) = Folder::with(text);
        let (code, said) = smer(&path, &[]);
        let place = if line == 0 { format!("{}: ", path.display()) } else { format!("{}:{line}: ", path.display()) };
        assert!(code == 2 && said.contains(&place) && said.contains(words), "{text:?}: {said}");
    }
    let large: String = (0..1001).map(|node| format!("n{node} = 1\n")).collect();
    let (_folder, path) = Folder::with(&large);
    assert!(smer(&path, &[]).1.contains("graph.txt:1001: `n1000 = 1`: one node more than the 1000 that are allowed"));
    let (folder, path) = Folder::with("a -> b");
    std::fs::write(&path, [b'a', 0xff]).unwrap();
    assert!(smer(&path, &[]).1.contains("is not text"));
    assert!(smer(&folder.0.path().join("none"), &[]).1.contains("cannot be read"));
}

#[test]
fn steps_and_graph_are_drawn() {
    let (folder, path) = Folder::with(TRIANGLE);
    let svg = folder.0.path().join("graph.svg");
    let draw = |more: &[&str]| smer(&path, &[&["--svg", svg.to_str().unwrap()], more].concat());
    assert_eq!(draw(&[]).0, 0);
    let text = std::fs::read_to_string(&svg).unwrap();
    assert!(text.contains("a bar where the node operates") && text.contains("r = 3") && text.contains("<polygon"));
    let (code, said) = draw(&["--force", "--steps", "10001"]);
    assert!(code == 2 && said.contains("allowed with --svg is up to 10000"), "{said}");
    let many: String = (0..41).map(|node| format!("n{node} -> n{}\n", node + 1)).collect();
    std::fs::write(&path, many).unwrap();
    assert!(draw(&["--force"]).1.contains("the graph has 42 nodes; allowed are up to 40"));
}

#[test]
fn the_98_orientations_of_the_hexapod_are_listed() {
    let list = data(&["hexapod", "--list"]);
    let rows: Vec<Vec<&str>> = list.lines().skip(1).map(|line| line.split_whitespace().collect()).collect();
    let periods = |period: &str| rows.iter().filter(|row| row[4] == period).count();
    assert_eq!((rows.len(), periods("2"), periods("4"), periods("6")), (98, 18, 68, 12));
    assert!(rows.iter().all(|row| (row[4] == "2") == (row[2] == "0" && row[3] == "0")), "{list}");
    assert!(list.contains("dd-dd-lll       0      0      0       2  TL+BL+MR ML+TR+BR\n"), "{list}");
    let object: Value = serde_json::from_str(&data(&["hexapod", "--list", "--json", "--reversibility", "5"])).unwrap();
    let all = object["orientations"].as_array().unwrap();
    assert!(
        all.len() == 98
            && all.iter().all(|one| one["period_steps"] == 6 && one["steps"].as_array().unwrap().len() == 6)
    );
    // Every gait of the list is what the orientation gives, after its transient.
    for row in rows.iter().step_by(7) {
        let steps = data(&["hexapod", "--reversibility", "1", "--orientation", row[0], "--steps", "30"]);
        assert!(steps.contains(&row[5..].join(" ")), "{row:?}: {steps}");
    }
}

#[test]
fn an_orientation_of_the_hexapod_is_chosen() {
    assert_eq!(data(&["hexapod", "--orientation", "dd-dd-lll"]), data(&["hexapod"]));
    assert_eq!(data(&["hexapod"]), "BL ML TL BR MR TR BL ML TL BR MR TR\n");
    let ring = ["hexapod", "--orientation", "dd-du-lrr", "--reversibility", "1"];
    let object: Value = serde_json::from_str(&data(&[&ring[..], &["--json"]].concat())).unwrap();
    assert_eq!(object["circulation"], serde_json::json!({ "ring": 4, "upper": 2, "lower": 2 }));
    assert_eq!((object["period_steps"].as_u64(), object["orientation"].as_str()), (Some(6), Some("dd-du-lrr")));
    let walk = data(&[&ring[..], &["--walk", "--steps", "2"]].concat());
    assert_eq!(walk.lines().count(), 102);
    for (orientation, words) in [
        (
            "dd-uu-lrr",
            "dead, because the upper cycle TL > ML > MR > TR > TL is directed: each of its legs waits for the next",
        ),
        ("uu-dd-rll", "allowed are the 98 orientations without a directed cycle; `footfall hexapod --list` lists them"),
        ("dd-dd", "5 characters: allowed are nine, as in dd-dd-lll"),
        ("dd-dx-lll", "character 5: allowed is u or d"),
    ] {
        let output = footfall(["hexapod", "--orientation", orientation]);
        assert!(output.status.code() == Some(2) && said(&output).contains(words), "{orientation}: {}", said(&output));
    }
    let output = footfall(["hexapod", "--list", "--walk"]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
}

/// (9, 9) has the lattice step 0.9: 0.35 becomes 0.45. At the change to (1, 5) the 9 tokens stay, at that to (4, 6) 7 become 6.
#[test]
fn changes_of_the_building_block_are_rounded_to_the_lattice() {
    let line = ["obb", "--reversibility", "9,9", "--steps", "12", "--switch", "2:1,5 4:4,6", "--json"];
    let object: Value = serde_json::from_str(&data(&line)).unwrap();
    let potentials: Vec<f64> =
        object["stretches"].as_array().unwrap().iter().map(|one| one["flexor_potential"].as_f64().unwrap()).collect();
    // In tenths: 9 - 9 + 9/2, 9 - 1 + 1/2, 6 - 4 + 1.
    assert!(potentials.iter().zip([0.45, 0.85, 0.3]).all(|(a, b)| (a - b).abs() < 1e-6), "{potentials:?}");
    assert_eq!(object["word"], "FEFFFEFFEFEF");
}
