//! Where a motion starts: at the last pulses if they are known, else at the park pose.
//!
//! A servo turns to the first pulse that it gets at its full speed, from wherever it is. Without an encoder the board does not know where that is. Where
//! the pulses ended last is the best that it can know, for as long as nobody has moved the joint: so an arming starts there, holds these pulses until
//! each servo follows them, and goes to the park pose at the limits of the gate. Then the ramp begins.
//!
//! A pose that the gate does not allow is one that a trim has left, or of another robot record. The pulses leave it as in a trim, each by a microsecond
//! in [`STEP_S`], to the allowed pose that is next to it (`Way`); from there the gate goes on.
//!
//! The supply of the servos comes on with the first pulse. A digital servo starts its processor first, and takes no pulse meanwhile. At its first
//! one it turns at full speed to where the pulses have gone by then: nowhere, while they are held.

use crate::error::{LoopError, ticks};
use crate::motion::gate::{Gate, GateState};
use crate::motion::servo::ServoMap;
use crate::setup::robot::{LONGEST, SHORTEST};
use joint_units::{Joint, Period, PulseMicros, Radians};

/// Time after the last pulse, or after a boot that kept it, for which it is known, s. Later a person may have moved the joint, or its weight.
pub const KNOWN_S: f32 = 60.0;
/// Time for which the last pulses are held, s: two servo frames, and more than a digital servo is assumed to take from its supply to its first pulse
/// (0.2 s, `docs/safety.md`). Where an arming starts at the park pose nothing is held: the ramp leaves it slowly.
const WAIT_S: f32 = 0.5;
/// Time in which a pulse moves by one microsecond in a trim, and on a `Way`, s.
pub const STEP_S: f32 = 0.01;
/// Largest difference of a pulse from that of a pose that the gate allows, us: the rounding of both.
const ROUNDING_US: u16 = 1;

/// The times, in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Start {
    known: u32,
    wait: u32,
    step: u32,
}

/// How long ago pulses began and ended, in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StartState {
    /// Since the last pulse; `None`: it is not known.
    silent: Option<u32>,
    /// Since the first pulse of this motion.
    on: u32,
}

impl Start {
    pub(crate) fn build(period: Period) -> Result<Self, LoopError> {
        Ok(Self {
            known: ticks("start.known_s", KNOWN_S, KNOWN_S, KNOWN_S, period)?,
            wait: ticks("start.wait_s", WAIT_S, WAIT_S, WAIT_S, period)?,
            step: ticks("start.step_s", STEP_S, STEP_S, STEP_S, period)?,
        })
    }

    /// Takes whether a tick has pulses, and the periods since the one before.
    pub(crate) fn note(self, state: &mut StartState, pulses: bool, elapsed: u32) {
        if pulses {
            *state = StartState { silent: Some(0), on: state.on.saturating_add(elapsed) };
        } else {
            let silent = state.silent.map(|silent| silent.saturating_add(elapsed));
            *state = StartState { silent: silent.filter(|silent| *silent <= self.known), on: 0 };
        }
    }

    /// Whether the last pulses have been held for long enough.
    pub(crate) fn has_begun(self, state: StartState) -> bool {
        state.on > self.wait
    }
}

impl StartState {
    /// Nothing is known.
    pub(crate) const UNKNOWN: Self = Self { silent: None, on: 0 };
    /// The pulses have just ended.
    pub(crate) const ENDED: Self = Self { silent: Some(0), on: 0 };

    /// Whether the last pulses are known.
    pub(crate) const fn is_known(self) -> bool {
        self.silent.is_some()
    }
}

/// Pulses on their way from a pose that the gate does not allow to the one that it allows next to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Way {
    /// The present pulses.
    pub(crate) at: [PulseMicros; Joint::COUNT],
    /// Ticks since they moved.
    stood: u32,
}

impl Way {
    /// Advances by a tick towards these pulses; true when all are there.
    pub(crate) fn step(&mut self, start: Start, goal: [PulseMicros; Joint::COUNT]) -> bool {
        self.stood = self.stood.saturating_add(1);
        if self.stood >= start.step {
            self.stood = 0;
            for (at, goal) in self.at.iter_mut().zip(goal) {
                *at = one_nearer(*at, goal);
            }
        }
        self.at == goal
    }
}

/// The pulse one microsecond nearer to its goal.
pub(crate) fn one_nearer(at: PulseMicros, goal: PulseMicros) -> PulseMicros {
    PulseMicros(if at < goal { at.0.saturating_add(1) } else { at.0.saturating_sub(u16::from(at > goal)) })
}

