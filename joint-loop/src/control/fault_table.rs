//! The reaction to each sensor validity while the joints move, if the sensor is required. [`fault_response`] is this table:
//!
//! | validity | cause | classified | rejected | independent | acts | follower | acts |
//! |---|---|---|---|---|---|---|---|
//! | open | sensor_open | 20 | 1 | park | 49 | freewheel | 21 |
//! | short | sensor_short | 20 | 1 | park | 49 | freewheel | 21 |
//! | saturated | sensor_saturated | 1 | 1 | carry on | 49 | carry on | 21 |
//! | stuck | sensor_stuck | 1000 | 1000 | park | 1048 | freewheel | 1020 |
//! | spike | sensor_spike | 1 | 1 | carry on | 49 | carry on | 21 |
//! | rate | sensor_rate | 5 | 1 | park | 49 | freewheel | 21 |
//! | out_of_table | sensor_out_of_table | 1 | 1 | park | 49 | freewheel | 21 |
//! | supply_low | supply | 1 | 1 | off | 41 | off | 41 |
//!
//! Times are in ms from the last correct sample, with the default configuration at 1 kHz: `n` ms is the n-th wrong sample.
//!
//! - *classified*: from this time the sample has the validity of its row ([`Validity::detection_ms`]). *rejected*: from this
//!   time samples are not good. No rejected sample is used as an angle: the last good angle is kept, and the time counts
//!   against the supervisor's tolerance.
//! - *independent*: a generator that needs no sensor. The supervisor *parks* the joints when a sensor has not been good for
//!   more than [`SENSOR_TOLERANCE_MS`]: [`Motion::Hurry`] to the park pose, outputs off at most [`PARK_MS`] later. A press is
//!   needed to move again. The cause is the worst validity ([`Validity::worse`]) of the last [`SENSOR_TOLERANCE_MS`].
//! - *follower*: a generator whose phase is locked to the sensor. The supervisor *parks* the joints when the sensor has not been good for more than
//!   [`FOLLOWER_LOST_MS`], so that nothing walks by itself when the sensor is good again later, unless the robot's [`crate::FollowerRules`] say so; then
//!   the time of the stand ends the motion. Before that, the follower *freewheels*
//!   after [`FOLLOWER_BRIDGE_MS`] without a good sample: it continues at its last cadence for at most [`FREEWHEEL_MS`], then
//!   stands with the outputs on, and follows again when the sensor is good. It also detects angles that a moving leg cannot
//!   have, and earlier: a sensor that sticks in mid swing after about 0.1 s. A sensor that sticks where the leg hardly moves
//!   looks like a standing leg; the joints then stand without freewheeling first.
//! - *off*: the supply is a condition of the board, watched with and without sensors ([`crate::control::supply`]): after [`SUPPLY_TOLERANCE_MS`]
//!   it is a fault, which switches the outputs off at once. A follower freewheels meanwhile. In a loop without a chip ([`crate::LoopConfig::supply`]
//!   is `None`) it is a condition of the sensor alone, with the cause `sensor_supply_low`, and the reaction is that to an open wire.
//! - *carry on*: the fault ends or gets a worse validity before any reaction. A spike becomes a rate from its 5th ms, a
//!   saturated code an open or shorted wire from its 20th. *acts* is the time at which a reaction would begin.
//! - A *rate* causes a reaction only if the jump remains impossible for that time: a jump of more than 78 degrees, or of more
//!   than 33 for a follower. A smaller jump is accepted before, and the motion continues.
//!
//! At rest there is no tolerance: a press does not arm unless the validity is good, and the cause states why. If no sensor is
//! required ([`crate::MonitorConfig::sensor_required`]), the validity is only reported in the frame.

use crate::control::supervisor::Cause;
#[cfg(doc)]
use crate::control::supervisor::Motion;
use crate::control::supply::SUPPLY_TOLERANCE_MS;
use hgod_adc::Validity;

/// How long a required sensor may be not good while the joints move, in ms: the default of
/// [`crate::MonitorConfig::sensor_tolerance_s`].
pub const SENSOR_TOLERANCE_MS: u16 = 48;

/// Longest time from the first tick of a hurried stop to the first tick with the outputs off, in ms: the ramp of 0.3 s and the
/// delay of the gate.
pub const PARK_MS: u16 = 304;

/// How long the sensor of a follower may be not good while the joints move, in ms: [`crate::MonitorConfig::sensor_tolerance_s`] of its loop.
pub const FOLLOWER_LOST_MS: u16 = 5000;

/// How long a follower bridges missing good samples before it freewheels, in ms: the default of
/// [`cpg_core::entrainment::PlausibilityConfig::bridge_s`].
pub const FOLLOWER_BRIDGE_MS: u16 = 20;

/// How long a follower continues at its last cadence without a sensor, in ms: the default of
/// [`cpg_core::entrainment::FollowerConfig::freewheel_s`].
pub const FREEWHEEL_MS: u16 = 2000;

/// Reaction of a loop to a validity that persists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Response {
    /// The last good angle is kept and the motion continues.
    CarryOn,
    /// The supervisor moves the joints to the park pose by the short ramp and switches the outputs off.
    Park,
    /// The follower continues without its sensor for a limited time, then stands.
    Freewheel,
    /// The supervisor switches the outputs off: a fault.
    Off,
}

