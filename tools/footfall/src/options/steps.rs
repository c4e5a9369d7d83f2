//! Options that `obb` and `hexapod` share: changes at given steps.

use crate::failure::Failure;

/// Parses changes such as `54:3 100:1`: a step, and the new value from this step on; the steps must rise, and be before the end of a run of
/// `steps`.
///
/// # Errors
/// Names the entry that is wrong and what is allowed.
pub fn switches<T>(
    text: &str,
    value: impl Fn(&str) -> Option<T>,
    allowed: &str,
    steps: u64,
) -> Result<Vec<(u64, T)>, Failure> {
    let mut all: Vec<(u64, T)> = vec![];
    for entry in text.split_whitespace() {
        let parsed = entry.split_once(':').and_then(|(step, to)| Some((step.parse().ok()?, value(to)?)));
        let Some((step, to)) = parsed else {
            return Err(Failure::input(format!(
                "--switch `{entry}`: allowed is STEP:{allowed}, as in the examples of --help"
            )));
        };
        if all.last().is_some_and(|(before, _)| *before >= step) {
            return Err(Failure::input(format!(
                "--switch `{entry}`: allowed is a later step than in the entry before"
            )));
        }
        if step >= steps {
            let last = steps.saturating_sub(1);
            return Err(Failure::input(format!(
                "--switch at step {step}, --steps {steps}: allowed are changes at step {last} or before, or more steps"
            )));
        }
        all.push((step, to));
    }
    Ok(all)
}
