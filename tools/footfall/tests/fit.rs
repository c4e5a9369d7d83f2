//! `footfall fit` and `footfall merge` called as programs: output, files, and files that stay unchanged.

use generator_file::file::GeneratorFile;
use joint_units::Joint;
use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const DEFAULT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/traces/gaitkit_fukuchi_healthy.csv");

fn footfall<A: Into<OsString>>(arguments: impl IntoIterator<Item = A>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_footfall"))
        .args(arguments.into_iter().map(Into::into))
        .output()
        .expect("footfall runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", said(output)))
}

/// A walk of so many strides that differ a little, as CSV.
fn walk(stride_s: f64, strides: usize) -> String {
    let mut csv = String::from("time_s,left_hip_deg,right_hip_deg,left_knee_deg,right_knee_deg\n");
    let rows = (stride_s * (strides as f64 + 0.6) * 100.0) as usize;
    for row in 0..rows {
        let t = row as f64 * 0.01;
        let size = 1.0 + 0.03 * (t * 0.9).sin();
        let angle = |mean: f64, one: f64, two: f64, turn: f64, lead: f64| {
            let p = std::f64::consts::TAU * (t / stride_s + lead);
            mean + size * (one * p.cos() + two * (2.0 * p + turn).cos())
        };
        let (hip, knee) = (|lead| angle(8.0, 21.0, -4.0, 0.0, lead), |lead| angle(24.0, 20.0, 15.0, 1.5, lead + 0.2));
        csv += &format!("{t:.3},{:.4},{:.4},{:.4},{:.4}\n", hip(0.0), hip(0.5), knee(0.0), knee(0.5));
    }
    csv
}

