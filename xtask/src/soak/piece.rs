//! One piece of a soak: a run of the virtual board from power-on to a stop, with its log treated in one way.

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use super::bench::Bench;
use super::judge::Judge;
use crate::shell;

/// Before its end a piece stops: the outputs are off when it ends.
const STOP_BEFORE_END_S: f64 = 4.0;
/// Of each piece the button is held so much later than of the one before, so that the walk meets other phases of the recorded gait.
const LATER_S: f64 = 0.137;
const FIRST_HOLD_S: f64 = 0.4;
const HOLD_S: f64 = 0.35;
/// Ticks that may come before the first frame and after the last.
const TICKS_AT_THE_ENDS: u64 = 400;
const TICKS_PER_S: f64 = 1_000.0;
/// Frames of pulses a second.
const FRAMES_PER_S: f64 = 50.0;
/// The cycle counter of 32 bits at 168 MHz, and the timer of 32 bits at 1 MHz, wrap after these times.
const CYCLES_WRAP_S: f64 = 4_294_967_296.0 / 168e6;
const MICROSECONDS_WRAP_S: f64 = 4_294.967_296;

/// What is done with the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Log {
    /// Nothing reads it, and the board finds the channel as it set it up.
    NotAttached,
    /// A debugger reads it all the time.
    Read,
    /// A debugger has attached, so that the board waits for room in the channel, and reads nothing.
    NotRead,
}

impl Log {
    pub(crate) const ALL: [Self; 3] = [Self::NotAttached, Self::Read, Self::NotRead];

    /// The words of the table.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::NotAttached => "not attached",
            Self::Read => "read",
            Self::NotRead => "attached, not read",
        }
    }

    const fn options(self) -> &'static [&'static str] {
        match self {
            Self::NotAttached => &["--no-drain"],
            Self::Read => &[],
            Self::NotRead => &["--rtt-mode", "2", "--no-drain"],
        }
    }
}

/// A piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    pub(crate) number: u32,
    pub(crate) log: Log,
    /// Virtual seconds.
    pub(crate) secs: f64,
}

/// How far a piece is.
#[derive(Debug, Default)]
pub(crate) struct Reached(AtomicU64);

impl Reached {
    /// Virtual seconds.
    pub(crate) fn seconds(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }

    fn set(&self, seconds: f64) {
        self.0.store(seconds.to_bits(), Ordering::Relaxed);
    }
}

/// Counts of ticks that the board has reported.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Ticks {
    pub(crate) ticks: u64,
    pub(crate) missed: u64,
    pub(crate) late: u64,
}

/// What the log says, where it is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Logged {
    pub(crate) ticks: Ticks,
    /// Over every setpoint of every tick.
    pub(crate) setpoint_hash: String,
}

/// What came of a piece.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) piece: Piece,
    pub(crate) frames: u64,
    /// Frames that are missing or not whole, and what the virtual board's judgement found.
    pub(crate) violations: u64,
    /// Over every pulse at the pins.
    pub(crate) pulse_hash: String,
    /// Those of the newest frame on the serial port, which does not depend on the log.
    pub(crate) ticks: Ticks,
    pub(crate) logged: Option<Logged>,
    /// Seconds of the processor; `None` where the system does not say.
    pub(crate) cpu_s: Option<f64>,
    /// Everything that is wrong, in words.
    pub(crate) wrong: Vec<String>,
}

impl Ran {
    /// How often the cycle counter and the timer of the microseconds have wrapped.
    pub(crate) fn wraps(&self) -> [u64; 2] {
        [CYCLES_WRAP_S, MICROSECONDS_WRAP_S].map(|wrap_s| (self.piece.secs / wrap_s) as u64)
    }
}

impl Piece {
    /// Frequency of the watchdog's oscillator: the usual one, and the ends of what its data sheet allows, in turn. At the highest it resets soonest.
    pub(crate) const fn watchdog_hz(&self) -> u32 {
        [32_000, 17_000, 47_000][self.number as usize % 3]
    }

