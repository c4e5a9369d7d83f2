//! Time spans of the strides of a recording, the parts that are in no stride, and the errors.

use crate::stride::period::{LONGEST_S, OVERLAP_S, SHORTEST_S, USUAL_S};
use std::fmt;

/// The time span of a stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Start, seconds.
    pub start_s: f64,
    /// End, seconds; the next stride may start there.
    pub end_s: f64,
}

/// Correlations of joints within the strides of a movement that is no gait; medians over the strides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Together {
    /// Left with right hip.
    pub hips: f64,
    /// Left with right knee.
    pub knees: f64,
    /// Hip with knee of the left leg.
    pub left: f64,
    /// Hip with knee of the right leg.
    pub right: f64,
}

/// Why a part of a recording is in no stride.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum WhyLeftOut {
    /// Movement before regular walking.
    StartUp,
    /// Movement after regular walking.
    Stop,
    /// The person stands.
    Standing,
    /// Three or more consecutive strides that differ from the others, or movement between two bouts of walking.
    Turn,
    /// A jump too long to bridge, with its stride.
    Glitch,
    /// A gap too long to bridge, with its stride.
    Gap,
    /// Less than a stride at an end of the recording or between two bouts.
    Partial,
    /// One or two strides that differ from the others.
    Odd,
}

/// A part of a recording that is in no stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Start, seconds.
    pub from_s: f64,
    /// End, seconds.
    pub to_s: f64,
    /// The reason.
    pub why: WhyLeftOut,
}

impl fmt::Display for WhyLeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StartUp => "starting up",
            Self::Stop => "stopping",
            Self::Standing => "standing",
            Self::Turn => "turning, or a different gait",
            Self::Glitch => "a jump too long to bridge",
            Self::Gap => "a gap too long to bridge",
            Self::Partial => "part of a stride",
            Self::Odd => "a stride that differs from the others",
        })
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} s to {:.2} s left out: {}", self.from_s, self.to_s, self.why)
    }
}

/// Why a recording has no strides.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StrideError {
    /// A joint is missing.
    #[error(
        "no {}; allowed is a recording with both hips and both knees: `--map {}` names columns that were not recognised{mirror}", .missing.join(", no "),
        .missing.iter().map(|joint| format!("{joint}=COLUMN")).collect::<Vec<_>>().join(","),
        mirror = if is_one_leg(.missing) { ", and `--mirror` makes the other leg half a stride later" } else { "" }
    )]
    NoJoint {
        /// Their names.
        missing: Vec<&'static str>,
    },
    /// The recording is not periodic.
    #[error(
        "no stride repeats within {duration_s:.2} s; allowed is walking or running of at least one stride of {SHORTEST_S} to {USUAL_S} s and {OVERLAP_S:.1} s more, or two strides of up to {LONGEST_S} s"
    )]
    NoPeriod {
        /// Length of the longest part without a gap, seconds.
        duration_s: f64,
    },
    /// The movement repeats too slowly for a stride.
    #[error(
        "the movement repeats after {period_s:.2} s; allowed are strides of {SHORTEST_S} to {LONGEST_S} s: is it a gait, and are the times in the right unit?"
    )]
    TooSlow {
        /// The period, seconds.
        period_s: f64,
    },
    /// The movement repeats, but it is no gait.
    #[error(
        "no gait: left and right leg move together (correlation {:.2} at the hips, {:.2} at the knees), and hip and knee of each leg too ({:.2} left, {:.2} right), as in squats and jumps; allowed is walking or running, in which the legs are half a stride apart",
        .0.hips, .0.knees, .0.left, .0.right
    )]
    NoGait(Together),
    /// There is a period, but no complete usable stride.
    #[error(
        "no complete usable stride of {period_s:.2} s; allowed is one or more; the parts of the recording: {parts}"
    )]
    NoStride {
        /// The period, seconds.
        period_s: f64,
        /// The parts of the recording, in words.
        parts: String,
    },
}

/// Whether what is missing is hip and knee of one leg.
fn is_one_leg(missing: &[&str]) -> bool {
    ["left", "right"].iter().any(|side| missing.len() == 2 && missing.iter().all(|joint| joint.starts_with(side)))
}

/// The strides of the joints that the recording has.
#[derive(Debug, Clone, PartialEq)]
pub struct Cuts {
    /// The strides, in order.
    pub spans: Vec<Span>,
    /// The rest of the recording, in order.
    pub left_out: Vec<LeftOut>,
}
