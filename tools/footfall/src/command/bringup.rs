//! `footfall bringup`: hardware evidence of one board. A person moves a jumper wire and presses buttons as the program says; the board measures its
//! own pulses, codes, clocks and times, and the program compares them with the limits that the project states.
//!
//! | module | what it does |
//! |---|---|
//! | [`evidence`] | the file: quantities with their limits, where these are stated, and the verdict |
//! | `measured` | what follows from the records: pulses from edges, codes at both rails, the board's clock against that of this computer |
//! | `board` | the board at its serial port, which may go away with its supply |
//! | `session` | the steps |

mod board;
pub mod evidence;
mod measured;
mod session;

use clap::Args;
use firmware::board::BOARDS;
use std::fmt::Write as _;
use std::io::{self, BufReader};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::answers::lines;
use crate::board::source::Origin;
use crate::failure::Failure;
use crate::messages;
use crate::options::overwrite::Overwrite;
use crate::options::value::{number, one_of};
use crate::output;
use board::Board;
use evidence::{Evidence, Port, Verdict};
use session::Session;

/// Options of `footfall bringup`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The board's serial port: a device file
    #[arg(long, value_name = "PORT")]
    pub serial: PathBuf,
    /// What tells this board from others of its kind: the unique number of its chip, or the text of a label on it
    #[arg(long, value_name = "TEXT", value_parser = chip_id)]
    pub chip_id: String,
    /// The board, where its boot record is not to be waited for; a boot record of another board is an error
    #[arg(long, value_name = "BOARD", value_parser = one_of(BOARDS, |board| board.name))]
    pub board: Option<&'static firmware::board::Board>,
    /// Time for which the board's clock is compared with that of this computer, s
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = number(10.0..=3600.0, " seconds"))]
    pub clock_secs: f64,
    /// The file that is written [default: bringup-BOARD-ID.toml in this folder]
    #[arg(short, long, value_name = "TOML")]
    pub out: Option<PathBuf>,
    /// Whether a file may be replaced
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// The id becomes a part of a file's name.
fn chip_id(text: &str) -> Result<String, String> {
    let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"-_".contains(&byte);
    if (1..=40).contains(&text.len()) && text.bytes().all(is_allowed) {
        Ok(text.to_owned())
    } else {
        Err("allowed are 1 to 40 letters, digits, - and _".to_owned())
    }
}

/// Runs the command. Answers come from standard input, a line each. `interrupt` is set by a signal that asks it to end.
///
/// # Errors
/// Wrong input, a port that cannot be opened or is silent, or a quantity that is outside of its limits; the file is written in the last case.
pub fn run(options: &Options, interrupt: &AtomicBool) -> Result<(), Failure> {
    let named = |board: &str| PathBuf::from(format!("bringup-{board}-{}.toml", options.chip_id));
    let known = options.out.clone().or(options.board.map(|board| named(board.name)));
    if let Some(path) = &known {
        output::check(path, options.overwrite)?;
    }
    let board = Board::open(&options.serial, interrupt)?;
    let port = if Origin::Serial(options.serial.clone()).is_of_a_chip() { Port::Serial } else { Port::PseudoTerminal };
    let answers = lines(BufReader::new(io::stdin()));
    let found = Session::new(board, options.board, options.clock_secs, answers, io::stderr()).run(|board| {
        let path = known.clone().unwrap_or_else(|| named(board));
        output::check(&path, options.overwrite)
    })?;
    let evidence = Evidence::of(found, options.chip_id.clone(), port);
    let path = known.unwrap_or_else(|| named(&evidence.board));
    output::print(&summary(&evidence))?;
    output::write_text(&path, &evidence.to_toml(), options.overwrite)?;
    messages::written(&path);
    match evidence.verdict {
        Verdict::Passed | Verdict::Incomplete => Ok(()),
        Verdict::Refused => Err(Failure::run(format!("refused: {}", evidence.refused().join("; ")))),
    }
}

/// A line for each quantity, and the verdict.
fn summary(evidence: &Evidence) -> String {
    let mut text = String::new();
    for quantity in &evidence.quantities {
        // A string takes all text.
        let _ = writeln!(text, "{quantity}");
    }
    let _ = writeln!(text, "verdict: {}", evidence.verdict.name());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_a_part_of_a_file_name() {
        assert_eq!(chip_id("0032001F-3138_5"), Ok("0032001F-3138_5".into()));
        for bad in ["", "a/b", "a b", "ä", &"x".repeat(41)] {
            assert!(chip_id(bad).is_err(), "{bad}");
        }
    }
}
