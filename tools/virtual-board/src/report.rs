//! What the board tells: one JSON object a line, on standard output.

use std::collections::BTreeMap;
use std::io::{self, Write};

use serde::Serialize;

/// One line. Times are virtual seconds since power-on.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(crate) enum Line {
    /// First line: what runs.
    Start {
        /// SHA-256 of the ELF file.
        elf_sha256: String,
        /// Core clock at power-on, Hz.
        hclk_hz: u32,
        /// Cycles charged for an instruction.
        cpi: f64,
    },
    /// The chip came out of reset.
    Boot {
        /// When.
        t_s: f64,
        /// `power_on`, `iwdg`, `software` or `pin`.
        cause: String,
    },
    /// Bytes of RTT up channel 0, hexadecimal.
    Rtt {
        /// When they were taken.
        t_s: f64,
        /// The bytes.
        hex: String,
    },
    /// The servo pulses of one period.
    Pulses {
        /// Time of the first rising edge.
        t_s: f64,
        /// Widths on the four servo pins, us; null where there was none.
        us: [Option<f64>; 4],
    },
    /// Each 100 ms.
    Status {
        /// When.
        t_s: f64,
        /// Core clock, Hz.
        hclk_hz: u32,
        /// Instructions executed since power-on.
        instructions: u64,
        /// Exceptions taken since power-on.
        exceptions: u64,
        /// Part of the cycles since the last status line that the core slept.
        asleep: f64,
        /// TIM1's main output enable.
        armed: bool,
    },
    /// The first time of an access that the models cannot follow or the chip would refuse.
    Lint {
        /// When.
        t_s: f64,
        /// In words.
        text: String,
        /// Function that ran then, as far as known.
        function: Option<String>,
    },
    /// A fault exception was taken.
    Fault {
        /// When.
        t_s: f64,
        /// The exception taken: 3 HardFault, 4 MemManage, 5 BusFault, 6 UsageFault.
        exception: u8,
        /// Why.
        cause: &'static str,
        /// Program counter of the cause.
        pc: String,
        /// Function that holds it.
        function: Option<String>,
    },
    /// The core locked up; only a reset helps.
    Lockup {
        /// When.
        t_s: f64,
        /// Why.
        cause: &'static str,
        /// Program counter.
        pc: String,
    },
    /// Text that the program wrote by semihosting.
    Semihosting {
        /// When.
        t_s: f64,
        /// The text.
        text: String,
    },
    /// A fault was put in.
    Injected {
        /// When.
        t_s: f64,
        /// `hang`, `fault`, `panic` or `hse`.
        kind: &'static str,
        /// The symbol, or the function that was called.
        symbol: String,
    },
    /// What an injected fault led to, told when the outputs are armed again or at the end.
    Reaction(Reaction),
    /// Last line.
    End(Box<End>),
}

/// From the effect of an injected fault to the outputs.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Reaction {
    /// `hang`, `fault`, `panic` or `hse`.
    pub(crate) kind: &'static str,
    /// The symbol, or the function that was called.
    pub(crate) symbol: String,
    /// When it was put in; null: the run ended before.
    pub(crate) injected_s: Option<f64>,
    /// When it took effect: the hung function was entered, the fault handler or the panic function began; null: never.
    pub(crate) effect_s: Option<f64>,
    /// From the effect to TIM1's main output enable being clear, us.
    pub(crate) disarmed_us: Option<f64>,
    /// The same in instructions executed.
    pub(crate) disarmed_instructions: Option<u64>,
    /// From the effect to the last moment at which a servo pin was high, us: 0 when all were low already.
    pub(crate) low_us: Option<f64>,
    /// The same in instructions executed.
    pub(crate) low_instructions: Option<u64>,
    /// From the effect to the next reset of the chip, us.
    pub(crate) reset_us: Option<f64>,
}

/// One kind of lint with its count.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct LintCount {
    /// In words.
    pub(crate) text: String,
    /// How often.
    pub(crate) count: u64,
    /// True where the models end.
    pub(crate) unmodelled: bool,
}

