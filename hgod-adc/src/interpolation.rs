//! Interpolation between two calibration points: a straight line, or a cubic that cannot overshoot.
//!
//! The cubic is the Hermite one of F. N. Fritsch and R. E. Carlson, "Monotone Piecewise Cubic Interpolation", SIAM J. Numer.
//! Anal. 17(2), 1980. With secants d_i = (a_i+1 - a_i) / h_i, h_i = v_i+1 - v_i:
//! 1. slopes m_i start from the three-point difference formula (exact for a parabola);
//! 2. in each interval alpha = m_i / d_i, beta = m_i+1 / d_i; where alpha^2 + beta^2 > 9, both are scaled by
//!    3 / sqrt(alpha^2 + beta^2), onto the circle inside their region of monotonicity.
//!
//! Interpolants are evaluated in t = (v - v_i) / h_i and kept between the interval's two angles, so that rounding cannot
//! leave the table. Rounding can turn a cubic back between neighbouring voltages, by less than 0.0001 degrees; a line
//! never. Units: volts, radians, radians a volt.

use crate::point::{CalibrationPoint, MAX_POINTS};
use core::cell::Cell;
use joint_units::order::between;

/// The angle between two calibration points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Interpolation {
    /// A straight line: least assumption, and the default. Its error grows with the square of the spacing.
    #[default]
    Linear,
    /// The monotone cubic of Fritsch and Carlson: a continuous slope, far closer to a smooth sensor.
    MonotoneCubic,
}

/// Greatest sqrt(alpha^2 + beta^2) of an interval.
const RADIUS: f32 = 3.0;

/// Halvings of t when a cubic is inverted: beyond the 24 bits of an `f32`, so the last ones change nothing.
const HALVINGS: u32 = 32;

/// One interval of the table, with the slopes at its ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Interval {
    pub(crate) left: CalibrationPoint,
    pub(crate) right: CalibrationPoint,
    /// Slopes at both ends in radians a volt; `None` for a straight line.
    pub(crate) slopes: Option<(f32, f32)>,
}

impl Interval {
    /// The angle at volts inside the interval.
    pub(crate) fn angle(&self, volts: f32) -> f32 {
        let (left, right) = (self.left.volts.0, self.right.volts.0);
        self.at((volts - left) / (right - left))
    }

    /// The volts at an angle inside the interval.
    pub(crate) fn volts(&self, angle: f32) -> f32 {
        let (from, to) = (self.left.angle.0, self.right.angle.0);
        let t = match self.slopes {
            None => (angle - from) / (to - from),
            Some(_) => {
                let rising = to > from;
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    let reached = self.at(middle);
                    let short = if rising { reached < angle } else { reached > angle };
                    if short { low = middle } else { high = middle }
                }
                high
            }
        };
        let (left, right) = (self.left.volts.0, self.right.volts.0);
        (left + t * (right - left)).max(left).min(right)
    }

    /// The angle at the fraction t of the interval.
    fn at(&self, t: f32) -> f32 {
        let (from, to) = (self.left.angle.0, self.right.angle.0);
        let delta = to - from;
        let change = match self.slopes {
            None => t * delta,
            Some((left, right)) => {
                let h = self.right.volts.0 - self.left.volts.0;
                // The line and what the slopes add to it: no large terms that cancel, as the powers of t would have.
                let rest = 1.0 - t;
                let bend = rest * (h * left - delta) - t * (h * right - delta);
                t * (delta + rest * bend)
            }
        };
        between(from + change, from, to)
    }
}

