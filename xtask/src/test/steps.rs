//! The steps of `cargo xtask test`, in their order: cheap ones first.
//!
//! Little is compiled twice: all steps on the host share two profiles (`dev`, and `host` for programs that must be fast), programs choose packages so that
//! dependencies have the same features, no step sets `RUSTFLAGS`, and what is built for the board is kept for the later steps.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use super::audits;
use super::counts::{self, Counts};
use super::example;
use super::judged::{self, Judged};
use super::pico;
use super::programs;
use super::python::{self, Environment};
use super::state::{CannotRun, State, cargo, passed, tests};
use crate::board::{Board, Variant};
use crate::emulated;
use crate::probe;
use crate::setup::{Need, REQUIRE};
use crate::shell;
use crate::toolchain::SMALLEST_TARGET;
use crate::workspace::WHEEL;

/// A check.
pub(super) struct Step {
    pub(super) name: &'static str,
    /// What passing means, for `--list`.
    pub(super) claim: &'static str,
    /// Without one of these the step is skipped, or the command stops where it is required.
    pub(super) needs: &'static [Need],
    /// Without one of these some of its tests are ignored, or the command stops where it is required.
    pub(super) uses: &'static [Need],
    /// Returns a number for the table, such as how many tests ran.
    pub(super) run: fn(&State) -> Result<String>,
}

