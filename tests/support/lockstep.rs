//! A conversation with the virtual board that steps it, docs/virtual-board.md.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, ChildStdout};

use serde_json::{Value, json};

/// The conversation, from the side of the program that steps.
#[derive(Debug)]
pub struct Conversation {
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    /// All that the board has written.
    text: String,
}

impl Conversation {
    /// A conversation through these pipes.
    #[must_use]
    pub fn new(requests: ChildStdin, answers: ChildStdout) -> Self {
        Self { requests: Some(requests), answers: BufReader::new(answers), text: String::new() }
    }

    /// Sends a line, and reads its answer: the lines up to `step`, `error` or `end`.
    ///
    /// # Panics
    /// The board has ended, or writes what is no object.
    pub fn ask(&mut self, request: &str) -> Vec<Value> {
        self.send(format!("{request}\n").as_bytes());
        let mut answer: Vec<Value> = Vec::new();
        while !answer.last().is_some_and(|line| ["step", "error", "end"].iter().any(|last| line["type"] == **last)) {
            answer.push(self.line());
        }
        answer
    }

    /// One step, with these keys: the lines of the answer, of which the last is `step`.
    ///
    /// # Panics
    /// As [`Conversation::ask`], or the board refuses it.
    pub fn step(&mut self, us: u64, mut keys: Value) -> Vec<Value> {
        keys["us"] = json!(us);
        let answer = self.ask(&keys.to_string());
        assert_eq!(answer.last().expect("a line")["type"], "step", "{answer:?}");
        answer
    }

    /// The next line of the board.
    ///
    /// # Panics
    /// There is none, or it is no object.
    pub fn line(&mut self) -> Value {
        let before = self.text.len();
        assert!(self.answers.read_line(&mut self.text).expect("JSON is text") > 0, "the board has ended");
        serde_json::from_str(&self.text[before..]).expect("an object")
    }

    /// Sends bytes as they are.
    ///
    /// # Panics
    /// The conversation was ended.
    pub fn send(&mut self, bytes: &[u8]) {
        let requests = self.requests.as_mut().expect("requests were not ended");
        requests.write_all(bytes).expect("the board reads");
    }

    /// Ends the requests, and reads to the end. Returns all that the board has written.
    ///
    /// # Panics
    /// It is no text.
    pub fn finish(&mut self) -> String {
        self.requests = None;
        self.answers.read_to_string(&mut self.text).expect("JSON is text");
        std::mem::take(&mut self.text)
    }
}
