//! Keeps the state of the servo outputs in RAM that a reset does not clear, see [`firmware::last_outputs`].

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use firmware::last_outputs::{LastOutputs, WORDS, is_kept_by};
use joint_units::PulseMicros;
use wire::Reset;

/// RAM that the start-up code does not initialise.
#[repr(transparent)]
struct Kept(UnsafeCell<MaybeUninit<[u32; WORDS]>>);

// SAFETY: written with the interrupts masked, or by a fault handler that never returns; a record that such a handler interrupted fails its checksum.
unsafe impl Sync for Kept {}

#[cfg_attr(target_os = "none", unsafe(link_section = ".uninit.footfall.last_outputs"))]
static KEPT: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

fn load() -> Option<LastOutputs> {
    let words = KEPT.0.get().cast::<u32>();
    let mut copy = [0; WORDS];
    for (index, word) in copy.iter_mut().enumerate() {
        // SAFETY: in bounds, aligned; any content of the RAM is a valid u32, and volatile reads stop the compiler from assuming a content.
        *word = unsafe { words.add(index).read_volatile() };
    }
    LastOutputs::from_words(&copy)
}

fn store(state: &LastOutputs) {
    let words = KEPT.0.get().cast::<u32>();
    for (index, word) in state.to_words().into_iter().enumerate() {
        // SAFETY: in bounds, aligned; see `Kept` for concurrent access.
        unsafe { words.add(index).write_volatile(word) };
    }
}

fn change(change: impl FnOnce(&mut LastOutputs)) {
    cortex_m::interrupt::free(|_| {
        let mut state = load().unwrap_or_default();
        change(&mut state);
        store(&state);
    });
}

/// Reads how the outputs of the run before ended; called once, early in the boot. The pulses stay known, also over another reset.
pub(crate) fn take(reset: Reset) -> Option<wire::LastOutputs> {
    let last = load().filter(|_| is_kept_by(reset));
    store(&LastOutputs { pulses: last.map(|last| last.pulses).unwrap_or_default(), ..LastOutputs::default() });
    let LastOutputs { pulses, on, cut } = last?;
    Some(wire::LastOutputs { pulses_us: pulses.map(|pulse| pulse.0), on, cut: cut.into() })
}

/// The servos get these pulses.
pub(crate) fn on(pulses: [PulseMicros; 4]) {
    change(|state| (state.pulses, state.on) = (pulses, true));
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
    change(|state| (state.on, state.cut) = (false, state.cut.saturating_add(pulses)));
}

/// The last pulses are too long ago.
pub(crate) fn forget() {
    change(|state| state.pulses = Default::default());
}
