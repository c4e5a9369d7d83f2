//! Damaged files, one of each kind of damage: a clear error that says where and what is allowed, no panic, no hang, and no
//! more memory than a few times the file's own size. Those of C3D are in `damaged_c3d.rs`.
//!
//! What the readers pass on, because those behind them can tell more, is at the end: times that stand still or run
//! backwards, gaps, legs that are swapped.

mod support;

#[path = "support/damage.rs"]
mod damage;

use damage::{MARGIN, check, damage, held};
use gait_trace::ReadOptions;
use gait_trace::format::csv_file;
use gait_trace::format::open;
use support::c3d_writer::Format;
use support::{Stand, c3d_of_angles, calibration, centre_points, mot, trc, walk};

const HEADER: &str = "time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg";

/// The header and rows of equal numbers.
fn table(header: &str, rows: usize, row: impl Fn(usize) -> String) -> String {
    (0..rows).fold(format!("{header}\n"), |text, n| text + &row(n) + "\n")
}

fn csv() -> String {
    let mut bytes = Vec::new();
    csv_file::write_to(&mut bytes, &walk()).unwrap();
    String::from_utf8(bytes).unwrap()
}

#[test]
fn tables_of_text() {
    let good = csv();
    let row = |n: usize| format!("{},20,21,3,4", n as f64 / 100.0);
    let with = |line: usize, text: &str| {
        let mut rows: Vec<&str> = good.lines().collect();
        rows[line - 1] = text;
        rows.join("\n")
    };
    let small = |scale: f64| {
        table(HEADER, 30, |n| {
            let v = |k: usize| (((n * k) as f64 / 5.0).sin() * scale).to_string();
            format!("{},{},{},{},{}", n as f64 / 100.0, v(1), v(2), v(3), v(4))
        })
    };
    let latin = [b"time_s,left_knee_deg,note\n0,1,a\n0.01,2,".as_slice(), &[0xb0], b"\n"].concat();
    let mut garbage = good.clone().into_bytes();
    garbage[400..420].copy_from_slice(&[0, 1, 2, 3, 255, 254, 0, 0, 7, 9, 200, 1, 0, 0, 0, 0, 1, 2, 3, 4]);
    let utf16: Vec<u8> = [0xff, 0xfe].into_iter().chain(good.bytes().flat_map(|byte| [byte, 0])).collect();
    check(
        vec![
            damage("nothing", "a.csv", "", &["a.csv: is empty", "time_s"]),
            damage("blank lines", "a.csv", "\n \n\r\n\t\n", &["is empty"]),
            damage("comments alone", "a.csv", "# one\n# two\n", &["is empty"]),
            damage("a byte order mark alone", "a.csv", "\u{feff}", &["is empty"]),
            damage("a header alone", "a.csv", HEADER, &["a.csv:1: 0 rows", "2 or more"]),
            damage("one row", "a.csv", table(HEADER, 1, row), &["a.csv:2: 1 rows", "2 or more"]),
            damage(
                "a short row in the middle",
                "a.csv",
                with(32, "0.2"),
                &["a.csv:32: 1 fields", "are 5, as in the header"],
            ),
            damage("more fields at the end", "a.csv", table(HEADER, 2, row) + "0.5,1,2,3,4,5", &["a.csv:4: 6 fields"]),
            damage(
                "a word at the end",
                "a.csv",
                table(HEADER, 2, row) + "0.5,1,2,3,oops",
                &["a.csv:4: column 5 `right_knee_deg`: `oops` is not a number"],
            ),
            damage("time NaN", "a.csv", with(9, "NaN,1,2,3,4"), &["a.csv:9: column 1 `time_s`: `NaN` is not finite"]),
            damage("time empty", "a.csv", with(9, ",1,2,3,4"), &["a.csv:9: column 1 `time_s`: `` is not a number"]),
            damage(
                "infinite",
                "a.csv",
                with(10, "0.05,1,inf,3,4"),
                &["a.csv:10: column 3 `right_hip_deg`: `inf` is not finite"],
            ),
            damage(
                "too large for a number",
                "a.csv",
                with(10, "0.05,1,1e999,3,4"),
                &["a.csv:10: column 3", "`1e999` is not finite"],
            ),
            damage(
                "a word",
                "a.csv",
                with(11, "0.06,1,2,oops,4"),
                &["a.csv:11: column 4 `left_knee_deg`: `oops` is not a number", "such as -12.5"],
            ),
            damage(
                "decimal commas between commas",
                "a.csv",
                with(2, "0,0,20,5,1,5,2,5,3,5"),
                &["a.csv:2: 10 fields", "are 5"],
            ),
            damage(
                "nothing but gaps",
                "a.csv",
                table(HEADER, 30, |n| format!("0.{n:02},nan,,NaN,")),
                &["a.csv:1: no row has a number"],
            ),
            damage(
                "degrees called radians",
                "a.csv",
                good.replace("_deg", "_rad"),
                &["a.csv:2: column 2 `left_hip_rad`", "wrong unit?); allowed is -200 to 200 degrees"],
            ),
            damage(
                "radians called degrees",
                "a.csv",
                small(1.2),
                &[
                    "a.csv:1: column 2 `left_hip_deg`: the file names degrees, but the largest of 120 values",
                    "`--unit degrees` or `--unit radians`",
                ],
            ),
            damage(
                "a unit that is neither named nor implied",
                "a.csv",
                small(5.0).replace("_deg", ""),
                &[
                    "a.csv:1: column 2 `left_hip`: the unit of the angles is unknown",
                    "may be either",
                    "`_deg` or `_rad`",
                ],
            ),
            damage(
                "milliseconds called time",
                "a.csv",
                table("time,left_hip_deg", 30, |n| format!("{},20", n * 10)),
                &[
                    "a.csv:1: column 1 `time`: read as seconds, the median time step is 10, too long for a gait (milliseconds?)",
                    "`time_ms`",
                ],
            ),
            damage(
                "two files in one",
                "a.csv",
                format!("{good}{good}"),
                &["a.csv:376: a second header; allowed is one"],
            ),
            damage(
                "a joint twice",
                "a.csv",
                "time_s,left_hip_deg,hip_flexion_l\n0,1,2\n1,2,3\n",
                &["a.csv:1: column 3 `hip_flexion_l`", "are both recognised as `left_hip`", "--map left_hip=COLUMN"],
            ),
            damage(
                "two times",
                "a.csv",
                "time,t,left_hip_deg\n0,1,2\n1,2,3\n",
                &["column 2 `t`", "are both recognised as `time`"],
            ),
            damage(
                "no header",
                "a.csv",
                "0,1,2\n1,2,3\n",
                &["a.csv:1: no column is recognised as the time (the first line is a row of numbers, not a header)"],
            ),
            damage(
                "no time",
                "a.csv",
                "left_hip_deg,x\n1,2\n3,4\n",
                &["the columns are `left_hip_deg`, `x`", "--map time=COLUMN"],
            ),
            damage(
                "no joint",
                "a.csv",
                "time_s,ankle,x\n1,2,3\n3,4,5\n",
                &[
                    "a.csv:1: no column is recognised as a joint; there are `time_s`, `ankle`, `x`",
                    "--map left_hip=COLUMN",
                ],
            ),
            damage(
                "blanks between fields",
                "a.csv",
                "time_s left_hip_deg\n0 1\n1 2\n",
                &["there is only one column", "`,`, `;` or tabs"],
            ),
            damage(
                "a quote that never closes",
                "a.csv",
                with(12, "\"0.07,1,2,3,4"),
                &["a.csv:12: a quote is opened and not closed"],
            ),
            damage(
                "a quote in the header that never closes",
                "a.csv",
                "time_s,\"left_hip_deg\n0,1\n1,2\n",
                &["a.csv:1: a quote is opened"],
            ),
            damage(
                "100,000 columns",
                "a.csv",
                format!("time_s{}\n", ",x".repeat(100_000)),
                &["a.csv:1: 100001 columns; allowed are up to 4096"],
            ),
            damage(
                "a row of 100,000 fields",
                "a.csv",
                format!("{HEADER}\n0{}\n", ",1".repeat(100_000)),
                &["a.csv:2: 100001 columns"],
            ),
            damage(
                "a line of 10 MB",
                "a.csv",
                format!("{HEADER}\n0,{}\n", "9".repeat(10_000_000)),
                &["a.csv:2: a line of 10000002 bytes", "up to 1048576"],
            ),
            damage(
                "a number of a million digits",
                "a.csv",
                format!("{HEADER}\n0,{}x,1,1,1\n", "9".repeat(1_000_000)),
                &["a.csv:2: column 2", "is not a number"],
            ),
            damage(
                "a heading as long as a book",
                "a.csv",
                format!("t,{}left_ankle_deg\n0,x\n1,2\n", "/".repeat(900_000)),
                &["a.csv:1: no column is recognised as a joint"],
            ),
            damage(
                "a path as long as a book",
                "a.csv",
                format!("t,{}hip_flexion_l/value\n0,x\n1,2\n", "/".repeat(900_000)),
                &["a.csv:2: column 2 `////", "`x` is not a number"],
            ),
            damage(
                "another character set",
                "a.csv",
                latin,
                &["a.csv:3: byte 0xb0 at offset 39 is not text (another character set", "UTF-8"],
            ),
            damage("garbage in the middle", "a.csv", garbage, &["byte 0x00 at offset 400 is not text", "UTF-8"]),
            damage("UTF-16", "a.csv", utf16, &["byte 0xff at offset 0 is not text (UTF-16: save it as UTF-8)"]),
            damage(
                "a spreadsheet",
                "a.csv",
                b"PK\x03\x04\x14\x00\x06\x00".as_slice(),
                &["a.csv: this is a zip file, perhaps a spreadsheet; Footfall does not read it: "],
            ),
            damage("compressed", "a.csv", b"\x1f\x8b\x08\x00".as_slice(), &["a compressed file (gzip)", "gunzip"]),
            damage("zeros", "a.csv", vec![0; 1 << 20], &["byte 0x00 at offset 0 is not text"]),
        ],
        &ReadOptions::default(),
    );

    let mut how = ReadOptions::default();
    how.add_map("left_hip=nowhere").unwrap();
    check(
        vec![
            damage(
                "a map to no column",
                "a.csv",
                csv(),
                &["the map takes `left_hip` from `nowhere`; the file has `time_s`, `left_hip_deg`"],
            ),
            damage(
                "a map to no column",
                "a.mot",
                mot(&walk(), 1, "\t", true),
                &["the map takes `left_hip` from `nowhere`", "`hip_flexion_l`"],
            ),
            damage(
                "a map to no point",
                "a.c3d",
                c3d_of_angles(Format::Intel, None).bytes(),
                &["from `nowhere`; the file has `LASI`"],
            ),
        ],
        &how,
    );
}

