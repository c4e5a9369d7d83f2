//! State of the pins: output levels, input levels, timer connections, changes to report.

use crate::pin::{PORTS, Pin};
use crate::plant::Plant;
use crate::tim::PinSignal;

/// A change of an output that is not yet reported to the plant.
#[derive(Debug, Clone, Copy)]
pub(super) struct OutputEdge {
    pub(super) cycle: u64,
    pub(super) pin: Pin,
    pub(super) level: bool,
}

/// Levels and connections of all pins; bit n of a word is pin n of the port.
#[derive(Debug)]
pub(super) struct Pins {
    /// Output levels as reported to the plant, or about to be.
    pub(super) levels: [u16; PORTS],
    /// Pins that the chip drives.
    pub(super) driven: [u16; PORTS],
    /// Levels that the plant drives on pins.
    pub(super) inputs: [u16; PORTS],
    /// Pins that nothing drives but a pull of the chip.
    pub(super) floating: [u16; PORTS],
    /// Pins that are connected to a timer: pin, timer number, signal.
    pub(super) routes: Vec<(Pin, usize, PinSignal)>,
    /// Levels of EXTI lines 0 to 15.
    pub(super) lines: u32,
    /// Changes not yet reported to the plant.
    pub(super) edges: Vec<OutputEdge>,
    /// Time of the last input sample, s; `None`: none yet.
    pub(super) sampled_at: Option<f64>,
    /// Cycle of the next announced change of an input, `u64::MAX`: none.
    pub(super) change_at: u64,
    /// Time of the same change, s; 0: none.
    pub(super) change_seconds: f64,
    /// What the plant announced at the last advance: the time of its next change, s.
    pub(super) announced: Option<f64>,
    /// The plant does not announce changes.
    pub(super) polled: bool,
}

impl Pins {
    /// All pins low and not driven.
    pub(super) fn new() -> Self {
        Pins {
            levels: [0; PORTS],
            driven: [0; PORTS],
            inputs: [0; PORTS],
            floating: [0; PORTS],
            routes: Vec::new(),
            lines: 0,
            edges: Vec::new(),
            sampled_at: None,
            change_at: u64::MAX,
            change_seconds: 0.0,
            announced: None,
            polled: false,
        }
    }

    /// Whether the plant announces the same change as at the last advance, and not one at once.
    pub(super) fn is_announced_by(&self, plant: &dyn Plant) -> bool {
        let Some((sampled_at, announced)) = self.sampled_at.zip(self.announced) else { return false };
        announced > sampled_at && plant.next_pin_change(sampled_at.max(0.0)) == Some(announced)
    }

    /// Output level of a pin.
    pub(super) fn output(&self, pin: Pin) -> bool {
        self.levels[pin.port_index()] >> pin.number() & 1 != 0
    }
}
