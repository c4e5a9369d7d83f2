//! What a board counts of what is not as it should be, once a second: counts since the boot, so that a record that is lost loses none.

use joint_loop::{BAD, SENSORS, SensorCounts};
use serde::{Deserialize, Serialize};

/// Counts of every tick since the boot, all of which wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Conditions {
    /// Control periods that they cover.
    pub tick: u32,
    /// Dips of the supply below its minimum, however short.
    pub supply_dips: u32,
    /// Each channel's sensor; `None` where the board has none.
    pub sensors: [Option<Validities>; SENSORS],
}

/// Validities of one sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Validities {
    /// Ticks in which the validity was another one than in the tick before.
    pub changes: u32,
    /// Control periods with each validity that is not good, in the order of `hgod_adc::Validity::ALL` without its first.
    pub bad: [u32; BAD],
}

impl Conditions {
    /// Those of a loop of which the first `count` channels have a sensor.
    #[must_use]
    pub fn of(counted: &joint_loop::Conditions<SENSORS>, count: usize) -> Self {
        let mut sensors = [None; SENSORS];
        for (sensor, SensorCounts { changes, bad }) in sensors.iter_mut().zip(counted.sensors).take(count) {
            *sensor = Some(Validities { changes, bad });
        }
        Self { tick: counted.tick, supply_dips: counted.supply_dips, sensors }
    }
}

impl Validities {
    /// As the loop has them.
    #[must_use]
    pub const fn counts(&self) -> SensorCounts {
        SensorCounts { changes: self.changes, bad: self.bad }
    }
}