#[test]
fn one_recording_gives_parameters_a_report_and_an_object() {
    let folder = tempfile::tempdir().unwrap();
    let (params, page) = (folder.path().join("generator.toml"), folder.path().join("generator.html"));
    let output = footfall([
        "fit".into(),
        DEFAULT.into(),
        "-o".into(),
        OsString::from(&params),
        "--report".into(),
        OsString::from(&page),
        "--evaluations".into(),
        "2000".into(),
        "--json".into(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let value = json(&output);
    assert_eq!(value["generator"], "shape");
    assert!((value["period_s"].as_f64().unwrap() - 1.09).abs() < 0.02, "{}", value["period_s"]);
    assert!(value["strides"].as_u64().unwrap() >= 1);
    for (joint, known) in value["joints"].as_array().unwrap().iter().zip(Joint::ALL) {
        assert_eq!(joint["name"], known.name());
        for key in ["rmse_mean_stride_deg", "rmse_heldout_deg", "stride_sd_deg"] {
            assert!(joint[key].as_f64().is_some_and(|deg| deg > 0.0 && deg < 5.0), "{key}: {joint}");
        }
    }
    assert_eq!(value["certificate"]["accepted"], true);

    // The file builds the generator whose errors were printed, and names its source.
    let file = GeneratorFile::read(&params).unwrap();
    assert_eq!(file.provenance.source, "gaitkit_fukuchi_healthy.csv");
    assert_eq!(file.provenance.source_sha256, value["sha256"].as_str().unwrap());
    assert!(file.provenance.settings.contains("harmonics"), "{}", file.provenance.settings);
    // The page needs nothing else.
    let page = std::fs::read_to_string(&page).unwrap();
    assert!(page.matches("<svg").count() >= 4 && page.contains(value["sha256"].as_str().unwrap()));
    for elsewhere in ["src=", "@import", "<script"] {
        assert!(!page.contains(elsewhere), "{elsewhere}");
    }
    assert_eq!(page.matches("href=").count(), page.matches("href=\"data:text/csv").count());
}

#[test]
fn the_same_file_and_seed_give_the_same_bytes_whatever_the_generator() {
    for generator in ["shape", "phase-coupled", "thesis"] {
        let run = || footfall(["fit", DEFAULT, "--kind", generator, "--evaluations", "2000", "--seed", "3"]);
        let (one, two) = (run(), run());
        assert_eq!(one.stdout, two.stdout, "{generator}");
        let refused = said(&one).contains("is refused");
        assert_eq!(one.status.code(), Some(i32::from(refused)), "{generator}: {}", said(&one));
        // What is refused is not written, and nothing else in its place.
        assert_eq!(one.stdout.is_empty(), refused, "{}", said(&one));
        if !refused {
            let file = GeneratorFile::parse("x", &String::from_utf8_lossy(&one.stdout)).unwrap();
            assert_eq!(file.set.name(), generator);
        }
    }
}

/// A thesis' network that does not come back to its orbit: its own error is said, and no other kind is written in its place.
#[test]
fn a_refused_generator_is_said_with_its_own_error_and_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.toml");
    let fit = |seed: u32, more: &[&str]| {
        let of = ["fit", DEFAULT, "--kind", "thesis", "--evaluations", "1000", "--force", "-o"].map(OsString::from);
        let seed = ["--seed".into(), seed.to_string().into()];
        footfall(of.into_iter().chain([out.clone().into()]).chain(seed).chain(more.iter().map(Into::into)))
    };
    // Which of the first seeds lead to such a network depends on the width of the processor's vectors.
    let seed = (1..=20).find(|seed| said(&fit(*seed, &[])).contains("is refused")).expect("a network that is refused");
    std::fs::remove_file(&out).ok();
    let refused = fit(seed, &[]);
    let words = said(&refused);
    assert_eq!(refused.status.code(), Some(1), "{words}");
    assert!(words.contains("the thesis generator is refused, with an RMSE of"), "{words}");
    assert!(words.contains("no generator is written") && words.contains("--kind shape"), "{words}");
    assert!(!out.exists());
    let value = json(&fit(seed, &["--json"]));
    assert_eq!((&value["generator"], &value["refused"]["generator"]), (&"thesis".into(), &"thesis".into()));
    for joint in 0..4 {
        let own = value["joints"][joint]["rmse_mean_stride_deg"].as_f64().unwrap();
        // A network of sinusoids: far from the least squares shape, near to a person all the same.
        assert!((1.0..40.0).contains(&own), "{own}");
        assert_eq!(value["refused"]["rmse_deg"][joint].as_f64().unwrap(), own);
        assert!(words.contains(&format!("{own:.2}")), "{own}: {words}");
    }
    let forced = fit(seed, &["--force-write"]);
    assert_eq!(forced.status.code(), Some(1), "{}", said(&forced));
    let file = GeneratorFile::parse("x", &std::fs::read_to_string(&out).unwrap()).unwrap();
    assert_eq!(file.set.name(), "thesis");
}

#[test]
fn wrong_input_writes_nothing_and_names_the_error() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.toml");
    let call = |file: &Path, more: &[&str]| {
        let mut arguments: Vec<OsString> = vec!["fit".into(), file.into(), "-o".into(), out.clone().into()];
        arguments.extend(more.iter().map(Into::into));
        let output = footfall(arguments);
        assert!(!out.exists());
        (output.status.code(), said(&output))
    };
    let bad = folder.path().join("bad.csv");
    std::fs::write(&bad, walk(1.1, 4).replace("\n0.500,", "\n0.500,x")).unwrap();
    let (code, words) = call(&bad, &[]);
    assert!(code == Some(2) && words.contains("bad.csv:52: column 2"), "{words}");
    std::fs::write(&bad, "time_s,left_hip_deg\n0,1\n0.01,2\n").unwrap();
    let (code, words) = call(&bad, &[]);
    assert!(code == Some(2) && words.contains("bad.csv"), "{words}");
    let (code, words) = call(&folder.path().join("nowhere.csv"), &[]);
    assert!(code == Some(2) && words.contains("nowhere.csv"), "{words}");
    let (code, words) = call(Path::new(DEFAULT), &["--map", "left_hip=nothing"]);
    assert!(code == Some(2) && words.contains("nothing"), "{words}");
    let (code, words) = call(Path::new(DEFAULT), &["--harmonics", "40"]);
    assert!(code == Some(2) && words.contains("allowed is 1 to 8"), "{words}");
}

/// There and back through OpenSim's format: the fit is the same within the rounding of a printed degree.
#[test]
fn a_recording_converted_to_mot_fits_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (mot, csv) = (folder.path().join("walk.mot"), folder.path().join("back.csv"));
    let convert = |from: &OsString, to: &Path| {
        footfall(["convert".into(), from.clone(), "--low-pass".into(), "off".into(), "-o".into(), OsString::from(to)])
    };
    assert_eq!(convert(&DEFAULT.into(), &mot).status.code(), Some(0));
    assert_eq!(convert(&OsString::from(&mot), &csv).status.code(), Some(0));
    let errors = |file: OsString| {
        let value = json(&footfall(["fit".into(), file, "--json".into()]));
        [0, 1, 2, 3].map(|joint| value["joints"][joint]["rmse_mean_stride_deg"].as_f64().unwrap())
    };
    let (direct, through) = (errors(DEFAULT.into()), errors(OsString::from(&csv)));
    for (a, b) in direct.iter().zip(through) {
        assert!((a - b).abs() < 0.01, "{direct:?} {through:?}");
    }
    let odd = convert(&DEFAULT.into(), &folder.path().join("walk.xlsx"));
    assert!(odd.status.code() == Some(2) && said(&odd).contains(".csv and .mot"), "{}", said(&odd));
}

