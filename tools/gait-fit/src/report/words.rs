//! Names and conditions that the parts of the page share.

use crate::fit::Fit;
use crate::judge::HeldOut;

/// `left_hip` as `left hip`.
pub(super) fn spaced(name: &str) -> String {
    name.replace('_', " ")
}

/// Whether errors on strides that were not fitted are known.
pub(super) fn is_judged(fit: &Fit) -> bool {
    fit.held_out != HeldOut::None
}
