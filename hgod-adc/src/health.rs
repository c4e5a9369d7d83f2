//! Determines the validity of a sample.
//!
//! | validity | rule | found after |
//! |---|---|---|
//! | supply_low | the supply by the internal reference is below the configured least, above 3.6 V, or has no reading | 1 ms |
//! | open, short | in an end band for [`HealthConfig::wire_ms`]: which of the two, [`Pull`] says | 20 ms |
//! | saturated | the code lies in an end band (outside 2 to 98 % of full scale by default) | 1 ms |
//! | stuck | the code has not left a band (of zero width by default) for [`HealthConfig::stuck_ms`] | 1000 ms |
//! | out_of_table | the volts lie outside the calibration table | 1 ms |
//! | rate | an impossible jump that has lasted for [`HealthConfig::spike_ms`] | 5 ms |
//! | spike | an impossible jump: the angle is further from the last good one than a joint can have turned since | 1 ms |
//!
//! The first rule of this order that holds gives the validity. It is also the order of [`Validity::worse`]: each can cause those
//! below it.
//!
//! *Found after*, [`Validity::detection_ms`], is the time from the last right sample to the one that gets the validity, at the default
//! limits and at 1 kHz: with `n` ms it is the n-th wrong sample. The fault itself lies between the last right sample and the first wrong
//! one, so it is reported no later than that after it occurred. Until a validity with a delay is reported, another one is: an open wire is
//! saturated for 19 ms, a jump that stays is a spike for 4 ms; none of these samples is used as an angle. Only a constant code is good
//! until it is reported as stuck.
//!
//! *Intermittent wires*: the time in an end band counts up, the time out of it counts down, so that a wire that is open for
//! more than half of the time is found too; and a wire that was open is accepted again after as much time as it took to be
//! rejected.
//!
//! *Standing still is not stuck*: a leg at rest still shows the converter's noise, so its code changes. Only a code that does
//! not change at all is stuck. Gait recordings turned into noise-free codes repeat one for 0.2 s at most (seen over
//! 475 s of walking, running and standing). A sensor that is mechanically stuck but noisy looks like a leg at rest here:
//! to detect it one has to know that the leg is walking.
//!
//! *Impossible jumps*: the allowance is `max_rate` times the time since the last good sample, plus `rate_noise`. It grows with
//! time, so a true jump (a strap that slipped) is accepted again as soon as a joint could have made it; no fault is permanent. At the
//! default limits a jump of d degrees is accepted after (d - 3) / 1.5 ms: what is over within 5 ms, as noise from the servos is, was a
//! *spike*; a *rate* is a jump of more than 10 degrees that stayed, or spikes on more than half of the samples. They are counted
//! like intermittent wires.

use crate::range::{RangeError, within};
use core::fmt;
use joint_units::{AdcCode, Period, RadPerSec, Radians};

/// Default of [`HealthConfig::wire_ms`].
pub const WIRE_FAULT_MS: u16 = 20;

/// Largest [`HealthConfig::wire_ms`]: an open or shorted wire is always reported within 50 ms.
pub const WIRE_FAULT_MAX_MS: u16 = 50;

/// Default of [`HealthConfig::stuck_ms`]: less than a walking stride (1.0 to 1.5 s), and five times the longest run of one
/// code in noise-free recordings.
pub const STUCK_MS: u16 = 1000;

/// Default of [`HealthConfig::spike_ms`]: longer than a servo's commutation disturbs a wire, and short enough to report a jump of more than
/// 10 degrees before it is accepted.
pub const SPIKE_MS: u16 = 5;

/// Detection time of a fault that a single sample shows, at 1 kHz.
const AT_ONCE_MS: u16 = 1;

