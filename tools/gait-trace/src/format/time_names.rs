//! Recognises a column of times or of frames by its name.

use crate::format::stated::words;
use crate::format::unit::seconds_of;
use crate::format::words::TIMES;

/// Longest name that is examined for the part of a cycle, bytes.
const MAX_NAME: usize = 64;

/// The power of ten of the time's unit if a column's name denotes a time (`time_ms`: -3); `Some(None)` for a time without unit.
#[must_use]
pub(crate) fn time_of(name: &str) -> Option<Option<i32>> {
    if is_share(name) {
        return Some(None);
    }
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    // `in s` is what some oscilloscopes write. A single letter `s` is too short to be a time.
    if let Some(power) = seconds_of(plain.strip_prefix("in").unwrap_or(&plain)).filter(|_| plain.len() > 2) {
        return Some(Some(power));
    }
    let rest = TIMES.iter().find_map(|word| plain.strip_prefix(word))?;
    if rest.is_empty() { Some(None) } else { seconds_of(rest).map(Some) }
}

/// Whether a column's name denotes the part of a gait cycle: `pct`, `gait_cycle_percent`, `% stride`, `cycle_fraction`, `Gait cycle [%]`.
#[must_use]
pub(crate) fn is_share(name: &str) -> bool {
    const SHARE: [&str; 9] = ["percent", "percentage", "pct", "perc", "prct", "%", "fraction", "prozent", "normalized"];
    const CYCLE: [&str; 8] = ["cycle", "gaitcycle", "gc", "gangzyklus", "cyclus", "ciclo", "cycles", "normalised"];
    const BESIDE: [&str; 12] =
        ["gait", "stride", "of", "the", "time", "phase", "in", "norm", "walking", "running", "t", "x"];
    // A text of any length is no heading.
    if name.len() > MAX_NAME {
        return false;
    }
    // `Cycle%` is two words.
    let words: Vec<String> = words(&name.replace('%', " % "));
    // A header of MATLAB is a comment: `% time`.
    if matches!(words.as_slice(), [first, time] if first == "%" && TIMES.contains(&time.as_str())) {
        return false;
    }
    let is = |list: &[&str], word: &String| list.contains(&word.as_str());
    words.iter().any(|word| is(&SHARE, word) || is(&CYCLE, word))
        && words.iter().all(|word| is(&SHARE, word) || is(&CYCLE, word) || is(&BESIDE, word))
}

/// As [`time_of`], for a stamp of a clock or the time since a beginning: `timestamp_us`, `elapsed_ms`.
#[must_use]
pub(crate) fn stamp_of(name: &str) -> Option<Option<i32>> {
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    let rest = ["timestamp", "elapsedtime", "elapsed"].iter().find_map(|word| plain.strip_prefix(word))?;
    if rest.is_empty() { Some(None) } else { seconds_of(rest).map(Some) }
}

/// Units of time that are not read, in lower case.
const OTHER_UNITS: [&str; 23] = [
    "min", "mins", "minute", "minutes", "minuten", "minuti", "minutos", "h", "hr", "hrs", "hour", "hours", "std",
    "stunden", "uur", "heures", "horas", "ore", "day", "days", "tage", "cs", "ds",
];

/// The unit that a heading has at its end, if it is one of time that is not read: `Time (min)`, `t/h`, `clock (0.1 s)`.
#[must_use]
pub(crate) fn other_unit_of_time(heading: &str) -> Option<String> {
    let bare = heading.trim_end_matches([']', ')', '}', ' ', '.']);
    let end = bare.rsplit(['_', '[', '(', '{', ' ', '/', ',']).next()?;
    if OTHER_UNITS.contains(&end.to_lowercase().as_str()) {
        return Some(end.into());
    }
    // A number of units: the times count tenths of a second.
    let (_, inside) = bare.rsplit_once(['[', '(', '{']).filter(|_| bare.len() < heading.trim_end().len())?;
    let is_multiple = inside.starts_with(|c: char| c.is_ascii_digit()) && seconds_of(end).is_some() && end != inside;
    is_multiple.then(|| inside.trim().into())
}

/// Whether a column's name is about time or a date, whatever is in it.
#[must_use]
pub(crate) fn is_time_like(name: &str) -> bool {
    let plain = name.to_lowercase();
    time_of(name).is_some()
        || TIMES
            .iter()
            .filter(|word| word.len() > 1)
            .chain(&["date", "clock", "utc", "stamp", "elapsed"])
            .any(|word| plain.contains(word))
}

/// Whether a column's name denotes a number of frames or samples.
#[must_use]
pub(crate) fn is_frame(name: &str) -> bool {
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    let counted = ["", "s", "no", "nr", "num", "number", "index", "id"];
    ["frame", "sample"].iter().any(|word| plain.strip_prefix(word).is_some_and(|rest| counted.contains(&rest)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_frames_are_recognised_by_name() {
        for (name, unit) in [
            ("time", Some(None)),
            ("t", Some(None)),
            ("Time (s)", Some(Some(0))),
            ("time_ms", Some(Some(-3))),
            ("Time [µs]", Some(Some(-6))),
            ("time_ns", Some(Some(-9))),
            ("T [s]", Some(Some(0))),
            ("Times", Some(Some(0))),
            ("sec", Some(Some(0))),
            ("in s", Some(Some(0))),
            ("s", None),
            ("ms", None),
            ("Zeit [s]", Some(Some(0))),
            ("tiempo (ms)", Some(Some(-3))),
            ("Temps", Some(None)),
            ("tempo", Some(None)),
            ("temp", None),
            ("temperature", None),
            ("torque", None),
            ("trunk", None),
        ] {
            assert_eq!(time_of(name), unit, "{name}");
        }
        for name in [
            "pct",
            "percent",
            "gait_cycle_percent",
            "gait_cycle_%",
            "% gait cycle",
            "Gait Cycle [%]",
            "%",
            "pct_gait_cycle",
            "GaitCyclePercent",
            "percent_stride",
            "stride %",
            "cycle_fraction",
            "cycle",
            "Cycle%",
            "normalized_time",
        ] {
            assert!(is_share(name) && time_of(name) == Some(None), "{name}");
        }
        for name in
            ["stride", "gait", "knee %", "percent_grade", "duty cycle", "% time", "cycle_no", "time", "phase", "x", ""]
        {
            assert!(!is_share(name), "{name}");
        }
        for (name, unit) in [
            ("timestamp", Some(None)),
            ("timestamp_ms", Some(Some(-3))),
            ("Timestamp [us]", Some(Some(-6))),
            ("timestamp_ns", Some(Some(-9))),
            ("elapsed", Some(None)),
            ("elapsed_ms", Some(Some(-3))),
            ("elapsed time (s)", Some(Some(0))),
            ("timestamp_utc", None),
            ("time", None),
        ] {
            assert_eq!(stamp_of(name), unit, "{name}");
        }
        for (name, unit) in [
            ("Time (min)", Some("min")),
            ("t/h", Some("h")),
            ("time_cs", Some("cs")),
            ("Zeit (0.1 s)", Some("0.1 s")),
            ("clock [1/100 s]", Some("1/100 s")),
            ("Minuten", Some("Minuten")),
            ("Time (s)", None),
            ("Uhr in ms", None),
            ("Time [s]", None),
            ("clock 2 s", None),
            ("path", None),
        ] {
            assert_eq!(other_unit_of_time(name).as_deref(), unit, "{name}");
        }
        assert!(["Frame", "frame #", "Sample No."].into_iter().all(is_frame));
        assert!(["framework", "time", "sampled", "sample_rate"].into_iter().all(|name| !is_frame(name)));
    }
}
