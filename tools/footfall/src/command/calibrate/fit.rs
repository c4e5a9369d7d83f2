//! Makes a table that the board accepts from rows of known angles, or reports the fault.
//!
//! 1. Rows of the same angle become poses ([`poses`]).
//! 2. The sensor must follow the angle, and be steady within a pose; else [`What::Stuck`], [`What::Unsteady`].
//! 3. In the order of volts, a pose that falls by no more than the spread is pooled ([`monotone`]); a larger fall is
//!    [`What::NotMonotone`]: such a sensor has two angles for the same volts.
//! 4. At both ends, poses at the converter's limit, poses where the sensor saturates, and poses that noise cannot tell from those are left
//!    out: a reading there is outside of the table, not a wrong angle.
//! 5. Up to 32 poses become points ([`knots`]).

use super::knots::{self, Extended};
use super::monotone;
use super::poses::{self, Pose};
use super::rows::Rows;
use crate::file::calibration_file::Hysteresis;
use hgod_adc::{Calibration, CalibrationError, CalibrationPoint, Interpolation, MAX_POINTS, MAX_SLOPE};
use joint_units::{AdcCode, Radians, Volts};

/// Fewest poses of a table: two make a line, the third one tests it.
pub const MIN_POSES: usize = 3;

/// Supply for the worth of a code if the rows have none, V.
const TYPICAL_SUPPLY_V: f64 = 3.3;

/// Distance of the table's end from the poses left out beyond it, in standard deviations.
const CLEAR_SD: f64 = 4.0;

/// Shortest stretch for measuring the sensitivity, as a share of the range of angles: a shorter one would measure noise.
const STRETCH: f64 = 0.05;

/// The same in degrees.
const LEAST_STRETCH_DEG: f64 = 2.0;

/// A number with at most two decimals.
#[must_use]
pub fn short(value: f64) -> String {
    // Adding 0 removes the sign of a rounded zero.
    format!("{}", (value * 100.0).round() / 100.0 + 0.0)
}

/// Settings of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Interpolation between the points.
    pub interpolation: Interpolation,
    /// Largest number of points, 2 to 32.
    pub points: usize,
    /// Rows whose angles differ by less are one pose, in degrees.
    pub same_deg: f64,
    /// Largest standard deviation within a visit to a pose, in degrees.
    pub most_sd_deg: f64,
    /// Share of the median sensitivity, in volts a degree, below which an end is saturated.
    pub saturated_share: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            interpolation: Interpolation::MonotoneCubic,
            points: MAX_POINTS,
            same_deg: 0.05,
            most_sd_deg: 2.0,
            saturated_share: 0.2,
        }
    }
}

/// Why a pose is not in the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LeftOut {
    /// One of its codes is 0 or 4095.
    Clipped,
    /// The volts hardly change there.
    Saturated,
    /// Noise cannot tell it from a pose that was left out.
    NearTheEnd,
}

impl LeftOut {
    /// Text for the user.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Clipped => "at the converter's end",
            Self::Saturated => "saturated",
            Self::NearTheEnd => "too near to a saturated pose",
        }
    }
}

/// A fault of the rows as a whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// Line of the file.
    pub line: Option<u64>,
    /// Kind of the fault.
    pub what: What,
}

/// The kinds of faults.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum What {
    /// Fewer than [`MIN_POSES`].
    #[error("too few poses: {poses}; allowed are {MIN_POSES} angles and more")]
    TooFewPoses {
        /// Number of angles.
        poses: usize,
    },
    /// The volts do not follow the angle.
    #[error("stuck: over {angle_deg:.1} degrees the sensor changes by {volts:.4} V; must be more than {least_v:.4} V")]
    Stuck {
        /// Range of the angles.
        angle_deg: f64,
        /// Range of the volts.
        volts: f64,
        /// Smallest range of a working sensor.
        least_v: f64,
    },
    /// The volts vary while the angle is held.
    #[error(
        "unsteady: at {angle_deg} degrees the rows spread by {sd_deg:.2} degrees (standard deviation); allowed is {most_deg}: \
         hold the joint still, or remove a wrong row"
    )]
    Unsteady {
        /// The pose.
        angle_deg: f64,
        /// Its spread.
        sd_deg: f64,
        /// The largest allowed spread.
        most_deg: f64,
    },
    /// The volts reverse their direction.
    #[error(
        "not monotone: from {from_deg} to {to_deg} degrees the volts go from {from_v:.4} to {to_v:.4} V, {fall_v:.4} V against \
         the direction of the rest; allowed is the rows' own spread, {allowed_v:.4} V"
    )]
    NotMonotone {
        /// The previous pose.
        from_deg: f64,
        /// Its volts.
        from_v: f64,
        /// The pose.
        to_deg: f64,
        /// Its volts.
        to_v: f64,
        /// The reversal.
        fall_v: f64,
        /// Spread of the two.
        allowed_v: f64,
    },
    /// An inner stretch where the volts do not change.
    #[error(
        "dead zone: from {from_deg} to {to_deg} degrees the volts change by {volts:.4} V; must be {least_v:.4} V at least"
    )]
    DeadZone {
        /// Its start.
        from_deg: f64,
        /// Its end.
        to_deg: f64,
        /// Range of the volts in it.
        volts: f64,
        /// Smallest range of a working sensor.
        least_v: f64,
    },
    /// Saturation leaves too few poses.
    #[error("saturated: {left_out} of {poses} poses are at a flat end, {left} are left; must be {MIN_POSES} at least")]
    Saturated {
        /// Number of poses.
        poses: usize,
        /// Number of poses that were left out.
        left_out: usize,
        /// Number of poses that remain.
        left: usize,
    },
    /// The table breaks a rule of the board.
    #[error("{0}")]
    Table(CalibrationError),
}

