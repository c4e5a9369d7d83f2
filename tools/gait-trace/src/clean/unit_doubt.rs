//! Whether a unit that nothing states, and only the values imply, gives a gait at all: volts around 0 look like radians.
//!
//! The knee that moves more has a range of 26 degrees in a patient's crouch and of 50 or more in the other 35 recordings of walking and
//! running in `tests/shared_traces.rs`; in slow walking it flexes less in swing, to 45 degrees and more (C. Kirtley, M. Whittle, R. Jefferson,
//! J. Biomed. Eng. 7 (1985) 282; M. Schwartz et al., J. Biomech. 41 (2008) 1639). The hip that moves more has 36 degrees and more.

use crate::clean::condition_error::ConditionError;
use crate::format::angle_unit::AngleUnit;
use crate::raw::{RawJoints, UnitSource};
use crate::series::quantile;
use joint_units::Joint;

/// Smallest range of the knee that moves more, degrees.
const LEAST_KNEE_RANGE_DEG: f64 = 25.0;
/// Smallest angle, without its sign, that the knee that bends more reaches if the unit is radians, degrees.
const LEAST_KNEE_DEG: f64 = 30.0;
/// Smallest range of the hip that moves more, degrees.
const LEAST_HIP_RANGE_DEG: f64 = 12.0;

/// An error if the unit is inferred and the joints move too little for a gait. `joints` are in degrees, in the order of [`Joint::ALL`].
pub(crate) fn check(
    raw: &RawJoints,
    joints: &[Option<Vec<f64>>; Joint::COUNT],
    unusable: &[bool],
) -> Result<(), ConditionError> {
    let inferred = raw.joints.iter().flatten().find_map(|joint| match joint.unit {
        UnitSource::Inferred(unit) => Some(unit),
        _ => None,
    });
    let Some(unit) = inferred else { return Ok(()) };
    let most = |of: &[usize], measure: fn(f64, f64) -> f64| {
        let one = |joint: &usize| {
            let x = joints[*joint].as_ref()?;
            let good = || x.iter().zip(unusable).filter(|(_, bad)| !**bad).map(|(x, _)| *x);
            Some(measure(quantile(good(), 0.01), quantile(good(), 0.99)))
        };
        of.iter().filter_map(one).reduce(f64::max)
    };
    let range = |low: f64, high: f64| high - low;
    let reach = |low: f64, high: f64| low.abs().max(high.abs());
    let doubts = [
        (most(&[2, 3], range), LEAST_KNEE_RANGE_DEG, "knees move"),
        (most(&[2, 3], reach).filter(|_| unit == AngleUnit::Radians), LEAST_KNEE_DEG, "knees bend"),
        (most(&[0, 1], range), LEAST_HIP_RANGE_DEG, "hips move"),
    ];
    match doubts.into_iter().find_map(|(found, least, what)| Some((found.filter(|found| *found < least)?, what))) {
        Some((range, what)) => {
            Err(ConditionError::UnitNotStated { file: raw.file.clone(), unit: unit.words(), what, range })
        }
        None => Ok(()),
    }
}
