//! `footfall sync`: fits another system's clock to the board's, from the edges of a line that both recorded.
//!
//! | module | what it does |
//! |---|---|
//! | [`edges`] | reads a file of edges: CSV with the header `time_s,level` |
//! | [`coded`] | pairs times where the line is a board's synchronisation output, whose pulses carry that board's time |
//! | [`paired`] | pairs times where both systems recorded the edges of any line |
//! | [`clocks`] | fits the straight line through the pairs |

pub mod clocks;
pub mod coded;
pub mod edges;
pub mod paired;

use crate::failure::Failure;
use crate::output;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Options of `footfall sync`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The edges: CSV with the header `time_s,level`. Alone: a board's coded output as another system recorded it, or another board
    #[arg(value_name = "EDGES.csv")]
    pub edges: PathBuf,
    /// The same line, any line, as the other system recorded it: EDGES.csv then has the board's clock, as `footfall record` writes it
    #[arg(long, value_name = "RECORDER_EDGES.csv")]
    pub against: Option<PathBuf>,
    /// Both files hold the line's first pulse: needed where the pulses are so regular that nothing else tells which is which
    #[arg(long, requires = "against")]
    pub first_is_first: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// A file that is no list of edges, or edges from which no relation of the clocks can be had.
pub fn run(options: &Options) -> Result<(), Failure> {
    let path = &options.edges;
    let edges::Edges { edges, notes } = edges::read(path).map_err(Failure::Input)?;
    output::notes(notes);
    let (clocks, text, more) = match &options.against {
        None => {
            let fit = coded::fit(&edges).map_err(|error| Failure::Run(format!("{}: {error}", path.display())))?;
            let (used, unused, frames, (first, last)) = (fit.used, fit.unused, fit.frames, fit.ticks);
            let text = format!("{used} pulses used, {unused} not; {frames} complete frames; ticks {first} to {last}\n");
            let more = json!({
                "pulses_used": used, "pulses_unused": unused, "frames": frames, "first_tick": first, "last_tick": last,
            });
            (fit.clocks, text, more)
        }
        Some(recorder) => {
            let edges::Edges { edges: others, notes } = edges::read(recorder).map_err(Failure::Input)?;
            output::notes(notes);
            for (path, edges) in [(path, &edges), (recorder, &others)] {
                let (most, count) = (edges::MOST_PAIRED, edges.len());
                if count > most {
                    let path = path.display();
                    return Err(Failure::input(format!(
                        "{path}: has {count} edges; allowed are up to {most}: cut the list"
                    )));
                }
            }
            let fit = paired::fit(&edges, &others, options.first_is_first)
                .map_err(|error| Failure::Run(format!("{} against {}: {error}", path.display(), recorder.display())))?;
            let (used, (board, other), (first, last)) = (fit.used, fit.unused, fit.board_s);
            let text = format!(
                "{used} pulses used; not used: {board} of the board's, {other} of the recorder's; board time {first:.3} to {last:.3} s\n"
            );
            let more = json!({
                "pulses_used": used, "pulses_unused": board + other, "board_pulses_unused": board,
                "recorder_pulses_unused": other, "first_board_s": first, "last_board_s": last,
            });
            (fit.clocks, text, more)
        }
    };
    output::print(&if options.json { format!("{}\n", clocks.with(more)) } else { clocks.as_text() + &text })
}
