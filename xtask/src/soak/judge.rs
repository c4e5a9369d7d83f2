//! The order of the pulses at the servo pins: four in each frame, no frame missing; and a hash over all of them. Their widths and rates, the virtual
//! board judges itself.

use anyhow::{Context, Result};
use serde_json::Value;
use sha2::{Digest, Sha256};

/// A frame of pulses is begun every 20 ms; a longer distance is a frame that is missing.
const FRAME_S: f64 = 0.02;
/// Of the times in the lines, s.
const RESOLUTION_S: f64 = 2e-6;

/// The pulses so far.
#[derive(Debug, Default)]
pub(crate) struct Judge {
    last_s: Option<f64>,
    hash: Sha256,
    /// Frames of four pulses.
    pub(crate) frames: u64,
    /// Frames without all pulses, and frames that are missing.
    pub(crate) violations: u64,
    /// The first of them, in words.
    pub(crate) first: Option<String>,
}

impl Judge {
    /// Takes a line of the type `pulses`.
    pub(crate) fn take(&mut self, line: &str) -> Result<()> {
        self.hash.update(line.as_bytes());
        self.frames += 1;
        let value: Value = serde_json::from_str(line).with_context(|| format!("`{line}` is no JSON"))?;
        let t_s = value["t_s"].as_f64().context("pulses without a time")?;
        let widths: [Option<f64>; 4] =
            serde_json::from_value(value["us"].clone()).context("pulses without four widths")?;
        if let Some(servo) = widths.iter().position(Option::is_none) {
            self.violation(format!("{t_s} s: servo {servo} has no pulse"));
        }
        if let Some(before_s) = self.last_s.replace(t_s)
            && (t_s - before_s - FRAME_S).abs() > RESOLUTION_S
        {
            self.violation(format!(
                "{t_s} s: the frame before began {} s before, allowed is {FRAME_S} s",
                t_s - before_s
            ));
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

    fn judged(lines: &[&str]) -> Judge {
        let mut judge = Judge::default();
        lines.iter().for_each(|line| judge.take(line).unwrap());
        judge
    }

    fn pulses(t_s: f64, us: &str) -> String {
        format!(r#"{{"type":"pulses","t_s":{t_s},"us":[{us}],"rail":true}}"#)
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
            (pulses(0.54, "1500,1500,1056,1944"), "the frame before began"),
            (pulses(0.51, "1500,1500,1056,1944"), "the frame before began"),
            (pulses(0.52, "1500,null,1056,1944"), "servo 1 has no pulse"),
        ] {
            let judge = judged(&[&good, &after]);
            assert!(judge.first.as_ref().is_some_and(|first| first.contains(words)), "{after}: {judge:?}");
        }
    }
}
