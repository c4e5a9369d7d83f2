//! `cargo xtask bringup`: hardware evidence of a connected board by `footfall bringup`, with what a debug probe can add: the unique number of the chip.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};

use crate::board::Board;
use crate::probe;
use crate::shell;
use crate::workspace::Workspace;

/// First address of the unique number of the chip, three words (RM0090 39.1, RM0390 34.1, RM0383 24.1).
const UNIQUE_ID: u32 = 0x1FFF_7A10;
const UNIQUE_ID_BYTES: usize = 12;

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
    let workspace = Workspace::open()?;
    let chip_id = match &options.chip_id {
        Some(text) => text.clone(),
        None => unique_id(options.board, &workspace.target_dir.join("board"))
            .context("the number of the chip cannot be read; name the board with --chip-id")?,
    };
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

/// The unique number of the chip as its three words from the lowest address on, 24 hexadecimal digits.
fn unique_id(board: Board, folder: &Path) -> Result<String> {
    probe::require()?;
    probe::require_outputs_off(board, folder)?;
    Ok(digits_of(&probe::read(board, UNIQUE_ID, UNIQUE_ID_BYTES, folder)?))
}

/// Words of four bytes, lowest byte first, as hexadecimal digits.
fn digits_of(bytes: &[u8]) -> String {
    bytes.chunks(4).flat_map(|word| word.iter().rev()).map(|byte| format!("{byte:02x}")).collect()
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
        let bytes = [0x1f, 0, 0x32, 0, 0x14, 0x51, 0x38, 0x31, 0x38, 0x38, 0x38, 0x36];
        assert_eq!(digits_of(&bytes), "0032001f3138511436383838");
    }
}
