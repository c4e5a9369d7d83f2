//! How a command ends when it does not end well, and with which exit code.

use std::fmt;

/// Why a command failed.
#[derive(Debug)]
pub enum Failure {
    /// What it was given is not as it must be; nothing was written. Exit code 2.
    Input(String),
    /// It was given good input and still did not succeed. Exit code 1.
    Run(String),
}

impl Failure {
    /// Of bad input.
    #[must_use]
    pub fn input(error: impl fmt::Display) -> Self {
        Self::Input(error.to_string())
    }

    /// Of what went wrong on the way.
    #[must_use]
    pub fn run(error: impl fmt::Display) -> Self {
        Self::Run(error.to_string())
    }

    /// The exit code.
    #[must_use]
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Run(_) => 1,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(text) | Self::Run(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for Failure {}
