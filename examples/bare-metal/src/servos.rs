//! Four servos behind [`SetDutyCycle`]: from joint angles to duty cycles of any PWM channel.

use embedded_hal::pwm::SetDutyCycle;
use joint_units::Radians;

/// Period of the PWM, us: 50 Hz.
const FRAME_US: f32 = 20_000.0;
/// Pulse of a joint at 0 rad, us.
const CENTRE_US: f32 = 1_500.0;
/// Change of the pulse with the angle, us per rad: 1000 us for 90 degrees.
const US_PER_RADIAN: f32 = 1_000.0 / core::f32::consts::FRAC_PI_2;
/// Limits of the angle, rad: the pulse stays between 500 and 2500 us.
const LIMIT: f32 = core::f32::consts::FRAC_PI_2;

/// Four servos on channels of type `P`, which run at 50 Hz.
#[derive(Debug)]
pub(crate) struct Servos<P> {
    /// In the order of [`joint_units::Joint::ALL`].
    pub(crate) channels: [P; 4],
}

impl<P: SetDutyCycle> Servos<P> {
    /// Writes the pulse of each angle, limited to ±90 degrees.
    ///
    /// # Errors
    /// That of the channel; the channels after it keep their pulses.
    pub(crate) fn write(&mut self, angles: [Radians; 4]) -> Result<(), P::Error> {
        for (channel, angle) in self.channels.iter_mut().zip(angles) {
            let pulse_us = CENTRE_US + US_PER_RADIAN * angle.0.clamp(-LIMIT, LIMIT);
            let full = f32::from(channel.max_duty_cycle());
            channel.set_duty_cycle((full * (pulse_us / FRAME_US)) as u16)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use embedded_hal::pwm::ErrorType;

    #[derive(Debug, Clone, Copy, Default)]
    struct Recorded(u16);

    impl ErrorType for Recorded {
        type Error = Infallible;
    }

    impl SetDutyCycle for Recorded {
        fn max_duty_cycle(&self) -> u16 {
            20_000
        }

        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            self.0 = duty;
            Ok(())
        }
    }

    #[test]
    fn angles_become_pulses_within_their_limits() {
        let mut servos = Servos { channels: [Recorded::default(); 4] };
        servos.write([0.0, 45.0, -90.0, 400.0].map(Radians::from_degrees)).unwrap();
        assert_eq!(servos.channels.map(|channel| channel.0), [1500, 2000, 500, 2500]);
    }
}
