//! `footfall convert`: invents nothing, filters nothing unless asked and never twice, and never writes over what it reads.
#![cfg(unix)]

mod common;

use common::{DEFAULT, footfall, said, walk};
use serde_json::Value;
use std::ffi::OsString;
use std::path::Path;
use std::process::Output;

fn convert(from: &Path, to: &Path, more: &[&str]) -> Output {
    let files: Vec<OsString> = vec!["convert".into(), from.into(), "-o".into(), to.into()];
    footfall(files.into_iter().chain(more.iter().map(Into::into)))
}

fn done(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", said(output));
}

fn errors(file: &Path, more: &[&str]) -> ([f64; 4], String) {
    let fitted =
        footfall([OsString::from("fit"), file.into(), "--json".into()].into_iter().chain(more.iter().map(Into::into)));
    let value: Value = serde_json::from_slice(&fitted.stdout).unwrap_or_else(|_| panic!("{}", said(&fitted)));
    let errors = [0, 1, 2, 3].map(|joint| value["joints"][joint]["rmse_mean_stride_deg"].as_f64().unwrap());
    (errors, String::from_utf8_lossy(&fitted.stderr).into_owned())
}

#[test]
fn gaps_and_jumps_stay_and_nothing_is_filtered() {
    let folder = tempfile::tempdir().unwrap();
    let [from, csv, mot] = ["walk.csv", "out.csv", "out.mot"].map(|name| folder.path().join(name));
    let rows: Vec<String> = walk(6.0, 1.1, 0.0)
        .lines()
        .enumerate()
        .map(|(n, row)| {
            let mut cells: Vec<&str> = row.split(',').collect();
            match n {
                // A short gap, a long one, one at the end, and a jump.
                100..=104 => cells[1] = "",
                200..=260 => cells[3] = "",
                580.. => cells[2] = "",
                400 => cells[4] = "99.5",
                _ => {}
            }
            cells.join(",")
        })
        .collect();
    std::fs::write(&from, rows.join("\n") + "\n").unwrap();
    for to in [&csv, &mot] {
        let output = convert(&from, to, &[]);
        done(&output);
        assert!(said(&output).contains("missing values; left empty"), "{}", said(&output));
        assert!(!said(&output).contains("low-pass"), "{}", said(&output));
    }
    let text = std::fs::read_to_string(&csv).unwrap();
    assert!(
        text.starts_with("# footfall convert ") && text.contains("\n# source: walk.csv\n# source-sha256: "),
        "{text}"
    );
    assert!(text.contains("\n# options: none\n# low-pass: off\n"), "{text}");
    let cells = |row: &str| -> Vec<Option<f64>> {
        row.split(['\t', ',']).map(|cell| cell.parse().ok().filter(|x: &f64| x.is_finite())).collect()
    };
    let wanted: Vec<Vec<Option<f64>>> = rows[1..].iter().map(|row| cells(row)).collect();
    let rows_below = |text: &str, header: &str| -> Vec<Vec<Option<f64>>> {
        text.lines().skip_while(|line| !line.starts_with(header)).skip(1).map(cells).collect()
    };
    assert!(rows_below(&text, "time_s,") == wanted);
    assert!(rows_below(&std::fs::read_to_string(&mot).unwrap(), "time\t") == wanted);
}

#[test]
fn a_file_that_was_filtered_is_not_filtered_again() {
    let folder = tempfile::tempdir().unwrap();
    let [plain, filtered, twice] = ["plain.csv", "filtered.csv", "twice.mot"].map(|name| folder.path().join(name));
    let default = Path::new(DEFAULT);
    done(&convert(default, &plain, &[]));
    done(&convert(default, &filtered, &["--low-pass", "customary"]));
    done(&convert(&filtered, &twice, &[]));
    let (direct, _) = errors(default, &[]);
    let (unfiltered, words) = errors(&plain, &[]);
    assert!(!words.contains("not filtered again"), "{words}");
    assert_eq!(direct, unfiltered, "a conversion without filter is filtered by `fit` as its source is");
    for file in [&filtered, &twice] {
        let (once, words) = errors(file, &[]);
        assert!(words.contains("`footfall convert` filtered this file at 6 Hz; it is not filtered again"), "{words}");
        for (once, direct) in once.iter().zip(direct) {
            assert!((once - direct).abs() < 1e-9, "{once}, not {direct}");
        }
        let asked = footfall([OsString::from("fit"), file.into(), "--low-pass".into(), "5".into()]);
        assert!(asked.status.code() == Some(2) && said(&asked).contains("twice is too much"), "{}", said(&asked));
        let again = convert(file, &folder.path().join("again.csv"), &["--low-pass", "5"]);
        assert!(again.status.code() == Some(2) && said(&again).contains("twice is too much"), "{}", said(&again));
    }
}

