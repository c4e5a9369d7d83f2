//! The direction in which a file counts the angle of a joint as positive.

/// The positive direction of a hip or a knee in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PositiveDirection {
    /// A bent joint is positive.
    Flexion,
    /// A bent joint is negative.
    Extension,
}

impl PositiveDirection {
    /// Both, in order.
    pub const ALL: [Self; 2] = [Self::Flexion, Self::Extension];

    /// Name of the direction.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flexion => "flexion",
            Self::Extension => "extension",
        }
    }

    /// The other direction.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::Flexion => Self::Extension,
            Self::Extension => Self::Flexion,
        }
    }
}