/// The error of the table at one row.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Residual {
    /// Line of the file.
    pub line: u64,
    /// The known angle.
    pub angle_deg: f64,
    /// The row's volts.
    pub volts: f64,
    /// The table's angle minus the known one; `None` at poses that are not in the table.
    pub error_deg: Option<f64>,
}

/// A table with its errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The table.
    pub calibration: Calibration,
    /// By rising angle.
    pub poses: Vec<Pose>,
    /// Why a pose is not in the table, for each pose.
    pub left_out: Vec<Option<LeftOut>>,
    /// Number of poses that were joined with neighbours because noise had reversed their order.
    pub pooled: usize,
    /// For each row, in order.
    pub residuals: Vec<Residual>,
    /// Root mean square over the rows of the table.
    pub rms_deg: f64,
    /// Largest residual, without its sign, and its line.
    pub worst_deg: (f64, u64),
    /// Largest error at the poses' means.
    pub worst_pose_deg: f64,
    /// Largest error at a pose that the table does not contain, leaving out each inner point in turn; `None` if there are only the
    /// ends.
    pub unknown_pose_deg: Option<f64>,
    /// Difference of up and down; `None` for one direction.
    pub hysteresis: Option<Hysteresis>,
    /// Standard deviation within visits, of all poses together, in volts; `None` without repeated rows.
    pub noise_v: Option<f64>,
    /// Angle of one code where the table is steepest, in degrees.
    pub code_deg: f64,
    /// Rows of left-out poses whose volts are within the table.
    pub inside: usize,
}

