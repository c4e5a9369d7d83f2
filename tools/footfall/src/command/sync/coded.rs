//! Decodes a recording of a board's synchronisation output ([`joint_loop::io::time_code`]), and relates the recorder's clock to the
//! board's.
//!
//! Complete frames that pass their check number the slots; a straight line through their rising edges then numbers all other pulses, and
//! the line through all of these is the result.

use super::clocks::{Clocks, outlier_s};
use super::edges::{Edge, pulses};
use crate::line_fit::line_fit;
use joint_loop::io::time_code::{FRAME_TICKS, NUMBER_BITS, SLOT_TICKS, SLOTS, Symbol, check};

/// Tolerance of widths and positions of pulses, s.
const TOLERANCE_S: f64 = 0.009;
const SLOT_S: f64 = SLOT_TICKS as f64 * 1e-3;

/// The relation of the two clocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The line.
    pub clocks: Clocks,
    /// Pulses that were used.
    pub used: usize,
    /// Pulses that were not used: not a width of the code, or not at a position of the line.
    pub unused: usize,
    /// Complete frames that passed their check.
    pub frames: usize,
    /// Tick of the first and of the last pulse that was used.
    pub ticks: (u32, u32),
}

#[derive(Debug, Clone, Copy)]
struct Pulse {
    time_s: f64,
    symbol: Option<Symbol>,
}

/// The rising edges with a falling edge.
fn symbols(edges: &[Edge]) -> Vec<Pulse> {
    let of_width = |width: f64| {
        [Symbol::Mark, Symbol::Bit(false), Symbol::Bit(true)]
            .into_iter()
            .find(|symbol| (f64::from(symbol.width_ticks()) * 1e-3 - width).abs() < TOLERANCE_S)
    };
    let whole = pulses(edges).into_iter().filter_map(|pulse| Some((pulse.time_s, pulse.width_s?)));
    whole.map(|(time_s, width)| Pulse { time_s, symbol: of_width(width) }).collect()
}

/// The number of the frame that begins with a pulse, and the pulses of its slots.
fn frame(pulses: &[Pulse]) -> Option<(u32, &[Pulse])> {
    let slots = pulses.get(..SLOTS as usize)?;
    let (mark, rest) = slots.split_first()?;
    if mark.symbol != Some(Symbol::Mark) {
        return None;
    }
    let mut word = 0_u64;
    for (n, pulse) in rest.iter().enumerate() {
        let place = mark.time_s + SLOT_S * (n + 1) as f64;
        match pulse.symbol {
            Some(Symbol::Bit(bit)) if (pulse.time_s - place).abs() < TOLERANCE_S => word |= u64::from(bit) << n,
            _ => return None,
        }
    }
    let number = (word & ((1 << NUMBER_BITS) - 1)) as u32;
    (word >> NUMBER_BITS == u64::from(check(number))).then_some((number, slots))
}

