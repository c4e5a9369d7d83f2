//! Turns SIGINT and SIGTERM into a flag, so that a run can finish its files.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::failure::Failure;

/// A flag that the first SIGINT or SIGTERM sets. The second signal ends the program at once.
///
/// # Errors
/// The system refuses the signal handler.
pub fn flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: when the first signal arrives, the flag is not set yet.
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&flag)).map_err(Failure::run)?;
        flag::register(signal, Arc::clone(&flag)).map_err(Failure::run)?;
    }
    Ok(flag)
}