/// What is read is never written over, and what is written first is not written over by what comes next.
#[test]
fn outputs_that_would_destroy_something_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("own.csv");
    let text = walk(1.1, 4);
    std::fs::write(&own, &text).unwrap();
    let (here, other) = (OsString::from(&own), OsString::from(folder.path().join("w.toml")));
    for (arguments, words) in [
        (vec!["-o".into(), here.clone()], "is an input of this command"),
        (vec!["--report".into(), here.clone()], "is an input of this command"),
        (vec!["-o".into(), other.clone(), "--report".into(), other.clone()], "is named twice"),
        (vec!["-o".into(), folder.path().join("no/where.toml").into()], "its folder does not exist"),
    ] {
        let output = footfall(["fit".into(), here.clone()].into_iter().chain(arguments));
        assert!(output.status.code() == Some(2) && said(&output).contains(words), "{words}: {}", said(&output));
        assert_eq!(std::fs::read_to_string(&own).unwrap(), text);
        assert!(!folder.path().join("w.toml").exists());
    }
}

/// A pipe that nobody writes into, and a link that leads back to where it stands.
#[cfg(unix)]
#[test]
fn neither_pipes_nor_links_in_a_circle_hold_a_batch_up() {
    let (from, to) = (laboratory(), tempfile::tempdir().unwrap());
    assert!(Command::new("mkfifo").arg(from.path().join("pipe.csv")).status().unwrap().success());
    std::os::unix::fs::symlink(from.path(), from.path().join("day2/up")).unwrap();
    let output = batch(from.path(), to.path(), &[]);
    assert!(said(&output).contains("3 fitted, 0 already known, 2 failed"), "{}", said(&output));
    assert!(said(&output).contains("pipe.csv: is no regular file"), "{}", said(&output));
}

