//! Protocol by which a program steps the board: requests on standard input, docs/virtual-board.md. Answers are lines of [`crate::report`].

mod entries;
mod request;
mod requests;

pub(crate) use request::{Given, Request, Step, VERSION};
pub(crate) use requests::{Line, Requests};

/// A request that is refused: the board stays as it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Refusal {
    /// The key that is wrong; empty: the line as a whole.
    pub(crate) field: String,
    /// What is wrong, and what is allowed.
    pub(crate) text: String,
}

impl Refusal {
    pub(crate) fn new(field: impl Into<String>, text: impl Into<String>) -> Self {
        Refusal { field: field.into(), text: text.into() }
    }
}
