//! The manners of the command line: closed pipes, amount and colour of messages, width of help texts, completions, manual pages.
#![cfg(unix)]

mod common;

use common::{footfall, said};
use std::fs::File;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn sample(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../samples").join(name).into_os_string().into_string().unwrap()
}

/// The program, with a line of arguments in which `@NAME` is a sample.
fn command(line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.args(line.split(' ').map(|word| word.strip_prefix('@').map_or(word.to_owned(), sample)));
    command.stdin(Stdio::null()).env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
    command
}

fn run(line: &str) -> Output {
    command(line).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The end of a pipe from which nobody reads.
fn closed() -> OwnedFd {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

/// Commands that print, one of each kind, with the exit code.
const PRINTING: [(&str, i32); 22] = [
    ("--help", 0),
    ("fit --help", 0),
    ("walk --secs 20 --csv", 0),
    ("walk --secs 5 --json", 0),
    ("obb --reversibility 1,5 --steps 100000", 0),
    ("hexapod --list", 0),
    ("hexapod --steps 10000", 0),
    ("hexapod --walk --steps 100", 0),
    ("smer @graph.txt --steps 100000", 0),
    ("gait-error --json", 0),
    ("volts --trace @walk.csv --calibration @sensor.toml", 0),
    ("check --trace @walk.csv", 0),
    ("fit @walk.csv", 0),
    ("fit @walk.csv --json", 0),
    ("certify list", 0),
    ("certify human-walk --starts 20", 0),
    ("entrain @walk.csv --sensor left_hip", 0),
    ("sync @edges.csv", 0),
    ("pack @generator.toml --rust", 0),
    ("defaults robot", 0),
    ("sample walk.csv", 0),
    ("completions bash", 0),
];

#[test]
fn a_closed_pipe_ends_every_command_quietly() {
    for (line, code) in PRINTING {
        let output = command(line).stdout(closed()).output().unwrap();
        let words = errors(&output);
        assert_eq!(output.status.code(), Some(code), "{line}: {words}");
        assert!(!words.contains("panicked") && !words.contains("error:"), "{line}: {words}");
    }
}

#[test]
fn closed_standard_error_is_no_failure() {
    for line in [
        "fit @walk.csv",
        "volts --trace @walk.csv",
        "check --trace @walk.csv",
        "entrain @walk.csv",
        "certify cell-walk",
        "sample nothing",
        "obb",
    ] {
        let loud = run(line);
        let output = command(line).stderr(closed()).output().unwrap();
        assert_eq!((output.status.code(), output.stdout), (loud.status.code(), loud.stdout), "{line}");
    }
}

#[test]
fn a_full_device_is_a_failure() {
    let full = File::options().write(true).open("/dev/full").unwrap();
    let output = command("hexapod --list").stdout(full).output().unwrap();
    assert!(output.status.code() == Some(1) && errors(&output).contains("error: "), "{}", errors(&output));
}

#[test]
fn quiet_says_nothing_but_warnings_and_errors() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name).display().to_string();
    for (line, usual) in [
        (format!("fit @walk.mot -o {}", out("a")), "next: run it on the virtual board: cargo xtask run --generator"),
        (format!("calibrate @rows.csv -o {}", out("b")), "next: run it on the virtual board, here on the left hip"),
        (format!("convert @walk.c3d -o {}", out("c.csv")), "next: see whether `fit` takes it: footfall check --trace"),
        (format!("volts --trace @walk.csv -o {}", out("d")), "next: feed them to the virtual board: cargo xtask run"),
        (format!("sample graph.txt -o {}", out("e")), "next: for example: footfall smer"),
        (format!("walk --secs 1 --svg {}", out("f.svg")), "written: "),
        (format!("fit @walk.csv @walk.mot -o {}", out("g")), "fitting 2 recordings, "),
    ] {
        let loud = run(&line);
        let words = errors(&loud);
        assert!(loud.status.success() && words.contains(usual), "{line}: {words}");
        let written = line.split(' ').next_back().unwrap();
        assert!(words.contains(written), "{line}: {words}");
        let force = if line.starts_with("fit @walk.csv @") { "" } else { " --force" };
        for quiet in ["--quiet", "-q"] {
            let silent = run(&format!("{line}{force} {quiet}"));
            assert!(silent.status.success() && silent.stderr.is_empty(), "{line}: {}", errors(&silent));
            assert_eq!(silent.stdout, loud.stdout, "{line}");
        }
    }
    let refused = run("sync @walk.csv --quiet");
    assert!(refused.status.code() == Some(2) && errors(&refused).starts_with("error: "), "{}", errors(&refused));
}

