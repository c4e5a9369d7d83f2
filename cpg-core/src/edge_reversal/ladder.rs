//! The ladder of a hexapod's six flexors: its legs, and the 128 orientations of its seven edges with their classes.
//!
//! ```text
//! TL --- TR      top
//! |       |
//! ML --- MR      middle
//! |       |
//! BL --- BR      bottom
//! ```
//! Each edge points to the leg of its two that swings first. An orientation is live if and only if no cycle is directed: on a directed cycle each leg
//! waits for the next. Of the 128, 98 are live and 30 dead.
//!
//! **Class.** Steps and changes of gait conserve the circulation of every cycle: the edges that point along it less those that point against
//! it. The cycles are the upper (TL ML MR TR), the lower (ML BL BR MR) and the ring (TL ML BL BR MR TR), each in this order. The two
//! small ones pass the rung ML-MR in opposite directions, so ring = upper + lower, and a directed ring makes one of the small cycles directed.
//!
//! **Gait.** With flexors of reversibility R and extensors of 1 every leg swings once in a period of `max(R + 1, n)` steps: n = 2 in
//! the class (0, 0, 0), which at R = 1 is the tripod (18 orientations); 6 where the ring has the circulation ±4 (12 orientations); else 4 (68).
//! A cycle of k edges with circulation c lets each of its legs swing at most `(k - |c|) / 2` times in k steps, and a leg and its extensor
//! alternate in R + 1 steps. Source: brute force over all orientations (`tests/hexapod_orientations.rs`); for R = 1 the bound is that of Barbosa and
//! Gafni 1989, ACM Trans. Program. Lang. Syst. 11, 562.
//!
//! ```
//! use cpg_core::edge_reversal::ladder::Orientation;
//! // The left side points down, down; the right side down, down; the rungs to the left: BL swings first, TR last.
//! let wave: Orientation = "dd-dd-lll".parse()?;
//! assert_eq!(wave, Orientation::WAVE);
//! assert_eq!((wave.circulation().ring(), wave.circulation().period(1)), (0, 2));
//! // Down the left side, to the right, up the right side, to the left: each waits for the next.
//! let dead: Orientation = "dd-uu-lrr".parse()?;
//! assert_eq!(dead.directed_cycle().unwrap().to_string(), "the upper cycle TL > ML > MR > TR > TL");
//! # Ok::<(), cpg_core::edge_reversal::ladder::OrientationError>(())
//! ```

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

use Leg::{BottomLeft, BottomRight, MiddleLeft, MiddleRight, TopLeft, TopRight};

impl Leg {
    /// All legs in order.
    pub const ALL: [Leg; 6] = [TopLeft, MiddleLeft, BottomLeft, TopRight, MiddleRight, BottomRight];

    /// Two letters, as in the paper: `TL`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            TopLeft => "TL",
            MiddleLeft => "ML",
            BottomLeft => "BL",
            TopRight => "TR",
            MiddleRight => "MR",
            BottomRight => "BR",
        }
    }
}

/// The edges: left side, right side, the three rungs. The first end is the upper or the left one.
pub const EDGES: [(Leg, Leg); 7] = [
    (TopLeft, MiddleLeft),
    (MiddleLeft, BottomLeft),
    (TopRight, MiddleRight),
    (MiddleRight, BottomRight),
    (TopLeft, TopRight),
    (MiddleLeft, MiddleRight),
    (BottomLeft, BottomRight),
];

/// The upper and the lower cycle, with their names.
const SMALL_CYCLES: [(&str, [Leg; 4]); 2] = [
    ("upper", [TopLeft, MiddleLeft, MiddleRight, TopRight]),
    ("lower", [MiddleLeft, BottomLeft, BottomRight, MiddleRight]),
];

/// Which legs precede others in [`Orientation::start_order`] where the edges leave it open: the left side from the bottom up, then the right.
const PRECEDENCE: [Leg; 6] = [BottomLeft, MiddleLeft, TopLeft, BottomRight, MiddleRight, TopRight];

/// One of the 128 orientations of the ladder: for each edge the end that swings first.
///
/// Written as `dd-dd-lll`: the left side from the top, the right side from the top (`u` up, `d` down), the three rungs from the top (`l` left, `r`
/// right); each letter says where its edge points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Orientation(
    /// Bit n is set if edge n of [`EDGES`] points to its first end.
    u8,
);

impl Orientation {
    /// `dd-dd-lll`, the start of the wave BL ML TL BR MR TR.
    pub const WAVE: Self = Self(0b111_0000);