/// A reset that happened.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Reset {
    /// When.
    pub(crate) t_s: f64,
    /// `iwdg`, `software` or `pin`.
    pub(crate) cause: String,
}

/// The whole run.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct End {
    /// When it ended.
    pub(crate) t_s: f64,
    /// `time`, `lockup`, `asleep`, `lint`, `killed` or `semihosting`.
    pub(crate) reason: &'static str,
    /// Status that the program gave by semihosting.
    pub(crate) status: Option<u32>,
    /// Number of accesses that the models cannot follow.
    pub(crate) unmodelled: u64,
    /// Every kind of lint.
    pub(crate) lints: Vec<LintCount>,
    /// Every reset after power-on.
    pub(crate) resets: Vec<Reset>,
    /// Fault exceptions taken.
    pub(crate) faults: u64,
    /// Of these, the ones that no injected fault explains.
    pub(crate) unexpected_faults: u64,
    /// Edges of each pin that had any.
    pub(crate) edges: BTreeMap<String, u64>,
    /// Edges of servo pins after a reset and before the first arming.
    pub(crate) edges_before_arming: u64,
    /// Edges of servo pins after disarming.
    pub(crate) edges_after_disarming: u64,
    /// Shortest and longest pulse of each servo, us.
    pub(crate) pulse_us: [Option<[f64; 2]>; 4],
    /// True for a servo pin that was high at the end.
    pub(crate) high_at_end: [bool; 4],
    /// Instructions executed.
    pub(crate) instructions: u64,
    /// Exceptions taken.
    pub(crate) exceptions: u64,
    /// Bytes taken from RTT.
    pub(crate) rtt_bytes: u64,
    /// Injected faults and what they led to.
    pub(crate) injections: Vec<Reaction>,
}

/// A time as it is printed: to the nanosecond.
#[must_use]
pub(crate) fn seconds(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// A duration in us as it is printed: to the nanosecond.
#[must_use]
pub(crate) fn micros(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Writes lines; once the reader has gone away, quietly nothing.
pub(crate) struct Report<W: Write> {
    out: W,
    closed: bool,
    unflushed: bool,
}

impl<W: Write> Report<W> {
    /// Reports to `out`.
    pub(crate) const fn new(out: W) -> Self {
        Report { out, closed: false, unflushed: false }
    }

    /// Writes a line.
    pub(crate) fn line(&mut self, line: &Line) {
        if self.closed {
            return;
        }
        let written = serde_json::to_writer(&mut self.out, line)
            .map_err(io::Error::from)
            .and_then(|()| self.out.write_all(b"\n"));
        self.closed = written.is_err();
        self.unflushed = true;
    }

    /// Hands written lines to the reader.
    pub(crate) fn flush(&mut self) {
        if std::mem::take(&mut self.unflushed) && !self.closed {
            self.closed = self.out.flush().is_err();
        }
    }

    /// True once the reader has gone away.
    #[must_use]
    pub(crate) const fn closed(&self) -> bool {
        self.closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_one_object_with_its_type_first() {
        let mut out = Vec::new();
        let mut report = Report::new(&mut out);
        report.line(&Line::Pulses {
            t_s: seconds(0.020_000_000_04),
            us: [Some(1500.0), None, None, Some(micros(1_499.999_96))],
        });
        report.line(&Line::Boot { t_s: 0.0, cause: "power_on".into() });
        report.flush();
        let text = String::from_utf8(out).unwrap();
        assert_eq!(
            text,
            "{\"type\":\"pulses\",\"t_s\":0.02,\"us\":[1500.0,null,null,1500.0]}\n{\"type\":\"boot\",\"t_s\":0.0,\"cause\":\"power_on\"}\n"
        );
    }

    #[test]
    fn a_reader_that_left_is_noticed_not_fatal() {
        struct Gone;
        impl Write for Gone {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut report = Report::new(Gone);
        report.line(&Line::Boot { t_s: 0.0, cause: "pin".into() });
        assert!(report.closed());
    }
}
