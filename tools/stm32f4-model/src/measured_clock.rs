//! The clocks that timers can measure by captures (RM0090 7.2.11).

/// A clock that a timer can measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measured {
    /// LSI, by channel 4 of TIM5.
    Lsi,
    /// HSE after the prescaler RTCPRE, by channel 1 of TIM11.
    HseRtc,
}

/// The clocks, each with the timer that measures it.
pub(crate) const MEASURED: [(Measured, usize); 2] = [(Measured::Lsi, 5), (Measured::HseRtc, 11)];

/// The next capture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Capture {
    /// Periods of the measured clock until then.
    pub(crate) periods: f64,
    /// Its cycle.
    pub(crate) at: u64,
}
