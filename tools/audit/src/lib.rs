//! Measures the image that is flashed, by its ELF file, and the source of the crates in it.
//!
//! - [`image`]: the ELF file: functions, code and loaded bytes.
//! - [`code`]: the instructions of a function: calls, and what it takes of the stack.
//! - [`graph`]: which function can call which; [`indirect`] lists where the calls through a pointer go.
//! - [`panics`]: whether a panic is reachable from the tick and from the handlers.
//! - [`stack`]: a bound of the stack over all calls and interrupts.
//! - [`paths`]: absolute paths in the loaded bytes; images compared by their loaded bytes.
//! - [`unsafe_code`]: unsafe blocks of a crate.
//! - [`ratchet`]: values that must not get worse than those in `ratchets.toml`; [`run`] has those of a run.
#![forbid(unsafe_code)]

pub mod code;
pub mod graph;
pub mod image;
pub mod indirect;
pub mod panics;
pub mod paths;
pub mod ratchet;
pub mod run;
pub mod stack;
pub mod unsafe_code;
