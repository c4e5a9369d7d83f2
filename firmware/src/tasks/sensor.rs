//! Takes each sample set from the converter's interrupt, checks that it is whole, in order and fresh, and hands it to the control task.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use firmware::pacing::{STALE_US, since};
use joint_loop::{BoardFaults, SENSORS};
use joint_units::AdcCode;

use super::SENSOR;
use crate::board::{BOARD, FOOT_SWITCH};
use crate::climate;
use crate::sampling::{NEWEST, SampleSet};
use crate::stopwatch;

/// What the control task works on.
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

/// The newest measurement, from this task to the control task.
pub(super) static MEASURED: Signal<CriticalSectionRawMutex, Measurement> = Signal::new();

/// Woken by the converter's interrupt, once a millisecond.
#[embassy_executor::task]
pub(crate) async fn sensor_task() -> ! {
    let mut last_sequence = None;
    loop {
        let set = NEWEST.wait().await;
        MEASURED.signal(sensor_step(&mut last_sequence, &set));
    }
}

/// One sample set.
#[inline(never)]
#[cfg_attr(target_os = "none", unsafe(no_mangle))]
fn sensor_step(last_sequence: &mut Option<u32>, set: &SampleSet) -> Measurement {
    // A set that was overwritten before this task ran is a lost conversion. That ticks are missing is counted by the time stamps.
    let in_order = last_sequence.is_none_or(|last| set.sequence == last.wrapping_add(1));
    *last_sequence = Some(set.sequence);
    let stale = since(stopwatch::now_us(), set.triggered_us) > STALE_US;

    let sound = in_order && !stale && !set.torn;
    let faults = if sound { BoardFaults::NONE } else { BoardFaults::ADC_OVERRUN };
    climate::add(set.vrefint, set.temperature);
    SENSOR.count();
    Measurement {
        sensors: set.sensors,
        vrefint: set.vrefint,
        button: BOARD.button.is_high() == BOARD.button_pressed,
        foot: FOOT_SWITCH.is_high(),
        triggered_us: set.triggered_us,
        faults,
    }
}
