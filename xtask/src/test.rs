//! `cargo xtask test`: everything that must hold before a change lands, cheap steps first, ending at the first that fails.
//!
//! Nothing is compiled twice: all steps on the host share two profiles (`dev`, and `host` for programs that must be fast),
//! no step sets `RUSTFLAGS`, and what is built for the board is kept for the later steps.

use std::cell::OnceCell;
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::board::{Board, Drive};
use crate::build::Workshop;
use crate::core_selftest::{self, SelfTest};
use crate::setup::Need;
use crate::shell;
use crate::toolchain::{SMALLEST_TARGET, TARGET};

/// Options of `cargo xtask test`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct Options {
    /// Only this step (repeat for more)
    #[arg(long, value_name = "STEP")]
    only: Vec<String>,
    /// List the steps and stop
    #[arg(long)]
    list: bool,
}

/// One thing that is checked.
struct Step {
    name: &'static str,
    /// What passing means, for `--list`.
    claim: &'static str,
    needs: &'static [Need],
    /// Returns the number worth telling, such as how many tests ran.
    run: fn(&Bench) -> Result<String>,
}

const STEPS: [Step; 15] = [
    Step { name: "format", claim: "every file is formatted", needs: &[], run: format },
    Step { name: "lints", claim: "clippy finds nothing on the host", needs: &[], run: lints },
    Step { name: "docs", claim: "the documentation builds without a warning", needs: &[], run: docs },
    Step { name: "cores-alone", claim: "each core compiles by itself", needs: &[], run: cores_alone },
    Step { name: "host-tests", claim: "unit, property and replay tests pass", needs: &[], run: host_tests },
    Step { name: "endurance", claim: "72 h of ticks lose no stride and keep the rate", needs: &[], run: endurance },
    Step { name: "firmware-host", claim: "the firmware's rules pass on the host", needs: &[], run: firmware_host },
    Step {
        name: "virtual-board",
        claim: "the virtual board has no lint, its docs build, its unit tests pass",
        needs: &[Need::VirtualBoard],
        run: virtual_board,
    },
    Step {
        name: "images",
        claim: "the firmware builds for every board, in single precision",
        needs: &[Need::Thumb],
        run: images,
    },
    Step {
        name: "cores-thumb",
        claim: "each core compiles by itself for Cortex-M4F and Cortex-M0",
        needs: &[Need::Thumb],
        run: cores_thumb,
    },
    Step { name: "panic-free", claim: "no panic is reachable from the cores", needs: &[Need::Thumb], run: panic_free },
    Step {
        name: "core-selftest",
        claim: "the virtual board's core passes its self-test",
        needs: &[Need::Thumb, Need::VirtualBoard],
        run: core_on_virtual_board,
    },
    Step {
        name: "core-qemu",
        claim: "QEMU's core agrees with the self-test",
        needs: &[Need::Thumb, Need::Qemu],
        run: core_on_qemu,
    },
    Step {
        name: "core-controls",
        claim: "the self-test notices a core that was broken on purpose",
        needs: &[Need::Thumb, Need::VirtualBoard],
        run: core_controls,
    },
    Step {
        name: "image-tests",
        claim: "the flashed image passes its scenarios on the virtual board",
        needs: &[Need::Thumb, Need::VirtualBoard],
        run: image_tests,
    },
];

/// What the steps share: the workspace, and whatever an earlier step has built.
struct Bench {
    shop: Workshop,
    image: OnceCell<PathBuf>,
    shadow: OnceCell<PathBuf>,
    virtual_board: OnceCell<PathBuf>,
    selftest: OnceCell<PathBuf>,
}

impl Bench {
    fn image(&self) -> Result<&Path> {
        kept(&self.image, || Ok(self.shop.firmware(Board::F4Discovery, Drive::Servos)?.elf))
    }

    fn shadow(&self) -> Result<&Path> {
        kept(&self.shadow, || Ok(self.shop.firmware(Board::F4Discovery, Drive::Nothing)?.elf))
    }

