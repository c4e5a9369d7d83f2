//! What follows from each verdict on a gait sensor that must be good, while the joints move. [`fault_response`] is the table:
//!
//! | verdict | cause | said | doubted | own rhythm | acts | follower | acts |
//! |---|---|---|---|---|---|---|---|
//! | open | sensor_open | 20 | 1 | park | 51 | freewheel | 21 |
//! | short | sensor_short | 20 | 1 | park | 51 | freewheel | 21 |
//! | saturated | sensor_saturated | 1 | 1 | carry on | 51 | carry on | 21 |
//! | stuck | sensor_stuck | 1000 | 1000 | park | 1050 | freewheel | 1020 |
//! | spike | sensor_spike | 1 | 1 | carry on | 51 | carry on | 21 |
//! | rate | sensor_rate | 5 | 1 | park | 51 | freewheel | 21 |
//! | out_of_table | sensor_out_of_table | 1 | 1 | park | 51 | freewheel | 21 |
//! | supply_low | sensor_supply_low | 1 | 1 | park | 51 | freewheel | 21 |
//!
//! All times are in ms from the last right sample, at the default configuration and 1 kHz: with `n` ms it is the n-th wrong
//! sample.
//!
//! - *said*: the verdict has its name ([`Validity::detection_ms`]). *doubted*: the first verdict that is not good; from there on
//!   no sample is taken for an angle, the last good angle is kept, and the tolerance of the supervisor is being used up.
//! - *own rhythm*: a walker that needs no sensor for its steps. It *parks* when a sensor has not been good for longer than
//!   [`SENSOR_TOLERANCE_MS`]: [`Motion::Hurry`] to the park pose, outputs off at most [`PARK_MS`] later, and a press is needed to
//!   move again. The cause names the verdict: the most severe ([`Validity::worse`]) of the last [`SENSOR_TOLERANCE_MS`].
//! - *follower*: a walker that the sensor leads. The supervisor leaves it to the follower, which *freewheels* after
//!   [`FOLLOWER_BRIDGE_MS`] without a good sample: it goes on in its last cadence for [`FREEWHEEL_MS`] at most, then comes to a
//!   stand with the outputs on, and follows again when the sensor is back. What a moving leg does not do it notices by itself
//!   too, and sooner: a sensor that sticks in mid swing after some 0.1 s. One that sticks where the leg hardly moves looks like a
//!   leg that stands, and then the joints stand without freewheeling first.
//! - *carry on*: the verdict ends or gets a graver name before anything acts. A spike is a rate from its 5th ms on, a saturated
//!   code an open or shorted wire from its 20th. *acts* is then the time from which something would.
//! - A *rate* acts only where the jump stays impossible for so long: one of more than 78 degrees, or of more than 33 for a
//!   follower. A smaller one is believed before, and the joints go on.
//!
//! At rest there is no tolerance: with any verdict but good a press does not arm, and the cause says why. Where no sensor is
//! required ([`crate::MonitorConfig::sensor_required`]) nothing follows from a verdict but its place in the frame.

use crate::control::supervisor::Cause;
#[cfg(doc)]
use crate::control::supervisor::Motion;
use hgod_adc::Validity;

/// How long a required sensor may be not good while the joints move: [`crate::MonitorConfig::sensor_tolerance_s`] of the default, in ms.
pub const SENSOR_TOLERANCE_MS: u16 = 50;

/// Longest time from the tick in which a stop in a hurry begins to the first one with the outputs off: the ramp of 0.3 s and what the gate
/// is behind it.
pub const PARK_MS: u16 = 304;

/// How long a follower goes on as if nothing was when no good sample comes: `gate.bridge_s` of its default, in ms.
pub const FOLLOWER_BRIDGE_MS: u16 = 20;

/// How long a follower goes on in its last cadence without a sensor: `freewheel_s` of its default, in ms.
pub const FREEWHEEL_MS: u16 = 2000;

/// What a walker does when a verdict lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Response {
    /// The last good angle is kept and the rhythm goes on.
    CarryOn,
    /// The supervisor brings the joints to the park pose in a hurry and switches the outputs off.
    Park,
    /// The follower goes on without its sensor for a while, then stands.
    Freewheel,
}

impl Response {
    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::CarryOn => "carry on",
            Self::Park => "park",
            Self::Freewheel => "freewheel",
        }
    }
}

/// What follows from a verdict. Times in ms from the last right sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultResponse {
    /// What telemetry calls it when it stops the joints or keeps them from arming.
    pub cause: Cause,
    /// When the verdict has its name.
    pub classified_ms: u16,
    /// When the first verdict that is not good comes.
    pub rejected_ms: u16,
    /// A walker with a rhythm of its own.
    pub independent: Response,
    /// A walker that follows the sensor.
    pub follower: Response,
}

impl FaultResponse {
    /// When the supervisor stops a walker with a rhythm of its own, if the sensor is not good for so long.
    ///
    /// ```
    /// use hgod_adc::Validity;
    /// use joint_loop::{Response, Cause, fault_response};
    /// let open = fault_response(Validity::Open).expect("it is not good");
    /// assert_eq!((open.cause, open.independent, open.stops_ms()), (Cause::SensorOpen, Response::Park, 51));
    /// ```
    #[must_use]
    pub const fn stops_ms(&self) -> u16 {
        self.rejected_ms.saturating_add(SENSOR_TOLERANCE_MS)
    }

    /// When a follower begins to freewheel at the latest, if the sensor is not good for so long.
    #[must_use]
    pub const fn freewheels_ms(&self) -> u16 {
        self.rejected_ms.saturating_add(FOLLOWER_BRIDGE_MS)
    }
}

/// What follows from a verdict, the table of [`crate::control::fault_table`]; nothing follows from good.
#[must_use]
pub const fn fault_response(verdict: Validity) -> Option<FaultResponse> {
    let cause = Cause::of_sensor(verdict);
    let (independent, follower) = match verdict {
        Validity::Good => return None,
        Validity::Saturated | Validity::Spike => (Response::CarryOn, Response::CarryOn),
        // Open, short, stuck, rate, out of table, supply low; a validity that is added later is one of them until the table says more.
        _ => (Response::Park, Response::Freewheel),
    };
    let classified_ms = verdict.detection_ms();
    let rejected_ms = match verdict {
        // Until then it is a code like any other.
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
        let faults: Vec<_> = Validity::ALL.into_iter().filter(|&verdict| verdict != Validity::Good).collect();
        assert_eq!(rows.len(), 1 + faults.len(), "a row for each verdict");
        for verdict in faults {
            let is = fault_response(verdict).expect("something follows");
            let row = rows.iter().find(|row| row[0] == verdict.name()).expect("a row of its own");
            let cells = [
                verdict.name().to_string(),
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

    /// A verdict that does not act by itself is over, or has another name, before the supervisor would act.
    #[test]
    fn what_is_carried_through_ends_before_the_tolerance() {
        for verdict in Validity::ALL {
            let Some(is) = fault_response(verdict) else { continue };
            assert!(is.rejected_ms <= is.classified_ms, "{verdict}");
            let graver = match verdict {
                Validity::Spike => Validity::Rate,
                Validity::Saturated => Validity::Open,
                _ => continue,
            };
            assert_eq!((is.independent, is.follower), (Response::CarryOn, Response::CarryOn), "{verdict}");
            assert_eq!(verdict.worse(graver), graver);
            let then = fault_response(graver).expect("something follows");
            assert!(then.classified_ms < is.stops_ms() && then.classified_ms <= is.freewheels_ms(), "{verdict}");
        }
    }
}
