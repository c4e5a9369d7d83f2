//! The gaits into which the orientations of the hexapod lead; judges edge-reversal networks on any graph.

pub mod liveness;
pub mod network;

use cpg_core::edge_reversal::hexapod::{Hexapod, Leg, Orientation, Swings};
use cpg_core::edge_reversal::ladder::Circulation;

use crate::failure::Failure;

/// A live orientation of the hexapod and the gait into which it leads.
pub struct LadderGait {
    /// The start.
    pub orientation: Orientation,
    /// Its class.
    pub circulation: Circulation,
    /// Steps before the gait repeats.
    pub transient: u32,
    /// The steps of a period, beginning with that in which the top left leg swings.
    pub period: Vec<Swings>,
}

impl LadderGait {
    /// All 98, found by running each to its repeated state.
    ///
    /// # Errors
    /// The reversibility is out of range, or a state is not repeated within the steps that the core looks at.
    pub fn all(reversibility: u32) -> Result<Vec<Self>, Failure> {
        Orientation::live().map(|orientation| Self::of(reversibility, orientation)).collect()
    }

    fn of(reversibility: u32, orientation: Orientation) -> Result<Self, Failure> {
        let mut hexapod = Hexapod::with_orientation(reversibility, orientation).map_err(Failure::input)?;
        let cycle = hexapod.graph().cycle().map_err(Failure::run)?;
        for _ in 0..cycle.transient {
            hexapod.step();
        }
        let mut period: Vec<Swings> = (0..cycle.period).map(|_| hexapod.step()).collect();
        let first = period.iter().position(|swings| swings.contains(Leg::TopLeft)).unwrap_or(0);
        period.rotate_left(first);
        Ok(Self { orientation, circulation: orientation.circulation(), transient: cycle.transient, period })
    }
}
