//! Bad files: each kind of fault gets an error that names file, line, field and what is allowed; exit code 2; nothing written.
//!
//! In the process itself, and through the program.

use footfall::board::default_loop;
use footfall::cli;
use footfall::file::calibration_file;
use generator_file::robot_file::RobotFile;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a call says, and its exit code: the same in the process and of the program.
fn call(arguments: &[OsString]) -> (u8, String) {
    let inside = match cli::call(std::iter::once("footfall".into()).chain(arguments.iter().cloned())) {
        Ok(()) => (0, String::new()),
        Err(failure) => (failure.exit_code(), failure.to_string()),
    };
    let output = Command::new(env!("CARGO_BIN_EXE_footfall")).args(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(inside.0.into()), "{arguments:?}");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    for line in inside.1.lines() {
        assert!(said.contains(line), "the program says\n{said}\nand not\n{line}");
    }
    inside
}

/// A folder, and a file in it that is bad.
struct Bad {
    folder: tempfile::TempDir,
    file: PathBuf,
}

impl Bad {
    fn new(name: &str, content: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(name);
        std::fs::write(&file, content).unwrap();
        Self { folder, file }
    }

    /// What is in the folder beside the file.
    fn written(&self) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        entries.map(|entry| entry.unwrap().path()).filter(|path| *path != self.file).collect()
    }
}

/// The file has this fault: at this line (0: none) in this field, in these words.
fn assert_refused(option: &str, bad: &Bad, line: usize, words: &[&str]) {
    // `check` reads recordings as `fit` does, which takes more than our own CSV; `volts` has the strict reader first.
    let command = if option == "--trace" { "volts" } else { "check" };
    let (code, said) = call(&[command.into(), option.into(), bad.file.clone().into()]);
    let file = bad.file.display();
    let place = if line == 0 { format!("{file}: ") } else { format!("{file}:{line}: ") };
    assert_eq!(code, 2, "{said}");
    assert!(said.starts_with(&place), "{said} does not begin with {place}");
    for word in words {
        assert!(said.contains(word), "{said} does not say {word}");
    }
    assert!(
        ["allowed", "must ", "allows "].iter().any(|word| said.contains(word)),
        "{said} does not say what is allowed"
    );
    assert_eq!(bad.written(), [] as [PathBuf; 0]);
}

