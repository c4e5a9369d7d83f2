//! The check of the program in flash, which this chip does not do yet: its image has no seal. The boot ROM checks the first 256 bytes alone.

use core::convert::Infallible;

use crate::variant::SEAL_REQUIRED;

const _: () = assert!(
    !SEAL_REQUIRED,
    "this chip's program does not check itself: it cannot demand a seal; build without `require-seal`"
);

/// Whether the board may not arm because of it: never.
pub(crate) const fn is_unproven() -> bool {
    false
}

/// Whether the image has a seal: no image of this chip has one.
pub(crate) const fn sealed() -> Option<bool> {
    None
}

/// Whether the program is known to be wrong: never.
pub(crate) const fn is_wrong() -> bool {
    false
}

/// No check.
pub(crate) struct ProgramCheck;

impl ProgramCheck {
    pub(crate) const fn new() -> Self {
        Self
    }

    /// Finds nothing.
    pub(crate) const fn step(&mut self) -> Option<Infallible> {
        None
    }
}
