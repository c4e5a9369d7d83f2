//! Large exports of oscilloscopes are read row by row from the disk: the result is that of the whole file, bit for bit, and so is the error.

#[path = "support/damage.rs"]
mod damage;

use damage::held;
use gait_trace::format::open::{self, HEAD_BYTES, InRows};
use gait_trace::{Axis, RawJoints, ReadOptions};
use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
use joint_units::{Radians, Volts};
use std::fmt::Write as _;

fn calibration() -> Calibration {
    let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
    Calibration::new(&[point(0.5, 0.0), point(2.5, 100.0)], Interpolation::Linear).unwrap()
}

/// An export of more than two blocks; some values are missing, some outside of the table.
fn export(line_end: &str) -> String {
    let mut text = format!(
        "\u{feff}Model,MDO3024{line_end}Record Length,250000{line_end}Vertical Units,V{line_end}TIME,CH1,CH2{line_end}"
    );
    for row in 0..250_000 {
        let volts = 1.5 + 1.2 * f64::from(row % 1000) / 1000.0;
        let volts = if row % 777 == 0 { "nan".to_owned() } else { format!("{volts:.4}") };
        let blank = if row % 5000 == 0 { line_end } else { "" };
        write!(text, "{:.5},{volts},0.5{line_end}{blank}", f64::from(row) * 1e-5).unwrap();
    }
    assert!(text.len() > 4 * HEAD_BYTES);
    text
}

/// Times and angles as bits, and everything else in words.
fn content(read: Result<RawJoints, gait_trace::TraceError>) -> Result<(Vec<u64>, String), String> {
    let raw = read.map_err(|error| error.to_string())?;
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<u64>>();
    let joints = raw.joints.iter().flatten().flat_map(|joint| bits(&joint.angle_deg));
    let numbers = bits(&raw.time_s).into_iter().chain(joints).collect();
    let columns: Vec<_> =
        raw.joints.iter().map(|joint| joint.as_ref().map(|joint| (&joint.column, joint.unit))).collect();
    Ok((numbers, format!("{} {:?} {:?}", raw.format, raw.notes, columns)))
}

#[test]
fn rows_from_the_disk_are_those_of_the_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("knee.csv");
    let name = path.display().to_string();
    let calibration = calibration();
    let mut how = ReadOptions { calibration: Some(&calibration), ..ReadOptions::default() };
    how.add_map("left_knee=CH1").unwrap();
    let good = export("\n");
    let late = good.len() - 1000;
    let end = late + good[late..].find('\n').unwrap() + 1;
    let with = |what: &[u8]| [&good.as_bytes()[..end], what, &good.as_bytes()[end..]].concat();
    let files: Vec<(Vec<u8>, bool)> = vec![
        (good.clone().into_bytes(), true),
        (export("\r\n").into_bytes(), true),
        (good.trim_end().as_bytes().to_vec(), true),
        (with(b"2.5,abc,1\n"), false),
        (with(b"2.5\n"), false),
        (with(b"2.5,\"1.5,0\n"), false),
        (with(b"1e999,1,1\n"), false),
        (with(b"2.5,1\0,1\n"), false),
        (with(b"2.5,\xff,1\n"), false),
        // A fault of the text is reported before that of a row above it.
        ([with(b"2.5,abc,1\n").as_slice(), b"3,1\0,1\n"].concat(), false),
        (with("2.5,\u{2212}1,\u{e9}\n".as_bytes()), true),
        (with(&[b"2.5,1,".as_slice(), &vec![b'7'; 1 << 20], b"\n"].concat()), false),
    ];
    for (place, (bytes, is_good)) in files.into_iter().enumerate() {
        std::fs::write(&path, &bytes).unwrap();
        let head = &bytes[..HEAD_BYTES];
        assert!(InRows::of_head(&name, head).is_some(), "file {place}");
        let (rows, whole) = (content(open::read(&path, &how)), content(open::of_bytes(&name, &bytes, &how)));
        assert_eq!(rows.is_ok(), is_good, "file {place}: {:?}", rows.err());
        assert!(rows == whole, "file {place}: {:?} {:?}", rows.err(), whole.err());
    }
    std::fs::write(&path, &good).unwrap();
    for how in [ReadOptions { axis: Some(Axis::X), ..how.clone() }, ReadOptions { calibration: None, ..how.clone() }] {
        let (rows, whole) = (content(open::read(&path, &how)), content(open::of_bytes(&name, good.as_bytes(), &how)));
        assert!(rows.is_err() && rows == whole, "{rows:?} {whole:?}");
    }
}

/// Other formats, and files that are not large, are read whole.
#[test]
fn other_files_are_read_whole() {
    let rows = "0.01,1,2,3,4\n".repeat(100_000);
    let csv = format!("time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n{rows}");
    let export = export("\n");
    assert!(InRows::of_head("a.csv", &csv.as_bytes()[..HEAD_BYTES]).is_none());
    assert!(InRows::of_head("a.csv", &export.as_bytes()[..HEAD_BYTES - 1]).is_none());
    assert!(InRows::of_head("a.csv", &export.as_bytes()[..HEAD_BYTES]).is_some());
    // Lines that end in CR are no lines of a block, and OpenSim's header is looked for in many lines.
    let old = export.replace('\n', "\r");
    assert!(InRows::of_head("a.csv", &old.as_bytes()[..HEAD_BYTES]).is_none());
    let motion = export.replacen("TIME,CH1,CH2\n", "TIME,CH1,CH2\nendheader\n", 1);
    assert!(InRows::of_head("a.csv", &motion.as_bytes()[..HEAD_BYTES]).is_none());
}

/// What is read takes 16 bytes a row, twice as much while a vector grows, and the blocks a few megabytes; the other channels take nothing.
#[test]
fn a_large_export_takes_little_memory() {
    let channels: Vec<String> = (1..=12).map(|n| format!("CH{n}")).collect();
    let mut text = format!("Model,MDO3024\nRecord Length,200000\nVertical Units,V\nTIME,{}\n", channels.join(","));
    for row in 0..200_000 {
        write!(text, "{:.5}", f64::from(row) * 1e-5).unwrap();
        (0..12).for_each(|channel| write!(text, ",{:.4}", 1.0 + f64::from((row + channel) % 1000) / 1000.0).unwrap());
        text.push('\n');
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("knee.csv");
    std::fs::write(&path, &text).unwrap();
    let calibration = calibration();
    let mut how = ReadOptions { calibration: Some(&calibration), ..ReadOptions::default() };
    how.add_map("left_knee=CH5").unwrap();
    let (raw, bytes) = held(|| open::read(&path, &how));
    assert_eq!(raw.unwrap().time_s.len(), 200_000);
    let most = (5 << 20) + 2 * 16 * 200_000;
    assert!(most < text.len() as isize && bytes < most, "{bytes} bytes for a file of {}", text.len());
}