/// The relation of the two clocks.
///
/// # Errors
/// No complete frame, or frames that contradict each other: the board was reset in between.
pub fn fit(edges: &[Edge]) -> Result<Fit, String> {
    let pulses = symbols(edges);
    let mut numbered: Vec<(f64, f64)> = Vec::new();
    let mut frames = 0;
    for start in 0..pulses.len() {
        let Some((number, slots)) = frame(&pulses[start..]) else { continue };
        frames += 1;
        let first = f64::from(number) * f64::from(FRAME_TICKS) * 1e-3;
        let points = slots.iter().enumerate().map(|(slot, pulse)| (first + SLOT_S * slot as f64, pulse.time_s));
        numbered.extend(points);
    }
    if frames == 0 {
        return Err(format!("no whole frame among {} pulses: {} s without a lost pulse are needed", pulses.len(), 6.4));
    }
    let (mut offset, mut slope) = line_fit(&numbered);
    if numbered.iter().any(|(x, y)| (offset + slope * x - y).abs() > TOLERANCE_S) {
        return Err("the frames' numbers do not go with their times: was the board reset in between?".into());
    }
    // From the frames in the middle outwards the line becomes more accurate: two rounds suffice for a drift of some 100 ppm. Then outliers
    // are left out: the edge of a pulse that was high when the recording or the board began is the edge of that beginning.
    let (mut points, mut off_s) = (Vec::new(), TOLERANCE_S);
    for _ in 0..4 {
        points.clear();
        for pulse in pulses.iter().filter(|pulse| pulse.symbol.is_some()) {
            let slot = ((pulse.time_s - offset) / slope / SLOT_S).round();
            let board_s = slot * SLOT_S;
            if slot >= 0.0 && (offset + slope * board_s - pulse.time_s).abs() < off_s {
                points.push((board_s, pulse.time_s));
            }
        }
        (offset, slope) = line_fit(&points);
        off_s = TOLERANCE_S.min(outlier_s(&points, (offset, slope)));
    }
    let tick = |point: Option<&(f64, f64)>| point.map_or(0, |(board_s, _)| (board_s * 1e3).round() as u32);
    Ok(Fit {
        clocks: Clocks::of(&points),
        used: points.len(),
        unused: pulses.len() - points.len(),
        frames,
        ticks: (tick(points.first()), tick(points.last())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use joint_loop::io::time_code::level;

    /// The edges of some ticks on a recorder's clock. `lost` is the probability that a pulse is lost.
    fn edges(ticks: std::ops::Range<u32>, offset_s: f64, ppm: f64, jitter_s: f64, lost: f64, seed: u64) -> Vec<Edge> {
        let mut state = seed;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut edges = Vec::new();
        let mut keep = true;
        for tick in ticks.start.max(1)..ticks.end {
            let now = level(tick);
            if now != level(tick - 1) {
                if now {
                    keep = random() >= lost;
                }
                let time_s = offset_s + f64::from(tick) * 1e-3 * (1.0 + ppm * 1e-6) + jitter_s * (2.0 * random() - 1.0);
                if keep {
                    edges.push(Edge { time_s, rising: now });
                }
            }
        }
        edges
    }

    #[test]
    fn offset_and_drift_come_back_through_jitter_and_lost_pulses() {
        // Ten minutes, begun in the middle of a frame; a frame of 32 pulses is whole with 0.98^32, every other one.
        for (seed, ppm) in [(1, 50.0), (2, -50.0), (3, 0.0), (4, 200.0)] {
            let edges = edges(1_234_567..1_834_567, -17.25, ppm, 0.5e-3, 0.02, seed);
            let fit = fit(&edges).unwrap();
            assert!((fit.clocks.drift_ppm - ppm).abs() < 0.2, "{fit:?}");
            // In the middle of the recording, where it is used.
            let error = fit.clocks.offset_s + 17.25 + 1534.567 * (fit.clocks.drift_ppm - ppm) * 1e-6;
            assert!(error.abs() < 3e-5, "{error} s: {fit:?}");
            assert!((fit.clocks.rms_s - 0.5e-3 / 3_f64.sqrt()).abs() < 2e-5 && fit.clocks.worst_s <= 0.6e-3, "{fit:?}");
            assert!(fit.frames > 60 && fit.used > 5_700 && fit.unused == 0, "{fit:?}");
            assert!((1_234_567..1_234_900).contains(&fit.ticks.0) && (1_834_200..1_834_567).contains(&fit.ticks.1));
        }
    }

    #[test]
    fn one_whole_frame_is_enough_and_less_is_refused() {
        let fit_of = |ticks| fit(&edges(ticks, 3.0, 50.0, 0.0, 0.0, 9));
        let one = fit_of(3_190..6_460).unwrap();
        assert_eq!((one.frames, one.ticks), (1, (3_200, 6_400)));
        assert!((one.clocks.drift_ppm - 50.0).abs() < 1e-3 && (one.clocks.offset_s - 3.0).abs() < 1e-6, "{one:?}");
        let error = fit_of(3_250..6_350).unwrap_err();
        assert!(error.starts_with("no whole frame among 31 pulses"), "{error}");
        assert!(fit(&[]).is_err());
    }

    #[test]
    fn pulses_that_are_not_the_boards_are_left_out_and_a_reset_is_noticed() {
        let mut noisy = edges(1..64_000, 0.0, 0.0, 0.0, 0.0, 5);
        for n in 0..5 {
            // A glitch in the pause of a slot.
            let time_s = 1.07 + 9.0 * f64::from(n);
            noisy.extend([(time_s, true), (time_s + 0.001, false)].map(|(time_s, rising)| Edge { time_s, rising }));
        }
        noisy.sort_by(|one, two| one.time_s.total_cmp(&two.time_s));
        let fit_of_noisy = fit(&noisy).unwrap();
        assert!(fit_of_noisy.clocks.worst_s < 1e-9 && fit_of_noisy.unused == 5, "{fit_of_noisy:?}");
        let mut reset = edges(1..20_000, 0.0, 0.0, 0.0, 0.0, 5);
        reset.extend(edges(1..20_000, 30.0, 0.0, 0.0, 0.0, 5));
        assert!(fit(&reset).unwrap_err().contains("reset"));
    }
}
