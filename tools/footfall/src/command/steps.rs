//! Options that `obb` and `hexapod` share: changes at steps, and the duration of a step.

use crate::failure::Failure;

/// Changes at steps, as `54:3 100:1`: step and what it changes to, in order.
///
/// # Errors
/// Says which entry is wrong and what is allowed.
pub(crate) fn switches<T>(
    text: &str,
    value: impl Fn(&str) -> Option<T>,
    allowed: &str,
) -> Result<Vec<(u64, T)>, Failure> {
    let mut all: Vec<(u64, T)> = vec![];
    for entry in text.split_whitespace() {
        let parsed = entry.split_once(':').and_then(|(step, to)| Some((step.parse().ok()?, value(to)?)));
        let Some((step, to)) = parsed else {
            return Err(Failure::input(format!(
                "--switch `{entry}`: allowed is STEP:{allowed}, such as those in --help"
            )));
        };
        if all.last().is_some_and(|(before, _)| *before >= step) {
            return Err(Failure::input(format!("--switch `{entry}`: allowed is a later step than the entry before")));
        }
        all.push((step, to));
    }
    Ok(all)
}

/// Seconds of a step of edge reversal.
pub(crate) fn step_seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.05..=60.0).contains(&seconds) => Ok(seconds),
        _ => Err("allowed is a number of seconds from 0.05 to 60".into()),
    }
}