pub(super) const STEPS: [Step; 26] = [
    Step { name: "format", claim: "every file is formatted", needs: &[], uses: &[], run: format },
    Step {
        name: "lints",
        claim: "clippy finds nothing on the host, nor in `footfall` and the Python package with the features that users build them with",
        needs: &[],
        uses: &[],
        run: lints,
    },
    Step { name: "docs", claim: "the documentation builds without a warning", needs: &[], uses: &[], run: docs },
    Step { name: "cores-alone", claim: "each core compiles by itself", needs: &[], uses: &[], run: cores_alone },
    Step {
        name: "packages",
        claim: "each core can be packaged for a registry and compiles from its package",
        needs: &[],
        uses: &[],
        run: packages,
    },
    Step {
        name: "images",
        claim: "the firmware builds for every board and with each feature, in single precision",
        needs: &[Need::BoardCompiler],
        uses: &[],
        run: images,
    },
    Step {
        name: "host-tests",
        claim: "unit, property and replay tests pass",
        needs: &[],
        uses: &[Need::Traces, Need::Terminal],
        run: host_tests,
    },
    Step {
        name: "c",
        claim: "programs in C and C++ have the numbers of Rust; the header is that of the source",
        needs: &[Need::Cpp],
        uses: &[],
        run: c_programs,
    },
    Step {
        name: "endurance",
        claim: "after 72 h of ticks the default walk has lost no stride, and its phase has an error of at most 0.001 rad",
        needs: &[],
        uses: &[],
        run: endurance,
    },
    Step {
        name: "firmware-host",
        claim: "unit tests and examples of the chip families pass on the host",
        needs: &[],
        uses: &[],
        run: firmware_host,
    },
    Step {
        name: "virtual-board",
        claim: "the virtual board passes clippy, its docs build, its unit tests pass",
        needs: &[Need::VirtualBoard],
        uses: &[],
        run: virtual_board,
    },
    Step {
        name: "cores-thumb",
        claim: "each core compiles by itself for a Cortex-M0, the smallest chip",
        needs: &[Need::BoardCompiler],
        uses: &[],
        run: cores_thumb,
    },
    Step {
        name: "example",
        claim: "a firmware of one's own compiles with the cores: on bare registers, and with embassy, which walks on the virtual board",
        needs: &[Need::BoardCompiler],
        uses: &[],
        run: example::firmwares,
    },
    Step {
        name: "panic-free",
        claim: "no panic is reachable from the cores and the records",
        needs: &[Need::BoardCompiler],
        uses: &[],
        run: panic_free,
    },
    Step {
        name: "image-audit",
        claim: "in the flashed images no panic is reachable from the tick and the handlers, and there is no path of this computer",
        needs: &[Need::BoardCompiler, Need::VirtualBoard],
        uses: &[],
        run: audits::image_audit,
    },
    Step {
        name: "same-bytes",
        claim: "a copy of the source in another folder makes the same image",
        needs: &[Need::BoardCompiler, Need::VirtualBoard],
        uses: &[],
        run: audits::same_bytes,
    },
    Step {
        name: "gait-changes",
        claim: "ten changes between gaits of persons are bit-equal on the virtual board and the host, and inside the limits",
        needs: &[Need::BoardCompiler, Need::VirtualBoard],
        uses: &[],
        run: gait_changes,
    },
    Step {
        name: "image-tests",
        claim: "the flashed image passes its scenarios on the virtual board",
        needs: &[Need::BoardCompiler, Need::VirtualBoard],
        uses: &[Need::Traces, Need::Terminal],
        run: image_tests,
    },
    Step {
        name: "controls",
        claim: "an image that lacks a protection fails the tests and faults that show it, one image for each protection",
        needs: &[Need::BoardCompiler, Need::VirtualBoard],
        uses: &[],
        run: super::controls::controls,
    },
    Step {
        name: "probe",
        claim: "probe-rs as it is released writes, runs, reads, erases and debugs the image on the virtual board, by itself and for `cargo xtask`",
        needs: &[Need::BoardCompiler, Need::VirtualBoard, Need::Probe],
        uses: &[],
        run: with_probe_rs,
    },
    Step {
        name: "pico",
        claim: "the image of the Raspberry Pi Pico, written by the chip's boot ROM, walks on rp2040js with the setpoints of the host, and the cycles of its tick differ by no more than 5 % from docs/performance.json; its packages come from the network",
        needs: &[Need::BoardCompiler, Need::Node, Need::Python],
        uses: &[],
        run: pico::on_the_emulator,
    },
    Step {
        name: "python-readers",
        claim: "programs in Python read captures and the live view; their packages come from the network",
        needs: &[Need::Python],
        uses: &[],
        run: python_readers,
    },
    Step {
        name: "python",
        claim: "a wheel of the Python package, in the profile of the host tests, works alone, its tests and examples pass; packages come from the network",
        needs: &[Need::Python],
        uses: &[],
        run: python,
    },
    Step {
        name: "python-board",
        claim: "a loop that Python runs has the setpoints and the hash of the flashed image, and Python steps that image",
        needs: &[Need::Python, Need::BoardCompiler, Need::VirtualBoard],
        uses: &[],
        run: python_board,
    },
    Step {
        name: "board-cost",
        claim: "the cost of each part of the image is counted as the firmware's stopwatch counts it, the trace changes no run, and the programs that look at images pass their tests",
        needs: &[Need::BoardCompiler, Need::VirtualBoard],
        uses: &[],
        run: audits::board_cost,
    },
    Step {
        name: "ratchets",
        claim: "instructions, stack, flash, RAM and unsafe code did not get worse than ratchets.toml",
        needs: &[Need::BoardCompiler, Need::VirtualBoard],
        uses: &[],
        run: audits::ratchets,
    },
];

/// Steps that only `--only` runs: they compile everything for the board once more.
pub(super) const BY_NAME: [&str; 1] = ["same-bytes"];

/// The same for the examples in the documentation, which cargo compiles while it runs them.
fn doc_tests() -> Result<Counts> {
    let mut cargo = shell::cargo();
    cargo.args(["test", "--doc"]);
    counts::run("cargo test --doc", &mut cargo, &mut std::io::stderr())
}

fn format(_: &State) -> Result<String> {
    cargo(&["fmt", "--all", "--", "--check"])?;
    Ok(String::new())
}

/// The virtual board has a step of its own: it needs system packages, and its C code is built once, in the profile `host`.
fn lints(_: &State) -> Result<String> {
    cargo(&["clippy", "--workspace", "--exclude", "virtual-board", "--all-targets", "--", "-D", "warnings"])?;
    // The whole program also compiles where the part of `cargo xtask run` lacks a module.
    cargo(&["clippy", "--package", "footfall", "--no-default-features", "--", "-D", "warnings"])?;
    // Users build the program and the Python package without the features that only tests ask for, which the first line counts in.
    cargo(&["clippy", "--package", "footfall", "--package", WHEEL, "--", "-D", "warnings"])?;
    Ok(String::new())
}

