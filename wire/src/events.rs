//! Records of single events: a change of state, an edge at the synchronisation input.

use joint_loop::{Cause, SupervisorState};
use serde::{Deserialize, Serialize};

use crate::number;

/// The supervisor changed its state or its cause; a refused press changes only the cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// Tick of the first frame that shows it.
    pub tick: u32,
    /// The new state.
    #[serde(with = "number")]
    pub state: SupervisorState,
    /// The new cause: why the last motion ended or arming was refused.
    #[serde(with = "number")]
    pub cause: Cause,
}

/// An edge at the synchronisation input, by the board's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Edge {
    /// The tick that reports it.
    pub tick: u32,
    /// Time of the edge relative to the trigger of that tick, us; usually negative, because the edge precedes the tick that reports it.
    pub offset_us: i32,
    /// Level after the edge.
    pub high: bool,
    /// Whether edges before this one were lost, because they came faster than the board can report.
    pub lost_before: bool,
}

impl Edge {
    /// Seconds since the boot, by the board's clock.
    ///
    /// ```
    /// let edge = wire::Edge { tick: 1200, offset_us: -250, high: true, lost_before: false };
    /// assert!((edge.time_s() - 1.199_75).abs() < 1e-9);
    /// ```
    #[must_use]
    pub fn time_s(&self) -> f64 {
        f64::from(self.tick) * 1e-3 + f64::from(self.offset_us) * 1e-6
    }
}
