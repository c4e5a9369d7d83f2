//! Output of the virtual board: one JSON object per line on standard output.

use std::collections::BTreeMap;
use std::io::{self, Write};

use serde::Serialize;

use crate::campaign::Totals;
use crate::judge::Judged;

/// One line of output. Times are virtual seconds since power-on.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(crate) enum ReportLine {
    /// First line of a conversation step by step: its protocol.
    Lockstep {
        /// Version of the protocol.
        version: u64,
        /// How the servos are mounted, by the robot record in flash; null: it has no valid one, and no servo is driven.
        joints: Option<[MountedJoint; 4]>,
    },
    /// Last line of the answer to a request of such a conversation.
    Step(Box<StepEnd>),
    /// A request that was refused; the board is as before.
    Error {
        /// The key that is wrong; empty: the line as a whole.
        field: String,
        /// What is wrong, and what is allowed.
        text: String,
    },
    /// First line, but for `lockstep`: the program.
    Start {
        /// SHA-256 of the ELF file.
        elf_sha256: String,
        /// The board on which it runs.
        board: &'static str,
        /// Core clock at power-on, Hz.
        hclk_hz: u32,
        /// Cycles per instruction.
        cpi: f64,
    },
    /// The host's end of the serial port.
    Serial {
        /// Its name.
        port: String,
    },
    /// The board is a debug probe with its target.
    Probe {
        /// Address at which it listens.
        address: String,
    },
    /// A client of the probe has connected, or is gone.
    ProbeClient {
        /// Time.
        t_s: f64,
        /// True: it has connected.
        connected: bool,
    },
    /// The chip left reset.
    Boot {
        /// Time.
        t_s: f64,
        /// `power_on`, `iwdg`, `software` or `pin`.
        cause: String,
    },
    /// The address of a server for RTT channel 1.
    RttServer {
        /// `HOST:PORT`.
        address: String,
    },
    /// Bytes of an RTT up channel, hexadecimal.
    Rtt {
        /// Time at which they were read.
        t_s: f64,
        /// Number of the channel.
        channel: u8,
        /// The bytes.
        hex: String,
    },
    /// The servo pulses of one period.
    Pulses {
        /// Time of the first rising edge.
        t_s: f64,
        /// Widths on the four servo pins, us; null: no pulse.
        us: [Option<f64>; 4],
        /// Whether the servos' supply was on at the end of the last pulse.
        rail: bool,
    },
    /// Modelled servos, every 20 ms.
    Servos {
        /// Time.
        t_s: f64,
        /// Angles of the joints, degrees.
        deg: [f64; 4],
        /// Torque of each servo, as a part of what its motor can give, 0 to 1.
        torque: [f64; 4],
    },
    /// State of the run, every 100 ms.
    Status {
        /// Time.
        t_s: f64,
        /// Core clock, Hz.
        hclk_hz: u32,
        /// Instructions executed since power-on.
        instructions: u64,
        /// Exceptions taken since power-on.
        exceptions: u64,
        /// Fraction of the cycles since the last status line in which the core slept, 0 to 1.
        asleep: f64,
        /// TIM1's main output enable.
        armed: bool,
    },
    /// First occurrence of an access that is not modelled, not clocked or not allowed.
    Lint {
        /// Time.
        t_s: f64,
        /// Description.
        text: String,
        /// Function that made it; null: not known.
        function: Option<String>,
    },
    /// A fault exception was taken.
    Fault {
        /// Time.
        t_s: f64,
        /// The exception taken: 3 HardFault, 4 MemManage, 5 BusFault, 6 UsageFault.
        exception: u8,
        /// Cause, in words.
        cause: &'static str,
        /// Program counter, hexadecimal.
        pc: String,
        /// Function at the program counter; null: not known.
        function: Option<String>,
    },
    /// The core locked up; only a reset ends that.
    Lockup {
        /// Time.
        t_s: f64,
        /// Cause, in words.
        cause: &'static str,
        /// Program counter, hexadecimal.
        pc: String,
    },
    /// Text that the program wrote by semihosting.
    Semihosting {
        /// Time.
        t_s: f64,
        /// The text.
        text: String,
    },
    /// A fault was injected.
    Injected {
        /// Time.
        t_s: f64,
        /// `hang`, `fault`, `panic`, `hse`, `overrun`, `dma`, `trigger` or `register`.
        kind: &'static str,
        /// Name of the function or of the peripheral.
        symbol: String,
    },
    /// Outcome of an injected fault, written when the outputs are armed again or at the end.
    Reaction(Reaction),
    /// Last line.
    End(Box<RunSummary>),
}

