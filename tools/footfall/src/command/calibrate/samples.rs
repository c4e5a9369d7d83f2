//! Live codes of a sensor and their statistics.
//!
//! They come in the inputs records of a board, or in lines: `CODE` or `CODE VREFINT`.

use std::io::{BufRead, Read as _};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use joint_units::AdcCode;
use wire::{Call, Record};

use crate::board::source::Opened;
use crate::board::transport::{Heard, Transport};
use crate::failure::Failure;
use crate::file::capture::rtt::Came;

/// Longest wait for a code.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Longest line of a source, bytes.
const LONGEST_LINE: u64 = 1 << 16;

/// One live sample: a code and, if known, the code of the internal reference.
pub(super) type Sample = (u16, Option<u16>);

/// Samples that wait to be taken, at most.
const QUEUE: usize = 1 << 16;

/// The codes of a board's first sensor, in a thread of its own, as those of [`read_samples`].
pub(super) fn samples_of_board(mut board: Opened) -> Receiver<Result<Sample, String>> {
    let (sender, receiver) = sync_channel(QUEUE);
    std::thread::spawn(move || {
        let mut transport = Transport::default();
        loop {
            let bytes = match board.next(TIMEOUT) {
                Came::Bytes(bytes) => bytes,
                Came::Nothing => continue,
                Came::End => return,
                Came::Broken(error) => {
                    // Without a receiver nobody waits for it.
                    let _ = sender.send(Err(format!("the board: {error}")));
                    return;
                }
            };
            let mut samples = Vec::new();
            let pushed = transport.push(&bytes, |heard| {
                if let Heard::Record(Record::Inputs(inputs)) = heard {
                    let sample = |call: &Call| Some((*call.codes.first()?, Some(call.reference)));
                    samples.extend(inputs.calls.iter().filter_map(sample).map(Ok));
                }
            });
            let failed = pushed.err().map(|error| Err(format!("the board: {error}")));
            let is_last = failed.is_some();
            samples.extend(failed);
            if samples.into_iter().try_for_each(|sample| sender.send(sample)).is_err() || is_last {
                return;
            }
        }
    });
    receiver
}

/// Reads samples in a thread of its own, so that the source does not block while the operator sets an angle.
pub(super) fn read_samples(codes: impl BufRead + Send + 'static) -> Receiver<Result<Sample, String>> {
    let (sender, receiver) = sync_channel(QUEUE);
    std::thread::spawn(move || {
        for (number, line) in (1_u64..).zip(lines(codes)) {
            let read = line.and_then(|line| parse_codes(&line));
            let sent = match read {
                Ok(sample) => sample.map_or(Ok(()), |sample| sender.send(Ok(sample))),
                Err(what) => sender.send(Err(format!("codes, line {number}: {what}"))),
            };
            if sent.is_err() {
                break;
            }
        }
    });
    receiver
}

/// The lines of a source; after one that cannot be read there is none.
fn lines(mut codes: impl BufRead) -> impl Iterator<Item = Result<String, String>> {
    let mut failed = false;
    std::iter::from_fn(move || {
        if failed {
            return None;
        }
        let line = line(&mut codes).transpose()?;
        failed = line.is_err();
        Some(line)
    })
}

/// The next line, without its end; `None` at the end of the source.
fn line(codes: &mut impl BufRead) -> Result<Option<String>, String> {
    let mut bytes = Vec::new();
    let count = codes.take(LONGEST_LINE + 1).read_until(b'\n', &mut bytes).map_err(|error| error.to_string())?;
    if count as u64 > LONGEST_LINE {
        return Err(format!("is longer than {LONGEST_LINE} bytes; allowed is up to that"));
    }
    let text = String::from_utf8(bytes).map_err(|_| "is not text; allowed is text in UTF-8")?;
    Ok((count > 0).then(|| text.trim_end_matches(['\r', '\n']).to_owned()))
}

/// The sample of a line; none for lines that do not begin with a whole number.
fn parse_codes(line: &str) -> Result<Option<Sample>, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let code = |word: &str| word.parse::<u16>().ok().filter(|code| *code <= AdcCode::MAX.0);
    // A number with a point is the time stamp of a log line.
    let begins_with_code =
        words.first().is_some_and(|word| word.starts_with(|c: char| c.is_ascii_digit()) && !word.contains('.'));
    match (&words[..], begins_with_code) {
        ([one], true) => code(one).map(|code| Some((code, None))),
        ([one, other], true) => code(one).zip(code(other)).map(|(code, vrefint)| Some((code, Some(vrefint)))),
        (_, true) => None,
        _ => Some(None),
    }
    .ok_or_else(|| {
        let short: String = line.chars().take(60).collect();
        format!("`{short}`: allowed are `CODE` and `CODE VREFINT`, both 0 to 4095")
    })
}

/// Takes so many samples; they have VREFINT throughout, or never.
pub(super) fn take(
    samples: &Receiver<Result<Sample, String>>,
    count: usize,
    with_vrefint: &mut Option<bool>,
) -> Result<Vec<Sample>, Failure> {
    let mut taken = Vec::with_capacity(count);
    while taken.len() < count {
        let sample = samples.recv_timeout(TIMEOUT).map_err(|error| {
            let had = taken.len();
            Failure::input(match error {
                RecvTimeoutError::Timeout => {
                    format!("no code came for {} s, {had} of {count} were taken", TIMEOUT.as_secs())
                }
                RecvTimeoutError::Disconnected => format!("the codes end, {had} of {count} were taken"),
            })
        })?;
        let sample = sample.map_err(Failure::input)?;
        if *with_vrefint.get_or_insert(sample.1.is_some()) != sample.1.is_some() {
            return Err(Failure::input("codes with and without VREFINT; allowed is one or the other throughout"));
        }
        taken.push(sample);
    }
    Ok(taken)
}

/// Mean, standard deviation, and rise of the straight line from the first to the last, in codes.
pub(super) fn statistics(samples: &[Sample]) -> (f64, f64, f64) {
    let n = samples.len() as f64;
    let mean = samples.iter().map(|&(code, _)| f64::from(code)).sum::<f64>() / n;
    let (mut squares, mut cross, mut times) = (0.0, 0.0, 0.0);
    for (k, &(code, _)) in samples.iter().enumerate() {
        let (time, off) = (k as f64 - 0.5 * (n - 1.0), f64::from(code) - mean);
        squares += off * off;
        cross += time * off;
        times += time * time;
    }
    (mean, (squares / (n - 1.0)).sqrt(), cross / times * (n - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn lines_end_in_any_way_and_have_a_longest_length() {
        let samples = read_samples(Cursor::new("1\r\n2 3\nlog\n4"));
        let all: Vec<Sample> = samples.iter().map(Result::unwrap).collect();
        assert_eq!(all, [(1, None), (2, Some(3)), (4, None)]);
        // A source without a line's end, such as /dev/zero.
        let samples = read_samples(Cursor::new(vec![0; 1 << 20]));
        let all: Vec<_> = samples.iter().collect();
        assert_eq!(all, [Err("codes, line 1: is longer than 65536 bytes; allowed is up to that".to_owned())]);
        let samples = read_samples(Cursor::new(b"7\n\xff\n8\n"));
        assert_eq!(samples.iter().filter(Result::is_err).count(), 1);
    }
}
