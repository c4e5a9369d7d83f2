//! Every coefficient of a leg as a linear function of the cadence, fitted to recordings by robust least squares.
//!
//! ```text
//! c(cadence) = level + slope (cadence - centre)
//! ```
//! Recordings of one person share most of their distance from the line: their errors are taken to correlate by [`SHARED`]. So persons weigh
//! nearly the same, whatever the number of their recordings, and two recordings of one person say more about the slope than two of different
//! persons (generalised least squares with a random level a person, computed by subtracting a part of each person's mean).
//! Huber's weights (Ann. Math. Stat. 35 (1964) 73) limit the pull of a person who is far from the others. A slope is multiplied by
//! `1 - 1/t^2`, at least 0, with its ratio t to its standard error (James and Stein's rule): what does not stand out of the scatter between
//! persons is not followed.
//!
//! The mean angle of the hip has no slope: its zero is defined differently in every laboratory (pelvis or vertical), by more than it could
//! change with the cadence.

use crate::gait_family::leg::{COEFFICIENTS, Leg};
use crate::gait_family::recorded::Recorded;

/// Correlation of the errors of two recordings of one person.
pub const SHARED: f64 = 0.9;
/// Residual in standard deviations from which a person loses weight: 95 % efficiency for normal errors.
const HUBER: f64 = 1.345;
/// Smallest standard deviation, degrees: below the repeatability of a recording nothing is far from the others.
const LEAST_DEVIATION_DEG: f64 = 0.2;
/// Rounds of reweighting.
const ROUNDS: usize = 100;
/// Index of the hip's mean in the coefficients.
const HIP_MEAN: usize = 0;

/// How the coefficients depend on the cadence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dependence {
    /// Linear, by robust least squares: the family.
    Linear,
    /// Not at all: the mean of the recordings, persons weighing the same.
    None,
}

/// The coefficients of a leg as functions of the cadence.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Cadence at which a coefficient is its level, steps a minute.
    pub centre: f64,
    /// Level and slope of each coefficient, degrees and degrees per step a minute.
    pub lines: [(f64, f64); COEFFICIENTS],
}

impl Model {
    /// The model of some recordings.
    #[must_use]
    pub fn of(recordings: &[&Recorded], dependence: Dependence) -> Self {
        let weights = weights(recordings);
        let persons: f64 = weights.iter().sum();
        let mean = |of: &dyn Fn(&Recorded) -> f64| {
            recordings.iter().zip(&weights).map(|(one, weight)| of(one) * weight).sum::<f64>() / persons
        };
        let centre = mean(&|one| one.cadence);
        let coefficient = |n: usize| {
            let of = |one: &Recorded| one.leg.coefficients()[n];
            match dependence {
                Dependence::Linear => line(&grouped(recordings, centre, of), n != HIP_MEAN),
                Dependence::None => (mean(&of), 0.0),
            }
        };
        Self { centre, lines: std::array::from_fn(coefficient) }
    }

    /// The leg at a cadence.
    #[must_use]
    pub fn at(&self, cadence: f64) -> Leg {
        Leg::from_coefficients(&self.lines.map(|(level, slope)| level + slope * (cadence - self.centre)))
    }
}

/// Weights with the sum 1 for each person.
#[must_use]
pub fn weights(recordings: &[&Recorded]) -> Vec<f64> {
    let count = |one: &Recorded| recordings.iter().filter(|other| other.source.person == one.source.person).count();
    recordings.iter().map(|one| 1.0 / count(one) as f64).collect()
}

/// The points (x, y) of each person.
type Persons = Vec<Vec<(f64, f64)>>;

fn grouped(recordings: &[&Recorded], centre: f64, of: impl Fn(&Recorded) -> f64) -> Persons {
    let mut persons: Vec<(&str, Vec<(f64, f64)>)> = vec![];
    for one in recordings {
        let point = (one.cadence - centre, of(one));
        match persons.iter_mut().find(|(name, _)| *name == one.source.person) {
            Some((_, points)) => points.push(point),
            None => persons.push((one.source.person, vec![point])),
        }
    }
    persons.into_iter().map(|(_, points)| points).collect()
}

/// Sums of the normal equations for a level and a slope.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    ones: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
}

impl Sums {
    /// The sums of points whose part of the person's mean is subtracted, one weight a person.
    fn of(persons: &Persons, weights: &[f64]) -> Self {
        let mut sums = Self::default();
        for (points, weight) in persons.iter().zip(weights) {
            let n = points.len() as f64;
            let part = 1.0 - ((1.0 - SHARED) / (1.0 - SHARED + n * SHARED)).sqrt();
            let weight = weight / (1.0 - SHARED);
            let mean = mean_of(points);
            for point in points {
                let (one, x, y) = (1.0 - part, point.0 - part * mean.0, point.1 - part * mean.1);
                sums.ones += weight * one * one;
                sums.x += weight * one * x;
                sums.y += weight * one * y;
                sums.xx += weight * x * x;
                sums.xy += weight * x * y;
            }
        }
        sums
    }

