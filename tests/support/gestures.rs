//! Gestures of the person who operates a board, as options of the virtual board.

use std::ffi::OsString;

use crate::recordings::default_volts_file;

/// A hold of the button that arms a board as soon as it has booted: the value of `--press`. The joints are armed at [`ARMED_S`].
pub const ARM: &str = "0.076:0.304";

/// When a board that was armed by [`ARM`] is armed at the latest, s after power-on: the release, and 20 ms of debouncing.
pub const ARMED_S: f64 = 0.405;

/// Presses the emergency stop before the button is held by [`ARM`]: its test, without which a board does not arm. The value of `--emergency-stop`.
pub const STOP_TEST: &str = "0.05:0.024";

/// A press that stops a motion at this time, s: the value of `--press`.
#[must_use]
pub fn stop(at_s: f64) -> String {
    format!("{at_s}:0.1")
}

/// A deliberate hold from this time on, s, 0.42 s before it arms: the value of `--press`.
#[must_use]
pub fn hold(at_s: f64) -> String {
    format!("{at_s}:0.4")
}

/// The options of these gestures.
pub fn options<G: AsRef<str>>(gestures: impl IntoIterator<Item = G>) -> impl Iterator<Item = OsString> {
    gestures.into_iter().flat_map(|gesture| ["--press".into(), gesture.as_ref().into()])
}

/// The options of a run of so many seconds on the default volts, armed by [`ARM`], and more.
#[must_use]
pub fn walk_options(secs: f64, more: &[&str]) -> Vec<OsString> {
    let mut options: Vec<OsString> = vec!["--secs".into(), secs.to_string().into(), "--press".into(), ARM.into()];
    options.extend(["--loop".into(), "--volts".into(), default_volts_file().into()]);
    options.extend(more.iter().map(Into::into));
    options
}
