//! Counts the instructions of a step of each generator for a Cortex-M4F, on an emulator that counts one cycle per instruction.
//!
//! It uses no vendor register and prints one line per generator by semihosting, `name least sum most least sum most`: over 1000 steps, for
//! the step alone and for the step with its angles. A plus before the name marks a variant of another generator or one with other joints.
//! `cargo xtask bench oscillators` runs it and prints the table.
//! The number of cycles on a chip differs, for example by flash wait states, and must be measured there.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod count;
#[cfg(target_os = "none")]
mod exit;
#[cfg(target_os = "none")]
mod generators;
#[cfg(target_os = "none")]
mod semihosting;
#[cfg(target_os = "none")]
mod start;
#[cfg(target_os = "none")]
mod table;

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This program counts instructions on an emulated board: cargo xtask bench oscillators.");
}
