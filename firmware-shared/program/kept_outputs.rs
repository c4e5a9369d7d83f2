//! Keeps the state of the servo outputs in RAM that a reset does not clear, see [`firmware_shared::last_outputs`].

use firmware_shared::last_outputs::{WORDS, from_words, is_kept_by, to_words};
use joint_units::PulseMicros;
use wire::{LastOutputs, Reset};

use crate::kept::Kept;

#[cfg_attr(target_os = "none", unsafe(link_section = ".uninit.footfall.last_outputs"))]
static KEPT: Kept<WORDS> = Kept::new();

fn load() -> Option<LastOutputs> {
    from_words(&KEPT.load())
}

fn store(state: &LastOutputs) {
    KEPT.store(to_words(state));
}

fn change(change: impl FnOnce(&mut LastOutputs)) {
    cortex_m::interrupt::free(|_| {
        let mut state = load().unwrap_or_default();
        change(&mut state);
        store(&state);
    });
}

/// Reads how the outputs of the run before ended; called once, early in the boot. The pulses stay known, also over another reset.
pub(crate) fn take(reset: Reset) -> Option<LastOutputs> {
    let last = load().filter(|_| is_kept_by(reset));
    store(&LastOutputs { pulses_us: last.map(|last| last.pulses_us).unwrap_or_default(), ..LastOutputs::default() });
    last
}

/// The servos get these pulses.
pub(crate) fn on(pulses: [PulseMicros; 4]) {
    change(|state| (state.pulses_us, state.on) = (pulses.map(|pulse| pulse.0), true));
}

/// The outputs are off; the last pulses stay known.
pub(crate) fn off() {
    change(|state| state.on = false);
}

/// Whether the outputs are on.
pub(crate) fn are_on() -> bool {
    load().is_some_and(|state| state.on)
}

/// The hardware has switched the outputs off and cut so many pulses short.
pub(crate) fn cut_off(pulses: u16) {
    change(|state| (state.on, state.cut) = (false, state.cut.saturating_add(pulses.into())));
}

/// The last pulses are too long ago.
pub(crate) fn forget() {
    change(|state| state.pulses_us = Default::default());
}
