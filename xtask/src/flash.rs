//! `cargo xtask flash`: writes the firmware to a board with probe-rs and shows the board's log until Ctrl-C.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, ensure};

use crate::board::{Board, Drive};
use crate::missing_requirement::MissingRequirement;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// `GENERATOR_SECTOR` in `firmware/src/board/mod.rs`; `tests/pins.rs` compares the two.
const GENERATOR_SECTOR: &str = "0x08004000";
/// `SENSORS_SECTOR` in the same file.
const SENSORS_SECTOR: &str = "0x08008000";

/// Options of `cargo xtask flash`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The board that is connected
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Write a generator's parameters into the board's first parameter sector first
    #[arg(long, value_name = "TOML")]
    generator: Option<PathBuf>,
    /// Write the sensors into the second: for each its joint and its calibration, from channel 1 on, up to four
    #[arg(long, value_name = "JOINT[=TOML]")]
    sensor: Vec<String>,
    /// Shadow mode: run everything, drive nothing
    #[arg(long)]
    shadow: bool,
}

/// Looks for a probe first: without one a build is useless.
pub(crate) fn flash(options: &Options) -> Result<ExitCode> {
    let board = options.board;
    if shell::on_path("probe-rs").is_none() {
        return Err(MissingRequirement(
            "probe-rs is missing: install it with `cargo install probe-rs-tools --locked` (or see probe.rs), then plug the board in".to_owned(),
        )
        .into());
    }
    let output = shell::command("probe-rs").arg("list").stdin(Stdio::null()).output().context("starting probe-rs")?;
    let output_text =
        format!("{}\n{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if let Some(error) = no_probe(output.status.success(), &output_text) {
        return Err(MissingRequirement(error).into());
    }
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler])?;
    let image = workspace.firmware(board, Drive::unless(options.shadow))?;
    eprintln!("image: {}, {}", image.elf.display(), image.footprint);
    // Each sector is a download of its own: that of the program does not erase them, so parameters outlast a new program.
    if let Some(generator) = &options.generator {
        download(&workspace, board, &[generator.into()], "generator.bin", GENERATOR_SECTOR)?;
    }
    if !options.sensor.is_empty() {
        let sensors: Vec<OsString> =
            options.sensor.iter().flat_map(|sensor| ["--sensor".into(), sensor.into()]).collect();
        download(&workspace, board, &sensors, "sensors.bin", SENSORS_SECTOR)?;
    }
    shell::replace_with(shell::command("probe-rs").args(["run", "--chip", board.chip()]).arg(image.elf))
}

/// Packs parameters and writes them into their sector.
fn download(workspace: &Workspace, board: Board, pack: &[OsString], name: &str, sector: &str) -> Result<()> {
    let packed = workspace.target_dir.join("images").join(name);
    let mut footfall = shell::command(workspace.footfall()?);
    footfall.current_dir(&workspace.started_in).arg("pack").args(pack).arg("--force").arg("--out").arg(&packed);
    done(&mut footfall, "footfall pack")?;
    let mut download = shell::command("probe-rs");
    download.args(["download", "--chip", board.chip(), "--binary-format", "bin", "--base-address", sector]);
    done(download.arg(packed), "probe-rs download")
}

fn done(command: &mut Command, name: &str) -> Result<()> {
    let status = command.status().with_context(|| format!("starting {name}"))?;
    ensure!(status.success(), "{name} ended with {status}");
    Ok(())
}

/// Why there is no probe to flash with, in one line, from the output of `probe-rs list`; `None` if there is one.
fn no_probe(succeeded: bool, output: &str) -> Option<String> {
    let first = output.lines().map(str::trim).find(|line| !line.is_empty());
    match (succeeded, first) {
        (true, Some(line)) if !line.to_ascii_lowercase().starts_with("no debug probes were found") => None,
        (true, _) => Some(
            "no probe found: plug the board's ST-LINK socket in (on Linux, probe-rs also wants its udev rules: see probe.rs)".to_owned(),
        ),
        (false, line) => Some(format!("probe-rs cannot list the probes: {}", line.unwrap_or("it wrote nothing"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listed_probe_is_enough() {
        let output = "The following debug probes were found:\n[0]: STLink V2 -- 0483:3748:0668FF (ST-LINK)\n";
        assert_eq!(no_probe(true, output), None);
    }

    #[test]
    fn no_probe_is_reported_in_one_line() {
        for (succeeded, output, word) in [
            (true, "No debug probes were found.\n", "plug"),
            (true, "", "plug"),
            (false, "\nError: cannot open libusb\n  caused by: more\n", "cannot open libusb"),
            (false, "", "wrote nothing"),
        ] {
            let line = no_probe(succeeded, output).unwrap();
            assert!(line.contains(word) && !line.contains('\n'), "{line}");
        }
    }
}
