//! Answers of the user, a line each.

use std::io::{self, BufRead};
use std::sync::mpsc::{Receiver, channel};

/// Reads lines in a thread of its own, so that the command does not wait for them.
pub(crate) fn lines(answers: impl BufRead + Send + 'static) -> Receiver<io::Result<String>> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in answers.lines() {
            let failed = line.is_err();
            if sender.send(line).is_err() || failed {
                break;
            }
        }
    });
    receiver
}