fn docs(_: &State) -> Result<String> {
    let mut cargo = shell::cargo();
    cargo.env("RUSTDOCFLAGS", "-Dwarnings").args(["doc", "--workspace", "--exclude", "virtual-board", "--no-deps"]);
    shell::must_succeed(&mut cargo, "cargo doc")?;
    Ok(String::new())
}

/// The crates that compile for every chip, in the order of their dependencies.
const CORES: [&str; 5] = ["joint-units", "hgod-adc", "cpg-core", "joint-loop", "wire"];

/// What only chips without a floating-point unit need is a feature.
const FIXED_POINT: [&str; 5] = ["--package", "cpg-core", "--no-default-features", "--features", "fixed-point"];

/// In one workspace build the features of all packages are united, which hides what a core lacks by itself.
fn cores_alone(_: &State) -> Result<String> {
    for core in CORES {
        cargo(&["check", "--package", core, "--no-default-features"])?;
    }
    cargo(&[&["check"], FIXED_POINT.as_slice()].concat())?;
    Ok(format!("{} crates", CORES.len()))
}

/// Packages every core as it would be published; each is compiled from its package, beside the packages of the others.
///
/// They are compiled in a folder of their own that is empty: cargo takes what it compiled of a package of the same version for today's.
fn packages(state: &State) -> Result<String> {
    forget_unpacked_cores()?;
    let folder = state.workspace.target_dir.join("packages");
    if folder.is_dir() {
        std::fs::remove_dir_all(&folder).with_context(|| format!("removing {}", folder.display()))?;
    }
    let mut cargo = shell::cargo();
    cargo.args(["package", "--allow-dirty", "--offline", "--target-dir"]).arg(&folder);
    cargo.args(CORES.iter().flat_map(|core| ["--package", core]));
    shell::must_succeed(&mut cargo, "cargo package")?;
    Ok(format!("{} crates", CORES.len()))
}

/// Removes the cores that an earlier `cargo package` unpacked. Cargo keeps them by name and version in its own folder, and takes them for
/// those of today. The folders of registries have the host in their name; those of packages in a workspace begin with `-`.
fn forget_unpacked_cores() -> Result<()> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let Some(home) = home.or_else(|| Some(std::env::home_dir()?.join(".cargo"))) else { return Ok(()) };
    let Ok(registries) = std::fs::read_dir(home.join("registry/src")) else { return Ok(()) };
    for registry in
        registries.filter_map(Result::ok).filter(|entry| entry.file_name().as_encoded_bytes().starts_with(b"-"))
    {
        for core in CORES {
            let unpacked = registry.path().join(format!("{core}-{}", env!("CARGO_PKG_VERSION")));
            if unpacked.is_dir() {
                std::fs::remove_dir_all(&unpacked).with_context(|| format!("removing {}", unpacked.display()))?;
            }
        }
    }
    Ok(())
}

/// The host has a standard library, 64 bits and every atomic operation; the smallest chip has none of them. The images and the panic-free proof
/// have the cores on a Cortex-M4F.
fn cores_thumb(state: &State) -> Result<String> {
    state.workspace.toolchain()?.ready_for(SMALLEST_TARGET)?;
    let check = |core: &str, options: &[&str]| {
        let mut check = state.workspace.thumb_check(core, SMALLEST_TARGET, options)?;
        shell::must_succeed(&mut check, &format!("checking {core} alone for {SMALLEST_TARGET}"))
    };
    for core in CORES {
        check(core, &["--no-default-features"])?;
    }
    check("cpg-core", &FIXED_POINT[2..])?;
    Ok(format!("{} crates", CORES.len()))
}

fn host_tests(state: &State) -> Result<String> {
    let mut counts = tests(state, &[], &[])?;
    counts.add(doc_tests()?);
    passed(state, counts)
}

