//! Where strides are in a recording, the parts that are in none, and why there may be no stride at all.

use crate::stride::period::OVERLAP_S;
use std::fmt;

/// A stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// From here.
    pub start_s: f64,
    /// To here, where the next one may start.
    pub end_s: f64,
}

/// Why a part of a recording is in no stride.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum WhyLeftOut {
    /// Moving, but not yet walking.
    StartUp,
    /// Coming to a stop.
    Stop,
    /// Nobody moves.
    Standing,
    /// Three strides on end or more that are unlike the others, or movement between two bouts of walking.
    Turn,
    /// A jump too long to bridge, and the stride it is in.
    Glitch,
    /// A gap too long to bridge, and the stride it is in.
    Gap,
    /// Less than a stride at an end of the recording, or what is left between strides of two bouts.
    Partial,
    /// One stride that is unlike the others, or two.
    Odd,
}

/// A part of the recording that is in no stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// From here.
    pub from_s: f64,
    /// To here.
    pub to_s: f64,
    /// Why.
    pub why: WhyLeftOut,
}

impl fmt::Display for WhyLeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StartUp => "starting up",
            Self::Stop => "stopping",
            Self::Standing => "standing",
            Self::Turn => "turning, or walking otherwise",
            Self::Glitch => "a jump too long to bridge",
            Self::Gap => "a gap too long to bridge",
            Self::Partial => "part of a stride",
            Self::Odd => "a stride unlike the others",
        })
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} s to {:.2} s left out: {}", self.from_s, self.to_s, self.why)
    }
}

/// Why there are no strides.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StrideError {
    /// Joints are missing.
    #[error("no {}; allowed for a cycle are both hips and both knees", .missing.join(", no "))]
    NoJoint {
        /// Their names.
        missing: Vec<&'static str>,
    },
    /// Nothing repeats.
    #[error(
        "nothing in {duration_s:.2} s repeats like a stride; allowed is walking or running of one stride and {:.1} s more",
        OVERLAP_S
    )]
    NoPeriod {
        /// Length of the recording.
        duration_s: f64,
    },
    /// There is a period, but no whole stride of it that can be used.
    #[error("no whole stride of {period_s:.2} s that can be used; the parts of the recording: {parts}")]
    NoStride {
        /// The period.
        period_s: f64,
        /// What the recording consists of, in words.
        parts: String,
    },
}

/// The strides of the joints that there are.
#[derive(Debug, Clone, PartialEq)]
pub struct Cuts {
    /// The strides, in order.
    pub spans: Vec<Span>,
    /// The rest of the recording, in order.
    pub left_out: Vec<LeftOut>,
}
