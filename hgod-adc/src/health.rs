//! Decides the validity of each sample.
//!
//! | validity | rule | found after |
//! |---|---|---|
//! | supply_low | the supply, measured through the internal reference, is below the configured least, above 3.6 V, or has no reading | 1 ms |
//! | open, short | the code is in an end band for [`HealthConfig::wire_ms`]; [`Pull`] decides which of the two it is | 20 ms |
//! | saturated | the code is in an end band (below 2 % or above 98 % of full scale by default) | 1 ms |
//! | stuck | the code stays within a band (of zero width by default) for [`HealthConfig::stuck_ms`] | 1000 ms |
//! | out_of_table | the volts are outside the calibration table | 1 ms |
//! | rate | an impossible jump that lasts for [`HealthConfig::spike_ms`] | 5 ms |
//! | spike | an impossible jump: the angle differs from the last good one by more than a joint can have turned since | 1 ms |
//!
//! The first rule of the table that holds gives the validity; where none holds, the sample is good. [`Validity::worse`] has the same order: a fault can cause those below it, so the
//! upper one is the cause.
//!
//! **Found after** ([`Validity::detection_ms`]) is the time from the last correct sample to the first sample with this validity, at the default
//! limits and 1 kHz; `n` ms is the n-th wrong sample. The fault occurs between the last correct and the first wrong sample, so it is reported
//! within this time of its occurrence. Before open, short and rate are reported, the samples have another validity that is not good: a
//! sample of an open wire is saturated for 19 ms, and one of a jump that stays is a spike for 4 ms. None of them is used as an angle. Only
//! samples of a constant code are good until they are stuck.
//!
//! **Intermittent wires.** A counter rises with every sample in an end band and falls with every other one. So a wire that is open for more than
//! half of the time is found too, and a repaired wire is accepted after as much time as its rejection took.
//!
//! **A standing leg is not stuck.** The code of a leg at rest changes by the converter's noise; only a code that does not change at all is stuck.
//! In recorded gait that was converted to codes without noise, the same code repeats for at most 0.2 s (475 s of walking, running and standing).
//! A sensor that is stuck mechanically, with noise on its code, cannot be distinguished from a standing leg here; a follower can
//! (`cpg_core::entrainment`), because it predicts the motion.
//!
//! **Impossible jumps.** The allowed change is `max_rate` times the time since the last good sample, plus `rate_noise`. It grows with time, so a
//! jump that stays (a strap that slipped) is accepted as soon as a joint could have made it; no fault is permanent. At the default limits a
//! jump of d degrees is accepted after (d - 3) / 1.5 ms. So an interference of less than 5 ms, as from servos, is a *spike*; a jump of more than
//! 10 degrees that stays, or spikes in more than half of the samples, become a *rate*. The counter works as for intermittent wires.

use crate::range::{RangeError, within};
use core::fmt;
use joint_units::{AdcCode, Period, RadPerSec, Radians};

/// Default of [`HealthConfig::wire_ms`].
pub const WIRE_FAULT_MS: u16 = 20;

/// Largest [`HealthConfig::wire_ms`]: an open or shorted wire is always reported within 50 ms.
pub const WIRE_FAULT_MAX_MS: u16 = 50;

/// Default of [`HealthConfig::stuck_ms`]: less than a walking stride (1.0 to 1.5 s), and five times the longest run of one code in recorded
/// gait without noise.
pub const STUCK_MS: u16 = 1000;

/// Default of [`HealthConfig::spike_ms`]: longer than a servo's switching disturbs a wire, and short enough to report a jump of more than 10
/// degrees before it is accepted.
pub const SPIKE_MS: u16 = 5;

/// Detection time of a fault that a single sample shows, at 1 kHz.
const AT_ONCE_MS: u16 = 1;

/// Validity of a sample: good, or the fault that was found. The number is that of recordings and telemetry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Validity {
    /// No fault: the angle is that of this sample.
    #[default]
    Good = 0,
    /// The sensor's wire is open, or shorted to the rail to which it is pulled: the two cannot be distinguished.
    Open = 1,
    /// The sensor's wire is shorted to the rail to which it is not pulled.
    Short = 2,
    /// The code is in an end band of the converter's range, not yet for long enough to be open or short.
    Saturated = 3,
    /// The code no longer changes.
    Stuck = 4,
    /// The angle jumped further than a joint can turn, less than [`HealthConfig::spike_ms`] ago.
    Spike = 5,
    /// The angle jumped further than a joint can turn, and stays there or continues to jump.
    Rate = 6,
    /// The volts lie outside the calibration table.
    OutOfTable = 7,
    /// The converter's supply is too low, or its reading is implausible: the volts are unknown.
    SupplyLow = 8,
}

impl Validity {
    /// Every validity, in order of its number.
    pub const ALL: [Validity; 9] = [
        Validity::Good,
        Validity::Open,
        Validity::Short,
        Validity::Saturated,
        Validity::Stuck,
        Validity::Spike,
        Validity::Rate,
        Validity::OutOfTable,
        Validity::SupplyLow,
    ];