    /// Runs it to its end.
    pub(crate) fn run(&self, bench: &Bench, reached: &Reached) -> Result<Ran> {
        let hold_s = FIRST_HOLD_S + LATER_S * f64::from(self.number % 8);
        let mut command = bench.board_command(self.secs);
        command.args([
            "--press",
            &format!("{hold_s}:{HOLD_S}"),
            "--press",
            &format!("{}:0.1", self.secs - STOP_BEFORE_END_S),
        ]);
        command.args(self.log.options());
        command.args(["--lsi-hz", &self.watchdog_hz().to_string()]);
        let mut board =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().context("starting the virtual board")?;
        let lines = BufReader::new(board.stdout.take().context("no standard output of the virtual board")?).lines();
        let mut reader = if self.log == Log::Read { Some(Reader::start(bench)?) } else { None };
        let mut judge = Judge::default();
        let (mut end, mut cpu_s) = (None, None);
        for line in lines {
            let line = line.context("reading from the virtual board")?;
            if line.contains(r#""type":"pulses""#) {
                judge.take(&line)?;
            } else if line.contains(r#""type":"rtt""#) {
                // Channel 1 has the records.
                if let Some(reader) = reader.as_mut().filter(|_| line.contains(r#""channel":1,"#)) {
                    reader.take(&line)?;
                }
            } else if line.contains(r#""type":"status""#) {
                reached.set(object(&line)?["t_s"].as_f64().unwrap_or_default());
            } else if line.contains(r#""type":"end""#) {
                cpu_s = processor_seconds(&board);
                end = Some(object(&line)?);
            }
        }
        let status = board.wait().context("waiting for the virtual board")?;
        let Some(end) = end else { bail!("the virtual board ended with {status}, without a result") };
        reached.set(self.secs);
        let logged = reader.map(Reader::finish).transpose()?;
        let reported = ticks(&end["reported"], ["tick", "missed", "late"]);
        let mut wrong = self.judged(&end, &judge, reported, logged.as_ref());
        if !status.success() {
            wrong.push(format!("the virtual board ended with {status}"));
        }
        let judged = end["judged"]["violations"].as_u64().unwrap_or_default();
        let (frames, violations, pulse_hash) = (judge.frames, judge.violations + judged, judge.hash());
        Ok(Ran {
            piece: *self,
            frames,
            violations,
            pulse_hash,
            ticks: reported.unwrap_or_default(),
            logged,
            cpu_s,
            wrong,
        })
    }

    /// Everything that is wrong.
    fn judged(&self, end: &Value, judge: &Judge, reported: Option<Ticks>, logged: Option<&Logged>) -> Vec<String> {
        let mut wrong: Vec<String> = judge.first.iter().cloned().collect();
        if end["judged"]["violations"] != 0 {
            wrong.push(format!("the virtual board's judgement of the pulses: {}", end["judged"]));
        }
        for key in ["unmodelled", "unexpected_faults", "edges_before_arming", "edges_after_disarming"] {
            if end[key] != 0 {
                wrong.push(format!("{key}: {}", end[key]));
            }
        }
        for key in ["lints", "resets"] {
            if end[key].as_array().is_none_or(|list| !list.is_empty()) {
                wrong.push(format!("{key}: {}", end[key]));
            }
        }
        // It walks from the hold to the stop.
        let least =
            ((self.secs - STOP_BEFORE_END_S - FIRST_HOLD_S - 8.0 * LATER_S - HOLD_S - 1.0) * FRAMES_PER_S) as u64;
        if judge.frames < least {
            wrong.push(format!("{} frames of pulses, at least {least} are expected", judge.frames));
        }
        if reported.is_none() {
            wrong.push("no frame on the serial port since the last reset".to_owned());
        }
        let counted = [("on the serial port", reported), ("in the log", logged.map(|logged| logged.ticks))];
        for (place, counted) in counted {
            let Some(Ticks { ticks, missed, late }) = counted else { continue };
            let most = (self.secs * TICKS_PER_S) as u64;
            let least = most - TICKS_AT_THE_ENDS;
            if !(least..=most).contains(&ticks) {
                wrong.push(format!("{ticks} ticks {place}, {least} to {most} are expected"));
            }
            if (missed, late) != (0, 0) {
                wrong.push(format!("{missed} missed and {late} late ticks {place}"));
            }
        }
        wrong
    }
}

/// Counts of ticks in an object, by the names of ticks, missed and late ones; `None`: it lacks one.
fn ticks(object: &Value, names: [&str; 3]) -> Option<Ticks> {
    let [ticks, missed, late] = names.map(|key| object[key].as_u64());
    Some(Ticks { ticks: ticks?, missed: missed?, late: late? })
}

fn object(line: &str) -> Result<Value> {
    serde_json::from_str(line).with_context(|| format!("`{line}` is no JSON"))
}

/// `footfall watch`, which decodes the records.
struct Reader {
    child: Child,
    input: ChildStdin,
    last: thread::JoinHandle<Result<Option<Value>>>,
}

impl Reader {
    fn start(bench: &Bench) -> Result<Self> {
        let mut command = shell::command(&bench.footfall);
        command.args(["watch", "--quiet", "--json", "--rtt", "-"]);
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().context("starting footfall watch")?;
        let input = child.stdin.take().context("no standard input of footfall watch")?;
        let lines = BufReader::new(child.stdout.take().context("no standard output of footfall watch")?).lines();
        let last = thread::spawn(move || {
            let mut last = None;
            for line in lines {
                let line = line.context("reading from footfall watch")?;
                if line.contains(r#""type":"tick""#) {
                    last = Some(line);
                }
            }
            last.as_deref().map(object).transpose()
        });
        Ok(Self { child, input, last })
    }

