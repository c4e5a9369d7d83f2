//! Builds, each in the target folder where it does not evict another: the host's programs in the workspace's own, the board's
//! there too or in `thumb-debian` below it (see `toolchain.rs`).

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::board::{Board, Drive};
use crate::image::{self, Footprint};
use crate::setup::{self, Need};
use crate::shell;
use crate::toolchain::{TARGET, Toolchain};

/// The workspace and what it is built with.
#[derive(Debug)]
pub(crate) struct Workshop {
    /// Cargo's target folder for the host.
    pub(crate) target_dir: PathBuf,
    /// Where the person stands: file names on the command line are relative to it.
    pub(crate) started_in: PathBuf,
    /// Warnings in code for the board fail the build; a person who is trying something out is only shown them.
    pub(crate) strict: bool,
    toolchain: Option<Toolchain>,
}

/// A firmware image.
#[derive(Debug)]
pub(crate) struct Image {
    /// A copy under a name of its own: cargo gives every board's image the same one.
    pub(crate) elf: PathBuf,
    /// What it takes on the chip.
    pub(crate) footprint: Footprint,
    /// Routines in it that compute in double precision.
    pub(crate) double_precision: Vec<String>,
}

impl Workshop {
    /// Finds the workspace and makes its root the working directory: cargo's configuration follows it.
    pub(crate) fn open() -> Result<Workshop> {
        let started_in = std::env::current_dir().context("reading the working directory")?;
        // Set by `cargo run`; the compiled-in one serves a copy of the program that is started by hand.
        let manifest = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
        let root = Path::new(&manifest).parent().context("xtask is not in a workspace")?;
        std::env::set_current_dir(root).with_context(|| format!("entering {}", root.display()))?;
        let metadata =
            shell::stdout_of(shell::cargo().args(["metadata", "--format-version", "1", "--no-deps", "--offline"]))?;
        let metadata: serde_json::Value = serde_json::from_str(&metadata).context("reading cargo's metadata")?;
        let target_dir = metadata["target_directory"].as_str().context("cargo names no target folder")?.into();
        Ok(Workshop { target_dir, started_in, strict: false, toolchain: None })
    }

    /// Makes the computer ready for `needs`.
    pub(crate) fn set_up(&mut self, needs: &[Need]) -> Result<()> {
        if let Some(toolchain) = setup::set_up(needs, &self.target_dir)? {
            self.toolchain = Some(toolchain);
        }
        Ok(())
    }

    /// The toolchain for the board, once [`Workshop::set_up`] has seen [`Need::Thumb`].
    pub(crate) fn toolchain(&self) -> Result<&Toolchain> {
        self.toolchain.as_ref().context("no toolchain for the board was set up")
    }

    /// A `cargo build` of one package for the board.
    pub(crate) fn thumb_build(&self, package: &str, options: &[&str]) -> Result<Command> {
        self.thumb_cargo("build", package, TARGET, options)
    }

    /// A `cargo check` of one package for a target without an operating system, which the toolchain must be
    /// [ready for](Toolchain::ready_for).
    pub(crate) fn thumb_check(&self, package: &str, target: &str, options: &[&str]) -> Result<Command> {
        self.thumb_cargo("check", package, target, options)
    }

    fn thumb_cargo(&self, command: &str, package: &str, target: &str, options: &[&str]) -> Result<Command> {
        let toolchain = self.toolchain()?;
        let mut cargo = toolchain.cargo();
        cargo.args([command, "--package", package, "--release", "--target", target]).args(options);
        if self.strict {
            toolchain.deny_warnings(&mut cargo);
        }
        // Without a level defmt compiles every log statement out; the configuration file says so too, but yields to the environment.
        if std::env::var_os("DEFMT_LOG").is_none_or(|level| level.is_empty()) {
            cargo.env("DEFMT_LOG", "info");
        }
        Ok(cargo)
    }

