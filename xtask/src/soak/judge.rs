//! Judges the pulses at the servo pins, whatever the firmware says of them: widths, rates, the distance of the frames; and a hash over all of them.

use anyhow::{Context, Result};
use serde_json::Value;
use sha2::{Digest, Sha256};

const SERVOS: usize = 4;
/// A frame of pulses is begun every 20 ms; a longer distance is a frame that is missing.
const FRAME_S: f64 = 0.02;
/// Of the times in the lines, s.
const RESOLUTION_S: f64 = 2e-6;
/// A width is a whole number of microseconds.
const RESOLUTION_US: f64 = 1.0;

/// The limits of the default robot, as pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    least_us: [f64; SERVOS],
    most_us: [f64; SERVOS],
    us_per_s: [f64; SERVOS],
}

impl Limits {
    /// Those of the campaign of faults, which a test compares with the robot.
    pub(crate) fn of_campaign(text: &str) -> Result<Self> {
        let list = |key: &str| -> Result<[f64; SERVOS]> {
            let line = text.lines().find_map(|line| line.strip_prefix(key)?.trim_start().strip_prefix('='));
            let line = line.with_context(|| format!("the campaign of faults has no limits `{key}`"))?;
            serde_json::from_str(line).with_context(|| format!("`{key}` is no list of {SERVOS} numbers"))
        };
        Ok(Self { least_us: list("least_us")?, most_us: list("most_us")?, us_per_s: list("us_per_s")? })
    }
}

/// The pulses so far.
#[derive(Debug)]
pub(crate) struct Judge {
    limits: Limits,
    last: Option<(f64, [f64; SERVOS])>,
    hash: Sha256,
    /// Frames of four pulses.
    pub(crate) frames: u64,
    /// Pulses outside the range or faster than the rate, frames without all pulses, and frames that are missing.
    pub(crate) violations: u64,
    /// The first of them, in words.
    pub(crate) first: Option<String>,
}

impl Judge {
    pub(crate) fn new(limits: Limits) -> Self {
        Self { limits, last: None, hash: Sha256::new(), frames: 0, violations: 0, first: None }
    }

    /// Takes a line of the type `pulses`.
    pub(crate) fn take(&mut self, line: &str) -> Result<()> {
        self.hash.update(line.as_bytes());
        self.frames += 1;
        let value: Value = serde_json::from_str(line).with_context(|| format!("`{line}` is no JSON"))?;
        let t_s = value["t_s"].as_f64().context("pulses without a time")?;
        let widths: [Option<f64>; SERVOS] =
            serde_json::from_value(value["us"].clone()).context("pulses without four widths")?;
        let mut us = [0.0; SERVOS];
        for (servo, (width, place)) in widths.iter().zip(&mut us).enumerate() {
            match width {
                Some(width) => *place = *width,
                None => return Ok(self.violation(format!("{t_s} s: servo {servo} has no pulse"))),
            }
        }
        for servo in 0..SERVOS {
            let (least, most) =
                (self.limits.least_us[servo] - RESOLUTION_US, self.limits.most_us[servo] + RESOLUTION_US);
            if !(least..=most).contains(&us[servo]) {
                self.violation(format!(
                    "{t_s} s: servo {servo} gets {} us, allowed are {least} to {most} us",
                    us[servo]
                ));
            }
        }
        if let Some((before_s, before)) = self.last.replace((t_s, us)) {
            let passed = t_s - before_s;
            if (passed - FRAME_S).abs() > RESOLUTION_S {
                self.violation(format!("{t_s} s: the frame before began {passed} s before, allowed is {FRAME_S} s"));
            }
            for servo in 0..SERVOS {
                let most = self.limits.us_per_s[servo] * passed + RESOLUTION_US;
                let moved = (us[servo] - before[servo]).abs();
                if moved > most {
                    self.violation(format!("{t_s} s: servo {servo} moves by {moved} us, allowed are {most:.1} us"));
                }
            }
        }
        Ok(())
    }

    fn violation(&mut self, words: String) {
        self.violations += 1;
        self.first.get_or_insert(words);
    }

    /// The hash over all lines, hexadecimal, its first half.
    pub(crate) fn hash(&self) -> String {
        self.hash.clone().finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: &str = "[limits]\nleast_us = [1000, 1000, 900.5, 600]\nmost_us = [2000, 2000, 2000, 2000]\nus_per_s = [5000, 5000, 5000, 5000]\n";

    fn judged(lines: &[&str]) -> Judge {
        let mut judge = Judge::new(Limits::of_campaign(LIMITS).unwrap());
        lines.iter().for_each(|line| judge.take(line).unwrap());
        judge
    }

    fn pulses(t_s: f64, us: &str) -> String {
        format!(r#"{{"type":"pulses","t_s":{t_s},"us":[{us}],"rail":true}}"#)
    }

    #[test]
    fn the_limits_are_those_of_the_campaign() {
        let limits = Limits::of_campaign(LIMITS).unwrap();
        assert_eq!((limits.least_us, limits.us_per_s), ([1000.0, 1000.0, 900.5, 600.0], [5000.0; 4]));
        let campaign = std::fs::read_to_string(std::path::Path::new("..").join(crate::campaign::FAULTS)).unwrap();
        assert!(Limits::of_campaign(&campaign).is_ok());
        for (broken, words) in [("most_us = 3", "no list of 4"), ("", "no limits `least_us`")] {
            let text = if broken.is_empty() {
                String::new()
            } else {
                LIMITS.replace("most_us = [2000, 2000, 2000, 2000]", broken)
            };
            assert!(Limits::of_campaign(&text).unwrap_err().to_string().contains(words), "{text}");
        }
    }

    #[test]
    fn good_pulses_have_no_violation_and_a_hash_of_their_own() {
        let [a, b, c] = [
            pulses(0.5, "1500,1500,1056,1944"),
            pulses(0.52, "1510,1500,1056,1944"),
            pulses(0.52, "1511,1500,1056,1944"),
        ];
        let (first, second) = (judged(&[&a, &b]), judged(&[&a, &c]));
        assert_eq!((first.violations, first.frames, second.violations), (0, 2, 0));
        assert_eq!(first.hash(), judged(&[&a, &b]).hash());
        assert_ne!(first.hash(), second.hash());
    }

    #[test]
    fn every_violation_is_found() {
        let good = pulses(0.5, "1500,1500,1056,1944");
        for (after, words) in [
            (pulses(0.52, "1500,1500,1056,2002"), "servo 3 gets 2002 us"),
            (pulses(0.52, "1500,1500,899,1944"), "servo 2 gets 899 us"),
            (pulses(0.52, "1602,1500,1056,1944"), "servo 0 moves by 102 us"),
            (pulses(0.54, "1500,1500,1056,1944"), "the frame before began"),
            (pulses(0.51, "1500,1500,1056,1944"), "the frame before began"),
            (pulses(0.52, "1500,null,1056,1944"), "servo 1 has no pulse"),
        ] {
            let judge = judged(&[&good, &after]);
            assert!(
                judge.violations >= 1 && judge.first.as_ref().is_some_and(|first| first.contains(words)),
                "{after}: {judge:?}"
            );
        }
    }
}
