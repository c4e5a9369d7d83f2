//! Builds the programs of the workspace: those for the host in its target folder, those for the board there too or in `thumb-debian`
//! below it (see `toolchain.rs`), so that no build removes the output of another.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::board::{Board, Variant};
use crate::board_flags;
use crate::image::{self, Footprint};
use crate::progress::{self, Build};
use crate::seal;
use crate::setup::{self, Need, Required};
use crate::shell;
use crate::toolchain::{SMALLEST_TARGET, TARGET, Toolchain};

/// The workspace and what it is built with.
#[derive(Debug)]
pub(crate) struct Workspace {
    /// Cargo's target folder for the host.
    pub(crate) target_dir: PathBuf,
    /// Where the command was typed: file names on the command line are relative to it.
    pub(crate) started_in: PathBuf,
    /// Warnings in code for the board fail the build. Outside the tests they are only shown.
    pub(crate) strict: bool,
    /// [`Workspace::footfall`] builds in the profile `dev`, from the crates of the host tests, which are then not compiled once more. Outside the tests it
    /// builds in the profile `host`.
    pub(crate) footfall_of_tests: bool,
    toolchain: Option<Toolchain>,
}

/// Commands that `footfall` is built with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Commands {
    /// `watch` and `record`: a newcomer waits for fewer crates.
    Watch,
    /// All, among them what judges a generator.
    All,
}

/// What `cargo xtask run` starts.
#[derive(Debug)]
pub(crate) struct Programs {
    pub(crate) virtual_board: PathBuf,
    pub(crate) footfall: PathBuf,
    pub(crate) image: Image,
}

/// A firmware image.
#[derive(Debug)]
pub(crate) struct Image {
    /// A sealed copy under a name of its own: cargo gives every board's image the same one.
    pub(crate) elf: PathBuf,
    /// What it takes on the chip.
    pub(crate) footprint: Footprint,
    /// Routines in it that compute in double precision.
    pub(crate) double_precision: Vec<String>,
}

impl Workspace {
    /// Finds the workspace and makes its root the working directory: cargo's configuration follows it.
    pub(crate) fn open() -> Result<Workspace> {
        let started_in = std::env::current_dir().context("reading the working directory")?;
        // Set by `cargo run`; the compiled-in one serves a copy of the program that is started by hand.
        let manifest = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
        let root = Path::new(&manifest).parent().context("xtask is not in a workspace")?;
        std::env::set_current_dir(root).with_context(|| format!("entering {}", root.display()))?;
        let metadata =
            shell::stdout_of(shell::cargo().args(["metadata", "--format-version", "1", "--no-deps", "--offline"]))?;
        let metadata: serde_json::Value = serde_json::from_str(&metadata).context("reading cargo's metadata")?;
        let target_dir = metadata["target_directory"].as_str().context("cargo names no target folder")?.into();
        Ok(Workspace { target_dir, started_in, strict: false, footfall_of_tests: false, toolchain: None })
    }

    /// Makes the computer ready for `needs`, all of which are required.
    pub(crate) fn set_up(&mut self, needs: &[Need]) -> Result<()> {
        self.prepare(needs, &Required::from_environment()?.and(needs)).map(drop)
    }

    /// Installs everything that a command may need, and these groups of tools, which are required then. Returns what is missing.
    pub(crate) fn install(&mut self, groups: &[Need]) -> Result<Vec<(Need, String)>> {
        let mut needs = vec![Need::BoardCompiler, Need::VirtualBoard];
        needs.extend(groups);
        self.prepare(&needs, &Required::from_environment()?.and(groups))
    }

    /// Makes the computer ready for `needs`; returns those optional ones that are missing, each with the reason.
    pub(crate) fn prepare(&mut self, needs: &[Need], required: &Required) -> Result<Vec<(Need, String)>> {
        let setup = setup::set_up(needs, required, &self.target_dir)?;
        self.toolchain = setup.toolchain.or(self.toolchain.take());
        Ok(setup.missing)
    }

    /// The toolchain for the board, once [`Workspace::set_up`] was called with [`Need::BoardCompiler`].
    pub(crate) fn toolchain(&self) -> Result<&Toolchain> {
        self.toolchain.as_ref().context("no toolchain for the board was set up")
    }

    /// A `cargo build` of one package for the board.
    pub(crate) fn thumb_build(&self, package: &str, options: &[&str]) -> Result<Command> {
        self.thumb_cargo("build", package, TARGET, options)
    }

