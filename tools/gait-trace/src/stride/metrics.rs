//! Root mean square and peak of the difference of two series, in the unit of the series.

/// Root mean square of the difference; `None` if the lengths differ or are 0.
///
/// ```
/// use gait_trace::stride::metrics::{peak, rmse};
/// let (a, b) = ([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, 2.0]);
/// assert_eq!(rmse(&a, &b), Some(1.0));
/// assert_eq!(peak(&a, &b), Some(2.0));
/// assert_eq!(rmse(&a, &b[1..]), None);
/// ```
#[must_use]
pub fn rmse(a: &[f64], b: &[f64]) -> Option<f64> {
    let sum: f64 = differences(a, b)?.map(|d| d * d).sum();
    Some((sum / a.len() as f64).sqrt())
}

/// Largest absolute difference; `None` as for [`rmse`]. NaN in either series gives NaN.
#[must_use]
pub fn peak(a: &[f64], b: &[f64]) -> Option<f64> {
    Some(differences(a, b)?.map(f64::abs).fold(0.0, |most, d| if d.is_nan() || d > most { d } else { most }))
}

fn differences<'a>(a: &'a [f64], b: &'a [f64]) -> Option<impl Iterator<Item = f64> + 'a> {
    (a.len() == b.len() && !a.is_empty()).then(|| a.iter().zip(b).map(|(a, b)| a - b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_of_different_length_have_no_difference() {
        assert_eq!(rmse(&[], &[]), None);
        assert_eq!(peak(&[1.0], &[]), None);
        assert!(peak(&[f64::NAN, 3.0], &[0.0, 0.0]).is_some_and(f64::is_nan));
    }
}