    fn virtual_board(&self) -> Result<&Path> {
        kept(&self.virtual_board, || self.shop.virtual_board())
    }

    fn selftest(&self, log: &str) -> Result<SelfTest<'_>> {
        Ok(SelfTest { elf: kept(&self.selftest, || self.shop.core_selftest())?, log: self.log(log) })
    }

    /// Where the output of a program that is run under a deadline is kept.
    fn log(&self, name: &str) -> PathBuf {
        self.shop.target_dir.join("xtask-logs").join(format!("{name}.log"))
    }
}

fn kept(cell: &OnceCell<PathBuf>, make: impl FnOnce() -> Result<PathBuf>) -> Result<&Path> {
    if cell.get().is_none() {
        // Empty, so this sets it.
        let _ = cell.set(make()?);
    }
    cell.get().map(PathBuf::as_path).context("nothing was built")
}

/// How a step ended.
enum Outcome {
    Passed(String),
    Failed(String),
    /// A step before it failed.
    NotRun,
}

struct Row {
    name: &'static str,
    outcome: Outcome,
    took: Duration,
}

/// Runs the steps and prints the closing table.
pub(crate) fn test(mut shop: Workshop, options: &Options) -> Result<ExitCode> {
    if options.list {
        for step in &STEPS {
            println!("{:<14} {}", step.name, step.claim);
        }
        return Ok(ExitCode::SUCCESS);
    }
    let steps = selected(&options.only)?;
    let begun = Instant::now();
    let mut needs: Vec<Need> = Vec::new();
    for need in steps.iter().flat_map(|step| step.needs) {
        if !needs.contains(need) {
            needs.push(*need);
        }
    }
    shop.set_up(&needs)?;
    shop.strict = true;
    let bench = Bench {
        shop,
        image: OnceCell::new(),
        shadow: OnceCell::new(),
        virtual_board: OnceCell::new(),
        selftest: OnceCell::new(),
    };

    let mut rows: Vec<Row> = Vec::new();
    let mut failed = false;
    for (index, step) in steps.iter().enumerate() {
        if failed {
            rows.push(Row { name: step.name, outcome: Outcome::NotRun, took: Duration::ZERO });
            continue;
        }
        eprintln!("\n=== step {} of {}: {} ({})", index + 1, steps.len(), step.name, step.claim);
        let started = Instant::now();
        let outcome = match (step.run)(&bench) {
            Ok(told) => Outcome::Passed(told),
            Err(error) => {
                failed = true;
                eprintln!("error: {error:#}");
                Outcome::Failed(format!("{error:#}").lines().next().unwrap_or_default().to_owned())
            }
        };
        rows.push(Row { name: step.name, outcome, took: started.elapsed() });
    }
    print!("\n{}", table(&rows, begun.elapsed()));
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// The steps that `--only` names, in their usual order; all without it.
fn selected(only: &[String]) -> Result<Vec<&'static Step>> {
    for name in only {
        if !STEPS.iter().any(|step| step.name == name) {
            let names: Vec<_> = STEPS.iter().map(|step| step.name).collect();
            bail!("there is no step `{name}`; allowed: {}", names.join(", "));
        }
    }
    Ok(STEPS.iter().filter(|step| only.is_empty() || only.iter().any(|name| name == step.name)).collect())
}

/// The closing table; its last line counts the steps.
fn table(rows: &[Row], whole: Duration) -> String {
    let mut text = String::new();
    let (mut passed, mut failed, mut skipped) = (0, 0, 0);
    for row in rows {
        let (word, told) = match &row.outcome {
            Outcome::Passed(told) => {
                passed += 1;
                ("passed", told.as_str())
            }
            Outcome::Failed(why) => {
                failed += 1;
                ("FAILED", why.as_str())
            }
            Outcome::NotRun => {
                skipped += 1;
                ("not run", "")
            }
        };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{:<14} {word:<8} {:>7.1} s  {told}", row.name, row.took.as_secs_f32());
    }
    let _ = writeln!(text, "{:<14} {:<8} {:>7.1} s", "all", "", whole.as_secs_f32());
    let _ = writeln!(text, "{passed} passed, {failed} failed, {skipped} skipped");
    text
}

