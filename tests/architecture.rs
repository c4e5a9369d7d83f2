//! Which package may depend on which, from `cargo metadata` and a few source lines.
//!
//! `joint-units <- {hgod-adc, cpg-core} <- joint-loop <- wire <- {firmware-shared <- families, tests, tools}`; the reasons are in `docs/architecture.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use footfall_tests::workspace::{files_ending, metadata, read, root};
use serde_json::Value;

/// The packages of this workspace that each core may depend on.
const CORES: [(&str, &[&str]); 5] = [
    ("joint-units", &[]),
    ("hgod-adc", &["joint-units"]),
    ("cpg-core", &["joint-units"]),
    ("joint-loop", &["joint-units", "hgod-adc", "cpg-core"]),
    ("wire", &["joint-units", "hgod-adc", "cpg-core", "joint-loop"]),
];

/// Libraries that a core may use: no allocation, no input or output, no hardware.
const CORE_LIBRARIES: [&str; 9] =
    ["cobs", "crc", "defmt", "fixed", "heapless", "libm", "micromath", "postcard", "serde"];

/// Packages that nothing may depend on, but what [`nothing_depends_on_an_end`] names: programs, families, chores and tests. The virtual board is one for
/// its licence too (GPL-2.0-only).
const ENDS: [&str; 12] = [
    "audit",
    "bare-metal-example",
    "book",
    "firmware",
    "firmware-rp2040",
    "footfall-c",
    "footfall-python",
    "footfall-tests",
    "link-proof",
    "step-cost",
    "virtual-board",
    "xtask",
];

/// The crates of the chip families.
const FAMILIES: [&str; 2] = ["firmware", "firmware-rp2040"];

/// What may read the tables of the STM32F4 boards. A second family does not: what both need is in `firmware-shared`.
const READERS_OF_THE_TABLES: [&str; 4] = ["audit", "board-cost", "footfall", "footfall-tests"];

/// Packages that need a second target or system packages, so that plain `cargo test` leaves them out.
const NOT_DEFAULT: [&str; 10] = [
    "audit",
    "bare-metal-example",
    "board-cost",
    "firmware",
    "firmware-rp2040",
    "footfall-c",
    "footfall-python",
    "link-proof",
    "step-cost",
    "virtual-board",
];

fn packages() -> BTreeMap<&'static str, &'static Value> {
    let packages = metadata()["packages"].as_array().expect("a list of packages");
    packages.iter().map(|package| (text(&package["name"]), package)).collect()
}

