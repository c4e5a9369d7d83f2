//! The rows of a certificate's table about the orbit, and whether the generator comes back to it.

use generator_file::certificate::{KICK_PHASES, RETURN_STRIDES, START_STRIDES};
use generator_file::returns::Return;

/// Name and content of each row.
pub(super) fn return_rows(returns: &Return) -> Vec<(&'static str, String)> {
    let motion = match (returns.quasi_periodic, returns.oscillates) {
        (true, _) => "quasi-periodic: steady, but the phases of the joints drift".into(),
        (false, true) => format!("periodic, {:.6} s", returns.period_s),
        (false, false) => "no steady oscillation".into(),
    };
    let mut rows = vec![("motion", motion)];
    if !returns.multipliers.is_empty() {
        let sizes: Vec<String> = returns.multipliers.iter().map(|m| format!("{m:.4}")).collect();
        rows.push(("Floquet multipliers", sizes.join(" ")));
    }
    if returns.kicks > 0 {
        rows.extend([
            (
                "kicks",
                format!(
                    "{} of {} come back to a tenth within {RETURN_STRIDES} strides, at {KICK_PHASES} phases",
                    returns.kicks - returns.kicks_lost.len() as u32,
                    returns.kicks
                ),
            ),
            (
                "settling after a kick",
                returns.settling_s.map_or("a kick is lost".into(), |s| format!("{s:.2} s, the worst of all kicks")),
            ),
            (
                "random starts",
                format!(
                    "{} of {} on the orbit within {START_STRIDES} strides, {} end at a bound",
                    returns.converged, returns.starts, returns.diverged
                ),
            ),
        ]);
    } else if !returns.multipliers.is_empty() {
        rows.push(("kicks", "none: a multiplier is too large".into()));
    } else if returns.oscillates && !returns.quasi_periodic {
        rows.push(("return", "its only state is a phase: every state is on the orbit".into()));
    }
    rows
}

/// The row of a table; the error that follows it has the reason of a refusal.
pub(super) const fn accepted(refused_because: Option<&String>) -> &'static str {
    if refused_because.is_some() { "no" } else { "yes" }
}