#[test]
fn kinds_of_files_that_are_not_read_are_named() {
    let workbook = b"PK\x03\x04\x14\0\x06\0[Content_Types].xml....PK\x03\x04xl/workbook.xml".as_slice();
    const ANGLES: &str = "export the joint angles as CSV";
    let named: Vec<damage::Damage> = [
        ("a.bvh", b"HIERARCHY\nROOT Hips\n{\n".as_slice(), &["a.bvh: this is a BVH motion capture file; ", ANGLES][..]),
        (
            "a.csv",
            b"\xef\xbb\xbfHIERARCHY\r\nROOT Hips\r\n",
            &["a BVH motion capture file", "Footfall does not read it"],
        ),
        ("a.bag", b"#ROSBAG V2.0\nE\0\0\0", &["a rosbag of ROS 1", "mcap convert"]),
        (
            "a.mot",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
            &["a Git LFS pointer", "git lfs pull"],
        ),
        ("a.csv", b"\x89PNG\r\n\x1a\n\0\0", &["a PNG image"]),
        ("a.c3d", b"\xff\xd8\xff\xe0\0\x10JFIF", &["a JPEG image"]),
        ("a.csv", b"%PDF-1.7\n%\xe2\xe3", &["a PDF document"]),
        ("a.csv", workbook, &["an Excel workbook (.xlsx)", "export the sheet as CSV"]),
        ("a.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", &["an old Excel workbook"]),
        ("a.mat", b"MATLAB 5.0 MAT-file, Platform: PCWIN64\0", &["a MATLAB file (.mat)"]),
        ("a.mat", b"MATLAB 7.3 MAT-file, Platform: GLNXA64\0", &["a MATLAB file (.mat)"]),
        ("a.mat", b"\0\0\0\0\x04\0\0\0", &["an old MATLAB file", "writetable"]),
        ("a.h5", b"\x89HDF\r\n\x1a\n", &["an HDF5 file", "h5py"]),
        ("a.parquet", b"PAR1\x15\x04", &["a Parquet, Feather or Arrow file", "to_csv"]),
        ("a.npy", b"\x93NUMPY\x01\0", &["an array of NumPy (.npy)"]),
        ("a.npz", b"PK\x03\x04\x14\0\0\0angles.npy\x93NUMPY", &["arrays of NumPy (.npz)"]),
        ("a.slx", b"PK\x03\x04\x14\0\0\0simulink/blockdiagram.xml", &["a Simulink model (.slx)"]),
        ("a.ods", b"PK\x03\x04\x14\0\0\0mimetypeapplication/vnd.oasis.opendocument.spreadsheet", &["an OpenDocument"]),
        ("a.zip", b"PK\x05\x06\0\0\0\0", &["a zip file"]),
        ("a.csv.xz", b"\xfd7zXZ\0\0\x04", &["a compressed file (bzip2, xz, zstd, 7z or rar)", "unpack it first"]),
        ("a.tdms", b"TDSm\x0e\0\0\0", &["a LabVIEW measurement"]),
        ("a.lvm", b"LabVIEW Measurement\t\r\nWriter_Version\t2\r\n", &["a LabVIEW measurement"]),
        ("a.tsv", b"NO_OF_FRAMES\t374\r\nNO_OF_CAMERAS\t8\r\n", &["a Qualisys export", "C3D from QTM"]),
        ("a.qtm", b"\x01\x02\0\0", &["a Qualisys measurement", "C3D from QTM"]),
        ("a.tak", b"\0\0\0\x01", &["an OptiTrack Motive take", "C3D or TRC"]),
        ("a.csv", b"Format Version,1.23,Take Name,walk\n", &["an OptiTrack Motive export of positions"]),
        ("a.x2d", b"\0\xff\0", &["camera data of Vicon", "model outputs"]),
        ("a.cmz", b"\0\xff\0", &["a Visual3D workspace", "Export_Data_To_Ascii_File"]),
        ("a.cmo", b"\0\xff\0", &["a Visual3D workspace"]),
        ("a.mvn", b"\0\xff\0", &["an Xsens recording", "MVNX"]),
        ("a.amc", b"#!OML:ASF C:/a.asf\n:FULLY-SPECIFIED\n:DEGREES\n1\n", &["an Acclaim motion or skeleton", ANGLES]),
        (
            "a.asf",
            b"# AST/ASF file\n:version 1.10\n:name VICON\n:units\n  mass 1.0\n",
            &["an Acclaim motion or skeleton"],
        ),
        ("a.fbx", b"Kaydara FBX Binary  \0\x1a\0", &["an FBX scene", ANGLES]),
        ("a.fbx", b"; FBX 7.3.0 project file\n", &["an FBX scene"]),
        ("a.glb", b"glTF\x02\0\0\0", &["a glTF scene"]),
        ("a.mp4", b"\0\0\0\x20ftypisom\0\0", &["a video", "track it"]),
        ("a.db3", b"SQLite format 3\0\x10\0", &["an SQLite database"]),
        ("a.csv", b"\n<!DOCTYPE html>\n<html>", &["a web page (HTML)", "download the file itself"]),
    ]
    .into_iter()
    .map(|(name, bytes, says)| damage("a kind that is not read", name, bytes, says))
    .collect();
    check(named, &ReadOptions::default());
    // A table that only begins with a word of a magic number is a table, and so is text with the extension of another kind.
    for (name, text) in [
        ("a.csv", "BZh,time_s,left_hip_deg\n1,0,20\n2,0.01,21\n"),
        ("a.csv", "glTF,time_s,left_hip_deg\n1,0,20\n2,0.01,21\n"),
        ("a.mat", "time_s,left_hip_deg\n0,20\n0.01,21\n"),
    ] {
        let raw = open::of_bytes(name, text.as_bytes(), &ReadOptions::default());
        assert_eq!(raw.unwrap_or_else(|error| panic!("{error}")).time_s, [0.0, 0.01]);
    }
}

