//! `cargo xtask watch` and `cargo xtask record`: a connected board, shown live or recorded: by probe-rs, by the server of another debug probe's
//! program, or through its serial port.

use std::ffi::OsString;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use crate::board::{Board, Variant};
use crate::probe;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// How long probe-rs may take for its end.
const PROBE_ENDS_WITHIN: Duration = Duration::from_secs(3);

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

    /// Whether `footfall` takes the ELF file with this source.
    fn names_elf(self, source: &str) -> bool {
        self == Self::Record || source == "--rtt"
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
    let elf = if probe || used.names_elf(if options.rtt.is_some() { "--rtt" } else { "--serial" }) {
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
        if let Some(elf) = elf.as_ref().filter(|_| used.names_elf(source)) {
            command.arg("--elf").arg(elf);
        }
        command.args(&options.footfall);
        command
    };
    match (&options.serial, &options.rtt, &elf) {
        (Some(port), ..) => shell::replace_with(&mut command("--serial", port.into())),
        (None, Some(source), _) => shell::replace_with(&mut command("--rtt", source.clone())),
        (None, None, Some(elf)) => {
            let log = workspace.target_dir.join("board").join("probe-rs.log");
            behind_probe_rs(options.board, elf, &log, command("--rtt-lines", "-".into()))
        }
        (None, None, None) => anyhow::bail!("there is no image"),
    }
}

/// Runs `footfall` on what probe-rs prints. The board is neither flashed nor reset.
fn behind_probe_rs(board: Board, elf: &Path, log: &Path, mut footfall: Command) -> Result<ExitCode> {
    if let Some(folder) = log.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    }
    // On the screen its messages would be in the way.
    let messages = File::create(log).with_context(|| format!("writing {}", log.display()))?;
    let mut probe = shell::command("probe-rs")
        .args(["attach", "--chip", board.chip(), "--log-format", "{L} {s}"])
        .arg(elf)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(messages)
        .spawn()
        .context("starting probe-rs")?;
    let lines = probe.stdout.take().context("no standard output of probe-rs")?;
    let status = footfall.stdin(lines).status().context("starting footfall");
    // Its pipe is closed when this command is gone.
    drop(footfall);
    end(&mut probe)?;
    let status = status?;
    if !status.success() {
        let said = std::fs::read_to_string(log).unwrap_or_default();
        let lines: Vec<&str> = said.lines().filter(|line| !line.trim().is_empty()).collect();
        for line in &lines[lines.len().saturating_sub(5)..] {
            eprintln!("probe-rs: {line}");
        }
    }
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}

/// Asks a program to end, and kills it where it does not.
fn end(child: &mut Child) -> Result<()> {
    let until = Instant::now() + PROBE_ENDS_WITHIN;
    if cfg!(unix) {
        // It leaves the probe in order. A failure shows below: then it is killed.
        let _ = shell::command("kill").args(["-TERM", &child.id().to_string()]).stderr(Stdio::null()).status();
    }
    while child.try_wait().context("waiting for probe-rs")?.is_none() {
        if Instant::now() >= until {
            child.kill().context("ending probe-rs")?;
            child.wait().context("waiting for probe-rs")?;
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    Ok(())
}

/// The commands that do the same without probe-rs.
fn other_ways(board: Board, used: Use) -> String {
    let (name, command) = (board.feature(), used.command());
    let jlink = board.chip().trim_end_matches("Tx");
    format!(
        "without probe-rs:\n  \
         through the serial port:  cargo xtask {command} --board {name} --serial /dev/ttyACM0\n  \
         with OpenOCD:  openocd -f interface/stlink.cfg -f target/stm32f4x.cfg -c init -c 'rtt setup 0x20000000 0x20000 \"SEGGER RTT\"' \
         -c 'rtt start' -c 'rtt server start 9090 0'\n                 \
         and beside it:  cargo xtask {command} --board {name} --rtt tcp:localhost:9090\n  \
         with J-Link:   JLinkExe -device {jlink} -if SWD -speed 4000 -autoconnect 1\n                 \
         and beside it:  cargo xtask {command} --board {name} --rtt tcp:localhost:19021"
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
            ["cargo xtask record --board nucleo-f446re --serial", "rtt server start 9090 0", "-device STM32F446RE "]
        {
            assert!(text.contains(words), "{text}");
        }
    }
}
