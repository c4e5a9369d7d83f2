//! The word of a certificate: accepted, or the first condition that is not met.

use serde::Serialize;

/// Accepted, or the first condition that is not met; spelled as in the JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CertificateStatus {
    /// All conditions are met.
    Accepted,
    /// A joint does not move.
    JointsDoNotMove,
    /// From its own start it comes to rest.
    DoesNotOscillate,
    /// From its own start it moves without a steady period.
    Irregular,
    /// In f32 at 1 ms a state reaches its bound.
    LeavesItsBound,
    /// It moves steadily, but the phases of its joints drift: it has no orbit.
    QuasiPeriodic,
    /// A difference from the orbit does not become smaller fast enough.
    DoesNotContract,
    /// A kick does not come back to the orbit.
    KicksDoNotReturn,
    /// Too few random starts arrive at the orbit.
    FewStartsArrive,
    /// A follower that does not lock from every start.
    DoesNotLock,
    /// A follower whose corrections are at their bound.
    CorrectionsAtBound,
    /// The motion exceeds a limit of the robot, on the orbit or on the way to it.
    BeyondLimits,
    /// In the control loop of the robot it does not walk.
    DoesNotWalk,
}

impl CertificateStatus {
    /// Whether nothing is wrong with the generator itself: what is left are joints that do not move, and the robot.
    #[must_use]
    pub const fn comes_back(self) -> bool {
        matches!(self, Self::Accepted | Self::JointsDoNotMove | Self::BeyondLimits | Self::DoesNotWalk)
    }

    /// A phrase for messages.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::JointsDoNotMove => "joints do not move",
            Self::DoesNotOscillate => "it does not oscillate from its own start",
            Self::Irregular => "its motion has no steady period",
            Self::LeavesItsBound => "in f32 at 1 ms it leaves its bound",
            Self::QuasiPeriodic => "quasi-periodic: the phases of its joints drift",
            Self::DoesNotContract => "differences from its orbit do not become smaller fast enough",
            Self::KicksDoNotReturn => "kicks do not come back to the orbit",
            Self::FewStartsArrive => "too few random starts arrive at the orbit",
            Self::DoesNotLock => "it does not lock on its person from every start",
            Self::CorrectionsAtBound => "its corrections are at their bound",
            Self::BeyondLimits => "its motion exceeds the limits of the robot",
            Self::DoesNotWalk => "it does not walk on the robot",
        }
    }
}

/// A status, and why in words and numbers.
pub type Verdict = (CertificateStatus, Option<String>);