    /// All 128, dead ones too.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..128).map(Self)
    }

    /// The 98 live ones.
    pub fn live() -> impl Iterator<Item = Self> {
        Self::all().filter(|orientation| orientation.directed_cycle().is_none())
    }

    /// From the ends to which the edges of [`EDGES`] point: `true` for the first.
    #[must_use]
    pub fn from_first_ends(points_to_first: [bool; 7]) -> Self {
        let bits = points_to_first.into_iter().rev().fold(0, |bits, first| bits << 1 | u8::from(first));
        Self(bits)
    }

    /// Whether each edge of [`EDGES`] points to its first end.
    #[must_use]
    pub fn first_ends(self) -> [bool; 7] {
        core::array::from_fn(|edge| self.0 >> edge & 1 == 1)
    }

    /// Whether these two legs have an edge, and it points from the first to the second.
    fn points(self, from: Leg, to: Leg) -> bool {
        let mut edges = EDGES.iter().zip(self.first_ends());
        edges.any(|(&(a, b), first)| if first { (from, to) == (b, a) } else { (from, to) == (a, b) })
    }

    /// The class.
    #[must_use]
    pub fn circulation(self) -> Circulation {
        let [upper, lower] = SMALL_CYCLES.map(|(_, legs)| {
            let nexts = legs.iter().cycle().skip(1);
            let along = legs.iter().zip(nexts).map(|(&from, &to)| if self.points(from, to) { 1 } else { -1 });
            along.fold(0i8, i8::saturating_add)
        });
        Circulation { upper, lower }
    }

    /// The cycle that makes the orientation dead, the upper one first; `None` if it is live.
    #[must_use]
    pub fn directed_cycle(self) -> Option<DirectedCycle> {
        let Circulation { upper, lower } = self.circulation();
        SMALL_CYCLES.into_iter().zip([upper, lower]).find(|(_, circulation)| matches!(circulation, -4 | 4)).map(
            |((name, [a, b, c, d]), circulation)| DirectedCycle {
                name,
                legs: if circulation > 0 { [a, b, c, d] } else { [a, d, c, b] },
            },
        )
    }

    /// An order of the legs in which each swings after those to which it points; `None` if the orientation is dead.
    ///
    /// Where the edges leave the order open, the left side precedes the right one, and of a side the lower leg the upper one.
    #[must_use]
    pub fn start_order(self) -> Option<[Leg; 6]> {
        let mut order = [None; 6];
        for place in 0..order.len() {
            let next = PRECEDENCE.into_iter().find(|&leg| {
                let waits =
                    PRECEDENCE.into_iter().any(|other| self.points(leg, other) && !order.contains(&Some(other)));
                !waits && !order.contains(&Some(leg))
            });
            *order.get_mut(place)? = Some(next?);
        }
        let [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f)] = order else { return None };
        Some([a, b, c, d, e, f])
    }
}

impl core::fmt::Display for Orientation {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for (edge, first) in self.first_ends().into_iter().enumerate() {
            let letter = match (edge, first) {
                (0..4, true) => "u",
                (0..4, false) => "d",
                (_, true) => "l",
                (_, false) => "r",
            };
            // A side ends with its second edge.
            f.write_str(if edge == 2 || edge == 4 { "-" } else { "" })?;
            f.write_str(letter)?;
        }
        Ok(())
    }
}

/// Why a text is no orientation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum OrientationError {
    /// Not nine characters.
    Length {
        /// Characters.
        found: usize,
    },
    /// A character that is not allowed at its place.
    Character {
        /// Its place, counted from 1.
        place: usize,
        /// What is allowed there.
        allowed: &'static str,
    },
}

impl core::fmt::Display for OrientationError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            OrientationError::Length { found } => write!(f, "{found} characters: allowed are nine")?,
            OrientationError::Character { place, allowed } => write!(f, "character {place}: allowed is {allowed}")?,
        }
        f.write_str(", as in dd-dd-lll: where the edges of left side, right side and rungs point, each from the top")
    }
}

impl core::error::Error for OrientationError {}

impl core::str::FromStr for Orientation {
    type Err = OrientationError;

    /// The form that [`Orientation`] describes.
    fn from_str(text: &str) -> Result<Self, OrientationError> {
        let found = text.chars().count();
        if found != 9 {
            return Err(OrientationError::Length { found });
        }
        let (mut first_ends, mut edge) = ([false; 7], 0);
        for (index, letter) in text.chars().enumerate() {
            let wrong = |allowed| Err(OrientationError::Character { place: index.saturating_add(1), allowed });
            let points_to_first = match (index, letter) {
                (2 | 5, '-') => continue,
                (2 | 5, _) => return wrong("-"),
                (0..5, 'u') | (6.., 'l') => true,
                (0..5, 'd') | (6.., 'r') => false,
                (0..5, _) => return wrong("u or d"),
                _ => return wrong("l or r"),
            };
            if let Some(end) = first_ends.get_mut(edge) {
                *end = points_to_first;
            }
            edge = edge.saturating_add(1);
        }
        Ok(Self::from_first_ends(first_ends))
    }
}

/// The class of an orientation: edges along each small cycle less those against it, -4 to 4, even.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Circulation {
    /// Of the upper cycle TL ML MR TR.
    pub upper: i8,
    /// Of the lower cycle ML BL BR MR.
    pub lower: i8,
}

impl Circulation {
    /// Of the ring TL ML BL BR MR TR: the sum of the two.
    #[must_use]
    pub const fn ring(self) -> i8 {
        self.upper.saturating_add(self.lower)
    }

    /// Steps in which every leg swings once, for flexors of this reversibility and a live orientation; see the module.
    #[must_use]
    pub const fn period(self, reversibility: u32) -> u32 {
        let least = match (self.upper, self.lower, self.ring()) {
            (0, 0, _) => 2,
            (_, _, -4 | 4) => 6,
            _ => 4,
        };
        let alternation = reversibility.saturating_add(1);
        if alternation > least { alternation } else { least }
    }
}

/// A cycle on which each leg waits for the next and the last for the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DirectedCycle {
    name: &'static str,
    legs: [Leg; 4],
}

impl DirectedCycle {
    /// The legs; each edge points to the next leg.
    #[must_use]
    pub const fn legs(&self) -> [Leg; 4] {
        self.legs
    }
}

impl core::fmt::Display for DirectedCycle {
    /// `the upper cycle TL > ML > MR > TR > TL`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let [a, b, c, d] = self.legs.map(Leg::name);
        write!(f, "the {} cycle {a} > {b} > {c} > {d} > {a}", self.name)
    }
}