/// An environment of Python in `target`, where a later run finds its packages.
fn python_environment(state: &State, name: &str, requirements: &str) -> Result<Environment> {
    let environment = Environment::open(&state.workspace.target_dir.join(name))?;
    match environment.install(&["-r", requirements]) {
        // A machine without a network has no packages.
        Err(error) if !state.required.contains(Need::Python) => Err(CannotRun(format!("{error:#}")).into()),
        installed => installed.map(|()| environment),
    }
}

fn python_readers(state: &State) -> Result<String> {
    let environment = python_environment(state, "python-readers", "tools/footfall/tests/python/requirements.txt")?;
    let variables = [("FOOTFALL_PYTHON", environment.python().as_os_str()), (REQUIRE, OsStr::new(Need::Python.name()))];
    // Without a package: cargo then gives the dependencies the features that they have in `host-tests`, and compiles them once for both.
    let counts = programs::run(&["--test", "python_readers"], &variables)?;
    passed(state, counts)
}

/// The environment of the Python package, with the wheel.
fn python_wheel(state: &State) -> Result<(Environment, PathBuf)> {
    let environment = python_environment(state, "python-package", "python/tests/requirements.txt")?;
    let wheel = environment.install_wheel(&state.workspace.target_dir.join("python-wheels"))?;
    Ok((environment, wheel))
}

/// Tests of the Python package that run the image.
const BOARD_TESTS: [&str; 3] =
    ["python/tests/test_board.py", "python/tests/test_board_steps.py", "python/tests/test_body_board.py"];

fn python(state: &State) -> Result<String> {
    let (environment, wheel) = python_wheel(state)?;
    if let Err(error) = environment.install(&["-r", "python/tests/requirements-ray.txt"]) {
        eprintln!("without Ray, whose test is skipped: {error:#}");
    }
    python::works_alone(&wheel, &state.workspace.target_dir.join("python-fresh"))?;
    let ignored = BOARD_TESTS.iter().flat_map(|file| ["--ignore", file]);
    let arguments: Vec<&str> = ["-q", "-rs", "python/tests"].into_iter().chain(ignored).collect();
    passed(state, environment.test(&arguments, &[])?)
}

fn python_board(state: &State) -> Result<String> {
    let (environment, _) = python_wheel(state)?;
    let footfall = state.workspace.footfall()?;
    let variables = [
        ("FOOTFALL_ELF", state.image()?.as_os_str()),
        ("FOOTFALL_VIRTUAL_BOARD", state.virtual_board()?.as_os_str()),
        ("FOOTFALL_BIN", footfall.as_os_str()),
    ];
    let arguments: Vec<&str> = ["-q", "-rs"].into_iter().chain(BOARD_TESTS).collect();
    passed(state, environment.test(&arguments, &variables)?)
}

fn c_programs(state: &State) -> Result<String> {
    // Beside two packages of the host tests the dependencies of the tests have the features that they have there, and are compiled once for both. The
    // static library, which the tests build by itself, has its own.
    let packages = ["--package", "footfall-c", "--package", "footfall-tests", "--package", "cpg-core"];
    passed(state, tests(state, &[&packages[..], &["--test", "programs"]].concat(), &[])?)
}

fn firmware_host(state: &State) -> Result<String> {
    // The library uses none of what an image needs.
    let mut counts = tests(state, &["--package", "firmware", "--lib", "--no-default-features"], &[])?;
    counts.add(tests(state, &["--package", "firmware-rp2040", "--lib"], &[])?);
    let examples = ["test", "--doc", "--package", "firmware", "--package", "firmware-rp2040", "--no-default-features"];
    let mut cargo = shell::cargo();
    cargo.args(examples);
    counts.add(counts::run("the examples of the families", &mut cargo, &mut std::io::stderr())?);
    passed(state, counts)
}

fn endurance(_: &State) -> Result<String> {
    // The host tests have built it. With `--package` its dependencies would have other features, and be compiled again.
    cargo(&["run", "--example", "endurance", "--", "72"])?;
    Ok(String::new())
}

