//! What a host can ask of the running loop, and the loop's answers.

use core::fmt;
use core::str::FromStr;

use crate::tuning::parameter::{Parameter, Thousandths};
use joint_units::{Joint, PulseMicros};

/// A request of a host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    /// Number that the host chooses; the answers repeat it.
    pub number: u16,
    /// What is asked for.
    pub action: Action,
}

/// What can be asked for. None of it switches an output on, and none of it changes a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// Stop at once, by the short ramp to the park pose, as after a lost sensor.
    Stop,
    /// Discard what is staged; with nothing staged, go back to the settings before the last change.
    Undo,
    /// Set a parameter.
    Set {
        /// The parameter.
        parameter: Parameter,
        /// Its new value, thousandths of its unit.
        thousandths: i32,
    },
    /// At rest: choose the servo that the next hold of the button trims, see [`crate::control::trim`].
    Trim {
        /// The servo's joint.
        joint: Joint,
    },
    /// In trim: move the servo slowly to this pulse.
    Jog {
        /// The pulse, within those of the servo in the robot record.
        pulse: PulseMicros,
    },
}

/// As in recordings: `7 stop`, `7 undo`, `7 set speed 1.25`, `7 trim left_hip`, `7 jog 1501`.
impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = self.number;
        match self.action {
            Action::Stop => write!(f, "{number} stop"),
            Action::Undo => write!(f, "{number} undo"),
            Action::Set { parameter, thousandths } => {
                write!(f, "{number} set {} {}", parameter.name(), Thousandths(thousandths))
            }
            Action::Trim { joint } => write!(f, "{number} trim {}", joint.name()),
            Action::Jog { pulse } => write!(f, "{number} jog {}", pulse.0),
        }
    }
}

/// A text that is no request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoRequest;

impl fmt::Display for NoRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("no request; allowed is a number, then stop, undo, set with a parameter and its value, trim with a joint, or jog with a pulse in us")
    }
}

impl core::error::Error for NoRequest {}

impl FromStr for Request {
    type Err = NoRequest;

    fn from_str(text: &str) -> Result<Self, NoRequest> {
        let mut words = text.split(' ');
        let number = words.next().and_then(|word| word.parse().ok()).ok_or(NoRequest)?;
        let action = match [words.next(), words.next(), words.next(), words.next()] {
            [Some("stop"), None, ..] => Action::Stop,
            [Some("undo"), None, ..] => Action::Undo,
            [Some("set"), Some(name), Some(value), None] => {
                let Thousandths(thousandths) = value.parse().map_err(|_| NoRequest)?;
                Action::Set { parameter: Parameter::from_name(name).ok_or(NoRequest)?, thousandths }
            }
            [Some("trim"), Some(name), None, _] => {
                let joint = Joint::ALL.into_iter().find(|joint| joint.name() == name);
                Action::Trim { joint: joint.ok_or(NoRequest)? }
            }
            [Some("jog"), Some(pulse), None, _] => {
                Action::Jog { pulse: PulseMicros(pulse.parse().map_err(|_| NoRequest)?) }
            }
            _ => return Err(NoRequest),
        };
        Ok(Self { number, action })
    }
}

/// Answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Answer {
    /// The tick in which it was staged, took effect or was refused.
    pub tick: u32,
    /// Number of the request. An effect answers the last request that was staged; the earlier ones take effect with it.
    pub number: u16,
    /// What became of it.
    pub outcome: Outcome,
}

/// What became of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Outcome {
    /// Valid, and waits: settings for the next phase boundary, a trim for a hold of the button.
    Staged,
    /// In effect from this tick on.
    InEffect,
    /// Refused: the value is outside the range of its parameter.
    OutOfRange,
    /// Refused: `follow` on a board whose generator follows nobody.
    NotAFollower,
    /// Refused: `speed` of a follower, which takes it from the person.
    FollowsAPerson,
    /// Refused: there was no change before.
    NothingToUndo,
    /// Refused: the gait cannot run at the control period.
    GaitNotPossible,
    /// Refused: a trim is chosen at rest.
    NotAtRest,
    /// Refused: a jog outside a trim.
    NotTrimming,
}

impl Outcome {
    /// Every outcome, in order.
    pub const ALL: [Self; 9] = [
        Self::Staged,
        Self::InEffect,
        Self::OutOfRange,
        Self::NotAFollower,
        Self::FollowsAPerson,
        Self::NothingToUndo,
        Self::GaitNotPossible,
        Self::NotAtRest,
        Self::NotTrimming,
    ];

    /// Name in recordings and for scripts.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Staged => "staged",
            Self::InEffect => "in_effect",
            Self::OutOfRange => "out_of_range",
            Self::NotAFollower => "not_a_follower",
            Self::FollowsAPerson => "follows_a_person",
            Self::NothingToUndo => "nothing_to_undo",
            Self::GaitNotPossible => "gait_not_possible",
            Self::NotAtRest => "not_at_rest",
            Self::NotTrimming => "not_trimming",
        }
    }

    /// Whether the request was refused and changed nothing.
    #[must_use]
    pub const fn is_refused(self) -> bool {
        !matches!(self, Self::Staged | Self::InEffect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_read_as_it_is_written() {
        let set = |parameter, thousandths| Action::Set { parameter, thousandths };
        let sets = Parameter::ALL.into_iter().map(|parameter| set(parameter, -1_250));
        let trims = Joint::ALL.into_iter().map(|joint| Action::Trim { joint });
        let trims = trims.chain([0, 1_501, u16::MAX].map(|pulse| Action::Jog { pulse: PulseMicros(pulse) }));
        for (number, action) in
            [0, 7, u16::MAX].into_iter().cycle().zip([Action::Stop, Action::Undo].into_iter().chain(sets).chain(trims))
        {
            let request = Request { number, action };
            assert_eq!(request.to_string().parse(), Ok(request));
        }
        assert_eq!(Request { number: 7, action: set(Parameter::Speed, 1_250) }.to_string(), "7 set speed 1.25");
        for text in [
            "",
            "7",
            "stop",
            "7 arm",
            "7 stop now",
            "7 set speed",
            "7 set speed 1 2",
            "65536 stop",
            "7 set arm 1",
            "7 trim",
            "7 trim knee",
            "7 jog -1",
        ] {
            assert_eq!(text.parse::<Request>(), Err(NoRequest), "{text}");
        }
    }
}
