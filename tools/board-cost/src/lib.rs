//! Cost of each part of the flashed image: instructions, and modelled cycles of a Cortex-M4F, from a trace of the virtual board.
//!
//! - [`trace`]: what the core executed, block by block.
//! - [`instruction`]: the instructions of a block, by capstone.
//! - [`timing`]: their cycles after ARM's manual, and [`flash`]: the stalls of flash and its accelerator.
//! - [`program`]: the image, and which of its addresses belong to which [`stage`], by the inlined functions of its debug information.
//! - [`block`]: what is known of a block before it runs. [`replay`]: the run. [`statistics`]: least, median, 99th percentile and most.
//!
//! Instructions are exact for the virtual board's run. Cycles are modelled: nothing has been measured on hardware.
#![forbid(unsafe_code)]

pub mod block;
pub mod flash;
pub mod instruction;
pub mod program;
pub mod replay;
pub mod stage;
pub mod statistics;
pub mod timing;
pub mod trace;
