//! The thresholds of the conditioning, and the low-pass filter that may be asked for.

/// Fewest rows that are looked at.
pub const FEWEST_ROWS: usize = 16;
/// Most rows that a time axis from 0 to 100 may have to be taken for percent of a cycle.
pub const MOST_PERCENT_ROWS: usize = 401;
/// Highest cut-off of a low-pass, as a share of the rate.
pub const MOST_CUT_OFF: f64 = 0.4;

/// A low-pass of fourth order without lag (Butterworth, forwards and backwards), for joints computed from unfiltered markers.
///
/// A treadmill walker's knee from unfiltered markers has 0.9 to 1.0 degrees (root mean square) above the sixth harmonic of a
/// stride; after the customary low-pass it has 0.4 to 0.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LowPass {
    /// All frequencies stay.
    Off,
    /// At this cut-off, Hz.
    At(f64),
    /// At the cut-off that is customary in gait laboratories: [`WALKING_HZ`], or [`RUNNING_HZ`] for strides shorter than
    /// [`RUNNING_STRIDE_S`]. Where nothing repeats nothing is taken out.
    Customary,
}

/// Customary cut-off for walking (D. A. Winter, Biomechanics and Motor Control of Human Movement).
pub const WALKING_HZ: f64 = 6.0;
/// Customary cut-off for running.
pub const RUNNING_HZ: f64 = 12.0;
/// Strides shorter than this are running: 146 steps a minute, between the fastest walkers and the slowest runners.
pub const RUNNING_STRIDE_S: f64 = 0.82;

/// Every threshold of the conditioning. The defaults leave sound recordings of walking, running and sprinting as they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Longest gap that is bridged, seconds. Bridges over 0.1 s of knees that were known are off by 0.2 to 0.5 degrees (root
    /// mean square; 2.8 at most) for three walkers, by 2 (10 at most) for a runner. Twice the length, sixteen times the error.
    pub longest_bridge_s: f64,
    /// Longest jump that is bridged, seconds, with its two guards: about 20 ms of disturbance.
    /// What lasts longer is seldom one event.
    pub longest_jump_s: f64,
    /// Unevenness of stamps that is worth saying: 95th percentile of the steps' distance from their median, as a share of it.
    /// Six decimals at 1 kHz give 0.001.
    pub jitter_share: f64,
    /// Least bend within 4 ms that can be a jump, degrees. Sprinters reach 1.9 at 250 Hz, swapped markers 4 to 60.
    pub jump_bend_deg: f64,
    /// The same as a multiple of the series' own usual bend. Running at 100 Hz reaches 9, swapped markers 44.
    pub jump_usual_bends: f64,
    /// How much on each side of a jump is not believed either, seconds: swapped markers drift for 20 ms before they snap.
    pub jump_guard_s: f64,
    /// Least offset that a jump must leave behind to be a step, degrees.
    pub step_deg: f64,
    /// The same as a share of the joint's range.
    pub step_share: f64,
    /// Longest time after which a step may be undone by another one, so that all in between counts as displaced, seconds.
    pub longest_excursion_s: f64,
    /// Least range of the most moving joint, degrees. A radian is 57 degrees: a knee's 60 degrees are 1.05.
    pub least_range_deg: f64,
    /// Largest share of a joint's time that may be unusable.
    pub most_unusable: f64,
    /// How far ends of a normalised cycle may be apart, degrees, or the joint's range times [`Self::cycle_end_share`].
    pub cycle_end_deg: f64,
    /// See [`Self::cycle_end_deg`].
    pub cycle_end_share: f64,
    /// Whether high frequencies are taken out. A normalised cycle is left alone.
    pub low_pass: LowPass,
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
            most_unusable: 0.5,
            cycle_end_deg: 3.0,
            cycle_end_share: 0.1,
            low_pass: LowPass::Off,
        }
    }
}
