//! Why a command failed, and the exit code that follows.

use std::fmt;

/// Why a command failed.
#[derive(Debug)]
pub enum Failure {
    /// The input is wrong; nothing was written. Exit code 2.
    Input(String),
    /// The input is correct, but the command did not succeed. Exit code 1.
    Run(String),
}

impl Failure {
    /// A failure caused by the input.
    #[must_use]
    pub fn input(error: impl fmt::Display) -> Self {
        Self::Input(error.to_string())
    }

    /// A failure during the run.
    #[must_use]
    pub fn run(error: impl fmt::Display) -> Self {
        Self::Run(error.to_string())
    }

    /// The same failure with a place in front of its text.
    #[must_use]
    pub fn at(self, place: impl fmt::Display) -> Self {
        match self {
            Self::Input(text) => Self::Input(format!("{place}: {text}")),
            Self::Run(text) => Self::Run(format!("{place}: {text}")),
        }
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
