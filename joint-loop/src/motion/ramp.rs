//! The minimum-jerk profile of every ramp: s(x) = 10 x^3 - 15 x^4 + 6 x^5 (Flash and Hogan, J. Neurosci. 5 (1985) 1688).

/// s of the elapsed part of a ramp: 0 before it, 1 after it, where it is not computed.
pub(crate) fn ramp(ticks: Option<u32>, duration: u32) -> f32 {
    match ticks {
        None => 0.0,
        Some(ticks) if ticks >= duration => 1.0,
        Some(ticks) => minimum_jerk(ticks as f32 / duration as f32),
    }
}

/// s(x) by Horner's rule, at most 1: rounding gives slightly more near the end.
pub(crate) fn minimum_jerk(x: f32) -> f32 {
    let s = x * x * x * (10.0 + x * (6.0 * x - 15.0));
    if s < 1.0 { s } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_computed_is_what_would_be() {
        assert_eq!([0.0, 1.0].map(|x| minimum_jerk(x).to_bits()), [0.0_f32, 1.0].map(f32::to_bits));
        for (ticks, s) in
            [(None, 0.0), (Some(0), 0.0), (Some(6), minimum_jerk(6.0 / 7.0)), (Some(7), 1.0), (Some(8), 1.0)]
        {
            assert_eq!(ramp(ticks, 7).to_bits(), s.to_bits(), "{ticks:?}");
        }
    }
}