/// Where the gate stands at rest with these pulses: in their pose, or in the allowed pose next to it with the way there. `None` where a pulse is none
/// that a servo can have. A pulse beyond those of its servo counts as the nearest of them: another robot record allows others.
pub(crate) fn found(
    gate: &Gate,
    servos: &[ServoMap; Joint::COUNT],
    parked: &GateState,
    pulses: [PulseMicros; Joint::COUNT],
) -> Option<(GateState, Option<Way>)> {
    if !pulses.iter().all(|pulse| *pulse >= SHORTEST && *pulse <= LONGEST) {
        return None;
    }
    let mut at = pulses;
    let mut pose = [Radians(0.0); Joint::COUNT];
    for ((angle, servo), at) in pose.iter_mut().zip(servos).zip(&mut at) {
        *at = servo.nearest(*at);
        *angle = servo.angle(*at);
    }
    let state = gate.rest_near(pose).unwrap_or(*parked);
    let is_near = |(servo, (angle, pulse)): (&ServoMap, (Radians, PulseMicros))| {
        servo.pulse(angle).is_some_and(|near| near.0.abs_diff(pulse.0) <= ROUNDING_US)
    };
    let is_allowed = servos.iter().zip(gate.pose(&state).into_iter().zip(at)).all(is_near);
    Some((state, if is_allowed { None } else { Some(Way { at, stood: 0 }) }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LoopConfig, RobotConfig};
    use proptest::prelude::*;

    fn robot() -> crate::Robot {
        RobotConfig::default_biped().build(Period::MILLISECOND).expect("valid")
    }

    proptest! {
        /// Whatever the gate allowed is known again from its pulses, to one microsecond.
        #[test]
        fn a_pose_that_the_gate_allowed_is_found_from_its_pulses(
            targets in prop::collection::vec(prop::array::uniform4(-3.0_f32..3.0), 1..20), ticks in 1_usize..400
        ) {
            let robot = robot();
            let mut state = robot.parked;
            for target in &targets {
                for _ in 0..ticks {
                    let (setpoints, _) = robot.gate.limit(&mut state, target.map(Radians)).expect("finite");
                    let pulses = ServoMap::pulses(&robot.servos, setpoints).expect("finite");
                    let (found, way) = found(&robot.gate, &robot.servos, &robot.parked, pulses).expect("pulses of servos");
                    prop_assert!(way.is_none(), "{:?} of {:?}", pulses, setpoints);
                    let again = robot.gate.pose(&found);
                    for ((angle, servo), pulse) in again.into_iter().zip(&robot.servos).zip(pulses) {
                        prop_assert!(servo.pulse(angle).expect("finite").0.abs_diff(pulse.0) <= 1);
                    }
                }
            }
        }
    }

    /// From any pulses the way leads to an allowed pose, each pulse by at most one microsecond in a step and never away from it.
    #[test]
    fn a_pose_that_is_not_allowed_is_left_slowly() {
        let (robot, start) = (robot(), Start::build(Period::MILLISECOND).expect("valid"));
        let of = |pulses: [u16; 4]| found(&robot.gate, &robot.servos, &robot.parked, pulses.map(PulseMicros));
        let park = LoopConfig::default_biped().blend.park;
        let parked = ServoMap::pulses(&robot.servos, park).expect("finite").map(|pulse| pulse.0);
        assert_eq!(of(parked).map(|(_, way)| way), Some(None));
        for joint in 0..4 {
            for pulse in [500, 640, 2_345, 2_500] {
                let mut pulses = parked;
                pulses[joint] = pulse;
                let (state, way) = of(pulses).expect("known");
                let (mut way, goal) = (way.expect("not allowed"), robot.gate.pose(&state));
                let goal = ServoMap::pulses(&robot.servos, goal).expect("finite");
                assert_eq!(way.at, pulses.map(PulseMicros));
                let mut ticks = 0_u32;
                loop {
                    let before = way.at;
                    let is_there = way.step(start, goal);
                    ticks += 1;
                    for ((before, at), goal) in before.into_iter().zip(way.at).zip(goal) {
                        let nearer = before.0.abs_diff(goal.0) - at.0.abs_diff(goal.0);
                        assert!(nearer <= u16::from(ticks.is_multiple_of(10)), "{before:?} {at:?} to {goal:?}");
                    }
                    if is_there {
                        break;
                    }
                }
                let furthest = pulses.iter().zip(goal).map(|(from, to)| from.abs_diff(to.0)).max();
                assert_eq!(Some(ticks), furthest.map(|us| u32::from(us) * 10), "{pulses:?}");
                assert_eq!(of(goal.map(|pulse| pulse.0)).map(|(_, way)| way), Some(None), "allowed");
            }
            for pulse in [0, 400, 499, 2_501, u16::MAX] {
                let mut pulses = parked;
                pulses[joint] = pulse;
                assert_eq!(of(pulses), None, "{pulses:?}");
            }
        }
        assert_eq!(of([0; 4]), None);
    }

    #[test]
    fn the_last_pulses_are_known_for_a_minute() {
        let start = Start::build(Period::MILLISECOND).expect("valid");
        let mut state = StartState::UNKNOWN;
        start.note(&mut state, false, 1);
        assert!(!state.is_known());
        for tick in 1..=600 {
            start.note(&mut state, true, 1);
            assert_eq!((state.is_known(), start.has_begun(state)), (true, tick > 500), "{tick}");
        }
        for tick in 1..=60_001 {
            start.note(&mut state, false, 1);
            assert_eq!((state.is_known(), start.has_begun(state)), (tick <= 60_000, false), "{tick}");
        }
        // Missed periods count.
        let mut state = StartState::ENDED;
        for _ in 0..235 {
            start.note(&mut state, false, 255);
        }
        assert!(state.is_known());
        start.note(&mut state, false, 255);
        assert!(!state.is_known());
    }
}
