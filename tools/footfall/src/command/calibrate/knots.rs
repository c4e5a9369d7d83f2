//! Selects the poses that become the points of a table: those with the smallest error at the others.
//!
//! Starting with the two ends, the pose with the largest error becomes a point until there are enough or no error is left; then
//! each inner point is moved between its neighbours as long as that improves the table. The objective is the largest error,
//! and among tables with the same one the root mean square.

use hgod_adc::{Calibration, CalibrationError, CalibrationPoint, Interpolation};
use joint_units::Volts;

/// Errors too small for another point: a hundredth of the reading accuracy of a goniometer.
const NOTHING_DEG: f64 = 1e-3;

/// Candidates for a point between its neighbours, and rounds over all points.
const TRIES: usize = 24;
const ROUNDS: usize = 4;

/// A table extended by straight lines beyond its ends, so that a noisy row at an end has an error instead of a validity.
#[derive(Debug, Clone, Copy)]
pub struct Extended<'a> {
    table: &'a Calibration,
    /// Volts, degrees and degrees a volt at each end.
    ends: [(f64, f64, f64); 2],
}

impl<'a> Extended<'a> {
    /// Extends a table.
    #[must_use]
    pub fn new(table: &'a Calibration) -> Self {
        let (low, high) = table.volts_span();
        let step = 0.01 * (f64::from(high.0) - f64::from(low.0)) / table.points().len() as f64;
        let end = |volts: f64, inward: f64| {
            let at = inside(table, volts);
            (volts, at, (inside(table, volts + inward) - at) / inward)
        };
        Self { table, ends: [end(low.0.into(), step), end(high.0.into(), -step)] }
    }

    /// The angle in degrees.
    #[must_use]
    pub fn degrees(&self, volts: f64) -> f64 {
        let [low, high] = self.ends;
        let beyond = |(at, degrees, slope): (f64, f64, f64)| degrees + slope * (volts - at);
        if volts < low.0 {
            beyond(low)
        } else if volts > high.0 {
            beyond(high)
        } else {
            inside(self.table, volts)
        }
    }

    /// Slope without its sign, degrees a volt.
    #[must_use]
    pub fn slope(&self, volts: f64) -> f64 {
        let step = 0.005 * (self.ends[1].0 - self.ends[0].0);
        ((self.degrees(volts + step) - self.degrees(volts - step)) / (2.0 * step)).abs()
    }
}

fn inside(table: &Calibration, volts: f64) -> f64 {
    let (low, high) = table.volts_span();
    let volts = (volts as f32).max(low.0).min(high.0);
    // Within its ends a table always has an angle.
    table.angle(Volts(volts)).map_or(f64::NAN, |angle| f64::from(angle.0).to_degrees())
}

/// Indices of the points among the candidates, which are sorted by volts; `wanted` are the volts and degrees to be met.
///
/// # Errors
/// The two ends alone break a rule of tables.
pub fn choose(
    candidates: &[CalibrationPoint],
    wanted: &[(f64, f64)],
    most: usize,
    interpolation: Interpolation,
) -> Result<Vec<usize>, CalibrationError> {
    let mut places = vec![0, candidates.len().saturating_sub(1)];
    let mut best = objective(&build(candidates, &places, interpolation)?, wanted);
    while places.len() < most {
        let Some(more) = one_more(candidates, &places, interpolation) else { break };
        best = objective(&build(candidates, &more, interpolation)?, wanted);
        places = more;
    }
    for _ in 0..ROUNDS {
        let before = best;
        for k in 1..places.len() - 1 {
            let (from, to) = (places[k - 1] + 1, places[k + 1]);
            let stride = (to - from).div_ceil(TRIES).max(1);
            for place in (from..to).step_by(stride) {
                let mut moved = places.clone();
                moved[k] = place;
                let Ok(table) = build(candidates, &moved, interpolation) else { continue };
                let now = objective(&table, wanted);
                if now < best {
                    (best, places) = (now, moved);
                }
            }
        }
        if best >= before {
            break;
        }
    }
    Ok(places)
}

