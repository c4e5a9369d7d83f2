//! Checks that a sample set of the converter is complete, in order and recent, and reads the button and the foot switch.

use crate::board::BOARD;
use firmware_shared::pacing::{STALE_US, since};
use joint_loop::{BoardFaults, SENSORS};
use joint_units::AdcCode;

use super::progress::SENSOR;
use crate::environment;
use crate::pins::PinRegisters;
use crate::sampling;
use crate::stopwatch;

/// Inputs of one control period.
#[derive(Clone, Copy)]
pub(crate) struct Measurement {
    pub(crate) sensors: [AdcCode; SENSORS],
    pub(crate) vrefint: AdcCode,
    /// Raw level of the user button.
    pub(crate) button: bool,
    /// The foot is on the floor.
    pub(crate) foot: bool,
    /// Time of the trigger, in [`stopwatch`] microseconds.
    pub(crate) triggered_us: u32,
    pub(crate) faults: BoardFaults,
}

/// Turns the newest sample set into a measurement; `None` if there is no new one.
#[inline(never)]
pub(super) fn sensor_step(last_sequence: &mut Option<u32>) -> Option<Measurement> {
    let set = sampling::take_newest()?;
    // A set that was overwritten before it was read is a lost conversion. The time stamps count the missed ticks.
    let in_order = match last_sequence {
        Some(last) => set.sequence == last.wrapping_add(1),
        None => true,
    };
    *last_sequence = Some(set.sequence);
    let stale = since(stopwatch::now_us(), set.triggered_us) > STALE_US;

    let sound = in_order && !stale && !set.torn;
    let faults = if sound { BoardFaults::NONE } else { BoardFaults::ADC_OVERRUN };
    environment::add(set.vrefint, set.temperature);
    SENSOR.count();
    Some(Measurement {
        sensors: set.sensors,
        vrefint: set.vrefint,
        button: BOARD.button.is_high() == BOARD.button_pressed,
        foot: BOARD.foot_switch.is_high(),
        triggered_us: set.triggered_us,
        faults,
    })
}
