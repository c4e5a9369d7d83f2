//! `cargo xtask flash`: the firmware onto a board, by probe-rs; its log then runs in the terminal until Ctrl-C.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, ensure};

use crate::board::{Board, Drive};
use crate::build::Workshop;
use crate::setup::{Incomplete, Need};
use crate::shell;

/// `GENERATOR_SECTOR` in `firmware/src/board/mod.rs`; `tests/pins.rs` compares the two.
const WALKER_SECTOR: &str = "0x08004000";
/// `SENSORS_SECTOR` in the same file.
const SENSORS_SECTOR: &str = "0x08008000";

/// What goes onto the board.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The board on the desk
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Write a walker's parameters into the board's first parameter sector first
    #[arg(long, value_name = "TOML")]
    params: Option<PathBuf>,
    /// Write the worn sensors into the second: each its joint and its calibration, from channel 1 on, up to four
    #[arg(long, value_name = "JOINT[=TOML]")]
    sensor: Vec<String>,
    /// Shadow mode: run everything, drive nothing
    #[arg(long)]
    shadow: bool,
}

/// Looks for a probe first: without one there is no need to build.
pub(crate) fn flash(shop: &mut Workshop, options: &Options) -> Result<ExitCode> {
    let board = options.board;
    if shell::on_path("probe-rs").is_none() {
        return Err(Incomplete(
            "probe-rs is missing: install it with `cargo install probe-rs-tools --locked` (or see probe.rs), then plug the board in".to_owned(),
        )
        .into());
    }
    let output = shell::command("probe-rs").arg("list").stdin(Stdio::null()).output().context("starting probe-rs")?;
    let said = format!("{}\n{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if let Some(trouble) = no_probe(output.status.success(), &said) {
        return Err(Incomplete(trouble).into());
    }
    shop.set_up(&[Need::Thumb])?;
    let image = shop.firmware(board, Drive::unless(options.shadow))?;
    eprintln!("image: {}, {}", image.elf.display(), image.footprint);
    // Each sector is its own download: the program's leaves them alone, so that parameters outlive a new program.
    if let Some(params) = &options.params {
        download(shop, board, &[params.into()], "walker.bin", WALKER_SECTOR)?;
    }
    if !options.sensor.is_empty() {
        let sensors: Vec<OsString> =
            options.sensor.iter().flat_map(|sensor| ["--sensor".into(), sensor.into()]).collect();
        download(shop, board, &sensors, "sensors.bin", SENSORS_SECTOR)?;
    }
    shell::hand_over(shell::command("probe-rs").args(["run", "--chip", board.chip()]).arg(image.elf))
}

/// Packs parameters and writes them into their sector.
fn download(shop: &Workshop, board: Board, pack: &[OsString], name: &str, sector: &str) -> Result<()> {
    let packed = shop.target_dir.join("images").join(name);
    let mut footfall = shell::command(shop.footfall()?);
    footfall.current_dir(&shop.started_in).arg("pack").args(pack).arg("--out").arg(&packed);
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

/// What `probe-rs list` says when there is nothing to flash with, in one line.
fn no_probe(succeeded: bool, said: &str) -> Option<String> {
    let first = said.lines().map(str::trim).find(|line| !line.is_empty());
    match (succeeded, first) {
        (true, Some(line)) if !line.to_ascii_lowercase().starts_with("no debug probes were found") => None,
        (true, _) => Some(
            "no probe found: plug the board's ST-LINK socket in (on Linux, probe-rs also wants its udev rules: see probe.rs)".to_owned(),
        ),
        (false, line) => Some(format!("probe-rs cannot list the probes: {}", line.unwrap_or("it said nothing"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listed_probe_is_enough() {
        let said = "The following debug probes were found:\n[0]: STLink V2 -- 0483:3748:0668FF (ST-LINK)\n";
        assert_eq!(no_probe(true, said), None);
    }

    #[test]
    fn no_probe_and_a_broken_probe_rs_are_told_in_one_line() {
        for (succeeded, said, word) in [
            (true, "No debug probes were found.\n", "plug"),
            (true, "", "plug"),
            (false, "\nError: cannot open libusb\n  caused by: more\n", "cannot open libusb"),
            (false, "", "said nothing"),
        ] {
            let line = no_probe(succeeded, said).unwrap();
            assert!(line.contains(word) && !line.contains('\n'), "{line}");
        }
    }
}