#[test]
fn the_input_is_never_the_output() {
    let folder = tempfile::tempdir().unwrap();
    let [file, soft, hard] = ["walk.csv", "soft.csv", "hard.csv"].map(|name| folder.path().join(name));
    std::fs::copy(DEFAULT, &file).unwrap();
    std::os::unix::fs::symlink(&file, &soft).unwrap();
    std::fs::hard_link(&file, &hard).unwrap();
    let before = std::fs::read(&file).unwrap();
    for (from, to) in [(&file, &file), (&file, &soft), (&file, &hard), (&soft, &file), (&hard, &soft)] {
        for more in [&[][..], &["--force"]] {
            let output = convert(from, to, more);
            assert!(output.status.code() == Some(2), "{}", said(&output));
            assert!(said(&output).contains("is an input of this command"), "{}", said(&output));
        }
    }
    assert_eq!(std::fs::read(&file).unwrap(), before);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
}

/// Other commands read a conversion as well, with gaps too.
#[test]
fn a_conversion_can_be_played_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let [holed, out] = ["holed.csv", "out.csv"].map(|name| folder.path().join(name));
    let text = std::fs::read_to_string(DEFAULT).unwrap();
    let rows: Vec<String> = text
        .lines()
        .enumerate()
        .map(
            |(n, row)| {
                if (50..54).contains(&n) { format!("{},,,,", row.split(',').next().unwrap()) } else { row.into() }
            },
        )
        .collect();
    std::fs::write(&holed, rows.join("\n") + "\n").unwrap();
    done(&convert(&holed, &out, &[]));
    let played = footfall([OsString::from("volts"), "--trace".into(), (&out).into()]);
    done(&played);
    let checked = footfall([OsString::from("check"), "--trace".into(), (&out).into()]);
    done(&checked);
    let words = said(&checked);
    assert!(
        words.contains("converted  from holed.csv by footfall") && words.contains("good: `fit` takes it"),
        "{words}"
    );
}

/// A hip that the file does not have, and more gaps than are listed one by one: both are said, and a gap is left empty.
#[test]
fn what_is_not_in_the_source_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["walk.csv", "out.csv"].map(|name| folder.path().join(name));
    let rows: Vec<String> = walk(10.0, 1.1, 0.0)
        .lines()
        .enumerate()
        .map(|(n, row)| {
            let mut cells: Vec<&str> = row.split(',').collect();
            if n > 50 && n % 60 < 2 {
                cells[3] = "";
            }
            cells.remove(2);
            cells.join(",")
        })
        .collect();
    std::fs::write(&from, rows.join("\n") + "\n").unwrap();
    let output = convert(&from, &to, &[]);
    done(&output);
    let text = std::fs::read_to_string(&to).unwrap();
    let missing = "right hip: not in walk.csv; the output has no such column";
    assert!(said(&output).contains(&format!("note: {missing}\n")), "{}", said(&output));
    assert!(text.contains(&format!("# changed: {missing}\n")), "{text}");
    let gaps = "16 gaps of missing values, the longest 0.030 s; left empty";
    assert!(said(&output).contains(gaps) && text.contains(gaps), "{}", said(&output));
    assert!(!said(&output).contains("cubic") && !text.contains("cubic"), "{}", said(&output));
    let empty = text.lines().filter(|line| line.ends_with(",,") || line.contains(",,")).count();
    assert_eq!(empty, rows.iter().filter(|row| row.contains(",,")).count());
}