/// Fits a table to rows.
///
/// # Errors
/// What is wrong with the rows, and where.
pub fn fit(rows: &Rows, settings: &Settings) -> Result<Fit, Fault> {
    let poses = poses::poses(&rows.rows, settings.same_deg);
    if poses.len() < MIN_POSES {
        return Err(Fault { line: None, what: What::TooFewPoses { poses: poses.len() } });
    }
    let noise_v = noise(&poses);
    let floor_v = if rows.code_v > 0.0 { rows.code_v } else { f64::from(hgod_adc::MIN_VOLTS_STEP.0) };
    moves(&poses, noise_v.unwrap_or(0.0), settings)?;

    // From here on in the order of rising volts.
    let mut order: Vec<usize> = (0..poses.len()).collect();
    if !rises(&poses) {
        order.reverse();
    }
    let mut left_out = vec![None; poses.len()];
    let inner = |index: &usize| !poses[*index].clipped;
    let first = order.iter().position(inner).unwrap_or(order.len());
    let last = order.iter().rposition(inner).map_or(first, |last| last + 1);
    for &index in order[..first].iter().chain(&order[last..]) {
        left_out[index] = Some(LeftOut::Clipped);
    }
    let order = &order[first..last];
    let spread = |pose: &Pose| {
        let own = if pose.rows > 1 { pose.spread_v } else { 0.0 };
        own.max(noise_v.unwrap_or(0.0)).max(floor_v)
    };
    in_order(&poses, order, spread)?;
    let values: Vec<(f64, f64)> = order.iter().map(|&index| (poses[index].volts, poses[index].rows as f64)).collect();
    let blocks = monotone::pool(&values);
    let pooled = blocks.iter().filter(|block| block.members.len() > 1).map(|block| block.members.len()).sum();
    let step = |k: usize, volts: f64| {
        let pose = order[k];
        Step { volts, angle_deg: poses[pose].angle_deg, weight: values[k].1, pose }
    };
    let steps: Vec<Step> = blocks.iter().flat_map(|block| block.members.clone().map(|k| step(k, block.mean))).collect();

    let angles = || order.iter().map(|&index| poses[index].angle_deg);
    let range = angles().fold(f64::MIN, f64::max) - angles().fold(f64::MAX, f64::min);
    let stretch = (STRETCH * range).max(LEAST_STRETCH_DEG);
    let clear_v = (CLEAR_SD * noise_v.unwrap_or(0.0) + 2.0 * floor_v).max(floor_v);
    let kept = ends(&steps, &poses, &mut left_out, stretch, settings.saturated_share, clear_v);
    let candidates = candidates(kept);
    if candidates.len() < MIN_POSES {
        let out = left_out.iter().flatten().count();
        let line = left_out.iter().position(Option::is_some).map(|index| poses[index].line());
        return Err(Fault {
            line,
            what: What::Saturated { poses: poses.len(), left_out: out, left: candidates.len() },
        });
    }
    alive(kept, &poses, stretch)?;

    let wanted: Vec<(f64, f64)> = kept.iter().map(|step| (poses[step.pose].volts, step.angle_deg)).collect();
    let table = |error: CalibrationError| Fault { line: None, what: What::Table(error) };
    let places = knots::choose(&candidates, &wanted, settings.points, settings.interpolation).map_err(table)?;
    let calibration = knots::build(&candidates, &places, settings.interpolation).map_err(table)?;
    let unknown_pose_deg = unknown(&candidates, &places, settings.interpolation);
    let judged = judge(rows, &poses, &left_out, &calibration, settings.same_deg);
    let code_v = if rows.code_v > 0.0 { rows.code_v } else { TYPICAL_SUPPLY_V / f64::from(AdcCode::MAX.0) };
    Ok(Fit {
        code_deg: code_v * steepest(&calibration),
        pooled,
        noise_v,
        unknown_pose_deg,
        residuals: judged.residuals,
        rms_deg: judged.rms_deg,
        worst_deg: judged.worst_deg,
        worst_pose_deg: judged.worst_pose_deg,
        hysteresis: judged.hysteresis,
        inside: judged.inside,
        calibration,
        poses,
        left_out,
    })
}

/// A pose with the volts of the monotone regression: joined neighbours have the same.
#[derive(Debug, Clone, Copy)]
struct Step {
    volts: f64,
    angle_deg: f64,
    weight: f64,
    /// Its index among the poses.
    pose: usize,
}

/// The candidates for points: poses of equal volts are one, at their mean angle; rounded as in the file, to a microvolt and a
/// ten thousandth of a degree.
fn candidates(steps: &[Step]) -> Vec<CalibrationPoint> {
    // Adding 0 removes the sign of a zero.
    let rounded = |value: f64, digits: f64| ((value * digits).round() / digits + 0.0) as f32;
    let point = |steps: &[Step]| {
        let weight: f64 = steps.iter().map(|step| step.weight).sum();
        let angle = steps.iter().map(|step| step.angle_deg * step.weight).sum::<f64>() / weight;
        let volts = steps.first().map_or(0.0, |step| step.volts);
        CalibrationPoint { volts: Volts(rounded(volts, 1e6)), angle: Radians::from_degrees(rounded(angle, 1e4)) }
    };
    steps.chunk_by(|a, b| a.volts == b.volts).map(point).collect()
}

/// Standard deviation within visits, over all poses.
fn noise(poses: &[Pose]) -> Option<f64> {
    let visits = || poses.iter().flat_map(|pose| &pose.visits).filter(|visit| visit.rows > 1);
    let freedom: usize = visits().map(|visit| visit.rows - 1).sum();
    let squares: f64 = visits().filter_map(|visit| Some(visit.sd_v?.powi(2) * (visit.rows - 1) as f64)).sum();
    (freedom > 0).then(|| (squares / freedom as f64).sqrt())
}

/// Smallest sensitivity of a table, volts a degree.
fn least_sensitivity() -> f64 {
    1.0 / f64::from(Radians(MAX_SLOPE).degrees())
}

