//! Gaits that people have, as functions of the cadence: a walk and a run, fitted to recorded persons, with start and stop.
//!
//! | member | cadence, steps a minute | motion |
//! |---|---|---|
//! | `human-walk` | 98.4 to 131 | the walk of six recorded persons |
//! | `human-run` | 154.9 to 175.7 | the run of three, scaled into the limits of the default robot |
//! | `human-run-unscaled` | 154.9 to 175.7 | the run as recorded: for robots whose knees reach 730 degrees/s and may be bent by 158 degrees together |
//!
//! A member is phase and shape ([`crate::waveform::shape`]): six harmonics for the hip and for the knee, the right leg half a stride after the
//! left one. Each coefficient is linear in the cadence, between the lowest and the highest cadence that was recorded. Beyond these there is no
//! recording and [`Member::at_cadence`] refuses: there is no walk at the cadence of a run, and none between 131 and 154.9.
//!
//! The mean angle of a hip is a robust mean over the persons and does not depend on the cadence: laboratories define its zero differently. Phase 0 is where the left hip is most flexed, at the middle of the cadences.
//!
//! [`FamilyGait`] is the family as one generator: it stands, starts, changes its cadence, changes between walk and run, and stops.
//!
//! Sources and licences are in [`sources`]. `cargo run -p reproduce --example gait_family` computes the numbers and the errors on persons that were
//! not fitted.

mod ends;
mod gait;
mod numbers;
pub mod sources;

use joint_units::Phase;

use crate::error::in_range;
use crate::gait::family::ends::Ends;
use crate::gait::fitted::shape;
use crate::waveform::shape::{FourierShape, PhaseShapeConfig};
use crate::{BuildError, Field};

pub use gait::{FamilyGait, FirstLeg, STAND};
pub use sources::{SOURCES, START_AND_STOP, Source};

/// Phase at which a walk starts from a stand with the left leg, half a stride later with the right one: where it fits the recorded start
/// best. One start of one person was recorded.
pub const START: Phase = Phase(numbers::START_COUNTS);

/// Phase at which a walk stops, or half a stride later: where it fits the recorded stop best. One stop of one person was recorded.
pub const STOP: Phase = Phase(numbers::STOP_COUNTS);

/// A member of the family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Member {
    /// The walk.
    Walk,
    /// The run, scaled and shifted joint by joint into the limits of the default robot.
    Run,
    /// The run as recorded.
    RunUnscaled,
}

impl Member {
    /// Every member.
    pub const ALL: [Self; 3] = [Self::Walk, Self::Run, Self::RunUnscaled];

    /// The name as in the table above.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Walk => "human-walk",
            Self::Run => "human-run",
            Self::RunUnscaled => "human-run-unscaled",
        }
    }

    /// Lowest and highest cadence, steps a minute: those of the recordings.
    #[must_use]
    pub const fn cadences(self) -> (f32, f32) {
        let [least, most] = self.ends().cadences;
        (least, most)
    }

    /// The middle of the cadences, steps a minute.
    #[must_use]
    pub const fn middle(self) -> f32 {
        let (least, most) = self.cadences();
        0.5 * (least + most)
    }

    /// Shapes and stride at a cadence in steps a minute, two a stride.
    ///
    /// # Errors
    /// `cadence` outside of [`Member::cadences`], or not finite.
    ///
    /// ```
    /// use cpg_core::Generator;
    /// use cpg_core::gait::family::Member;
    /// use joint_units::Period;
    /// let mut walk = Member::Walk.at_cadence(120.0)?.build(Period::MILLISECOND)?;
    /// let left = walk.angles()[0];
    /// for _ in 0..500 {
    ///     walk.step();
    /// }
    /// // At 120 steps a minute a step takes half a second; then the right leg is where the left one was.
    /// assert!((walk.angles()[1].0 - left.0).abs() < 1e-4);
    /// let refused = Member::Walk.at_cadence(150.0).map(|_| ()).unwrap_err();
    /// assert_eq!(refused.to_string(), "cadence = 150: must be from 98.4 to 131");
    /// # Ok::<(), cpg_core::BuildError>(())
    /// ```
    pub fn at_cadence(self, cadence: f32) -> Result<PhaseShapeConfig<FourierShape<6>, 4>, BuildError> {
        let (least, most) = self.cadences();
        in_range(cadence, Field::of("cadence"), least, most)?;
        let [left_hip, right_hip, left_knee, right_knee] = self.ends().joints((cadence - least) / (most - least));
        let shapes = [shape(&left_hip)?, shape(&right_hip)?, shape(&left_knee)?, shape(&right_knee)?];
        Ok(PhaseShapeConfig { shapes, stride_s: 120.0 / cadence })
    }

    const fn ends(self) -> &'static Ends {
        match self {
            Self::Walk => &numbers::WALK,
            Self::Run => &numbers::RUN,
            Self::RunUnscaled => &numbers::RUN_UNSCALED,
        }
    }
}
