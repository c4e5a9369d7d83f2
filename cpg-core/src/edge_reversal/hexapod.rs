//! The hexapod of twelve neurons: a 2 x 3 ladder of flexors (top, middle, bottom; left and right), each with one extensor.
//!
//! Yang et al. 2014, fig 2, as edge reversal ([`crate::edge_reversal::smer`]): 12 nodes, 13 edges. Flexors have reversibility R, extensors 1
//! (the roles of eq 1; with those of the paper's Table 1 the gait would be the tripod for every R). A leg swings while its flexor fires. R = 5 is the
//! slow metachronal wave (period 6 steps, each leg swings in 1 of 6), R = 3 the middle gait (period 4), R = 1 the tripod (period 2).
//!
//! A change R -> R2 keeps the direction of every flexor-flexor edge (its R tokens become R2) and clamps each flexor's tokens against
//! its extensor to R2; between 5, 3 and 1, from every phase, the ladder stays live and settles within 4 steps, in every class.
//!
//! The ladder may start with any of its 98 live orientations ([`crate::edge_reversal::ladder`]). Steps and changes conserve the circulation
//! of its cycles, so wave and tripod can change into one another only because both are in class (0, 0, 0).

use crate::edge_reversal::ladder::{Circulation, DirectedCycle, EDGES};
pub use crate::edge_reversal::ladder::{Leg, Orientation};
use crate::edge_reversal::smer::{Edge, Fired, MAX_REVERSIBILITY, Smer, SmerError};

/// The legs that swing in one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Swings(Fired);

impl Swings {
    /// The legs whose flexors fired in a graph in which the flexors are nodes 0 to 5, in the order of [`Leg::ALL`].
    #[must_use]
    pub const fn of(fired: Fired) -> Self {
        Self(Fired(fired.0 & 0b11_1111))
    }

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

/// Why a hexapod was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum HexapodError {
    /// The reversibility is 0 or above [`MAX_REVERSIBILITY`].
    Reversibility,
    /// The orientation is dead: on this cycle each leg waits for the next.
    Dead {
        /// What was asked for.
        orientation: Orientation,
        /// The directed cycle.
        cycle: DirectedCycle,
    },
}

impl core::fmt::Display for HexapodError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Reversibility => write!(f, "reversibility of the flexors: 1 to {MAX_REVERSIBILITY} is allowed"),
            Self::Dead { orientation, cycle } => write!(
                f,
                "orientation {orientation}: dead, because {cycle} is directed: each of its legs waits for the next, and none can swing; \
                 allowed are the 98 orientations without a directed cycle"
            ),
        }
    }
}

impl core::error::Error for HexapodError {}

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
    period: u32,
}

impl Hexapod {
    /// Starts in the class of the wave and the tripod ([`Orientation::WAVE`]) with the flexors' reversibility R: 5 wave, 3 middle gait, 1
    /// tripod.
    ///
    /// # Errors
    /// [`SmerError::Reversibility`] outside 1 to [`MAX_REVERSIBILITY`].
    pub fn new(reversibility: u32) -> Result<Self, SmerError> {
        Self::assemble(reversibility, Orientation::WAVE, start_tokens(Orientation::WAVE))
    }

    /// Starts with any live orientation of the ladder. The legs begin to swing in its [`Orientation::start_order`].
    ///
    /// ```
    /// use cpg_core::edge_reversal::hexapod::Hexapod;
    /// // A class whose ring has the circulation 4: even at R = 1 one leg swings at a time.
    /// let mut ring = Hexapod::with_orientation(1, "dd-du-lrr".parse()?)?;
    /// assert_eq!((ring.circulation().ring(), ring.period()), (4, 6));
    /// // Here each leg of the upper cycle waits for the next.
    /// assert!(Hexapod::with_orientation(1, "dd-uu-lrr".parse()?).is_err());
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The reversibility is outside 1 to [`MAX_REVERSIBILITY`], or the orientation is dead.
    pub fn with_orientation(reversibility: u32, orientation: Orientation) -> Result<Self, HexapodError> {
        if let Some(cycle) = orientation.directed_cycle() {
            return Err(HexapodError::Dead { orientation, cycle });
        }
        Self::assemble(reversibility, orientation, start_tokens(orientation)).map_err(|_| HexapodError::Reversibility)
    }

    /// Changes the gait at any step by the rule above.
    ///
    /// # Errors
    /// As [`Hexapod::new`]; the running gait is then unchanged.
    pub fn set_reversibility(&mut self, reversibility: u32) -> Result<(), SmerError> {
        let mut tokens = [0; 6];
        for (tokens, edge) in tokens.iter_mut().zip(self.graph.edges().iter().skip(EDGES.len())) {
            *tokens = edge.tokens_at_a;
        }
        *self = Self::assemble(reversibility, self.orientation(), tokens)?;
        Ok(())
    }

    /// The orientation of the ladder now.
    #[must_use]
    pub fn orientation(&self) -> Orientation {
        let mut first_ends = [false; 7];
        for (first, edge) in first_ends.iter_mut().zip(self.graph.edges()) {
            *first = edge.tokens_at_a > 0;
        }
        Orientation::from_first_ends(first_ends)
    }

    /// The class, which steps and changes of gait conserve.
    #[must_use]
    pub fn circulation(&self) -> Circulation {
        self.orientation().circulation()
    }

    /// Steps in which every leg swings once, after the transient.
    #[must_use]
    pub const fn period(&self) -> u32 {
        self.period
    }

    /// One step: the legs that swing during it.
    pub fn step(&mut self) -> Swings {
        Swings::of(self.graph.step())
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

    fn assemble(reversibility: u32, orientation: Orientation, tokens: [u32; 6]) -> Result<Self, SmerError> {
        if reversibility == 0 || reversibility > MAX_REVERSIBILITY {
            return Err(SmerError::Reversibility { node: 0 });
        }
        let ladder = EDGES.iter().zip(orientation.first_ends()).map(|(&(a, b), first)| Edge {
            a: a as u8,
            b: b as u8,
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
            Ok(Self { graph, reversibility, period: orientation.circulation().period(reversibility) })
        } else {
            Err(SmerError::Deadlock { step: 0 })
        }
    }
}

/// Tokens of each flexor against its extensor: 5 for the first leg of the start order, 0 for the last, so that at R = 5 the legs swing one by
/// one from the first step on.
fn start_tokens(orientation: Orientation) -> [u32; 6] {
    let mut tokens = [0; 6];
    for (waits, leg) in (0..).zip(orientation.start_order().into_iter().flatten()) {
        if let Some(tokens) = tokens.get_mut(leg as usize) {
            *tokens = 5u32.saturating_sub(waits);
        }
    }
    tokens
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
                for (a, b) in EDGES {
                    assert!(!(swings.0.contains(a as usize) && swings.0.contains(b as usize)));
                }
            }
        }
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
