//! Headers of CSV files that say less than they seem: merged cells, a unit of time that is not read, columns that a program renamed.

mod support;

use gait_trace::format::open;
use gait_trace::{RawJoints, ReadOptions};
use joint_units::Joint;
use support::{joint, walk};

const ENGLISH: &str = "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg";

/// The walk below a header: the time times a factor, then the fields of the joints.
fn csv(header: &str, time: f64, fields: impl Fn(f64) -> String) -> String {
    let walk = walk();
    let mut text = format!("{header}\n");
    for (row, at) in walk.time_s().iter().enumerate() {
        let joints = Joint::ALL.map(|which| fields(joint(&walk, which)[row]));
        text += &format!("{},{}\n", at * time, joints.join(","));
    }
    text
}

fn read(text: &str, map: &str) -> Result<RawJoints, String> {
    let mut how = ReadOptions::default();
    if !map.is_empty() {
        how.add_map(map).unwrap();
    }
    open::of_bytes("walk.csv", text.as_bytes(), &how).map_err(|error| error.to_string())
}

fn angles(raw: &RawJoints) -> Vec<&[f64]> {
    raw.joints.iter().flatten().map(|joint| joint.angle_deg.as_slice()).collect()
}

fn plain() -> RawJoints {
    read(&csv(ENGLISH, 1.0, |x| x.to_string()), "").unwrap()
}

/// The first component is not flexion; before, it was read as if it were.
#[test]
fn cells_merged_over_components_are_refused() {
    let header = "time_s,Left Hip (deg),,,Right Hip (deg),,,Left Knee (deg),,,Right Knee (deg),,";
    let text = csv(header, 1.0, |x| format!("{},{},{x}", 5.0 + 0.4 * x, 3.0 - 0.2 * x));
    let error = read(&text, "").unwrap_err();
    assert!(error.contains("`Left Hip (deg)` and the other joints each have a column without a heading"), "{error}");
    assert!(error.contains("`--map left_hip=COLUMN,...`"), "{error}");
    let mapped = read(&text, "left_hip=4,right_hip=7,left_knee=10,right_knee=13").unwrap();
    assert_eq!(angles(&mapped), angles(&plain()));
    // One column without a heading, and delimiters at the ends of all lines, are none of this.
    for text in [
        csv(&format!("{ENGLISH},,"), 1.0, |x| x.to_string()).replace('\n', ",,\n").replace(",,,,\n", ",,\n"),
        csv(ENGLISH, 1.0, |x| x.to_string()).replace('\n', ",,\n").replacen(",,\n", "\n", 1),
        csv("time_s,left_hip_deg,,right_hip_deg,,left_knee_deg,right_knee_deg", 1.0, |x| x.to_string())
            .lines()
            .enumerate()
            .map(|(n, row)| match row.split(',').collect::<Vec<_>>()[..] {
                [t, a, b, c, d] if n > 0 => format!("{t},{a},,{b},,{c},{d}\n"),
                _ => format!("{row}\n"),
            })
            .collect(),
    ] {
        assert_eq!(angles(&read(&text, "").unwrap()), angles(&plain()), "{}", &text[..80]);
    }
}

/// A single joint with a delimiter at the end of each line, and one column without a heading.
#[test]
fn a_column_without_a_heading_beside_one_joint_is_no_component() {
    let knee = |rest: &str| format!("time_s,left_knee_deg,\n0,1,{rest}\n0.01,2,{rest}\n");
    for rest in ["", "7"] {
        assert_eq!(angles(&read(&knee(rest), "").unwrap()), [[1.0, 2.0]]);
    }
}

#[test]
fn a_unit_of_time_that_is_not_read_is_refused_where_the_map_names_the_column() {
    for (heading, factor) in [("Time (min)", 1.0 / 60.0), ("Time [h]", 1.0 / 3600.0), ("Zeit (0.1 s)", 10.0)] {
        let text = csv(&ENGLISH.replacen("time_s", heading, 1), factor, |x| x.to_string());
        assert!(read(&text, "").is_err());
        let error = read(&text, "time=1").unwrap_err();
        assert!(error.contains("which is not read") && error.contains("`--rate HZ`"), "{error}");
    }
    let text = csv(&ENGLISH.replacen("time_s", "Uhr in ms", 1), 1000.0, |x| x.to_string());
    assert_eq!(angles(&read(&text, "time=1").unwrap()), angles(&plain()));
}

