//! Interrupts of the flashed image on the virtual board: those that the firmware lists are enabled, each with its priority, and no other.

use std::collections::BTreeMap;
use std::process::ExitCode;

use firmware::interrupts::ENABLED;
use footfall_tests::board::Board;
use footfall_tests::gestures::{ARM, STOP_TEST};
use test_suite::{report, tests};

fn main() -> ExitCode {
    test_suite::run(tests![only_the_listed_interrupts_are_enabled(Image)])
}

/// The HAL enables the interrupts of all streams of both DMA controllers at the highest priority; the firmware switches them off.
fn only_the_listed_interrupts_are_enabled() {
    let ran = Board::find().run(["--secs", "3", "--emergency-stop", STOP_TEST, "--press", ARM]);
    ran.assert_sound();
    let listed: BTreeMap<u8, u8> = ENABLED.iter().map(|interrupt| (interrupt.line, interrupt.priority)).collect();
    assert_eq!(ran.end.interrupts, listed);
    let cycles: Vec<u32> = ran.boots[0].costs.iter().map(|cost| cost.longest_cycles).collect();
    report!("longest tick of each second: {cycles:?} instructions");
}
