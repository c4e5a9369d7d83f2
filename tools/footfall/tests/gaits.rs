//! The commands that show generators, through the binary: exact words, exit codes, and what is on which stream.

mod common;

use serde_json::Value;

/// Exit code, standard output, standard error.
fn footfall(arguments: &[&str]) -> (i32, String, String) {
    common::parts(common::footfall(arguments.iter().copied()))
}

/// The data of a command that must succeed without a word of talk.
fn data(arguments: &[&str]) -> String {
    let (code, out, talk) = footfall(arguments);
    assert_eq!((code, talk.as_str()), (0, ""), "{arguments:?}");
    out
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&data(arguments)).expect("JSON")
}

/// The paper's start, 0.35 and 0.65: a first burst of four letters, shorter or longer than the later ones, then the Christoffel word.
#[test]
fn the_firing_words_of_the_building_block() {
    let word = |pair: &str, steps: &str| data(&["obb", "--reversibility", pair, "--steps", steps]);
    assert_eq!(word("1,5", "24"), "FFFFEFFFFFEFFFFFEFFFFFEF\n");
    assert_eq!(word("1,3", "17"), "FFFFEFFFEFFFEFFFE\n");
    assert_eq!(word("1,1", "11"), "FFFFEFEFEFE\n");
    let full = |pair: &str| data(&["obb", "--reversibility", pair, "--steps", "8", "--start", "full"]);
    assert_eq!(full("3,5"), "FFEFFEFE\n");
    assert_eq!(full("2,3"), "FFEFEFFE\n");
}

/// (1,5), then (1,3) from step 54, then (1,1) from step 100.
#[test]
fn the_transition_of_the_building_block() {
    let switch = "54:1,3 100:1,1";
    let arguments = ["obb", "--reversibility", "1,5", "--steps", "140", "--switch", switch];
    let slow = format!("FFFFE{}F", "FFFFFE".repeat(8));
    assert_eq!(slow.len(), 54);
    let middle = format!("FFFFE{}F", "FFFE".repeat(10));
    assert_eq!(middle.len(), 46);
    let fast = format!("FFE{}F", "FE".repeat(18));
    assert_eq!(fast.len(), 40);
    let wanted = slow + &middle + &fast;
    assert_eq!(data(&arguments), wanted.clone() + "\n");
    let object = json(&[arguments.as_slice(), &["--json"]].concat());
    assert_eq!((object["word"].as_str(), object["period_steps"].as_u64()), (Some(wanted.as_str()), Some(2)));
    assert_eq!(object["flexor_fired"].as_u64(), Some(wanted.matches('F').count() as u64));
    // At the end, like the period; and each stretch has its own.
    assert_eq!(object["reversibility"], "1,1");
    let stretches = object["stretches"].as_array().expect("stretches");
    let of = |key: &str| stretches.iter().map(|one| one[key].clone()).collect::<Vec<_>>();
    assert_eq!(of("from_step"), [0, 54, 100]);
    assert_eq!(of("to_step"), [54, 100, 140]);
    assert_eq!(of("reversibility"), ["1,5", "1,3", "1,1"]);
    assert_eq!(of("period_steps"), [6, 4, 2]);
    let fired = [&wanted[..54], &wanted[54..100], &wanted[100..]].map(|word| word.matches('F').count());
    assert_eq!(of("flexor_fired"), fired);
    assert_eq!(of("extensor_fired"), [54 - fired[0], 46 - fired[1], 40 - fired[2]]);
}

/// The ladder: the wave, the middle gait from step 54, the tripod from step 100.
#[test]
fn the_swings_of_the_hexapod_through_all_three_gaits() {
    let walk = |options: &[&str]| data(&[&["hexapod", "--reversibility", "5"], options].concat());
    let wave = "BL ML TL BR MR TR";
    assert_eq!(walk(&["--steps", "12"]), format!("{wave} {wave}\n"));
    let mut words = vec![wave; 9];
    words.extend(["BL ML+BR TL+MR TR"; 11]);
    words.push("BL ML+BR");
    words.extend(["TL+BL+MR ML+TR+BR"; 5]);
    let all = walk(&["--steps", "110", "--switch", "54:3 100:1"]);
    assert_eq!(all, words.join(" ") + "\n");
    let object = json(&["hexapod", "--steps", "110", "--switch", "54:3 100:1", "--json"]);
    let legs = |step: &Value| {
        let legs = step.as_array().expect("legs").iter().map(|leg| leg.as_str().expect("a name").to_owned());
        legs.collect::<Vec<_>>().join("+")
    };
    let steps: Vec<String> = object["steps"].as_array().expect("steps").iter().map(legs).collect();
    assert_eq!(steps.join(" ") + "\n", all);
    assert_eq!(object["reversibility"], 1);
}

