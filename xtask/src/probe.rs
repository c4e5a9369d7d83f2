//! A board at a debug probe: its parameter sectors are read and written, and its program started, with probe-rs.
//!
//! **What attaching does.** Each start of probe-rs halts the core twice, for some 10 to 40 ms behind an ST-LINK: once to clear the break points, once more at its
//! end. The firmware freezes its watchdog with the core while the servo outputs are off; from an arming on it does not, so attaching to a walking board may
//! reset it. No command of probe-rs can ask anything before it has halted the core. So what reads or writes a board at rest does one short read first
//! ([`require_outputs_off`]), and goes no further when the outputs are on.
//!
//! **What stays.** When probe-rs has ended, debugging stays enabled in the chip (C_DEBUGEN) until its supply is switched off.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};

use crate::board::Board;
use crate::missing_requirement::MissingRequirement;
use crate::shell;

/// The least version of probe-rs: `read` writes files since this one, and its options are read in its source.
pub(crate) const LEAST_VERSION: [u32; 3] = [0, 32, 0];

/// The command that installs it.
pub(crate) const INSTALL: &str = "cargo install probe-rs-tools --locked --version 0.32.0";

/// The variable that names the folder of probe-rs and cargo-embed.
pub(crate) const FOLDER: &str = "FOOTFALL_PROBE_RS";

/// The variable by which probe-rs itself takes a probe that it cannot list, such as a virtual board.
const PROBE: &str = "PROBE_RS_PROBE";

/// The variable from which probe-rs takes the protocol.
const PROTOCOL: &str = "PROBE_RS_PROTOCOL";

/// Without these options `run` and `attach` set vector catches that outlast them: then a fault halts the core before its handler switches the outputs off, and a
/// reset does not boot.
pub(crate) const NO_CATCHES: [&str; 4] =
    ["--no-catch-reset", "--no-catch-hardfault", "--no-catch-svc", "--no-catch-hlt"];

/// What is said before a log that the user ends.
pub(crate) const END: &str =
    "Ctrl-C ends the log and the program runs on, but stop a walk first: the end halts the chip for some milliseconds";

/// What is said where probe-rs was connected with a board.
pub(crate) const POWER_CYCLE: &str = "Debugging stays enabled in the chip until its supply is switched off and on: do so before you rely on the board alone";

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
            Self::Robot => "the board runs the built-in robot, and warns of it",
        }
    }
}

/// Checks that probe-rs and a probe are there.
pub(crate) fn require() -> Result<()> {
    let program = program("probe-rs")?;
    // A probe by name, as of a virtual board, is in no list.
    if std::env::var_os(PROBE).is_some_and(|name| !name.is_empty()) {
        return Ok(());
    }
    let output = shell::command(program).arg("list").stdin(Stdio::null()).output().context("starting probe-rs")?;
    let [listed, said] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    match no_probe(output.status.success(), &listed, &said) {
        Some(error) => Err(MissingRequirement(error).into()),
        None => Ok(()),
    }
}

/// A command of probe-rs, with SWD, which each board's debug connector has. At a Black Magic Probe probe-rs asks for a protocol.
pub(crate) fn probe_rs() -> Result<Command> {
    let mut command = shell::command(program("probe-rs")?);
    if std::env::var_os(PROTOCOL).is_none_or(|name| name.is_empty()) {
        command.env(PROTOCOL, "swd");
    }
    Ok(command)
}

/// The path of `probe-rs` or `cargo-embed`, which one package has: in the folder that FOOTFALL_PROBE_RS names, on PATH, or where `cargo xtask setup --with
/// probe` has installed it.
pub(crate) fn program(name: &str) -> Result<PathBuf> {
    Ok(installed(name).map_err(MissingRequirement)?)
}

/// The same, with the reason in one line where there is none.
pub(crate) fn installed(name: &str) -> Result<PathBuf, String> {
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let named = std::env::var_os(FOLDER).filter(|folder| !folder.is_empty());
    let candidates = match &named {
        Some(folder) => vec![Path::new(folder).join(&file)],
        None => shell::on_path(name).into_iter().chain([tools_folder().join("bin").join(&file)]).collect(),
    };
    let mut older = None;
    for path in candidates.into_iter().filter(|path| path.is_file()) {
        let answer = shell::stdout_of(shell::command(&path).arg("--version")).unwrap_or_default();
        match version(&answer) {
            Some(version) if version >= LEAST_VERSION => return Ok(path),
            Some([major, minor, patch]) => {
                older = Some(format!("is {major}.{minor}.{patch}, at least 0.32.0 is needed"))
            }
            None => older = Some("says no version".to_owned()),
        }
    }
    let what = older.unwrap_or_else(|| "is missing".to_owned());
    Err(format!("{name} {what}: install it with `{INSTALL}`, or with `cargo xtask setup --with probe`"))
}

