//! The table of the parameters that can change while the loop runs.
//!
//! Values are whole thousandths of the unit, so that a value is a value on every side: there is no NaN, and no rounding on the way.

use core::fmt;
use core::str::FromStr;

use cpg_core::gait::family::Member;
use cpg_core::gait::named::Gait;
use joint_units::Joint;

/// The gaits of [`Parameter::Gait`], from 1 on; 0 is the generator of the board's own record. All begin at phase zero.
pub const GAITS: [Gait; 4] = [Gait::Walk, Gait::NaturalWalk, Gait::Human(Member::Walk), Gait::Human(Member::Run)];

/// A parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Parameter {
    /// Which generator moves the joints.
    Gait,
    /// Factor on the speed of the motion.
    Speed,
    /// Factor on a joint's distance from the park pose.
    Amplitude(Joint),
    /// Angle that is added to a joint.
    Offset(Joint),
    /// Whether a follower gets its sensor.
    Follow,
    /// Frames a second on the serial port.
    RecordRate,
}

impl Parameter {
    /// Number of parameters.
    pub const COUNT: usize = 12;

    /// Every parameter. The order is part of the wire format.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Gait,
        Self::Speed,
        Self::Amplitude(Joint::LeftHip),
        Self::Amplitude(Joint::RightHip),
        Self::Amplitude(Joint::LeftKnee),
        Self::Amplitude(Joint::RightKnee),
        Self::Offset(Joint::LeftHip),
        Self::Offset(Joint::RightHip),
        Self::Offset(Joint::LeftKnee),
        Self::Offset(Joint::RightKnee),
        Self::Follow,
        Self::RecordRate,
    ];

    /// Place in [`Parameter::ALL`].
    #[must_use]
    pub const fn place(self) -> usize {
        match self {
            Self::Gait => 0,
            Self::Speed => 1,
            Self::Amplitude(joint) => 2 + joint as usize,
            Self::Offset(joint) => 6 + joint as usize,
            Self::Follow => 10,
            Self::RecordRate => 11,
        }
    }

    /// Name on the command line and in recordings.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gait => "gait",
            Self::Speed => "speed",
            Self::Amplitude(Joint::LeftHip) => "amplitude_left_hip",
            Self::Amplitude(Joint::RightHip) => "amplitude_right_hip",
            Self::Amplitude(Joint::LeftKnee) => "amplitude_left_knee",
            Self::Amplitude(Joint::RightKnee) => "amplitude_right_knee",
            Self::Offset(Joint::LeftHip) => "offset_left_hip",
            Self::Offset(Joint::RightHip) => "offset_right_hip",
            Self::Offset(Joint::LeftKnee) => "offset_left_knee",
            Self::Offset(Joint::RightKnee) => "offset_right_knee",
            Self::Follow => "follow",
            Self::RecordRate => "record_rate",
        }
    }

    /// The parameter of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.name() == name)
    }

    /// Unit of a value; empty for a factor or a choice.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Offset(_) => "deg",
            Self::RecordRate => "1/s",
            Self::Gait | Self::Speed | Self::Amplitude(_) | Self::Follow => "",
        }
    }

    /// Least, greatest and default value, thousandths of the unit.
    #[must_use]
    pub const fn range(self) -> [i32; 3] {
        match self {
            Self::Gait => [0, GAITS.len() as i32 * 1000, 0],
            Self::Speed => [500, 1_500, 1_000],
            Self::Amplitude(_) => [0, 1_500, 1_000],
            Self::Offset(_) => [-15_000, 15_000, 0],
            Self::Follow => [0, 1_000, 1_000],
            Self::RecordRate => [1_000, 1_000_000, 100_000],
        }
    }

    /// Whether only whole numbers are allowed.
    #[must_use]
    pub const fn is_whole(self) -> bool {
        matches!(self, Self::Gait | Self::Follow | Self::RecordRate)
    }

    /// What it is, in one sentence.
    #[must_use]
    pub const fn about(self) -> &'static str {
        match self {
            Self::Gait => "The generator of the joints: 0 is the board's own, 1 to 4 are gaits by name.",
            Self::Speed => "Factor on the speed of the motion; a follower takes its speed from the person.",
            Self::Amplitude(_) => "Factor on the distance of the joint from the park pose.",
            Self::Offset(_) => "Angle that is added to the joint, flexion positive.",
            Self::Follow => "1: a follower gets its sensor; 0: it gets none, and stands after two seconds.",
            Self::RecordRate => {
                "Frames a second on the serial port; one in a whole number of ticks, so that the next lower rate may result."
            }
        }
    }

    /// Whether the value is allowed.
    #[must_use]
    pub const fn allows(self, thousandths: i32) -> bool {
        let [least, most, _] = self.range();
        thousandths >= least && thousandths <= most && (!self.is_whole() || thousandths % 1000 == 0)
    }
}

