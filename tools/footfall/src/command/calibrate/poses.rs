//! Collects rows of the same angle to poses, with mean, spread and drift, and the two means if the angle was reached from both
//! sides.

use super::rows::{Direction, Row};

/// Consecutive rows of the same pose.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Visit {
    /// First and last line of the file.
    pub lines: (u64, u64),
    /// Direction in which the angle was reached.
    pub direction: Direction,
    /// Number of rows.
    pub rows: usize,
    /// Mean volts.
    pub mean_v: f64,
    /// Standard deviation in volts; `None` for one row.
    pub sd_v: Option<f64>,
    /// Rise of the straight line through the rows from the first to the last, in volts; `None` for less than 3 rows.
    pub drift_v: Option<f64>,
}

/// A known angle and the sensor's volts there.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Pose {
    /// Mean of the rows' angles.
    pub angle_deg: f64,
    /// Middle between the means of up and down, or the mean of the only direction, in volts.
    pub volts: f64,
    /// Number of rows.
    pub rows: usize,
    /// Standard deviation within visits, in volts; `None` where no visit has two rows.
    pub sd_v: Option<f64>,
    /// Standard deviation of all rows about the pose's volts, including hysteresis.
    pub spread_v: f64,
    /// Mean volts of the visits from smaller angles.
    pub up_v: Option<f64>,
    /// Mean volts of the visits from greater angles.
    pub down_v: Option<f64>,
    /// A row was at the converter's limit.
    pub clipped: bool,
    /// In the order of the file.
    pub visits: Vec<Visit>,
}

impl Pose {
    /// First line of the file.
    #[must_use]
    pub fn line(&self) -> u64 {
        self.visits.first().map_or(0, |visit| visit.lines.0)
    }

    /// Up minus down, in volts.
    #[must_use]
    pub fn hysteresis_v(&self) -> Option<f64> {
        Some(self.up_v? - self.down_v?)
    }

    /// The largest drift of its visits, in volts, with its sign.
    #[must_use]
    pub fn drift_v(&self) -> Option<f64> {
        self.visits.iter().filter_map(|visit| visit.drift_v).max_by(|a, b| a.abs().total_cmp(&b.abs()))
    }
}

/// The poses of the rows, by rising angle: angles less than `same_deg` above the smallest one of a pose belong to it.
#[must_use]
pub fn poses(rows: &[Row], same_deg: f64) -> Vec<Pose> {
    let places = places(rows, same_deg);
    let count = places.iter().max().map_or(0, |most| most + 1);
    let angles = means(rows.iter().map(|row| row.angle_deg), &places, count);
    let mut gathered: Vec<(Vec<Visit>, bool)> = vec![(Vec::new(), false); count];
    let mut runs: Vec<(usize, std::ops::Range<usize>)> = Vec::new();
    for (index, &place) in places.iter().enumerate() {
        match runs.last_mut() {
            Some((before, run)) if *before == place && rows[run.start].direction == rows[index].direction => {
                run.end = index + 1;
            }
            _ => runs.push((place, index..index + 1)),
        }
    }
    for (number, (place, run)) in runs.iter().enumerate() {
        let members = &rows[run.clone()];
        let direction = members[0].direction.unwrap_or_else(|| direction(&runs, number));
        gathered[*place].0.push(visit(members, direction));
        gathered[*place].1 |= members.iter().any(|row| row.clipped);
    }
    gathered.into_iter().zip(angles).map(|((visits, clipped), angle)| pose(angle, visits, clipped)).collect()
}

/// The pose of each row, counted from 0 by rising angle.
pub(crate) fn places(rows: &[Row], same_deg: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|&a, &b| rows[a].angle_deg.total_cmp(&rows[b].angle_deg));
    let mut places = vec![0; rows.len()];
    let (mut place, mut smallest) = (0, order.first().map_or(0.0, |&first| rows[first].angle_deg));
    for index in order {
        let angle = rows[index].angle_deg;
        // Steps of exactly this width are separate poses, whatever their rounding.
        if angle - smallest > same_deg * (1.0 - 1e-6) {
            place += 1;
            smallest = angle;
        }
        places[index] = place;
    }
    places
}

fn means(values: impl Iterator<Item = f64>, places: &[usize], count: usize) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); count];
    for (value, &place) in values.zip(places) {
        sums[place].0 += value;
        sums[place].1 += 1.0;
    }
    sums.into_iter().map(|(sum, n): (f64, f64)| sum / n).collect()
}

/// From the previous pose; the first visit is assumed to continue its first direction.
fn direction(runs: &[(usize, std::ops::Range<usize>)], number: usize) -> Direction {
    let from = number.saturating_sub(1);
    let rises = match (runs.get(from), runs.get(from + 1)) {
        (Some(a), Some(b)) => b.0 >= a.0,
        _ => true,
    };
    if rises { Direction::Up } else { Direction::Down }
}