fn virtual_board(state: &State) -> Result<String> {
    let package = ["--package", "virtual-board", "--profile", "host"];
    state.virtual_board()?;
    cargo(&[&["clippy"], &package[..], &["--all-targets", "--", "-D", "warnings"]].concat())?;
    let mut doc = shell::cargo();
    doc.env("RUSTDOCFLAGS", "-Dwarnings").arg("doc").args(package).arg("--no-deps");
    shell::must_succeed(&mut doc, "cargo doc")?;
    passed(state, tests(state, &package, &[])?)
}

fn images(state: &State) -> Result<String> {
    let mut sizes = Vec::new();
    let shadow = state.workspace.firmware(Board::F4Discovery, Variant::SHADOW)?;
    let _ = state.shadow.set(shadow.elf);
    let without_sensor = state.workspace.firmware_without_sensor()?;
    let _ = state.without_sensor.set(without_sensor.elf);
    for board in Board::ALL {
        let image = state.workspace.firmware(board, Variant::USUAL)?;
        // One such routine in a tick costs as much as fifty in single precision, and no other test shows it.
        ensure!(
            image.double_precision.is_empty(),
            "{} computes in double precision: {:?}",
            board.feature(),
            image.double_precision
        );
        sizes.push(format!("{}: {}", board.feature(), image.footprint));
        // Each is set only once: it was not asked for before.
        let _ = match board {
            Board::F4Discovery => state.image.set(image.elf),
            Board::BlackPillF411 => state.black_pill.set(image.elf),
            Board::NucleoF446re => Ok(()),
        };
    }
    Ok(sizes.join("; "))
}

/// Links only if no panic is reachable; with one reachable index it must not link, otherwise the proof proves nothing.
fn panic_free(state: &State) -> Result<String> {
    shell::must_succeed(&mut state.workspace.thumb_build("link-proof", &[])?, "linking the panic-free proof")?;
    let mut broken = state.workspace.thumb_build("link-proof", &["--features", "unchecked-index"])?;
    let finished =
        shell::with_deadline(&mut broken, Duration::from_secs(600), &state.log("link-proof-unchecked-index"))?;
    let undefined = finished.output.lines().find(|line| line.contains("undefined symbol"));
    match (finished.success(), undefined) {
        (true, _) => bail!("the proof links with a reachable panic: it proves nothing"),
        (false, None) => bail!("the proof with a reachable panic failed, but not at the link:\n{}", finished.tail(20)),
        (false, Some(line)) => {
            eprintln!("with a reachable panic, as it should: {}", line.trim());
            Ok("links; with a reachable panic it does not".to_owned())
        }
    }
}

fn gait_changes(state: &State) -> Result<String> {
    let elf = state.workspace.gait_changes()?;
    let board = emulated::lines(state.virtual_board()?, &elf, &state.log("gait-changes"))?;
    let host = shell::stdout_of(&mut shell::command(state.workspace.gait_changes_on_host()?))?;
    let host: Vec<&str> = host.lines().collect();
    if let Some((board, host)) = board.iter().zip(&host).find(|(board, host)| board != *host) {
        bail!("the virtual board says `{board}`, the host says `{host}`");
    }
    ensure!(
        board.len() == host.len() && !board.is_empty(),
        "{} changes on the virtual board, {} on the host: both must be equal, and more than 0",
        board.len(),
        host.len()
    );
    let outside: Vec<&String> = board.iter().filter(|line| !line.ends_with(" inside")).collect();
    ensure!(outside.is_empty(), "beyond a range or a rate: {outside:?}");
    Ok(format!("{} changes", board.len()))
}

/// The test programs that run the image.
const IMAGE_TESTS: [&str; 27] = [
    "virtual_board",
    "fits",
    "board_black_pill",
    "board_inputs",
    "board_lockstep",
    "board_serial",
    "board_rtt",
    "board_trim",
    "board_pulses",
    "board_servos",
    "board_conditions",
    "board_program",
    "board_watchdog",
    "board_restart",
    "board_boots",
    "board_campaign",
    "board_operator",
    "board_script",
    "board_watch",
    "board_gestures",
    "board_interrupts",
    "board_follower",
    "board_records",
    "board_entrainment",
    "capture",
    "lamps",
    "sensor_faults",
];

