//! The interrupts of the control loop: which are enabled, and how urgent each is. No other is enabled; a test on the virtual board compares.

/// An interrupt that is enabled while the program runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Enabled {
    /// Its name in the vector table, which is that of its handler.
    pub name: &'static str,
    /// Its number (RM0090 table 62, RM0383 table 37, RM0390 table 38).
    pub line: u8,
    /// 0 to 15; a lower number interrupts a higher one.
    pub priority: u8,
    /// What it does.
    pub what: &'static str,
}

/// First of all: it switches the servos' supply off.
pub const BREAK: Enabled = Enabled {
    name: "TIM1_BRK_TIM9",
    line: 24,
    priority: 0,
    what: "the break has cut the pulses: switches the servos' supply off, counts the pulses",
};

/// Its time stamp is late by the entry into the handler.
pub const EDGE: Enabled = Enabled {
    name: "EXTI9_5",
    line: 23,
    priority: 2,
    what: "an edge of the synchronisation input: its time and level",
};

/// The end of the samples of a tick.
pub const BLOCK_END: Enabled = Enabled {
    name: "DMA2_STREAM0",
    line: 56,
    priority: 4,
    what: "the samples of a tick are in memory: stamps them, makes the tick pending",
};

/// As urgent as the samples: the two share their state.
pub const OVERRUN: Enabled =
    Enabled { name: "ADC", line: 18, priority: 4, what: "a conversion was lost: restarts converter and transfer" };

/// The ticks: below what samples and stamps, above all that logs.
pub const TICK: Enabled = Enabled {
    name: "I2C1_EV",
    line: 31,
    priority: 6,
    what: "runs the control task; the interrupt of a peripheral that is not used",
};

/// Below the ticks: a tick never waits for a timer of telemetry.
pub const TASK_CLOCK: Enabled =
    Enabled { name: "TIM4", line: 30, priority: 10, what: "the clock of the tasks, of embassy-time" };

/// All, most urgent first.
pub const ENABLED: [Enabled; 6] = [BREAK, EDGE, BLOCK_END, OVERRUN, TICK, TASK_CLOCK];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_in_order() {
        assert!(ENABLED.is_sorted_by_key(|interrupt| interrupt.priority));
        assert!(ENABLED.iter().all(|interrupt| !interrupt.what.is_empty()));
    }
}
