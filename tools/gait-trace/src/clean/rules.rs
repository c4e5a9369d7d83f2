//! Thresholds of the conditioning, and the choice of the low-pass filter.

use crate::clean::positive_direction::PositiveDirection;

/// Fewest rows of a recording.
pub const FEWEST_ROWS: usize = 16;
/// Largest number of rows with which a time axis from 0 to 100 is taken as percent of a cycle.
pub const MOST_PERCENT_ROWS: usize = 401;
/// Highest cut-off of a low-pass, as a fraction of the rate.
pub const MOST_CUT_OFF: f64 = 0.4;
/// Largest speed that a joint has for a quarter of the time, degrees a second.
pub(crate) const MOST_DEG_S: f64 = 2000.0;

/// Zero-lag low-pass of fourth order (Butterworth, forwards and backwards), for joints computed from unfiltered markers.
///
/// The knee of a person on a treadmill, from unfiltered markers, has 0.9 to 1.0 degrees (root mean square) above the sixth harmonic
/// of a stride; after the customary low-pass it has 0.4 to 0.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LowPass {
    /// No filter.
    Off,
    /// Cut-off in Hz.
    At(f64),
    /// The cut-off that is customary in gait laboratories: [`WALKING_HZ`], or [`RUNNING_HZ`] for strides shorter than
    /// [`RUNNING_STRIDE_S`]. A recording without a stride period is not filtered.
    Customary,
}

/// Customary cut-off for walking, Hz (D. A. Winter, Biomechanics and Motor Control of Human Movement).
pub const WALKING_HZ: f64 = 6.0;
/// Customary cut-off for running, Hz.
pub const RUNNING_HZ: f64 = 12.0;
/// Strides shorter than this, seconds, count as running: 146 steps a minute, between the fastest walking and the slowest running.
pub const RUNNING_STRIDE_S: f64 = 0.82;

/// All thresholds of the conditioning. With the defaults, good recordings of walking, running and sprinting are not changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Longest gap that is bridged, seconds. Bridges over 0.1 s of known knee angles err by 0.2 to 0.5 degrees (root mean square;
    /// 2.8 at most) for three walking persons and by 2 (10 at most) for a running one. The error grows with the fourth power of the length.
    pub longest_bridge_s: f64,
    /// Longest jump that is bridged, seconds, including its two guards: about 20 ms of disturbance. A longer one is seldom a single
    /// event.
    pub longest_jump_s: f64,
    /// Unevenness of time stamps from which it is reported: 95th percentile of the deviation of the steps from their median, as a
    /// fraction of the median. Times with six decimals at 1 kHz give 0.001.
    pub jitter_share: f64,
    /// Smallest second difference over 4 ms that can be a jump, degrees. Sprinting reaches 1.9 at 250 Hz, swapped markers 4 to 60.
    pub jump_bend_deg: f64,
    /// The same as a multiple of the series' own typical second difference. Running at 100 Hz reaches 9, swapped markers 44.
    pub jump_usual_bends: f64,
    /// Time on each side of a jump that is discarded too, seconds: swapped markers drift for 20 ms before they jump.
    pub jump_guard_s: f64,
    /// Smallest lasting offset after which a jump counts as a step, degrees.
    pub step_deg: f64,
    /// The same as a fraction of the joint's range.
    pub step_share: f64,
    /// Longest time after which a step may be reversed by another one, seconds; everything in between then counts as displaced.
    pub longest_excursion_s: f64,
    /// Smallest range of the joint that moves most, degrees. It detects radians: 60 degrees of a knee are 1.05 radians.
    pub least_range_deg: f64,
    /// Largest difference of the two ends of a normalised cycle, degrees; the larger of this and the joint's range times
    /// [`Self::cycle_end_share`] holds.
    pub cycle_end_deg: f64,
    /// The same as a fraction of the joint's range; see [`Self::cycle_end_deg`].
    pub cycle_end_share: f64,
    /// The low-pass filter. A normalised cycle is never filtered.
    pub low_pass: LowPass,
    /// The sign of the knees in the file; by the angles if this is `None`.
    pub knee_sign: Option<PositiveDirection>,
    /// The sign of the hips in the file; if this is `None`, that of the format, else by the shape of the strides.
    pub hip_sign: Option<PositiveDirection>,
    /// The leg that the file does not have is the other one, moved by half a stride.
    pub mirror: bool,
    /// Each leg of a cycle counts from its own contact: the right one is moved by half of the cycle.
    pub own_cycles: bool,
    /// Duration of the stride, seconds, of a file whose time runs from 0 to 1 or to 100; it makes a cycle of such a file whatever its ends.
    pub stride_s: Option<f64>,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            longest_bridge_s: 0.1,
            longest_jump_s: 0.12,
            jitter_share: 0.02,
            jump_bend_deg: 2.5,
            jump_usual_bends: 15.0,
            jump_guard_s: 0.03,
            step_deg: 4.0,
            step_share: 0.08,
            longest_excursion_s: 2.0,
            least_range_deg: 3.0,
            cycle_end_deg: 3.0,
            cycle_end_share: 0.1,
            low_pass: LowPass::Off,
            knee_sign: None,
            hip_sign: None,
            mirror: false,
            own_cycles: false,
            stride_s: None,
        }
    }
}