#[test]
fn calibration_files() {
    let good = calibration_file::to_text(&default_loop::wired_sensor().unwrap(), None);
    let head = "schema = 1\ninterpolation = \"linear\"\ndivider = 1\n";
    let points = |rows: &[&str]| {
        let rows: String = rows.iter().map(|row| format!("  {{ {row} }},\n")).collect();
        format!("{head}points = [\n{rows}]\n")
    };
    let p = ["sensor_v = 0.5, angle_deg = 90", "sensor_v = 1.5, angle_deg = 30", "sensor_v = 2.5, angle_deg = -20"];
    let with = |last: &str| points(&[p[0], p[1], last]);
    let ok = Bad::new("good.toml", points(&p).as_bytes());
    assert_eq!(call(&["check".into(), "--calibration".into(), ok.file.clone().into()]).0, 0);

    for (text, line, words) in [
        (String::new(), 0, vec!["is empty", "`footfall defaults sensor`"]),
        ("\u{1}".into(), 1, vec!["not TOML"]),
        ("schema = 1\npoints = [\n".into(), 2, vec!["not TOML"]),
        ("schema = 1\nschema = 1\n".into(), 2, vec!["not TOML", "duplicate"]),
        (good.replace("schema = 1", "schema = 3"), 2, vec!["field `schema`", "is 3", "1 or 2"]),
        (good.replace("schema = 1\n", ""), 1, vec!["field `schema`", "is missing"]),
        (good.replace("divider = 1.0", "divider = 0"), 4, vec!["field `divider`", "is 0", "0.05 to 20"]),
        (good.replace("divider = 1.0", "divider = nan"), 4, vec!["field `divider`", "is nan"]),
        (good.replace("divider = 1.0", "divider = inf"), 4, vec!["field `divider`", "is inf"]),
        (good.replace("divider = 1.0", "divider = 1e999"), 4, vec!["field `divider`", "1e999"]),
        (
            good.replace("divider = 1.0", "divider = \"one\""),
            4,
            vec!["field `divider`", "the text \"one\"", "a number"],
        ),
        (good.replace("divider = 1.0", "devider = 1"), 4, vec!["field `devider`", "unknown field", "`divider`"]),
        (good.replace("monotone_cubic", "spline"), 3, vec!["field `interpolation`", "\"linear\", \"monotone_cubic\""]),
        (format!("{head}points = 3\n"), 4, vec!["field `points`", "the whole number 3", "a list"]),
        (format!("{head}points = []\n"), 4, vec!["field `points`", "0 points", "2 to 32"]),
        (points(&p[..1]), 4, vec!["field `points`", "1 points", "2 to 32"]),
        (points(&vec![p[0]; 33]), 4, vec!["field `points`", "33 points", "2 to 32"]),
        (points(&[p[0], "sensor_v = 1.5"]), 6, vec!["field `points[1].angle_deg`", "is missing"]),
        (
            points(&[p[0], "sensor_v = 1.5, angle = 3"]),
            6,
            vec!["field `points[1].angle`", "unknown field", "`angle_deg`"],
        ),
        (with("sensor_v = -0.1, angle_deg = 3"), 7, vec!["field `points[2].sensor_v`", "-0.1", "0 to 30 V"]),
        (with("sensor_v = 2.5, angle_deg = nan"), 7, vec!["field `points[2].angle_deg`", "nan"]),
        (with("sensor_v = 2.5, angle_deg = 180"), 7, vec!["field `points[2].angle_deg`", "180", "-60 to 170"]),
        (with("sensor_v = 1.5, angle_deg = -20"), 7, vec!["field `points[2].sensor_v`", "more than the point before"]),
        (with("sensor_v = 1.2, angle_deg = -20"), 7, vec!["field `points[2].sensor_v`", "more than the point before"]),
        (with("sensor_v = 2.5, angle_deg = 40"), 7, vec!["field `points[2].angle_deg`", "rise throughout or fall"]),
        (with("sensor_v = 2.5, angle_deg = 30"), 7, vec!["field `points[2].angle_deg`", "at least"]),
        (with("sensor_v = 1.51, angle_deg = -20"), 7, vec!["field `points[2].sensor_v`", "saturates"]),
    ] {
        assert_refused("--calibration", &Bad::new("sensor.toml", text.as_bytes()), line, &words);
    }
    assert_refused("--calibration", &Bad::new("sensor.toml", b"schema = 1\n\xff\xfe"), 2, &["is not text"]);
    assert_refused("--calibration", &Bad::new("sensor.toml", &vec![b'#'; (1 << 20) + 1]), 0, &["is larger than"]);
}

