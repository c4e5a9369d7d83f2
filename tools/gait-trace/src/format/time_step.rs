//! Whether the steps of a time column can be those of a gait in seconds, and whether the times agree with a rate that the caller gives.

use crate::fault::Fault;
use crate::format::text_table::short;

/// From this median step on, seconds, times are not those of a gait: two rows a stride of 1 s.
pub(crate) const MAX_STEP_S: f64 = 0.5;
/// Times whose unit nothing states are not read as seconds below this step: angles are not recorded at more than 2.5 kHz, but the rows of 60 Hz are
/// 0.28 thousandths of a minute apart.
pub(crate) const MIN_UNSAID_STEP_S: f64 = 4e-4;
/// Shortest step of a recorder of gait, seconds.
const MIN_STEP_S: f64 = 1e-4;

/// What times with such a step, which are read as seconds, probably are, and a heading that says so.
pub(crate) fn likely_unit(step: f64) -> (&'static str, &'static str) {
    let fits = |factor: f64| (MIN_STEP_S..MAX_STEP_S).contains(&(step * factor));
    if step == 1.0 {
        ("milliseconds, or numbers of frames", "`time_ms`, or `frame` with `--rate HZ`")
    } else if fits(1e-3) {
        ("milliseconds", "`time_ms`")
    } else if fits(1e-6) {
        ("microseconds", "`time_us`")
    } else if fits(1e-9) {
        ("nanoseconds", "`time_ns`")
    } else {
        ("another unit", "`time_ms`")
    }
}

/// Replaces times by those of rows at a rate, if they agree with it: within the step to which they are rounded, and within half a row, so
/// that no row is missing.
pub(crate) fn at_rate(time_s: &mut [f64], rate_hz: f64, column: &str, notes: &mut Vec<String>) -> Result<(), Fault> {
    let (Some(&first), Some(&last)) = (time_s.first(), time_s.last()) else { return Ok(()) };
    let off = |(row, time): (usize, &f64)| time - first - row as f64 / rate_hz;
    let (least, most) =
        time_s.iter().enumerate().map(off).fold((0.0_f64, 0.0_f64), |(a, b), off| (a.min(off), b.max(off)));
    let (apart_s, resolution_s) = (most - least, resolution_s(time_s));
    let allowed_s = resolution_s.max(0.5 / rate_hz);
    let (rows, span_s) = (time_s.len(), last - first);
    if apart_s > allowed_s * 1.001 {
        let found_hz = (rows - 1) as f64 / span_s;
        let column = short(column);
        return Err(Fault::RateDisagrees { rate_hz, column, apart_s, rows, span_s, found_hz, allowed_s });
    }
    // The grid in the middle of the deviations.
    let start = first + 0.5 * (least + most);
    time_s.iter_mut().enumerate().for_each(|(row, time)| *time = start + row as f64 / rate_hz);
    notes.push(format!(
        "The times are the numbers of the rows at {rate_hz} Hz, as requested; `{}` agrees with them within {:.1} ms.",
        short(column),
        apart_s * 1e3
    ));
    Ok(())
}

/// The step to which times are rounded: the largest of which all differences are multiples, in whole microseconds.
fn resolution_s(time_s: &[f64]) -> f64 {
    let first = time_s.first().copied().unwrap_or_default();
    let common = time_s.iter().map(|time| ((time - first).abs() * 1e6).round() as u64).fold(0, |mut a, mut b| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    });
    common as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(times: impl Iterator<Item = f64>, rate_hz: f64) -> Result<(Vec<f64>, String), String> {
        let (mut times, mut notes) = (times.collect::<Vec<_>>(), Vec::new());
        at_rate(&mut times, rate_hz, "time_s", &mut notes).map_err(|fault| fault.to_string())?;
        Ok((times, notes.remove(0)))
    }

    fn rounded(rows: u32, rate_hz: f64, step_s: f64) -> impl Iterator<Item = f64> {
        (0..rows).map(move |row| (f64::from(row) / rate_hz / step_s).floor() * step_s)
    }

    /// The times of the rows come back within the step to which the stamps are rounded.
    #[test]
    fn rounded_times_agree_with_their_rate() {
        for (rate_hz, step_s) in [(200.0, 0.01), (240.0, 0.01), (128.0, 0.01), (60.0, 0.001), (1000.0, 0.02)] {
            let (times, note) = read(rounded(2000, rate_hz, step_s), rate_hz).unwrap();
            for (row, time) in times.iter().enumerate() {
                assert!((time - row as f64 / rate_hz).abs() <= step_s, "{rate_hz} {row}: {time}");
            }
            assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 1.0 / rate_hz).abs() < 1e-9));
            assert!(note.contains("as requested; `time_s` agrees"), "{note}");
        }
    }

    #[test]
    fn another_rate_or_missing_rows_are_an_error() {
        let error = read(rounded(2000, 200.0, 0.01), 190.0).unwrap_err();
        assert!(error.contains("`--rate 190`") && error.contains("2000 rows in 9.99 s are 200.100 Hz"), "{error}");
        assert!(read(rounded(2000, 200.0, 0.01), 199.5).is_err());
        let missing = rounded(2000, 200.0, 0.01).enumerate().filter(|(row, _)| !(500..504).contains(row));
        assert!(read(missing.map(|(_, time)| time), 200.0).is_err());
    }

    #[test]
    fn the_likely_unit_follows_from_the_step() {
        assert_eq!(likely_unit(10.0).0, "milliseconds");
        assert_eq!(likely_unit(5000.0).0, "microseconds");
        assert_eq!(likely_unit(5e6).0, "nanoseconds");
        assert!(likely_unit(1.0).0.contains("numbers of frames"));
    }
}
