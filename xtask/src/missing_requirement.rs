//! The error of a command that lacks something required.

/// This computer lacks something that is required; the message says what to do. The program then exits with code 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct MissingRequirement(pub(crate) String);

impl std::fmt::Display for MissingRequirement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for MissingRequirement {}