#[test]
fn verbose_names_what_is_read_and_the_time() {
    let words = errors(&run("check --trace @walk.csv --verbose"));
    assert!(
        words.contains("bytes") && words.contains("walk.csv") && words.lines().last().unwrap().starts_with("took "),
        "{words}"
    );
    assert_eq!(run("check --trace @walk.csv -v -q").status.code(), Some(2));
}

/// The first line of a batch comes before the first recording is fitted.
#[test]
fn a_batch_says_at_once_what_it_does() {
    let folder = tempfile::tempdir().unwrap();
    let line = format!("fit @walk.csv @walk.mot @walk.c3d -o {} --jobs 2", folder.path().display());
    let words = errors(&run(&line));
    let lines: Vec<&str> = words.lines().collect();
    assert_eq!(lines[0], "fitting 3 recordings, 2 at a time", "{words}");
    assert!(lines[1..].iter().filter(|line| line.starts_with("fitted: ")).count() == 3, "{words}");
}

#[test]
fn colours_are_asked_for_or_follow_the_terminal() {
    let coloured = |line: &str, variables: &[(&str, &str)]| {
        let output = command(line).envs(variables.iter().copied()).output().unwrap();
        [output.stdout, output.stderr].concat().contains(&0x1b)
    };
    for line in ["fit --help", "sync @walk.csv", "walk --no-such-option"] {
        assert!(!coloured(line, &[]), "{line}: no terminal");
        let always = format!("--color always {line}");
        assert!(coloured(&always, &[]), "{always}");
        assert!(coloured(&always, &[("NO_COLOR", "1")]), "{always}: an option is stronger than the environment");
        assert!(!coloured(&format!("--color=never {line}"), &[("CLICOLOR_FORCE", "1")]), "{line}");
        assert!(!coloured(line, &[("NO_COLOR", "1"), ("CLICOLOR_FORCE", "1")]), "{line}");
    }
    let wrong = run("--color pink hexapod --list");
    assert!(wrong.status.code() == Some(2) && errors(&wrong).contains("auto, always, never"), "{}", errors(&wrong));
}

#[test]
fn help_is_as_wide_as_the_terminal() {
    let widest = |columns: &str, line: &str| {
        let output = command(line).env("COLUMNS", columns).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        // Examples are not broken, so that they can be copied.
        let (options, _) = text.split_once("Examples:").unwrap_or((&text, ""));
        // Nor is the usage.
        options.lines().filter(|line| !line.starts_with("Usage:")).map(str::len).max().unwrap()
    };
    for line in ["--help", "calibrate --help", "watch --help", "fit --help"] {
        assert!(widest("70", line) <= 70, "{line}: {}", widest("70", line));
        assert!((71..=100).contains(&widest("200", line)), "{line}: {}", widest("200", line));
    }
}

#[test]
fn the_help_of_every_command_has_examples() {
    let program = footfall::cli::program();
    for command in program.get_subcommands() {
        let help = String::from_utf8(run(&format!("{} --help", command.get_name())).stdout).unwrap();
        let (_, examples) = help.split_once("Examples:").unwrap_or_else(|| panic!("{help}"));
        let begin = format!("    footfall {}", command.get_name());
        assert!(examples.lines().filter(|line| line.starts_with("    footfall ")).count() >= 2, "{help}");
        assert!(examples.lines().any(|line| line.starts_with(&begin)), "{help}");
    }
}