/// Two persons in one table: refused, and the rows of one are written.
#[test]
fn rows_of_one_subject_are_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["both.csv", "anna.csv"].map(|name| folder.path().join(name));
    let of = |name: &str, stride_s: f64| -> Vec<String> {
        walk(6.0, stride_s, 0.0).lines().skip(1).map(|row| format!("{name},{row}")).collect()
    };
    let header = format!("subject,{}", walk(0.1, 1.0, 0.0).lines().next().unwrap());
    let both = [vec![header], of("Anna", 1.1), of("Bert", 1.3)].concat();
    std::fs::write(&from, both.join("\n") + "\n").unwrap();
    for command in ["convert", "fit"] {
        let files: [OsString; 4] = [command.into(), (&from).into(), "-o".into(), (&to).into()];
        let output = footfall(files);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains("`Anna` (600 rows), `Bert` (600 rows)"), "{}", said(&output));
        assert!(said(&output).contains("`--where subject=Anna`") && !to.exists(), "{}", said(&output));
    }
    done(&convert(&from, &to, &["--where", "subject=Bert"]));
    let text = std::fs::read_to_string(&to).unwrap();
    assert!(text.contains("\n# options: --where subject=Bert\n"), "{text}");
    let numbers = |row: &str| row.split(',').map(|cell| cell.parse().unwrap()).collect::<Vec<f64>>();
    let (found, wanted) = (numbers(text.lines().last().unwrap()), walk(6.0, 1.3, 0.0));
    assert_eq!(found, numbers(wanted.lines().last().unwrap()));
    let wrong = convert(&from, &folder.path().join("x.csv"), &["--where", "subject"]);
    assert!(wrong.status.code() == Some(2) && said(&wrong).contains("COLUMN=VALUE"), "{}", said(&wrong));
}

/// What no person does is refused by the words of `fit`, a warning with --strict, and what `fit` refuses for its strides is said.
#[test]
fn the_result_is_judged_as_a_fit_judges_it() {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["walk.csv", "out.csv"].map(|name| folder.path().join(name));
    let changed = |column: usize, change: &dyn Fn(f64) -> f64| {
        let rows = walk(6.0, 1.1, 0.0);
        let row = |row: &str| {
            let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
            if let Ok(angle) = cells[column].parse::<f64>() {
                cells[column] = change(angle).to_string();
            }
            cells.join(",") + "\n"
        };
        std::fs::write(&from, rows.lines().map(row).collect::<String>()).unwrap();
    };
    for (column, change, words) in [
        (1, (&|x| x + 120.0) as &dyn Fn(f64) -> f64, "left_hip has a mean of 12"),
        (1, &|x: f64| x.abs(), "left_hip turns back in a corner at 0 degrees"),
    ] {
        changed(column, change);
        let output = convert(&from, &to, &[]);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(words) && !to.exists(), "{}", said(&output));
        let checked = footfall(["check".into(), "--trace".into(), OsString::from(&from)]);
        assert!(said(&checked).contains(words), "{}", said(&checked));
    }
    // A hip of which upright is 90 degrees: possible, and doubtful.
    changed(1, &|x| x + 80.0);
    let output = convert(&from, &to, &["--strict"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("--strict allows no warning: left hip: a mean of") && !to.exists(),
        "{}",
        said(&output)
    );
    done(&convert(&from, &to, &[]));
    std::fs::write(&from, walk(0.9, 1.1, 0.0)).unwrap();
    let output = convert(&from, &to, &["--force"]);
    done(&output);
    assert!(
        said(&output).contains("note: `fit` refuses it: no stride repeats") && !said(&output).contains("next:"),
        "{}",
        said(&output)
    );
}

/// A table with the hips times a sign, and only so many rows.
fn table_of(rows: usize, hips: f64) -> String {
    let text = walk(6.0, 1.1, 0.0);
    let mut lines = text.lines();
    let header = lines.next().unwrap().to_owned() + "\n";
    lines.take(rows).fold(header, |all, row| {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        all + &format!("{},{},{},{},{}\n", cells[0], hips * cells[1], hips * cells[2], cells[3], cells[4])
    })
}

fn checked(file: &Path, more: &[&str]) -> (Option<i32>, String) {
    let files: Vec<OsString> = vec!["check".into(), "--trace".into(), file.into()];
    let output = footfall(files.into_iter().chain(more.iter().map(Into::into)));
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned() + &said(&output))
}

