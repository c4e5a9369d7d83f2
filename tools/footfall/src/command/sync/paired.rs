//! Finds which pulses of two recordings of one line, each with its own clock, are the same.
//!
//! A guess takes one pulse of each recording for the same. It is extended outwards: with a clock drift of at most [`MOST_PPM`] the next
//! pulses must be where the guess predicts them; the more are, the better the drift is known, and the further the next ones are
//! searched. The score of a guess counts the pulses with a partner, minus those without one while the other recording was
//! running. A pulse is compared with its width where both recordings have one, so that regular pulses of changing width can be
//! paired.
//!
//! The best guess is accepted only if no other one can be true: any other pairing of at least half as many pulses must leave more of them
//! without a partner than chance explains. Pulses at a constant rate pair almost as well when they are shifted, and then some of the
//! places where each recording lost a pulse coincide: at n places, of which each recording lost a share p, Poisson(n p^2) of them. Each
//! coincidence saves two pulses without a partner, as the true pairing of one pause in the line does. The margin is the number of
//! coincidences that is less likely than [`CHANCE`] in any of n shifts.

use super::clocks::{Clocks, outlier_s};
use super::edges::{Edge, Pulse, pulses};
use crate::line_fit::line_fit;
use std::ops::Range;

/// Largest drift, parts per million; twenty times that of a crystal.
pub const MOST_PPM: f64 = 300.0;
/// Largest difference of two times of the same pulse, s: two recorders with a period of 1 ms are within one.
pub const TOLERANCE_S: f64 = 0.002;
/// The same as a share of the usual time between two pulses.
const TOLERANCE_SHARE: f64 = 0.2;
/// While the drift is unknown, pulses are searched within this share of the time between two pulses.
const REACH_SHARE: f64 = 0.4;
/// Fewest pairs.
pub const FEWEST: usize = 4;
/// Smallest share of pulses with a partner, while both recordings run.
pub const LEAST_SHARE: f64 = 0.6;
/// Largest probability that another pairing is the true one.
pub const CHANCE: f64 = 1e-3;

/// Pulses to either side that the first score uses.
const NEAR: usize = 20;
/// Number of guesses that are extended for each anchor.
const FOLLOWED: usize = 24;

/// The relation of the two clocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The line.
    pub clocks: Clocks,
    /// Pairs that were used.
    pub used: usize,
    /// Pulses that were not used, of the board and of the recorder: lost by the other one, glitches, or outside of the common time.
    pub unused: (usize, usize),
    /// Board time of the first and of the last pair, s.
    pub board_s: (f64, f64),
}

/// A recording of pulses, and their usual distance.
struct Train {
    pulses: Vec<Pulse>,
    interval_s: f64,
}

impl Train {
    fn of(edges: &[Edge], whose: &str) -> Result<Self, String> {
        let pulses = pulses(edges);
        if pulses.len() < FEWEST {
            return Err(format!("the {whose} has {} pulses; allowed are {FEWEST} or more", pulses.len()));
        }
        let mut intervals: Vec<f64> = pulses.windows(2).map(|two| two[1].time_s - two[0].time_s).collect();
        intervals.sort_by(f64::total_cmp);
        // The lower quartile is affected neither by glitches nor by pauses.
        Ok(Self { interval_s: intervals[intervals.len() / 4], pulses })
    }

    fn time(&self, n: usize) -> f64 {
        self.pulses[n].time_s
    }

    fn ends(&self) -> (f64, f64) {
        (self.time(0), self.time(self.pulses.len() - 1))
    }
}

/// A guess extended over the recordings.
#[derive(Debug, Clone)]
struct Pairing {
    /// Pulse of the board, pulse of the recorder.
    pairs: Vec<(usize, usize)>,
    /// Pulses without a partner while the other recorder was running.
    alone: usize,
    /// Offset and slope.
    line: (f64, f64),
}

impl Pairing {
    fn score(&self) -> i64 {
        self.pairs.len() as i64 - self.alone as i64
    }

