//! Whether the joints move faster than a leg can: then the times are not in the unit in which they are read.
//!
//! In recordings of walking, turning and running at up to 5 m/s the fastest joint moves at 178 to 664 degrees a second or faster for a quarter of the time,
//! and at up to 973 in the fastest moment. Minutes or milliseconds that are read as seconds, or seconds as milliseconds, are factors of 60 and more.

use crate::clean::condition_error::ConditionError;
use crate::clean::rules::MOST_DEG_S;
use crate::raw::RawJoints;
use crate::series::quantile;
use crate::stride::period;
use joint_units::Joint;

/// Smallest speed that a joint of a slow gait has for a quarter of the time, degrees a second; the largest of any gait is [`MOST_DEG_S`].
const LEAST_DEG_S: f64 = 20.0;
/// Speeds are those over this time, seconds, or over this share of a shorter recording: from sample to sample they would be noise.
const OVER_S: f64 = 0.02;
const OVER_SHARE: usize = 50;

/// An error if a joint is too fast. `joints` are in degrees at equal steps.
pub(crate) fn check(
    raw: &RawJoints,
    joints: &[Option<Vec<f64>>; Joint::COUNT],
    unusable: &[bool],
    rate_hz: f64,
) -> Result<(), ConditionError> {
    let samples = unusable.len();
    let over = ((OVER_S * rate_hz).round() as usize).min(samples / OVER_SHARE).max(1);
    let duration_s = (samples - 1) as f64 / rate_hz;
    for (joint, x) in Joint::ALL.into_iter().zip(joints) {
        let Some(x) = x else { continue };
        let is_good = |n: &usize| !unusable[*n] && !unusable[n + over];
        let speeds = (0..samples - over).filter(is_good).map(|n| (x[n + over] - x[n]).abs() * rate_hz / over as f64);
        let deg_s = quantile(speeds, 0.75);
        if deg_s > MOST_DEG_S {
            let is_gait = |factor: f64| {
                (LEAST_DEG_S..MOST_DEG_S).contains(&(deg_s / factor)) && factor * duration_s >= period::SHORTEST_S
            };
            let units = [(60.0, "minutes"), (1000.0, "seconds, under a heading of milliseconds"), (3600.0, "hours")];
            let likely =
                units.into_iter().find(|(factor, _)| is_gait(*factor)).map_or("another unit", |(_, unit)| unit);
            return Err(ConditionError::TooFast { file: raw.file.clone(), joint, deg_s, duration_s, likely });
        }
    }
    Ok(())
}
