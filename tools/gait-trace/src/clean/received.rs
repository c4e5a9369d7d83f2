//! Times at which messages were received: rows at equal steps, of which each is late by a delay of its own.
//!
//! The step is the median over many rows, and the delay of a row is what its time has beyond the grid. Where two rows are far apart, messages
//! may be missing, or the second one is late. A late one displaces no row after it: the least delays of the [`AROUND`] rows on either side
//! are nearly equal, whatever the delays are, so the grids through them differ by the missing messages alone. Where there are few rows, at
//! the ends and next to a gap, medians are compared.

use crate::series::{median, quantile};
use std::ops::Range;

/// Rows on each side of a long step that are compared.
const AROUND: usize = 60;
/// With fewer rows on a side, medians are compared.
const FEWEST: usize = 10;
/// Rows over which the step is measured.
const FAR: usize = 50;
/// Two rows that are farther apart than this, in steps, may have missing messages between them.
const LONG: f64 = 1.1;
/// How much the least delays of both sides may differ, in steps.
const LEAST_DELAYS: f64 = 0.15;
/// Widest range of the delays, in steps, with which the steps are clear.
const WIDEST: f64 = 1.5;

/// The delays of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Delays {
    /// Their range as a fraction of a step, without the outermost twentieths.
    pub(crate) share: f64,
    /// The rows fit equal steps.
    pub(crate) are_clear: bool,
}

/// Puts times at equal steps, with gaps where messages are missing. If the steps are not clear, the times stay as they were.
pub(crate) fn put_at_equal_steps(times: &mut [f64]) -> Delays {
    let far = FAR.min(times.len() / 4).max(1);
    let step = median(times.windows(far + 1).map(|part| (part[far] - part[0]) / far as f64));
    let mut places: Vec<f64> = Vec::with_capacity(times.len());
    let (mut place, mut first) = (0.0, 0);
    for row in 0..times.len() {
        if row > 0 {
            let lost = missing(times, first, row, step);
            if lost > 0.0 {
                first = row;
            }
            place += 1.0 + lost;
        }
        places.push(place);
    }
    let (start, step) = line(&places, times);
    let delays = || times.iter().zip(&places).map(|(time, place)| time - start - place * step);
    let share = (quantile(delays(), 0.95) - quantile(delays(), 0.05)) / step;
    let are_clear = share <= WIDEST;
    if are_clear {
        times.iter_mut().zip(&places).for_each(|(time, place)| *time = place * step);
    }
    Delays { share, are_clear }
}

/// The number of messages that are missing in front of a row; `first` is the first row behind the gap before.
fn missing(times: &[f64], first: usize, row: usize, step: f64) -> f64 {
    if times[row] - times[row - 1] <= LONG * step {
        return 0.0;
    }
    let at_row = |n: usize| times[n] + (row as f64 - n as f64) * step;
    let (before, after) = (row.saturating_sub(AROUND).max(first)..row, row..(row + AROUND).min(times.len()));
    let lost = if before.len().min(after.len()) >= FEWEST {
        let least = |rows: Range<usize>| rows.map(at_row).fold(f64::INFINITY, f64::min);
        // No message is earlier than the least delay.
        ((least(after) - least(before)) / step + LEAST_DELAYS).floor()
    } else {
        ((median(after.map(at_row)) - median(before.map(at_row))) / step).round()
    };
    lost.max(0.0)
}

/// Start and slope of the least-squares line through `y` over `x`.
fn line(x: &[f64], y: &[f64]) -> (f64, f64) {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (x0, y0) = (mean(x), mean(y));
    let (xx, xy) =
        x.iter().zip(y).fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - x0).powi(2), xy + (x - x0) * (y - y0)));
    (y0 - xy / xx * x0, xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Delays of up to eight tenths of a step, and two gaps: the rows come back to the grid, and the gaps have their length.
        #[test]
        fn delays_are_taken_away_and_gaps_stay(
            delays in prop::collection::vec(0.0_f64..0.8, 500),
            (first, second) in (60_usize..200, 260_usize..440),
            (lost, more) in (0_usize..4, 0_usize..30),
        ) {
            let place = |n: usize| n + if n >= first { lost } else { 0 } + if n >= second { more } else { 0 };
            let mut times: Vec<f64> = delays.iter().enumerate().map(|(n, delay)| (place(n) as f64 + delay) * 0.01).collect();
            let start = times[0];
            times.iter_mut().for_each(|time| *time -= start);
            let delays = put_at_equal_steps(&mut times);
            prop_assert!(delays.are_clear && delays.share < 0.85, "{delays:?}");
            for (n, time) in times.iter().enumerate() {
                prop_assert!((time - place(n) as f64 * 0.01).abs() < 0.002, "{n}: {time}");
            }
        }
    }

    #[test]
    fn times_without_delays_stay() {
        let mut times: Vec<f64> = (0..300).filter(|n| !(100..=104).contains(n)).map(|n| f64::from(n) * 0.02).collect();
        let before = times.clone();
        assert!(put_at_equal_steps(&mut times).share < 1e-9);
        assert!(times.iter().zip(before).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    /// Messages in bursts, with several steps between them: the steps are not clear.
    #[test]
    fn bursts_are_left_as_they_are() {
        let mut times: Vec<f64> = (0..400).map(|n| f64::from(n / 8) * 0.08 + f64::from(n % 8) * 0.0001).collect();
        let before = times.clone();
        assert!(!put_at_equal_steps(&mut times).are_clear);
        assert_eq!(times, before);
    }
}
