//! `footfall sync`: two clocks, one line. What comes out is the offset and drift that were put in, or a refusal; never a wrong pairing.

use footfall::command::sync::coded;
use footfall::command::sync::edges::Edge;
use footfall::command::sync::paired;
use footfall::command::sync::paired::Fit;
use joint_loop::io::time_code::level;
use proptest::prelude::*;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Numbers from 0 to 1, the same for the same seed.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A clock and how well edges are seen by it.
#[derive(Debug, Clone, Copy)]
struct Recorder {
    offset_s: f64,
    ppm: f64,
    /// Largest error of a time stamp, s.
    jitter_s: f64,
    /// Chance that a pulse is lost.
    lost: f64,
    /// Chance that one of a pulse's edges is lost.
    torn: f64,
    /// Glitches a pulse.
    glitches: f64,
    /// What it records of the line, s of the true time.
    from_s: f64,
    to_s: f64,
}

const PERFECT: Recorder = Recorder {
    offset_s: 0.0,
    ppm: 0.0,
    jitter_s: 0.0,
    lost: 0.0,
    torn: 0.0,
    glitches: 0.0,
    from_s: f64::NEG_INFINITY,
    to_s: f64::INFINITY,
};

impl Recorder {
    /// The edges of pulses (start, width) as this one has them.
    fn sees(&self, line: &[(f64, f64)], random: &mut Random) -> Vec<Edge> {
        let mut edges = vec![];
        for &(start, width) in line.iter().filter(|pulse| (self.from_s..self.to_s).contains(&pulse.0)) {
            let (lost, torn, first) = (random.unit() < self.lost, random.unit() < self.torn, random.unit() < 0.5);
            for (time_s, rising) in [(start, true), (start + width, false)] {
                if !(lost || torn && first == rising) {
                    edges.push((time_s + self.jitter_s * (2.0 * random.unit() - 1.0), rising));
                }
            }
            if random.unit() < self.glitches {
                // Somewhere in the pulse or after it.
                let at = start + 2.0 * width * random.unit();
                let high = (start..start + width).contains(&at);
                edges.extend([(at, !high), (at + 1e-4, high)]);
            }
        }
        edges.sort_by(|one, two| one.0.total_cmp(&two.0));
        let clock = |time_s: f64| self.offset_s + time_s * (1.0 + self.ppm * 1e-6);
        edges.into_iter().map(|(time_s, rising)| Edge { time_s: clock(time_s), rising }).collect()
    }
}

/// A line of pulses at random intervals.
fn random_line(pulses: usize, random: &mut Random) -> Vec<(f64, f64)> {
    let mut at = 3.0;
    let mut pulse = || {
        let interval = 0.1 + 1.4 * random.unit();
        at += interval;
        (at, 0.05 + 0.04 * random.unit())
    };
    (0..pulses).map(|_| pulse()).collect()
}

/// A frame clock that stops so often, for a whole number of frames.
fn gated_line(pulses: usize, frame_s: f64, pauses: usize, random: &mut Random) -> Vec<(f64, f64)> {
    let stops: Vec<(usize, f64)> = (0..pauses)
        .map(|_| ((random.unit() * pulses as f64) as usize, (5.0 + 60.0 * random.unit()).round() * frame_s))
        .collect();
    let late = |n: usize| stops.iter().filter(|stop| stop.0 <= n).map(|stop| stop.1).sum::<f64>();
    (0..pulses).map(|n| (10.0 + n as f64 * frame_s + late(n), 0.5 * frame_s)).collect()
}