/// Six columns; a leg goes forward only in the steps that the words name, and no angle jumps.
#[test]
fn the_setpoints_of_the_hexapod() {
    let table = data(&["hexapod", "--walk", "--steps", "24", "--step-s", "0.5", "--switch", "12:1", "--every-ms", "1"]);
    let mut lines = table.lines();
    let header = "time_s,top_left_deg,middle_left_deg,bottom_left_deg,top_right_deg,middle_right_deg,bottom_right_deg";
    assert_eq!(lines.next(), Some(header));
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    assert_eq!(rows.len(), 12_001);
    let largest = |rows: &[Vec<f64>]| {
        let pairs = rows.windows(2);
        pairs.flat_map(|pair| (1..7).map(move |leg| (pair[1][leg] - pair[0][leg]).abs())).fold(0.0, f64::max)
    };
    // 40 degrees in half a second, at most one and a half times as fast as evenly, and a little for the lift.
    assert!(largest(&rows) < 0.16, "{}", largest(&rows));
    let swinging = |rows: &[Vec<f64>]| (1..7).filter(|&leg| rows[499][leg] - rows[0][leg] > 10.0).count();
    assert_eq!((0..8).map(|step| swinging(&rows[500 * step..])).collect::<Vec<_>>(), [1; 8]);
    assert_eq!((18..23).map(|step| swinging(&rows[500 * step..])).collect::<Vec<_>>(), [3; 5]);
    let first = data(&["hexapod", "--walk", "--steps", "1", "--json"]);
    let first: Value = serde_json::from_str(first.lines().next().expect("a line")).expect("JSON");
    assert_eq!((first["t_s"].as_f64(), first["angles_deg"].as_array().map(Vec::len)), (Some(0.0), Some(6)));
}

#[test]
fn wrong_input_ends_with_2_and_names_what_is_allowed() {
    for arguments in [
        &["obb", "--reversibility", "1;5"][..],
        &["obb", "--reversibility", "0,5"],
        &["obb", "--reversibility", "1,5", "--switch", "10:1,3 9:1,1"],
        &["obb", "--reversibility", "1,5", "--svg", "x.svg", "--steps", "10001"],
        &["obb", "--reversibility", "1,5", "--switch", "24:1,3"],
        &["walk", "--secs", "3", "--switch", "t=3.5 run"],
        &["walk", "--switch", "t=8 run", "--switch", "t=1 stop"],
        &["hexapod", "--switch", "x:1"],
        &["hexapod", "--switch", "5:0"],
        &["hexapod", "--walk", "--step-s", "0"],
        &["walk", "--gait", "canter"],
        &["walk", "--gait", "list"],
        &["walk", "--speed", "3"],
        &["walk", "--cadence", "90..130"],
        &["walk", "--cadence", "fast"],
        &["walk", "--cadence", "100..140"],
        &["walk", "--cadence", "100..120", "--gait", "walk"],
        &["walk", "--cadence", "100..120", "--switch", "t=1 stop"],
        &["walk", "--cadence", "160", "--gait", "human-walk"],
        &["walk", "--gait", "human-run", "--speed", "1.2"],
        &["walk", "--cadence", "110", "--switch", "t=1 cadence 150"],
        &["walk", "--secs", "0"],
        &["walk", "--switch", "t=1"],
        &["walk", "--switch", "t=1 stop", "--switch", "t=2 speed 3"],
        &["certify", "no-such-set"],
    ] {
        let (code, out, talk) = footfall(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {talk}");
        assert!(["allowed", "must be", "no-such-set"].iter().any(|word| talk.contains(word)), "{arguments:?}: {talk}");
    }
}

/// A change that would never come names itself and the end.
#[test]
fn a_change_after_the_end_is_refused_with_both_times() {
    let talk = |arguments: &[&str]| footfall(arguments).2;
    let said = talk(&["walk", "--secs", "3", "--switch", "t=1 run", "--switch", "t=3.5 stop"]);
    assert!(said.contains("--switch at t=3.5, --secs 3: allowed are changes up to the end, or a later end"), "{said}");
    let said = talk(&["walk", "--switch", "t=8 run"]);
    assert!(said.contains("--switch at t=8, without --secs the end is at 5: allowed"), "{said}");
    let said = talk(&["obb", "--reversibility", "1,5", "--steps", "54", "--switch", "54:1,3"]);
    assert!(said.contains("--switch at step 54, --steps 54: allowed are changes at step 53 or before"), "{said}");
    let said = talk(&["hexapod", "--switch", "5:3 12:1"]);
    assert!(said.contains("--switch at step 12, --steps 12: allowed are changes at step 11 or before"), "{said}");
    assert_eq!(footfall(&["walk", "--secs", "3", "--switch", "t=3 run"]).0, 0);
    assert_eq!(footfall(&["hexapod", "--switch", "5:3 11:1"]).0, 0);
}

/// The thesis' set: a word of its own, on both streams, and exit code 1.
#[test]
fn a_quasi_periodic_generator_is_named_so() {
    let (code, out, talk) = footfall(&["certify", "thesis", "--starts", "20"]);
    assert_eq!(code, 1, "{talk}");
    assert!(out.contains("quasi-periodic: steady, but the phases of the joints drift"), "{out}");
    assert!(talk.contains("refused: quasi-periodic: the phases of its joints drift"), "{talk}");
    let (code, out, _) = footfall(&["certify", "thesis", "--starts", "20", "--json"]);
    let object: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, object["accepted"].as_bool()), (1, Some(false)));
    assert_eq!((object["status"].as_str(), object["drive"]["walks"].as_bool()), (Some("quasi_periodic"), Some(true)));
}

