//! Messages on standard error: where they cannot be written the run ends as it does otherwise, and what they quote from files is escaped.

mod common;

use common::{DEFAULT, footfall, said};
use std::path::Path;

/// What a command says of a file with this content: both streams, without the byte that begins an escape sequence.
fn quoted(arguments: &[&str], name: &str, content: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    let place = path.to_str().unwrap();
    let output = footfall(arguments.iter().map(|argument| argument.replace("FILE", place)));
    let said = said(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(!said.contains(['\u{1b}', '\u{9b}', '\r']), "{arguments:?}: {said:?}");
    said
}

/// A graph, a generator, a robot, sensors, recordings, lists of poses and of edges: none makes a terminal obey.
#[test]
fn escape_sequences_in_files_are_not_passed_on() {
    let wipe = "\u{1b}[2J\u{9b}31m\rx";
    let escaped = r"\u001b[2J\u009b31m";
    for line in [format!("a -> b{wipe}\n"), format!("{wipe} = 1\n"), format!("a = {wipe}\n"), format!("a b {wipe} 1\n")]
    {
        let said = quoted(&["smer", "FILE"], "graph.txt", line.as_bytes());
        assert!(said.contains(escaped), "{line:?}: {said}");
    }
    for (arguments, name, content) in [
        (&["check", "--trace", "FILE"][..], "a.csv", format!("time_s,left_hip_deg,{wipe}\n0,1,2\n")),
        (&["check", "--trace", "FILE"], "b.csv", format!("time_s,left_knee_deg\n0,{wipe}\n0.01,{wipe}\n")),
        (&["volts", "--trace", "FILE"], "c.csv", format!("time_s,left_knee_deg\n0,{wipe}\n")),
        (&["check", "--robot", "FILE"], "d.toml", format!("schema = \"{wipe}\"\n")),
        (&["check", "--robot", "FILE"], "e.toml", "\"\\u001b[2J\" = 1\n".into()),
        (&["check", "--generator", "FILE"], "f.toml", "kind = \"\\u001b[2J\"\n".into()),
        (&["check", "--calibration", "FILE"], "g.toml", "\"\\u001b[2J\" = \"\\u001b[2J\"\n".into()),
        (&["calibrate", "FILE", "-o", "no.toml"], "h.csv", format!("{wipe},code\n{wipe},2\n")),
        (&["sync", "FILE"], "i.csv", format!("{wipe},state\n0,{wipe}\n")),
    ] {
        quoted(arguments, name, content.as_bytes());
    }
    assert!(!Path::new("no.toml").exists());
}

#[cfg(target_os = "linux")]
mod full {
    use super::*;
    use std::fs::OpenOptions;
    use std::process::{Command, Stdio};

    /// Exit code and standard output, with a standard error that can be written or with one on a full device.
    fn ended(arguments: &[&str], full: bool) -> (Option<i32>, Vec<u8>) {
        let device = || Stdio::from(OpenOptions::new().write(true).open("/dev/full").unwrap());
        let output = Command::new(env!("CARGO_BIN_EXE_footfall"))
            .args(arguments)
            .stdin(Stdio::null())
            .stderr(if full { device() } else { Stdio::piped() })
            .output()
            .unwrap();
        assert!(full || !output.stderr.is_empty(), "{arguments:?} says nothing");
        (output.status.code(), output.stdout)
    }

    /// Notes, progress, results and errors: the exit code and the data are those of a run whose messages are read.
    #[test]
    fn a_full_standard_error_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let dead = file("dead.txt");
        std::fs::write(&dead, "a -> b\nb -> c\nc -> a\n").unwrap();
        let (volts, converted) = (file("volts.csv"), file("converted.csv"));
        let (recordings, fits) = (file("recordings"), file("fits"));
        std::fs::create_dir(&recordings).unwrap();
        std::fs::copy(DEFAULT, Path::new(&recordings).join("a.csv")).unwrap();
        for (arguments, code) in [
            (&["walk", "--secs", "2", "--switch", "t=1 stop", "--switch", "t=1 speed 1.2"][..], 0),
            (&["walk", "--gait", "canter"], 2),
            (&["walk", "--no-such-option"], 2),
            (&["smer", &dead], 1),
            (&["volts", "--trace", DEFAULT, "-o", &volts, "--force"], 0),
            (&["convert", DEFAULT, "-o", &converted, "--force", "--low-pass", "6"], 0),
            (&["certify", "cell-walk", "--starts", "20"], 0),
            (&["fit", DEFAULT], 0),
            (&["fit", &recordings, "-o", &fits], 0),
        ] {
            let (read, lost) = (ended(arguments, false), ended(arguments, true));
            assert_eq!(read.0, Some(code), "{arguments:?}");
            assert!(lost == read, "{arguments:?}: {:?}, not {:?}", lost.0, read.0);
        }
    }
}
