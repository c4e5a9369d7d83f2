//! The RP2040 firmware: boots with its outputs off, then steps the joint loop once a millisecond.
//!
//! The tasks, the log, the queues and the reading of the records are files of `firmware-shared`, which each family compiles in its program. This
//! crate has what those files ask of a chip, by the same names. Each peripheral is used by one module, all but the USB by their registers:
//!
//! | peripherals | module |
//! |---|---|
//! | PWM | `servo_pwm` |
//! | ADC, DMA | `sampling` |
//! | TIMER, and SysTick of the core | `stopwatch` |
//! | interrupts of IO_BANK0, SYSCFG | `emergency_stop` |
//! | WATCHDOG, PSM | `watchdog` |
//! | IO_BANK0, PADS_BANK0, SIO | `pins` |
//! | CLOCKS, VREG_AND_CHIP_RESET | `clocks` |
//! | USB | `serial`, by the HAL |
//!
//! Alarm 0 of TIMER is the clock of embassy-time. The interrupt SWI_IRQ_0, which no peripheral has, runs the control task.
//!
//! What the other family has and this chip has not is said at each boot (`protections`).
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
use firmware_rp2040::{board, timing};

#[cfg(target_os = "none")]
mod boot;
#[cfg(target_os = "none")]
mod clocks;
#[cfg(target_os = "none")]
mod debugger;
#[cfg(target_os = "none")]
mod emergency_stop;
#[cfg(target_os = "none")]
mod environment;
#[cfg(target_os = "none")]
mod faults;
#[cfg(target_os = "none")]
mod float;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/guards.rs"]
mod guards;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/kept.rs"]
mod kept;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/kept_outputs.rs"]
mod kept_outputs;
#[cfg(target_os = "none")]
mod lamps;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/log.rs"]
mod log;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/parameters.rs"]
mod parameters;
#[cfg(target_os = "none")]
mod pins;
#[cfg(target_os = "none")]
mod program;
#[cfg(target_os = "none")]
mod protections;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/queue.rs"]
mod queue;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/removed.rs"]
mod removed;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/requests.rs"]
mod requests;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/rtt.rs"]
mod rtt;
#[cfg(target_os = "none")]
mod sampling;
#[cfg(target_os = "none")]
mod serial;
#[cfg(target_os = "none")]
mod servo_pwm;
#[cfg(target_os = "none")]
mod servo_rail;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/stack.rs"]
mod stack;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/start.rs"]
mod start;
#[cfg(target_os = "none")]
mod stopwatch;
#[cfg(target_os = "none")]
mod sync_input;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/tasks/mod.rs"]
mod tasks;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/variant.rs"]
mod variant;
#[cfg(target_os = "none")]
mod watchdog;
#[cfg(target_os = "none")]
#[path = "../../firmware-shared/program/watchdog_clock.rs"]
mod watchdog_clock;

#[cfg(not(target_os = "none"))]
fn main() {
    let board = &firmware_rp2040::board::BOARD;
    println!(
        "This is the firmware for the {} board, compiled for this computer: it only shows that it compiles.\n\
         Build it for thumbv6m-none-eabi: `cargo xtask pico`",
        board.name
    );
}