/// Where `cargo xtask setup --with probe` installs: the `--root` of its `cargo install`.
pub(crate) fn tools_folder() -> PathBuf {
    let manifest = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    Path::new(&manifest).with_file_name("target").join("tools").join("probe-rs")
}

/// The version in what a program of the package says: `probe-rs 0.32.0 (git commit: crates.io)`, `cargo embed 0.32.0 (git commit: crates.io)`.
fn version(said: &str) -> Option<[u32; 3]> {
    let number = |word: &str| {
        let parts: Vec<u32> = word.split('-').next()?.split('.').map(str::parse).collect::<Result<_, _>>().ok()?;
        parts.try_into().ok()
    };
    said.split_whitespace().find_map(number)
}

/// The command that writes an image into a board's flash, starts it and shows its log, until it is ended. `wire` has records for programs, and is not shown.
pub(crate) fn run(chip: &str, elf: &Path) -> Result<Command> {
    let mut run = probe_rs()?;
    run.args(["run", "--chip", chip]).args(NO_CATCHES).args(["--rtt-up-channels", "0"]).arg(elf);
    Ok(run)
}

/// The command that shows the channels of a running board as `cargo embed` does, with these settings. `probe-rs` has that program in itself.
#[cfg(unix)]
pub(crate) fn embed(settings: &Path, elf: &Path) -> Result<Command> {
    let mut embed = probe_rs()?;
    embed.args(["cargo-embed", "--disable-progressbars", "--config-file"]).arg(settings).arg("--path").arg(elf);
    // It does not read this variable by itself, and finds a probe at a network address only by the numbers of the Black Magic Probe.
    if let Some(probe) = std::env::var(PROBE).ok().filter(|name| !name.is_empty()) {
        let at_address = probe.strip_prefix("0:0:").map(|address| format!("1d50:6018:{address}"));
        embed.arg("--probe").arg(at_address.unwrap_or(probe));
    }
    Ok(embed)
}

/// Refuses a board whose servo outputs are on, by one short read.
pub(crate) fn require_outputs_off(board: Board, folder: &Path) -> Result<()> {
    /// TIM1_BDTR, and in it MOE: the outputs are on (RM0090 17.4.18).
    const BREAK_AND_DEAD_TIME: u32 = 0x4001_0044;
    const MAIN_OUTPUT_ENABLE: u32 = 1 << 15;
    let register = read_word(board, BREAK_AND_DEAD_TIME, folder)?;
    ensure!(
        register & MAIN_OUTPUT_ENABLE == 0,
        "the board's servo outputs are on: stop the walk first. Attaching has halted the chip for some milliseconds, and its watchdog may have reset it"
    );
    Ok(())
}

/// Writes a file into a sector. What the sector held is gone, and the other sectors stay.
pub(crate) fn download(board: Board, sector: Sector, file: &Path) -> Result<()> {
    let mut download = probe_rs()?;
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
    done(probe_rs()?.args(["reset", "--chip", board.chip()]), "probe-rs reset")
}

/// The bytes of the three sectors, which lie side by side, in one session.
pub(crate) fn read_sectors(board: Board, folder: &Path) -> Result<[Vec<u8>; 3]> {
    let bytes = read(board, Sector::Generator.address(), 3 * SECTOR_BYTES, folder)?;
    Ok([0, 1, 2].map(|sector| bytes[sector * SECTOR_BYTES..(sector + 1) * SECTOR_BYTES].to_vec()))
}

/// A word of the chip's memory.
pub(crate) fn read_word(board: Board, address: u32, folder: &Path) -> Result<u32> {
    let bytes = read(board, address, 4, folder)?;
    Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
}

