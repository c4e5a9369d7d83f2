//! `cargo xtask flash`: writes the firmware to a board with probe-rs and shows the board's log until Ctrl-C, or writes it through the chip's
//! USB boot loader. A Raspberry Pi Pico has a family of its own: [`crate::pico`].

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};

use crate::board::{AnyBoard, Board, Variant};
use crate::dfu;
use crate::image;
use crate::option_bytes;
use crate::pico;
use crate::probe::{self, Sector};
use crate::record;
use crate::setup::Need;
use crate::shell;
use crate::workspace::Workspace;

/// What a sector gets.
enum Content {
    /// The record that `footfall pack` makes with these arguments.
    Record(Vec<OsString>),
    /// The record of the default robot.
    DefaultRobot,
    /// Nothing: it is erased.
    Erased,
}

/// Options of `cargo xtask flash`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The board that is connected
    #[arg(long, value_enum, default_value_t)]
    board: AnyBoard,
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
    #[command(flatten)]
    variant: Variant,
    /// Write through the chip's USB boot loader with dfu-util, without a probe: BOOT0 high, then reset
    #[arg(long, conflicts_with = "drive")]
    dfu: bool,
    /// Folder of the Pico's drive RPI-RP2 [default: the one that is mounted]
    #[arg(long, value_name = "FOLDER")]
    drive: Option<PathBuf>,
}

impl Options {
    /// The sectors that are written, and those that are kept.
    fn sectors(&self, board: Board) -> (Vec<(Sector, Content)>, Vec<Sector>) {
        let generator = self.generator.as_ref().map(|file| vec![file.into()]);
        let sensors = self.sensor.iter().flat_map(|sensor| ["--sensor".into(), sensor.into()]);
        // `pack` refuses a calibration that this board refuses.
        let sensors = sensors.chain(["--board".into(), board.feature().into()]).collect();
        let sensors: Option<Vec<OsString>> = (!self.sensor.is_empty()).then_some(sensors);
        let robot = self.robot.as_ref().map(|file| vec!["--robot".into(), file.into()]);
        let (mut written, mut kept) = (Vec::new(), Vec::new());
        for (sector, given, otherwise) in [
            (Sector::Generator, generator, Content::Erased),
            (Sector::Sensors, sensors, Content::Erased),
            (Sector::Robot, robot, Content::DefaultRobot),
        ] {
            match given {
                Some(pack) => written.push((sector, Content::Record(pack))),
                None if self.keep => kept.push(sector),
                None => written.push((sector, otherwise)),
            }
        }
        (written, kept)
    }
}

/// Looks for the board first: without one a build is useless.
pub(crate) fn flash(options: &Options) -> Result<ExitCode> {
    let board = match options.board {
        AnyBoard::Stm32(board) => board,
        AnyBoard::Pico => return flash_pico(options),
    };
    ensure!(options.drive.is_none(), "--drive is for the board pico, whose boot loader shows one: remove it");
    if options.dfu { dfu::require(board) } else { probe::require() }?;
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler])?;
    let image = workspace.firmware(board, options.variant)?;
    eprintln!("image: {}, {}", image.elf.display(), image.footprint);
    // Each sector is a download of its own: that of the program does not erase them.
    let (written, kept) = options.sectors(board);
    if !options.dfu {
        option_bytes::check(board, &workspace.target_dir.join("board"))?;
    }
    for (sector, content) in written {
        write(&workspace, board, options.dfu, sector, &content)?;
    }
    for sector in kept {
        eprintln!("{} sector: kept as it is", sector.name());
    }
    if !options.dfu {
        eprintln!("the board's log follows; {}. {}", probe::END, probe::POWER_CYCLE);
        return shell::replace_with(&mut probe::run(board.chip(), &image.elf)?);
    }
    let elf = std::fs::read(&image.elf).with_context(|| format!("reading {}", image.elf.display()))?;
    for part in image::flash_parts(&elf).with_context(|| format!("in {}", image.elf.display()))? {
        let file = image.elf.with_extension("bin");
        std::fs::write(&file, &part.bytes).with_context(|| format!("writing {}", file.display()))?;
        dfu::download(part.address, &file)?;
    }
    eprintln!(
        "the boot loader's tool does not set the brown-out reset, whose level the log and the live view show: set it once with a probe \
         (`cargo xtask board brown-out --board {}`), or with `STM32_Programmer_CLI -c port=USB1 -ob BOR_LEV={}`",
        board.feature(),
        option_bytes::wanted(board).field()
    );
    eprintln!("next: connect BOOT0 with GND and press reset; the board then runs the program");
    Ok(ExitCode::SUCCESS)
}