/// How a servo is mounted on its joint.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct MountedJoint {
    /// Pin of the servo.
    pub(crate) pin: String,
    /// The joint.
    pub(crate) joint: &'static str,
    /// Pulse at `deg_at_neutral`, us.
    pub(crate) neutral_us: f64,
    /// Angle of the joint at the neutral pulse, degrees.
    pub(crate) deg_at_neutral: f64,
    /// Change of the pulse, us a degree: negative where the servo is mirrored.
    pub(crate) us_per_deg: f64,
}

/// State of the board at the end of a step.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct StepEnd {
    /// The board's time: the steps so far, us.
    pub(crate) t_us: u64,
    /// TIM1's main output enable.
    pub(crate) armed: bool,
    /// The servos' supply is on.
    pub(crate) rail: bool,
    /// Lamps that changed.
    pub(crate) lamps: Vec<LampChange>,
    /// Angles of the joints of modelled servos, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) deg: Option<[f64; 4]>,
    /// Torque of each, as a part of what its motor can give, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) torque: Option<[f64; 4]>,
}

/// A lamp is switched.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct LampChange {
    /// Time.
    pub(crate) t_s: f64,
    /// Its pin.
    pub(crate) pin: String,
    /// It is lit.
    pub(crate) on: bool,
}

/// Outcome of an injected fault: times from its effect to safe outputs and to the reset.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Reaction {
    /// `hang`, `fault`, `panic`, `hse`, `overrun`, `dma`, `trigger` or `register`.
    pub(crate) kind: &'static str,
    /// Name of the function or of the peripheral.
    pub(crate) symbol: String,
    /// Time of the injection; null: the run ended before.
    pub(crate) injected_s: Option<f64>,
    /// Time of its effect: start of the hung function, of the fault handler or of the panic function; null: no effect.
    pub(crate) effect_s: Option<f64>,
    /// Its end; null: it has none, or the run ended before.
    pub(crate) ended_s: Option<f64>,
    /// From the effect until TIM1's main output enable was clear, us; null: it stayed set.
    pub(crate) disarmed_us: Option<f64>,
    /// The same, in instructions executed.
    pub(crate) disarmed_instructions: Option<u64>,
    /// From the effect to the last time at which a servo pin was high, us; 0: all were low already; null: pulses continued.
    pub(crate) low_us: Option<f64>,
    /// The same, in instructions executed.
    pub(crate) low_instructions: Option<u64>,
    /// From the effect until the servos' supply was off, us; 0: it was off already; null: it stayed on.
    pub(crate) rail_us: Option<f64>,
    /// From the effect to the next reset of the chip, us; null: no reset.
    pub(crate) reset_us: Option<f64>,
}

/// A lint with its count.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct LintCount {
    /// Description.
    pub(crate) text: String,
    /// Number of occurrences.
    pub(crate) count: u64,
    /// True: the access is not modelled, so that the run shows nothing about the chip.
    pub(crate) unmodelled: bool,
}

/// A reset during the run.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ResetRecord {
    /// Time.
    pub(crate) t_s: f64,
    /// `iwdg`, `software` or `pin`.
    pub(crate) cause: String,
}

