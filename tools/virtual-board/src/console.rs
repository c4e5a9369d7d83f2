//! The person at the board: lines on standard input, and the signals that ask the program to end.

use std::io::BufRead;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use anyhow::{Context as _, Result};

/// What a person can ask for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Command {
    /// `press`: the user button goes down.
    Press,
    /// `release`: it goes up.
    Release,
    /// `quit`, SIGINT or SIGTERM: end, with a complete last line.
    Quit,
    /// A line that means nothing.
    Unknown(String),
}

impl Command {
    fn parse(line: &str) -> Option<Self> {
        Some(match line.trim() {
            "" => return None,
            "press" => Command::Press,
            "release" => Command::Release,
            "quit" => Command::Quit,
            other => Command::Unknown(other.to_owned()),
        })
    }
}

/// Source of commands.
pub(crate) struct Console {
    lines: Receiver<Command>,
    signalled: Arc<AtomicBool>,
    open: bool,
}

impl Console {
    /// Listens to standard input and to SIGINT and SIGTERM.
    ///
    /// # Errors
    /// The system lets no handler be set.
    pub(crate) fn open() -> Result<Self> {
        let signalled = Arc::new(AtomicBool::new(false));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&signalled)).context("cannot listen to signals")?;
        }
        let (send, lines) = channel();
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                let Ok(line) = line else { break };
                if Command::parse(&line).is_some_and(|command| send.send(command).is_err()) {
                    break;
                }
            }
        });
        Ok(Console { lines, signalled, open: true })
    }

    /// The next command that has come in.
    pub(crate) fn poll(&mut self) -> Option<Command> {
        if self.signalled.load(Ordering::Relaxed) {
            return Some(Command::Quit);
        }
        match self.lines.try_recv() {
            Ok(command) => Some(command),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.open = false;
                None
            }
        }
    }

    /// False once standard input has ended: only a signal can still come.
    #[must_use]
    pub(crate) const fn is_open(&self) -> bool {
        self.open
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_commands() {
        assert_eq!(Command::parse("press\r"), Some(Command::Press));
        assert_eq!(Command::parse(" release "), Some(Command::Release));
        assert_eq!(Command::parse("quit"), Some(Command::Quit));
        assert_eq!(Command::parse(""), None);
        assert_eq!(Command::parse("jump"), Some(Command::Unknown("jump".into())));
    }
}
