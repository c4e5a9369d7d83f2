//! Changes while the loop runs: one table of parameters, requests to change them, and how a change takes effect.
//!
//! ```text
//! request --> range --> staged --> phase boundary, no earlier change under way --> in effect: ramp of one second --> complete
//! ```
//! - [`Parameter`] is the table: name, unit, range, default, one sentence. Host and board check a value with the same function.
//! - A [`Request`] sets one parameter, goes back to the settings before the last change, or stops. There is none that arms, and none that
//!   changes a limit: the gate is behind all that is set here.
//! - A valid setting is staged. While the joints move it takes effect at the next phase boundary, where the gait phase passes zero, and after
//!   an earlier change is complete; without a boundary, as when a follower stands, after [`LONGEST_WAIT_S`]. While they rest it takes effect at
//!   once. Settings that are staged together take effect together.
//! - From there speed, amplitudes and offsets are led to their new values, and the old gait to the new one, by the minimum-jerk profile of the
//!   blend in [`RAMP_S`].
//! - Each request is answered in the tick that takes it, and a staged one again in the tick of its effect ([`Answer`]).
//! - A request is an input of the loop ([`crate::Sample::request`]): a replay with the same requests gives the same bits. Without a request the
//!   generator's angles pass unchanged, bit for bit.
//!
//! ```
//! use joint_loop::setup::default_loop::{Parameters, board_loop};
//! use joint_loop::tuning::{Action, Outcome, Parameter, Request};
//! use joint_loop::{RobotConfig, Sample};
//! use joint_units::{AdcCode, Volts};
//! let default = Parameters::with_defaults(None, None, RobotConfig::default_biped())?;
//! let mut joints = board_loop(&default, AdcCode(1501), Volts(2.7), false)?;
//! joints.tick(&Sample::default());
//! let speed = Parameter::from_name("speed").expect("it is in the table");
//! let action = Action::Set { parameter: speed, thousandths: 1_200 };
//! joints.tick(&Sample { request: Some(Request { number: 7, action }), ..Sample::default() });
//! // At rest: staged, and in effect in the same tick.
//! let outcomes: Vec<Outcome> = joints.answers().map(|answer| answer.outcome).collect();
//! assert_eq!(outcomes, [Outcome::Staged, Outcome::InEffect]);
//! assert_eq!(joints.settings().thousandths(speed), 1_200);
//! # Ok::<(), joint_loop::setup::default_loop::BoardLoopError>(())
//! ```

mod effect;
mod paced;
mod parameter;
mod request;
mod settings;
mod source;
mod tuner;

pub use parameter::{GAITS, NoThousandths, Parameter, Thousandths};
pub use request::{Action, Answer, NoRequest, Outcome, Request};
pub use settings::Settings;
pub(crate) use source::Source;
pub use tuner::{LONGEST_WAIT_S, RAMP_S};
pub(crate) use tuner::{Robot, Tuner};
