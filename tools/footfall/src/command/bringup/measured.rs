//! What follows from the records of a board: pulses from the edges of a line, codes at both rails, the board's clock against that of this computer.

use wire::Edge;

/// A pulse of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pulse {
    /// Its rising edge, us since the boot by the board's clock.
    pub(super) rise_us: i64,
    /// Time to the falling edge, us.
    pub(super) width_us: i64,
}

/// Time of an edge since the boot, us.
pub(super) fn edge_us(edge: &Edge) -> i64 {
    i64::from(edge.tick) * 1_000 + i64::from(edge.offset_us)
}

/// The whole pulses between these edges. Where edges were lost, the pulse is none.
pub(super) fn pulses<'e>(edges: impl IntoIterator<Item = &'e Edge>) -> Vec<Pulse> {
    let (mut rise, mut found) = (None, Vec::new());
    for edge in edges {
        if edge.lost_before {
            rise = None;
        }
        match (edge.high, rise.take()) {
            (true, _) => rise = Some(edge_us(edge)),
            (false, Some(rise_us)) => found.push(Pulse { rise_us, width_us: edge_us(edge) - rise_us }),
            (false, None) => {}
        }
    }
    found
}

/// Pulses of a servo pin while the board commands one width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Widths {
    /// How many.
    pub(super) count: usize,
    /// Median of the measured less the commanded width, us.
    pub(super) median_us: f64,
    /// The one of the greatest magnitude among the middle half of all, us.
    pub(super) middle_us: f64,
    /// The one of the greatest magnitude, us.
    pub(super) worst_us: f64,
    /// Mean time from one rising edge to the next, us.
    pub(super) period_us: f64,
}

/// Compares pulses with the width that the board commanded; `None` for fewer than three.
pub(super) fn widths(pulses: &[Pulse], commanded_us: u16) -> Option<Widths> {
    let (first, last) = (pulses.first()?, pulses.last()?);
    let count = pulses.len();
    if count < 3 {
        return None;
    }
    let mut errors: Vec<i64> = pulses.iter().map(|pulse| pulse.width_us - i64::from(commanded_us)).collect();
    errors.sort_unstable();
    let farthest = |errors: &[i64]| errors.iter().copied().max_by_key(|error| error.abs());
    let (worst, middle) = (farthest(&errors)?, farthest(errors.get(count / 4..count - count / 4)?)?);
    let period_us = (last.rise_us - first.rise_us) as f64 / (count - 1) as f64;
    Some(Widths { count, median_us: median(&errors), middle_us: middle as f64, worst_us: worst as f64, period_us })
}

/// Median of sorted numbers; not a number for none.
fn median(sorted: &[i64]) -> f64 {
    let middle = |place: usize| sorted.get(place).map_or(f64::NAN, |value| *value as f64);
    let half = sorted.len() / 2;
    if sorted.len() % 2 == 1 { middle(half) } else { (middle(half.wrapping_sub(1)) + middle(half)) / 2.0 }
}

/// Median codes of an input below and above the middle of the converter's range; `None` where it was never on one side.
pub(super) fn rails(codes: &[u16]) -> Option<[f64; 2]> {
    const MIDDLE: u16 = 2048;
    let (mut low, mut high): (Vec<i64>, Vec<i64>) = (Vec::new(), Vec::new());
    for code in codes {
        if *code < MIDDLE { low.push((*code).into()) } else { high.push((*code).into()) }
    }
    low.sort_unstable();
    high.sort_unstable();
    (!low.is_empty() && !high.is_empty()).then(|| [median(&low), median(&high)])
}

/// Rate of the board's clock against that of this computer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rate {
    /// The board's clock is so much faster, ppm.
    pub(super) ppm: f64,
    /// Half the width of the interval in which the true rate is, ppm.
    pub(super) uncertainty_ppm: f64,
}

/// A frame of full-speed USB, s: a serial adapter delivers in steps of it, so that two shortest delays may differ by so much.
const USB_FRAME_S: f64 = 1e-3;

/// Compares the two clocks by reports of the board, each with the time of the board and of its arrival, s.
///
/// A report comes late by the way through the port, never early. So the shortest delay in each third of the time counts: the first and the last give the
/// rate, and by how much the middle one is off their line is the error that the delays still have.
pub(super) fn rate(reports: &[(f64, f64)]) -> Option<Rate> {
    let (first, last) = (reports.first()?, reports.last()?);
    let third = (last.0 - first.0) / 3.0;
    let shortest = |part: u8| {
        let from = first.0 + third * f64::from(part);
        let of_part = reports.iter().filter(|(board_s, _)| *board_s >= from && *board_s <= from + third);
        of_part.map(|(board_s, host_s)| (*board_s, host_s - board_s)).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let [(t0, d0), (t1, d1), (t2, d2)] = [shortest(0)?, shortest(1)?, shortest(2)?];
    let span = t2 - t0;
    if span <= 0.0 {
        return None;
    }
    let slope = (d2 - d0) / span;
    let off = (d1 - (d0 + slope * (t1 - t0))).abs();
    // A board that is fast counts more seconds than this computer: the difference falls.
    Some(Rate { ppm: -slope / (1.0 + slope) * 1e6, uncertainty_ppm: (off + USB_FRAME_S) / span * 1e6 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(us: i64, high: bool) -> Edge {
        let tick = (us / 1_000 + 1) as u32;
        Edge { tick, offset_us: (us - i64::from(tick) * 1_000) as i32, high, lost_before: false }
    }

    #[test]
    fn pulses_are_those_between_edges() {
        // The end of a pulse, two whole ones, a falling edge that was lost, one more.
        let mut edges: Vec<Edge> =
            [(900, false), (20_000, true), (21_500, false), (40_000, true), (41_502, false), (60_000, true)]
                .map(|(us, high)| edge(us, high))
                .into();
        edges.push(Edge { lost_before: true, ..edge(81_000, false) });
        edges.extend([edge(100_000, true), edge(101_499, false)]);
        let found = pulses(&edges);
        assert_eq!(found.iter().map(|pulse| pulse.width_us).collect::<Vec<_>>(), [1_500, 1_502, 1_499]);
        let widths = widths(&found, 1_500).unwrap();
        assert_eq!((widths.count, widths.median_us, widths.worst_us, widths.period_us), (3, 0.0, 2.0, 40_000.0));
        assert_eq!(super::widths(&found[..2], 1_500), None);
    }

    #[test]
    fn rails_are_the_medians_of_both_sides() {
        assert_eq!(rails(&[2, 4095, 3, 4094, 2, 1_900, 4095]), Some([2.5, 4095.0]));
        assert_eq!(rails(&[2, 3]), None);
    }

    /// Whatever the delays are above the shortest ones, the rate is inside of its uncertainty.
    #[test]
    fn the_rate_is_found_below_the_delays() {
        for ppm in [0.0, 40.0, -700.0, 20_000.0] {
            let mut random = 12_345_u32;
            let reports: Vec<(f64, f64)> = (0..6_000)
                .map(|n| {
                    random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    let delay = f64::from(random >> 16) / 65_536.0 * 0.012;
                    let host_s = f64::from(n) * 0.01;
                    (host_s * (1.0 + ppm * 1e-6), host_s + 0.003 + delay)
                })
                .collect();
            let rate = rate(&reports).unwrap();
            assert!((rate.ppm - ppm).abs() <= rate.uncertainty_ppm, "{ppm}: {rate:?}");
            assert!(rate.uncertainty_ppm < 60.0, "{rate:?}");
        }
        assert_eq!(rate(&[(1.0, 1.0)]), None);
    }
}
