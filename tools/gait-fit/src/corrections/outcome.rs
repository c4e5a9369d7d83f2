//! What the learning of corrections ended with: for each joint, and why there are none.

use cpg_core::entrainment::correction::MAX_GAIN;

/// Fewest strides of rows: with fewer, the gains are those of a few strides.
pub const LEAST_STRIDES: f64 = 20.0;

/// What was learned for a joint. Errors are root mean squares of the difference from the recording in degrees, on spans that the gains were not
/// learned from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointOutcome {
    /// The joint was not recorded.
    NotRecorded,
    /// It has a correction.
    Corrected {
        /// Error of the template alone.
        without_deg: f64,
        /// Error with the correction; smaller.
        with_deg: f64,
    },
    /// It has none, because its error would not be smaller.
    NotCloser {
        /// Error of the template alone.
        without_deg: f64,
        /// Error with the best correction.
        with_deg: f64,
    },
    /// It has none, because each ridge leads to a gain beyond [`MAX_GAIN`].
    GainsTooLarge {
        /// Error of the template alone.
        without_deg: f64,
    },
}

impl JointOutcome {
    /// Words for a note, without the joint's name; `None` for a joint that was not recorded.
    #[must_use]
    pub fn in_words(&self) -> Option<String> {
        Some(match self {
            Self::NotRecorded => return None,
            Self::Corrected { without_deg, with_deg } => format!("{with_deg:.2} (without {without_deg:.2})"),
            Self::NotCloser { without_deg, with_deg } => {
                format!("{without_deg:.2} and not corrected: with a correction it would be {with_deg:.2}")
            }
            Self::GainsTooLarge { without_deg } => {
                format!("{without_deg:.2} and not corrected: gains would be beyond {MAX_GAIN}")
            }
        })
    }
}

/// Why there are no corrections.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotLearned {
    /// The follower was not locked for long enough.
    #[error(
        "the follower was locked at full amplitude for {strides:.1} strides, not counting the first 3 s of a lock; allowed is {LEAST_STRIDES} or more"
    )]
    FewStrides {
        /// Strides with rows.
        strides: f64,
    },
    /// The time axis is a cycle.
    #[error("the time axis of the recording is a cycle; allowed is one in seconds")]
    Cycle,
    /// The joints or the follower are not what the regression needs; the text says what.
    #[error("{0}")]
    Unusable(String),
}