    /// A `cargo build` of one package for the smallest chips, which the toolchain must be [ready for](Toolchain::ready_for).
    pub(crate) fn smallest_build(&self, package: &str, options: &[&str]) -> Result<Command> {
        self.thumb_cargo("build", package, SMALLEST_TARGET, options)
    }

    /// A `cargo check` of one package for a target without an operating system, which the toolchain must be
    /// [ready for](Toolchain::ready_for).
    pub(crate) fn thumb_check(&self, package: &str, target: &str, options: &[&str]) -> Result<Command> {
        self.thumb_cargo("check", package, target, options)
    }

    fn thumb_cargo(&self, command: &str, package: &str, target: &str, options: &[&str]) -> Result<Command> {
        let toolchain = self.toolchain()?;
        let mut cargo = toolchain.cargo();
        let root = std::env::current_dir().context("reading the working directory")?;
        let (name, flags) = board_flags::variable(&root, &self.target_dir, &toolchain.library())?;
        cargo.env(name, flags);
        cargo.args([command, "--package", package, "--release", "--target", target]).args(options);
        if self.strict {
            toolchain.deny_warnings(&mut cargo);
        }
        // Without a level defmt compiles every log statement out. The configuration file sets it too, but an empty variable overrides that.
        if std::env::var_os("DEFMT_LOG").is_none_or(|level| level.is_empty()) {
            cargo.env("DEFMT_LOG", "info");
        }
        Ok(cargo)
    }

    /// The firmware for a board.
    pub(crate) fn firmware(&self, board: Board, variant: Variant) -> Result<Image> {
        self.firmware_with(&features(board, variant))
    }

    /// The firmware for the Discovery that walks without a gait sensor, and neither while a debugger is attached nor without a seal: the features `no-sensor`,
    /// `no-debugger` and `require-seal` in one image, for the tests.
    pub(crate) fn firmware_without_sensor(&self) -> Result<Image> {
        self.firmware_with(&format!("{},no-sensor,no-debugger,require-seal", Board::F4Discovery.feature()))
    }

    /// The firmware for the Discovery of which any one protection can be removed: the feature `controls`.
    pub(crate) fn firmware_controls(&self) -> Result<Image> {
        self.firmware_with(&format!("{},controls", Board::F4Discovery.feature()))
    }

    fn firmware_with(&self, features: &str) -> Result<Image> {
        eprintln!("build: firmware for {features}");
        let _alone = self.images_alone()?;
        let built = executable(self.firmware_build(features)?)?;
        self.image(&built, features)
    }

    /// What `cargo xtask run` needs, built side by side. The two programs for the host are one build, because they share most crates.
    pub(crate) fn image_and_host_programs(
        &self,
        board: Board,
        variant: Variant,
        commands: Commands,
    ) -> Result<Programs> {
        let features = features(board, variant);
        eprintln!("build: virtual-board and footfall, firmware for {features} (the first time takes minutes)");
        let mut host = host_build("virtual-board and footfall", &["virtual-board", "footfall"], &[]);
        if commands == Commands::Watch {
            host.cargo.arg("--no-default-features");
        }
        let _alone = self.images_alone()?;
        let built: Vec<PathBuf> =
            progress::build(vec![host, self.firmware_build(&features)?])?.into_iter().flatten().collect();
        let Ok([virtual_board, footfall, firmware]) = <[PathBuf; 3]>::try_from(built) else {
            bail!("cargo built other programs than the three that were asked for: virtual board, footfall, firmware")
        };
        Ok(Programs { virtual_board, footfall, image: self.image(&firmware, &features)? })
    }

    /// The firmware for a board from the source in another folder, with everything compiled there.
    pub(crate) fn firmware_in(&self, root: &Path, board: Board) -> Result<PathBuf> {
        let toolchain = self.toolchain()?;
        let target_dir = root.join("target");
        let mut build = self.firmware_build(&features(board, Variant::USUAL))?;
        let (name, flags) = board_flags::variable(root, &target_dir, &toolchain.library())?;
        build.cargo.env(name, flags).env("CARGO_TARGET_DIR", toolchain.target_dir(&target_dir)).current_dir(root);
        build.label = "firmware in another folder";
        let built = executable(build)?;
        sealed(&built, &built)?;
        Ok(built)
    }