/// A cargo command of the host whose output is the step's.
fn cargo(arguments: &[&str]) -> Result<()> {
    shell::must_succeed(shell::cargo().args(arguments), &format!("cargo {}", arguments.join(" ")))
}

/// A cargo command that runs tests: shows its output, counts the tests and names those that fail.
fn cargo_test(command: &mut Command) -> Result<String> {
    count_tests(command, &mut std::io::stderr())
}

fn count_tests(command: &mut Command, show: &mut dyn Write) -> Result<String> {
    let mut count = 0;
    let mut failures = Vec::new();
    let status = shell::each_line(command, |line| {
        // Nobody may be listening any more; the result counts all the same.
        let _ = writeln!(show, "{line}");
        count += passed_in(line).unwrap_or(0);
        failures.extend(failure_in(line).map(str::to_owned));
    })?;
    ensure!(failures.is_empty(), "{} of the tests failed: {}", failures.len(), failures.join(", "));
    ensure!(status.success(), "the test run failed ({status})");
    ensure!(count > 0, "no test ran");
    Ok(format!("{count} tests"))
}

/// The name in `test a_name ... FAILED`.
fn failure_in(line: &str) -> Option<&str> {
    line.trim().strip_prefix("test ")?.strip_suffix(" ... FAILED")
}

/// The first number of `test result: ok. 12 passed; 0 failed; ...`.
fn passed_in(line: &str) -> Option<u32> {
    line.trim().strip_prefix("test result: ")?.split_once(". ")?.1.split_once(" passed")?.0.parse().ok()
}

fn format(_: &Bench) -> Result<String> {
    cargo(&["fmt", "--all", "--", "--check"])?;
    Ok(String::new())
}

/// The virtual board is left to its own step: it needs system packages, and has its C code built once, in the profile `host`.
fn lints(_: &Bench) -> Result<String> {
    cargo(&["clippy", "--workspace", "--exclude", "virtual-board", "--all-targets", "--", "-D", "warnings"])?;
    Ok(String::new())
}

fn docs(_: &Bench) -> Result<String> {
    let mut cargo = shell::cargo();
    cargo.env("RUSTDOCFLAGS", "-Dwarnings").args(["doc", "--workspace", "--exclude", "virtual-board", "--no-deps"]);
    shell::must_succeed(&mut cargo, "cargo doc")?;
    Ok(String::new())
}

/// What is compiled for every chip, from the dictionary up.
const CORES: [&str; 4] = ["joint-units", "hgod-adc", "cpg-core", "joint-loop"];

/// In one workspace build the features of all packages add up, which hides what a core lacks by itself.
fn cores_alone(_: &Bench) -> Result<String> {
    for core in CORES {
        cargo(&["check", "--package", core, "--no-default-features"])?;
    }
    Ok(format!("{} crates", CORES.len()))
}

/// The host has a standard library, 64 bits and every atomic operation to fall back on; the smallest chip has none of them.
fn cores_thumb(bench: &Bench) -> Result<String> {
    let targets = [TARGET, SMALLEST_TARGET];
    for target in targets {
        bench.shop.toolchain()?.ready_for(target)?;
        for core in CORES {
            let mut check = bench.shop.thumb_check(core, target, &["--no-default-features"])?;
            shell::must_succeed(&mut check, &format!("checking {core} alone for {target}"))?;
        }
    }
    Ok(format!("{} crates, {}", CORES.len(), targets.join(" and ")))
}

fn host_tests(_: &Bench) -> Result<String> {
    cargo_test(shell::cargo().arg("test"))
}