/// Validity of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Validity {
    /// The angle is that of this sample.
    #[default]
    Good = 0,
    /// The sensor's wire is open (or shorted to the rail it is pulled to: the two look alike).
    Open = 1,
    /// The sensor's wire is shorted to the rail that it is not pulled to.
    Short = 2,
    /// The code is at an end of the converter's range, so the volts are at that end or beyond.
    Saturated = 3,
    /// The code has stopped changing.
    Stuck = 4,
    /// The angle jumped farther than a joint can turn, less than [`HealthConfig::spike_ms`] ago.
    Spike = 5,
    /// The angle jumped farther than a joint can turn, and stays there or goes on jumping.
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

    /// The word for it in telemetry and recordings.
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

    /// The validity of that [`Validity::name`].
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|validity| validity.name() == name)
    }

    /// Time from the last right sample to the one that gets this validity, at the default [`HealthConfig`] and 1 kHz, in ms; 0 for good.
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

/// Limits of the rules.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HealthConfig {
    /// Codes up to this one are the low end band; 0 to 1023. Default 81: below 2 % of full scale.
    pub low: AdcCode,
    /// Codes from this one are the high end band; 3072 to 4095. Default 4014: above 98 % of full scale.
    pub high: AdcCode,
    /// Where an open wire reads. Default down.
    pub pull: Pull,
    /// How long a code must be in an end band to be called open or short, in ms; 1 to [`WIRE_FAULT_MAX_MS`].
    pub wire_ms: u16,
    /// How long a code must stay in the stuck band to be called stuck, in ms; 200 to 5000.
    pub stuck_ms: u16,
    /// How far from the first one a code may be to count as unchanged; 0 to 8. Default 0: no noise at all.
    pub stuck_band: u16,
    /// How long an impossible jump is taken for a spike, in ms; 1 to 50. Default 5.
    pub spike_ms: u16,
    /// Fastest that the joint turns; 100 to 10,000 degrees a second (here in radians). Default 1500: the knees of runners and
    /// sprinters turn at up to 720 to 1060 in the recordings that this was set from, artefacts of markers at 1800 to 6200.
    pub max_rate: RadPerSec,
    /// What noise may add between two samples; 0.05 to 30 degrees (here in radians). Default 3: below that a spike is left to
    /// the median filter.
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
    /// Checks every field and turns times into ticks.
    ///
    /// # Errors
    /// The field that is out of range, and the range.
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

/// The whole periods that fit into a time, one at least: a detection is never later than the time that was asked for.
fn ticks(ms: u16, period: Period) -> u16 {
    let micros = u32::from(ms).saturating_mul(1000);
    let whole = micros.checked_div(period.micros()).unwrap_or(1).max(1);
    u16::try_from(whole).unwrap_or(u16::MAX)
}

/// A checked [`HealthConfig`] at a period.
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
    /// Radians that the joint turns in one period at most.
    turn_per_tick: f32,
    rate_noise: f32,
}

/// State of the rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HealthState {
    low: Persistence,
    high: Persistence,
    /// The code that the present run of unchanged codes began with.
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
    /// Validity by the code alone: open, short, saturated, stuck or good. Must be called once a sample, also if the sample has other faults.
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
        // A wire may go from one rail to the other: the end where it is now decides.
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

    /// Whether a joint can have turned from one angle to the other in so many periods.
    #[must_use]
    pub fn can_turn(&self, from: Radians, to: Radians, ticks: u32) -> bool {
        (to.0 - from.0).abs() <= self.turn_per_tick * ticks as f32 + self.rate_noise
    }

    /// Spike or rate if this sample is an impossible jump. Must be called once a sample, also if the sample has other faults.
    pub fn jump(&self, state: &mut HealthState, jumped: bool) -> Validity {
        state.jump.update(jumped, self.spike_ticks);
        match (jumped, state.jump.holds) {
            (false, _) => Validity::Good,
            (true, false) => Validity::Spike,
            (true, true) => Validity::Rate,
        }
    }

    /// The longest gap between good samples, in periods, over which a filter may carry on as if there had been none.
    pub(crate) fn bridge_ticks(&self) -> u32 {
        u32::from(self.wire_ticks)
    }
}