/// How far a fit is off at both ends of what it used, s.
fn off(fit: &Fit, board: &Recorder, other: &Recorder) -> f64 {
    let at = |board_s: f64| {
        let truth = (board_s - board.offset_s) / (1.0 + board.ppm * 1e-6);
        let known = other.offset_s + truth * (1.0 + other.ppm * 1e-6);
        (fit.clocks.offset_s + (1.0 + fit.clocks.drift_ppm * 1e-6) * board_s - known).abs()
    };
    at(fit.board_s.0).max(at(fit.board_s.1))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    /// Random pulses: either side starting earlier, lost and extra edges, jitter, drift up to 200 ppm.
    #[test]
    fn offset_and_drift_come_back(
        seed in any::<u64>(), pulses in 40_usize..300, offset_s in -1e4..1e4, ppm in -200.0..200.0, jitter_s in 0.0..0.5e-3,
        lost in 0.0..0.05, torn in 0.0..0.03, glitches in 0.0..0.05, early in -0.3..0.3,
    ) {
        let mut random = Random(seed);
        let line = random_line(pulses, &mut random);
        let cut = line[(pulses as f64 * f64::abs(early)) as usize].0 + 0.001;
        let seen = Recorder { jitter_s, lost, torn, glitches, ..PERFECT };
        let mut board = seen;
        let mut other = Recorder { offset_s, ppm, ..seen };
        (if early < 0.0 { &mut board } else { &mut other }).from_s = cut;
        let (one, two) = (board.sees(&line, &mut random), other.sees(&line, &mut random));
        let fit = paired::fit(&one, &two, false);
        prop_assert!(fit.is_ok(), "{fit:?}");
        let fit = fit.unwrap();
        let off = off(&fit, &board, &other);
        // A straight line through n points that are off by up to the jitter of two recorders: ends within five standard
        // deviations. A glitch beside a lost edge may pass for it, by no more than other pairs are off.
        let sd = 2.0 * jitter_s * (2.0_f64 / 3.0).sqrt() / (fit.used as f64).sqrt();
        prop_assert!(off <= 5.0 * sd + 2e-5, "off by {off} s, expected {sd}: {fit:?}");
        let most = pulses as f64 * (1.0 - f64::abs(early));
        prop_assert!(fit.used as f64 > 0.7 * most, "{} of {most} pulses: {fit:?}", fit.used);
        // A pair is off by two jitters; of n pairs the root mean square is known to a part of 1 / sqrt(2 n), and two glitches may be among them.
        let (used, worst_s) = (fit.used as f64, 5.0 * jitter_s + 3e-5);
        let rms_s = jitter_s * (2.0_f64 / 3.0).sqrt() * (1.0 + 5.0 / (2.0 * used).sqrt()) + worst_s * (2.0 / used).sqrt();
        prop_assert!(fit.clocks.rms_s <= rms_s + 3e-5 && fit.clocks.worst_s <= worst_s, "{fit:?}");
    }

    /// A frame clock with any number of pauses: right, or refused.
    #[test]
    fn a_frame_clock_is_paired_rightly_or_not_at_all(
        seed in any::<u64>(), pulses in 50_usize..600, rate_hz in 5.0..120.0, pauses in 0_usize..4, offset_s in -100.0..100.0,
        ppm in -200.0..200.0, lost in 0.0..0.04, from in 0.0..0.4,
    ) {
        let mut random = Random(seed);
        let line = gated_line(pulses, 1.0 / rate_hz, pauses, &mut random);
        let board = Recorder { lost, jitter_s: 0.2e-3, ..PERFECT };
        let cut = line[(from * pulses as f64) as usize].0 - 0.1 / rate_hz;
        let other = Recorder { offset_s, ppm, from_s: cut, ..board };
        let (one, two) = (board.sees(&line, &mut random), other.sees(&line, &mut random));
        match paired::fit(&one, &two, false) {
            Ok(fit) => {
                let off = off(&fit, &board, &other);
                prop_assert!(off < 0.6e-3, "off by {off} s: {fit:?}");
                prop_assert!(pauses > 0, "nothing tells regular pulses apart: {fit:?}");
            }
            Err(words) => prop_assert!(words.contains("regular") || words.contains("do not pair"), "{words}"),
        }
    }
}

