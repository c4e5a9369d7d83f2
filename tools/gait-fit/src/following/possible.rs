//! The error that is possible, and whether a follower's is near it: of its templates with a perfect phase, and from the past of its sensor.
//!
//! The **causal bound** of a joint is the error with which a regression estimates it from the past of the sensor ([`crate::causal`]): an
//! error that is reached by an estimator which is fitted to other strides of the same recording, so an upper estimate of the smallest one. It
//! is 0 for the joint with the sensor, which shows it. In a recording of fewer than [`crate::causal::LEAST_STRIDES`] strides it is not known.

use crate::causal::{Past, RATE_HZ, causal_errors};
use gait_trace::Recording;
use joint_units::Joint;

use super::run::{Following, Holes, within};

/// Multiple of a possible error that counts as reached.
pub const ALLOWED: f64 = 1.10;

/// How the error of one joint compares with what is possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// At most [`ALLOWED`] times that of the templates with a perfect phase.
    WithinPerfectPhase,
    /// Above that, and at most [`ALLOWED`] times the causal bound.
    WithinCausalBound,
    /// Above both.
    Above,
    /// Above that with a perfect phase; the causal bound is not known.
    NotKnown,
}

impl Comparison {
    /// Name in text and JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::WithinPerfectPhase => "within_perfect_phase",
            Self::WithinCausalBound => "within_causal_bound",
            Self::Above => "above",
            Self::NotKnown => "not_known",
        }
    }

    /// Of an error, that with a perfect phase, and the causal bound.
    #[must_use]
    pub fn of(rmse: f64, perfect_phase: f64, causal_bound: Option<f64>) -> Self {
        match causal_bound {
            _ if rmse <= ALLOWED * perfect_phase => Self::WithinPerfectPhase,
            Some(bound) if rmse <= ALLOWED * bound => Self::WithinCausalBound,
            Some(_) => Self::Above,
            None => Self::NotKnown,
        }
    }
}

/// What is possible, and the verdict on each joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Possible {
    /// Causal bound of each joint, root mean square over the steady part, degrees; `None` for joints that were not recorded, without a steady
    /// part, and where it is not known.
    pub causal_bound_deg: [Option<f64>; Joint::COUNT],
    /// The verdicts; `None` for joints without an error.
    pub verdicts: [Option<Comparison>; Joint::COUNT],
}

impl Possible {
    /// Compares the errors of a follower with what is possible in the recording.
    #[must_use]
    pub fn of(recording: &Recording, sensor: Joint, holes: &Holes, stride_s: f64, following: &Following) -> Self {
        let causal_bound_deg = causal_bounds(recording, sensor, holes, stride_s, following);
        let verdicts = Joint::ALL.map(|joint| {
            let joint = joint as usize;
            let (rmse, perfect) = (following.steady_rmse_deg[joint]?, following.perfect_phase_rmse_deg[joint]?);
            Some(Comparison::of(rmse, perfect, causal_bound_deg[joint]))
        });
        Self { causal_bound_deg, verdicts }
    }

    /// A sentence for each joint that is above both.
    #[must_use]
    pub fn above(&self, following: &Following) -> Vec<String> {
        let above = Joint::ALL.into_iter().filter(|&joint| self.verdicts[joint as usize] == Some(Comparison::Above));
        let sentence = |joint: Joint| {
            let rmse = following.steady_rmse_deg[joint as usize]?;
            let perfect = following.perfect_phase_rmse_deg[joint as usize]?;
            let bound = self.causal_bound_deg[joint as usize]?;
            let name = joint.name();
            Some(format!(
                "{name}: error of {rmse:.2} degrees; with a perfect phase it is {perfect:.2}, the causal bound is {bound:.2}; allowed is {ALLOWED:.2} \
                 times the larger one"
            ))
        };
        above.filter_map(sentence).collect()
    }
}

fn causal_bounds(
    recording: &Recording,
    sensor: Joint,
    holes: &Holes,
    stride_s: f64,
    following: &Following,
) -> [Option<f64>; Joint::COUNT] {
    let mut bounds = [None; Joint::COUNT];
    let (Some((from, to)), Ok(even)) = (following.steady_s, recording.resample(RATE_HZ)) else { return bounds };
    let Ok(measured) = even.of_joint(sensor) else { return bounds };
    bounds[sensor as usize] = Some(0.0);
    let known: Vec<bool> = (0..measured.values().len()).map(|row| !within(&holes.any, row as f64 / RATE_HZ)).collect();
    let others: Vec<Joint> = Joint::ALL.into_iter().filter(|joint| *joint != sensor).collect();
    let others: Vec<(Joint, &[f64])> =
        others.into_iter().filter_map(|joint| Some((joint, even.channel(joint.name()).ok()?.values()))).collect();
    let series: Vec<&[f64]> = others.iter().map(|(_, values)| *values).collect();
    let past = Past { sensor: measured.values(), known: &known, stride_s };
    let judged = (from * RATE_HZ) as usize..(to * RATE_HZ) as usize;
    for ((joint, _), bound) in others.iter().zip(causal_errors(&past, &series, judged).unwrap_or_default()) {
        bounds[*joint as usize] = Some(bound);
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_within_either_or_above_both() {
        for (rmse, perfect, bound, verdict) in [
            (1.09, 1.0, None, Comparison::WithinPerfectPhase),
            (1.09, 1.0, Some(0.5), Comparison::WithinPerfectPhase),
            (1.11, 1.0, Some(1.02), Comparison::WithinCausalBound),
            (1.11, 1.0, Some(1.0), Comparison::Above),
            (1.11, 1.0, Some(0.0), Comparison::Above),
            (1.11, 1.0, None, Comparison::NotKnown),
            (0.0, 0.0, None, Comparison::WithinPerfectPhase),
        ] {
            assert_eq!(Comparison::of(rmse, perfect, bound), verdict, "{rmse} {perfect} {bound:?}");
        }
    }
}
