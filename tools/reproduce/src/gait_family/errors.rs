//! Leave-one-out errors: every recording predicted at its own cadence by what the other recordings, or the other persons, give.

use gait_fit::generator_cycle::aligned;
use gait_trace::Cycle;
use gait_trace::stride::cycle::POINTS;
use joint_units::Joint;

use crate::gait_family::model::{Dependence, Model, weights};
use crate::gait_family::recorded::Recorded;

/// Root mean square errors of the joints against a mean stride, after one phase shift of all joints, degrees.
pub type JointErrors = [f64; Joint::COUNT];

/// What is left out of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeftOut {
    /// The recording that is predicted.
    Recording,
    /// All recordings of its person.
    Person,
}

/// The errors of one recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Family without the recording.
    pub family: JointErrors,
    /// Family without the person.
    pub family_person: JointErrors,
    /// Mean of the other recordings.
    pub mean: JointErrors,
    /// Mean of the other persons.
    pub mean_person: JointErrors,
}

impl Prediction {
    /// The four errors in the order of their columns.
    #[must_use]
    pub const fn columns(&self) -> [JointErrors; 4] {
        [self.family, self.mean, self.family_person, self.mean_person]
    }
}

/// The errors of all recordings of a kind. With `level`, the mean of each joint is left out of the comparison.
#[must_use]
pub fn predictions(recordings: &[Recorded], level: bool) -> Vec<Prediction> {
    let one = |index: usize| {
        let error = |left_out, dependence| predicted(recordings, index, left_out, dependence, level);
        Prediction {
            family: error(LeftOut::Recording, Dependence::Linear),
            family_person: error(LeftOut::Person, Dependence::Linear),
            mean: error(LeftOut::Recording, Dependence::None),
            mean_person: error(LeftOut::Person, Dependence::None),
        }
    };
    (0..recordings.len()).map(one).collect()
}

fn predicted(all: &[Recorded], index: usize, left_out: LeftOut, dependence: Dependence, level: bool) -> JointErrors {
    let wanted = &all[index];
    let stays = |(n, other): &(usize, &Recorded)| match left_out {
        LeftOut::Recording => *n != index,
        LeftOut::Person => other.source.person != wanted.source.person,
    };
    let others: Vec<&Recorded> = all.iter().enumerate().filter(stays).map(|(_, other)| other).collect();
    errors(&Model::of(&others, dependence).at(wanted.cadence).cycle(), &wanted.mean, level)
}

/// Errors of a stride against a recorded one after the best phase shift of all joints together.
fn errors(stride: &Cycle, wanted: &Cycle, level: bool) -> JointErrors {
    let levelled = |cycle: &Cycle| {
        Cycle(cycle.0.map(|joint| {
            let mean = if level { joint.iter().sum::<f64>() / POINTS as f64 } else { 0.0 };
            joint.map(|angle| angle - mean)
        }))
    };
    let wanted = levelled(wanted);
    aligned(&levelled(stride), &wanted).0.rmse_deg(&wanted)
}

/// Root mean square of the errors over recordings, persons weighing the same, for each column of [`Prediction::columns`].
#[must_use]
pub fn over_all(recordings: &[Recorded], predictions: &[Prediction]) -> [JointErrors; 4] {
    let weights = weights(&recordings.iter().collect::<Vec<_>>());
    let total: f64 = weights.iter().sum();
    std::array::from_fn(|column| {
        std::array::from_fn(|joint| {
            let squares =
                predictions.iter().zip(&weights).map(|(one, weight)| weight * one.columns()[column][joint].powi(2));
            (squares.sum::<f64>() / total).sqrt()
        })
    })
}
