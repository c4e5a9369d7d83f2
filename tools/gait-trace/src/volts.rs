//! Converts joint angles to the volts that a calibrated sensor on the joint would have given.
//!
//! `V_pin = calibration^-1(angle) / divider`, rounded to a microvolt (one code of 12 bit at 3.3 V is 806). The angles are
//! real, the sensor is not: such volts are called **semi-synthetic** wherever they are used. Noise, supply droop and faults are not
//! included; a caller that needs them adds and names them.

use crate::recording::{Channel, Quantity, Recording, RecordingError};
use hgod_adc::{Calibration, OutOfTable};

/// Why a recording cannot become volts.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VoltsError {
    /// The channel holds no angles.
    #[error("channel `{channel}` holds {}; allowed are angles in degrees", .quantity.unit())]
    NotAngles {
        /// The channel.
        channel: String,
        /// The quantity that it holds.
        quantity: Quantity,
    },
    /// The name is not a pin.
    #[error("`{pin}` is not a pin; allowed is for example `PA1`")]
    Pin {
        /// The name.
        pin: String,
    },
    /// The divider is not a finite number above 0.
    #[error("divider {divider}; allowed is a number above 0")]
    Divider {
        /// The given value.
        divider: f32,
    },
    /// An angle is outside of the calibration table.
    #[error(
        "`{channel}` is {angle_deg} degrees at {time_s} s, {why}; allowed is {least_deg:.2} to {most_deg:.2} degrees"
    )]
    OutOfTable {
        /// The channel.
        channel: String,
        /// Time of the row, seconds.
        time_s: f64,
        /// The angle, degrees.
        angle_deg: f64,
        /// Side of the table.
        why: OutOfTable,
        /// Smallest angle of the table, degrees.
        least_deg: f32,
        /// Largest angle of the table, degrees.
        most_deg: f32,
    },
    /// The volts are out of the range of a pin.
    #[error("the volts at the pin: {0}")]
    Volts(#[from] RecordingError),
}

impl Recording {
    /// The semi-synthetic volts of `channel` at a pin: a sensor with this calibration on that joint, wired through a divider.
    ///
    /// # Errors
    /// The channel holds no angles, an angle is outside of the calibration, or pin or divider are not valid.
    ///
    /// ```
    /// use gait_trace::{Channel, Quantity, Recording};
    /// use hgod_adc::{Calibration, CalibrationPoint, Interpolation};
    /// use joint_units::{Radians, Volts};
    /// let point = |volts, degrees| CalibrationPoint { volts: Volts(volts), angle: Radians::from_degrees(degrees) };
    /// let calibration = Calibration::new(&[point(0.5, 0.0), point(2.5, 100.0)], Interpolation::Linear)?;
    /// let knee = Channel::new("knee", Quantity::Angle, vec![10.0, 60.0]);
    /// let walk = Recording::build(vec![0.0, 0.5], vec![knee])?;
    ///
    /// let volts = walk.semi_synthetic_volts(&walk.channels()[0], &calibration, 2.0, "PA1")?;
    /// assert_eq!(volts.channel("PA1")?.values(), [0.35, 0.85]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn semi_synthetic_volts(
        &self,
        channel: &Channel,
        calibration: &Calibration,
        divider: f32,
        pin: &str,
    ) -> Result<Self, VoltsError> {
        if channel.quantity() != Quantity::Angle {
            return Err(VoltsError::NotAngles { channel: channel.name().into(), quantity: channel.quantity() });
        }
        let Some((pin, Quantity::PinVolts)) = Channel::of_column(pin) else {
            return Err(VoltsError::Pin { pin: pin.into() });
        };
        if !(divider.is_finite() && divider > 0.0) {
            return Err(VoltsError::Divider { divider });
        }
        let at_pin = |(row, angle)| match calibration.volts(angle) {
            Ok(volts) => Ok((f64::from(volts.0) / f64::from(divider) * 1e6).round() / 1e6),
            Err(why) => Err(VoltsError::OutOfTable {
                channel: channel.name().into(),
                time_s: self.time_s()[row],
                angle_deg: channel.values()[row],
                why,
                least_deg: calibration.span().0.degrees(),
                most_deg: calibration.span().1.degrees(),
            }),
        };
        let values = channel.radians().enumerate().map(at_pin).collect::<Result<_, _>>()?;
        Ok(Recording::build(self.time_s().to_vec(), vec![Channel::new(pin, Quantity::PinVolts, values)])?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hgod_adc::{Interpolation, rk09k};
    use joint_units::Volts;

    fn calibration() -> Calibration {
        Calibration::new(&rk09k::points::<17>(Volts(3.3), 0.265, 0.88), Interpolation::MonotoneCubic).unwrap()
    }

    fn walk(quantity: Quantity, values: Vec<f64>) -> Recording {
        let times = (0..values.len()).map(|n| n as f64 * 0.5).collect();
        Recording::build(times, vec![Channel::new("knee", quantity, values)]).unwrap()
    }

    #[test]
    fn volts_convert_back_to_the_angle() {
        let angles: Vec<f64> = (-50..88).map(f64::from).collect();
        let walk = walk(Quantity::Angle, angles.clone());
        let volts = walk.semi_synthetic_volts(&walk.channels()[0], &calibration(), 1.5, "PC3").unwrap();
        for (volts, angle) in volts.channels()[0].values().iter().zip(angles) {
            let back = calibration().angle(Volts((volts * 1.5) as f32)).unwrap();
            assert!((f64::from(back.degrees()) - angle).abs() < 1e-3, "{back:?} for {angle}");
        }
    }

    #[test]
    fn bad_inputs_are_refused() {
        let angles = walk(Quantity::Angle, vec![0.0, 150.0]);
        let knee = &angles.channels()[0];
        let error = angles.semi_synthetic_volts(knee, &calibration(), 1.0, "PA1").unwrap_err().to_string();
        assert!(
            error.starts_with("`knee` is 150 degrees at 0.5 s, above the calibration table; allowed is -5"),
            "{error}"
        );
        let divided = |divider| angles.semi_synthetic_volts(knee, &calibration(), divider, "PA1");
        for divider in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(matches!(divided(divider), Err(VoltsError::Divider { .. })), "{divider}");
        }
        let pinned = |pin| angles.semi_synthetic_volts(knee, &calibration(), 1.0, pin);
        for pin in ["", "PA99", "left_knee_deg"] {
            assert!(matches!(pinned(pin), Err(VoltsError::Pin { .. })), "{pin}");
        }
        let volts = walk(Quantity::PinVolts, vec![0.0, 1.0]);
        let again = volts.semi_synthetic_volts(&volts.channels()[0], &calibration(), 1.0, "PA1");
        assert!(matches!(again, Err(VoltsError::NotAngles { .. })));
    }
}