    /// Name in telemetry and recordings: `good`, `open`, `short`, `saturated`, `stuck`, `spike`, `rate`, `out_of_table`, `supply_low`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Open => "open",
            Self::Short => "short",
            Self::Saturated => "saturated",
            Self::Stuck => "stuck",
            Self::Spike => "spike",
            Self::Rate => "rate",
            Self::OutOfTable => "out_of_table",
            Self::SupplyLow => "supply_low",
        }
    }

    /// The validity with this [`Validity::name`]; `None` for another text.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|validity| validity.name() == name)
    }

    /// Time from the last correct sample to the first one with this validity, at the default [`HealthConfig`] and 1 kHz, in ms; 0 for good.
    ///
    /// ```
    /// use hgod_adc::Validity;
    /// let found = Validity::ALL.map(|validity| (validity.name(), validity.detection_ms()));
    /// assert_eq!(found[1..], [
    ///     ("open", 20),
    ///     ("short", 20),
    ///     ("saturated", 1),
    ///     ("stuck", 1000),
    ///     ("spike", 1),
    ///     ("rate", 5),
    ///     ("out_of_table", 1),
    ///     ("supply_low", 1),
    /// ]);
    /// ```
    #[must_use]
    pub const fn detection_ms(self) -> u16 {
        match self {
            Self::Good => 0,
            Self::Open | Self::Short => WIRE_FAULT_MS,
            Self::Stuck => STUCK_MS,
            Self::Rate => SPIKE_MS,
            Self::Saturated | Self::Spike | Self::OutOfTable | Self::SupplyLow => AT_ONCE_MS,
        }
    }

    /// The worse of two: of several sensors, or of several samples. The order is that of the module's table.
    ///
    /// ```
    /// use hgod_adc::Validity;
    /// assert_eq!(Validity::Saturated.worse(Validity::Open), Validity::Open);
    /// assert_eq!(Validity::Good.worse(Validity::Spike), Validity::Spike);
    /// ```
    #[must_use]
    pub const fn worse(self, other: Self) -> Self {
        if other.severity() > self.severity() { other } else { self }
    }

    const fn severity(self) -> u8 {
        match self {
            Self::Good => 0,
            Self::Spike => 1,
            Self::Rate => 2,
            Self::OutOfTable => 3,
            Self::Stuck => 4,
            Self::Saturated => 5,
            Self::Short => 6,
            Self::Open => 7,
            Self::SupplyLow => 8,
        }
    }
}

impl fmt::Display for Validity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The rail that a resistor at the converter's input pulls to, so that an open wire has a definite code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pull {
    /// To ground: an open wire reads in the low band.
    #[default]
    Down,
    /// To the supply: an open wire reads in the high band.
    Up,
}

/// Limits of the rules of validity.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HealthConfig {
    /// Greatest code of the low end band; 0 to 1023, default 81 (2 % of full scale).
    pub low: AdcCode,
    /// Least code of the high end band; 3072 to 4095, default 4014 (98 % of full scale).
    pub high: AdcCode,
    /// Direction of the pull resistor, which decides in which band an open wire reads; default [`Pull::Down`].
    pub pull: Pull,
    /// Time in an end band after which a sample is open or short, in ms; 1 to [`WIRE_FAULT_MAX_MS`], default [`WIRE_FAULT_MS`].
    pub wire_ms: u16,
    /// Time without change after which a sample is stuck, in ms; 200 to 5000, default [`STUCK_MS`].
    pub stuck_ms: u16,
    /// Largest distance of a code from the first one of a run at which it counts as unchanged; 0 to 8 codes, default 0: no noise at all.
    pub stuck_band: u16,
    /// Time for which an impossible jump is a spike before it is a rate, in ms; 1 to 50, default [`SPIKE_MS`].
    pub spike_ms: u16,
    /// Highest rate of the joint, in rad/s; 100 to 10 000 degrees/s, default 1500 degrees/s. In the recordings from which it was chosen the knees
    /// of runners and sprinters reach 720 to 1060 degrees/s, and artefacts of markers 1800 to 6200 degrees/s.
    pub max_rate: RadPerSec,
    /// Largest change between two samples by noise, in rad; 0.05 to 30 degrees, default 3 degrees. Smaller spikes are removed by the median
    /// filter.
    pub rate_noise: Radians,
}

impl Default for HealthConfig {
    fn default() -> Self {
        Self {
            low: AdcCode(81),
            high: AdcCode(4014),
            pull: Pull::Down,
            wire_ms: WIRE_FAULT_MS,
            stuck_ms: STUCK_MS,
            stuck_band: 0,
            spike_ms: SPIKE_MS,
            max_rate: RadPerSec(Radians::from_degrees(1500.0).0),
            rate_noise: Radians::from_degrees(3.0),
        }
    }
}

