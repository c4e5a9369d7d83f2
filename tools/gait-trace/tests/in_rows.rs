//! Large tables of text are read row by row from the disk: the result is that of the whole file, bit for bit, and so is the error.

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

/// Angles of a hip and a knee at a time, degrees.
fn angles(time_s: f64) -> [f64; 2] {
    [20.0 * (6.0 * time_s).sin(), 30.0 + 25.0 * (6.0 * time_s).cos()]
}

/// A table of so many rows, and columns that are not needed.
fn csv(rows: u32) -> String {
    let mut text = "time_s,left_hip_deg,left_knee_deg,a,b,c,d,e,f\n".to_owned();
    for row in 0..rows {
        let time = f64::from(row) * 1e-3;
        let [hip, knee] = angles(time);
        writeln!(text, "{time:.4},{hip:.4},{knee:.4},{hip:.9},{knee:.9},{hip:.9},{knee:.9},-,{row}").unwrap();
    }
    text
}

/// The same as a motion file.
fn motion(rows: u32) -> String {
    let names = "time\thip_flexion_l\tknee_angle_l\tpelvis_tx\tpelvis_ty\tpelvis_tz\tankle_angle_l";
    let mut text = format!("Coordinates\nversion=1\nnRows={rows}\nnColumns=7\ninDegrees=yes\nendheader\n{names}\n");
    for row in 0..rows {
        let time = f64::from(row) * 1e-3;
        let [hip, knee] = angles(time);
        writeln!(text, "{time:.8}\t{hip:.8}\t{knee:.8}\t{time:.8}\t{hip:.8}\t{knee:.8}\t{knee:.8}").unwrap();
    }
    text
}

/// Markers of a leg, and as many others that the leg does not need, with rows that are too long for a thousand of them in the beginning.
fn markers(rows: u32) -> String {
    let others: Vec<String> = (0..40).map(|n| format!("M{n}")).collect();
    let names = format!("LHJC\t\t\tLKJC\t\t\tLAJC\t\t\t{}", others.join("\t\t\t"));
    let mut text = format!(
        "PathFileType\t4\t(X/Y/Z)\twalk.trc\nNumFrames\tNumMarkers\tUnits\n{rows}\t43\tmm\nFrame#\tTime\t{names}\n\t\tX1\tY1\tZ1\n\n"
    );
    for row in 0..rows {
        let time = f64::from(row) * 1e-3;
        let [hip, knee] = angles(time).map(f64::to_radians);
        let at = 1200.0 * time;
        let (lower, shank) = (at + 420.0 * hip.sin(), hip - knee);
        write!(text, "{row}\t{time:.5}\t{at:.5}\t900.0\t90.0\t{lower:.5}\t{:.5}\t90.0", 900.0 - 420.0 * hip.cos())
            .unwrap();
        write!(text, "\t{:.5}\t{:.5}\t90.0", lower + 410.0 * shank.sin(), 480.0 - 410.0 * shank.cos()).unwrap();
        (0..40).for_each(|n| write!(text, "\t{at:.5}\t1200.00000\t{n}.00000").unwrap());
        text.push('\n');
    }
    text
}

/// Files of more than two blocks, damaged near their ends.
#[test]
fn rows_of_tables_are_those_of_the_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    for (file, text) in [("a.csv", csv(60_000)), ("a.mot", motion(60_000)), ("a.trc", markers(4000))] {
        assert!(text.len() > 4 * HEAD_BYTES, "{file}: {}", text.len());
        let path = folder.path().join(file);
        let name = path.display().to_string();
        let late = text.len() - text.len() / 50;
        let end = late + text[late..].find('\n').unwrap() + 1;
        let with = |what: &str| format!("{}{what}{}", &text[..end], &text[end..]).into_bytes();
        let files = [
            text.clone().into_bytes(),
            text.replace('\n', "\r\n").into_bytes(),
            text.as_bytes()[..text.len() - 1].to_vec(),
            text.as_bytes()[..text.len() - 30].to_vec(),
            with("1\n"),
            with("endheader\n"),
            with("1\nendheader\n"),
            with("\n# a comment\n"),
            with("1\n\0"),
            with("\u{feff}"),
        ];
        for (place, bytes) in files.into_iter().enumerate() {
            std::fs::write(&path, &bytes).unwrap();
            let how = ReadOptions::default();
            let rows = InRows::of_head(&name, &bytes[..HEAD_BYTES]).unwrap_or_else(|| panic!("{file} {place}"));
            let read = rows.read(&name, &mut std::io::Cursor::new(&bytes), &how);
            assert_eq!(matches!(read, Ok(None)), place == 8, "{file} {place}: {read:?}");
            let (rows, whole) = (content(open::read(&path, &how)), content(open::of_bytes(&name, &bytes, &how)));
            assert!(rows.is_ok() || place > 2, "{file} {place}: {rows:?}");
            assert!(rows == whole, "{file} {place}: {:?} {:?}", rows.err(), whole.err());
        }
    }
}

/// Other formats, and files that are not large, are read whole.
#[test]
fn other_files_are_read_whole() {
    let export = export("\n");
    let csv = csv(20_000);
    assert!(InRows::of_head("a.csv", &csv.as_bytes()[..HEAD_BYTES]).is_some());
    for name in ["a.mot", "a.sto", "a.gcd", "a.c3d"] {
        assert!(InRows::of_head(name, &csv.as_bytes()[..HEAD_BYTES]).is_none(), "{name}");
    }
    // With fewer than a thousand lines it may be a motion file, whose header has up to that many.
    let wide = csv.replace("-,", &format!("{},", "-".repeat(1000)));
    assert!(InRows::of_head("a.csv", &wide.as_bytes()[..HEAD_BYTES]).is_none());
    for begin in ["Devices\n1000\n", "#!DST-0.1 GCD\n", "\tA\tA\n\tT\tT\n\tTARGET\tTARGET\n"] {
        assert!(InRows::of_head("a.csv", &[begin, &csv].concat().as_bytes()[..HEAD_BYTES]).is_none(), "{begin}");
    }
    assert!(InRows::of_head("a.csv", &export.as_bytes()[..HEAD_BYTES - 1]).is_none());
    assert!(InRows::of_head("a.csv", &export.as_bytes()[..HEAD_BYTES]).is_some());
    // Lines that end in CR are no lines of a block.
    let old = export.replace('\n', "\r");
    assert!(InRows::of_head("a.csv", &old.as_bytes()[..HEAD_BYTES]).is_none());
}

/// What is read takes 8 bytes a number, twice as much while a vector grows, what is computed of it as much again, and the blocks a few
/// megabytes; columns and markers that are not needed take nothing.
#[test]
fn a_large_table_takes_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    for (file, text, rows, row_bytes) in [
        ("a.csv", csv(250_000), 250_000, 2 * 24),
        ("a.mot", motion(250_000), 250_000, 2 * 24),
        ("a.trc", markers(14_000), 14_000, 2 * (8 + 72) + 8 + 24 + 32),
    ] {
        let path = folder.path().join(file);
        std::fs::write(&path, &text).unwrap();
        let (raw, bytes) = held(|| open::read(&path, &ReadOptions::default()));
        assert_eq!(raw.unwrap().time_s.len(), rows);
        let most = (5 << 20) + rows as isize * row_bytes;
        let size = text.len() as isize;
        assert!(most < size && bytes < most, "{file}: {bytes} bytes, {most} allowed, for a file of {size}");
    }
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