    fn firmware_build(&self, features: &str) -> Result<Build> {
        let cargo = self.thumb_build("firmware", &["--no-default-features", "--features", features])?;
        Ok(Build { label: "firmware", cargo, executables: &["firmware"] })
    }

    /// The folder of the images and records that commands make.
    pub(crate) fn images(&self) -> Result<PathBuf> {
        let images = self.target_dir.join("images");
        std::fs::create_dir_all(&images).with_context(|| format!("making {}", images.display()))?;
        Ok(images)
    }

    /// Waits until no other command builds an image, and keeps others from it until the result is dropped. Cargo gives the images of all variants one name:
    /// of two builds at a time, one command would take the image of the other, which may drive the servos where its own does not.
    pub(crate) fn images_alone(&self) -> Result<File> {
        let path = self.images()?.join(".lock");
        let file = File::create(&path).with_context(|| format!("making {}", path.display()))?;
        if file.try_lock().is_err() {
            eprintln!("build: waits for another command that builds an image");
        }
        file.lock().with_context(|| format!("waiting for {}", path.display()))?;
        Ok(file)
    }

    /// Reads the image, seals it, and keeps that under a name of its own.
    fn image(&self, built: &Path, features: &str) -> Result<Image> {
        let copy = self.images()?.join(format!("firmware-{}.elf", features.replace(',', "-")));
        let elf = sealed(built, &copy)?;
        let place = || format!("in {}", built.display());
        let footprint = image::footprint(&elf).with_context(place)?;
        let double_precision = image::double_precision(&elf).with_context(place)?;
        Ok(Image { elf: copy, footprint, double_precision })
    }

    /// The program that counts the instructions of every generator's step.
    pub(crate) fn step_cost(&self) -> Result<PathBuf> {
        one_program(Build {
            label: "step-cost",
            cargo: self.thumb_build("step-cost", &[])?,
            executables: &["step-cost"],
        })
    }

    /// An example firmware, with options that choose it.
    pub(crate) fn example(&self, program: &'static [&'static str; 1], options: &[&str]) -> Result<PathBuf> {
        let cargo = self.thumb_build("bare-metal-example", &[&["--bin", program[0]], options].concat())?;
        one_program(Build { label: program[0], cargo, executables: program })
    }

    /// The program that plays changes of gait, for the board.
    pub(crate) fn gait_changes(&self) -> Result<PathBuf> {
        one_program(Build {
            label: "gait-changes",
            cargo: self.thumb_build("step-cost", &[])?,
            executables: &["gait-changes"],
        })
    }

    /// The same program for the host. Beside packages of the host tests its dependencies have the features that they have there; those that only tests
    /// ask for are counted in because of the example, which the host tests have built.
    pub(crate) fn gait_changes_on_host(&self) -> Result<PathBuf> {
        let mut cargo = shell::cargo();
        cargo.args(["build", "--package", "step-cost", "--package", "footfall-tests", "--package", "cpg-core"]);
        cargo.args(["--bin", "gait-changes", "--example", "endurance"]);
        one_program(Build { label: "gait-changes for the host", cargo, executables: &["gait-changes"] })
    }

    /// The program that runs an image without a board.
    pub(crate) fn virtual_board(&self) -> Result<PathBuf> {
        one_program(host_build("virtual-board", &["virtual-board"], &[]))
    }

    /// The program that measures images and source.
    pub(crate) fn audit(&self) -> Result<PathBuf> {
        one_program(host_build("audit", &["audit"], &["board-cost", "footfall", WHEEL]))
    }

    /// The program that counts the cost of each part of an image.
    pub(crate) fn board_cost(&self) -> Result<PathBuf> {
        one_program(host_build("board-cost", &["board-cost"], &["audit", "footfall", WHEEL]))
    }

    /// The command-line program.
    pub(crate) fn footfall(&self) -> Result<PathBuf> {
        if !self.footfall_of_tests {
            return one_program(host_build("footfall", &["footfall"], &[WHEEL]));
        }
        let mut cargo = shell::cargo();
        // Features that only tests ask for are counted in because of the example, which the host tests build.
        cargo.args(["build", "--bin", "footfall", "--example", "endurance"]);
        one_program(Build { label: "footfall, as the tests build it", cargo, executables: &["footfall"] })
    }
}

