//! A board whose chip runs its USB boot loader: written with dfu-util, without a debug probe.
//!
//! The boot loader is in the chip's ROM (ST AN2606) and runs where BOOT0 is high at reset. It cannot be asked what a sector holds.

use std::path::Path;
use std::process::Stdio;

use anyhow::{Context, Result, bail};

use crate::board::Board;
use crate::missing_requirement::MissingRequirement;
use crate::probe::{SECTOR_BYTES, Sector, done};
use crate::shell;

/// Vendor and product of the boot loader in every STM32 (ST AN3156).
const BOOT_LOADER: &str = "0483:df11";

/// Checks that the board has a USB connector of its chip, that dfu-util is there, and that a boot loader answers.
pub(crate) fn require(board: Board) -> Result<()> {
    if !board.has_usb() {
        bail!(
            "--dfu: the {} has no USB connector of its chip; flash it with its probe, without --dfu",
            board.feature()
        );
    }
    if shell::on_path("dfu-util").is_none() {
        return Err(MissingRequirement(
            "dfu-util is missing: install it (Debian, Fedora, Homebrew: the package dfu-util), then start the boot loader: BOOT0 high, USB plugged in, reset".to_owned(),
        )
        .into());
    }
    let output = shell::command("dfu-util").arg("--list").stdin(Stdio::null()).output().context("starting dfu-util")?;
    if !String::from_utf8_lossy(&output.stdout).contains(&format!("Found DFU: [{BOOT_LOADER}]")) {
        return Err(MissingRequirement(
            "no boot loader found: connect BOOT0 with VDD, plug the board's USB socket in (not that of the ST-LINK), and press reset".to_owned(),
        )
        .into());
    }
    Ok(())
}

/// Writes a file to flash. The boot loader erases every sector that the file touches, and no other.
pub(crate) fn download(address: u32, file: &Path) -> Result<()> {
    let mut dfu = shell::command("dfu-util");
    dfu.args(["--device", BOOT_LOADER, "--alt", "0", "--dfuse-address"]).arg(format!("0x{address:08x}"));
    done(dfu.arg("--download").arg(file), "dfu-util")
}

/// Erases a parameter sector by a download that touches all of it; `file` is written on the way.
pub(crate) fn erase(sector: Sector, file: &Path) -> Result<()> {
    std::fs::write(file, [0xFF; SECTOR_BYTES]).with_context(|| format!("writing {}", file.display()))?;
    download(sector.address(), file)
}
