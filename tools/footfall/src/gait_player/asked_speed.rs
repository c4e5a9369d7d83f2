//! A speed as it was asked for, as a factor or as a cadence, and what a gait allows of it on the default robot.

use cpg_core::gait::family::Member;
use cpg_core::gait::named::Gait;
use joint_loop::GateConfig;
use joint_units::Radians;
use std::fmt;

use crate::failure::Failure;

/// A speed in the unit in which it was asked for. A change of gait keeps the number in this unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AskedSpeed {
    /// A factor on the gait's own cadence.
    Factor(f32),
    /// Steps a minute, two a stride.
    Cadence(f32),
}

/// Whether a gait is for robots with faster joints: it is played as it is.
const fn is_for_faster_joints(gait: Gait) -> bool {
    matches!(gait, Gait::Human(Member::RunUnscaled))
}

/// The largest factor at which the joints of a gait keep to the rate limits of the default robot; the least one if they do at none.
fn largest_factor(gait: Gait) -> f32 {
    let (slowest, fastest) = gait.speeds();
    if is_for_faster_joints(gait) {
        return fastest;
    }
    gait.largest_speed(&GateConfig::default_biped().joint_limits()).unwrap_or(slowest)
}

/// The least number with so many parts of 1 that is not below this one.
fn rounded_up(number: f32, parts: f32) -> f32 {
    let near = (number * parts).round();
    if near / parts >= number { near / parts } else { (near + 1.0) / parts }
}

/// The largest number with so many parts of 1 that is not above this one.
fn rounded_down(number: f32, parts: f32) -> f32 {
    -rounded_up(-number, parts)
}

impl AskedSpeed {
    /// The number in its unit.
    #[must_use]
    pub const fn number(self) -> f32 {
        match self {
            Self::Factor(number) | Self::Cadence(number) => number,
        }
    }

    /// As a factor on a gait's own cadence.
    #[must_use]
    pub const fn factor(self, gait: Gait) -> f32 {
        match self {
            Self::Factor(factor) => factor,
            Self::Cadence(cadence) => cadence * gait.stride_s() / 120.0,
        }
    }

    /// As a cadence of a gait, steps a minute.
    #[must_use]
    pub const fn cadence(self, gait: Gait) -> f32 {
        match self {
            Self::Factor(factor) => factor * 120.0 / gait.stride_s(),
            Self::Cadence(cadence) => cadence,
        }
    }

    /// Least and largest number in this unit that a gait allows on the default robot, rounded to thousandths of a factor or tenths of a step a
    /// minute such that both are allowed themselves.
    #[must_use]
    pub fn allowed(self, gait: Gait) -> (f32, f32) {
        let largest = largest_factor(gait);
        let ((least, most), parts) = match self {
            Self::Factor(_) => ((gait.speeds().0, largest), 1e3),
            Self::Cadence(_) => ((gait.cadences().0, gait.cadences().1.min(Self::Factor(largest).cadence(gait))), 10.0),
        };
        (rounded_up(least, parts), rounded_down(most, parts))
    }

    /// The factor at which a gait is built, if the gait and the joints of the default robot allow it.
    ///
    /// # Errors
    /// It is out of the range of the gait, or a joint would exceed its rate limit; with what is allowed, in this unit.
    pub fn allow(self, gait: Gait) -> Result<f32, Failure> {
        let (unit, asked, (slowest, fastest)) = match self {
            Self::Factor(factor) => ("speed", factor, gait.speeds()),
            Self::Cadence(cadence) => ("cadence", cadence, gait.cadences()),
        };
        let ((least, most), name) = (self.allowed(gait), gait.name());
        if !(slowest..=fastest).contains(&asked) {
            return Err(Failure::input(format!("{unit} = {asked}: must be from {least} to {most} for {name}")));
        }
        let factor = match self {
            Self::Factor(factor) => factor,
            Self::Cadence(cadence) => gait.speed_at(cadence).map_err(Failure::input)?,
        };
        match gait.allow_speed(factor, &GateConfig::default_biped().joint_limits()) {
            Err(fast) if !is_for_faster_joints(gait) => {
                let (joint, [rate, limit]) =
                    (fast.joint.name(), [fast.rate, fast.limit].map(|r| Radians(r.0).degrees()));
                Err(Failure::input(format!(
                    "{unit} = {asked}: {joint} of {name} would reach {rate:.0} deg/s, its limit is {limit:.0} deg/s: allowed is up to {most}"
                )))
            }
            _ => Ok(factor),
        }
    }

    /// The same, or the nearest that a gait allows.
    #[must_use]
    pub fn nearest(self, gait: Gait) -> Self {
        if self.allow(gait).is_ok() {
            return self;
        }
        let (least, most) = self.allowed(gait);
        match self {
            Self::Factor(factor) => Self::Factor(factor.min(most).max(least)),
            Self::Cadence(cadence) => Self::Cadence(cadence.min(most).max(least)),
        }
    }
}

impl fmt::Display for AskedSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Factor(factor) => write!(f, "speed {factor}"),
            Self::Cadence(cadence) => write!(f, "a cadence of {cadence} steps a minute"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is printed as the range of a gait is accepted when it is typed in, and is short; what is beyond is refused with it.
    #[test]
    fn printed_limits_are_allowed() {
        for gait in Gait::ALL {
            for (unit, step) in [(AskedSpeed::Factor as fn(f32) -> AskedSpeed, 1e-3), (AskedSpeed::Cadence, 0.1)] {
                let (least, most) = unit(1.0).allowed(gait);
                for (limit, outward) in [(least, -step), (most, step)] {
                    let typed: f32 = limit.to_string().parse().unwrap();
                    let factor = unit(typed).allow(gait).unwrap_or_else(|why| panic!("{}: {why}", gait.name()));
                    assert!(gait.build(factor, joint_units::Period::MILLISECOND).is_ok(), "{}", gait.name());
                    assert!(limit.to_string().len() <= 5, "{}: {limit}", gait.name());
                    // The largest factor is in whole thousandths too, so a cadence may be allowed that is larger by a tenth.
                    let beyond = unit(typed + 2.01 * outward);
                    let refused = beyond.allow(gait).unwrap_err().to_string();
                    assert!(refused.contains(&limit.to_string()), "{}: {refused}", gait.name());
                    assert_eq!(beyond.nearest(gait), unit(limit), "{}", gait.name());
                    assert_eq!(unit(typed).nearest(gait), unit(typed));
                }
            }
        }
        assert_eq!(AskedSpeed::Cadence(1.0).allowed(Gait::Human(Member::Walk)), (98.4, 131.0));
        assert_eq!(AskedSpeed::Factor(1.0).allowed(Gait::Human(Member::Run)), (0.938, 1.062));
        assert_eq!(AskedSpeed::Cadence(1.0).allowed(Gait::NaturalWalk), (55.4, 119.3));
        assert_eq!((rounded_up(1.25, 10.0), rounded_down(1.25, 10.0)), (1.3, 1.2));
    }

    #[test]
    fn what_is_no_speed_is_refused() {
        for number in [f32::NAN, f32::INFINITY, 0.0, -1.0, 1e9] {
            for asked in [AskedSpeed::Factor(number), AskedSpeed::Cadence(number)] {
                let refused = asked.allow(Gait::Walk).unwrap_err().to_string();
                assert!(refused.contains("must be from") && refused.ends_with("for walk"), "{refused}");
            }
        }
    }
}