    fn at(&self, board_s: f64) -> f64 {
        self.line.0 + self.line.1 * board_s
    }
}

struct Search<'a> {
    board: &'a Train,
    other: &'a Train,
    tolerance_s: f64,
    reach_s: f64,
}

impl Search<'_> {
    fn others(&self) -> Range<usize> {
        0..self.other.pulses.len()
    }

    /// The first pulse of the other recording at or after a time, in a range.
    fn at_or_after(&self, time_s: f64, among: &Range<usize>) -> usize {
        among.start + self.other.pulses[among.clone()].partition_point(|pulse| pulse.time_s < time_s)
    }

    /// The pulse of the other recording nearest to a time, in a range.
    fn nearest(&self, time_s: f64, among: &Range<usize>) -> usize {
        let after = self.at_or_after(time_s, among);
        let before = after.saturating_sub(1).max(among.start);
        let nearer = after < among.end && self.other.time(after) - time_s < time_s - self.other.time(before);
        if nearer { after } else { before }
    }

    fn same_width(&self, n: usize, m: usize) -> bool {
        let widths = self.board.pulses[n].width_s.zip(self.other.pulses[m].width_s);
        widths.is_none_or(|(a, b)| (a - b).abs() <= 2.0 * self.tolerance_s)
    }

    /// Pairs and pulses without a partner, in a range of the board's pulses and a range of the other's; `expected` gives the time on the other
    /// clock and its tolerance.
    fn pairs(
        &self,
        range: Range<usize>,
        among: Range<usize>,
        expected: impl Fn(f64) -> (f64, f64),
        with_width: bool,
    ) -> (Vec<(usize, usize)>, usize) {
        let (first, last) = self.other.ends();
        let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
        let (mut alone, mut from, mut to) = (0, f64::INFINITY, f64::NEG_INFINITY);
        for n in range {
            let (time_s, off_s) = expected(self.board.time(n));
            if time_s < first - off_s || time_s > last + off_s {
                continue;
            }
            (from, to) = (from.min(time_s - off_s), to.max(time_s + off_s));
            let m = self.nearest(time_s, &among);
            let by = (self.other.time(m) - time_s).abs();
            if by > off_s || (with_width && !self.same_width(n, m)) {
                alone += 1;
                continue;
            }
            match pairs.last_mut() {
                // Of two candidates for one pulse the nearer is taken.
                Some(before) if before.1 == m => {
                    alone += 1;
                    if by < before.2 {
                        *before = (n, m, by);
                    }
                }
                _ => pairs.push((n, m, by)),
            }
        }
        let theirs = self.at_or_after(to, &among).saturating_sub(self.at_or_after(from, &among));
        alone += theirs - pairs.len().min(theirs);
        (pairs.into_iter().map(|(n, m, _)| (n, m)).collect(), alone)
    }

    /// A first score of a guess, from the pulses near it.
    fn near(&self, n: usize, m: usize) -> i64 {
        let (x0, y0) = (self.board.time(n), self.other.time(m));
        let range = n.saturating_sub(NEAR)..(n + NEAR + 1).min(self.board.pulses.len());
        let among = m.saturating_sub(4 * NEAR)..(m + 4 * NEAR).min(self.other.pulses.len());
        let expected = |x: f64| (y0 + x - x0, (self.tolerance_s + MOST_PPM * 1e-6 * (x - x0).abs()).min(self.reach_s));
        let (pairs, alone) = self.pairs(range, among, expected, true);
        pairs.len() as i64 - alone as i64
    }

    /// Extends a guess.
    fn follow(&self, n: usize, m: usize) -> Pairing {
        let x0 = self.board.time(n);
        let (mut at_x0, mut slope, mut slope_off) = (self.other.time(m), 1.0, MOST_PPM * 1e-6);
        let mut covered = 0;
        loop {
            let radius = (self.reach_s - self.tolerance_s) / slope_off;
            let from = self.board.pulses.partition_point(|pulse| pulse.time_s < x0 - radius);
            let to = self.board.pulses.partition_point(|pulse| pulse.time_s <= x0 + radius);
            let expected =
                |x: f64| (at_x0 + slope * (x - x0), (self.tolerance_s + slope_off * (x - x0).abs()).min(self.reach_s));
            let (pairs, alone) = self.pairs(from..to, self.others(), expected, true);
            let points: Vec<_> = pairs.iter().map(|&(n, m)| (self.board.time(n) - x0, self.other.time(m))).collect();
            let span = points.last().map_or(0.0, |last| last.0 - points[0].0);
            let few = points.len() < FEWEST || span <= 0.0;
            let limit = MOST_PPM * 1e-6;
            if !few {
                (at_x0, slope) = line_fit(&points);
                slope = slope.clamp(1.0 - limit, 1.0 + limit);
            }
            if few || to - from <= covered {
                return Pairing { pairs, alone, line: (at_x0 - slope * x0, slope) };
            }
            covered = to - from;
            // Six standard deviations of a slope through equally spaced points with an error of half the tolerance.
            let known = 10.0 * self.tolerance_s / ((points.len() as f64).sqrt() * span);
            slope_off = known.min(limit);
        }
    }

    /// Pulses to start from: those after the longest pauses, and some in between.
    fn anchors(&self) -> Vec<usize> {
        let all = self.board.pulses.len();
        let mut by_pause: Vec<usize> = (1..all).collect();
        by_pause.sort_by(|&a, &b| {
            let pause = |n: usize| self.board.time(n) - self.board.time(n - 1);
            pause(b).total_cmp(&pause(a))
        });
        let spread = (0..8).map(|part| (2 * part + 1) * all / 16);
        let mut anchors: Vec<usize> = by_pause.into_iter().take(6).chain(spread).collect();
        anchors.sort_unstable();
        anchors.dedup();
        anchors
    }

    /// The best guesses, extended.
    fn pairings(&self) -> Vec<Pairing> {
        let (all, others) = (self.board.pulses.len(), self.other.pulses.len());
        let mut found = Vec::new();
        for n in self.anchors() {
            // Of equal scores the longest common time comes first.
            let common = |m: usize| n.min(m) + (all - n).min(others - m);
            let mut guesses: Vec<(i64, usize)> = (0..others).map(|m| (self.near(n, m), m)).collect();
            guesses.sort_by_key(|&(score, m)| std::cmp::Reverse((score, common(m))));
            found
                .extend(guesses.iter().take(FOLLOWED).filter(|(score, _)| *score > 0).map(|&(_, m)| self.follow(n, m)));
        }
        found
    }

    /// Whether two pairings are the same.
    fn same(&self, one: &Pairing, two: &Pairing) -> bool {
        let (first, last) = self.board.ends();
        let (o, t) = (one.pairs.len() / 2, two.pairs.len() / 2);
        // Compared where each has its pairs; at the ends a badly known drift may separate them.
        [one.pairs[o].0, two.pairs[t].0]
            .into_iter()
            .map(|n| self.board.time(n).clamp(first, last))
            .any(|at| (one.at(at) - two.at(at)).abs() < self.reach_s)
    }
}