#[test]
fn shells_complete_every_command() {
    let names: Vec<String> = footfall::cli::program().get_subcommands().map(|of| of.get_name().to_owned()).collect();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = String::from_utf8(run(&format!("completions {shell}")).stdout).unwrap();
        let missing: Vec<&String> = names.iter().filter(|name| !script.contains(name.as_str())).collect();
        assert!(missing.is_empty() && script.contains("knee-sign"), "{shell}: {missing:?}");
    }
    let unknown = run("completions tcsh");
    assert!(unknown.status.code() == Some(2) && errors(&unknown).contains("bash"), "{}", errors(&unknown));
    // A shell takes the script as it is.
    let script = run("completions bash").stdout;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("footfall.bash");
    std::fs::write(&path, script).unwrap();
    match Command::new("bash").arg("-n").arg(&path).status() {
        Ok(status) => assert!(status.success()),
        Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::NotFound, "{error}"),
    }
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("man");
    let written = footfall([std::ffi::OsStr::new("man"), "-o".as_ref(), out.as_os_str()]);
    assert!(written.status.success(), "{}", said(&written));
    for command in footfall::cli::program().get_subcommands() {
        let name = command.get_name();
        let page = std::fs::read_to_string(out.join(format!("footfall-{name}.1")))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(
            page.contains(".TH footfall-") && page.contains(".SH OPTIONS") && page.contains(".SH EXAMPLES"),
            "{name}: {page}"
        );
        assert!(page.contains("quiet"), "{name} has the general options");
        assert_eq!(String::from_utf8(run(&format!("man {name}")).stdout).unwrap(), page);
    }
    let main = std::fs::read_to_string(out.join("footfall.1")).unwrap();
    assert!(main.contains("footfall\\-fit(1)") && main.contains("Exit codes"), "{main}");
    let kept = footfall([std::ffi::OsStr::new("man"), "-o".as_ref(), out.as_os_str()]);
    assert!(kept.status.code() == Some(2) && said(&kept).contains("--force"), "{}", said(&kept));
    assert_eq!(run("man nothing").status.code(), Some(2));
}

#[test]
fn certify_list_is_certify_with_the_option() {
    let list = run("certify list");
    assert!(list.status.success() && String::from_utf8_lossy(&list.stdout).lines().count() > 20);
    assert_eq!(list.stdout, run("certify --list").stdout);
    assert_eq!(run("certify list --json").stdout, run("certify --list --json").stdout);
}

/// Files without end, and larger ones than allowed, are refused within a small memory and time.
#[test]
fn no_command_reads_a_file_without_end() {
    for line in [
        "sync /dev/zero",
        "sync @line-board.csv --against /dev/zero",
        "smer /dev/zero",
        "calibrate /dev/zero -o /dev/null",
        "pack /dev/zero -o /dev/null",
        "check --trace /dev/zero",
        "check --generator /dev/zero",
        "check --robot /dev/zero",
        "check --record /dev/zero",
        "check --calibration /dev/zero",
        "fit /dev/zero",
        "convert /dev/zero -o /dev/null.csv",
        "entrain /dev/zero",
        "certify /dev/zero -o /dev/null",
        "volts --trace /dev/zero",
        "calibrate --guide --codes /dev/zero -o /dev/null",
    ] {
        // The shell limits the memory of the program, in KiB.
        let script =
            format!("ulimit -v 1500000 && exec {} {}", env!("CARGO_BIN_EXE_footfall"), line.replace('@', &sample("")));
        let began = std::time::Instant::now();
        let output = Command::new("sh").args(["-c", &script]).stdin(Stdio::null()).output().unwrap();
        let words = errors(&output);
        assert_eq!(output.status.code(), Some(2), "{line}: {words}");
        assert!(words.contains("error: ") && words.contains("allowed"), "{line}: {words}");
        assert!(began.elapsed().as_secs() < 30, "{line}: {:?}", began.elapsed());
    }
}

#[test]
fn too_many_edges_are_not_paired() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("edges.csv");
    let rows: String = (0..40_001).map(|n| format!("{n},{}\n", n % 2)).collect();
    std::fs::write(&path, format!("time_s,level\n{rows}")).unwrap();
    let refused = run(&format!("sync @line-board.csv --against {}", path.display()));
    let words = errors(&refused);
    assert!(refused.status.code() == Some(2) && words.contains("has 40001 edges; allowed are up to 40000"), "{words}");
}
