//! Requests of a host, and the answers: the types of [`joint_loop::tuning`] as bytes.
//!
//! A request is its number, one byte for the action, and a value: 0 stop, 1 undo, 2 and above the place of a parameter in its table, 254 the
//! trim of a joint, 255 a jog to a pulse in us. No byte switches an output on, and none changes a limit: there is no such action.

use joint_loop::tuning::{Action, Answer, Outcome, Parameter, Request};
use joint_units::{Joint, PulseMicros};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::number;

const STOP: u8 = 0;
const UNDO: u8 = 1;
const FIRST_PARAMETER: u8 = 2;
const TRIM: u8 = 254;
const JOG: u8 = 255;

/// Number, action, value.
#[derive(Serialize, Deserialize)]
struct Sent(u16, u8, i32);

impl From<Request> for Sent {
    fn from(Request { number, action }: Request) -> Self {
        match action {
            Action::Stop => Self(number, STOP, 0),
            Action::Undo => Self(number, UNDO, 0),
            // A dozen places.
            Action::Set { parameter, thousandths } => {
                Self(number, FIRST_PARAMETER.saturating_add(parameter.place() as u8), thousandths)
            }
            Action::Trim { joint } => Self(number, TRIM, joint as i32),
            Action::Jog { pulse } => Self(number, JOG, pulse.0.into()),
        }
    }
}

impl Sent {
    fn request<E: de::Error>(self) -> Result<Request, E> {
        let Self(number, action, value) = self;
        let beyond = |allowed: &'static str| E::invalid_value(de::Unexpected::Signed(value.into()), &allowed);
        let action = match (action, value) {
            (STOP, 0) => Action::Stop,
            (UNDO, 0) => Action::Undo,
            (TRIM, place) => {
                let joint = usize::try_from(place).ok().and_then(|place| Joint::ALL.get(place)).copied();
                Action::Trim { joint: joint.ok_or_else(|| beyond("a joint, 0 to 3"))? }
            }
            (JOG, micros) => {
                let micros = u16::try_from(micros).map_err(|_| beyond("a pulse, 0 to 65535 us"))?;
                Action::Jog { pulse: PulseMicros(micros) }
            }
            (action, thousandths) => {
                let place = action.checked_sub(FIRST_PARAMETER).map(usize::from);
                let parameter = place.and_then(|place| Parameter::ALL.get(place)).copied();
                let unknown = || de::Unexpected::Unsigned(action.into());
                Action::Set {
                    parameter: parameter.ok_or_else(|| E::invalid_value(unknown(), &"an action of the table"))?,
                    thousandths,
                }
            }
        };
        Ok(Request { number, action })
    }
}

pub(crate) fn serialize<S: Serializer>(request: &Request, to: S) -> Result<S::Ok, S::Error> {
    Sent::from(*request).serialize(to)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Request, D::Error> {
    Sent::deserialize(from)?.request()
}

/// The same for a request that may be absent.
pub(crate) mod option {
    use super::{Deserialize, Deserializer, Request, Sent, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(request: &Option<Request>, to: S) -> Result<S::Ok, S::Error> {
        request.map(Sent::from).serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Request>, D::Error> {
        Option::<Sent>::deserialize(from)?.map(Sent::request).transpose()
    }
}

/// Answer of the loop to a request, see [`joint_loop::tuning::Answer`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answered {
    /// The tick in which it was staged, took effect or was refused.
    pub tick: u32,
    /// Number of the request.
    pub number: u16,
    /// What became of it.
    #[serde(with = "number")]
    pub outcome: Outcome,
}

impl From<Answer> for Answered {
    fn from(Answer { tick, number, outcome }: Answer) -> Self {
        Self { tick, number, outcome }
    }
}

/// Counters of requests and of the serial port since the boot, wrapping; once a second. Requests come by the serial port or through a debug probe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Port {
    /// Requests that were handed to the loop.
    pub requests: u32,
    /// Frames that were refused: damaged, or no request.
    pub malformed: u32,
    /// Requests of another version, refused.
    pub other_version: u32,
    /// Requests that came while the loop had too many to take.
    pub too_many: u32,
    /// Records that were not sent because the port was slower than the board.
    pub not_sent: u32,
}