    /// The firmware for a board.
    pub(crate) fn firmware(&self, board: Board, drive: Drive) -> Result<Image> {
        let features = match drive {
            Drive::Servos => board.feature().to_owned(),
            Drive::Nothing => format!("{},shadow", board.feature()),
        };
        eprintln!("build: firmware for {features}");
        let options = ["--no-default-features", "--features", &features];
        let built = executable(&mut self.thumb_build("firmware", &options)?, "firmware")?;
        let elf = std::fs::read(&built).with_context(|| format!("reading {}", built.display()))?;
        let wrong = |wrong: &'static str| anyhow::anyhow!("{}: {wrong}", built.display());
        let footprint = image::footprint(&elf).map_err(wrong)?;
        let double_precision = image::double_precision(&elf).map_err(wrong)?;
        let images = self.target_dir.join("images");
        std::fs::create_dir_all(&images).with_context(|| format!("making {}", images.display()))?;
        let copy = images.join(format!("firmware-{}.elf", features.replace(',', "-")));
        std::fs::write(&copy, elf).with_context(|| format!("writing {}", copy.display()))?;
        Ok(Image { elf: copy, footprint, double_precision })
    }

    /// The self-test of the processor core, which needs no peripheral.
    pub(crate) fn core_selftest(&self) -> Result<PathBuf> {
        eprintln!("build: core-selftest");
        executable(&mut self.thumb_build("core-selftest", &[])?, "core-selftest")
    }

    /// The program that counts the instructions of every generator's step.
    pub(crate) fn step_cost(&self) -> Result<PathBuf> {
        eprintln!("build: step-cost");
        executable(&mut self.thumb_build("step-cost", &[])?, "step-cost")
    }

    /// The program that runs an image without a board.
    pub(crate) fn virtual_board(&self) -> Result<PathBuf> {
        self.host_program("virtual-board")
    }

    /// The command-line program.
    pub(crate) fn footfall(&self) -> Result<PathBuf> {
        self.host_program("footfall")
    }

    fn host_program(&self, package: &str) -> Result<PathBuf> {
        eprintln!("build: {package}");
        executable(shell::cargo().args(["build", "--package", package, "--profile", "host"]), package)
    }
}

/// Runs a `cargo build` and returns the executable that it tells of.
fn executable(cargo: &mut Command, name: &str) -> Result<PathBuf> {
    let output = cargo
        .arg("--message-format=json-render-diagnostics")
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .context("starting cargo")?;
    if !output.status.success() {
        bail!("building {name} failed ({})", output.status);
    }
    executable_in(&String::from_utf8_lossy(&output.stdout), name)
        .with_context(|| format!("cargo told of no executable named {name}"))
}

/// The path of the binary `name` in cargo's messages, one JSON object a line.
fn executable_in(messages: &str, name: &str) -> Option<PathBuf> {
    messages.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok()).find_map(|message| {
        let ours = message["reason"] == "compiler-artifact" && message["target"]["name"] == name;
        if ours { message["executable"].as_str().map(PathBuf::from) } else { None }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_executable_is_found_among_cargos_messages() {
        let messages = concat!(
            r#"{"reason":"compiler-artifact","target":{"name":"footfall","kind":["lib"]},"executable":null}"#,
            "\n",
            r#"{"reason":"compiler-artifact","target":{"name":"other","kind":["bin"]},"executable":"/t/other"}"#,
            "\n not json\n",
            r#"{"reason":"compiler-artifact","target":{"name":"footfall","kind":["bin"]},"executable":"/t/footfall"}"#,
            "\n",
            r#"{"reason":"build-finished","success":true}"#,
        );
        assert_eq!(executable_in(messages, "footfall"), Some("/t/footfall".into()));
        assert_eq!(executable_in(messages, "firmware"), None);
    }

    #[test]
    fn a_build_without_a_toolchain_is_refused() {
        let shop = Workshop { target_dir: "target".into(), started_in: ".".into(), strict: false, toolchain: None };
        assert!(shop.thumb_build("firmware", &[]).unwrap_err().to_string().contains("toolchain"));
    }
}