#[test]
fn opensim_files() {
    let good = mot(&walk(), 1, "\t", true);
    let rows = walk().time_s().len();
    let header = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        good.replacen(from, to, 1)
    };
    let lines: Vec<&str> = good.lines().collect();
    let promise = format!("nRows={rows}");
    check(
        vec![
            damage(
                "cut within a row",
                "a.mot",
                good[..good.len() - 10].to_owned(),
                &["a.mot:384: ", "fields; allowed are 6"],
            ),
            damage(
                "a title of other quantities",
                "a.mot",
                header("Coordinates", "Inverse Dynamics Generalized Forces"),
                &[
                    "a.mot:1: the title line `Inverse Dynamics Generalized Forces` names another quantity than joint angles (`dynamics`)",
                ],
            ),
            damage(
                "a title in SIMM's words",
                "a.mot",
                header("Coordinates", "name Accelerations"),
                &["a.mot:1: the title line `Accelerations` names another quantity than joint angles"],
            ),
            damage("cut within the header", "a.mot", lines[..4].join("\n"), &["a.mot:4: `endheader` is missing"]),
            damage(
                "cut behind the header",
                "a.mot",
                lines[..9].join("\n"),
                &["`names of columns below `endheader`` is missing"],
            ),
            damage(
                "cut behind the names",
                "a.mot",
                lines[..10].join("\n"),
                &["a.mot:10: 0 rows of numbers; allowed are 2 or more"],
            ),
            damage("two files in one", "a.mot", format!("{good}{good}"), &["a.mot:385: a second header"]),
            damage(
                "rows beyond any number",
                "a.mot",
                header(&promise, "nRows=99999999999999999999999"),
                &["a.mot:3: `nRows` is `99999999999999999999999`; allowed is a whole number"],
            ),
            damage(
                "rows that are no number",
                "a.mot",
                header(&promise, "nRows=many"),
                &["a.mot:3: `nRows` is `many`; allowed is a whole number"],
            ),
            damage(
                "neither degrees nor radians",
                "a.mot",
                header("inDegrees=yes", "inDegrees=maybe"),
                &["a.mot:5: `inDegrees` is `maybe`; allowed is yes or no"],
            ),
            damage(
                "radians called degrees",
                "a.mot",
                mot(&walk(), 1, "\t", false).replace("inDegrees=no", "inDegrees=yes"),
                &["a.mot:10: column 3 `hip_flexion_l`: the file names degrees, but the largest of 1496 values"],
            ),
            damage(
                "degrees called radians",
                "a.mot",
                header("inDegrees=yes", "inDegrees=no"),
                &["a.mot:11: column 3 `hip_flexion_l`: ", "wrong unit?"],
            ),
            damage(
                "a version to come",
                "a.sto",
                header("version=1", "version=9"),
                &["a.sto:2: `version` is `9`; allowed is 1, 2 or 3"],
            ),
            damage(
                "vectors",
                "a.sto",
                mot(&walk(), 3, "\t", true).replace("=double", "=Vec3"),
                &["a.sto:4: `DataType` is `Vec3`; allowed is double"],
            ),
            damage(
                "no coordinate of a joint",
                "a.mot",
                good.replace("hip_", "toe_").replace("knee_", "toe_"),
                &["a.mot:10: no column is recognised as a joint"],
            ),
            damage(
                "a joint twice",
                "a.mot",
                header("hip_flexion_r", "hip_flexion_l"),
                &["a.mot:10: `hip_flexion_l` and `hip_flexion_l` are both recognised as `left_hip`"],
            ),
            damage(
                "a number that is none",
                "a.mot",
                good.replacen("\t0.25\t", "\t0.25\t0x", 1),
                &["a.mot:11: column 3 `hip_flexion_l`: `0x"],
            ),
            damage("garbage", "a.mot", good.replacen("0.25", "\u{0}", 1), &["a.mot:11: byte 0x00 at offset"]),
            damage("nothing of it", "a.mot", "hello\n", &["a.mot:1: `endheader` is missing"]),
            damage(
                "a header without end",
                "a.mot",
                "x=1\n".repeat(100_000),
                &["a.mot:1000: `endheader` is missing; allowed is a line `endheader` within the first 1000"],
            ),
        ],
        &ReadOptions::default(),
    );
}

