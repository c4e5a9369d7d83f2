//! `footfall sync`: the board's clock against another system's, from the edges of the board's synchronisation output as that system
//! recorded them.
//!
//! The file is CSV with the header `time_s,level`: an edge a row, in the order of time; level 1 after a rising edge, 0 after a falling one.
//! The code is that of [`joint_loop::sync`]. Frames that came whole and pass their check number the slots; a straight line through their
//! rising edges then numbers every other pulse, whole frame or not, and the line through all of these is the answer:
//! ```text
//! recorder time = offset + (1 + drift) board time,    board time = tick / 1000 s
//! ```

use crate::failure::Failure;
use clap::Args;
use joint_loop::sync::{FRAME_TICKS, NUMBER_BITS, SLOT_TICKS, SLOTS, Symbol, check};
use serde_json::json;
use std::path::{Path, PathBuf};

/// A pulse is this near to a width, or to its place, to be taken for it, s.
const TOLERANCE_S: f64 = 0.009;
const SLOT_S: f64 = SLOT_TICKS as f64 * 1e-3;

/// Options of `footfall sync`.
#[derive(Debug, Clone, Args)]
pub struct Options {
    /// The edges: CSV with the header `time_s,level`
    #[arg(value_name = "EDGES.csv")]
    pub edges: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// A change of the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// When, s.
    pub time_s: f64,
    /// True for a rising edge.
    pub rising: bool,
}

/// How the two clocks relate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Recorder time at board time 0, s.
    pub offset_s: f64,
    /// How much faster the recorder's clock runs, parts per million.
    pub drift_ppm: f64,
    /// Root mean square of what the line leaves, s.
    pub rms_s: f64,
    /// Most that it leaves, s.
    pub worst_s: f64,
    /// Pulses that were used.
    pub used: usize,
    /// Pulses that were not: no width of the code, or not where the line puts one.
    pub unused: usize,
    /// Frames that came whole and passed their check.
    pub frames: usize,
    /// Tick of the first and of the last pulse that was used.
    pub ticks: (u32, u32),
}

#[derive(Debug, Clone, Copy)]
struct Pulse {
    time_s: f64,
    symbol: Option<Symbol>,
}

/// Runs the command.
///
/// # Errors
/// A file that is no list of edges, or one in which no frame came whole.
pub fn run(options: &Options) -> Result<(), Failure> {
    let path = &options.edges;
    let edges = read(path).map_err(Failure::Input)?;
    let fit = fit(&edges).map_err(|error| Failure::Run(format!("{}: {error}", path.display())))?;
    let text = if options.json {
        format!(
            "{}\n",
            json!({
                "offset_s": fit.offset_s, "drift_ppm": fit.drift_ppm, "rms_s": fit.rms_s, "worst_s": fit.worst_s,
                "pulses_used": fit.used, "pulses_unused": fit.unused, "frames": fit.frames,
                "first_tick": fit.ticks.0, "last_tick": fit.ticks.1,
            })
        )
    } else {
        format!(
            "recorder time = {:.6} s + {:.9} x board time  (drift {:+.2} ppm)\n\
             residuals: rms {:.3} ms, worst {:.3} ms\n\
             {} pulses used, {} not; {} whole frames; ticks {} to {}\n",
            fit.offset_s,
            1.0 + fit.drift_ppm * 1e-6,
            fit.drift_ppm,
            fit.rms_s * 1e3,
            fit.worst_s * 1e3,
            fit.used,
            fit.unused,
            fit.frames,
            fit.ticks.0,
            fit.ticks.1
        )
    };
    crate::cli::print(&text)
}

/// Reads a file of edges.
fn read(path: &Path) -> Result<Vec<Edge>, String> {
    let at = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let text = std::fs::read_to_string(path).map_err(|error| at(&error))?;
    parse(&text).map_err(|error| format!("{}:{error}", path.display()))
}

/// Reads the text of a file of edges; an error begins with the number of the line.
fn parse(text: &str) -> Result<Vec<Edge>, String> {
    let mut lines = text.lines().enumerate();
    let header = lines.next().map_or("", |(_, line)| line.trim());
    if header != "time_s,level" {
        return Err(format!("1: the header is `{header}`; allowed is `time_s,level`"));
    }
    let mut edges: Vec<Edge> = Vec::new();
    for (index, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let row = index + 1;
        let (time, level) = line.split_once(',').ok_or_else(|| format!("{row}: two columns are wanted: `{line}`"))?;
        let time_s = time.trim().parse::<f64>().ok().filter(|time| time.is_finite());
        let time_s = time_s.ok_or_else(|| format!("{row}: field `time_s`: `{time}` is no finite number"))?;
        let rising = match level.trim() {
            "1" => true,
            "0" => false,
            other => return Err(format!("{row}: field `level`: `{other}`; allowed is 0 or 1")),
        };
        if let Some(before) = edges.last().filter(|before| before.time_s >= time_s) {
            return Err(format!("{row}: field `time_s`: {time_s} does not come after {}", before.time_s));
        }
        edges.push(Edge { time_s, rising });
    }
    Ok(edges)
}