/// The margin: how many more pulses without a partner rule out another pairing.
fn telling_of(best: &Pairing) -> usize {
    let n = best.pairs.len() as f64;
    let lost = (best.alone + 1) as f64 / (2.0 * (n + 1.0));
    let mean = n * lost * lost;
    let at_least = |least: usize| {
        let mut term = (-mean).exp();
        let mut tail = 0.0;
        for k in 1..least + 60 {
            term *= mean / k as f64;
            tail += if k >= least { term } else { 0.0 };
        }
        n * tail
    };
    // With a loss of 3 pulses in 4 there would be no pairing; the condition is met far earlier.
    2 * (2..=best.pairs.len()).find(|&least| at_least(least) < CHANCE).unwrap_or(best.pairs.len())
}

/// The relation of the two clocks.
///
/// # Errors
/// Too few pulses, nothing in common, or pulses so regular that they pair in more than one way.
pub fn fit(board: &[Edge], other: &[Edge], first_is_first: bool) -> Result<Fit, String> {
    let (board, other) = (Train::of(board, "board")?, Train::of(other, "recorder")?);
    let interval_s = board.interval_s.min(other.interval_s);
    let tolerance_s = TOLERANCE_S.min(TOLERANCE_SHARE * interval_s);
    let search = Search { board: &board, other: &other, tolerance_s, reach_s: REACH_SHARE * interval_s };
    let mut pairings = search.pairings();
    pairings.retain(|pairing| pairing.pairs.len() >= FEWEST);
    pairings.sort_by_key(|pairing| std::cmp::Reverse(pairing.score()));
    let share =
        |pairing: &Pairing| pairing.pairs.len() as f64 / (pairing.pairs.len() as f64 + 0.5 * pairing.alone as f64);
    let best = if first_is_first { Some(search.follow(0, 0)) } else { pairings.first().cloned() };
    let best = best.filter(|best| best.pairs.len() >= FEWEST && share(best) >= LEAST_SHARE).ok_or_else(|| {
        let (ours, theirs) = (board.pulses.len(), other.pulses.len());
        let how = if first_is_first { ", the first of each taken for the same" } else { "" };
        format!(
            "the board's {ours} pulses and the recorder's {theirs} do not pair{how}; allowed are two recordings of the same line, of one time, \
             with a clock drift up to {MOST_PPM} ppm"
        )
    })?;
    let telling = telling_of(&best);
    let rivals = |pairing: &&Pairing| {
        2 * pairing.pairs.len() >= best.pairs.len()
            && pairing.alone < best.alone + telling
            && !search.same(pairing, &best)
    };
    let better = |pairing: &&Pairing| {
        pairing.alone + telling_of(pairing) <= best.alone && pairing.pairs.len() > best.pairs.len()
    };
    if first_is_first {
        if let Some(rival) = pairings.iter().find(better) {
            let by = rival.at(board.time(0)) - other.time(0);
            return Err(format!(
                "with the first pulses taken for the same, {} pulses have no partner; shifted by {by:+.3} s, {}: a first pulse is missing",
                best.alone, rival.alone
            ));
        }
    } else if let Some(rival) = pairings.iter().find(rivals) {
        let middle = board.time(best.pairs[best.pairs.len() / 2].0);
        let by = (rival.at(middle) - best.at(middle)).abs();
        return Err(format!(
            "the pulses are so regular that they pair in more than one way, for one {by:.3} s apart ({} pairs and {} without a partner, or {} and {}); \
             allowed is --first-is-first, if both recordings hold the first pulse of the line, or a line that is not regular: pause the pulses \
             three times or more, and the more often the more of them are lost",
            best.pairs.len(),
            best.alone,
            rival.pairs.len(),
            rival.alone
        ));
    }
    // Widths are no longer used: a pulse whose end was lost or cut still has its beginning.
    let (mut offset, mut slope) = best.line;
    let (mut pairs, mut off_s) = (Vec::new(), tolerance_s);
    for _ in 0..4 {
        (pairs, _) = search.pairs(0..board.pulses.len(), search.others(), |x| (offset + slope * x, off_s), false);
        if pairs.len() < FEWEST {
            return Err("no straight line goes through the pairs: was one of the clocks set in between?".into());
        }
        let points: Vec<_> = pairs.iter().map(|&(n, m)| (board.time(n), other.time(m))).collect();
        (offset, slope) = line_fit(&points);
        // A glitch near a lost pulse is not its partner.
        off_s = tolerance_s.min(outlier_s(&points, (offset, slope)));
    }
    if 2 * pairs.len() < best.pairs.len() {
        return Err("no straight line goes through the pairs: was one of the clocks set in between?".into());
    }
    let points: Vec<_> = pairs.iter().map(|&(n, m)| (board.time(n), other.time(m))).collect();
    let used = pairs.len();
    Ok(Fit {
        clocks: Clocks::of(&points),
        used,
        unused: (board.pulses.len() - used, other.pulses.len() - used),
        board_s: (points[0].0, points[used - 1].0),
    })
}
