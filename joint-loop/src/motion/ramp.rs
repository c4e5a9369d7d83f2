//! The minimum-jerk profile of every ramp: s(x) = 10 x^3 - 15 x^4 + 6 x^5 (Flash and Hogan, J. Neurosci. 5 (1985) 1688).

/// Elapsed fraction of a ramp: 0 before it, 1 after it.
pub(crate) fn fraction(ticks: Option<u32>, duration: u32) -> f32 {
    match ticks {
        None => 0.0,
        Some(ticks) if ticks >= duration => 1.0,
        Some(ticks) => ticks as f32 / duration as f32,
    }
}

/// s(x) by Horner's rule, at most 1: rounding gives slightly more near the end.
pub(crate) fn minimum_jerk(x: f32) -> f32 {
    (x * x * x * (10.0 + x * (6.0 * x - 15.0))).min(1.0)
}
