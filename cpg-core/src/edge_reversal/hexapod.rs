//! The hexapod of twelve neurons: a 2 x 3 ladder of flexors (top, middle, bottom; left and right), each with one extensor.
//!
//! Yang et al. 2014, fig 2, as edge reversal ([`crate::edge_reversal::smer`]): 12 nodes, 13 edges. Flexors have reversibility R, extensors 1
//! (the roles of eq 1; with those of the paper's Table 1 the gait would be the tripod for every R). A leg swings while its flexor fires. R = 5 is the
//! slow metachronal wave (period 6 steps, each leg swings in 1 of 6), R = 3 the middle gait (period 4), R = 1 the tripod (period 2).
//!
//! A change R -> R2 keeps the direction of every flexor-flexor edge (its R tokens become R2) and clamps each flexor's tokens against
//! its extensor to R2; from every phase of 5 -> 3 -> 1 the ladder stays live and settles within 3 steps, upward within 6. The circulation of
//! the ladder's cycles is conserved, so wave and tripod can change into one another only because both are in class (0, 0, 0).

use crate::edge_reversal::smer::{Edge, Fired, MAX_REVERSIBILITY, Smer, SmerError};

/// A leg, in the order of every array of six: top, middle, bottom of the left side, then of the right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Leg {
    /// Top left.
    TopLeft = 0,
    /// Middle left.
    MiddleLeft = 1,
    /// Bottom left.
    BottomLeft = 2,
    /// Top right.
    TopRight = 3,
    /// Middle right.
    MiddleRight = 4,
    /// Bottom right.
    BottomRight = 5,
}

impl Leg {
    /// All legs in order.
    pub const ALL: [Leg; 6] =
        [Leg::TopLeft, Leg::MiddleLeft, Leg::BottomLeft, Leg::TopRight, Leg::MiddleRight, Leg::BottomRight];

    /// Two letters, as in the paper: `TL`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Leg::TopLeft => "TL",
            Leg::MiddleLeft => "ML",
            Leg::BottomLeft => "BL",
            Leg::TopRight => "TR",
            Leg::MiddleRight => "MR",
            Leg::BottomRight => "BR",
        }
    }
}

/// The legs that swing in one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Swings(Fired);

impl Swings {
    /// Whether this leg swings.
    #[must_use]
    pub const fn contains(self, leg: Leg) -> bool {
        self.0.contains(leg as usize)
    }

    /// The legs that swing, in the order of [`Leg::ALL`].
    pub fn legs(self) -> impl Iterator<Item = Leg> {
        Leg::ALL.into_iter().filter(move |&leg| self.contains(leg))
    }
}

impl core::fmt::Display for Swings {
    /// `ML+BR`, or `-` if no leg swings.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mut separator = "";
        for leg in self.legs() {
            write!(f, "{separator}{}", leg.name())?;
            separator = "+";
        }
        if separator.is_empty() { f.write_str("-") } else { Ok(()) }
    }
}

/// Flexor-flexor edges of the ladder: left side, right side, the three rungs.
const LADDER: [(u8, u8); 7] = [(0, 1), (1, 2), (3, 4), (4, 5), (0, 3), (1, 4), (2, 5)];

/// The ends that hold the tokens at the start of the wave, in the order of [`LADDER`]: the first end of each rung, else the second.
const FIRST_END_HOLDS: [bool; 7] = [false, false, false, false, true, true, true];

/// Tokens of each flexor against its extensor at the start of the wave with R = 5.
const WAVE_TOKENS: [u32; 6] = [3, 4, 5, 0, 1, 2];

/// The ladder with its tokens.
///
/// ```
/// use cpg_core::edge_reversal::hexapod::Hexapod;
/// let mut wave = Hexapod::new(5)?;
/// let steps: Vec<String> = (0..6).map(|_| wave.step().to_string()).collect();
/// assert_eq!(steps.join(" "), "BL ML TL BR MR TR");
/// # Ok::<(), cpg_core::edge_reversal::smer::SmerError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hexapod {
    graph: Smer<12, 13>,
    reversibility: u32,
}

