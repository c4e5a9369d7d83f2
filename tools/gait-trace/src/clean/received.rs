//! Times at which messages were received: rows at equal steps, of which each is late by a delay of its own.
//!
//! The delay of a row is what its time has beyond the grid. Where two rows are farther apart than a step, messages may be missing, or the
//! second one is late. A late one displaces no row after it: the least delays of the rows on either side are nearly equal, whatever the
//! delays are, and they differ by a step for each message that is missing. The step is at first the median over many rows; then that of the
//! line through all rows, and the missing messages are counted again with more rows and a closer tolerance.

use crate::series::{median, quantile};

/// Rows on each side of a long step, and the tolerance of their least delays in steps, at first.
const FIRST: (usize, f64) = (20, 0.3);
/// The same, when the step is known.
const SECOND: (usize, f64) = (60, 0.15);
/// Rows over which the step is measured at first.
const FAR: usize = 50;
/// Two rows that are farther apart than this, in steps, may have missing messages between them.
const LONG: f64 = 1.1;
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
    let mut step = median(times.windows(far + 1).map(|part| (part[far] - part[0]) / far as f64));
    let (mut start, mut places) = (0.0, Vec::new());
    for (around, tolerance) in [FIRST, SECOND] {
        places = grid(times, step, around, tolerance);
        (start, step) = line(&places, times);
    }
    let delays = || times.iter().zip(&places).map(|(time, place)| time - start - place * step);
    let share = (quantile(delays(), 0.95) - quantile(delays(), 0.05)) / step;
    let are_clear = share <= WIDEST;
    if are_clear {
        times.iter_mut().zip(&places).for_each(|(time, place)| *time = place * step);
    }
    Delays { share, are_clear }
}

/// The place of each row on the grid, in steps. The least delays of `around` rows may differ by the tolerance, in steps.
fn grid(times: &[f64], step: f64, around: usize, tolerance: f64) -> Vec<f64> {
    let mut places: Vec<f64> = Vec::with_capacity(times.len());
    for row in 0..times.len() {
        let Some(&last) = places.last() else {
            places.push(0.0);
            continue;
        };
        let mut place = last + 1.0;
        if times[row] - times[row - 1] > LONG * step {
            let from = row.saturating_sub(around);
            let before = (from..row).map(|n| times[n] - places[n] * step).fold(f64::INFINITY, f64::min);
            let rows = times[row..].iter().take(around).enumerate();
            let after = rows.map(|(n, time)| time - (place + n as f64) * step).fold(f64::INFINITY, f64::min);
            place += ((after - before) / step + tolerance).floor().max(0.0);
        }
        places.push(place);
    }
    places
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
        /// Random delays of up to six tenths of a step, and two gaps: the rows come back to the grid, and the gaps have their length. With eight
        /// tenths about one recording in a thousand gets a gap that is wrong by a message.
        #[test]
        fn delays_are_taken_away_and_gaps_stay(
            delays in prop::collection::vec(0.0_f64..0.6, 500),
            (first, second) in (60_usize..200, 260_usize..440),
            (lost, more) in (0_usize..4, 0_usize..30),
        ) {
            let place = |n: usize| n + if n >= first { lost } else { 0 } + if n >= second { more } else { 0 };
            let mut times: Vec<f64> = delays.iter().enumerate().map(|(n, delay)| (place(n) as f64 + delay) * 0.01).collect();
            let start = times[0];
            times.iter_mut().for_each(|time| *time -= start);
            let delays = put_at_equal_steps(&mut times);
            prop_assert!(delays.are_clear && delays.share < 0.65, "{delays:?}");
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
