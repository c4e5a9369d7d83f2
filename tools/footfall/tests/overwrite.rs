//! No command replaces a file without `--force`, and none replaces what is no file.
#![cfg(unix)]

mod common;

use common::{DEFAULT, footfall, said, walk};
use std::ffi::OsString;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::process::{Command, Stdio};

const ROWS: &str = "angle_deg,volts\n0,0.5\n20,0.9\n40,1.3\n60,1.7\n80,2.1\n100,2.5\n";

fn words(line: &str, folder: &Path) -> Vec<OsString> {
    line.split_whitespace()
        .map(|word| match word.strip_prefix('@') {
            Some(name) => folder.join(name).into(),
            None if word == "DEFAULT" => DEFAULT.into(),
            None => word.into(),
        })
        .collect()
}

/// Every command that writes files, with the file that is there before.
const COMMANDS: [(&str, &str); 17] = [
    ("fit DEFAULT -o @old", "old"),
    ("fit DEFAULT -o @new --report @old", "old"),
    ("convert DEFAULT -o @old.csv", "old.csv"),
    ("convert DEFAULT -o @old.mot", "old.mot"),
    ("volts --out @old", "old"),
    ("pack @generator.toml --out @old", "old"),
    ("pack --sensor left_knee --out @old", "old"),
    ("certify @generator.toml --starts 20 --out @old", "old"),
    ("calibrate @rows.csv -o @old", "old"),
    ("calibrate @rows.csv -o @new --report @old", "old"),
    ("calibrate @rows.csv -o @new --svg @old", "old"),
    ("entrain DEFAULT --svg @old", "old"),
    ("walk --secs 0.1 --svg @old", "old"),
    ("obb --reversibility 1,5 --svg @old", "old"),
    ("hexapod --svg @old", "old"),
    ("smer @graph.txt --svg @old", "old"),
    ("figures --out @.", "hexapod-steps.svg"),
];

#[test]
fn every_command_keeps_a_file_unless_forced() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).unwrap();
    put("generator.toml", &footfall(["defaults", "generator"]).stdout);
    put("rows.csv", ROWS.as_bytes());
    put("graph.txt", b"a -> b");
    let count = || std::fs::read_dir(folder.path()).unwrap().count();
    for (command, old) in COMMANDS {
        put(old, b"old");
        let (path, before) = (folder.path().join(old), count());
        let kept = footfall(words(command, folder.path()));
        let text = said(&kept);
        assert!(kept.status.code() == Some(2) && text.contains("--force") && text.contains(old), "{command}: {text}");
        assert_eq!((std::fs::read(&path).unwrap(), count()), (b"old".to_vec(), before), "{command}: {text}");
        let forced = footfall(words(command, folder.path()).into_iter().chain(["--force".into()]));
        assert_ne!(forced.status.code(), Some(2), "{command}: {}", said(&forced));
        assert_ne!(std::fs::read(&path).unwrap(), b"old", "{command}");
        for name in [old, "new"] {
            let _ = std::fs::remove_file(folder.path().join(name));
        }
    }
}

#[test]
fn an_input_is_never_an_output() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).unwrap();
    put("generator.toml", &footfall(["defaults", "generator"]).stdout);
    put("rows.csv", ROWS.as_bytes());
    put("walk.csv", walk(6.0, 1.1, 0.0).as_bytes());
    put("graph.txt", b"a -> b");
    assert_eq!(footfall(words("calibrate @rows.csv -o @sensor.toml", folder.path())).status.code(), Some(0));
    for (command, input) in [
        ("certify @generator.toml --starts 20 -o @generator.toml --force", "generator.toml"),
        ("pack @generator.toml -o @generator.toml --force", "generator.toml"),
        ("pack --sensor left_knee=@sensor.toml -o @sensor.toml --force", "sensor.toml"),
        ("calibrate @rows.csv -o @rows.csv --force", "rows.csv"),
        ("fit @walk.csv -o @walk.csv --force", "walk.csv"),
        ("convert @walk.csv -o @walk.csv --force", "walk.csv"),
        ("volts --trace @walk.csv --out @walk.csv --force", "walk.csv"),
        ("entrain @walk.csv --svg @walk.csv --force", "walk.csv"),
        ("smer @graph.txt --svg @graph.txt --force", "graph.txt"),
    ] {
        let before = std::fs::read(folder.path().join(input)).unwrap();
        // Of `left_knee=@sensor.toml` the file's part is a path too.
        let arguments = words(command, folder.path()).into_iter().map(|word| {
            let text = word.to_string_lossy().replace("=@", &format!("={}/", folder.path().display()));
            OsString::from(text)
        });
        let refused = footfall(arguments);
        let text = said(&refused);
        assert!(refused.status.code() == Some(2) && text.contains("is an input"), "{command}: {text}");
        assert_eq!(std::fs::read(folder.path().join(input)).unwrap(), before, "{command}");
    }
}