#[test]
fn exports_of_oscilloscopes() {
    let calibration = calibration();
    let mut how = ReadOptions { calibration: Some(&calibration), ..ReadOptions::default() };
    how.add_map("left_knee=CH1").unwrap();
    let rigol =
        |start: &str, unit: &str| format!("X,CH1,Start,Increment\nSequence,{unit},0,{start}\n0,1.5\n1,1.6\n2,1.7\n");
    check(
        vec![
            damage(
                "a length that is not a number",
                "a.csv",
                "Record Length,Analog:lots\nSource,CH1\nSecond,Volt\n0,1\n1,1\n",
                &["a.csv:1: `Record Length` is `Analog:lots`"],
            ),
            damage(
                "no increment",
                "a.csv",
                rigol("0", "Volt"),
                &["a.csv:2: `Increment` is `0`; allowed is a number of seconds above 0"],
            ),
            damage(
                "an increment that is not a number",
                "a.csv",
                rigol("fast", "Volt"),
                &["a.csv:2: `Increment` is `fast`"],
            ),
            damage("amperes", "a.csv", rigol("0.01", "Amp"), &["a.csv:2: `CH1` is `Amp`; allowed is Volt or mV"]),
            damage(
                "another time",
                "a.csv",
                "x-axis,1\nhertz,Volt\n0,1\n1,2\n",
                &["a.csv:2: `the time's unit` is `hertz`; allowed is s or second, ms, us or ns"],
            ),
            damage("a header alone", "a.csv", "x-axis,1\nsecond,Volt\n", &["a.csv:2: 0 rows"]),
            damage(
                "a row cut short",
                "a.csv",
                "x-axis,1,2\nsecond,Volt,Volt\n0,1,1\n1\n",
                &["a.csv:4: 1 fields; allowed are 2"],
            ),
            damage("no channel", "a.csv", "x-axis,\nsecond,\n0,1\n1,2\n", &["a.csv:2: no channel"]),
            damage(
                "a word",
                "a.csv",
                "x-axis,1\nsecond,Volt\n0,1\n1,clipped\n",
                &["a.csv:4: column 2 `CH1`: `clipped` is not a number"],
            ),
            damage(
                "infinite",
                "a.csv",
                "x-axis,1\nsecond,Volt\n0,1\n1,9.9E+370\n",
                &["a.csv:4: column 2 `CH1`: `9.9E+370` is not finite"],
            ),
            damage(
                "all out of the table",
                "a.csv",
                rigol("0.01", "mV"),
                &[
                    "`CH1` is 0.002 to 0.002 V, completely outside of the calibration table; allowed is 0.500 to 2.500 V",
                ],
            ),
            damage(
                "another channel",
                "a.csv",
                rigol("0.01", "Volt").replace("CH1", "CH3"),
                &["the map takes `left_knee` from `CH1`; the file has `CH3`"],
            ),
        ],
        &how,
    );
}