/// Checks that the sensor follows the joint, and is steady at a pose.
fn moves(poses: &[Pose], noise_v: f64, settings: &Settings) -> Result<(), Fault> {
    let (low, high) = poses.iter().fold((f64::MAX, f64::MIN), |(l, h), pose| (l.min(pose.volts), h.max(pose.volts)));
    let angle_deg = poses[poses.len() - 1].angle_deg - poses[0].angle_deg;
    let least_v = (angle_deg * least_sensitivity()).max(CLEAR_SD * noise_v);
    // A voltage that varies widely is unsteady, not stuck.
    for pose in poses {
        let sd_deg = pose.sd_v.unwrap_or(0.0) * angle_deg / (high - low).max(angle_deg * least_sensitivity());
        if sd_deg > settings.most_sd_deg {
            let what = What::Unsteady { angle_deg: pose.angle_deg, sd_deg, most_deg: settings.most_sd_deg };
            return Err(Fault { line: Some(pose.line()), what });
        }
    }
    if high - low <= least_v {
        return Err(Fault { line: Some(poses[0].line()), what: What::Stuck { angle_deg, volts: high - low, least_v } });
    }
    Ok(())
}

/// Whether volts rise with the angle, by the sign of their covariance.
fn rises(poses: &[Pose]) -> bool {
    let n = poses.len() as f64;
    let middle = poses.iter().map(|pose| pose.angle_deg).sum::<f64>() / n;
    poses.iter().map(|pose| (pose.angle_deg - middle) * pose.volts).sum::<f64>() > 0.0
}

/// Checks that no pose falls below a previous one by more than the spread of both.
fn in_order(poses: &[Pose], order: &[usize], spread: impl Fn(&Pose) -> f64) -> Result<(), Fault> {
    let Some(&first) = order.first() else { return Ok(()) };
    let mut highest = &poses[first];
    for pose in order.iter().map(|&index| &poses[index]) {
        let (fall_v, allowed_v) = (highest.volts - pose.volts, spread(highest) + spread(pose));
        if fall_v > allowed_v {
            let (from_deg, from_v) = (highest.angle_deg, highest.volts);
            let (to_deg, to_v) = (pose.angle_deg, pose.volts);
            let what = What::NotMonotone { from_deg, from_v, to_deg, to_v, fall_v, allowed_v };
            return Err(Fault { line: Some(pose.line()), what });
        }
        if fall_v < 0.0 {
            highest = pose;
        }
    }
    Ok(())
}

/// Sensitivity from a step inward, volts a degree, over a minimum stretch, or as far as the poses reach.
fn sensitivity<'a>(end: &Step, inward: impl Iterator<Item = &'a Step>, stretch: f64) -> Option<f64> {
    let mut last = None;
    for step in inward {
        let width = (step.angle_deg - end.angle_deg).abs();
        last = Some((step.volts - end.volts).abs() / width);
        if width >= stretch * (1.0 - 1e-6) {
            break;
        }
    }
    last
}

/// The range between the flat ends; poses outside are marked.
fn ends<'a>(
    steps: &'a [Step],
    poses: &[Pose],
    left_out: &mut [Option<LeftOut>],
    stretch: f64,
    share: f64,
    clear_v: f64,
) -> &'a [Step] {
    let each = (0..steps.len()).filter_map(|k| sensitivity(&steps[k], steps[k + 1..].iter(), stretch));
    let median = gait_trace::upper_median(each);
    let least = (share * median).max(least_sensitivity());
    let (mut from, mut to) = (0, steps.len());
    while to - from > 1 && sensitivity(&steps[from], steps[from + 1..to].iter(), stretch) < Some(least) {
        mark(&steps[from], left_out, LeftOut::Saturated);
        from += 1;
    }
    while to - from > 1 && sensitivity(&steps[to - 1], steps[from..to - 1].iter().rev(), stretch) < Some(least) {
        to -= 1;
        mark(&steps[to], left_out, LeftOut::Saturated);
    }
    // Visits of the poses that were left out, at the low and at the high end.
    let middle = 0.5 * (steps.first().map_or(0.0, |step| step.volts) + steps.last().map_or(0.0, |step| step.volts));
    let out = |left_out: &[Option<LeftOut>]| -> (f64, f64) {
        let visits = poses.iter().zip(left_out).filter(|(_, why)| why.is_some()).flat_map(|(pose, _)| &pose.visits);
        visits.fold((f64::MIN, f64::MAX), |(low, high), visit| match visit.mean_v {
            volts if volts < middle => (low.max(volts), high),
            volts => (low, high.min(volts)),
        })
    };
    let (low, high) = out(left_out);
    while from < to && steps[from].volts < low + clear_v {
        mark(&steps[from], left_out, LeftOut::NearTheEnd);
        from += 1;
    }
    while from < to && steps[to - 1].volts > high - clear_v {
        to -= 1;
        mark(&steps[to], left_out, LeftOut::NearTheEnd);
    }
    &steps[from..to]
}