/// A number of thousandths as a decimal number, without zeros at the end: 1250 is `1.25`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Thousandths(
    /// The number.
    pub i32,
);

impl fmt::Display for Thousandths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = self.0.unsigned_abs();
        let (whole, rest) = (magnitude / 1000, magnitude % 1000);
        if self.0 < 0 {
            f.write_str("-")?;
        }
        match rest {
            0 => write!(f, "{whole}"),
            rest if rest % 100 == 0 => write!(f, "{whole}.{}", rest / 100),
            rest if rest % 10 == 0 => write!(f, "{whole}.{:02}", rest / 10),
            rest => write!(f, "{whole}.{rest:03}"),
        }
    }
}

/// A text that is no decimal number with up to three places, or one beyond the range of [`Thousandths`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoThousandths;

impl fmt::Display for NoThousandths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("allowed is a decimal number with up to three places, such as 1.25 or -0.5")
    }
}

impl core::error::Error for NoThousandths {}

impl FromStr for Thousandths {
    type Err = NoThousandths;

    /// Reads a decimal number exactly: `1.25` is 1250.
    fn from_str(text: &str) -> Result<Self, NoThousandths> {
        let (negative, magnitude) = match text.strip_prefix('-') {
            Some(rest) => (true, rest),
            None => (false, text),
        };
        let (whole, places) = magnitude.split_once('.').unwrap_or((magnitude, "0"));
        let number = |digits: &str| match digits.bytes().all(|byte| byte.is_ascii_digit()) {
            true => digits.parse::<i64>().map_err(|_| NoThousandths),
            false => Err(NoThousandths),
        };
        let scale = match places.len() {
            1 => 100,
            2 => 10,
            3 => 1,
            _ => return Err(NoThousandths),
        };
        let value = number(whole)?.saturating_mul(1000).saturating_add(number(places)?.saturating_mul(scale));
        i32::try_from(if negative { -value } else { value }).map(Self).map_err(|_| NoThousandths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_consistent() {
        for (place, parameter) in Parameter::ALL.into_iter().enumerate() {
            let name = parameter.name();
            assert_eq!((parameter.place(), Parameter::from_name(name)), (place, Some(parameter)), "{name}");
            let [least, most, default] = parameter.range();
            assert!(least < most && parameter.allows(default), "{name}");
            assert!(parameter.allows(least) && parameter.allows(most), "{name}");
            assert!(!parameter.allows(least - 1) && !parameter.allows(most + 1), "{name}");
            assert!(!parameter.allows(i32::MIN) && !parameter.allows(i32::MAX), "{name}");
            assert_eq!(parameter.allows(default + 1), !parameter.is_whole(), "{name}");
            assert!(parameter.about().ends_with('.'), "{name}");
        }
        assert_eq!(Parameter::from_name("arm"), None);
    }

    #[test]
    fn thousandths_are_printed_exactly() {
        for (thousandths, text) in [
            (0, "0"),
            (1_000, "1"),
            (1_250, "1.25"),
            (-500, "-0.5"),
            (-15_001, "-15.001"),
            (7, "0.007"),
            (i32::MIN, "-2147483.648"),
        ] {
            assert_eq!(Thousandths(thousandths).to_string(), text);
            assert_eq!(text.parse(), Ok(Thousandths(thousandths)));
        }
        for text in
            ["", "-", ".", "1.", ".5", "+1", "1.2345", "1e3", " 1", "nan", "2147483.648", "99999999999999999999", "--1"]
        {
            assert_eq!(text.parse::<Thousandths>(), Err(NoThousandths), "{text}");
        }
    }
}