    /// Hands the bytes of a line on.
    fn take(&mut self, line: &str) -> Result<()> {
        let line = object(line)?;
        let hex = line["hex"].as_str().context("a line of the log without bytes")?;
        let digit = |place: usize| hex.get(place..place + 2).and_then(|two| u8::from_str_radix(two, 16).ok());
        let bytes: Option<Vec<u8>> = (0..hex.len()).step_by(2).map(digit).collect();
        self.input
            .write_all(&bytes.context("a line of the log that is not hexadecimal")?)
            .context("writing to footfall watch")
    }

    /// The last tick that the log has.
    fn finish(self) -> Result<Logged> {
        let Self { mut child, input, last } = self;
        drop(input);
        let last = last.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        let status = child.wait().context("waiting for footfall watch")?;
        if !status.success() {
            bail!("footfall watch failed ({status})");
        }
        let last = last.context("the log has no tick")?;
        Ok(Logged {
            ticks: ticks(&last, ["tick", "missed_ticks", "late_ticks"]).context("a tick of the log without counts")?,
            setpoint_hash: last["setpoint_hash"].as_str().context("a tick of the log without its hash")?.to_owned(),
        })
    }
}

/// Processor seconds of a child so far: fields 14 and 15 of its `stat`, in hundredths (proc(5)).
fn processor_seconds(child: &Child) -> Option<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
    // Behind the name, which may have blanks.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(11..13)?.iter().map(|field| field.parse::<f64>().ok()).sum::<Option<f64>>()?;
    Some(ticks / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn ticks_resets_and_reports_that_are_missing_are_named() {
        let piece = Piece { number: 0, log: Log::NotAttached, secs: 20.0 };
        let sound = json!({
            "judged": { "violations": 0 }, "unmodelled": 0, "unexpected_faults": 0, "edges_before_arming": 0, "edges_after_disarming": 0,
            "lints": [], "resets": [], "reported": { "tick": 19_980, "missed": 0, "late": 0, "overruns": 0 },
        });
        let mut judge = Judge::default();
        judge.frames = 700;
        let wrong = |key: &str, value: Value| {
            let mut end = sound.clone();
            end[key] = value;
            piece.judged(&end, &judge, ticks(&end["reported"], ["tick", "missed", "late"]), None)
        };
        assert_eq!(wrong("lints", json!([])), [""; 0]);
        let reported = |tick: u64, missed: u64, late: u64| json!({ "tick": tick, "missed": missed, "late": late });
        for (key, value, words) in [
            ("reported", reported(19_980, 1, 0), "1 missed and 0 late ticks on the serial port"),
            ("reported", reported(19_980, 0, 2), "0 missed and 2 late ticks on the serial port"),
            ("reported", reported(19_599, 0, 0), "19599 ticks on the serial port, 19600 to 20000 are expected"),
            ("reported", reported(20_001, 0, 0), "20001 ticks on the serial port, 19600 to 20000 are expected"),
            ("reported", Value::Null, "no frame on the serial port since the last reset"),
            ("resets", json!([{ "cause": "iwdg" }]), "resets:"),
            ("edges_before_arming", json!(1), "edges_before_arming: 1"),
        ] {
            let found = wrong(key, value);
            assert!(matches!(found.as_slice(), [one] if one.contains(words)), "{words}: {found:?}");
        }
    }
}