#[test]
fn steps_that_are_too_short_need_the_unit_of_the_time() {
    let text = |heading: &str, factor| csv(&ENGLISH.replacen("time_s", heading, 1), factor, |x| x.to_string());
    let error = read(&text("Time", 1.0 / 60.0), "").unwrap_err();
    assert!(error.contains("too short for a recording of angles (minutes, hours or days?)"), "{error}");
    assert!(read(&text("Time", 1.0 / 86400.0), "").is_err());
    assert!(read(&text("Time", 1.0), "").is_ok());
    assert!(read(&text("time_s", 1.0 / 60.0), "").is_ok(), "the file states seconds");
}

#[test]
fn a_time_of_day_is_refused_with_what_to_do() {
    let text = csv(ENGLISH, 1.0, |x| x.to_string()).replacen("\n0,", "\n00:00:01.000,", 1);
    let error = read(&text, "").unwrap_err();
    assert!(error.contains("`00:00:01.000` is a time of day") && error.contains("--rate HZ"), "{error}");
}

#[test]
fn columns_that_a_program_renamed_are_the_same_joint() {
    let header = "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg,left_hip_deg.1";
    let text = csv(header, 1.0, |x| x.to_string()).replace('\n', ",1\n").replacen(",1\n", "\n", 1);
    let error = read(&text, "").unwrap_err();
    assert!(error.contains("`left_hip_deg` and `left_hip_deg.1` are both recognised as `left_hip`"), "{error}");
    assert_eq!(angles(&read(&text, "left_hip=2").unwrap()), angles(&plain()));
}

#[test]
fn decimal_commas_below_lines_of_text_are_read() {
    let table = csv(ENGLISH, 1.0, |x| x.to_string()).replace(',', ";").replace('.', ",");
    let raw = read(&format!("Patient;Max\nTime;12:00:00\n{table}"), "").unwrap();
    assert_eq!((angles(&raw), &raw.time_s), (angles(&plain()), &plain().time_s));
    // Headings with commas inside.
    let header = ENGLISH.replace(',', ";").replace("_deg", ", deg").replace("_s;", ", s;");
    for above in ["", "Patient;Max\n"] {
        let raw = read(&format!("{above}{header}\n{}", table.split_once('\n').unwrap().1), "").unwrap();
        assert_eq!((angles(&raw), &raw.time_s), (angles(&plain()), &plain().time_s));
    }
    // A true minus sign, which some programs write.
    let raw = read(&csv(ENGLISH, 1.0, |x| x.to_string()).replace('-', "\u{2212}"), "").unwrap();
    assert_eq!(angles(&raw), angles(&plain()));
    let named = read(&format!("sep=;\n{table}"), "").unwrap();
    assert!(named.notes.iter().all(|note| !note.contains("header")), "{:?}", named.notes);
}

#[test]
fn a_header_between_blanks_is_refused_with_what_to_do() {
    let text = csv(ENGLISH, 1.0, |x| x.to_string()).replace(',', "  ");
    let error = read(&text, "").unwrap_err();
    assert!(error.contains("the 5 words of this line are separated by blanks"), "{error}");
    assert!(error.contains("`--map time=1,left_hip=2,...`"), "{error}");
}

/// MATLAB writes a header as a comment; a share of a cycle is another thing.
#[test]
fn a_comment_before_a_time_is_no_percent() {
    let header = |time: &str| ENGLISH.replace("time_s", time);
    for time in ["% TimeStamp", "%time_s", "% Time (s)"] {
        let read = read(&csv(&header(time), 1.0, |x| x.to_string()), "time=1")
            .unwrap_or_else(|error| panic!("{time}: {error}"));
        assert_eq!(read.time_s, plain().time_s, "{time}");
    }
    for time in ["% gait cycle", "Time [%]", "% of stride time"] {
        let error = read(&csv(&header(time), 1.0, |x| x.to_string()), "time=1").unwrap_err();
        assert!(error.contains("one cycle, from 0 to 100"), "{time}: {error}");
    }
}