fn visit(rows: &[Row], direction: Direction) -> Visit {
    let n = rows.len() as f64;
    let mean_v = rows.iter().map(|row| row.volts).sum::<f64>() / n;
    let sum_of = |f: &dyn Fn(f64, f64) -> f64| {
        rows.iter().enumerate().map(|(k, row)| f(k as f64 - 0.5 * (n - 1.0), row.volts - mean_v)).sum::<f64>()
    };
    let sd_v = (rows.len() > 1).then(|| (sum_of(&|_, v| v * v) / (n - 1.0)).sqrt());
    let drift_v = (rows.len() > 2).then(|| sum_of(&|t, v| t * v) / sum_of(&|t, _| t * t) * (n - 1.0));
    Visit { lines: (rows[0].line, rows[rows.len() - 1].line), direction, rows: rows.len(), mean_v, sd_v, drift_v }
}

fn pose(angle_deg: f64, visits: Vec<Visit>, clipped: bool) -> Pose {
    let mean = |direction| {
        let of: Vec<&Visit> = visits.iter().filter(|visit| visit.direction == direction).collect();
        let rows: usize = of.iter().map(|visit| visit.rows).sum();
        (rows > 0).then(|| of.iter().map(|visit| visit.mean_v * visit.rows as f64).sum::<f64>() / rows as f64)
    };
    let (up_v, down_v) = (mean(Direction::Up), mean(Direction::Down));
    let volts = match (up_v, down_v) {
        (Some(up), Some(down)) => 0.5 * (up + down),
        (one, other) => one.or(other).unwrap_or(0.0),
    };
    let rows: usize = visits.iter().map(|visit| visit.rows).sum();
    let squares = |visit: &Visit| visit.sd_v.map_or(0.0, |sd| sd * sd * (visit.rows - 1) as f64);
    let within: f64 = visits.iter().map(squares).sum();
    let about: f64 = visits.iter().map(|visit| (visit.mean_v - volts).powi(2) * visit.rows as f64).sum();
    let degrees_of_freedom: usize = visits.iter().map(|visit| visit.rows - 1).sum();
    Pose {
        angle_deg,
        volts,
        rows,
        sd_v: (degrees_of_freedom > 0).then(|| (within / degrees_of_freedom as f64).sqrt()),
        spread_v: if rows > 1 { ((within + about) / (rows - 1) as f64).sqrt() } else { 0.0 },
        up_v,
        down_v,
        clipped,
        visits,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(pairs: &[(f64, f64)]) -> Vec<Row> {
        let row = |(index, &(angle_deg, volts)): (usize, &(f64, f64))| Row {
            line: index as u64 + 2,
            angle_deg,
            volts,
            clipped: false,
            direction: None,
        };
        pairs.iter().enumerate().map(row).collect()
    }

    #[test]
    fn an_up_and_a_down_sweep_differ_in_the_order_of_the_angles() {
        let rows = rows(&[(0.0, 1.0), (10.0, 2.0), (10.0, 2.2), (20.0, 3.0), (10.0, 2.4), (0.0, 1.2)]);
        let poses = poses(&rows, 0.05);
        assert_eq!(poses.iter().map(|pose| pose.angle_deg).collect::<Vec<_>>(), [0.0, 10.0, 20.0]);
        let middle = &poses[1];
        assert_eq!((middle.rows, middle.line()), (3, 3));
        assert!((middle.up_v.unwrap() - 2.1).abs() < 1e-12 && middle.down_v == Some(2.4));
        assert!((middle.volts - 2.25).abs() < 1e-12, "the middle of the two, however many rows each has");
        assert!((middle.hysteresis_v().unwrap() + 0.3).abs() < 1e-12);
        assert_eq!(poses[2].down_v, None, "the top was come to from below only");
        assert!((poses[0].hysteresis_v().unwrap() + 0.2).abs() < 1e-12, "the first visit goes as it begins");
    }

    #[test]
    fn what_the_file_says_of_the_direction_counts() {
        let mut rows = rows(&[(0.0, 1.0), (10.0, 2.0), (20.0, 3.0)]);
        for row in &mut rows {
            row.direction = Some(Direction::Down);
        }
        assert!(poses(&rows, 0.05).iter().all(|pose| pose.up_v.is_none() && pose.down_v.is_some()));
    }

    /// Mean 3, deviations -1, 0, 1: SD 1, a line of slope 1 over 2 steps.
    #[test]
    fn spread_and_drift_are_those_by_hand() {
        let poses = poses(&rows(&[(5.0, 2.0), (5.0, 3.0), (5.0, 4.0)]), 0.05);
        assert_eq!((poses[0].sd_v, poses[0].drift_v(), poses[0].spread_v), (Some(1.0), Some(2.0), 1.0));
    }

    #[test]
    fn near_angles_are_one_pose_as_far_as_asked_for() {
        let rows = rows(&[(0.0, 1.0), (0.04, 1.0), (0.05, 1.0), (1.0, 1.0), (1.9, 1.0), (2.0, 1.0)]);
        let count = |same| poses(&rows, same).len();
        assert_eq!((count(0.05), count(1.0), count(5.0)), (5, 3, 1));
    }
}