#[test]
fn pauses_tell_regular_pulses_apart() {
    let mut random = Random(7);
    for (rate_hz, pulses) in [(2.0, 100), (25.0, 1_000), (100.0, 20_000)] {
        let mut line = gated_line(pulses, 1.0 / rate_hz, 0, &mut random);
        for (n, pulse) in line.iter_mut().enumerate() {
            // Twice, for 7 and for 12 frames.
            pulse.0 +=
                if n > pulses / 3 { 7.0 / rate_hz } else { 0.0 } + if n > pulses / 2 { 12.0 / rate_hz } else { 0.0 };
        }
        let board = Recorder { offset_s: 3.0, jitter_s: 0.3e-3, ..PERFECT };
        let other = Recorder { offset_s: -20.0, ppm: 120.0, from_s: line[pulses / 5].0 - 0.001, ..board };
        let (one, two) = (board.sees(&line, &mut random), other.sees(&line, &mut random));
        let fit = paired::fit(&one, &two, false).unwrap();
        assert!(off(&fit, &board, &other) < 0.3e-3, "{fit:?}");
        assert_eq!((fit.used, fit.unused), (pulses - pulses / 5, (pulses / 5, 0)));
    }
}

#[test]
fn regular_pulses_are_refused_unless_the_first_is_the_first() {
    let mut random = Random(3);
    let line = gated_line(500, 0.02, 0, &mut random);
    let board = Recorder { jitter_s: 0.2e-3, ..PERFECT };
    let other = Recorder { offset_s: 55.0, ppm: -80.0, ..board };
    let (one, two) = (board.sees(&line, &mut random), other.sees(&line, &mut random));
    let error = paired::fit(&one, &two, false).unwrap_err();
    for words in ["pair in more than one way", "--first-is-first", "pause the pulses three times or more"] {
        assert!(error.contains(words), "{error}");
    }
    let fit = paired::fit(&one, &two, true).unwrap();
    assert!(off(&fit, &board, &other) < 0.1e-3 && fit.used == 500, "{fit:?}");

    // It is not the first, and two pauses say so.
    let mut line = gated_line(500, 0.02, 0, &mut random);
    line.iter_mut().skip(200).for_each(|pulse| pulse.0 += 0.2);
    line.iter_mut().skip(300).for_each(|pulse| pulse.0 += 0.26);
    let (one, two) = (board.sees(&line, &mut random), other.sees(&line[3..], &mut random));
    let error = paired::fit(&one, &two, true).unwrap_err();
    assert!(
        error.contains("with the first pulses taken for the same") || error.contains("the first of each"),
        "{error}"
    );
    assert!(paired::fit(&one, &two, false).is_ok_and(|fit| off(&fit, &board, &other) < 0.1e-3));
}

/// Slots every 100 ms, but widths that carry a code: the pulses pair by their widths.
#[test]
fn a_coded_line_pairs_by_its_widths() {
    let line: Vec<(f64, f64)> = (1..60_000_u32)
        .filter(|tick| level(*tick) && !level(tick - 1))
        .map(|tick| {
            let high = (tick..).take_while(|tick| level(*tick)).count();
            (f64::from(tick) * 1e-3, high as f64 * 1e-3)
        })
        .collect();
    let mut random = Random(11);
    let board = Recorder { lost: 0.01, jitter_s: 0.4e-3, ..PERFECT };
    let other = Recorder { offset_s: 1e3, ppm: 40.0, from_s: 20.0, ..board };
    let (one, two) = (board.sees(&line, &mut random), other.sees(&line, &mut random));
    let fit = paired::fit(&one, &two, false).unwrap();
    assert!(off(&fit, &board, &other) < 0.2e-3 && fit.used > 370, "{fit:?}");
    // And by its code alone, on a board whose input recorded another board's output.
    let fit = coded::fit(&two).unwrap();
    assert!((fit.clocks.offset_s - 1e3).abs() < 1e-3 && (fit.clocks.drift_ppm - 40.0).abs() < 5.0, "{fit:?}");
}