impl HealthConfig {
    /// Checks every field and converts times to ticks of the control period.
    ///
    /// # Errors
    /// [`RangeError`] names the field that is out of range, and the range.
    pub fn build(&self, period: Period) -> Result<Health, RangeError> {
        let whole = |field, value: u16, min, max| within(field, f32::from(value), min, max);
        whole("health.low", self.low.0, 0.0, 1023.0)?;
        whole("health.high", self.high.0, 3072.0, f32::from(AdcCode::MAX.0))?;
        whole("health.wire_ms", self.wire_ms, 1.0, f32::from(WIRE_FAULT_MAX_MS))?;
        whole("health.stuck_ms", self.stuck_ms, 200.0, 5000.0)?;
        whole("health.stuck_band", self.stuck_band, 0.0, 8.0)?;
        whole("health.spike_ms", self.spike_ms, 1.0, 50.0)?;
        let rad = |degrees| Radians::from_degrees(degrees).0;
        let max_rate = within("health.max_rate", self.max_rate.0, rad(100.0), rad(10_000.0))?;
        let rate_noise = within("health.rate_noise", self.rate_noise.0, rad(0.05), rad(30.0))?;
        Ok(Health {
            low: self.low,
            high: self.high,
            pull: self.pull,
            wire_ticks: ticks(self.wire_ms, period),
            stuck_ticks: ticks(self.stuck_ms, period),
            stuck_band: self.stuck_band,
            spike_ticks: ticks(self.spike_ms, period),
            turn_per_tick: max_rate * period.seconds(),
            rate_noise,
        })
    }
}

/// Number of whole periods in a time, at least 1: rounded down, so that a detection is never later than configured.
fn ticks(ms: u16, period: Period) -> u16 {
    let micros = u32::from(ms).saturating_mul(1000);
    let whole = micros.checked_div(period.micros()).unwrap_or(1).max(1);
    u16::try_from(whole).unwrap_or(u16::MAX)
}

/// A checked [`HealthConfig`] for a control period. [`crate::Sensor`] calls its methods in the right order; use it alone only for a chain of
/// your own.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Health {
    low: AdcCode,
    high: AdcCode,
    pull: Pull,
    wire_ticks: u16,
    stuck_ticks: u16,
    stuck_band: u16,
    spike_ticks: u16,
    /// Largest turn of the joint in one period, rad.
    turn_per_tick: f32,
    rate_noise: f32,
}

/// State of the rules between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HealthState {
    low: Persistence,
    high: Persistence,
    /// First code of the present run of unchanged codes.
    anchor: AdcCode,
    /// Length of that run in samples.
    run: u16,
    jump: Persistence,
}

/// A condition that is reported after it has held for a time, and cleared after it has been absent for the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Persistence {
    count: u16,
    holds: bool,
}

impl Persistence {
    fn update(&mut self, present: bool, limit: u16) {
        self.count = if present { self.count.saturating_add(1).min(limit) } else { self.count.saturating_sub(1) };
        self.holds = self.count >= limit || (self.holds && self.count > 0);
    }
}

impl Health {
    /// Validity by the code only: open, short, saturated, stuck or good. Call it once a sample, also if the sample has other faults.
    pub fn code(&self, state: &mut HealthState, code: AdcCode) -> Validity {
        let (low, high) = (code <= self.low, code >= self.high);
        state.low.update(low, self.wire_ticks);
        state.high.update(high, self.wire_ticks);
        if state.run == 0 || code.0.abs_diff(state.anchor.0) > self.stuck_band {
            state.anchor = code;
            state.run = 0;
        }
        state.run = state.run.saturating_add(1);

        let (at_low, at_high) = match self.pull {
            Pull::Down => (Validity::Open, Validity::Short),
            Pull::Up => (Validity::Short, Validity::Open),
        };
        // A wire may change from one rail to the other: the present end decides.
        if state.low.holds && !high {
            at_low
        } else if state.high.holds && !low {
            at_high
        } else if low || high {
            Validity::Saturated
        } else if state.run > self.stuck_ticks {
            Validity::Stuck
        } else {
            Validity::Good
        }
    }

    /// Whether a joint can turn from one angle to the other in `ticks` periods.
    #[must_use]
    pub fn can_turn(&self, from: Radians, to: Radians, ticks: u32) -> bool {
        (to.0 - from.0).abs() <= self.turn_per_tick * ticks as f32 + self.rate_noise
    }

    /// Spike or rate if this sample is an impossible jump, else good. Call it once a sample, also if the sample has other faults.
    pub fn jump(&self, state: &mut HealthState, jumped: bool) -> Validity {
        state.jump.update(jumped, self.spike_ticks);
        if !jumped {
            return Validity::Good;
        }
        if state.jump.holds { Validity::Rate } else { Validity::Spike }
    }

    /// Longest gap between good samples, in periods, after which the filter continues instead of beginning again.
    pub(crate) fn bridge_ticks(&self) -> u32 {
        u32::from(self.wire_ticks)
    }
}
