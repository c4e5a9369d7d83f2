//! The speeds at which the joints of a named gait keep to their rate limits.
//!
//! The speed of most gaits changes their time and not their angles, so every rate is proportional to the speed. The rates at speed 1 are those
//! of the harmonic waveforms, amplitude times 2 pi / stride time, for the gaits of four cells; the others were measured over a minute from the
//! start. The members of [`crate::gait::family`] change their shape too: their rates are those of the shape at each cadence.
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
//! | `human-walk`, `human-run` | knees | their fastest |
//! | `human-run-unscaled` | knees | none |

use joint_units::{Joint, Phase, RadPerSec, Radians};

use crate::gait::default_walk::default_config;
use crate::gait::family::Member;
use crate::gait::named::Gait;
use crate::transition::JointLimits;
use crate::waveform::shape::Shape;

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
            None => write!(f, "no speed is allowed, as the least is {}", self.gait.speeds().0),
        }
    }
}

impl core::error::Error for TooFast {}

impl Gait {
    /// The highest rate of each joint at a speed, rad/s; infinite where the speed is none of [`Gait::speeds`].
    #[must_use]
    pub fn peak_rates(self, speed: f32) -> [RadPerSec; Joint::COUNT] {
        let at_speed_1 = match self {
            Gait::Walk => [115.84, 115.84, 178.31, 178.31],
            Gait::NaturalWalk => [183.68, 177.19, 463.61, 427.99],
            Gait::Thesis => [117.81, 118.0, 172.63, 173.11],
            Gait::Cells(_) => {
                let turn = core::f32::consts::TAU / self.stride_s();
                default_config().amplitudes.map(|amplitude| amplitude.degrees() * turn)
            }
            Gait::Human(member) => return of_member(member, speed * 120.0 / self.stride_s()),
        };
        at_speed_1.map(|rate| RadPerSec(Radians::from_degrees(rate * speed).0))
    }

    /// The largest of its speeds at which every joint keeps to its rate limit, in whole thousandths if it is not the fastest of all; `None` if
    /// no speed does. Rates grow with the speed.
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
        let (slowest, fastest) = self.speeds();
        let keeps = |speed| self.too_fast(speed, limits).is_none();
        if keeps(fastest) {
            return Some(fastest);
        }
        if !keeps(slowest) {
            return None;
        }
        let (mut within, mut beyond) = (slowest, fastest);
        for _ in 0..20 {
            let middle = 0.5 * (within + beyond);
            *(if keeps(middle) { &mut within } else { &mut beyond }) = middle;
        }
        Some((libm::floorf(within * 1e3) / 1e3).max(slowest))
    }

    /// The first joint that is too fast at a speed: its rate and its limit.
    fn too_fast(self, speed: f32, limits: &[JointLimits; Joint::COUNT]) -> Option<(Joint, RadPerSec, RadPerSec)> {
        let rates = self.peak_rates(speed).into_iter().zip(limits);
        let mut joints = Joint::ALL.into_iter().zip(rates).map(|(joint, (rate, limits))| (joint, rate, limits.rate));
        // The product rounds.
        joints.find(|(_, rate, limit)| rate.0 > limit.0 * (1.0 + 1e-6))
    }

    /// Checks that every joint keeps to its rate limit at a speed.
    ///
    /// # Errors
    /// [`TooFast`] names the first joint that does not, with its rate, its limit and the largest speed.
    pub fn allow_speed(self, speed: f32, all: &[JointLimits; Joint::COUNT]) -> Result<(), TooFast> {
        match self.too_fast(speed, all) {
            Some((joint, rate, limit)) => {
                Err(TooFast { gait: self, speed, joint, rate, limit, largest: self.largest_speed(all) })
            }
            None => Ok(()),
        }
    }
}

/// Phases of a stride at which the rates of a member are computed: the sixth harmonic is missed by at most 0.3 %.
const PHASES: u32 = 256;

/// The highest rates of a member at a cadence in steps a minute.
fn of_member(member: Member, cadence: f32) -> [RadPerSec; Joint::COUNT] {
    let Ok(config) = member.at_cadence(cadence) else { return [RadPerSec(f32::INFINITY); Joint::COUNT] };
    config.shapes.map(|shape| {
        let slopes = (0..PHASES).map(|k| shape.at(Phase(k << 24)).slope.abs());
        RadPerSec(slopes.fold(0.0, f32::max) / config.stride_s)
    })
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
            for speed in [gait.speeds().0, 1.0, gait.speeds().1] {
                let mut highest = [0.0f32; 4];
                let mut generator = gait.build(speed, Period::MILLISECOND).unwrap();
                for _ in 0..20_000 {
                    let before = generator.angles();
                    generator.step();
                    for ((highest, before), after) in highest.iter_mut().zip(before).zip(generator.angles()) {
                        *highest = highest.max((after.0 - before.0).abs() * 1e3);
                    }
                }
                for (measured, stated) in highest.into_iter().zip(gait.peak_rates(speed)) {
                    let part = measured / stated.0;
                    assert!((0.99..1.003).contains(&part), "{}: {measured} of {} rad/s", gait.name(), stated.0);
                }
            }
        }
    }

    #[test]
    fn a_speed_beyond_the_limit_names_joint_rate_limit_and_largest_speed() {
        let limits = [JointLimits { rate: RadPerSec(Radians::from_degrees(500.0).0), ..JointLimits::WIDEST }; 4];
        let refused = Gait::NaturalWalk.allow_speed(1.5, &limits).unwrap_err();
        let words = "speed = 1.5: left_knee of natural-walk would reach 695 deg/s, its limit is 500 deg/s: allowed is up to 1.078";
        assert_eq!(refused.to_string(), words);
        let limited = Gait::ALL.map(|gait| (gait.name(), gait.largest_speed(&limits)));
        for (name, largest) in limited {
            let expected = match name {
                "natural-walk" => 1.078,
                "fast-hop" => 1.326,
                "human-walk" => Member::Walk.cadences().1 / Member::Walk.middle(),
                "human-run" => Member::Run.cadences().1 / Member::Run.middle(),
                "human-run-unscaled" => {
                    assert_eq!(largest, None);
                    continue;
                }
                _ => 1.5,
            };
            assert_eq!(largest, Some(expected), "{name}");
        }
        for gait in Gait::ALL.into_iter().filter(|gait| gait.largest_speed(&limits).is_some()) {
            let largest = gait.largest_speed(&limits).unwrap();
            assert_eq!(gait.allow_speed(largest, &limits), Ok(()));
            let more = gait.allow_speed(largest + 0.002, &limits).is_err();
            assert!(more == (largest < 1.5), "{}", gait.name());
        }
        let slow = [JointLimits { rate: RadPerSec(1.0), ..JointLimits::WIDEST }; 4];
        assert_eq!(Gait::Walk.largest_speed(&slow), None);
        assert!(Gait::Walk.allow_speed(0.5, &slow).unwrap_err().to_string().ends_with("the least is 0.5"));
    }
}
