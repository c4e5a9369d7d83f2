//! A board at a debug probe: its parameter sectors are read and written with probe-rs.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};

use crate::board::Board;
use crate::missing_requirement::MissingRequirement;
use crate::shell;

/// `SECTOR_BYTES` in `firmware/src/board/mod.rs`; `tests/pins.rs` compares the two.
pub(crate) const SECTOR_BYTES: usize = 16 * 1024;

/// A parameter sector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sector {
    Generator,
    Sensors,
    Robot,
}

impl Sector {
    pub(crate) const ALL: [Self; 3] = [Self::Generator, Self::Sensors, Self::Robot];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Generator => "generator",
            Self::Sensors => "sensors",
            Self::Robot => "robot",
        }
    }

    /// Its first address, as `firmware/src/board/mod.rs` has it; `tests/pins.rs` compares the two.
    pub(crate) fn address(self) -> u32 {
        match self {
            Self::Generator => 0x0800_4000,
            Self::Sensors => 0x0800_8000,
            Self::Robot => 0x0800_C000,
        }
    }

    /// The address as probe-rs takes it.
    fn argument(self) -> String {
        format!("0x{:08x}", self.address())
    }

    /// What a board does whose sector is erased.
    pub(crate) fn when_erased(self) -> &'static str {
        match self {
            Self::Generator => "the board runs the built-in walk",
            Self::Sensors => "the board has one sensor with the published curve",
            Self::Robot => "the board gives no pulse",
        }
    }
}

/// Checks that probe-rs and a probe are there.
pub(crate) fn require() -> Result<()> {
    if shell::on_path("probe-rs").is_none() {
        return Err(MissingRequirement(
            "probe-rs is missing: install it with `cargo install probe-rs-tools --locked` (or see probe.rs), then plug the board in".to_owned(),
        )
        .into());
    }
    let output = shell::command("probe-rs").arg("list").stdin(Stdio::null()).output().context("starting probe-rs")?;
    let output_text =
        format!("{}\n{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    match no_probe(output.status.success(), &output_text) {
        Some(error) => Err(MissingRequirement(error).into()),
        None => Ok(()),
    }
}

/// Writes a file into a sector. What the sector held is gone, and the other sectors stay.
pub(crate) fn download(board: Board, sector: Sector, file: &Path) -> Result<()> {
    let mut download = shell::command("probe-rs");
    download.args(["download", "--chip", board.chip(), "--binary-format", "bin", "--base-address"]);
    done(download.arg(sector.argument()).arg(file), "probe-rs download")
}

/// Erases a sector by a download that touches all of it; `file` is written on the way.
pub(crate) fn erase(board: Board, sector: Sector, file: &Path) -> Result<()> {
    std::fs::write(file, [0xFF; SECTOR_BYTES]).with_context(|| format!("writing {}", file.display()))?;
    download(board, sector, file)
}

/// Resets the board: it runs what its flash holds.
pub(crate) fn reset(board: Board) -> Result<()> {
    done(shell::command("probe-rs").args(["reset", "--chip", board.chip()]), "probe-rs reset")
}

/// The bytes of a sector.
pub(crate) fn read(board: Board, sector: Sector) -> Result<Vec<u8>> {
    let words = (SECTOR_BYTES / 4).to_string();
    let mut read = shell::command("probe-rs");
    let text = shell::stdout_of(read.args(["read", "--chip", board.chip(), "b32", &sector.argument(), &words]))?;
    let bytes = bytes_of(&text).with_context(|| format!("reading the {} sector", sector.name()))?;
    ensure!(
        bytes.len() == SECTOR_BYTES,
        "probe-rs read {} bytes of the {} sector; expected are {SECTOR_BYTES}",
        bytes.len(),
        sector.name()
    );
    Ok(bytes)
}

/// The bytes of a list of 32 bit words in hex, as `probe-rs read b32` prints it.
pub(crate) fn bytes_of(text: &str) -> Result<Vec<u8>> {
    let word = |word: &str| {
        ensure!(word.len() == 8, "`{word}` is no word of 8 hex digits");
        let number = u32::from_str_radix(word, 16).with_context(|| format!("`{word}` is no word of 8 hex digits"))?;
        Ok(number.to_le_bytes())
    };
    text.split_whitespace().map(word).collect::<Result<Vec<_>>>().map(|words| words.concat())
}

/// Runs a command that must succeed.
pub(crate) fn done(command: &mut Command, name: &str) -> Result<()> {
    let status = command.status().with_context(|| format!("starting {name}"))?;
    ensure!(status.success(), "{name} ended with {status}");
    Ok(())
}

/// Why there is no probe, in one line, from the output of `probe-rs list`; `None` if there is one.
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

    #[test]
    fn words_are_little_endian_bytes() {
        assert_eq!(bytes_of("4b574646 00000001\nffffffff\n").unwrap(), *b"FFWK\x01\0\0\0\xFF\xFF\xFF\xFF");
        assert!(bytes_of("4b574646 0x01").unwrap_err().to_string().contains("`0x01`"));
        assert!(bytes_of("warning: ").is_err());
    }
}