/// Less than a stride shows no sign of a hip: neither the source nor its conversion says that flexion is positive.
#[test]
fn a_sign_that_was_assumed_is_not_known_in_the_conversion() {
    let folder = tempfile::tempdir().unwrap();
    let [from, csv, mot, named] = ["short.csv", "out.csv", "out.mot", "named.csv"].map(|name| folder.path().join(name));
    std::fs::write(&from, table_of(40, -1.0)).unwrap();
    let warning = "left hip: neither the file nor the strides show whether flexion is positive, and it is assumed; `--hip-sign flexion|extension` names the sign";
    let is_not_known = |file: &Path| {
        let (_, words) = checked(file, &[]);
        let line = words.lines().find(|line| line.trim_start().starts_with("left_hip")).unwrap();
        assert!(line.ends_with("sign not known, flexion assumed") && words.contains(warning), "{words}");
    };
    is_not_known(&from);
    for to in [&csv, &mot] {
        let output = convert(&from, to, &["--strict"]);
        assert!(output.status.code() == Some(1) && !to.exists(), "{}", said(&output));
        let output = convert(&from, to, &[]);
        done(&output);
        assert!(said(&output).contains(&format!("warning: {warning}")), "{}", said(&output));
        is_not_known(to);
    }
    done(&convert(&csv, &named, &["--hip-sign", "extension", "--strict"]));
    let (_, words) = checked(&named, &[]);
    assert!(words.contains("left_hip   `left_hip_deg`, degrees, stated in the file, flexion positive\n"), "{words}");
    assert!(!words.contains("warning"), "{words}");
}

/// The shape of the strides is a guess, which changes the data: `--strict` refuses it, until the sign is named.
#[test]
fn a_sign_that_the_shape_changes_is_refused_by_strict_also_in_the_conversion() {
    let folder = tempfile::tempdir().unwrap();
    let [from, out] = ["walk.csv", "out.csv"].map(|name| folder.path().join(name));
    std::fs::write(&from, table_of(usize::MAX, -1.0)).unwrap();
    let is_refused = |file: &Path| {
        let (code, words) = checked(file, &["--strict"]);
        assert!(code == Some(1) && words.contains("--strict allows no warning: left hip: "), "{words}");
    };
    is_refused(&from);
    done(&convert(&from, &out, &[]));
    is_refused(&out);
    assert_eq!(checked(&from, &["--strict", "--hip-sign", "extension"]).0, Some(0));
    assert_eq!(checked(&out, &["--strict", "--hip-sign", "flexion"]).0, Some(0));
}

/// Hip and knee of one leg in each other's column: the joints are reported with the columns that they are in.
#[test]
fn an_exchanged_joint_is_reported_with_its_column() {
    let folder = tempfile::tempdir().unwrap();
    let from = folder.path().join("walk.csv");
    let text = table_of(usize::MAX, 1.0).replacen("left_hip_deg", "?", 1).replacen("left_knee_deg", "left_hip_deg", 1);
    std::fs::write(&from, text.replacen('?', "left_knee_deg", 1)).unwrap();
    let (_, words) = checked(&from, &[]);
    assert!(words.contains("left leg: the hip column moves like a knee"), "{words}");
    for line in ["  left_hip   `left_knee_deg`, ", "  left_knee  `left_hip_deg`, ", "  right_hip  `right_hip_deg`, "] {
        assert!(words.contains(line), "{line}: {words}");
    }
}

/// Columns that are called extension are read where the map names them, and the message has the map.
#[test]
fn columns_of_extension_are_refused_with_the_options_that_read_them() {
    let folder = tempfile::tempdir().unwrap();
    let from = folder.path().join("walk.csv");
    let text = table_of(usize::MAX, -1.0).replace("_hip_deg", "_hip_extension_deg");
    std::fs::write(&from, text).unwrap();
    let (code, words) = checked(&from, &[]);
    let options = "--map left_hip=2,right_hip=3 --hip-sign extension";
    assert!(code == Some(2) && words.contains(options), "{words}");
    assert!(
        words.contains("no left_hip, no right_hip; ") && words.contains("`--map left_hip=COLUMN,right_hip=COLUMN`"),
        "{words}"
    );
    let more: Vec<&str> = options.split(' ').chain(["--strict"]).collect();
    assert_eq!(checked(&from, &more).0, Some(0));
}