/// A folder may come from somebody else: what a link in it names outside of it is not read. A link within it is a recording by another name.
#[cfg(unix)]
#[test]
fn links_out_of_a_folder_are_not_followed() {
    use std::os::unix::fs::symlink;
    let (from, to, elsewhere) = (laboratory(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let secret = elsewhere.path().join("secret.csv");
    std::fs::write(&secret, "the first line of a secret\n").unwrap();
    symlink(&secret, from.path().join("day2/out.csv")).unwrap();
    symlink(elsewhere.path(), from.path().join("folder")).unwrap();
    symlink(from.path().join("a.csv"), from.path().join("day2/within.csv")).unwrap();
    let output = batch(from.path(), to.path(), &[]);
    assert!(said(&output).contains("4 fitted, 0 already known, 1 failed"), "{}", said(&output));
    assert!(said(&output).contains("out.csv is a link out of the folder and is not read"), "{}", said(&output));
    assert!(!said(&output).contains("first line") && !to.path().join("day2__out.csv.fit.json").exists());
}

/// Three recordings, one of them in a folder of its own, and one other file.
fn laboratory() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("day2")).unwrap();
    for (name, stride_s) in [("a.csv", 1.0), ("b.csv", 1.2), ("day2/a.csv", 0.9)] {
        std::fs::write(folder.path().join(name), walk(stride_s, 12)).unwrap();
    }
    std::fs::write(folder.path().join("broken.csv"), "time_s,left_hip_deg\n0,1\n").unwrap();
    std::fs::write(folder.path().join("notes.md"), "not a recording").unwrap();
    folder
}

fn batch(from: &Path, to: &Path, more: &[&str]) -> Output {
    let mut arguments: Vec<OsString> = vec!["fit".into(), from.into(), "-o".into(), to.into()];
    arguments.extend(more.iter().map(Into::into));
    footfall(arguments)
}

/// Everything that a run wrote, but for how long it took.
fn written(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut all: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| {
            let mut text = std::fs::read_to_string(&path).unwrap();
            if path.to_string_lossy().ends_with(".fit.json") {
                let mut value: Value = serde_json::from_str(&text).unwrap();
                value["seconds"] = Value::Null;
                text = value.to_string();
            }
            (path.strip_prefix(folder).unwrap().to_owned(), text)
        })
        .collect();
    all.sort();
    all
}

#[test]
fn a_bad_file_does_not_stop_the_rest_and_a_second_run_fits_nothing_again() {
    let (from, to) = (laboratory(), tempfile::tempdir().unwrap());
    let first = batch(from.path(), to.path(), &["--jobs", "2"]);
    assert_eq!(first.status.code(), Some(1), "one of four failed");
    assert!(said(&first).contains("3 fitted, 0 already known, 1 failed"), "{}", said(&first));
    assert!(said(&first).contains("broken.csv"), "{}", said(&first));
    let names: Vec<String> = written(to.path()).iter().map(|(path, _)| path.display().to_string()).collect();
    for name in [
        "a.csv.toml",
        "b.csv.toml",
        "day2__a.csv.toml",
        "broken.csv.fit.json",
        "summary.csv",
        "summary.json",
        "summary.html",
    ] {
        assert!(names.iter().any(|there| there == name), "{name} in {names:?}");
    }
    let table = std::fs::read_to_string(to.path().join("summary.csv")).unwrap();
    assert_eq!(table.lines().count(), 5);
    assert!(table.lines().any(|line| line.starts_with("broken.csv,") && line.contains("broken.csv:")), "{table}");
    assert!(table.contains("day2__a.csv,shape,0.9"), "{table}");

    let before = written(to.path());
    let second = batch(from.path(), to.path(), &["--jobs", "2"]);
    assert!(said(&second).contains("0 fitted, 3 already known, 1 failed"), "{}", said(&second));
    assert_eq!(written(to.path()), before);

    // As after an interruption: one outcome is missing, one recording has changed since.
    std::fs::remove_file(to.path().join("b.csv.fit.json")).unwrap();
    std::fs::write(from.path().join("a.csv"), walk(1.05, 12)).unwrap();
    let third = batch(from.path(), to.path(), &[]);
    assert!(said(&third).contains("2 fitted, 1 already known, 1 failed"), "{}", said(&third));
    // Other wishes are other fits.
    let fourth = batch(from.path(), to.path(), &["--harmonics", "3"]);
    assert!(said(&fourth).contains("3 fitted, 0 already known, 1 failed"), "{}", said(&fourth));
}

