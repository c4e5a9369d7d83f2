//! Options of every command: how much is said, and in which colours.

use clap::{Args, ColorChoice};
use std::ffi::OsString;

use crate::messages::{self, Amount};

/// How much is said, and in which colours.
#[derive(Debug, Clone, Args)]
pub struct Manners {
    /// Colours of messages, help texts and live screens; `auto`: on a terminal, unless NO_COLOR is set
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto", help_heading = "General options")]
    pub color: ColorChoice,
    /// Print no notes, no progress and no names of written files to standard error: only warnings and errors
    #[arg(short, long, global = true, help_heading = "General options")]
    pub quiet: bool,
    /// Print also the files that are read, and how long the command took
    #[arg(short, long, global = true, conflicts_with = "quiet", help_heading = "General options")]
    pub verbose: bool,
}

impl Manners {
    /// Makes them those of the program.
    pub fn apply(&self) {
        messages::set_colour(self.color);
        messages::set_amount(match (self.quiet, self.verbose) {
            (true, _) => Amount::Quiet,
            (_, true) => Amount::Verbose,
            _ => Amount::Usual,
        });
    }
}

/// The colours that the arguments ask for, for help texts and errors of the arguments themselves.
#[must_use]
pub fn colour_asked(arguments: &[OsString]) -> Option<ColorChoice> {
    let mut words = arguments.iter().map(|word| word.to_string_lossy()).take_while(|word| word != "--");
    let mut asked = None;
    while let Some(word) = words.next() {
        let value = match word.strip_prefix("--color") {
            Some("") => words.next().map(|word| word.into_owned()),
            Some(rest) => rest.strip_prefix('=').map(str::to_owned),
            None => continue,
        };
        asked = value.and_then(|value| value.parse().ok()).or(asked);
    }
    asked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_are_known_before_the_arguments_are() {
        let asked = |line: &str| colour_asked(&line.split(' ').map(OsString::from).collect::<Vec<_>>());
        assert_eq!(asked("footfall --color never fit --help"), Some(ColorChoice::Never));
        assert_eq!(asked("footfall fit --color=always"), Some(ColorChoice::Always));
        assert_eq!(asked("footfall fit --color"), None);
        assert_eq!(asked("footfall watch -- --color never"), None);
        assert_eq!(asked("footfall --colors never"), None);
    }
}
