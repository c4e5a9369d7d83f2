//! What a board reports once a second: load and reserves of the processor, conditions of the chip.

use serde::{Deserialize, Serialize};

/// Load and reserves in the last second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cost {
    /// Longest tick by the core's cycle counter: cycles on a chip, instructions on the virtual board, which counts one cycle an instruction.
    pub longest_cycles: u32,
    /// Latest start of a tick after its trigger, us.
    pub latest_start_us: u32,
    /// Records dropped since the boot because a queue was full.
    pub dropped: u32,
    /// Deepest stack since the boot, bytes.
    pub stack_used: u32,
    /// Size of the stack, bytes.
    pub stack_size: u32,
    /// Servo pulses that the break input or a clock failure cut short since the boot, by the widths that were last written.
    pub truncated: u32,
}

/// Conditions of the chip: means over the last second, unless the field says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// Temperature of the die, degrees Celsius; `None` on a chip without usable factory readings.
    pub die_c: Option<f32>,
    /// Supply of the converter, V; `None` where the reference has no usable reading.
    pub supply_v: Option<f32>,
    /// Measured clock of the watchdog, Hz; 0: it stands still, `None`: not measured. The last measurement, not a mean.
    pub watchdog_hz: Option<u32>,
    /// Whether a debugger is attached to the core, at the moment of the report.
    pub debugger: bool,
}
