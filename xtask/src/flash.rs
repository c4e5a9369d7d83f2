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
/// `ROBOT_SECTOR` in the same file.
const ROBOT_SECTOR: &str = "0x0800c000";
/// `SECTOR_BYTES` in the same file.
const SECTOR_BYTES: usize = 16 * 1024;

/// What a sector gets.
enum Content {
    /// The record that `footfall pack` makes with these arguments.
    Record(Vec<OsString>),
    /// The record of the default robot.
    DefaultRobot,
    /// Nothing: it is erased.
    Erased {
        /// What the board runs then.
        built_in: &'static str,
    },
}

/// Options of `cargo xtask flash`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The board that is connected
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Write a generator's parameters into the board's first parameter sector [default: erase it; the board runs the built-in walk]
    #[arg(long, value_name = "TOML")]
    generator: Option<PathBuf>,
    /// Write the sensors into the second: for each its joint and its calibration, from channel 1 on, up to four [default: erase it; the
    /// board has one sensor with the published curve]
    #[arg(long, value_name = "JOINT[=TOML]")]
    sensor: Vec<String>,
    /// Write the robot into the third: servos, limits, park pose [default: the default robot]
    #[arg(long, value_name = "TOML")]
    robot: Option<PathBuf>,
    /// Keep the parameter sectors that no option names, whoever's they are
    #[arg(long)]
    keep: bool,
    /// Shadow mode: run everything, drive nothing
    #[arg(long)]
    shadow: bool,
}

impl Options {
    /// The sectors that are written, each with its name and address, and the names of those that are kept.
    fn sectors(&self) -> (Vec<(&'static str, &'static str, Content)>, Vec<&'static str>) {
        let generator = self.generator.as_ref().map(|file| vec![file.into()]);
        let sensors = self.sensor.iter().flat_map(|sensor| ["--sensor".into(), sensor.into()]).collect();
        let sensors: Option<Vec<OsString>> = (!self.sensor.is_empty()).then_some(sensors);
        let robot = self.robot.as_ref().map(|file| vec!["--robot".into(), file.into()]);
        let (mut written, mut kept) = (Vec::new(), Vec::new());
        for (name, address, given, otherwise) in [
            ("generator", GENERATOR_SECTOR, generator, Content::Erased { built_in: "the built-in walk" }),
            ("sensors", SENSORS_SECTOR, sensors, Content::Erased { built_in: "one sensor with the published curve" }),
            ("robot", ROBOT_SECTOR, robot, Content::DefaultRobot),
        ] {
            match given {
                Some(pack) => written.push((name, address, Content::Record(pack))),
                None if self.keep => kept.push(name),
                None => written.push((name, address, otherwise)),
            }
        }
        (written, kept)
    }
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
    // Each sector is a download of its own: that of the program does not erase them.
    let (written, kept) = options.sectors();
    for (name, address, content) in written {
        download(&workspace, board, name, address, &content)?;
    }
    for name in kept {
        eprintln!("{name} sector: kept as it is");
    }
    shell::replace_with(shell::command("probe-rs").args(["run", "--chip", board.chip()]).arg(image.elf))
}

/// Makes the content of a sector and writes it.
fn download(workspace: &Workspace, board: Board, name: &str, sector: &str, content: &Content) -> Result<()> {
    let packed = workspace.target_dir.join("images").join(name).with_extension("bin");
    let pack = |arguments: &[OsString]| {
        let mut footfall = shell::command(workspace.footfall()?);
        footfall.current_dir(&workspace.started_in).arg("pack").args(arguments);
        done(footfall.arg("--force").arg("--out").arg(&packed), "footfall pack")
    };
    match content {
        Content::Record(arguments) => pack(arguments)?,
        Content::DefaultRobot => {
            eprintln!("{name} sector: the default robot; --robot writes another, --keep keeps what is there");
            let file = packed.with_extension("toml");
            let text = shell::stdout_of(shell::command(workspace.footfall()?).args(["defaults", "robot"]))?;
            std::fs::write(&file, text).with_context(|| format!("writing {}", file.display()))?;
            pack(&["--robot".into(), file.into()])?;
        }
        Content::Erased { built_in } => {
            eprintln!("{name} sector: erased, the board runs {built_in}; --keep keeps it");
            // A download erases each sector that it touches.
            std::fs::write(&packed, [0xFF; SECTOR_BYTES]).with_context(|| format!("writing {}", packed.display()))?;
        }
    }
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
    use clap::Parser;

    /// Nothing of an earlier person stays on a board, unless it is asked for.
    #[test]
    fn a_sector_without_an_option_is_erased_or_kept() {
        let sectors = |words: &str| -> Vec<String> {
            let words = std::iter::once("flash").chain(words.split_whitespace());
            let (written, kept) = Parsed::try_parse_from(words).unwrap().options.sectors();
            let written = written.into_iter().map(|(name, address, content)| match content {
                Content::Record(pack) => format!("{name} {address} {}", pack.join(" ".as_ref()).to_string_lossy()),
                Content::Erased { .. } => format!("{name} {address} erased"),
                Content::DefaultRobot => format!("{name} {address} default"),
            });
            written.chain(kept.into_iter().map(|name| format!("{name} kept"))).collect()
        };
        let default = ["generator 0x08004000 erased", "sensors 0x08008000 erased", "robot 0x0800c000 default"];
        assert_eq!(sectors(""), default);
        assert_eq!(sectors("--keep"), ["generator kept", "sensors kept", "robot kept"]);
        assert_eq!(sectors("--generator g.toml")[..2], ["generator 0x08004000 g.toml", default[1]]);
        assert_eq!(sectors("--robot r.toml --keep")[0], "robot 0x0800c000 --robot r.toml");
        let two = "--keep --sensor left_hip=h.toml --sensor left_knee";
        assert_eq!(sectors(two)[0], "sensors 0x08008000 --sensor left_hip=h.toml --sensor left_knee");
    }

    /// The options as a command line.
    #[derive(clap::Parser)]
    struct Parsed {
        #[command(flatten)]
        options: Options,
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
}