#[test]
fn recordings_of_different_lines_are_refused() {
    let mut random = Random(5);
    let (one, two) = (random_line(100, &mut random), random_line(100, &mut random));
    let (one, two) = (PERFECT.sees(&one, &mut random), PERFECT.sees(&two, &mut random));
    let error = paired::fit(&one, &two, false).unwrap_err();
    assert!(
        error.contains("the board's 100 pulses and the recorder's 100 do not pair; allowed are two recordings of"),
        "{error}"
    );
    let error = paired::fit(&one, &two, true).unwrap_err();
    assert!(error.contains("the first of each taken for the same"), "{error}");
    let error = paired::fit(&one[..4], &two, false).unwrap_err();
    assert!(error.contains("the board has 2 pulses; allowed are 4 or more"), "{error}");
    let error = paired::fit(&one, &[], false).unwrap_err();
    assert!(error.contains("the recorder has 0 pulses"), "{error}");
    // A clock that runs a tenth of a percent fast.
    let fast: Vec<Edge> = one.iter().map(|edge| Edge { time_s: edge.time_s * 1.001, ..*edge }).collect();
    let error = paired::fit(&one, &fast, false).unwrap_err();
    assert!(error.contains("a clock drift up to 300 ppm"), "{error}");
    // A clock that was set in the middle.
    let set: Vec<Edge> = one
        .iter()
        .map(|edge| Edge { time_s: edge.time_s + if edge.time_s > 40.0 { 5.0 } else { 0.0 }, ..*edge })
        .collect();
    assert!(paired::fit(&one, &set, false).is_err());
}

fn sync(arguments: &[&Path], more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footfall"));
    command.arg("sync").args(arguments).args(more).stdin(Stdio::null()).output().unwrap()
}

fn file(folder: &tempfile::TempDir, name: &str, edges: &[Edge]) -> PathBuf {
    let mut text = "time_s,level\n".to_owned();
    for edge in edges {
        let _ = writeln!(text, "{:.9},{}", edge.time_s, u8::from(edge.rising));
    }
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn the_command_prints_offset_drift_and_used_pulses() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(1);
    let line = random_line(200, &mut random);
    let other = Recorder { offset_s: 12.5, ppm: 50.0, from_s: line[50].0 - 0.01, ..PERFECT };
    let board = file(&folder, "walk.edges.csv", &PERFECT.sees(&line, &mut random));
    let recorder = file(&folder, "mocap.csv", &other.sees(&line, &mut random));
    let against = Path::new("--against");
    let output = sync(&[&board, against, &recorder], &["--json"]);
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!((object["offset_s"].as_f64().unwrap() - 12.5).abs() < 1e-6, "{object}");
    assert!((object["drift_ppm"].as_f64().unwrap() - 50.0).abs() < 0.01, "{object}");
    assert!(object["rms_s"].as_f64().unwrap() < 1e-8 && object["worst_s"].as_f64().unwrap() < 1e-8, "{object}");
    assert_eq!((object["pulses_used"].as_u64(), object["pulses_unused"].as_u64()), (Some(150), Some(50)));
    assert_eq!(
        (object["board_pulses_unused"].as_u64(), object["recorder_pulses_unused"].as_u64()),
        (Some(50), Some(0))
    );
    let text = String::from_utf8(sync(&[&board, against, &recorder], &[]).stdout).unwrap();
    assert!(text.starts_with("recorder time = 12.5") && text.contains("drift +50.00 ppm"), "{text}");
    assert!(text.contains("150 pulses used; not used: 50 of the board's, 0 of the recorder's"), "{text}");

    let failed = |output: Output, code: i32, words: &str| {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(code) && said.contains(words) && output.stdout.is_empty(), "{said}");
    };
    let regular = file(&folder, "regular.csv", &PERFECT.sees(&gated_line(100, 0.1, 0, &mut random), &mut random));
    failed(sync(&[&regular, against, &regular], &[]), 1, "regular.csv: the pulses are so regular");
    failed(sync(&[&board, Path::new("--first-is-first")], &[]), 2, "--against");
    failed(sync(&[&board, against, &folder.path().join("none.csv")], &[]), 2, "none.csv");
    let bad = folder.path().join("bad.csv");
    std::fs::write(&bad, "time_s,level\n1,1\n0.5,0\n").unwrap();
    failed(sync(&[&board, against, &bad], &[]), 2, "bad.csv:3: field `time_s`: 0.5 does not come after 1");
}
