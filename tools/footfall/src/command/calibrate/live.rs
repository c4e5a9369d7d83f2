//! Shows the last second of the sensor's codes on one line of the terminal, above the input line, while the operator sets an
//! angle.

use super::samples::{Sample, statistics};
use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

/// Interval of the updates.
pub(crate) const EVERY: Duration = Duration::from_millis(200);

/// Number of samples in the statistics: one second of the board.
const WINDOW: usize = 1000;

/// Time without codes until this is shown.
const SILENT: Duration = Duration::from_secs(1);

/// The line.
pub(crate) struct Live {
    window: VecDeque<Sample>,
    last: Instant,
    /// The error of the codes.
    wrong: Option<String>,
}

impl Live {
    /// Writes the empty line and the input line below it.
    pub(crate) fn begin(out: &mut impl Write) -> io::Result<Self> {
        write!(out, "\n> ")?;
        out.flush()?;
        Ok(Self { window: VecDeque::with_capacity(WINDOW), last: Instant::now(), wrong: None })
    }

    /// Takes the new samples and writes the line again; the cursor stays in place.
    pub(crate) fn refresh(
        &mut self,
        samples: &Receiver<Result<Sample, String>>,
        out: &mut impl Write,
    ) -> io::Result<()> {
        loop {
            match samples.try_recv() {
                Ok(Ok(sample)) => {
                    if self.window.len() == WINDOW {
                        self.window.pop_front();
                    }
                    self.window.push_back(sample);
                    (self.last, self.wrong) = (Instant::now(), None);
                }
                Ok(Err(what)) => self.wrong = Some(what),
                Err(TryRecvError::Disconnected) => {
                    self.wrong.get_or_insert_with(|| "the codes have ended".into());
                    break;
                }
                Err(TryRecvError::Empty) => break,
            }
        }
        write!(out, "\x1b7\x1b[1A\r\x1b[K{}\x1b8", self.line())?;
        out.flush()
    }

    fn line(&self) -> String {
        let silent = self.last.elapsed();
        match (&self.wrong, self.window.back()) {
            (Some(what), _) => what.chars().filter(|c| !c.is_control()).take(78).collect(),
            (None, _) if silent > SILENT => format!("no code for {} s", silent.as_secs()),
            (None, None) => String::new(),
            (None, Some((code, _))) if self.window.len() < 2 => format!("code {code}"),
            (None, Some((code, _))) => {
                let samples: Vec<Sample> = self.window.iter().copied().collect();
                let (mean, sd, drift) = statistics(&samples);
                let n = samples.len();
                format!("code {code}: mean {mean:.1}, standard deviation {sd:.2}, drift {drift:+.1} of {n}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn the_line_is_the_last_second_and_what_is_wrong() {
        let (send, receive) = channel();
        let mut said = Vec::new();
        let mut live = Live::begin(&mut said).unwrap();
        for n in 0..3000_u16 {
            send.send(Ok((n, None))).unwrap();
        }
        said.clear();
        live.refresh(&receive, &mut said).unwrap();
        // A straight line: its mean is the middle of the last thousand samples, its drift their rise.
        assert_eq!(
            String::from_utf8(said.clone()).unwrap(),
            "\u{1b}7\u{1b}[1A\r\u{1b}[Kcode 2999: mean 2499.5, standard deviation 288.82, drift +999.0 of 1000\u{1b}8"
        );
        send.send(Err("codes, line 3: `x\u{1b}`".into())).unwrap();
        live.refresh(&receive, &mut said).unwrap();
        assert!(String::from_utf8(said.clone()).unwrap().ends_with("codes, line 3: `x`\u{1b}8"));
        send.send(Ok((7, None))).unwrap();
        drop(send);
        live.refresh(&receive, &mut said).unwrap();
        assert!(String::from_utf8(said).unwrap().ends_with("the codes have ended\u{1b}8"));
    }
}