/// Every name of the list is certified; another one is refused with the names.
#[test]
fn gaits_and_models_are_certified_by_name() {
    let list = data(&["certify", "--list"]);
    assert!(list.lines().count() == 30 && list.contains("half-centre ") && list.contains("gallop-run "), "{list}");
    let (code, out, _) = footfall(&["certify", "cell-walk", "--starts", "20"]);
    assert!(code == 0 && out.contains("walks                  yes, no limit acts"), "{out}");
    let (code, _, talk) = footfall(&["certify", "canter"]);
    assert!(code == 2 && talk.contains("allowed is a generator file, or one of phase-coupled, thesis"), "{talk}");
}

#[test]
fn the_default_walk_is_accepted_with_its_tongue() {
    let (code, out, _) = footfall(&["certify", "phase-coupled", "--starts", "50", "--json"]);
    let object: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, object["status"].as_str(), object["converged"].as_u64()), (0, Some("accepted"), Some(50)));
    let tongue = object["entrainment"].as_array().expect("a tongue");
    let widths = tongue.iter().map(|at| at["high_hz"].as_f64().unwrap() - at["low_hz"].as_f64().unwrap());
    let widths: Vec<f64> = widths.collect();
    assert!(widths.len() == 3 && widths.is_sorted() && widths[0] > 0.005, "{widths:?}");
}

#[test]
fn every_figure_is_written_and_has_its_axes() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = data(&["figures", "--out", folder.path().to_str().expect("text")]);
    let names: Vec<&str> = files.lines().filter_map(|line| line.rsplit('/').next()).collect();
    let wanted = "thesis-2-4 thesis-2-5 thesis-2-6 thesis-2-7 thesis-2-8 thesis-links thesis-5-1 thesis-5-2 thesis-5-3 thesis-5-4 thesis-5-5 thesis-5-6 thesis-hip-knee yang-1 yang-3 yang-4 yang-change-40-s yang-2 hexapod-steps hexapod-printed-roles matsuoka-networks matsuoka-control";
    assert_eq!(names.iter().map(|name| name.trim_end_matches(".svg")).collect::<Vec<_>>().join(" "), wanted);
    for name in names {
        let text = std::fs::read_to_string(folder.path().join(name)).expect("a file");
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{name}");
        let is_graph = ["thesis-links.svg", "yang-1.svg", "yang-2.svg"].contains(&name);
        let axis =
            ["time, s", "time, cycles", "angle, deg", "step", "factor on Tr"].iter().any(|axis| text.contains(axis));
        assert!(is_graph || (axis && text.len() > 5_000), "{name}: {} bytes", text.len());
        assert!(text.contains("Parameters: ") && text.contains("Command: footfall figures"), "{name}");
    }
    let legs = std::fs::read_to_string(folder.path().join("hexapod-steps.svg")).expect("a file");
    assert!(["TL", "BR", "R = 3", "R = 1"].iter().all(|word| legs.contains(word)));
}