/// Every run of the virtual board in these tests, whoever starts it, adds its judgement of the pulses to one file.
fn image_tests(state: &State) -> Result<String> {
    let footfall = state.workspace.footfall()?;
    let file = state.log("judged");
    std::fs::create_dir_all(file.parent().unwrap_or(Path::new("")))?;
    std::fs::write(&file, "").with_context(|| format!("cannot write {}", file.display()))?;
    let variables = [
        ("FOOTFALL_ELF", state.image()?),
        ("FOOTFALL_SHADOW_ELF", state.shadow()?),
        ("FOOTFALL_NO_SENSOR_ELF", state.without_sensor()?),
        ("FOOTFALL_BLACK_PILL_ELF", state.black_pill()?),
        ("FOOTFALL_VIRTUAL_BOARD", state.virtual_board()?),
        ("FOOTFALL_BIN", &footfall),
        (judged::FILE, &file),
    ];
    let mut variables = variables.map(|(name, path)| (name, path.as_os_str())).to_vec();
    // Tests of these programs that need no image run in the step `host-tests`.
    variables.push(("FOOTFALL_IMAGES_ALONE", OsStr::new("1")));
    // Without `--package`, the features are those of the host tests and nothing is compiled again.
    let arguments: Vec<&str> = IMAGE_TESTS.iter().flat_map(|name| ["--test", name]).collect();
    let tests = passed(state, tests(state, &arguments, &variables)?)?;
    Ok(format!("{tests}; {}", Judged::read(&file)?))
}

/// The test programs in which probe-rs, or a person's part, meets a virtual board that runs as fast as real time. One test at a time: a board that gets too
/// little of the processor is behind real time, and what waits for it gives up.
const PROBE_TESTS: [&str; 4] = ["board_probe", "bringup", "page_commands", "xtask_probe"];

fn with_probe_rs(state: &State) -> Result<String> {
    let footfall = state.workspace.footfall()?;
    let probe_rs = probe::program("probe-rs")?;
    let folder = probe_rs.parent().context("probe-rs is in no folder")?;
    let variables = [
        ("FOOTFALL_ELF", state.image()?),
        ("FOOTFALL_SHADOW_ELF", state.shadow()?),
        ("FOOTFALL_VIRTUAL_BOARD", state.virtual_board()?),
        ("FOOTFALL_BIN", &footfall),
        (probe::FOLDER, folder),
    ];
    let mut variables = variables.map(|(name, path)| (name, path.as_os_str())).to_vec();
    variables.push(("FOOTFALL_IMAGES_ALONE", OsStr::new("1")));
    let required = format!("{},{}", state.required.for_tests(true), Need::Probe.name());
    variables.push((REQUIRE, OsStr::new(&required)));
    let (mut all, mut again) = (Counts::default(), Vec::new());
    for name in PROBE_TESTS {
        let run = || {
            let mut cargo = shell::cargo();
            cargo.args(["test", "--test", name, "--", "--test-threads=1"]).envs(variables.iter().copied());
            counts::run(name, &mut cargo, &mut std::io::stderr())
        };
        let mut counts = run()?;
        // Real time: a computer that stands still for a second fails a test that is good.
        if !counts.failed.is_empty() {
            again.push(counts.failed.join(", "));
            eprintln!("{name}: failed, and runs once more");
            counts = run()?;
        }
        all.add(counts);
    }
    let text = passed(state, all)?;
    Ok(if again.is_empty() { text } else { format!("{text}; at the second run: {}", again.join(", ")) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_steps_have_the_same_name() {
        for (index, step) in STEPS.iter().enumerate() {
            assert!(STEPS[..index].iter().all(|before| before.name != step.name), "{}", step.name);
            assert!(step.name.len() <= 14, "{} is too wide for the table", step.name);
        }
    }

    #[test]
    fn only_node_python_cpp_and_probe_are_optional_for_a_step() {
        let optional = |need: &&Need| !crate::setup::Required::default().contains(**need);
        let mut optional = STEPS.iter().flat_map(|step| step.needs.iter().filter(optional));
        assert!(optional.all(|need| [Need::Cpp, Need::Node, Need::Probe, Need::Python].contains(need)));
    }
}
