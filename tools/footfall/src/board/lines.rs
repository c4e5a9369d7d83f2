//! The output of the virtual board's process: one JSON object a line. Fields that are not needed here are ignored.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// The RTT up channel with the log for people.
pub const TEXT: u8 = 0;

/// The RTT up channel with the records.
pub const RECORDS: u8 = 1;

/// A line.
#[derive(Debug, Clone, PartialEq)]
pub enum BoardLine {
    /// First line.
    Start {
        /// SHA-256 of the ELF file.
        elf_sha256: String,
    },
    /// The chip left reset.
    Boot {
        /// Virtual seconds since power-on.
        t_s: f64,
        /// `power_on`, `iwdg`, `software` or `pin`.
        cause: String,
    },
    /// Bytes of the log.
    Rtt {
        /// Virtual time, s.
        t_s: f64,
        /// Its RTT up channel.
        channel: u8,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// Servo pulses of one period, measured at the pins.
    Pulses {
        /// Virtual time, s.
        t_s: f64,
        /// Widths in microseconds, left hip, right hip, left knee, right knee; `None` without a pulse.
        us: [Option<f64>; 4],
    },
    /// Every 100 ms.
    Status {
        /// Virtual time, s.
        t_s: f64,
    },
    /// An unsupported access, a fault, a lock-up, an injected fault or its effect.
    Remark {
        /// Virtual time, if the line has it.
        t_s: Option<f64>,
        /// The type of the line.
        kind: String,
        /// The line.
        text: String,
    },
    /// Last line.
    End(Box<End>),
}

/// The result of a run, from the virtual board.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct End {
    /// Virtual seconds.
    pub t_s: f64,
    /// `time`, `killed`, `lockup`, `asleep`, `lint` ...
    pub reason: String,
    /// Accesses that the models do not support.
    pub unmodelled: u64,
    /// Every kind of irregular access.
    #[serde(default)]
    pub lints: Vec<Value>,
    /// Every reset after power-on.
    #[serde(default)]
    pub resets: Vec<Reset>,
    /// Faults that were not injected.
    #[serde(default)]
    pub unexpected_faults: u64,
    /// Edges of each pin with edges.
    #[serde(default)]
    pub edges: BTreeMap<String, u64>,
    /// Edges of servo pins before the first arming after a reset.
    pub edges_before_arming: u64,
    /// Edges of servo pins after disarming.
    pub edges_after_disarming: u64,
    /// Shortest and longest pulse of each servo.
    pub pulse_us: [Option<[f64; 2]>; 4],
    /// Injected faults and their effects.
    #[serde(default)]
    pub injections: Vec<Value>,
    /// Shortest time from a write of a pulse width to the start of a servo frame, us; `None` if none was written while armed.
    #[serde(default)]
    pub frame_margin_us: Option<f64>,
    /// What came of the pulses.
    #[serde(default)]
    pub judged: Judged,
    /// Least and most angle of each modelled servo's joint, degrees; null without modelled servos.
    #[serde(default)]
    pub servo_deg: Value,
    /// Interrupt lines that are enabled at the end, each with its priority, 0 to 15.
    #[serde(default)]
    pub interrupts: BTreeMap<u8, u8>,
    /// Instructions executed.
    #[serde(default)]
    pub instructions: u64,
}

/// What the virtual board says of a run's pulses: it compares each with the robot record in flash, the button and the emergency stop.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Judged {
    /// Number of pulses that were judged.
    pub pulses: u64,
    /// Of these, those that ended early together with the servos' supply, for a cause.
    pub cut: u64,
    /// Pins of the servos that were trimmed.
    pub trimmed: Vec<String>,
    /// Number of pulses that no servo may get.
    pub violations: u64,
    /// The first of them, in words.
    pub first: Vec<String>,
}

/// A reset of the chip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reset {
    /// Virtual time, s.
    pub t_s: f64,
    /// `iwdg`, `software` or `pin`.
    pub cause: String,
}

/// A line with the wrong format.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the virtual board wrote `{line}`: {why}")]
pub struct LineError {
    /// The beginning of the line.
    pub line: String,
    /// What is wrong with it.
    pub why: String,
}

/// All fields that a line may have.
///
/// Not an enum that serde tags by `type`: those cannot hold fractions once any crate in the build turns on serde_json's
/// `arbitrary_precision`, which the log decoder does.
#[derive(Deserialize)]
struct Fields {
    r#type: String,
    t_s: Option<f64>,
    elf_sha256: Option<String>,
    cause: Option<String>,
    channel: Option<u8>,
    hex: Option<String>,
    us: Option<[Option<f64>; 4]>,
}

