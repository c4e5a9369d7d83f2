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

/// Registers of the flash interface for the option bytes (RM0090 3.9.3, 3.9.6; RM0390 3.8.3, 3.8.6).
const FLASH_OPTKEYR: u32 = 0x4002_3C08;
const FLASH_OPTCR: u32 = 0x4002_3C14;

/// The writes that set the brown-out reset to its highest level, where `optcr` says that it is off: the two keys, the new option bytes, the start
/// of their programming, the lock. Nothing else in the option bytes changes.
fn brown_out_writes(optcr: u32) -> Option<[(u32, u32); 5]> {
    /// BOR_LEV, 3 is off.
    const BOR_LEV: u32 = 3 << 2;
    const OPTSTRT: u32 = 2;
    const OPTLOCK: u32 = 1;
    let new = optcr & !(BOR_LEV | OPTSTRT | OPTLOCK);
    let [key, other_key] = [0x0819_2A3B, 0x4C5D_6E7F].map(|key| (FLASH_OPTKEYR, key));
    (optcr & BOR_LEV == BOR_LEV).then_some([
        key,
        other_key,
        (FLASH_OPTCR, new),
        (FLASH_OPTCR, new | OPTSTRT),
        (FLASH_OPTCR, new | OPTLOCK),
    ])
}

/// Switches the brown-out reset on in the option bytes, if it is off. probe-rs has no command for option bytes: this writes the registers of the
/// flash interface.
pub(crate) fn set_brown_out_reset(board: Board) -> Result<()> {
    let word = |address: u32| format!("0x{address:08x}");
    let optcr = || -> Result<u32> {
        let mut read = shell::command("probe-rs");
        let text = shell::stdout_of(read.args(["read", "--chip", board.chip(), "b32", &word(FLASH_OPTCR), "1"]))?;
        let bytes = bytes_of(&text).context("reading FLASH_OPTCR")?;
        let bytes = bytes.try_into().ok().context("reading FLASH_OPTCR: not one word")?;
        Ok(u32::from_le_bytes(bytes))
    };
    let Some(writes) = brown_out_writes(optcr()?) else { return Ok(()) };
    for (address, value) in writes {
        let mut write = shell::command("probe-rs");
        write.args(["write", "--chip", board.chip(), "b32", &word(address), &word(value)]);
        done(&mut write, "probe-rs write")?;
    }
    ensure!(
        brown_out_writes(optcr()?).is_none(),
        "the brown-out reset is still off in the option bytes, and the board will not arm; set it with another tool, for example \
         `STM32_Programmer_CLI -c port=SWD -ob BOR_LEV=0`"
    );
    eprintln!("option bytes: the brown-out reset is on now, at its highest level");
    Ok(())
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
fn bytes_of(text: &str) -> Result<Vec<u8>> {
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
    fn only_the_level_of_the_brown_out_reset_changes() {
        // As delivered: OPTLOCK, BOR off, watchdog by hardware off, no protection.
        let writes = brown_out_writes(0x0FFF_AAED).unwrap();
        assert_eq!(writes.map(|(_, value)| value), [0x0819_2A3B, 0x4C5D_6E7F, 0x0FFF_AAE0, 0x0FFF_AAE2, 0x0FFF_AAE1]);
        assert_eq!(writes.map(|(address, _)| address & 0xFF), [0x08, 0x08, 0x14, 0x14, 0x14]);
        // Any level that is on stays, and so does a protected chip's.
        assert!([0x0FFF_AAE1, 0x0FFF_AAE5, 0x0FFF_AAE9].into_iter().all(|optcr| brown_out_writes(optcr).is_none()));
        assert_eq!(brown_out_writes(0x0FFE_55ED).unwrap()[2].1, 0x0FFE_55E0);
    }

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
