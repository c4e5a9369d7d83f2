//! `cargo xtask watch` and `cargo xtask record`: a connected board, shown live or recorded: by probe-rs, by the server of another debug probe's
//! program, or through its serial port.
//!
//! The records of a board are bytes, in RTT channel 1. `probe-rs attach` prints them as text, which they are not; only the program `cargo embed` of the same package
//! gives them as they are, to a socket that it connects to. It shows a screen of its own and wants a terminal for it: it gets a pseudo-terminal that nobody sees.

use std::ffi::OsString;
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result};

use crate::board::{Board, Variant};
use crate::probe;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

#[cfg(unix)]
mod hidden_terminal;

/// Options of `cargo xtask watch` and `cargo xtask record`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "`cargo footfall watch --help` and `cargo footfall record --help` list the options of footfall."
)]
pub(crate) struct Options {
    /// The board that is connected, with this image on it: `cargo xtask flash` writes it
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    #[command(flatten)]
    variant: Variant,
    /// Without probe-rs: the board's serial port
    #[arg(long, value_name = "PORT", conflicts_with = "rtt")]
    serial: Option<PathBuf>,
    /// Without probe-rs: the RTT server of OpenOCD or J-Link, tcp:HOST:PORT, or a file with the raw bytes
    #[arg(long, value_name = "SOURCE")]
    rtt: Option<OsString>,
    /// Every other option goes to footfall, for example --json, --secs N, -o FILE
    #[arg(value_name = "OPTIONS OF FOOTFALL", trailing_var_arg = true, allow_hyphen_values = true)]
    footfall: Vec<OsString>,
}

/// What `footfall` does with the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Use {
    Watch,
    Record,
}

impl Use {
    fn command(self) -> &'static str {
        match self {
            Self::Watch => "watch",
            Self::Record => "record",
        }
    }

    /// Whether `footfall` takes the ELF file, for the head of a capture.
    fn names_elf(self) -> bool {
        self == Self::Record
    }
}

/// Builds what is needed and becomes `footfall`, or runs it behind probe-rs.
pub(crate) fn live(options: &Options, used: Use) -> Result<ExitCode> {
    let probe = options.serial.is_none() && options.rtt.is_none();
    if probe && let Err(missing) = probe::require() {
        eprintln!("{}", other_ways(options.board, used));
        return Err(missing);
    }
    let mut workspace = Workspace::open()?;
    let elf = if probe || used.names_elf() {
        workspace.set_up(&[Need::BoardCompiler])?;
        let image = workspace.firmware(options.board, options.variant)?;
        eprintln!("image: {}, {}", image.elf.display(), image.footprint);
        Some(image.elf)
    } else {
        None
    };
    let footfall = workspace.footfall()?;
    let command = |source: &str, of: OsString| {
        let mut command = shell::command(&footfall);
        command.current_dir(&workspace.started_in).arg(used.command()).arg(source).arg(of);
        if let Some(elf) = elf.as_ref().filter(|_| used.names_elf()) {
            command.arg("--elf").arg(elf);
        }
        command.args(&options.footfall);
        command
    };
    match (&options.serial, &options.rtt, &elf) {
        (Some(port), ..) => shell::replace_with(&mut command("--serial", port.into())),
        (None, Some(source), _) => shell::replace_with(&mut command("--rtt", source.clone())),
        (None, None, Some(elf)) => {
            let address = free_address()?;
            let footfall = command("--rtt", format!("tcp-listen:{address}").into());
            behind_probe_rs(options.board, elf, &address, &workspace.target_dir.join("board"), footfall)
        }
        (None, None, None) => anyhow::bail!("there is no image"),
    }
}

/// An address on this computer that no program listens at.
fn free_address() -> Result<String> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).context("looking for a free port")?;
    Ok(listener.local_addr().context("looking for a free port")?.to_string())
}