impl Hexapod {
    /// Starts in the class of the wave and the tripod with the flexors' reversibility R: 5 wave, 3 middle gait, 1 tripod.
    ///
    /// # Errors
    /// [`SmerError::Reversibility`] outside 1 to [`MAX_REVERSIBILITY`].
    pub fn new(reversibility: u32) -> Result<Self, SmerError> {
        Self::assemble(reversibility, FIRST_END_HOLDS, WAVE_TOKENS)
    }

    /// Changes the gait at any step by the rule above.
    ///
    /// # Errors
    /// As [`Hexapod::new`]; the running gait is then unchanged.
    pub fn set_reversibility(&mut self, reversibility: u32) -> Result<(), SmerError> {
        let (ladder, pendants) = self.graph.edges().split_at(LADDER.len());
        let mut first_end_holds = [false; 7];
        for (holds, edge) in first_end_holds.iter_mut().zip(ladder) {
            *holds = edge.tokens_at_a > 0;
        }
        let mut tokens = [0; 6];
        for (tokens, edge) in tokens.iter_mut().zip(pendants) {
            *tokens = edge.tokens_at_a;
        }
        *self = Self::assemble(reversibility, first_end_holds, tokens)?;
        Ok(())
    }

    /// One step: the legs that swing during it.
    pub fn step(&mut self) -> Swings {
        let fired = self.graph.step();
        Swings(Fired(fired.0 & 0b11_1111))
    }

    /// The flexors' reversibility R: a leg stands for R steps between swings.
    #[must_use]
    pub const fn reversibility(&self) -> u32 {
        self.reversibility
    }

    /// The graph: flexors are nodes 0 to 5, their extensors 6 to 11.
    #[must_use]
    pub const fn graph(&self) -> &Smer<12, 13> {
        &self.graph
    }