#[test]
fn what_is_no_file_and_what_is_too_large_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str| open::read(&folder.path().join(name), &ReadOptions::default()).unwrap_err().to_string();
    assert!(read("nowhere.csv").contains("nowhere.csv: cannot be read: "));
    assert!(read("").contains("cannot be read: "));
    // 4 GB that take no space on the disk.
    std::fs::File::create(folder.path().join("large.c3d")).unwrap().set_len(4 << 30).unwrap();
    let (error, held) = held(|| read("large.c3d"));
    assert!(
        error.ends_with("large.c3d: is larger than 268435456 bytes; allowed is up to that: cut the recording"),
        "{error}"
    );
    assert!(held < MARGIN, "refused before it is read: {held} bytes");
}

#[test]
fn trc_files() {
    let stand = Stand { up: [0.0, 1.0, 0.0], forward: [1.0, 0.0, 0.0], step_mm: 6.0, turn_deg: 0.0 };
    let good = trc(&centre_points(&walk(), stand), 150.0);
    let lines: Vec<&str> = good.lines().collect();
    let with = |line: usize, text: &str| {
        let mut rows = lines.clone();
        rows[line - 1] = text;
        rows.join("\n")
    };
    check(
        vec![
            damage(
                "cut within a row",
                "a.trc",
                good[..good.len() - 30].to_owned() + "\n",
                &["a.trc:380: ", "fields; allowed are 20"],
            ),
            damage(
                "cut within the header",
                "a.trc",
                lines[..3].join("\n"),
                &["a.trc: `the names of the markers` is missing"],
            ),
            damage("cut behind the header", "a.trc", lines[..5].join("\n"), &["a.trc:4: 0 rows of numbers"]),
            damage(
                "a word",
                "a.trc",
                with(10, &lines[9].replacen('.', "x", 1)),
                &["a.trc:10: column 2 `Time`: `0x0", "is not a number"],
            ),
            damage(
                "a marker that is a word",
                "a.trc",
                with(10, &(lines[9].rsplit_once('\t').unwrap().0.to_owned() + "\tlost")),
                &["a.trc:10: column 20 `RAJC`: `lost` is not a number"],
            ),
            damage(
                "no time",
                "a.trc",
                good.replacen("\tTime", "\tMoment", 1),
                &["a.trc:4: `the second column` is `Moment`; allowed is `Time`"],
            ),
            damage(
                "no leg",
                "a.trc",
                good.replace("HJC", "ASI"),
                &["a.trc:4: neither joint angles nor joint centres: the points are `LASI`"],
            ),
            damage(
                "100,000 columns",
                "a.trc",
                with(4, &"Frame#\tTime".to_owned().repeat(60_000)),
                &["a.trc:4: 60001 columns; allowed are up to 4096"],
            ),
        ],
        &ReadOptions::default(),
    );
    let mut how = ReadOptions::default();
    how.add_map("left_knee=LKJC").unwrap();
    check(vec![damage("a map", "a.trc", good.clone(), &["a map is given (`--map`), but the file has markers"])], &how);
    let how = ReadOptions { rate_hz: Some(100.0), ..ReadOptions::default() };
    check(
        vec![damage(
            "a rate",
            "a.trc",
            good,
            &["a.trc:4: column 2 `Time`: a rate is given (`--rate 100`)", "correct the rate"],
        )],
        &how,
    );
}

