//! `cargo xtask soak`: hours of the flashed image on the virtual board, in pieces side by side, with the log not attached, read, and attached but
//! not read.

mod bench;
mod judge;
mod piece;
mod table;

use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;

use crate::board::{Board, Variant};
use crate::probe::Sector;
use crate::record;
use crate::setup::Need;
use crate::workspace::Workspace;
use bench::Bench;
use piece::{Log, Piece, Ran};

/// Longest piece, virtual seconds: the timer of the microseconds, 32 bits, wraps after 4295 s.
const LONGEST_PIECE_S: f64 = 4_800.0;
/// Shortest piece: the robot is armed, walks and stops.
const SHORTEST_PIECE_S: f64 = 20.0;
const PROGRESS: Duration = Duration::from_secs(10);

/// Options of `cargo xtask soak`.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Virtual hours in all: a third with the log not attached, one with the log read, one with it attached but not read
    #[arg(long, value_name = "H", default_value_t = 24.0, value_parser = hours)]
    hours: f64,
    /// Pieces that run at a time [default: the processor's cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: Option<u16>,
    /// One JSON object instead of the table
    #[arg(long)]
    json: bool,
}

fn hours(text: &str) -> Result<f64, String> {
    let least = 3.0 * SHORTEST_PIECE_S / 3600.0;
    let hours = text.parse::<f64>().ok().filter(|hours| (least..=10_000.0).contains(hours));
    hours.ok_or_else(|| format!("allowed is a number of virtual hours from {least:.3} to 10000"))
}

/// Builds what is needed, runs the pieces, and prints what came of them.
pub(crate) fn soak(options: &Options) -> Result<ExitCode> {
    let mut workspace = Workspace::open()?;
    workspace.set_up(&[Need::BoardCompiler, Need::VirtualBoard])?;
    let elf = workspace.firmware(Board::F4Discovery, Variant::USUAL)?.elf;
    let robot = record::path_of(&workspace, Sector::Robot);
    record::pack_default_robot(&workspace, &robot)?;
    let bench = Bench { robot, virtual_board: workspace.virtual_board()?, footfall: workspace.footfall()?, elf };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let begun = Instant::now();
    let ran = run_all(&bench, &pieces(options.hours), options.jobs.map_or(cores, usize::from))?;
    let result = table::Soak::of(ran, begun.elapsed());
    if options.json {
        println!("{}", result.json());
    } else {
        print!("{result}");
    }
    Ok(if result.is_sound() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The pieces: as many of each third, all of the same length. Pieces of one number have the same inputs.
fn pieces(hours: f64) -> Vec<Piece> {
    let third_s = hours * 3600.0 / 3.0;
    let count = (third_s / LONGEST_PIECE_S).ceil().max(1.0);
    let secs = third_s / count;
    (0..count as u32).flat_map(|number| Log::ALL.map(|log| Piece { number, log, secs })).collect()
}

/// Runs the pieces, so many at a time, and shows how far they are.
fn run_all(bench: &Bench, pieces: &[Piece], jobs: usize) -> Result<Vec<Ran>> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let reached: Vec<_> = pieces.iter().map(|_| piece::Reached::default()).collect();
    let whole_s: f64 = pieces.iter().map(|piece| piece.secs).sum();
    let begun = Instant::now();
    thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs.min(pieces.len()))
            .map(|_| {
                scope.spawn(|| -> Result<()> {
                    loop {
                        let place = next.fetch_add(1, Ordering::Relaxed);
                        let (Some(piece), Some(reached)) = (pieces.get(place), reached.get(place)) else {
                            return Ok(());
                        };
                        let ran = piece.run(bench, reached)?;
                        done.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(ran);
                    }
                })
            })
            .collect();
        let mut shown = Instant::now();
        while workers.iter().any(|worker| !worker.is_finished()) {
            thread::sleep(Duration::from_millis(50));
            if shown.elapsed() >= PROGRESS {
                shown = Instant::now();
                let so_far_s: f64 = reached.iter().map(piece::Reached::seconds).sum();
                let finished = done.lock().map_or(0, |done| done.len());
                eprintln!(
                    "soak: {:.0} of {whole_s:.0} virtual s, {finished} of {} pieces done, after {:.0} s",
                    so_far_s,
                    pieces.len(),
                    begun.elapsed().as_secs_f64()
                );
            }
        }
        workers
            .into_iter()
            .try_for_each(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    let mut ran = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    ran.sort_by_key(|ran| (ran.piece.log as u8, ran.piece.number));
    Ok(ran)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thirds_are_equal_and_a_day_wraps_the_timer_in_every_piece() {
        let day = pieces(24.0);
        assert_eq!(day.len(), 18);
        assert!(day.iter().all(|piece| piece.secs > 4_295.0 && piece.secs <= LONGEST_PIECE_S));
        assert!((day.iter().map(|piece| piece.secs).sum::<f64>() - 86_400.0).abs() < 1e-6);
        for log in Log::ALL {
            assert_eq!(day.iter().filter(|piece| piece.log == log).count(), 6);
        }
        assert_eq!(pieces(0.05).len(), 3);
    }

    #[test]
    fn hours_that_make_no_piece_are_refused() {
        for wrong in ["0", "-1", "nan", "inf", "1e9", "", "day"] {
            assert!(hours(wrong).is_err_and(|error| error.contains("allowed is")), "{wrong}");
        }
        assert_eq!(hours("0.2"), Ok(0.2));
    }
}
