//! The speeds at which the joints of a named gait keep to their rate limits.
//!
//! The speed of a named gait changes its time and not its angles, so every rate is proportional to the speed. The rates at speed 1 are those
//! of the harmonic waveforms, amplitude times 2 pi / stride time, for the gaits of four cells; the others were measured over a minute from the start.
//!
//! | gait | fastest joint at speed 1 | largest speed at 500 degrees/s |
//! |---|---|---|
//! | `walk` | knees, 178 degrees/s | 1.5 |
//! | `natural-walk` | left knee, 464 degrees/s | 1.078 |
//! | `thesis` | right knee, 173 degrees/s | 1.5 |
//! | `cell-walk` | knees, 171 degrees/s | 1.5 |
//! | `run`, `skip` | knees, 269 degrees/s | 1.5 |
//! | `slow-hop`, `gallop-run` | knees, 314 degrees/s | 1.5 |
//! | `fast-hop` | knees, 377 degrees/s | 1.326 |
//! | `gallop-walk` | knees, 236 degrees/s | 1.5 |

use joint_units::{Joint, RadPerSec, Radians};

use crate::gait::default_walk::default_config;
use crate::gait::named::{Gait, SPEEDS};
use crate::transition::JointLimits;

/// Why a gait cannot be played at a speed: a joint would exceed its rate limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TooFast {
    /// The gait.
    pub gait: Gait,
    /// The speed asked for.
    pub speed: f32,
    /// The first joint that is too fast.
    pub joint: Joint,
    /// Its highest rate at this speed, rad/s.
    pub rate: RadPerSec,
    /// Its limit, rad/s.
    pub limit: RadPerSec,
    /// The largest speed at which all joints keep to their limits, in whole thousandths; `None` if they do at no speed.
    pub largest: Option<f32>,
}

impl core::fmt::Display for TooFast {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let degrees = |rate: RadPerSec| Radians(rate.0).degrees();
        let (gait, joint) = (self.gait.name(), self.joint.name());
        let (speed, rate, limit) = (self.speed, degrees(self.rate), degrees(self.limit));
        write!(f, "speed = {speed}: {joint} of {gait} would reach {rate:.0} deg/s, its limit is {limit:.0} deg/s: ")?;
        match self.largest {
            Some(largest) => write!(f, "allowed is up to {largest}"),
            None => write!(f, "no speed is allowed, as the least is {}", SPEEDS.0),
        }
    }
}

impl core::error::Error for TooFast {}

impl Gait {
    /// The highest rate of each joint at speed 1, rad/s; at another speed multiply by it.
    #[must_use]
    pub fn peak_rates(self) -> [RadPerSec; Joint::COUNT] {
        let degrees = |rates: [f32; Joint::COUNT]| rates.map(|rate| RadPerSec(Radians::from_degrees(rate).0));
        match self {
            Gait::Walk => degrees([115.84, 115.84, 178.31, 178.31]),
            Gait::NaturalWalk => degrees([183.68, 177.19, 463.61, 427.99]),
            Gait::Thesis => degrees([117.81, 118.0, 172.63, 173.11]),
            Gait::Cells(_) => {
                let turn = core::f32::consts::TAU / self.stride_s();
                default_config().amplitudes.map(|amplitude| RadPerSec(amplitude.0 * turn))
            }
        }
    }

    /// The largest speed, at most 1.5 and in whole thousandths, at which every joint keeps to its rate limit; `None` if no speed does.
    ///
    /// ```
    /// use cpg_core::gait::named::Gait;
    /// use cpg_core::transition::JointLimits;
    /// use joint_units::RadPerSec;
    /// let limits = [JointLimits { rate: RadPerSec(8.73), ..JointLimits::WIDEST }; 4];
    /// assert_eq!(Gait::Walk.largest_speed(&limits), Some(1.5));
    /// assert_eq!(Gait::NaturalWalk.largest_speed(&limits), Some(1.078));
    /// ```
    #[must_use]
    pub fn largest_speed(self, limits: &[JointLimits; Joint::COUNT]) -> Option<f32> {
        let speeds = self.peak_rates().into_iter().zip(limits).map(|(peak, limits)| limits.rate.0 / peak.0);
        let largest = libm::floorf(speeds.fold(SPEEDS.1, f32::min) * 1e3) / 1e3;
        (largest >= SPEEDS.0).then_some(largest)
    }

    /// Checks that every joint keeps to its rate limit at a speed.
    ///
    /// # Errors
    /// [`TooFast`] names the first joint that does not, with its rate, its limit and the largest speed.
    pub fn allow_speed(self, speed: f32, all: &[JointLimits; Joint::COUNT]) -> Result<(), TooFast> {
        for (joint, (peak, limits)) in Joint::ALL.into_iter().zip(self.peak_rates().into_iter().zip(all)) {
            let (rate, limit) = (RadPerSec(peak.0 * speed), limits.rate);
            // The product rounds.
            if rate.0 > limit.0 * (1.0 + 1e-6) {
                let largest = self.largest_speed(all);
                return Err(TooFast { gait: self, speed, joint, rate, limit, largest });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Generator;
    use joint_units::Period;

    /// The rates of the angles themselves, at both ends of the speeds: never above those stated, and not far below.
    #[test]
    fn the_stated_rates_are_those_of_the_angles() {
        for gait in Gait::ALL {
            let mut highest = [0.0f32; 4];
            for speed in [SPEEDS.0, 1.0, SPEEDS.1] {
                let mut generator = gait.build(speed, Period::MILLISECOND).unwrap();
                for _ in 0..20_000 {
                    let before = generator.angles();
                    generator.step();
                    for ((highest, before), after) in highest.iter_mut().zip(before).zip(generator.angles()) {
                        *highest = highest.max((after.0 - before.0).abs() * 1e3 / speed);
                    }
                }
            }
            for (measured, stated) in highest.into_iter().zip(gait.peak_rates()) {
                let part = measured / stated.0;
                assert!((0.995..1.001).contains(&part), "{}: {measured} of {} rad/s", gait.name(), stated.0);
            }
        }
    }

    #[test]
    fn a_speed_beyond_the_limit_names_joint_rate_limit_and_largest_speed() {
        let limits = [JointLimits { rate: RadPerSec(Radians::from_degrees(500.0).0), ..JointLimits::WIDEST }; 4];
        let refused = Gait::NaturalWalk.allow_speed(1.5, &limits).unwrap_err();
        let words = "speed = 1.5: left_knee of natural-walk would reach 695 deg/s, its limit is 500 deg/s: allowed is up to 1.078";
        assert_eq!(refused.to_string(), words);
        let limited: [_; 10] = Gait::ALL.map(|gait| (gait.name(), gait.largest_speed(&limits)));
        for (name, largest) in limited {
            let expected = match name {
                "natural-walk" => 1.078,
                "fast-hop" => 1.326,
                _ => 1.5,
            };
            assert_eq!(largest, Some(expected), "{name}");
        }
        for gait in Gait::ALL {
            let largest = gait.largest_speed(&limits).unwrap();
            assert_eq!(gait.allow_speed(largest, &limits), Ok(()));
            assert_eq!(gait.allow_speed(largest + 0.002, &limits).is_err(), largest < 1.5, "{}", gait.name());
        }
        let slow = [JointLimits { rate: RadPerSec(1.0), ..JointLimits::WIDEST }; 4];
        assert_eq!(Gait::Walk.largest_speed(&slow), None);
        assert!(Gait::Walk.allow_speed(0.5, &slow).unwrap_err().to_string().ends_with("the least is 0.5"));
    }
}
