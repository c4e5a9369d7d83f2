//! `footfall sync`: the board's clock against another system's, from the edges of a line that both know.
//!
//! | module | what it is for |
//! |---|---|
//! | [`edges`] | a file of edges: CSV with the header `time_s,level` |
//! | [`coded`] | the line is a board's synchronisation output, whose pulses carry that board's time |
//! | [`paired`] | the line is anybody's, and the board recorded it at its input as the other system did |
//!
//! Either way pairs of the same moment on both clocks come out of it, and through them a straight line:
//! ```text
//! recorder time = offset + (1 + drift) board time
//! ```

pub mod coded;
pub mod edges;
pub mod paired;

use crate::failure::Failure;
use clap::Args;
use serde_json::{Map, Value, json};
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

/// A straight line from the board's clock to the recorder's, and what it leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clocks {
    /// Recorder time at board time 0, s.
    pub offset_s: f64,
    /// How much faster the recorder's clock runs, parts per million.
    pub drift_ppm: f64,
    /// Root mean square of what the line leaves, s.
    pub rms_s: f64,
    /// Most that it leaves, s.
    pub worst_s: f64,
}

impl Clocks {
    /// By least squares through (board time, recorder time).
    fn of(points: &[(f64, f64)]) -> Self {
        let (offset, slope) = line(points);
        let residual = |(x, y): &(f64, f64)| y - offset - slope * x;
        let squares: f64 = points.iter().map(|point| residual(point).powi(2)).sum();
        Self {
            offset_s: offset,
            drift_ppm: (slope - 1.0) * 1e6,
            rms_s: (squares / points.len() as f64).sqrt(),
            worst_s: points.iter().map(|point| residual(point).abs()).fold(0.0, f64::max),
        }
    }

    fn as_text(&self) -> String {
        format!(
            "recorder time = {:.6} s + {:.9} x board time  (drift {:+.2} ppm)\n\
             residuals: rms {:.3} ms, worst {:.3} ms\n",
            self.offset_s,
            1.0 + self.drift_ppm * 1e-6,
            self.drift_ppm,
            self.rms_s * 1e3,
            self.worst_s * 1e3,
        )
    }

    /// As JSON, with more beside it.
    fn with(&self, more: Value) -> Value {
        let mut object = Map::new();
        for (key, number) in [
            ("offset_s", self.offset_s),
            ("drift_ppm", self.drift_ppm),
            ("rms_s", self.rms_s),
            ("worst_s", self.worst_s),
        ] {
            object.insert(key.into(), number.into());
        }
        if let Value::Object(more) = more {
            object.extend(more);
        }
        Value::Object(object)
    }
}

/// Runs the command.
///
/// # Errors
/// A file that is no list of edges, or edges from which no relation of the clocks can be had.
pub fn run(options: &Options) -> Result<(), Failure> {
    let path = &options.edges;
    let edges = edges::read(path).map_err(Failure::Input)?;
    let (clocks, told, more) = match &options.against {
        None => {
            let fit = coded::fit(&edges).map_err(|error| Failure::Run(format!("{}: {error}", path.display())))?;
            let (used, unused, frames, (first, last)) = (fit.used, fit.unused, fit.frames, fit.ticks);
            let told = format!("{used} pulses used, {unused} not; {frames} whole frames; ticks {first} to {last}\n");
            let more = json!({
                "pulses_used": used, "pulses_unused": unused, "frames": frames, "first_tick": first, "last_tick": last,
            });
            (fit.clocks, told, more)
        }
        Some(recorder) => {
            let others = edges::read(recorder).map_err(Failure::Input)?;
            let fit = paired::fit(&edges, &others, options.first_is_first)
                .map_err(|error| Failure::Run(format!("{} against {}: {error}", path.display(), recorder.display())))?;
            let (used, (board, other), (first, last)) = (fit.used, fit.unused, fit.board_s);
            let told = format!(
                "{used} pulses used; not used: {board} of the board's, {other} of the recorder's; board time {first:.3} to {last:.3} s\n"
            );
            let more = json!({
                "pulses_used": used, "pulses_unused": board + other, "board_pulses_unused": board,
                "recorder_pulses_unused": other, "first_board_s": first, "last_board_s": last,
            });
            (fit.clocks, told, more)
        }
    };
    crate::cli::print(&if options.json { format!("{}\n", clocks.with(more)) } else { clocks.as_text() + &told })
}

/// Offset and slope of the straight line of least squares through (board time, recorder time).
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (x0, y0) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let (xx, xy) =
        points.iter().fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - x0) * (x - x0), xy + (x - x0) * (y - y0)));
    let slope = xy / xx;
    (y0 - slope * x0, slope)
}

/// What a pair may be off by to be one, s, by what all of them are off by a line: what is much further off than most, and than all in the mean, is
/// another pulse, or one that began before the recording did.
fn outlier_s(points: &[(f64, f64)], (offset, slope): (f64, f64)) -> f64 {
    /// What a time stamp may be off by in any case, s.
    const RESOLUTION_S: f64 = 1e-5;
    let mut off: Vec<f64> = points.iter().map(|(x, y)| (offset + slope * x - y).abs()).collect();
    off.sort_by(f64::total_cmp);
    let median = off.get(off.len() / 2).copied().unwrap_or(0.0);
    let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len().max(1) as f64).sqrt();
    RESOLUTION_S + (6.0 * median).max(3.0 * rms)
}
