//! The limits that acted in a tick.

/// Limits that changed setpoints in a tick: a set of bits. A limit is a status, not a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GateStatus(u8);

impl GateStatus {
    /// No limit.
    pub const NONE: Self = Self(0);
    /// The range of a joint.
    pub const RANGE: Self = Self(1 << 0);
    /// An edge of the pose envelope.
    pub const POSE: Self = Self(1 << 1);
    /// The rate limit.
    pub const RATE: Self = Self(1 << 2);
    /// The acceleration limit, which includes the braking distance before a target.
    pub const ACCELERATION: Self = Self(1 << 3);

    /// Bits, for the wire format.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether any limit acted.
    #[must_use]
    pub const fn any(self) -> bool {
        self.0 != 0
    }

    /// Whether all limits of `other` acted.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    pub(super) const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