#[test]
fn robot_files() {
    let good = RobotFile::default_biped().to_toml();
    let ok = Bad::new("good.toml", good.as_bytes());
    assert_eq!(call(&["check".into(), "--robot".into(), ok.file.clone().into()]).0, 0);
    for (from, to, words) in [
        ("schema = 2", "schema = 7", vec!["field `schema`", "is 7", "allowed is 1 or 2", "`footfall defaults robot`"]),
        ("schema = 2", "schema = \"1\"", vec!["field `schema`", "the text \"1\""]),
        ("rate_deg_per_s = 500.0", "rate_deg_per_s = nan", vec!["field `left_hip.rate_deg_per_s`", "nan"]),
        ("rate_deg_per_s = 500.0", "rate_deg_per_s = -5", vec!["field `left_hip.rate_deg_per_s`", "-5", "1000 deg/s"]),
        ("rate_deg_per_s = 500.0", "rate = 500", vec!["field `left_hip.rate`", "unknown field", "`rate_deg_per_s`"]),
        ("[-30.0, 60.0]", "[nan, 60]", vec!["field `left_hip.range_deg[0]`", "nan", "a finite number"]),
        ("[-30.0, 60.0]", "[60, -30]", vec!["field `left_hip.range_deg`", "below the most"]),
        ("[-30.0, 60.0]", "[-30]", vec!["field `left_hip.range_deg`", "a list of 1", "a list of 2 numbers"]),
        ("[-30.0, 60.0]", "[-30, 60, 90]", vec!["field `left_hip.range_deg`", "a list of 3", "a list of 2"]),
        ("[-30.0, 60.0]", "[-30, 600]", vec!["field `left_hip.range_deg[1]`", "600", "-30 to 120 deg"]),
        ("[-30.0, 60.0]", "[-30, \"x\"]", vec!["field `left_hip.range_deg[1]`", "the text \"x\""]),
        ("first = \"left_knee\"", "first = \"left_toe\"", vec!["field `pose[0].first`", "left_toe", "\"left_hip\""]),
        ("most_deg = 150.0", "most_deg = nan", vec!["field `pose[0].most_deg`", "nan", "-257 to 257 degrees"]),
        ("sense = \"sum\"", "sense = 1", vec!["field `pose[0].sense`", "the whole number 1", "\"difference\""]),
        ("neutral_us = 1500", "neutral_us = 1500.5", vec!["field `left_hip.neutral_us`", "1500.5", "a whole number"]),
        ("direction = \"forward\"", "direction = \"up\"", vec!["field `left_hip.direction`", "\"mirrored\""]),
        ("park_deg = 0.0", "park_deg = 90", vec!["field `left_hip.park_deg`", "90", "-30 to 60 deg"]),
        ("min_supply_v = 2.7", "min_supply_v = 1", vec!["field `min_supply_v`", "1.8 to 3.6 V"]),
        ("longest_us = 2500", "longest_us = 2500\nspeed = 3", vec!["field `left_hip.speed`", "unknown field"]),
        ("[-2.0, 120.0]", "[-2, 140]", vec!["gate.range", "left_knee", "pulse"]),
    ] {
        let at = good.find(from).unwrap_or_else(|| panic!("{from} is not in the file"));
        let text = format!("{}{to}{}", &good[..at], &good[at + from.len()..]);
        let line = good[..at].matches('\n').count() + 1 + usize::from(to.contains('\n'));
        assert_refused("--robot", &Bad::new("robot.toml", text.as_bytes()), line, &words);
    }
    // A field that is not there is missed at its table.
    for (gone, table, words) in [
        ("us_per_rad = 636.62\n", "[left_hip]", ["field `left_hip.us_per_rad`", "is missing"]),
        ("most_deg = 150.0\n", "[[pose]]", ["field `pose[0].most_deg`", "is missing"]),
    ] {
        let text = good.replacen(gone, "", 1);
        let line = text[..text.find(table).unwrap()].matches('\n').count() + 1;
        assert_refused("--robot", &Bad::new("robot.toml", text.as_bytes()), line, &words);
    }
}

