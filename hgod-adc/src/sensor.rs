//! One sensor channel: converts a code through volts to the filtered angle, with its validity.
//!
//! After a short gap without good samples (at most [`HealthConfig::wire_ms`]) the filter continues; after a longer one it begins again with the
//! first good sample, so that an old angle is not mixed with a new one.

use crate::calibration::{Calibration, OutOfTable};
use crate::code::{Reference, ReferenceConfig, Supply};
use crate::filter::{Filter, FilterConfig, FilterState};
use crate::health::{Health, HealthConfig, HealthState, Validity};
use crate::range::RangeError;
use core::fmt;
use joint_units::{AdcCode, Period, Radians, Volts};

/// Configuration of one sensor channel.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorConfig {
    /// Wiring and reference of the converter's input: codes to volts.
    pub reference: ReferenceConfig,
    /// Calibration table: volts to angle.
    pub calibration: Calibration,
    /// Low-pass filter.
    pub filter: FilterConfig,
    /// Limits of the validity rules.
    pub health: HealthConfig,
}

/// Why a sensor was refused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SensorError {
    /// A parameter is out of its range.
    Range(RangeError),
    /// At a supply within the allowed range, the first or last point of the calibration table reads a code in an end band, where it would count
    /// as a broken wire: shorten the table or change the divider.
    TableInEndBand {
        /// The point, counted from 0: the first or the last of the table.
        index: usize,
        /// The code that it reads.
        code: AdcCode,
        /// Least code that is allowed.
        min: AdcCode,
        /// Greatest code that is allowed.
        max: AdcCode,
    },
}

impl fmt::Display for SensorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range(error) => error.fmt(f),
            Self::TableInEndBand { index, code, min, max } => write!(
                f,
                "points[{index}].volts: reads code {} where only {} to {} differ from a broken wire; \
                 shorten the table or change the divider",
                code.0, min.0, max.0
            ),
        }
    }
}

impl core::error::Error for SensorError {}

impl From<RangeError> for SensorError {
    fn from(error: RangeError) -> Self {
        Self::Range(error)
    }
}

impl SensorConfig {
    /// Checks every part, and that the parts fit together, for a control period.
    ///
    /// # Errors
    /// [`SensorError`] names the field that is out of range, or the point of the table that cannot be distinguished from a broken wire.
    pub fn build(self, period: Period) -> Result<Sensor, SensorError> {
        let reference = self.reference.build()?;
        let filter = self.filter.build(period)?;
        let health = self.health.build(period)?;

        let (least, greatest) = self.calibration.volts_span();
        let (min_supply, max_supply) = reference.supplies();
        let (min, max) = (AdcCode(self.health.low.0.saturating_add(1)), AdcCode(self.health.high.0.saturating_sub(1)));
        let last = self.calibration.points().len().saturating_sub(1);
        for (index, volts, supply) in [(0, least, max_supply), (last, greatest, min_supply)] {
            let code = reference.code(volts, supply);
            if code < min || code > max {
                return Err(SensorError::TableInEndBand { index, code, min, max });
            }
        }
        Ok(Sensor { reference, calibration: self.calibration, filter, health })
    }
}

/// A checked [`SensorConfig`] for a control period. Its state is a [`SensorState`], so one `Sensor` can serve several identical channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    reference: Reference,
    calibration: Calibration,
    filter: Filter,
    health: Health,
}

/// State of a sensor between samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorState {
    filter: FilterState,
    health: HealthState,
    /// The supply of the last sample that had one.
    supply: Option<Supply>,
    good: Option<LastGood>,
    /// Periods since the last good sample.
    since_good: u32,
    /// Place in the calibration table.
    right: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct LastGood {
    /// As measured: the rate is measured from it.
    measured: Radians,
    /// As filtered: the angle of a sample that is not good.
    filtered: Radians,
}

impl SensorState {
    /// Counts control periods without a sample, so that the limit for a jump of the next sample allows for their time.
    pub fn missed(&mut self, periods: u32) {
        self.since_good = self.since_good.saturating_add(periods);
    }
}

/// The result of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading {
    /// The code of the converter.
    pub code: AdcCode,
    /// The volts at the sensor. If the supply has no valid reading, they are computed with the last valid one, or with that of the factory
    /// calibration before the first.
    pub volts: Volts,
    /// The filtered angle; if the validity is not good, that of the last good sample. Before the first good sample it is the angle within the
    /// table nearest to 0.
    pub angle: Radians,
    /// Good if the angle is that of this sample; otherwise the fault.
    pub validity: Validity,
}

impl Sensor {
    /// Converts one sample: the code of the sensor, and the code of the converter's internal reference in the same tick. Call it once a control
    /// period; after periods without a sample call [`SensorState::missed`] first.
    pub fn sample(&self, state: &mut SensorState, code: AdcCode, vrefint: AdcCode) -> Reading {
        state.since_good = state.since_good.saturating_add(1);
        let of_code = self.health.code(&mut state.health, code);
        let supply = self.reference.supply(vrefint).ok();
        state.supply = supply.or(state.supply);
        let volts = self.reference.volts(code, state.supply.unwrap_or(self.reference.supply_at_cal()));

        let seen = if supply.is_none() {
            Err(Validity::SupplyLow)
        } else if of_code != Validity::Good {
            Err(of_code)
        } else {
            self.calibration.angle_near(volts, &mut state.right).map_err(|_| Validity::OutOfTable)
        };
        let jumped = seen.is_ok_and(|angle| self.too_fast(state, angle));
        let of_jump = self.health.jump(&mut state.health, jumped);
        let validity = match seen {
            Err(validity) => validity,
            Ok(_) if jumped => of_jump,
            Ok(angle) => {
                self.accept(state, angle);
                Validity::Good
            }
        };
        let angle = state.good.map_or_else(|| self.resting(), |good| good.filtered);
        Reading { code, volts, angle, validity }
    }

    /// The code that the converter would read at an angle: the inverse of the whole chain without the filter, for simulations.
    ///
    /// # Errors
    /// The angle lies outside the calibration table.
    pub fn code(&self, angle: Radians, supply: Supply) -> Result<AdcCode, OutOfTable> {
        Ok(self.reference.code(self.calibration.volts(angle)?, supply))
    }

    /// The conversion of codes to volts.
    #[must_use]
    pub const fn reference(&self) -> &Reference {
        &self.reference
    }

    /// The conversion of volts to angles.
    #[must_use]
    pub const fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    fn too_fast(&self, state: &SensorState, angle: Radians) -> bool {
        state.good.is_some_and(|good| !self.health.can_turn(good.measured, angle, state.since_good))
    }

    fn accept(&self, state: &mut SensorState, angle: Radians) {
        if state.since_good > self.health.bridge_ticks() {
            state.filter = FilterState::default();
        }
        let filtered = self.filter.step(&mut state.filter, angle);
        state.good = Some(LastGood { measured: angle, filtered });
        state.since_good = 0;
    }

    /// The angle of the table that is nearest to 0.
    fn resting(&self) -> Radians {
        let (low, high) = self.calibration.span();
        Radians(0.0_f32.max(low.0).min(high.0))
    }
}