/// A subjects' table, a text, and a table of forces lie between the recordings: they are no failures. Named, they are.
#[test]
fn files_without_gait_are_skipped_in_a_folder() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let put = |name: &str, text: &str| std::fs::write(from.path().join(name), text).unwrap();
    put("a.csv", &walk(1.0, 12));
    put("subjects.csv", "subject,age,height_m\n1,30,1.75\n2,41,1.8\n");
    put("readme.txt", "Recorded on a Tuesday.\nNobody fell.\n");
    put("forces.csv", "time_s,fz_N\n0,700\n0.01,710\n");
    let output = batch(from.path(), to.path(), &[]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let words = said(&output);
    assert!(words.contains("1 fitted, 0 already known, 0 failed, 3 skipped as no recording of gait"), "{words}");
    assert_eq!(words.matches("skipped: ").count(), 3, "{words}");
    assert!(words.contains("forces.csv:1: no column is recognised as a joint; there are"), "{words}");
    assert_eq!(std::fs::read_to_string(to.path().join("summary.csv")).unwrap().lines().count(), 2);

    // A damaged recording is one all the same.
    put("forces.csv", "time_s,left_hip_deg\n0,x\n");
    let output = batch(from.path(), to.path(), &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("1 already known, 1 failed, 2 skipped"), "{}", said(&output));
    // What somebody names he means.
    let named = footfall([
        "fit".into(),
        from.path().join("a.csv"),
        from.path().join("subjects.csv"),
        "-o".into(),
        to.path().into(),
    ]);
    assert_eq!(named.status.code(), Some(1), "{}", said(&named));
    std::fs::remove_file(from.path().join("a.csv")).unwrap();
    std::fs::remove_file(from.path().join("forces.csv")).unwrap();
    let none = batch(from.path(), tempfile::tempdir().unwrap().path(), &[]);
    assert!(none.status.code() == Some(2) && said(&none).contains("none of 2 files is a recording"), "{}", said(&none));
}

/// Two files of one name: each has a result, and a note gives the new name of the second.
#[test]
fn two_recordings_of_one_name_are_two() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for (day, stride_s) in [("mon", 1.0), ("tue", 1.2), ("wed", 0.9)] {
        std::fs::create_dir(from.path().join(day)).unwrap();
        std::fs::write(from.path().join(day).join("walk.csv"), walk(stride_s, 12)).unwrap();
    }
    // And one that already has the name that the second would get; one file by two paths is one.
    std::fs::write(from.path().join("tue/walk~2.csv"), walk(1.1, 12)).unwrap();
    let file = |name: &str| OsString::from(from.path().join(name));
    let call = || {
        let files = ["wed/walk.csv", "mon/walk.csv", "tue/walk.csv", "tue/walk~2.csv", "tue/../mon/walk.csv"].map(file);
        footfall(["fit".into()].into_iter().chain(files).chain(["-o".into(), to.path().into()]))
    };
    let output = call();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&output).contains("4 fitted"), "{}", said(&output));
    assert!(
        said(&output).contains("tue/walk.csv is called walk~3.csv: another recording has the same name"),
        "{}",
        said(&output)
    );
    let period = |name: &str| {
        let text = std::fs::read_to_string(to.path().join(format!("{name}.fit.json"))).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["period_s"].as_f64().unwrap()
    };
    let found = ["walk.csv", "walk~2.csv", "walk~3.csv", "walk~4.csv"].map(period);
    for (period, wanted) in found.iter().zip([1.0, 1.1, 1.2, 0.9]) {
        assert!((period - wanted).abs() < 0.02, "{found:?}");
    }
    assert!(said(&call()).contains("0 fitted, 4 already known"));
}

