//! `cargo xtask bringup`: hardware evidence of a connected board by `footfall bringup`, with what a debug probe can add: the unique number of the chip.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};

use crate::board::Board;
use crate::probe;
use crate::shell;
use crate::workspace::Workspace;

/// First address of the unique number of the chip, three words (RM0090 39.1, RM0390 34.1, RM0383 24.1).
const UNIQUE_ID: &str = "0x1fff7a10";

/// How the names of serial ports of USB devices begin, on Linux and on macOS.
const PORTS: [&str; 4] = ["ttyACM", "ttyUSB", "cu.usbmodem", "cu.usbserial"];

/// Options of `cargo xtask bringup`.
#[derive(Debug, clap::Args)]
#[command(after_help = "`cargo footfall bringup --help` lists the options of footfall.")]
pub(crate) struct Options {
    /// The board that is connected, with its usual image on it: `cargo xtask flash` writes it
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// The board's serial port [default: the only one of a USB device]
    #[arg(long, value_name = "PORT")]
    serial: Option<PathBuf>,
    /// What tells this board from others of its kind [default: the unique number of the chip, by probe-rs]
    #[arg(long, value_name = "TEXT")]
    chip_id: Option<String>,
    /// Every other option goes to footfall, for example --clock-secs N, -o FILE
    #[arg(value_name = "OPTIONS OF FOOTFALL", trailing_var_arg = true, allow_hyphen_values = true)]
    footfall: Vec<OsString>,
}

/// Builds `footfall` and becomes it.
pub(crate) fn bringup(options: &Options) -> Result<ExitCode> {
    let port = match &options.serial {
        Some(port) => port.clone(),
        None => only(&ports(Path::new("/dev"))?)?,
    };
    let chip_id = match &options.chip_id {
        Some(text) => text.clone(),
        None => {
            unique_id(options.board).context("the number of the chip cannot be read; name the board with --chip-id")?
        }
    };
    let workspace = Workspace::open()?;
    let mut footfall = shell::command(workspace.footfall()?);
    footfall.current_dir(&workspace.started_in).arg("bringup").arg("--serial").arg(port);
    footfall.args(["--board", options.board.feature(), "--chip-id", &chip_id]).args(&options.footfall);
    shell::replace_with(&mut footfall)
}

/// Serial ports of USB devices in a folder, in the order of their names.
fn ports(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))?;
    let names = entries.filter_map(Result::ok).filter(|entry| {
        let name = entry.file_name();
        PORTS.iter().any(|begin| name.to_string_lossy().starts_with(begin))
    });
    let mut ports: Vec<PathBuf> = names.map(|entry| entry.path()).collect();
    ports.sort();
    Ok(ports)
}

fn only(ports: &[PathBuf]) -> Result<PathBuf> {
    match ports {
        [port] => Ok(port.clone()),
        [] => bail!("no serial port of a USB device is there; plug the adapter in, or name the port with --serial"),
        several => {
            let names: Vec<String> = several.iter().map(|port| port.display().to_string()).collect();
            bail!("several serial ports are there: {}; name one with --serial", names.join(", "))
        }
    }
}

/// The unique number of the chip, 24 hexadecimal digits.
fn unique_id(board: Board) -> Result<String> {
    probe::require()?;
    let text =
        shell::stdout_of(shell::command("probe-rs").args(["read", "--chip", board.chip(), "b32", UNIQUE_ID, "3"]))?;
    digits_of(&text)
}

/// Three words of 8 hexadecimal digits, as `probe-rs read b32` prints them, as one number.
fn digits_of(text: &str) -> Result<String> {
    let digits: String = text.split_whitespace().collect();
    ensure!(
        digits.len() == 24 && digits.bytes().all(|byte| byte.is_ascii_hexdigit()),
        "probe-rs printed `{}`; expected are three words of 8 hex digits",
        text.trim()
    );
    Ok(digits.to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_only_port_of_a_usb_device_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let add = |name: &str| std::fs::write(folder.path().join(name), "").unwrap();
        let found = || only(&ports(folder.path()).unwrap());
        add("ttyS0");
        assert!(found().unwrap_err().to_string().contains("--serial"));
        add("ttyUSB0");
        assert_eq!(found().unwrap(), folder.path().join("ttyUSB0"));
        add("ttyACM0");
        let error = found().unwrap_err().to_string();
        assert!(error.contains("ttyACM0, ") && error.contains("ttyUSB0;"), "{error}");
    }

    #[test]
    fn the_number_of_the_chip_has_three_words() {
        assert_eq!(digits_of("0032001F 31385114 36383838\n").unwrap(), "0032001f3138511436383838");
        assert!(digits_of("0032001F 31385114").is_err() && digits_of("warning: none").is_err());
    }
}