/// The slope at every point, for a table that has been checked: volts rise, angles are strictly monotone.
pub(crate) fn slopes(points: &[CalibrationPoint]) -> [f32; MAX_POINTS] {
    let mut slopes = [0.0; MAX_POINTS];
    let inner = slopes.iter_mut().skip(1);
    for (slope, three) in inner.zip(points.windows(3)) {
        if let [a, b, c] = three {
            let (h, d) = secant(a, b);
            let (h_next, d_next) = secant(b, c);
            *slope = (h_next * d + h * d_next) / (h + h_next);
        }
    }
    let first = match points {
        [a, b, c, ..] => end_slope(secant(a, b), secant(b, c)),
        [a, b] => secant(a, b).1,
        _ => 0.0,
    };
    let last = match points {
        [.., a, b, c] => end_slope(secant(b, c), secant(a, b)),
        _ => first,
    };
    if let Some(slope) = slopes.first_mut() {
        *slope = first;
    }
    if let Some(slope) = points.len().checked_sub(1).and_then(|index| slopes.get_mut(index)) {
        *slope = last;
    }
    let cells = Cell::from_mut(&mut slopes[..]).as_slice_of_cells();
    for (pair, ends) in points.windows(2).zip(cells.windows(2)) {
        if let ([a, b], [left, right]) = (pair, ends) {
            let (_, d) = secant(a, b);
            let (alpha, beta) = (left.get() / d, right.get() / d);
            let square = alpha * alpha + beta * beta;
            if square > RADIUS * RADIUS {
                let scale = RADIUS / libm::sqrtf(square);
                left.set(scale * alpha * d);
                right.set(scale * beta * d);
            }
        }
    }
    slopes
}

/// Width and secant between two points.
fn secant(a: &CalibrationPoint, b: &CalibrationPoint) -> (f32, f32) {
    let h = b.volts.0 - a.volts.0;
    (h, (b.angle.0 - a.angle.0) / h)
}

/// One-sided three-point slope at an end; 0 where the formula points against the table.
fn end_slope((h, d): (f32, f32), (h_next, d_next): (f32, f32)) -> f32 {
    let slope = ((2.0 * h + h_next) * d - h * d_next) / (h + h_next);
    if slope * d > 0.0 { slope } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use joint_units::{Radians, Volts};

    fn table(points: &[(f32, f32)]) -> Vec<CalibrationPoint> {
        points.iter().map(|&(v, a)| CalibrationPoint { volts: Volts(v), angle: Radians(a) }).collect()
    }

    /// The limiter on a case by hand: secants 0.1 and 1 with unit spacing give m = (0, 0.55, 1.45) before it, because the
    /// formula at the left end points backwards, so alpha = 0 and beta = 5.5 on the left interval: beta is cut to 3, m to 0.3.
    /// Then alpha = 0.3 and beta = 1.45 on the right one: inside the circle.
    #[test]
    fn slopes_are_cut_to_the_circle_as_by_hand() {
        let slopes = slopes(&table(&[(0.0, 0.0), (1.0, 0.1), (2.0, 1.1)]));
        for (got, want) in slopes.iter().zip([0.0, 0.3, 1.45]) {
            assert!((got - want).abs() < 1e-6, "{got} for {want}");
        }
        assert!(slopes[3..].iter().all(|&slope| slope == 0.0));
    }

    /// The paper's example data (RPN 14, Lawrence Livermore), where other cubics overshoot 1 and dip below 0.
    #[test]
    fn the_papers_own_data_stay_monotone() {
        let points = table(&[
            (7.99, 0.0),
            (8.09, 2.764_29e-5),
            (8.19, 4.374_98e-2),
            (8.7, 0.169_183),
            (9.2, 0.469_428),
            (10.0, 0.943_740),
            (12.0, 0.998_636),
            (15.0, 0.999_919),
            (20.0, 0.999_994),
        ]);
        let slopes = slopes(&points);
        for (pair, ends) in points.windows(2).zip(slopes.windows(2)) {
            let interval = Interval { left: pair[0], right: pair[1], slopes: Some((ends[0], ends[1])) };
            let (_, d) = secant(&pair[0], &pair[1]);
            let (alpha, beta) = (ends[0] / d, ends[1] / d);
            assert!(alpha >= 0.0 && beta >= 0.0 && alpha * alpha + beta * beta <= 9.0001, "{alpha} {beta}");
            let mut before = pair[0].angle.0;
            for step in 0..=1000 {
                let angle = interval.at(step as f32 / 1000.0);
                assert!(angle >= before - 4.0 * f32::EPSILON * angle.abs(), "{angle} after {before}");
                before = angle;
            }
        }
    }
}
