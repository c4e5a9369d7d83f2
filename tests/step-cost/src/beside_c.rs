//! Steps of the thesis' network, of R1 and of the gate in Rust, and in plain C of the same equations (`c/networks.c`, `c/gate.c`), for an emulated
//! Cortex-M4F.
//!
//! Both begin in the same state. It prints a line for each, `name steps equal difference`: steps, how many of them C without contraction computes bit
//! for bit as Rust, and the largest difference of C with contraction, in parts of 10^9 of the displacement's amplitude; of the gate, how many steps of
//! that are not equal, as it has hardly any arithmetic of the FPU. A line `gate-any steps all` says how many steps of the gate in Rust had targets of every
//! kind, and 1 if each of its limits acted in them. `cargo xtask bench board` counts what each step costs. Without a C compiler (`arm-none-eabi-gcc`) it
//! prints nothing.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod exit;
#[cfg(all(target_os = "none", beside_c))]
mod gate;
#[cfg(all(target_os = "none", beside_c))]
mod networks;
#[cfg(all(target_os = "none", beside_c))]
mod recorded;
#[cfg(all(target_os = "none", beside_c))]
mod semihosting;
#[cfg(target_os = "none")]
mod start;

/// Steps of each network.
#[cfg(all(target_os = "none", beside_c))]
const NETWORK_STEPS: u32 = 2000;
/// Steps of the gate on targets of every kind.
#[cfg(all(target_os = "none", beside_c))]
const ANY_STEPS: u32 = 100_000;

/// Entry on the board.
#[cfg(target_os = "none")]
#[unsafe(no_mangle)]
extern "C" fn after_reset() -> ! {
    #[cfg(beside_c)]
    let status = networks::run(NETWORK_STEPS) | gate::run(usize::MAX, ANY_STEPS);
    #[cfg(not(beside_c))]
    let status = 0;
    exit::exit(status)
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This program runs on an emulated board: cargo xtask bench board.");
}