/// Nodes made here: a pipe with a reader, and a copy of /dev/full. Both are still there afterwards.
#[test]
fn pipes_and_devices_are_written_through() {
    let folder = tempfile::tempdir().unwrap();
    let (pipe, full) = (folder.path().join("pipe.csv"), folder.path().join("full.csv"));
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for force in [&[][..], &["--force".into()]] {
        let reader = Command::new("cat").arg(&pipe).stdout(Stdio::piped()).spawn().unwrap();
        let arguments: Vec<OsString> = vec!["convert".into(), DEFAULT.into(), "-o".into(), (&pipe).into()];
        let began = std::time::Instant::now();
        // `cat` may not have opened the pipe yet.
        let output = loop {
            let output = footfall(arguments.iter().chain(force));
            if output.status.success() || began.elapsed().as_secs() > 20 {
                break output;
            }
            assert!(said(&output).contains("no program reads"), "{}", said(&output));
        };
        assert!(output.status.success(), "{}", said(&output));
        let read = reader.wait_with_output().unwrap().stdout;
        assert!(read.starts_with(b"# footfall convert ") && read.ends_with(b"\n"));
        assert!(std::fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo());
    }
    if !Command::new("mknod").arg(&full).args(["c", "1", "7"]).stderr(Stdio::null()).status().unwrap().success() {
        // Who may not make a device may not replace the machine's own one.
        std::os::unix::fs::symlink("/dev/full", &full).unwrap();
    }
    for command in ["fit DEFAULT -o", "convert DEFAULT -o", "volts --out"] {
        let output = footfall(words(command, folder.path()).into_iter().chain([(&full).into(), "--force".into()]));
        assert!(output.status.code() == Some(1) && said(&output).contains("cannot be written"), "{}", said(&output));
        assert!(std::fs::metadata(&full).unwrap().file_type().is_char_device(), "{command}");
    }
    // Standard output by its name, also where it is a file: nothing of it is lost.
    let file = folder.path().join("both.csv");
    let line = format!("echo before; '{}' volts --out /dev/stdout; echo after", env!("CARGO_BIN_EXE_footfall"));
    let out = std::fs::File::create(&file).unwrap();
    assert!(Command::new("sh").arg("-c").arg(line).stdout(out).stderr(Stdio::null()).status().unwrap().success());
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        text.starts_with("before\ntime_s,PA1\n0,") && text.ends_with("\nafter\n"),
        "{}",
        &text[..text.len().min(200)]
    );
}

#[test]
fn a_link_is_written_through_with_force_alone() {
    let folder = tempfile::tempdir().unwrap();
    let [file, link, none] = ["file.toml", "link.toml", "none.toml"].map(|name| folder.path().join(name));
    std::fs::write(&file, "old").unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    std::os::unix::fs::symlink(folder.path().join("nothing"), &none).unwrap();
    let fit = |out: &Path, more: &[&str]| {
        let start: Vec<OsString> = vec!["fit".into(), DEFAULT.into(), "-o".into(), out.into()];
        footfall(start.into_iter().chain(more.iter().map(Into::into)))
    };
    assert_eq!(fit(&link, &[]).status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "old");
    assert_eq!(fit(&link, &["--force"]).status.code(), Some(0));
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(std::fs::read_to_string(&file).unwrap().contains("schema"));
    let dangling = fit(&none, &["--force"]);
    assert!(dangling.status.code() == Some(2) && said(&dangling).contains("a link to no file"), "{}", said(&dangling));
}

/// A batch replaces what a batch wrote, also after an interruption, and nothing else.
#[test]
fn a_batch_replaces_its_own_files_alone() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    std::fs::write(from.path().join("a.csv"), walk(6.0, 1.1, 0.0)).unwrap();
    let batch = |more: &[&str]| {
        let start: Vec<OsString> = vec!["fit".into(), from.path().into(), "-o".into(), to.path().into()];
        footfall(start.into_iter().chain(more.iter().map(Into::into)))
    };
    for (foreign, text) in [("a.csv.toml", "mine = 1"), ("a.csv.fit.json", "[]"), ("summary.csv", "mine")] {
        let path = to.path().join(foreign);
        std::fs::write(&path, text).unwrap();
        let refused = batch(&[]);
        assert!(refused.status.code() == Some(2) && said(&refused).contains("--force"), "{}", said(&refused));
        assert_eq!(std::fs::read_dir(to.path()).unwrap().count(), 1, "{foreign}");
        std::fs::remove_file(&path).unwrap();
    }
    assert_eq!(batch(&[]).status.code(), Some(0));
    // Interrupted before the outcome, and called with other options.
    std::fs::remove_file(to.path().join("a.csv.fit.json")).unwrap();
    let again = batch(&[]);
    assert!(again.status.code() == Some(0) && said(&again).contains("1 fitted"), "{}", said(&again));
    let other = batch(&["--harmonics", "3"]);
    assert!(other.status.code() == Some(0) && said(&other).contains("1 fitted"), "{}", said(&other));
}
