//! A spinner for commands that compute for seconds or minutes.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

use crate::messages::{self, Amount};

/// A spinner with the time and a message on a terminal, nothing elsewhere and with `--quiet`.
#[must_use]
pub fn begin() -> ProgressBar {
    if !messages::says(Amount::Usual) {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}
