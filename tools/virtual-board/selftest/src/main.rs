//! A self-test of the Cortex-M4F core that touches no vendor register: the virtual board and QEMU must both pass it.
//!
//! It ends by semihosting with status 0, or with the number of the first check that failed. An unexpected fault fails the running check.
//! Every check tests a statement of the architecture manual (ARMv7-M ARM, DDI 0403E). The two emulators are independent, so that an error
//! of interpretation in one of them shows.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod checks;
#[cfg(target_os = "none")]
mod context;
#[cfg(target_os = "none")]
mod core_registers;
#[cfg(target_os = "none")]
mod handlers;
#[cfg(target_os = "none")]
mod start;

#[cfg(not(target_os = "none"))]
fn main() {}