/// The Pico's boot loader is a drive, which no probe and no program is needed for.
fn flash_pico(options: &Options) -> Result<ExitCode> {
    ensure!(!options.dfu, "--dfu is for the STM32F4 boards; a Pico is written by its drive: remove it");
    let Options { generator, sensor, robot, keep, variant, drive, .. } = options;
    let image = pico::Options {
        generator: generator.clone(),
        sensor: sensor.clone(),
        robot: robot.clone(),
        keep: *keep,
        variant: *variant,
    };
    pico::flash(&image, drive.as_deref())
}

/// Makes the content of a sector and writes it.
fn write(workspace: &Workspace, board: Board, dfu: bool, sector: Sector, content: &Content) -> Result<()> {
    let name = sector.name();
    let packed = record::path_of(workspace, sector);
    match content {
        Content::Record(arguments) => record::pack(workspace, arguments, &packed)?,
        Content::DefaultRobot => {
            eprintln!("{name} sector: the default robot; --robot writes another, --keep keeps what is there");
            record::pack_default_robot(workspace, &packed)?;
        }
        Content::Erased => {
            eprintln!("{name} sector: erased, {}; --keep keeps it", sector.when_erased());
            return match dfu {
                true => dfu::erase(sector, &packed),
                false => probe::erase(board, sector, &packed),
            };
        }
    }
    match dfu {
        true => dfu::download(sector.address(), &packed),
        false => probe::download(board, sector, &packed),
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
            let (written, kept) = Parsed::try_parse_from(words).unwrap().options.sectors(Board::default());
            let written = written.into_iter().map(|(sector, content)| match content {
                Content::Record(pack) => format!("{} {}", sector.name(), pack.join(" ".as_ref()).to_string_lossy()),
                Content::Erased => format!("{} erased", sector.name()),
                Content::DefaultRobot => format!("{} default", sector.name()),
            });
            written.chain(kept.into_iter().map(|sector| format!("{} kept", sector.name()))).collect()
        };
        let default = ["generator erased", "sensors erased", "robot default"];
        assert_eq!(sectors(""), default);
        assert_eq!(sectors("--keep"), ["generator kept", "sensors kept", "robot kept"]);
        assert_eq!(sectors("--generator g.toml")[..2], ["generator g.toml", default[1]]);
        assert_eq!(sectors("--robot r.toml --keep")[0], "robot --robot r.toml");
        let two = "--keep --sensor left_hip=h.toml --sensor left_knee";
        assert_eq!(sectors(two)[0], "sensors --sensor left_hip=h.toml --sensor left_knee --board f4-discovery");
    }

    #[test]
    fn options_of_the_other_family_are_refused() {
        for (words, said) in [("--board pico --dfu", "--dfu is for"), ("--drive /media/x", "--drive is for")] {
            let words = std::iter::once("flash").chain(words.split_whitespace());
            let error = flash(&Parsed::try_parse_from(words).unwrap().options).unwrap_err().to_string();
            assert!(error.starts_with(said), "{error}");
        }
    }

    /// The options as a command line.
    #[derive(clap::Parser)]
    struct Parsed {
        #[command(flatten)]
        options: Options,
    }
}
