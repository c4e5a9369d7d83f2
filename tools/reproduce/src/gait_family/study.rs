//! The whole study: walk and run fitted and judged, the run inside the limits, start and stop.

use std::path::Path;

use cpg_core::gait::family::Member;

use crate::gait_family::errors::{Prediction, predictions};
use crate::gait_family::leg::Leg;
use crate::gait_family::limits::{Inside, inside};
use crate::gait_family::model::{Dependence, Model};
use crate::gait_family::recorded::{Recorded, recorded};
use crate::gait_family::start::{Change, start_and_stop};

/// A member that was fitted.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Its recordings, the slowest first.
    pub recordings: Vec<Recorded>,
    /// Lowest and highest cadence, rounded into the recorded range, steps a minute.
    pub cadences: [f64; 2],
    /// The legs at these.
    pub ends: [Leg; 2],
    /// Phase 0 on a leg whose phase is that of [`Leg::of`], in cycles: where the hip is most flexed at the middle of the cadences.
    pub origin: f64,
    /// The errors on what was not fitted.
    pub predictions: Vec<Prediction>,
    /// The same without the mean of each joint.
    pub without_means: Vec<Prediction>,
}

/// The study.
#[derive(Debug, Clone)]
pub struct Study {
    /// The walk.
    pub walk: Fitted,
    /// The run as recorded.
    pub run: Fitted,
    /// The run inside the limits of the default robot, at both ends.
    pub inside: [Inside; 2],
    /// The recorded start and stop.
    pub changes: [Change; 2],
}

/// Does the whole study.
///
/// # Errors
/// A recording is missing or cannot be used; the text names it.
pub fn study(folder: &Path) -> Result<Study, String> {
    let walk = fitted(folder, Member::Walk)?;
    let run = fitted(folder, Member::RunUnscaled)?;
    let [slow, fast] = &run.ends;
    let inside = [inside(slow, run.cadences[0])?, inside(fast, run.cadences[1])?];
    let changes = start_and_stop(folder, walk.origin)?;
    Ok(Study { walk, run, inside, changes })
}

fn fitted(folder: &Path, member: Member) -> Result<Fitted, String> {
    let recordings = recorded(folder, member)?;
    let (Some(slowest), Some(fastest)) = (recordings.first(), recordings.last()) else {
        return Err("no recordings".into());
    };
    let cadences = [(slowest.cadence * 10.0).ceil() / 10.0, (fastest.cadence * 10.0).floor() / 10.0];
    let model = Model::of(&recordings.iter().collect::<Vec<_>>(), Dependence::Linear);
    let origin = model.at(f64::midpoint(cadences[0], cadences[1])).hip.peak();
    let ends = cadences.map(|cadence| model.at(cadence).from_phase(origin));
    let predictions = [false, true].map(|level| predictions(&recordings, level));
    let [predictions, without_means] = predictions;
    Ok(Fitted { cadences, ends, origin, predictions, without_means, recordings })
}
