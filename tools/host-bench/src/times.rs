//! Times of several runs.

use std::time::Instant;

/// The middle of several numbers; NaN of none.
pub(crate) fn median(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let mut numbers: Vec<f64> = numbers.into_iter().collect();
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Seconds that some work takes.
pub(crate) fn time<R>(work: impl FnOnce() -> R) -> f64 {
    let start = Instant::now();
    std::hint::black_box(work());
    start.elapsed().as_secs_f64()
}

/// A number with four digits that count, for the result.
pub(crate) fn rounded(number: f64) -> f64 {
    format!("{number:.3e}").parse().unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_one() {
        assert_eq!(median([3.0, 1.0, 100.0, 2.0, 0.5]), 2.0);
        assert!(median([]).is_nan());
        assert_eq!((rounded(1234.567), rounded(0.000_123_456)), (1235.0, 0.000_123_5));
    }
}
