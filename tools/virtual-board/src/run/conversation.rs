//! State of the conversation with a program that steps the board.

use crate::lockstep::Requests;

/// The conversation.
pub(super) struct Lockstep {
    pub(super) requests: Requests,
    /// End of the step, us.
    pub(super) until_us: u64,
    /// A request was carried out, whose answer is due.
    pub(super) owes_answer: bool,
    /// The last request has changed an input of which the peripherals do not know yet.
    pub(super) has_changed_input: bool,
    /// A supply of the chip that is given from a time on: s and V.
    pub(super) supply: Option<(f64, f64)>,
    /// The input ended in the middle of a line.
    pub(super) is_cut: bool,
}

impl Lockstep {
    /// A conversation that has not begun.
    pub(super) const fn new(requests: Requests) -> Self {
        Lockstep { requests, until_us: 0, owes_answer: false, has_changed_input: false, supply: None, is_cut: false }
    }

    /// The time from which on a supply is given, s.
    pub(super) fn supply_due(&self) -> Option<f64> {
        self.supply.map(|(at, _)| at)
    }
}
