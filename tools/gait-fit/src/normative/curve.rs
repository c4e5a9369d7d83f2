//! Mean and standard deviation over persons, over the cycle of a joint.

/// Points of the band; point `k` is at `100 k / POINTS` percent of the cycle.
pub const POINTS: usize = 50;

/// The band of one joint, the same for left and right. Degrees, flexion positive.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Mean over persons.
    pub mean_deg: [f64; POINTS],
    /// Standard deviation over persons.
    pub sd_deg: [f64; POINTS],
    /// Standard deviation over persons of the mean angle of a cycle: much of it is the laboratories' definition of zero.
    pub level_sd_deg: f64,
    /// Mean and standard deviation over persons of the range of motion.
    pub range_deg: (f64, f64),
}