/// So many bytes from an address on, both multiples of 4. They go through a file in `folder`: what probe-rs prints is for people, and changes with its version.
pub(crate) fn read(board: Board, address: u32, bytes: usize, folder: &Path) -> Result<Vec<u8>> {
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    let file = folder.join("read.bin");
    let mut read = probe_rs()?;
    read.args(["read", "--chip", board.chip(), "b32", &format!("0x{address:08x}"), &(bytes / 4).to_string()]);
    read.args(["--format", "binary", "--output"]).arg(&file);
    // Its messages are shown if it fails: without a USB bus it warns a lot.
    shell::stdout_of(&mut read)?;
    let content = std::fs::read(&file).with_context(|| format!("reading {}", file.display()))?;
    ensure!(
        content.len() == bytes,
        "probe-rs read {} bytes from {address:#010x} on; expected are {bytes}",
        content.len()
    );
    Ok(content)
}

/// Runs a command that must succeed.
pub(crate) fn done(command: &mut Command, name: &str) -> Result<()> {
    let status = command.status().with_context(|| format!("starting {name}"))?;
    ensure!(status.success(), "{name} ended with {status}");
    Ok(())
}

/// Why there is no probe, in one line, from what `probe-rs list` writes to its two streams; `None` if there is one that can be used.
fn no_probe(succeeded: bool, listed: &str, said: &str) -> Option<String> {
    let probes: Vec<&str> = listed.lines().map(str::trim).filter(|line| line.starts_with('[')).collect();
    let first = listed.lines().chain(said.lines()).map(str::trim).find(|line| !line.is_empty());
    match probes.as_slice() {
        _ if !succeeded => Some(format!("probe-rs cannot list the probes: {}", first.unwrap_or("it wrote nothing"))),
        [] => Some(format!(
            "no probe found: plug the board's ST-LINK socket in (on Linux, probe-rs also wants its udev rules: {UDEV})"
        )),
        all if all.iter().all(|line| line.ends_with("(inaccessible)")) => Some(format!(
            "no permission for the probe `{}`: install the udev rules of probe-rs ({UDEV}), then unplug it and plug it in again",
            all[0].trim_end_matches("(inaccessible)").trim()
        )),
        _ => None,
    }
}

/// Where the udev rules are, and what to do with them.
const UDEV: &str = "https://probe.rs/docs/getting-started/probe-setup/";

#[cfg(test)]
mod tests {
    use super::*;

    /// What 0.32.0 writes, `src/bin/probe-rs/cmd/list.rs`.
    #[test]
    fn a_listed_probe_is_enough() {
        let listed = "The following debug probes were found:\n[0]: STLink V2 -- 0483:3748:0668FF (ST-LINK)\n";
        assert_eq!(no_probe(true, listed, ""), None);
        let two = format!("{listed}[1]: J-Link -- 1366:0101:0001 (J-Link) (inaccessible)\n");
        assert_eq!(no_probe(true, &two, ""), None);
    }

    #[test]
    fn no_probe_is_reported_in_one_line() {
        let inaccessible =
            "The following debug probes were found:\n[0]: STLink V2 -- 0483:3748:0668FF (ST-LINK) (inaccessible)\n";
        for (succeeded, listed, said, word) in [
            (true, "No debug probes were found.\n", " WARN probe_rs: If your probe is plugged in\n", "plug"),
            (true, "", "", "plug"),
            (
                true,
                inaccessible,
                " WARN probe_rs: If your probe is plugged in\n",
                "udev rules of probe-rs (https://probe.rs/",
            ),
            (true, inaccessible, "", "`[0]: STLink V2 -- 0483:3748:0668FF (ST-LINK)`"),
            (false, "", "\nError: cannot open libusb\n  caused by: more\n", "cannot open libusb"),
            (false, "", "", "wrote nothing"),
        ] {
            let line = no_probe(succeeded, listed, said).unwrap();
            assert!(line.contains(word) && !line.contains('\n'), "{line}");
        }
    }

    #[test]
    fn versions_are_compared_as_numbers() {
        assert_eq!(version("probe-rs 0.32.0 (git commit: crates.io)\n"), Some([0, 32, 0]));
        assert_eq!(version("cargo embed 1.0.0-rc.1 (git commit: crates.io)"), Some([1, 0, 0]));
        assert!(version("probe-rs 0.31.0").unwrap() < LEAST_VERSION);
        assert!(version("probe-rs 0.100.1").unwrap() > LEAST_VERSION);
        for unknown in ["", "probe-rs", "probe-rs x.y.z", "probe-rs 0.32"] {
            assert_eq!(version(unknown), None, "{unknown}");
        }
    }
}