/// The rising edges that are followed by a falling one.
fn pulses(edges: &[Edge]) -> Vec<Pulse> {
    let whole = edges.windows(2).filter(|two| two[0].rising && !two[1].rising);
    let of_width = |width: f64| {
        [Symbol::Mark, Symbol::Bit(false), Symbol::Bit(true)]
            .into_iter()
            .find(|symbol| (f64::from(symbol.width_ticks()) * 1e-3 - width).abs() < TOLERANCE_S)
    };
    whole.map(|two| Pulse { time_s: two[0].time_s, symbol: of_width(two[1].time_s - two[0].time_s) }).collect()
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

/// Offset and slope of the straight line of least squares through (board time, recorder time).
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (x0, y0) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let (xx, xy) =
        points.iter().fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - x0) * (x - x0), xy + (x - x0) * (y - y0)));
    let slope = xy / xx;
    (y0 - slope * x0, slope)
}

/// The relation of the two clocks.
///
/// # Errors
/// No frame came whole, or the frames contradict each other: the board was reset in between.
pub fn fit(edges: &[Edge]) -> Result<Fit, String> {
    let pulses = pulses(edges);
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
    let (mut offset, mut slope) = line(&numbered);
    if numbered.iter().any(|(x, y)| (offset + slope * x - y).abs() > TOLERANCE_S) {
        return Err("the frames' numbers do not go with their times: was the board reset in between?".into());
    }
    // From the middle of the frames outwards the line only gets better: twice is enough for what drifts by some 100 ppm.
    let mut points = Vec::new();
    for _ in 0..2 {
        points.clear();
        for pulse in pulses.iter().filter(|pulse| pulse.symbol.is_some()) {
            let slot = ((pulse.time_s - offset) / slope / SLOT_S).round();
            let board_s = slot * SLOT_S;
            if slot >= 0.0 && (offset + slope * board_s - pulse.time_s).abs() < TOLERANCE_S {
                points.push((board_s, pulse.time_s));
            }
        }
        (offset, slope) = line(&points);
    }
    let residual = |(x, y): &(f64, f64)| y - offset - slope * x;
    let squares: f64 = points.iter().map(|point| residual(point).powi(2)).sum();
    let tick = |point: Option<&(f64, f64)>| point.map_or(0, |(board_s, _)| (board_s * 1e3).round() as u32);
    Ok(Fit {
        offset_s: offset,
        drift_ppm: (slope - 1.0) * 1e6,
        rms_s: (squares / points.len() as f64).sqrt(),
        worst_s: points.iter().map(|point| residual(point).abs()).fold(0.0, f64::max),
        used: points.len(),
        unused: pulses.len() - points.len(),
        frames,
        ticks: (tick(points.first()), tick(points.last())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use joint_loop::sync::level;

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
            assert!((fit.drift_ppm - ppm).abs() < 0.2, "{fit:?}");
            // At the middle of the recording, where it is used.
            let error = fit.offset_s + 17.25 + 1534.567 * (fit.drift_ppm - ppm) * 1e-6;
            assert!(error.abs() < 3e-5, "{error} s: {fit:?}");
            assert!((fit.rms_s - 0.5e-3 / 3_f64.sqrt()).abs() < 2e-5 && fit.worst_s <= 0.6e-3, "{fit:?}");
            assert!(fit.frames > 60 && fit.used > 5_700 && fit.unused == 0, "{fit:?}");
            assert!((1_234_567..1_234_900).contains(&fit.ticks.0) && (1_834_200..1_834_567).contains(&fit.ticks.1));
        }
    }

    #[test]
    fn one_whole_frame_is_enough_and_none_is_told() {
        let fit_of = |ticks| fit(&edges(ticks, 3.0, 50.0, 0.0, 0.0, 9));
        let one = fit_of(3_190..6_460).unwrap();
        assert_eq!((one.frames, one.ticks), (1, (3_200, 6_400)));
        assert!((one.drift_ppm - 50.0).abs() < 1e-3 && (one.offset_s - 3.0).abs() < 1e-6, "{one:?}");
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
        assert!(fit_of_noisy.worst_s < 1e-9 && fit_of_noisy.unused == 5, "{fit_of_noisy:?}");
        let mut reset = edges(1..20_000, 0.0, 0.0, 0.0, 0.0, 5);
        reset.extend(edges(1..20_000, 30.0, 0.0, 0.0, 0.0, 5));
        assert!(fit(&reset).unwrap_err().contains("reset"));
    }

    #[test]
    fn bad_files_are_refused_with_their_line() {
        for (text, words) in [
            ("", "1: the header is ``"),
            ("time,level\n", "allowed is `time_s,level`"),
            ("time_s,level\n1\n", "2: two columns"),
            ("time_s,level\n1,1\nx,0\n", "3: field `time_s`: `x`"),
            ("time_s,level\n1,2\n", "2: field `level`: `2`; allowed is 0 or 1"),
            ("time_s,level\n1,1\n1,0\n", "3: field `time_s`: 1 does not come after 1"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(words), "{text:?}: {error}");
        }
        assert_eq!(parse("time_s,level\n0.5,1\n").unwrap(), [Edge { time_s: 0.5, rising: true }]);
    }
}
