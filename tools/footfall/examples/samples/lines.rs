//! Edges of lines that two systems recorded, for `footfall sync`.

use super::random::Noise;
use joint_loop::io::time_code::level;
use std::fmt::Write as _;

/// A clock beside that of the line.
#[derive(Clone, Copy)]
pub(super) struct Clock {
    /// Its time when the line's is 0, s.
    offset_s: f64,
    /// How much faster it runs, parts per million.
    drift_ppm: f64,
    /// Largest error of a time, s.
    jitter_s: f64,
    seed: u64,
}

/// The board, whose input times edges by its own clock.
pub(super) const BOARD: Clock = Clock { offset_s: 3.0, drift_ppm: 0.0, jitter_s: 2e-6, seed: 7 };
/// A motion-capture system.
pub(super) const RECORDER: Clock = Clock { offset_s: 41.5, drift_ppm: 35.0, jitter_s: 1e-4, seed: 8 };

struct Edges {
    clock: Clock,
    noise: Noise,
    text: String,
}

impl Edges {
    fn of(clock: Clock) -> Self {
        Self { clock, noise: Noise::new(clock.seed), text: String::from("time_s,level\n") }
    }

    fn push(&mut self, line_s: f64, high: bool) {
        let Clock { offset_s, drift_ppm, jitter_s, .. } = self.clock;
        let error = jitter_s * (2.0 * self.noise.uniform() - 1.0);
        let time_s = offset_s + line_s * (1.0 + drift_ppm * 1e-6) + error;
        // Writing to a String cannot fail.
        let _ = writeln!(self.text, "{time_s:.6},{}", u8::from(high));
    }
}

/// A minute of a board's synchronisation output on the clock of a motion-capture system, from 20 s after the board's start.
pub(super) fn coded() -> String {
    let mut edges = Edges::of(RECORDER);
    for tick in 20_000..80_000_u32 {
        if level(tick) != level(tick - 1) {
            edges.push(f64::from(tick) * 1e-3, level(tick));
        }
    }
    edges.text
}

/// Two minutes of pulses at irregular intervals, such as the trigger of another device, on a clock.
pub(super) fn plain(clock: Clock) -> String {
    let (mut edges, mut intervals) = (Edges::of(clock), Noise::new(9));
    let mut line_s = 1.0;
    while line_s < 120.0 {
        edges.push(line_s, true);
        edges.push(line_s + 0.05, false);
        line_s += 0.4 + 0.8 * intervals.uniform();
    }
    edges.text
}
