//! `cargo xtask run-image ELF`, the runner in `.cargo/config.toml`: what `cargo run` has built for a board is sealed, written to the board and started.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};

use crate::board::Board;
use crate::image;
use crate::probe;
use crate::seal;
use crate::shell;

/// Options of `cargo xtask run-image`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The ELF file that cargo has built
    #[arg(value_name = "ELF")]
    elf: PathBuf,
    /// Every other option goes to `probe-rs run`
    #[arg(value_name = "OPTIONS OF PROBE-RS", trailing_var_arg = true, allow_hyphen_values = true)]
    probe_rs: Vec<OsString>,
}

/// Becomes `probe-rs run` with a sealed copy of the image. The parameter sectors stay as they are.
pub(crate) fn run_image(options: &Options) -> Result<ExitCode> {
    let (board, elf) = sealed(&options.elf)?;
    probe::require()?;
    eprintln!("image for {}; {}. {}", board.feature(), probe::END, probe::POWER_CYCLE);
    shell::replace_with(probe::run(board.chip(), &elf)?.args(&options.probe_rs))
}

/// Writes a sealed copy beside the image: what cargo has built stays as cargo wrote it. The copy's path, and the board.
fn sealed(built: &Path) -> Result<(Board, PathBuf)> {
    let place = || format!("in {}", built.display());
    let mut elf = std::fs::read(built).with_context(|| format!("reading {}", built.display()))?;
    let board = board_of(&elf).with_context(place)?;
    seal::seal(&mut elf).with_context(place)?;
    let copy = built.with_file_name(format!("firmware-{}-sealed.elf", board.feature()));
    std::fs::write(&copy, &elf).with_context(|| format!("writing {}", copy.display()))?;
    Ok((board, copy))
}

/// The board that the image names by a symbol (`firmware/build.rs`).
fn board_of(elf: &[u8]) -> Result<Board> {
    let names = image::board_symbols(elf)?;
    let board = |name: &String| Board::ALL.into_iter().find(|board| board.feature().replace('-', "_") == **name);
    match names.as_slice() {
        [] => bail!(
            "the program names no board, so it is no image of this firmware; start it with probe-rs itself: `probe-rs run --chip CHIP ELF`"
        ),
        [name] => board(name)
            .with_context(|| format!("the program is for the board `{name}`, which probe-rs does not start here")),
        all => bail!("the program names several boards: {}", all.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::tests::{with_segments, with_symbols};

    #[test]
    fn the_board_is_the_one_that_the_image_names() {
        for board in Board::ALL {
            let symbol = format!("__board_{}", board.feature().replace('-', "_"));
            assert_eq!(board_of(&with_symbols(&[("main", 0x0801_0001), (&symbol, 0)])).unwrap(), board);
        }
    }

    #[test]
    fn another_program_is_refused_in_words() {
        for (symbols, words) in [
            (&[("main", 0x0801_0001)][..], "names no board"),
            (&[("__board_pico", 0)], "the board `pico`"),
            (&[("__board_f4_discovery", 0), ("__board_nucleo_f446re", 0)], "several boards"),
        ] {
            let error = board_of(&with_symbols(symbols)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        assert!(board_of(&with_segments(&[])).is_err());
        assert!(board_of(b"no ELF file").is_err());
    }
}