fn firmware_host(_: &Bench) -> Result<String> {
    cargo_test(shell::cargo().args(["test", "--package", "firmware", "--lib"]))
}

fn endurance(_: &Bench) -> Result<String> {
    cargo(&["run", "--package", "cpg-core", "--profile", "host", "--example", "endurance", "--", "72"])?;
    Ok(String::new())
}

fn virtual_board(bench: &Bench) -> Result<String> {
    let package = ["--package", "virtual-board", "--profile", "host"];
    bench.virtual_board()?;
    cargo(&[&["clippy"], &package[..], &["--all-targets", "--", "-D", "warnings"]].concat())?;
    let mut doc = shell::cargo();
    doc.env("RUSTDOCFLAGS", "-Dwarnings").arg("doc").args(package).arg("--no-deps");
    shell::must_succeed(&mut doc, "cargo doc")?;
    cargo_test(shell::cargo().arg("test").args(package))
}

fn images(bench: &Bench) -> Result<String> {
    let mut told = Vec::new();
    let shadow = bench.shop.firmware(Board::F4Discovery, Drive::Nothing)?;
    let _ = bench.shadow.set(shadow.elf);
    for board in Board::ALL {
        let image = bench.shop.firmware(board, Drive::Servos)?;
        // One such routine in a tick costs as much as fifty in single precision, and nothing else would tell.
        ensure!(
            image.double_precision.is_empty(),
            "{} computes in double precision: {:?}",
            board.feature(),
            image.double_precision
        );
        told.push(format!("{}: {}", board.feature(), image.footprint));
        if board == Board::F4Discovery {
            // Set only once: `image` was not asked for before.
            let _ = bench.image.set(image.elf);
        }
    }
    Ok(told.join("; "))
}

/// Links only if no panic is reachable; with one reachable index it must not, or the proof would prove nothing.
fn panic_free(bench: &Bench) -> Result<String> {
    shell::must_succeed(&mut bench.shop.thumb_build("link-proof", &[])?, "linking the panic-free proof")?;
    let mut broken = bench.shop.thumb_build("link-proof", &["--features", "unchecked-index"])?;
    let ended = shell::with_deadline(&mut broken, Duration::from_secs(600), &bench.log("link-proof-unchecked-index"))?;
    let undefined = ended.said.lines().find(|line| line.contains("undefined symbol"));
    match (ended.success(), undefined) {
        (true, _) => bail!("the proof links with a reachable panic: it proves nothing"),
        (false, None) => bail!("the proof with a reachable panic failed, but not at the link:\n{}", ended.tail(20)),
        (false, Some(line)) => {
            eprintln!("with a reachable panic, as it should: {}", line.trim());
            Ok("links; with a reachable panic it does not".to_owned())
        }
    }
}

fn core_on_virtual_board(bench: &Bench) -> Result<String> {
    bench.selftest("core-selftest")?.on_virtual_board(bench.virtual_board()?)
}

fn core_on_qemu(bench: &Bench) -> Result<String> {
    bench.selftest("core-qemu")?.on_qemu()
}

fn core_controls(bench: &Bench) -> Result<String> {
    for fault in core_selftest::FAULTS {
        let noticed = bench.selftest(fault)?.notices(bench.virtual_board()?, fault)?;
        eprintln!("--break {fault}, as it should: {noticed}");
    }
    Ok(format!("{} faults noticed", core_selftest::FAULTS.len()))
}

