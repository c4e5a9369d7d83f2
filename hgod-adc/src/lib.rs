//! Converts ADC codes to calibrated joint angles and classifies every sample.
//!
//! The sensor is a potentiometer goniometer on a joint (HGOD, the joint-angle sensor of the thesis that Footfall builds on). A 12 bit
//! analogue-to-digital converter (ADC) reads its voltage. Any sensor whose voltage rises or falls with the angle throughout can be used.
//!
//! ```text
//!  AdcCode, reference --[code]--> Volts --[calibration]--> Radians --[filter]--> Radians
//!         |                          |                        |
//!         +---- open, short,         +---- out of table       +---- spike, rate
//!               saturated, stuck, supply low                      [health]
//! ```
//!
//! [`Sensor`] is the whole chain; each stage can also be used alone. Every stage has a configuration, which `build` checks once, and a state apart
//! from it (`Default`, `Clone`). There is no clock and no input or output: one call of [`Sensor::sample`] is one tick. Board and host compute the
//! same bits.
//!
//! # From a code to an angle
//! ```
//! use hgod_adc::{Calibration, CalibrationPoint, FilterConfig, HealthConfig, Interpolation, ReferenceConfig};
//! use hgod_adc::{SensorConfig, SensorState, Validity};
//! use joint_units::{AdcCode, Period, Radians, Volts};
//!
//! // A goniometer that falls by 1 V for 60 degrees, measured with a protractor at four angles.
//! let measured = [(0.5, 120.0), (1.5, 60.0), (2.0, 30.0), (2.5, 0.0)];
//! let points = measured.map(|(v, deg)| CalibrationPoint { volts: Volts(v), angle: Radians::from_degrees(deg) });
//!
//! let sensor = SensorConfig {
//!     // The factory's code of the internal reference of this chip, measured at 3.3 V.
//!     reference: ReferenceConfig::stm32f4(AdcCode(1501)),
//!     calibration: Calibration::new(&points, Interpolation::Linear)?,
//!     filter: FilterConfig::default(),
//!     health: HealthConfig::default(),
//! }
//! .build(Period::MILLISECOND)?;
//!
//! // The internal reference reads as it did in the factory, so the supply is 3.3 V and code 2172 is 1.7503 V: 45.0 degrees.
//! let mut state = SensorState::default();
//! let reading = sensor.sample(&mut state, AdcCode(2172), AdcCode(1501));
//! assert_eq!(reading.validity, Validity::Good);
//! assert!((reading.volts.0 - 1.7503).abs() < 1e-4);
//! assert!((reading.angle.degrees() - 44.98).abs() < 0.01);
//!
//! // The wire breaks: no sample is used as an angle, and after 20 ms the validity is `open`.
//! let first = sensor.sample(&mut state, AdcCode(3), AdcCode(1501));
//! assert_eq!((first.code, first.validity, first.angle), (AdcCode(3), Validity::Saturated, reading.angle));
//! let last = (2..=20).map(|_| sensor.sample(&mut state, AdcCode(3), AdcCode(1501)).validity).last();
//! assert_eq!(last, Some(Validity::Open));
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! # Guarantees
//! - No input makes a call panic, loop without bound or return a number that is not finite.
//! - An angle always lies in the span of the calibration table. Outside the table the sample is not good; nothing is extrapolated.
//! - If the validity is not [`Validity::Good`], code and volts are those of the sample and the angle is the last good one.
//!
//! # Features
//! - `defmt`: `defmt::Format` for readings and errors. For a target that links a defmt logger.
//!
//! # Glossary
//! - **code**: one raw count of the converter; **supply**: its reference voltage (VDDA), measured through the internal reference.
//! - **validity**: what is known about one sample: `good`, or the name of the fault.
//! - **calibration**: a table of measured pairs of volts and angle.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod calibration;
mod code;
mod filter;
mod health;
mod interpolation;
mod oversampling;
mod point;
mod range;
pub mod rk09k;
mod sensor;
pub mod stm32f4;

pub use calibration::{
    ANATOMY, Calibration, CalibrationError, MAX_SLOPE, MAX_VOLTS, MIN_ANGLE_STEP, MIN_VOLTS_STEP, OutOfTable,
};
pub use code::{Excitation, Reference, ReferenceConfig, ReferenceError, Supply, SupplyFault};
pub use filter::{Filter, FilterConfig, FilterState};
pub use health::{
    Health, HealthConfig, HealthState, Pull, SPIKE_MS, STUCK_MS, Validity, WIRE_FAULT_MAX_MS, WIRE_FAULT_MS,
};
pub use interpolation::Interpolation;
pub use oversampling::{OVERSAMPLING, trimmed_mean, trimmed_means_of_two};
pub use point::{CalibrationPoint, MAX_POINTS};
pub use range::RangeError;
pub use sensor::{Reading, Sensor, SensorConfig, SensorError, SensorState};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