/// Settings of `cargo embed` that neither write nor reset the board, and give the bytes of channel 1 to a program that listens at the address.
///
/// Both channels keep the mode in which the firmware never waits: with the mode that probe-rs sets by itself (block if full) channel 1 is silent.
fn embed_settings(board: Board, address: &str) -> String {
    format!(
        "[default.general]
chip = \"{}\"
[default.flashing]
enabled = false
[default.reset]
enabled = false
[default.rtt]
enabled = true
timeout = 10000
up_channels = [
    {{ channel = 0, mode = \"NoBlockSkip\", format = \"Defmt\" }},
    {{ channel = 1, mode = \"NoBlockSkip\", format = \"BinaryLE\", socket = \"{address}\" }},
]
tabs = [{{ up_channel = 0 }}, {{ up_channel = 1, hide = true }}]
",
        board.chip()
    )
}

/// Runs `footfall`, which listens at the address, and `cargo embed`, which gives it the records. The board is neither written nor reset.
#[cfg(unix)]
fn behind_probe_rs(board: Board, elf: &Path, address: &str, folder: &Path, mut footfall: Command) -> Result<ExitCode> {
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    let settings = folder.join("embed.toml");
    std::fs::write(&settings, embed_settings(board, address))
        .with_context(|| format!("writing {}", settings.display()))?;
    eprintln!(
        "attaching halts the chip for some milliseconds: attach before you arm, a walking board may be reset by its watchdog"
    );
    let mut embed = probe::embed(&settings, elf)?;
    embed.current_dir(folder);
    let mut running = footfall.spawn().context("starting footfall")?;
    let embed = hidden_terminal::Hidden::start(&mut embed);
    let status = match &embed {
        Ok(_) => running.wait().context("waiting for footfall"),
        Err(_) => running.kill().and_then(|()| running.wait()).context("ending footfall"),
    };
    let said = embed?.end()?;
    let status = status?;
    if !status.success() {
        for line in &said {
            eprintln!("probe-rs: {line}");
        }
    }
    eprintln!("{}", probe::POWER_CYCLE);
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}

/// Elsewhere there is no pseudo-terminal for `cargo embed`.
#[cfg(not(unix))]
fn behind_probe_rs(board: Board, _: &Path, _: &str, _: &Path, footfall: Command) -> Result<ExitCode> {
    let command = footfall.get_args().next().and_then(|name| name.to_str()).map(str::to_owned);
    let used = if command.as_deref() == Some("record") { Use::Record } else { Use::Watch };
    eprintln!("{}", other_ways(board, used));
    anyhow::bail!("on this system the records do not come through probe-rs: use another way")
}

/// The commands that do the same without probe-rs.
fn other_ways(board: Board, used: Use) -> String {
    let (name, command) = (board.feature(), used.command());
    // Without package and temperature range: STM32F407VG of STM32F407VGTx.
    let jlink = &board.chip()[..board.chip().len() - 2];
    format!(
        "without probe-rs:\n  \
         through the serial port:  cargo xtask {command} --board {name} --serial /dev/ttyACM0\n  \
         with OpenOCD:  openocd -f interface/stlink.cfg -f target/stm32f4x.cfg -c init -c 'rtt setup 0x20000000 0x20000 \"SEGGER RTT\"' \
         -c 'rtt start' -c 'rtt server start 9090 1'\n                 \
         and beside it:  cargo xtask {command} --board {name} --rtt tcp:localhost:9090\n  \
         with J-Link:   JLinkExe -device {jlink} -if SWD -speed 4000 -autoconnect 1\n                 \
         and beside it:  cargo xtask {command} --board {name} --rtt jlink:localhost:19021"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Parsed {
        #[command(flatten)]
        options: Options,
    }

    #[test]
    fn options_of_footfall_keep_their_order() {
        let words = "watch --board nucleo-f446re --shadow --json --secs 3";
        let options = Parsed::try_parse_from(words.split(' ')).unwrap().options;
        assert_eq!((options.board, options.variant), (Board::NucleoF446re, Variant::SHADOW));
        assert_eq!(options.footfall, ["--json", "--secs", "3"]);
        assert!(Parsed::try_parse_from(["watch", "--serial", "a", "--rtt", "b"]).is_err());
    }

    #[test]
    fn the_other_ways_name_board_and_command() {
        let text = other_ways(Board::NucleoF446re, Use::Record);
        for words in
            ["cargo xtask record --board nucleo-f446re --serial", "rtt server start 9090 1", "-device STM32F446RE "]
        {
            assert!(text.contains(words), "{text}");
        }
    }
}
