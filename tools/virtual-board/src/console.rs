//! Commands of the user: lines on standard input, and the signals SIGINT and SIGTERM.

use std::io::BufRead;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use anyhow::{Context as _, Result};

use crate::plant::Wire;

/// A command of the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ConsoleCommand {
    /// `press`: press the user button.
    Press,
    /// `release`: release it.
    Release,
    /// `hold`: press it for half a virtual second, a hold whose release arms. It begins when a present `stop` has ended.
    Hold,
    /// `stop`: press the emergency stop for a tenth of a virtual second.
    Stop,
    /// `reset`: press the reset button.
    Reset,
    /// `power`: switch the power off and on.
    Power,
    /// `wire PE9=PC6`: replace all jumper wires by these; `wire` alone removes them.
    Wire(Vec<Wire>),
    /// `inject "reset-button", for_ms = 50`: an event of a fault script, now.
    Inject(String),
    /// `quit`, SIGINT or SIGTERM: end the run with its summary.
    Quit,
    /// Any other line.
    Unknown(String),
}

impl ConsoleCommand {
    fn parse(line: &str) -> Option<Self> {
        Some(match line.trim() {
            "" => return None,
            "press" => ConsoleCommand::Press,
            "release" => ConsoleCommand::Release,
            "hold" => ConsoleCommand::Hold,
            "stop" => ConsoleCommand::Stop,
            "reset" => ConsoleCommand::Reset,
            "power" => ConsoleCommand::Power,
            "quit" => ConsoleCommand::Quit,
            other => match other.split_once(' ').unwrap_or((other, "")) {
                ("wire", wires) => match wires.split_whitespace().map(str::parse).collect() {
                    Ok(wires) => ConsoleCommand::Wire(wires),
                    Err(_) => ConsoleCommand::Unknown(other.to_owned()),
                },
                ("inject", event) => ConsoleCommand::Inject(event.to_owned()),
                _ => ConsoleCommand::Unknown(other.to_owned()),
            },
        })
    }
}

/// Source of commands.
pub(crate) struct Console {
    lines: Receiver<ConsoleCommand>,
    signalled: Arc<AtomicBool>,
    open: bool,
}

impl Console {
    /// Without commands.
    pub(crate) fn closed() -> Self {
        Console { lines: channel().1, signalled: Arc::default(), open: false }
    }

    /// Starts reading standard input and catching SIGINT and SIGTERM.
    ///
    /// # Errors
    /// A signal handler cannot be installed.
    pub(crate) fn open() -> Result<Self> {
        let signalled = Arc::new(AtomicBool::new(false));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&signalled)).context("cannot install a signal handler")?;
        }
        let (send, lines) = channel();
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                let Ok(line) = line else { break };
                if ConsoleCommand::parse(&line).is_some_and(|command| send.send(command).is_err()) {
                    break;
                }
            }
        });
        Ok(Console { lines, signalled, open: true })
    }

    /// The next command; `None`: none so far.
    pub(crate) fn poll(&mut self) -> Option<ConsoleCommand> {
        if self.signalled.load(Ordering::Relaxed) {
            return Some(ConsoleCommand::Quit);
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

    /// False after the end of standard input; signals are still caught.
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
        assert_eq!(ConsoleCommand::parse("press\r"), Some(ConsoleCommand::Press));
        assert_eq!(ConsoleCommand::parse(" release "), Some(ConsoleCommand::Release));
        assert_eq!(ConsoleCommand::parse("hold"), Some(ConsoleCommand::Hold));
        assert_eq!(ConsoleCommand::parse("stop"), Some(ConsoleCommand::Stop));
        assert_eq!(ConsoleCommand::parse("reset"), Some(ConsoleCommand::Reset));
        assert_eq!(ConsoleCommand::parse("power"), Some(ConsoleCommand::Power));
        assert_eq!(ConsoleCommand::parse("quit"), Some(ConsoleCommand::Quit));
        assert_eq!(ConsoleCommand::parse(""), None);
        let [from, to] = ["PE9", "PC6"].map(|name| name.parse().unwrap());
        assert_eq!(ConsoleCommand::parse("wire PE9=PC6"), Some(ConsoleCommand::Wire(vec![Wire { from, to }])));
        assert_eq!(ConsoleCommand::parse("wire"), Some(ConsoleCommand::Wire(vec![])));
        assert_eq!(ConsoleCommand::parse("wire PE9"), Some(ConsoleCommand::Unknown("wire PE9".into())));
        assert_eq!(ConsoleCommand::parse("inject \"halt\""), Some(ConsoleCommand::Inject("\"halt\"".into())));
        assert_eq!(ConsoleCommand::parse("jump"), Some(ConsoleCommand::Unknown("jump".into())));
    }
}
