//! The times of the frames: from their numbers where these agree with the rounded times, else the times themselves.

use crate::fault::Fault;

/// Number and time of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Stamp {
    pub(super) index: Option<f64>,
    pub(super) time_ms: Option<f64>,
}

/// Times that are rounded to milliseconds are at most this far from those of the numbers, milliseconds.
const ROUNDED_MS: f64 = 1.0;

/// Times in seconds. `rate_hz` is the frame rate of the header.
pub(super) fn times_s(stamps: &[Stamp], rate_hz: Option<f64>, notes: &mut Vec<String>) -> Result<Vec<f64>, Fault> {
    let indices: Option<Vec<f64>> = stamps.iter().map(|stamp| stamp.index).collect();
    let times_ms: Option<Vec<f64>> = stamps.iter().map(|stamp| stamp.time_ms).collect();
    let first = |values: &[f64]| values.first().copied().unwrap_or_default();
    let counted = indices.zip(rate_hz);
    match (counted, times_ms) {
        (Some((indices, rate_hz)), Some(times_ms)) => {
            let (start, start_ms) = (first(&indices), first(&times_ms));
            let counted: Vec<f64> = indices.iter().map(|index| start_ms / 1000.0 + (index - start) / rate_hz).collect();
            let apart = counted.iter().zip(&times_ms).map(|(s, ms)| (s * 1000.0 - ms).abs()).fold(0.0, f64::max);
            if apart > ROUNDED_MS {
                notes.push(format!(
                    "`time` differs from the numbers of the frames at {rate_hz} Hz by up to {apart:.1} ms; `time` is read."
                ));
                return Ok(times_ms.iter().map(|ms| ms / 1000.0).collect());
            }
            notes.push(format!(
                "The times are the numbers of the frames at {rate_hz} Hz; `time` agrees with them within {apart:.1} ms."
            ));
            Ok(counted)
        }
        (Some((indices, rate_hz)), None) => {
            notes.push(format!(
                "Not every frame has a `time`; the times are the numbers of the frames at {rate_hz} Hz."
            ));
            Ok(indices.iter().map(|index| index / rate_hz).collect())
        }
        (None, Some(times_ms)) => Ok(times_ms.iter().map(|ms| ms / 1000.0).collect()),
        (None, None) => {
            let allowed = "`time` in ms in every frame, or `index` in every frame and `frameRate` of the subject";
            Err(Fault::HeaderField {
                field: "the time of the frames".into(),
                found: "missing".into(),
                allowed: allowed.into(),
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(rate_hz: Option<f64>, of: impl Fn(usize) -> Stamp) -> (Vec<f64>, Vec<String>) {
        let mut notes = Vec::new();
        let stamps: Vec<Stamp> = (0..240).map(of).collect();
        (times_s(&stamps, rate_hz, &mut notes).unwrap(), notes)
    }

    #[test]
    fn numbers_give_the_times_that_are_rounded() {
        let whole = |n: usize| (n as f64 * 1000.0 / 240.0).floor();
        let (found, notes) =
            times(Some(240.0), |n| Stamp { index: Some(n as f64 + 5.0), time_ms: Some(whole(n) + 20.0) });
        assert!(found.iter().enumerate().all(|(n, s)| (s - 0.02 - n as f64 / 240.0).abs() < 1e-12));
        assert!(notes[0].contains("agrees with them within 0.8 ms"), "{notes:?}");
        // At another rate than the header's the numbers are not used.
        let (found, notes) = times(Some(60.0), |n| Stamp { index: Some(n as f64), time_ms: Some(whole(n)) });
        assert_eq!((found[239], notes.len()), (0.995, 1));
        assert!(notes[0].contains("`time` is read"), "{notes:?}");
    }

    #[test]
    fn either_is_enough() {
        let (found, notes) = times(Some(100.0), |n| Stamp { index: Some(n as f64), time_ms: None });
        assert!(found[150] == 1.5 && notes[0].contains("Not every frame has a `time`"));
        let (found, notes) = times(None, |n| Stamp { index: Some(n as f64), time_ms: Some(n as f64 * 10.0) });
        assert!(found[150] == 1.5 && notes.is_empty());
        let none = times_s(&[Stamp::default(); 3], Some(100.0), &mut Vec::new()).unwrap_err().to_string();
        assert!(none.contains("`the time of the frames` is missing; allowed is `time` in ms in every frame"), "{none}");
    }
}