/// Seals the image that cargo built and writes it to `copy`; its bytes.
fn sealed(built: &Path, copy: &Path) -> Result<Vec<u8>> {
    let mut elf = std::fs::read(built).with_context(|| format!("reading {}", built.display()))?;
    // An image without content has no place for a seal either, and the other message says why.
    image::footprint(&elf).and_then(|_| seal::seal(&mut elf)).with_context(|| format!("in {}", built.display()))?;
    std::fs::write(copy, &elf).with_context(|| format!("writing {}", copy.display()))?;
    Ok(elf)
}

fn features(board: Board, variant: Variant) -> String {
    let all: Vec<&str> = std::iter::once(board.feature()).chain(variant.features()).collect();
    all.join(",")
}

/// The Python package, whose wheel needs every dependency of `footfall`, with the same features or more.
pub(crate) const WHEEL: &str = "footfall-python";

/// A build of programs for the host: packages with an executable of the same name. Cargo gives a dependency the features that the chosen packages need
/// together, so with the packages `beside`, of which nothing is built, what is compiled here serves their builds too.
fn host_build(label: &'static str, programs: &'static [&'static str], beside: &[&str]) -> Build {
    let mut cargo = shell::cargo();
    cargo.args(["build", "--profile", "host"]);
    cargo.args(programs.iter().chain(beside).flat_map(|package| ["--package", package]));
    cargo.args(programs.iter().flat_map(|program| ["--bin", program]));
    Build { label, cargo, executables: programs }
}

/// A build of one executable, announced by its name.
fn one_program(build: Build) -> Result<PathBuf> {
    eprintln!("build: {}", build.label);
    executable(build)
}

fn executable(build: Build) -> Result<PathBuf> {
    let built = progress::build(vec![build])?;
    built.into_iter().flatten().next().context("the build made no program")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_variant_has_its_features_and_each_feature_is_one_of_both_families() {
        let of = |shadow, no_sensor| features(Board::F4Discovery, Variant { shadow, no_sensor });
        assert_eq!(of(false, false), "f4-discovery");
        assert_eq!(of(true, false), "f4-discovery,shadow");
        assert_eq!(of(false, true), "f4-discovery,no-sensor");
        assert_eq!(of(true, true), "f4-discovery,shadow,no-sensor");
        for family in ["firmware", "firmware-rp2040"] {
            let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(family).join("Cargo.toml");
            let text = std::fs::read_to_string(manifest).unwrap();
            for feature in (Variant { shadow: true, no_sensor: true }).features() {
                assert!(text.contains(&format!("\n{feature} = [")), "{family} has no feature {feature}");
            }
        }
    }

    #[test]
    fn a_build_without_a_toolchain_is_refused() {
        let workspace = Workspace {
            target_dir: "target".into(),
            started_in: ".".into(),
            strict: false,
            footfall_of_tests: false,
            toolchain: None,
        };
        assert!(workspace.thumb_build("firmware", &[]).unwrap_err().to_string().contains("toolchain"));
    }

    /// The Discovery without a name from the root, each board by its name in the folder of the firmware: two chips at once do not compile.
    #[test]
    fn cargo_alone_has_one_chip() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let from_root: &[&str] = &["--package", "firmware", "--target", TARGET];
        for (folder, arguments, chip) in [
            ("", from_root, "stm32f407vg"),
            ("", &["--package", "firmware"], "stm32f407vg"),
            ("firmware", &["--features", "f4-discovery"], "stm32f407vg"),
            ("firmware", &["--features", "nucleo-f446re"], "stm32f446re"),
            ("firmware", &["--features", "black-pill-f411"], "stm32f411ce"),
        ] {
            let mut cargo = shell::cargo();
            cargo.args(["tree", "--depth", "1", "--edges", "normal", "--prefix", "none", "--format", "{p};{f}"]);
            // Flags of whoever runs this test would replace those of the configuration.
            cargo.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
            let tree = shell::stdout_of(cargo.args(arguments).current_dir(root.join(folder))).unwrap();
            let features = tree.lines().find_map(|line| line.strip_prefix("embassy-stm32 ")).expect("the HAL");
            let features = features.split_once(';').unwrap().1;
            let chips: Vec<&str> = features.split([',', ' ']).filter(|name| name.starts_with("stm32f")).collect();
            assert_eq!(chips, [chip], "{folder} {arguments:?}");
        }
    }
}
