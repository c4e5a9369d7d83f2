//! The straight line of least squares through points.

/// Offset and slope of the line `y = offset + slope x` of least squares.
///
/// The slope is not a number where all `x` are equal.
#[must_use]
pub fn line_fit(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (x0, y0) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let (xx, xy) =
        points.iter().fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - x0) * (x - x0), xy + (x - x0) * (y - y0)));
    let slope = xy / xx;
    (y0 - slope * x0, slope)
}