/// Counts in a header that differ from the file are notes where every row is whole; nothing is reserved for rows that are not there.
#[test]
fn counts_that_differ_are_notes() {
    let good = mot(&walk(), 1, "\t", true);
    let lines: Vec<&str> = good.lines().collect();
    let four = "`nRows` announces 4294967296 rows, but the file has 374";
    for (text, rows, note) in [
        (lines[..200].join("\n"), 190, "`nRows` announces 374 rows, but the file has 190"),
        (lines[..200].join("\n"), 190, "The last line has no line end"),
        (format!("{good}{}\n", lines[20]), 375, "`nRows` announces 374 rows, but the file has 375"),
        (good.replace("nRows=374", "nRows=4294967296"), 374, four),
        (good.replace("nColumns=6", "nColumns=24"), 374, "`nColumns` announces 24 columns, but the file has 6"),
    ] {
        let (raw, held) = held(|| open::of_bytes("a.mot", text.as_bytes(), &ReadOptions::default()));
        let raw = raw.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(raw.time_s.len(), rows, "{note}");
        assert!(raw.notes.iter().any(|found| found.starts_with(note)), "{:?}", raw.notes);
        assert!(held < 3 * text.len() as isize + MARGIN, "{note}: {held} bytes");
    }
    let calibration = calibration();
    let mut how = ReadOptions { calibration: Some(&calibration), ..ReadOptions::default() };
    how.add_map("left_knee=CH1").unwrap();
    for (text, note) in [
        ("Record Length,Analog:7\nSource,CH1\nSecond,Volt\n0,1\n1,1\n2,1\n", "announces 7 rows, but the file has 3"),
        ("Model,MDO\nRecord Length,4294967296\nTIME,CH1\n0,1\n1,1\n", "announces 4294967296 rows, but the file has 2"),
    ] {
        let raw = open::of_bytes("a.csv", text.as_bytes(), &how).unwrap_or_else(|error| panic!("{error}"));
        assert!(raw.notes.iter().any(|found| found.contains(note)), "{:?}", raw.notes);
    }
}