    fn assemble(reversibility: u32, first_end_holds: [bool; 7], tokens: [u32; 6]) -> Result<Self, SmerError> {
        if reversibility == 0 || reversibility > MAX_REVERSIBILITY {
            return Err(SmerError::Reversibility { node: 0 });
        }
        let ladder = LADDER.iter().zip(first_end_holds).map(|(&(a, b), first)| Edge {
            a,
            b,
            tokens_at_a: if first { reversibility } else { 0 },
        });
        let pendants = (0u8..6).zip(tokens).map(|(leg, tokens)| Edge {
            a: leg,
            b: leg + 6,
            tokens_at_a: tokens.min(reversibility),
        });
        let mut edges = [Edge { a: 0, b: 0, tokens_at_a: 0 }; 13];
        for (place, edge) in edges.iter_mut().zip(ladder.chain(pendants)) {
            *place = edge;
        }
        let r = reversibility;
        // The extensors hang on one edge each and never decide liveness; the ladder, all of one reversibility, is live iff acyclic.
        let graph = Smer::unproven([r, r, r, r, r, r, 1, 1, 1, 1, 1, 1], edges)?;
        if graph.is_acyclic_among(0b11_1111) {
            Ok(Self { graph, reversibility })
        } else {
            Err(SmerError::Deadlock { step: 0 })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(hexapod: &mut Hexapod, n: usize) -> Vec<String> {
        (0..n).map(|_| hexapod.step().to_string()).collect()
    }

    fn repeat(cycle: &[&str], from: usize, n: usize) -> Vec<String> {
        (from..from + n).map(|i| cycle[i % cycle.len()].to_string()).collect()
    }

    const WAVE: [&str; 6] = ["BL", "ML", "TL", "BR", "MR", "TR"];
    const MIDDLE: [&str; 4] = ["BL", "ML+BR", "TL+MR", "TR"];
    const TRIPOD: [&str; 2] = ["TL+BL+MR", "ML+TR+BR"];

    #[test]
    fn wave_then_middle_gait_then_tripod_word_for_word() {
        let mut hexapod = Hexapod::new(5).unwrap();
        assert_eq!(steps(&mut hexapod, 54), repeat(&WAVE, 0, 54));
        hexapod.set_reversibility(3).unwrap();
        assert_eq!(steps(&mut hexapod, 46), repeat(&MIDDLE, 0, 46));
        hexapod.set_reversibility(1).unwrap();
        assert_eq!(steps(&mut hexapod, 40), repeat(&TRIPOD, 0, 40));
    }

    #[test]
    fn ten_million_steps_of_the_wave_do_not_drift() {
        let mut hexapod = Hexapod::new(5).unwrap();
        for step in 0..10_000_000u32 {
            let fired = hexapod.step();
            if step % 1_000_003 == 0 {
                assert_eq!(fired.to_string(), WAVE[step as usize % 6], "step {step}");
            }
        }
        assert_eq!(steps(&mut hexapod, 6), repeat(&WAVE, 10_000_000 % 6, 6));
    }

    /// From every phase of every gait to every other: stays live, settles in at most so many steps to the right period.
    #[test]
    fn every_change_from_every_phase_settles() {
        for (from, to, bound) in [(5, 3, 2), (3, 1, 3), (5, 1, 3), (1, 3, 6), (3, 5, 6), (1, 5, 6)] {
            for phase in 0..from + 1 {
                let mut hexapod = Hexapod::new(from).unwrap();
                steps(&mut hexapod, (24 + phase) as usize);
                hexapod.set_reversibility(to).unwrap();
                let word = steps(&mut hexapod, 60);
                let period = to as usize + 1;
                let settled = (0..40).find(|&k| (k..60 - period).all(|i| word[i] == word[i + period]));
                assert!(settled.is_some_and(|k| k <= bound), "{from} to {to} at phase {phase}: {settled:?}");
                let cycle = hexapod.graph().cycle().unwrap();
                assert_eq!(cycle.period, to + 1);
                assert!(cycle.operations[..6].iter().all(|&n| n == 1), "every leg swings once: {cycle:?}");
                assert!(cycle.operations[6..].iter().all(|&n| n == to), "every extensor {to} times: {cycle:?}");
            }
        }
    }

    /// Neighbouring legs never swing together in any gait, so the hexapod never stands on fewer than three legs.
    #[test]
    fn neighbours_never_swing_together() {
        for reversibility in 1..20 {
            let mut hexapod = Hexapod::new(reversibility).unwrap();
            for _ in 0..200 {
                let swings = hexapod.step();
                assert!(swings.legs().count() <= 3);
                for (a, b) in LADDER {
                    assert!(!(swings.0.contains(a as usize) && swings.0.contains(b as usize)));
                }
            }
        }
    }

    /// All 128 orientations of the ladder at R = 1.
    #[test]
    fn census_of_the_ladder() {
        let (mut live, mut tripod, mut four, mut six) = (0, 0, 0, 0);
        for mask in 0..128u32 {
            let holds = core::array::from_fn(|i| mask >> i & 1 == 1);
            match Hexapod::assemble(1, holds, [0; 6]) {
                Ok(hexapod) => {
                    live += 1;
                    match hexapod.graph().cycle().unwrap().period {
                        2 => tripod += 1,
                        4 => four += 1,
                        6 => six += 1,
                        other => panic!("period {other}"),
                    }
                }
                Err(error) => assert_eq!(error, SmerError::Deadlock { step: 0 }),
            }
        }
        assert_eq!((live, tripod, four, six), (98, 18, 68, 12));
    }

    #[test]
    fn circulation_class_is_kept_by_steps_and_changes() {
        let mut hexapod = Hexapod::new(5).unwrap();
        let ring = [0, 1, 2, 5, 4, 3];
        for reversibility in [5, 3, 1, 3, 5, 1] {
            hexapod.set_reversibility(reversibility).unwrap();
            for _ in 0..13 {
                hexapod.step();
                assert_eq!(hexapod.graph().circulation(&ring), Some(0));
                assert_eq!(hexapod.graph().circulation(&[0, 1, 4, 3]), Some(0));
                assert_eq!(hexapod.graph().circulation(&[1, 2, 5, 4]), Some(0));
            }
        }
    }

    #[test]
    fn bad_reversibility_is_refused_and_the_gait_goes_on() {
        assert!(Hexapod::new(0).is_err());
        let mut hexapod = Hexapod::new(5).unwrap();
        let before = hexapod.clone();
        assert_eq!(hexapod.set_reversibility(0), Err(SmerError::Reversibility { node: 0 }));
        assert_eq!(hexapod, before);
    }
}