#[test]
fn recordings() {
    for (content, line, words) in [
        (&b""[..], 0, vec!["is empty"]),
        (b"left_knee_deg\n1\n", 1, vec!["column `time_s` is missing"]),
        (b"time_s,left_knee\n0,1\n", 1, vec!["column 2 `left_knee`", "unknown heading"]),
        (b"time_s,knee_deg,knee_deg\n0,1,1\n", 1, vec!["column 3 `knee_deg`", "twice"]),
        (b"time_s,knee_deg\n0,1\n", 2, vec!["1 rows of numbers", "2 or more"]),
        (b"time_s,knee_deg\n0,1\n1,x\n", 3, vec!["column 2 `knee_deg`", "`x` is not a number"]),
        (b"time_s,knee_deg\n0,1\n1,nan\n", 3, vec!["column 2 `knee_deg`", "`nan` is not finite"]),
        (b"time_s,knee_deg\n0,1\n1,inf\n", 3, vec!["column 2 `knee_deg`", "`inf` is not finite"]),
        (b"time_s,knee_deg\n0,1\n0,2\n", 3, vec!["column 1 `time_s`", "later time"]),
        (b"time_s,knee_deg\n0,1\n1,\n", 3, vec!["column 2 `knee_deg`", "not a number"]),
        (b"time_s,knee_deg\n0,1\n1\n", 3, vec!["1 fields", "2"]),
        (b"time_s,knee_deg\n0,1\n1,3000\n", 3, vec!["column 2 `knee_deg`", "wrong unit?", "-200 to 200"]),
        (b"\x7fELF\x00\x01", 1, vec!["is not text"]),
    ] {
        assert_refused("--trace", &Bad::new("walk.csv", content), line, &words);
    }
}

/// Whatever is bad, `watch` has written nothing and `volts` has not either; a recording of that name stays as it was.
#[test]
fn commands_refuse_bad_files_before_they_write() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let write = |name: &str, text: &str| {
        std::fs::write(path(name), text).unwrap();
        path(name)
    };
    let trace = write("bad.csv", "time_s,left_knee_deg\n0,1\n0.01,inf\n");
    let hips = write("hips.csv", "time_s,left_hip_deg,right_hip_deg\n0,1,2\n0.01,2,3\n");
    let far = write("far.csv", "time_s,knee_deg\n0,1\n0.01,150\n");
    let calibration = write("bad.toml", "schema = 1\ndivider = 1\n");
    let elf = write("no.elf", "this is no ELF file");
    let old = write("old.csv", "kept");
    let before: Vec<PathBuf> = sorted(folder.path());

    for (option, file, words) in [
        ("--trace", &trace, "bad.csv:3: column 2 `left_knee_deg`: `inf` is not finite"),
        ("--trace", &hips, "no channel `left_knee`; the recording has `left_hip`, `right_hip`"),
        ("--trace", &far, "`knee` is 150 degrees at 0.01 s, above the calibration table; allowed is -51.92 to"),
        ("--calibration", &calibration, "bad.toml:1: field `interpolation`: is missing"),
    ] {
        let arguments = ["volts".into(), option.into(), file.into(), "--out".into(), path("volts.csv").into()];
        let (code, said) = call(&arguments);
        assert_eq!(code, 2, "{said}");
        assert!(said.contains(words), "{said} does not say {words}");
        assert_eq!(sorted(folder.path()), before);
    }
    // The image is refused first: these tests have no firmware. What follows it is in the tests of `watch`.
    let watch = |elf: &Path, record: &Path| {
        let options = ["watch".into(), "--elf".into(), elf.into(), "--virtual-board".into(), "/no/such/board".into()];
        call(&options.into_iter().chain(["--record".into(), record.into(), "--json".into()]).collect::<Vec<OsString>>())
    };
    for elf in [&elf, &path("missing.elf")] {
        let (code, said) = watch(elf, &old);
        assert_eq!(code, 2, "{said}");
        assert!(said.contains(&elf.display().to_string()), "{said}");
        assert_eq!((std::fs::read_to_string(&old).unwrap().as_str(), sorted(folder.path())), ("kept", before.clone()));
    }
    for arguments in [vec!["volts", "--rate"], vec!["watch"], vec!["check"], vec!["walk-on-water"], vec![]] {
        let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
        assert_eq!(call(&arguments).0, 2, "{arguments:?}");
    }
}

fn sorted(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// The first thing that a new user types.
#[test]
fn a_file_without_an_option_is_refused_with_the_option() {
    let (code, said) = call(&["check".into(), "walk.csv".into()]);
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("`--trace walk.csv` if it is a recording"), "{said}");
}