fn image_tests(bench: &Bench) -> Result<String> {
    let footfall = bench.shop.footfall()?;
    let mut tests = shell::cargo();
    tests
        .env("FOOTFALL_ELF", bench.image()?)
        .env("FOOTFALL_SHADOW_ELF", bench.shadow()?)
        .env("FOOTFALL_VIRTUAL_BOARD", bench.virtual_board()?)
        .env("FOOTFALL_BIN", footfall)
        .env("FOOTFALL_REQUIRE_VIRTUAL_BOARD", "1")
        // Without `--package`, the features are those of the host tests and nothing is compiled anew.
        .args([
            "test",
            "--test",
            "virtual_board",
            "--test",
            "bad_input",
            "--test",
            "fits",
            "--test",
            "ears",
            "--test",
            "follow",
            "--test",
            "board_entrainment",
            "--test",
            "capture",
            "--test",
            "verdicts",
        ]);
    cargo_test(&mut tests)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_have_names_of_their_own() {
        for (index, step) in STEPS.iter().enumerate() {
            assert!(STEPS[..index].iter().all(|before| before.name != step.name), "{}", step.name);
            assert!(step.name.len() <= 14, "{} is too wide for the table", step.name);
        }
    }

    #[test]
    fn only_selects_in_the_usual_order_and_refuses_what_it_does_not_know() {
        let names = |only: &[&str]| -> Vec<_> {
            let only: Vec<String> = only.iter().map(|&name| name.to_owned()).collect();
            selected(&only).unwrap().iter().map(|step| step.name).collect()
        };
        assert_eq!(names(&["docs", "format"]), ["format", "docs"]);
        assert_eq!(names(&[]).len(), STEPS.len());
        let message = selected(&["fmt".to_owned()]).err().unwrap().to_string();
        assert!(message.contains("`fmt`") && message.contains("allowed: format, lints"), "{message}");
    }

    #[test]
    fn passed_tests_are_counted_from_cargos_lines() {
        assert_eq!(passed_in("test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out"), Some(12));
        assert_eq!(passed_in("test result: FAILED. 3 passed; 1 failed; 0 ignored"), Some(3));
        assert_eq!(passed_in("test tests::the_result ... ok"), None);
        assert_eq!(passed_in("running 4 tests"), None);
    }

    #[test]
    fn a_test_run_is_shown_counted_and_judged() {
        let run = |script: &str| {
            let mut shown = Vec::new();
            let result = count_tests(shell::command("sh").args(["-c", script]), &mut shown);
            (result.map_err(|error| error.to_string()), String::from_utf8(shown).unwrap())
        };
        let (result, shown) =
            run("echo 'test result: ok. 2 passed; 0 failed'; echo 'test result: ok. 3 passed; 0 failed'");
        assert_eq!(result, Ok("5 tests".to_owned()));
        assert_eq!(shown.lines().count(), 2);
        assert_eq!(run("echo 'test result: ok. 0 passed; 0 failed'").0, Err("no test ran".to_owned()));
        let failing = "echo 'test gate::holds ... FAILED'; echo 'test result: FAILED. 2 passed; 1 failed'; exit 101";
        assert_eq!(run(failing).0, Err("1 of the tests failed: gate::holds".to_owned()));
        assert!(run("echo 'test result: ok. 2 passed; 0 failed'; exit 1").0.unwrap_err().contains("exit status: 1"));
    }

    #[test]
    fn the_last_line_counts_the_steps() {
        let rows = [
            Row { name: "format", outcome: Outcome::Passed("5 files".into()), took: Duration::from_millis(1500) },
            Row { name: "lints", outcome: Outcome::Failed("cargo clippy failed".into()), took: Duration::from_secs(3) },
            Row { name: "docs", outcome: Outcome::NotRun, took: Duration::ZERO },
        ];
        let text = table(&rows, Duration::from_secs(5));
        assert_eq!(text.lines().last(), Some("1 passed, 1 failed, 1 skipped"));
        assert!(text.lines().nth(1).unwrap().contains("FAILED") && text.contains("1.5 s  5 files"), "{text}");
    }

    #[test]
    fn what_was_built_is_built_once() {
        let cell = OnceCell::new();
        assert!(kept(&cell, || bail!("no")).is_err());
        assert_eq!(kept(&cell, || Ok("a".into())).unwrap(), Path::new("a"));
        assert_eq!(kept(&cell, || panic!("built again")).unwrap(), Path::new("a"));
    }
}
