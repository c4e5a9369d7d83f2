//! What the tests of this package share.
//!
//! - [`traces`]: recordings that ship, and the folder of many more that may be there or not;
//! - [`walk`]: the loop that ships, fed with a recording, tick by tick on the host;
//! - [`degraded`]: a sensor's codes as they are when something is broken;
//! - [`board`]: the flashed image on the virtual board, where there is one;
//! - [`faulty`]: a sensor's faults as volts for it, and when its converter looks at them.
#![forbid(unsafe_code)]

pub mod board;
pub mod degraded;
pub mod faulty;
pub mod traces;
pub mod walk;

use std::io::Write;

/// Says that something was left out, so loudly that the test runner cannot keep it to itself.
pub fn left_out(what: &str, why: &str) {
    // `eprintln!` in a test that passes is captured; the stream itself is not.
    let _ = writeln!(std::io::stderr(), "\n*** LEFT OUT: {what}: {why} ***");
}
