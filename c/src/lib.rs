//! Footfall for C and C++: generators and the control loop of the boards, in memory of the caller.
//!
//! | module | content |
//! |---|---|
//! | [`generator`] | `footfall_generator_...`: gaits by name, generators of records |
//! | [`control`] | `footfall_loop_...`: the control loop, tick by tick |
//! | [`error`] | status codes, and the text of an error |
//! | `slot` | a value in memory of the caller |
//!
//! Nothing allocates. A caller owns every object as a plain variable; `footfall_..._build` functions fill it, all others refuse
//! one that is not filled.
//! The four cores forbid unsafe code, so this crate is apart: each unsafe block states what the caller guarantees.
#![cfg_attr(target_os = "none", no_std)]
#![deny(unsafe_op_in_unsafe_fn, clippy::undocumented_unsafe_blocks)]

pub mod control;
pub mod error;
pub mod generator;
mod slot;

/// Without an operating system a panic stops here; none is reachable from the cores.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
