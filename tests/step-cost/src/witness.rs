//! What the virtual board and QEMU both count: whole ticks of the control loop, steps of every generator, and where there is a C compiler the steps beside C.
//!
//! It reads no counter, as QEMU has none: both emulators write down what they execute. `cargo xtask test --only qemu-counts` compares the counts of
//! each call. It ends with status 0, or 1 if something cannot be built, has an invalid state, or does not walk.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod control_loop;
#[cfg(target_os = "none")]
mod exit;
#[cfg(all(target_os = "none", beside_c))]
mod gate;
#[cfg(target_os = "none")]
mod generators;
#[cfg(all(target_os = "none", beside_c))]
mod networks;
#[cfg(target_os = "none")]
mod recorded;
#[cfg(all(target_os = "none", beside_c))]
mod semihosting;
#[cfg(target_os = "none")]
mod start;
#[cfg(target_os = "none")]
mod steps;

/// Steps of each network and of the gate beside C.
#[cfg(all(target_os = "none", beside_c))]
const STEPS_BESIDE_C: u32 = 60;

/// Entry on the board.
#[cfg(target_os = "none")]
#[unsafe(no_mangle)]
extern "C" fn after_reset() -> ! {
    let status = u32::from(control_loop::run().is_none() || !steps::run());
    #[cfg(beside_c)]
    let status = status | networks::run(STEPS_BESIDE_C) | gate::run(STEPS_BESIDE_C as usize, STEPS_BESIDE_C);
    exit::exit(status)
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This program runs on two emulators: cargo xtask test --only qemu-counts.");
}