/// Summary of the run.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct RunSummary {
    /// Time at which it ended.
    pub(crate) t_s: f64,
    /// `time`, `lockup`, `asleep` (no wake-up source), `lint`, `killed` (`quit`, signal or closed output) or `semihosting`.
    pub(crate) reason: &'static str,
    /// Exit status that the program passed by semihosting.
    pub(crate) status: Option<u32>,
    /// Number of accesses that are not modelled.
    pub(crate) unmodelled: u64,
    /// All lints.
    pub(crate) lints: Vec<LintCount>,
    /// All resets after power-on.
    pub(crate) resets: Vec<ResetRecord>,
    /// Fault exceptions taken.
    pub(crate) faults: u64,
    /// Of these, those that were not caused by an injected fault.
    pub(crate) unexpected_faults: u64,
    /// Number of edges of each pin with edges.
    pub(crate) edges: BTreeMap<String, u64>,
    /// Edges of servo pins between a reset and the first arming.
    pub(crate) edges_before_arming: u64,
    /// Edges of servo pins while disarmed, after an arming.
    pub(crate) edges_after_disarming: u64,
    /// Shortest and longest pulse of each servo, us; null: no pulse.
    pub(crate) pulse_us: [Option<[f64; 2]>; 4],
    /// Level of each servo pin at the end; true is high.
    pub(crate) high_at_end: [bool; 4],
    /// Shortest time from a write of a pulse width to the start of a servo frame, us; null: none was written while armed.
    pub(crate) frame_margin_us: Option<f64>,
    /// What came of the pulses.
    pub(crate) judged: Judged,
    /// Least and most angle of the joint of each modelled servo, degrees; null: none was modelled.
    pub(crate) servo_deg: Option<[[f64; 2]; 4]>,
    /// Instructions executed.
    pub(crate) instructions: u64,
    /// Exceptions taken.
    pub(crate) exceptions: u64,
    /// Interrupt lines that are enabled at the end, each with its priority, 0 to 15.
    pub(crate) interrupts: BTreeMap<u8, u8>,
    /// Bytes read from RTT.
    pub(crate) rtt_bytes: u64,
    /// Counts of ticks in the newest frame on the serial port since the last reset; null: none was read.
    pub(crate) reported: Option<Totals>,
    /// Injected faults and their outcomes.
    pub(crate) injections: Vec<Reaction>,
}

/// Rounds a time in s to 1 ns for the output.
#[must_use]
pub(crate) fn seconds(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// Rounds an angle in degrees, or a part of 1, to a thousandth for the output.
#[must_use]
pub(crate) fn degrees(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Rounds a duration in us to 1 ns for the output.
#[must_use]
pub(crate) fn micros(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Writes lines. After the reader has closed the pipe it discards them.
pub(crate) struct ReportWriter<W: Write> {
    out: W,
    closed: bool,
    unflushed: bool,
}

impl<W: Write> ReportWriter<W> {
    /// A writer to `out`.
    pub(crate) const fn new(out: W) -> Self {
        ReportWriter { out, closed: false, unflushed: false }
    }

    /// Writes a line.
    pub(crate) fn line(&mut self, line: &ReportLine) {
        if self.closed {
            return;
        }
        let written = serde_json::to_writer(&mut self.out, line)
            .map_err(io::Error::from)
            .and_then(|()| self.out.write_all(b"\n"));
        self.closed = written.is_err();
        self.unflushed = true;
    }

    /// Flushes the written lines.
    pub(crate) fn flush(&mut self) {
        if std::mem::take(&mut self.unflushed) && !self.closed {
            self.closed = self.out.flush().is_err();
        }
    }

    /// True after the reader has closed the pipe.
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
        let mut report = ReportWriter::new(&mut out);
        report.line(&ReportLine::Pulses {
            t_s: seconds(0.020_000_000_04),
            us: [Some(1500.0), None, None, Some(micros(1_499.999_96))],
            rail: true,
        });
        report.line(&ReportLine::Boot { t_s: 0.0, cause: "power_on".into() });
        report.flush();
        let text = String::from_utf8(out).unwrap();
        assert_eq!(
            text,
            "{\"type\":\"pulses\",\"t_s\":0.02,\"us\":[1500.0,null,null,1500.0],\"rail\":true}\n{\"type\":\"boot\",\"t_s\":0.0,\"cause\":\"power_on\"}\n"
        );
    }

    #[test]
    fn a_closed_pipe_is_detected_and_not_fatal() {
        struct Gone;
        impl Write for Gone {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut report = ReportWriter::new(Gone);
        report.line(&ReportLine::Boot { t_s: 0.0, cause: "pin".into() });
        assert!(report.closed());
    }
}