    /// Spread of x about its mean.
    fn spread(&self) -> f64 {
        self.xx - self.x * self.x / self.ones
    }

    /// Level and slope; the slope is 0 if it is not wanted or all points are at one x.
    fn line(&self, sloped: bool) -> (f64, f64) {
        let slope =
            if sloped && self.spread() > 1e-9 { (self.xy - self.x * self.y / self.ones) / self.spread() } else { 0.0 };
        (self.level(slope), slope)
    }

    /// The best level for a slope.
    fn level(&self, slope: f64) -> f64 {
        (self.y - slope * self.x) / self.ones
    }
}

fn mean_of(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    (points.iter().map(|point| point.0).sum::<f64>() / n, points.iter().map(|point| point.1).sum::<f64>() / n)
}

/// Level and slope of a coefficient.
fn line(persons: &Persons, sloped: bool) -> (f64, f64) {
    let mut weights = vec![1.0; persons.len()];
    let mut sums = Sums::of(persons, &weights);
    for _ in 0..ROUNDS {
        let (level, slope) = sums.line(sloped);
        let off: Vec<f64> = persons
            .iter()
            .map(|points| {
                let (x, y) = mean_of(points);
                (y - level - slope * x).abs()
            })
            .collect();
        let deviation = (gait_trace::upper_median(off.iter().copied()) / 0.6745).max(LEAST_DEVIATION_DEG);
        for (weight, off) in weights.iter_mut().zip(&off) {
            *weight = 1.0 / (off / (HUBER * deviation)).max(1.0);
        }
        sums = Sums::of(persons, &weights);
    }
    let (level, slope) = sums.line(sloped);
    if slope == 0.0 {
        return (level, slope);
    }
    // The variance of the points about the line, in the units of the transformed points.
    let residuals: Persons =
        persons.iter().map(|points| points.iter().map(|(x, y)| (*x, y - level - slope * x)).collect()).collect();
    let variance = squares(&residuals, &weights) / (persons.iter().map(Vec::len).sum::<usize>() as f64 - 2.0).max(1.0);
    let squared_t = slope * slope * sums.spread() / variance.max(1e-18);
    let kept = slope * (1.0 - 1.0 / squared_t).max(0.0);
    (sums.level(kept), kept)
}

/// Weighted sum of the squares of transformed residuals.
fn squares(residuals: &Persons, weights: &[f64]) -> f64 {
    let swapped: Persons = residuals.iter().map(|points| points.iter().map(|(_, r)| (*r, 0.0)).collect()).collect();
    Sums::of(&swapped, weights).xx
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nine persons at x = 0 ... 8, one point each.
    fn persons(y: impl Fn(f64) -> f64) -> Persons {
        (0..9).map(|n| vec![(f64::from(n), y(f64::from(n)))]).collect()
    }

    #[test]
    fn a_line_is_found_again() {
        let (level, slope) = line(&persons(|x| 3.0 - 0.5 * x), true);
        assert!((level - 3.0).abs() < 1e-9 && (slope + 0.5).abs() < 1e-9);
        let (level, slope) = line(&persons(|x| 3.0 - 0.5 * x), false);
        assert!((level - 1.0).abs() < 1e-9 && slope == 0.0);
    }

    /// The plain line would be at 21 at x = 8.
    #[test]
    fn one_far_person_hardly_moves_the_line() {
        let (level, slope) = line(&persons(|x| if x == 8.0 { 43.0 } else { 3.0 }), true);
        assert!((level + 8.0 * slope - 3.0).abs() < 0.5, "{level} {slope}");
    }

    /// A person who is recorded three times at one cadence weighs little more than one who is recorded once.
    #[test]
    fn persons_weigh_nearly_the_same() {
        let once = vec![vec![(0.0, 0.0)], vec![(0.0, 1.0)]];
        let thrice = vec![vec![(0.0, 0.0)], vec![(0.0, 1.0); 3]];
        assert!((line(&once, true).0 - 0.5).abs() < 1e-9);
        // 1 / (0.9 + 0.1 / 3) against 1.
        assert!((line(&thrice, true).0 - 1.0 / (1.0 + 0.9 + 0.1 / 3.0)).abs() < 1e-9, "{:?}", line(&thrice, true));
    }

    /// Two persons at different levels who rise by 1: the slope is nearer to theirs than to the -0.5 of a line through all four points.
    #[test]
    fn the_slope_is_that_within_persons() {
        let apart = vec![vec![(0.0, 20.0), (10.0, 30.0)], vec![(10.0, 0.0), (20.0, 10.0)]];
        let (_, slope) = line(&apart, true);
        assert!((0.5..1.0).contains(&slope), "{slope}");
    }

    /// Points without any trend have no slope that is kept.
    #[test]
    fn scatter_is_not_followed() {
        let scatter = [1.0, -1.0, 0.5, -0.7, 0.9, -0.4, 0.8, -1.1, 0.2];
        assert_eq!(line(&persons(|x| scatter[x as usize]), true).1, 0.0);
    }
}
