//! Trim: moves one servo slowly to find its neutral pulse and its scale, while the others stay in the park pose.
//!
//! 1. At rest, a host chooses the servo ([`Action::Trim`]). From then on a hold of the button begins the trim, where the last pulses are if they are
//!    known, else in the park pose ([`crate::motion::start`]). From elsewhere the servos go to the park pose at the speed of a trim, the chosen one last.
//! 2. In trim, the host sets the pulse ([`Action::Jog`]), within the pulses of the servo in the robot record. The pulse moves there by one
//!    microsecond in [`STEP_S`]: about 9 degrees a second.
//! 3. A press, a stop request, or [`SILENCE_S`] in the park pose or after the last jog without another one ends the trim: the outputs go off.
//!
//! The angles of a joint are not known before it is trimmed. So its range and its pose limits do not bind here: what bounds the trim are the
//! pulses of the servo, the speed, and the hand at the button. The other joints get the pulses of the park pose.

use crate::motion::servo::ServoMap;
pub use crate::motion::start::STEP_S;
use crate::motion::start::one_nearer;
use crate::tuning::{Action, Outcome};
use crate::{LoopError, SupervisorState};
use joint_units::{Joint, Period, PulseMicros, Radians};

use crate::error::ticks;

/// Longest time without a jog, s. A host repeats the last one to keep the trim going.
pub const SILENCE_S: f32 = 5.0;

/// What is fixed, in ticks and pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Trimmer {
    step: u32,
    silence: u32,
    servos: [ServoMap; Joint::COUNT],
    parked: [PulseMicros; Joint::COUNT],
}

/// The servo that is trimmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Trim {
    joint: Joint,
    /// The pulses of all servos.
    at: [PulseMicros; Joint::COUNT],
    goal: PulseMicros,
    /// Ticks since a pulse moved.
    stood: u32,
    /// Ticks since the last jog, or since the servos have come to the park pose.
    silent: u32,
    /// On the way to the park pose, with which a trim begins; no jog came meanwhile.
    returns: bool,
}

impl Trimmer {
    pub(crate) fn build(
        servos: [ServoMap; Joint::COUNT],
        park: [Radians; Joint::COUNT],
        period: Period,
    ) -> Result<Self, LoopError> {
        let parked = ServoMap::pulses(&servos, park).ok_or(LoopError::Park)?;
        let step = ticks("trim.step_s", STEP_S, STEP_S, STEP_S, period)?;
        Ok(Self { step, silence: ticks("trim.silence_s", SILENCE_S, SILENCE_S, SILENCE_S, period)?, servos, parked })
    }

    /// Takes a request for a trim or a jog in this state. The outcome of any other action is that there is no trim.
    pub(crate) fn take(&self, trim: &mut Option<Trim>, state: SupervisorState, action: Action) -> Outcome {
        match (action, state, trim) {
            (Action::Trim { joint }, SupervisorState::Disarmed | SupervisorState::TrimReady, trim) => {
                *trim = Some(self.begin(joint, self.parked));
                Outcome::Staged
            }
            (Action::Trim { .. }, ..) => Outcome::NotAtRest,
            (Action::Jog { pulse }, SupervisorState::Trimming, Some(trim)) => {
                if !self.servo(trim.joint).is_some_and(|servo| servo.allows(pulse)) {
                    return Outcome::OutOfRange;
                }
                (trim.goal, trim.silent, trim.returns) = (pulse, 0, false);
                Outcome::InEffect
            }
            _ => Outcome::NotTrimming,
        }
    }

    /// Advances a trim by a tick; the pulses of all servos, and the angle of the one that is trimmed.
    pub(crate) fn step(&self, trim: &mut Trim) -> ([PulseMicros; Joint::COUNT], Joint, Radians) {
        trim.returns = trim.returns && trim.at != self.parked;
        trim.silent = if trim.returns { 0 } else { trim.silent.saturating_add(1) };
        trim.stood = trim.stood.saturating_add(1);
        if trim.stood >= self.step {
            let chosen = trim.joint as usize;
            let mut is_parked = true;
            for (other, (at, parked)) in trim.at.iter_mut().zip(self.parked).enumerate() {
                if other != chosen && *at != parked {
                    *at = one_nearer(*at, parked);
                    (is_parked, trim.stood) = (false, 0);
                }
            }
            // Not while others move.
            if is_parked && let Some(at) = trim.at.get_mut(chosen).filter(|at| **at != trim.goal) {
                *at = one_nearer(*at, trim.goal);
                trim.stood = 0;
            }
        }
        let at = trim.at.get(trim.joint as usize).copied().unwrap_or_default();
        (trim.at, trim.joint, self.servo(trim.joint).map_or(Radians(0.0), |servo| servo.angle(at)))
    }

    /// Whether the host has been silent for too long.
    pub(crate) fn is_silent(&self, trim: &Trim) -> bool {
        trim.silent >= self.silence
    }

    /// The pulses of the park pose.
    pub(crate) const fn parked(&self) -> [PulseMicros; Joint::COUNT] {
        self.parked
    }

    /// The trim of a servo from these pulses on to the park pose, as at its beginning.
    pub(crate) fn begin(&self, joint: Joint, at: [PulseMicros; Joint::COUNT]) -> Trim {
        let goal = self.parked.get(joint as usize).copied().unwrap_or_default();
        Trim { joint, at, goal, stood: 0, silent: 0, returns: true }
    }

    fn servo(&self, joint: Joint) -> Option<&ServoMap> {
        self.servos.get(joint as usize)
    }
}

impl Trim {
    /// The joint.
    pub(crate) const fn joint(&self) -> Joint {
        self.joint
    }
}