/// What a generator would not heed is not taken in silence.
#[test]
fn options_of_the_shape_alone_are_refused_with_another_generator() {
    for (generator, option, value) in [
        ("phase-coupled", "--harmonics", "4"),
        ("thesis", "--harmonics", "4"),
        ("phase-coupled", "--follow", "left_hip"),
    ] {
        let output = footfall(["fit", DEFAULT, "--kind", generator, option, value]);
        let words = format!("{option} with --kind {generator}: allowed is {option} with --kind shape");
        assert!(output.status.code() == Some(2) && said(&output).contains(&words), "{}", said(&output));
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn shares_of_several_computers_merge_to_the_same_summary() {
    let (from, whole, shared) = (laboratory(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    batch(from.path(), whole.path(), &["--jobs", "1"]);
    for share in ["1/3", "2/3", "3/3"] {
        batch(from.path(), shared.path(), &["--shard", share]);
    }
    assert!(!shared.path().join("summary.csv").exists(), "no share makes the summary");
    let merged = footfall(["merge".into(), OsString::from(shared.path())]);
    assert!(
        merged.status.code() == Some(1) && said(&merged).contains("recordings that failed: 1; the summary says why"),
        "{}",
        said(&merged)
    );
    assert_eq!(written(shared.path()), written(whole.path()));
    // A file that is no result, and one that nobody ever writes to, are named; the others stay in the summary.
    std::fs::write(shared.path().join("x.fit.json"), "{\"a\":1}").unwrap();
    #[cfg(unix)]
    rustix::fs::mkfifoat(rustix::fs::CWD, shared.path().join("pipe.fit.json"), rustix::fs::Mode::RWXU).unwrap();
    let before = std::fs::read_to_string(shared.path().join("summary.csv")).unwrap();
    let strange = footfall(["merge".into(), OsString::from(shared.path())]);
    assert!(
        strange.status.code() == Some(1) && said(&strange).contains("x.fit.json: is no result of a fit"),
        "{}",
        said(&strange)
    );
    let after = std::fs::read_to_string(shared.path().join("summary.csv")).unwrap();
    assert!(before.lines().all(|line| after.contains(line)), "{before}\n{after}");
    assert!(after.contains("x.fit.json: is no result of a fit"), "{after}");
    #[cfg(unix)]
    assert!(after.contains("pipe.fit.json: is no regular file"), "{after}");
    let empty = tempfile::tempdir().unwrap();
    let nothing = footfall(["merge".into(), OsString::from(empty.path())]);
    assert!(
        nothing.status.code() == Some(2) && said(&nothing).contains("has no result of `footfall fit`"),
        "{}",
        said(&nothing)
    );
}

/// A follower's events are in the file, and its certificate has the time to lock; other generators with --follow are refused.
#[test]
fn a_follower_has_its_events_and_its_time_to_lock() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("follower.toml");
    let written = out.display().to_string();
    let led =
        |more: &[&str]| footfall([&["fit", DEFAULT, "--follow", "left_knee", "--json", "-o", &written], more].concat());
    let output = led(&["--events", "peak"]);
    assert!(output.status.success(), "{}", said(&output));
    let following = &json(&output)["certificate"]["following"];
    assert_eq!((&following["sensor"], &following["events"]), (&Value::from("left_knee"), &Value::from("peak")));
    assert!(following["lock_worst_s"].as_f64().is_some_and(|worst| worst < 4.0), "{following}");
    let text = std::fs::read_to_string(&out).expect("written");
    assert!(text.contains("sensor = \"left_knee\"\nevents = \"peak\"\n"), "{text}");
    GeneratorFile::read(&out).expect("a generator file");

    for (more, wanted) in [
        (&["--kind", "phase-coupled"][..], "allowed is --follow with --kind shape"),
        (&["--events", "heel"], "none, peak, foot_switch"),
    ] {
        let output = led(more);
        assert!(output.status.code() == Some(2) && said(&output).contains(wanted), "{}", said(&output));
    }
}