/// Reads a line.
///
/// # Errors
/// It is no JSON object, or lacks a field of its type.
pub fn parse(line: &str) -> Result<BoardLine, LineError> {
    let fail = |why: String| LineError { line: line.chars().take(120).collect(), why };
    let fields: Fields = serde_json::from_str(line).map_err(|error| fail(error.to_string()))?;
    let lacks = |field: &str| fail(format!("a line of type `{}` needs `{field}`", fields.r#type));
    let time = || fields.t_s.ok_or_else(|| lacks("t_s"));
    Ok(match fields.r#type.as_str() {
        "start" => BoardLine::Start { elf_sha256: fields.elf_sha256.clone().ok_or_else(|| lacks("elf_sha256"))? },
        "boot" => BoardLine::Boot { t_s: time()?, cause: fields.cause.clone().ok_or_else(|| lacks("cause"))? },
        "rtt" => {
            let bytes = fields.hex.as_deref().and_then(bytes_of_hex).ok_or_else(|| lacks("hex"))?;
            BoardLine::Rtt { t_s: time()?, channel: fields.channel.ok_or_else(|| lacks("channel"))?, bytes }
        }
        "pulses" => BoardLine::Pulses { t_s: time()?, us: fields.us.ok_or_else(|| lacks("us"))? },
        "status" => BoardLine::Status { t_s: time()? },
        "end" => BoardLine::End(Box::new(serde_json::from_str(line).map_err(|error| fail(error.to_string()))?)),
        kind => BoardLine::Remark { t_s: fields.t_s, kind: kind.into(), text: line.into() },
    })
}

/// Bytes from hexadecimal digits.
pub(crate) fn bytes_of_hex(hex: &str) -> Option<Vec<u8>> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    hex.as_bytes()
        .chunks(2)
        .map(|pair| match pair {
            [high, low] => u8::try_from(digit(*high)? * 16 + digit(*low)?).ok(),
            _ => None,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_type_is_read() {
        let line = |text: &str| parse(text).unwrap();
        assert_eq!(
            line(r#"{"type":"start","elf_sha256":"ab","hclk_hz":16000000,"cpi":1.0}"#),
            BoardLine::Start { elf_sha256: "ab".into() }
        );
        assert_eq!(
            line(r#"{"type":"boot","t_s":0.25,"cause":"iwdg"}"#),
            BoardLine::Boot { t_s: 0.25, cause: "iwdg".into() }
        );
        assert_eq!(
            line(r#"{"type":"rtt","t_s":0.001,"channel":1,"hex":"00fF1a"}"#),
            BoardLine::Rtt { t_s: 0.001, channel: 1, bytes: vec![0, 255, 26] }
        );
        assert_eq!(
            line(r#"{"type":"pulses","t_s":1.5,"us":[1500.0,null,1056.5,2]}"#),
            BoardLine::Pulses { t_s: 1.5, us: [Some(1500.0), None, Some(1056.5), Some(2.0)] }
        );
        assert!(matches!(line(r#"{"type":"status","t_s":0.1,"armed":true}"#), BoardLine::Status { t_s: 0.1 }));
        assert!(
            matches!(line(r#"{"type":"lint","t_s":0.1,"text":"x"}"#), BoardLine::Remark { t_s: Some(0.1), kind, .. } if kind == "lint")
        );
        let end = line(
            r#"{"type":"end","t_s":2.5,"reason":"time","status":null,"unmodelled":0,"lints":[],"resets":[{"t_s":1.5,"cause":"iwdg"}],
            "edges":{"PE9":10},"edges_before_arming":0,"edges_after_disarming":0,"pulse_us":[[1000.5,2000],null,null,[1,2]],
            "judged":{"pulses":4,"cut":1,"trimmed":["PE9"],"violations":1,"first":["a"]},"instructions":5}"#,
        );
        let BoardLine::End(end) = end else { panic!("{end:?}") };
        assert_eq!(
            end.judged,
            Judged { pulses: 4, cut: 1, trimmed: vec!["PE9".into()], violations: 1, first: vec!["a".into()] }
        );
        assert_eq!(
            (end.t_s, end.resets[0].t_s, end.pulse_us[0], end.pulse_us[1]),
            (2.5, 1.5, Some([1000.5, 2000.0]), None)
        );
    }

    #[test]
    fn lines_that_are_not_as_agreed_are_shown() {
        for (text, words) in [
            ("", "EOF"),
            ("thread panicked", "expected"),
            ("{}", "missing field `type`"),
            (r#"{"type":"rtt","t_s":1,"channel":0,"hex":"0"}"#, "needs `hex`"),
            (r#"{"type":"rtt","t_s":1,"channel":0,"hex":"zz"}"#, "needs `hex`"),
            (r#"{"type":"rtt","channel":0,"hex":"00"}"#, "needs `t_s`"),
            (r#"{"type":"rtt","t_s":1,"hex":"00"}"#, "needs `channel`"),
            (r#"{"type":"end","t_s":1}"#, "missing field `reason`"),
            (r#"{"type":"pulses","t_s":1,"us":[1,2]}"#, "invalid length"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