fn mark(step: &Step, left_out: &mut [Option<LeftOut>], why: LeftOut) {
    left_out[step.pose] = Some(why);
}

/// Checks that no stretch between the ends is flat.
fn alive(steps: &[Step], poses: &[Pose], stretch: f64) -> Result<(), Fault> {
    for (k, step) in steps.iter().enumerate() {
        let far = |other: &&Step| (other.angle_deg - step.angle_deg).abs() >= stretch * (1.0 - 1e-6);
        let Some(other) = steps[k + 1..].iter().find(far) else { continue };
        let volts = other.volts - step.volts;
        let least_v = (other.angle_deg - step.angle_deg).abs() * least_sensitivity();
        if volts < least_v {
            let line = Some(poses[other.pose].line());
            let what = What::DeadZone { from_deg: step.angle_deg, to_deg: other.angle_deg, volts, least_v };
            return Err(Fault { line, what });
        }
    }
    Ok(())
}

/// The largest error at a pose that the table does not contain.
fn unknown(candidates: &[CalibrationPoint], places: &[usize], interpolation: Interpolation) -> Option<f64> {
    let whole = knots::build(candidates, places, interpolation).ok()?;
    let errors = (0..candidates.len()).filter_map(|place| {
        let point = candidates.get(place)?;
        let off = |table: &Calibration| {
            (Extended::new(table).degrees(point.volts.0.into()) - f64::from(point.angle.degrees())).abs()
        };
        match places.iter().position(|&own| own == place) {
            None => Some(off(&whole)),
            Some(k) if k == 0 || k + 1 == places.len() => None,
            Some(k) => {
                let mut others = places.to_vec();
                others.remove(k);
                Some(off(&knots::build(candidates, &others, interpolation).ok()?))
            }
        }
    });
    errors.max_by(f64::total_cmp)
}

struct Judged {
    residuals: Vec<Residual>,
    rms_deg: f64,
    worst_deg: (f64, u64),
    worst_pose_deg: f64,
    hysteresis: Option<Hysteresis>,
    inside: usize,
}

fn judge(rows: &Rows, poses: &[Pose], left_out: &[Option<LeftOut>], table: &Calibration, same_deg: f64) -> Judged {
    let extended = Extended::new(table);
    let places = poses::places(&rows.rows, same_deg);
    let (low, high) = table.volts_span();
    let (mut squares, mut count, mut worst_deg, mut inside) = (0.0, 0.0, (0.0, 0), 0);
    let residuals = rows.rows.iter().zip(places).map(|(row, place)| {
        let error_deg = left_out[place].is_none().then(|| extended.degrees(row.volts) - row.angle_deg);
        match error_deg {
            Some(error) => {
                squares += error * error;
                count += 1.0;
                if error.abs() > worst_deg.0 {
                    worst_deg = (error.abs(), row.line);
                }
            }
            None => inside += usize::from((f64::from(low.0)..=f64::from(high.0)).contains(&row.volts)),
        }
        Residual { line: row.line, angle_deg: row.angle_deg, volts: row.volts, error_deg }
    });
    let residuals = residuals.collect();
    let kept = || poses.iter().zip(left_out).filter(|(_, why)| why.is_none()).map(|(pose, _)| pose);
    let worst_pose_deg = kept().map(|pose| (extended.degrees(pose.volts) - pose.angle_deg).abs()).fold(0.0, f64::max);
    let apart: Vec<f64> =
        kept().filter_map(|pose| Some((extended.degrees(pose.up_v?) - extended.degrees(pose.down_v?)).abs())).collect();
    // The file has four decimals.
    let rounded = |value: f64| ((value * 1e4).round() / 1e4) as f32;
    let hysteresis = (!apart.is_empty()).then(|| Hysteresis {
        largest: rounded(apart.iter().copied().fold(0.0, f64::max)),
        mean: rounded(apart.iter().sum::<f64>() / apart.len() as f64),
    });
    Judged {
        residuals,
        rms_deg: f64::sqrt(squares / f64::max(count, 1.0)),
        worst_deg,
        worst_pose_deg,
        hysteresis,
        inside,
    }
}

/// The largest slope of an interval, degrees a volt.
fn steepest(table: &Calibration) -> f64 {
    let slope = |pair: &[CalibrationPoint]| match pair {
        [a, b] => f64::from((b.angle.degrees() - a.angle.degrees()).abs() / (b.volts.0 - a.volts.0)),
        _ => 0.0,
    };
    table.points().windows(2).map(slope).fold(0.0, f64::max)
}