#[test]
fn what_is_passed_on_to_those_who_can_tell_more() {
    let read = |text: &str| open::of_bytes("a.csv", text.as_bytes(), &ReadOptions::default()).unwrap();
    // Times that stand still, run backwards and leap: whoever repairs them names them.
    let raw = read("time_s,left_hip_deg\n0,20\n0.01,21\n0.01,21\n0.005,22\n9,23\n");
    assert_eq!(raw.time_s, [0.0, 0.01, 0.01, 0.005, 9.0]);
    // Left and right swapped: a name cannot tell, the walk can.
    let swapped = csv().replace("left_", "x_").replace("right_", "left_").replace("x_", "right_");
    let (raw, good) = (read(&swapped), read(&csv()));
    assert_eq!(raw.joints[0].as_ref().unwrap().angle_deg, good.joints[1].as_ref().unwrap().angle_deg);
    // Two joints are missing: whoever fits them says what it needs.
    let raw = read("time_s,left_hip_deg,left_knee_deg\n0,20,\n0.01,21,5\n");
    assert!(raw.joints[1].is_none() && raw.joints[3].is_none());
    assert!(raw.joints[2].as_ref().unwrap().angle_deg[0].is_nan());
    // A row in a hundred that no leg can do is a glitch, not a unit; it is missing, and a note says so.
    let text = table(HEADER, 200, |n| format!("{},20,21,3,{}", n as f64 / 100.0, if n == 7 { 9e5 } else { 4.0 }));
    let raw = read(&text);
    assert!(raw.joints[3].as_ref().unwrap().angle_deg[7].is_nan());
    assert!(
        raw.notes[0].contains("1 of 200 values are beyond 200 degrees") && raw.notes[0].contains("line 9"),
        "{:?}",
        raw.notes
    );
}