/// The table through these candidates.
///
/// # Errors
/// They break a rule of tables.
pub fn build(
    candidates: &[CalibrationPoint],
    places: &[usize],
    interpolation: Interpolation,
) -> Result<Calibration, CalibrationError> {
    let points: Vec<CalibrationPoint> = places.iter().filter_map(|&place| candidates.get(place).copied()).collect();
    Calibration::new(&points, interpolation)
}

/// Largest error, and root mean square.
fn objective(table: &Calibration, wanted: &[(f64, f64)]) -> (f64, f64) {
    let table = Extended::new(table);
    let (mut worst, mut squares) = (0.0_f64, 0.0);
    for &(volts, degrees) in wanted {
        let error = (table.degrees(volts) - degrees).abs();
        worst = worst.max(error);
        squares += error * error;
    }
    (worst, squares)
}

/// The same indices and the candidate with the largest error; `None` if no candidate can be added.
fn one_more(candidates: &[CalibrationPoint], places: &[usize], interpolation: Interpolation) -> Option<Vec<usize>> {
    let table = build(candidates, places, interpolation).ok()?;
    let table = Extended::new(&table);
    let mut errors: Vec<(f64, usize)> = candidates
        .iter()
        .enumerate()
        .filter(|(place, _)| !places.contains(place))
        .map(|(place, point)| ((table.degrees(point.volts.0.into()) - f64::from(point.angle.degrees())).abs(), place))
        .filter(|&(error, _)| error > NOTHING_DEG)
        .collect();
    errors.sort_by(|a, b| b.0.total_cmp(&a.0));
    errors.into_iter().find_map(|(_, place)| {
        let mut more = places.to_vec();
        more.insert(more.partition_point(|&before| before < place), place);
        build(candidates, &more, interpolation).is_ok().then_some(more)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use joint_units::Radians;

    fn curve(count: usize, degrees: impl Fn(f64) -> f64) -> (Vec<CalibrationPoint>, Vec<(f64, f64)>) {
        let volts = |k: usize| 0.5 + 2.0 * k as f64 / (count - 1) as f64;
        let wanted: Vec<(f64, f64)> = (0..count).map(|k| (volts(k), degrees(volts(k)))).collect();
        let point = |&(v, deg): &(f64, f64)| CalibrationPoint {
            volts: Volts(v as f32),
            angle: Radians::from_degrees(deg as f32),
        };
        (wanted.iter().map(point).collect(), wanted)
    }

    #[test]
    fn a_straight_sensor_takes_two_points() {
        let (candidates, wanted) = curve(101, |v| 40.0 * v - 30.0);
        assert_eq!(choose(&candidates, &wanted, 32, Interpolation::Linear).unwrap(), [0, 100]);
    }

    /// The error of straight lines through a parabola is c h^2 / 4 in an interval of width h, so equal steps are optimal: for
    /// 10 deg/V^2, 2 V and 8 intervals 0.1563 degrees.
    #[test]
    fn straight_lines_share_the_error_of_a_parabola_evenly() {
        let (candidates, wanted) = curve(401, |v| 20.0 * v + 10.0 * v * v);
        let places = choose(&candidates, &wanted, 9, Interpolation::Linear).unwrap();
        let table = build(&candidates, &places, Interpolation::Linear).unwrap();
        let (worst, _) = objective(&table, &wanted);
        assert!((0.156..1.15 * 0.1563).contains(&worst), "{worst} with {places:?}");
    }

    /// The inner point of three belongs at the corner, which bisection would not find.
    #[test]
    fn the_corner_of_a_bent_line_is_found() {
        let (candidates, wanted) = curve(101, |v| if v < 1.0 { 80.0 * v } else { 80.0 + 20.0 * (v - 1.0) });
        assert_eq!(choose(&candidates, &wanted, 3, Interpolation::Linear).unwrap(), [0, 25, 100]);
    }

    #[test]
    fn beyond_its_ends_a_table_goes_on_straight() {
        let (candidates, _) = curve(3, |v| 40.0 * v);
        let table = build(&candidates, &[0, 1, 2], Interpolation::MonotoneCubic).unwrap();
        let table = Extended::new(&table);
        for volts in [0.4, 0.5, 1.7, 2.5, 2.6] {
            assert!((table.degrees(volts) - 40.0 * volts).abs() < 2e-3, "{}", table.degrees(volts));
            assert!((table.slope(volts) - 40.0).abs() < 0.05);
        }
    }
}
