//! A phase whose arctangent is computed only where it is asked for.

use joint_units::Phase;

use crate::math::trig::angle;

/// The phase of a generator before its arctangent is computed: cheap to take each tick, also where [`PhasePoint::phase`] is seldom asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PhasePoint {
    /// The phase.
    Known(Phase),
    /// The angle of this point is the phase, see [`angle`].
    Of {
        /// First argument of [`angle`].
        y: f32,
        /// Second argument of [`angle`].
        x: f32,
    },
}

impl PhasePoint {
    /// The phase: the bits of [`crate::Generator::phase`] at the time when the point was taken.
    #[must_use]
    pub fn phase(self) -> Phase {
        match self {
            Self::Known(phase) => phase,
            Self::Of { y, x } => angle(y, x),
        }
    }
}