impl Response {
    /// Name, as in the table.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::CarryOn => "carry on",
            Self::Park => "park",
            Self::Freewheel => "freewheel",
            Self::Off => "off",
        }
    }
}

/// Reaction to a validity. Times are in ms from the last correct sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultResponse {
    /// Cause in the frame if it stops the joints or prevents arming.
    pub cause: Cause,
    /// Time from which samples have this validity.
    pub classified_ms: u16,
    /// Time of the first sample that is not good.
    pub rejected_ms: u16,
    /// Reaction with a generator that needs no sensor.
    pub independent: Response,
    /// Reaction with a follower.
    pub follower: Response,
}

impl FaultResponse {
    /// Time at which the supervisor stops a generator that needs no sensor, or switches it off, in ms, if the sensor is not good until then.
    ///
    /// ```
    /// use hgod_adc::Validity;
    /// use joint_loop::{Response, Cause, fault_response};
    /// let open = fault_response(Validity::Open).expect("a reaction");
    /// assert_eq!((open.cause, open.independent, open.stops_ms()), (Cause::SensorOpen, Response::Park, 49));
    /// ```
    #[must_use]
    pub const fn stops_ms(&self) -> u16 {
        self.rejected_ms.saturating_add(match self.independent {
            Response::Off => SUPPLY_TOLERANCE_MS,
            _ => SENSOR_TOLERANCE_MS,
        })
    }

    /// Latest time at which a follower begins to freewheel, or is switched off, in ms, if the sensor is not good until then.
    #[must_use]
    pub const fn freewheels_ms(&self) -> u16 {
        self.rejected_ms.saturating_add(match self.follower {
            Response::Off => SUPPLY_TOLERANCE_MS,
            _ => FOLLOWER_BRIDGE_MS,
        })
    }
}

/// Reaction to a validity, as in the table of [`crate::control::fault_table`]; `None` for good.
#[must_use]
pub const fn fault_response(validity: Validity) -> Option<FaultResponse> {
    let cause = match validity {
        Validity::SupplyLow => Cause::Supply,
        _ => Cause::of_sensor(validity),
    };
    let (independent, follower) = match validity {
        Validity::Good => return None,
        Validity::Saturated | Validity::Spike => (Response::CarryOn, Response::CarryOn),
        Validity::SupplyLow => (Response::Off, Response::Off),
        // Open, short, stuck, rate, out of table, and any validity that is added later.
        _ => (Response::Park, Response::Freewheel),
    };
    let classified_ms = validity.detection_ms();
    let rejected_ms = match validity {
        // Before that time a stuck code cannot be distinguished from a constant angle.
        Validity::Stuck => classified_ms,
        _ => 1,
    };
    Some(FaultResponse { cause, classified_ms, rejected_ms, independent, follower })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LoopConfig, MonitorConfig};
    use cpg_core::entrainment::{FollowerConfig, PlausibilityConfig};

    #[test]
    fn the_function_is_the_documented_table() {
        let doc = include_str!("fault_table.rs");
        let rows: Vec<Vec<&str>> = doc
            .lines()
            .filter_map(|line| line.strip_prefix("//! | "))
            .map(|line| line.trim_end_matches('|').split('|').map(str::trim).collect())
            .collect();
        let faults: Vec<_> = Validity::ALL.into_iter().filter(|&validity| validity != Validity::Good).collect();
        assert_eq!(rows.len(), 1 + faults.len(), "a row for each validity");
        for validity in faults {
            let is = fault_response(validity).expect("a reaction");
            let row = rows.iter().find(|row| row[0] == validity.name()).expect("a row of the validity");
            let cells = [
                validity.name().to_string(),
                is.cause.name().to_string(),
                is.classified_ms.to_string(),
                is.rejected_ms.to_string(),
                is.independent.name().to_string(),
                is.stops_ms().to_string(),
                is.follower.name().to_string(),
                is.freewheels_ms().to_string(),
            ];
            assert_eq!(*row, cells);
        }
        assert_eq!(fault_response(Validity::Good), None);
    }

    #[test]
    fn the_constants_are_those_of_the_default_configurations() {
        let seconds = |ms: u16| f32::from(ms) / 1000.0;
        assert_eq!(MonitorConfig::DEFAULT.sensor_tolerance_s, seconds(SENSOR_TOLERANCE_MS));
        assert_eq!(LoopConfig::default_biped().blend.hurry_s, seconds(300));
        assert_eq!(PlausibilityConfig::default().bridge_s, seconds(FOLLOWER_BRIDGE_MS));
        assert_eq!(FollowerConfig::default().freewheel_s, seconds(FREEWHEEL_MS));
    }

    /// A validity without a reaction ends, or changes to a worse one, before the supervisor would act.
    #[test]
    fn a_validity_without_reaction_ends_within_the_tolerance() {
        for validity in Validity::ALL {
            let Some(is) = fault_response(validity) else { continue };
            assert!(is.rejected_ms <= is.classified_ms, "{validity}");
            let worse = match validity {
                Validity::Spike => Validity::Rate,
                Validity::Saturated => Validity::Open,
                _ => continue,
            };
            assert_eq!((is.independent, is.follower), (Response::CarryOn, Response::CarryOn), "{validity}");
            assert_eq!(validity.worse(worse), worse);
            let then = fault_response(worse).expect("a reaction");
            assert!(then.classified_ms < is.stops_ms() && then.classified_ms <= is.freewheels_ms(), "{validity}");
        }
    }
}
