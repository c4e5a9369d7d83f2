//! Counts the instructions that a step of each generator takes on a Cortex-M4F, on an emulator that counts one cycle an instruction.
//!
//! It touches no vendor register and tells a line a generator by semihosting, `name least sum most least sum most`: over 1000 steps, of the
//! step alone and of the step with its angles; a plus before the name marks what is no model of its own. `cargo xtask bench oscillators`
//! runs it and prints the table.
//! Instructions are no cycles: how long they take, flash wait states included, only a chip can tell.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod count;
#[cfg(target_os = "none")]
mod generators;
#[cfg(target_os = "none")]
mod semihosting;
#[cfg(target_os = "none")]
mod start;

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This program counts instructions on an emulated board: cargo xtask bench oscillators.");
}