fn text(value: &'static Value) -> &'static str {
    value.as_str().unwrap_or_default()
}

fn dependencies(package: &'static Value) -> &'static [Value] {
    package["dependencies"].as_array().map_or(&[], Vec::as_slice)
}

/// A dependency inside the workspace has a path, one from a registry has a source.
fn is_ours(dependency: &Value) -> bool {
    dependency["path"].is_string()
}

/// The names of all dependencies of any kind on packages of this workspace.
fn ours(package: &'static Value) -> BTreeSet<&'static str> {
    dependencies(package)
        .iter()
        .filter(|dependency| is_ours(dependency))
        .map(|dependency| text(&dependency["name"]))
        .collect()
}

/// The names of the files in a folder, relative to the root.
fn files(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join(folder)).unwrap_or_else(|error| panic!("{folder}: {error}"));
    entries.map(|entry| Path::new(folder).join(entry.expect("a readable folder").file_name())).collect()
}

#[test]
fn the_arrows_between_the_cores() {
    let packages = packages();
    for (core, allowed) in CORES {
        let used = ours(packages[core]);
        // Itself with another feature, for its own tests.
        for other in used.iter().filter(|other| **other != core) {
            assert!(allowed.contains(other), "{core} depends on {other}; allowed: {allowed:?}");
        }
    }
    // An arrow of the diagram that no package uses would be wrong.
    for (core, allowed) in &CORES[3..] {
        let used: BTreeSet<_> = ours(packages[core]).into_iter().filter(|other| other != core).collect();
        assert_eq!(used, allowed.iter().copied().collect(), "{core}");
    }
}

#[test]
fn firmware_and_host_tool_use_the_loop() {
    let packages = packages();
    for user in ["firmware", "firmware-rp2040", "footfall", "link-proof"] {
        assert!(
            ours(packages[user]).contains("joint-loop"),
            "{user} does not depend on joint-loop, whose loop it must run"
        );
    }
    for user in ["firmware", "firmware-rp2040", "footfall", "footfall-tests"] {
        assert!(
            ours(packages[user]).contains("wire"),
            "{user} does not depend on wire, whose records it must exchange"
        );
    }
}

/// Pins and addresses of flash sectors stand in the firmware's board files only: the host tool and the tests of the image read them there.
#[test]
fn nothing_depends_on_an_end() {
    for (name, package) in packages() {
        for end in ENDS {
            let is_allowed = match end {
                "firmware" => READERS_OF_THE_TABLES.contains(&name),
                "firmware-rp2040" => ["footfall", "footfall-tests"].contains(&name),
                // Two programs that read the machine code of an image.
                "audit" => name == "board-cost",
                _ => false,
            };
            assert!(is_allowed || !ours(package).contains(end), "{name} depends on {end}");
        }
    }
}

/// The firmware's library holds the tables of the boards; its program, and with it the HAL, is nobody's.
#[test]
fn of_the_firmware_tools_see_the_board_files_alone() {
    for (name, package) in packages() {
        for dependency in dependencies(package).iter().filter(|dependency| dependency["name"] == "firmware") {
            assert!(READERS_OF_THE_TABLES.contains(&name), "{name} depends on firmware");
            assert_eq!(dependency["uses_default_features"], false, "{name} would compile the HAL");
            assert_eq!(dependency["features"], Value::Array(Vec::new()), "{name} asks for features of firmware");
        }
    }
}

/// The tables and modules of one family are not for the other.
#[test]
fn families_share_only_what_is_in_firmware_shared() {
    let packages = packages();
    let cores = CORES.map(|(core, _)| core);
    for dependency in dependencies(packages["firmware-shared"]) {
        let name = text(&dependency["name"]);
        // Text of a bounded length, without a heap: no part of a family.
        assert!(cores.contains(&name) || name == "heapless", "firmware-shared depends on {name}; allowed: {cores:?}");
    }
    for family in FAMILIES {
        let main = read(Path::new(family).join("src/main.rs"));
        let paths: Vec<&str> = main.lines().filter_map(|line| line.trim().strip_prefix("#[path = \"")).collect();
        assert!(paths.len() >= 9, "{family}: {paths:?}");
        for path in paths {
            assert!(path.starts_with("../../firmware-shared/program/"), "{family} compiles {path}");
        }
    }
}

#[test]
fn the_peripheral_model_depends_on_nothing_of_ours() {
    assert_eq!(
        ours(packages()["stm32f4-model"]),
        BTreeSet::new(),
        "a model that shares code with the firmware would share its mistakes"
    );
    assert_eq!(ours(packages()["servo-model"]), BTreeSet::new(), "a servo knows nothing of the board");
}

#[test]
fn the_virtual_board_uses_the_models_and_the_records_only() {
    let packages = packages();
    let allowed = BTreeSet::from(["joint-loop", "servo-model", "stm32f4-model", "wire"]);
    assert!(ours(packages["virtual-board"]).is_subset(&allowed), "its licence would reach the rest");
}

#[test]
fn only_the_virtual_board_has_another_licence() {
    for (name, package) in packages() {
        let want = if name == "virtual-board" { "GPL-2.0-only" } else { "MIT OR Apache-2.0" };
        assert_eq!(text(&package["license"]), want, "{name}");
    }
    assert_eq!(packages()["virtual-board"]["publish"], Value::Array(Vec::new()));
}

#[test]
fn only_the_firmware_names_a_chip_family() {
    for (name, package) in packages() {
        for dependency in dependencies(package).iter().filter(|dependency| !is_ours(dependency)) {
            let library = text(&dependency["name"]);
            let chip = ["embassy", "stm32", "defmt-rtt", "panic-"].iter().any(|prefix| library.starts_with(prefix));
            let of_a_firmware = FAMILIES.contains(&name) || name == "bare-metal-example";
            assert!(!chip || of_a_firmware, "{name} depends on {library}");
            let processor = library.starts_with("cortex-m");
            let bare = ["bare-metal-example", "firmware", "firmware-rp2040", "link-proof"].contains(&name);
            assert!(!processor || bare, "{name} depends on {library}");
        }
    }
}

#[test]
fn cores_use_few_libraries_and_no_build_script() {
    let packages = packages();
    for (core, _) in CORES {
        for dependency in dependencies(packages[core]) {
            let library = text(&dependency["name"]);
            // For tests only, a core may use what it likes, but still nothing of ours beyond the arrows.
            if is_ours(dependency) || dependency["kind"] == "dev" {
                continue;
            }
            assert_ne!(dependency["kind"], "build", "{core} builds with {library}");
            assert!(CORE_LIBRARIES.contains(&library), "{core} depends on {library}; allowed: {CORE_LIBRARIES:?}");
            if library == "defmt" {
                assert_eq!(dependency["optional"], true, "{core}: defmt does not link on the host");
            }
        }
        assert_eq!(packages[core]["features"].get("default"), None, "{core}: a default feature is easily left on");
    }
}

#[test]
fn cores_need_neither_std_nor_unsafe_code() {
    for (core, _) in CORES {
        let source = read(Path::new(core).join("src/lib.rs"));
        for attribute in ["#![cfg_attr(not(test), no_std)]", "#![forbid(unsafe_code)]"] {
            assert!(source.lines().any(|line| line.trim() == attribute), "{core}/src/lib.rs lacks {attribute}");
        }
        assert!(
            !source.contains("extern crate"),
            "{core} has an `extern crate`; allowed are the dependencies in its manifest"
        );
    }
}

#[test]
fn versions_that_decide_bits_are_exact() {
    let packages = packages();
    let requirement = |package: &str, library: &str| -> Vec<&'static str> {
        let all = dependencies(packages[package]).iter().filter(|dependency| dependency["name"] == library);
        all.map(|dependency| text(&dependency["req"])).collect()
    };
    // Host and board give equal bits only with one libm; the HAL's gaps and the emulator's traps were read in one version.
    for (package, library) in [
        ("firmware", "embassy-stm32"),
        ("firmware-rp2040", "embassy-rp"),
        ("cpg-core", "libm"),
        ("virtual-board", "unicorn-engine"),
    ] {
        let requirements = requirement(package, library);
        assert!(!requirements.is_empty(), "{package} does not depend on {library}: correct this test");
        assert!(requirements.iter().all(|version| version.starts_with('=')), "{package}: {library} {requirements:?}");
    }
}

#[test]
fn plain_cargo_test_needs_nothing_but_rust() {
    let list =
        |key: &str| -> BTreeSet<&'static str> { metadata()[key].as_array().expect(key).iter().map(text).collect() };
    let (members, default) = (list("workspace_members"), list("workspace_default_members"));
    for (name, package) in packages() {
        let id = text(&package["id"]);
        assert!(members.contains(id), "{name} is not a member");
        assert_eq!(default.contains(id), !NOT_DEFAULT.contains(&name), "{name}: is it a default member?");
    }
}

#[test]
fn there_is_one_cargo_configuration() {
    let members = || packages().into_values().map(|package| Path::new(text(&package["manifest_path"])).to_owned());
    for manifest in members() {
        assert!(!read(&manifest).contains("[profile."), "{}: profiles of a member are ignored", manifest.display());
        // The one for commands that are typed in the folder `firmware`, as embedded projects have it.
        let configuration = manifest.with_file_name(".cargo");
        let is_of_firmware = manifest.parent() == Some(&root().join("firmware"));
        assert!(
            is_of_firmware || !configuration.exists(),
            "{}: configuration of a member is ignored from the root",
            configuration.display()
        );
    }
    // A target that is named there would be fetched by every cargo call, and offline every one would fail.
    for toolchain in ["rust-toolchain.toml", "rust-toolchain"] {
        assert!(!root().join(toolchain).exists(), "{toolchain}");
    }
    let configuration = read(".cargo/config.toml");
    for line in configuration.lines().map(str::trim) {
        // Without this one, which chooses a board, the build of an image without a board fails, and says so.
        if line == "rustflags = \"--cfg default_board\"" {
            continue;
        }
        for trap in ["[build]", "[unstable]", "build-std", "rustflags", "link-arg"] {
            assert!(
                !line.starts_with(trap),
                ".cargo/config.toml: `{line}` reaches the host, or vanishes under RUSTFLAGS"
            );
        }
    }
}

/// Beside a virtual manifest, a test file that its package does not declare is built by nothing and fails nothing.
#[test]
fn every_file_of_tests_is_built() {
    let packages = packages();
    let targets = packages["footfall-tests"]["targets"].as_array().expect("targets");
    let declared: BTreeSet<PathBuf> = targets
        .iter()
        .filter(|target| target["kind"][0] == "test")
        .map(|target| Path::new(text(&target["src_path"])).strip_prefix(root()).expect("in the workspace").to_owned())
        .collect();
    // A program of several files is a folder with a `main.rs`; what has a manifest is a package of its own.
    let is_source = |file: &Path| file.extension().is_some_and(|extension| extension == "rs");
    let main_of = |path: PathBuf| if is_source(&path) { path } else { path.join("main.rs") };
    let present: BTreeSet<PathBuf> =
        files("tests").into_iter().map(main_of).filter(|file| root().join(file).is_file()).collect();
    let forgotten: Vec<_> = present.difference(&declared).collect();
    assert!(forgotten.is_empty(), "no [[test]] in tests/Cargo.toml for {forgotten:?}");
}

/// A sine or cosine of a library reduces a large argument in a loop: a tick that takes longer, or a wrong angle. Those of the cores take a phase of
/// one cycle, an integer. (`f32::sin` needs the standard library, which the cores do not have; a board computes nothing in `f64`.)
#[test]
fn a_sine_is_that_of_a_phase() {
    let names = ["sin", "cos", "tan", "sincos"];
    let calls = |text: &str| -> Vec<String> {
        let functions =
            text.split("libm::").skip(1).map(|rest| rest.split(|c: char| !c.is_alphanumeric()).next().unwrap_or(""));
        functions
            .filter(|name| names.iter().any(|sine| name.strip_suffix('f').unwrap_or(name) == *sine))
            .map(str::to_owned)
            .collect()
    };
    let mut of_f64 = Vec::new();
    for (core, _) in CORES {
        for file in files_ending(&[".rs"]).filter(|file| file.starts_with(&format!("{core}/src/"))) {
            let found = calls(&read(file));
            if file == "cpg-core/src/math/scalar.rs" {
                of_f64 = found
            } else {
                assert!(found.is_empty(), "{file}: {found:?}")
            }
        }
    }
    assert_eq!(of_f64, ["sin", "cos"], "of `f64`, for the host");
    let phase = read("cpg-core/src/math/trig.rs");
    assert!(phase.contains("pub fn sin_cos(phase: Phase) -> (f32, f32)"));
    assert!(read("joint-units/src/lib.rs").contains("pub struct Phase(pub u32)"), "a phase is an integer that wraps");
}

/// The last stage before the servos can be read in one sitting.
#[test]
fn the_gate_stays_short() {
    let lines = read("joint-loop/src/motion/gate.rs").lines().count();
    assert!(lines < 300, "joint-loop/src/motion/gate.rs has {lines} lines");
}
