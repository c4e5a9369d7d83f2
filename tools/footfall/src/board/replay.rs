//! The host's copy of the board's control loop, with the board's inputs.
//!
//! The same core crates run here, so the same inputs must give the same bits. The board's inputs records have every call since the
//! boot. After a lost record the state of the board is unknown, and nothing is compared from there on, which is not the same as
//! equal.

use crate::board::default_loop::BoardLoop;
use joint_loop::SENSORS;
use std::collections::VecDeque;
use wire::{Call, Follow, Frame, Inputs};

/// Number of frames that are kept for comparison: the board lags at most by its queue of 64 calls.
const KEPT: usize = 256;

/// Inputs were lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("inputs of ticks {} to {} were lost", .after.wrapping_add(1), .found.wrapping_sub(1))]
pub struct Gap {
    /// The last tick before the gap.
    pub after: u32,
    /// The first tick after the gap.
    pub found: u32,
}

/// A field that differs between board and host.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("tick {tick}: {field} is {board} on the board and {host} on the host")]
pub struct Difference {
    /// The tick.
    pub tick: u32,
    /// The field.
    pub field: &'static str,
    /// The board's value.
    pub board: String,
    /// The host's value.
    pub host: String,
}

/// The host's loop and its last frames.
#[derive(Debug, Clone)]
pub struct Replay {
    joints: BoardLoop,
    frames: VecDeque<(Call, joint_loop::Frame<SENSORS>)>,
    gap: Option<Gap>,
    calls: u64,
}

impl Replay {
    /// Begins with a loop after boot.
    #[must_use]
    pub fn new(joints: BoardLoop) -> Self {
        Self { joints, frames: VecDeque::new(), gap: None, calls: 0 }
    }

    /// Runs the calls of one record.
    ///
    /// # Errors
    /// The record does not continue the one before; the copy cannot be used any more.
    pub fn feed(&mut self, inputs: &Inputs) -> Result<(), Gap> {
        if let Some(gap) = self.gap {
            return Err(gap);
        }
        let before = self.joints.frame().tick;
        if let Some(first) = inputs.calls.first()
            && before.wrapping_add(u32::from(first.elapsed.max(1))) != inputs.first_tick
        {
            let gap = Gap { after: before, found: inputs.first_tick };
            self.gap = Some(gap);
            return Err(gap);
        }
        for call in &inputs.calls {
            self.joints.tick(&call.sample());
            self.calls += 1;
            if self.frames.len() == KEPT {
                self.frames.pop_front();
            }
            self.frames.push_back((call.clone(), self.joints.frame()));
        }
        Ok(())
    }

    /// The last tick.
    #[must_use]
    pub fn tick(&self) -> u32 {
        self.joints.frame().tick
    }

    /// Calls of the loop so far.
    #[must_use]
    pub const fn calls(&self) -> u64 {
        self.calls
    }

    /// The gap, if inputs were lost.
    #[must_use]
    pub const fn gap(&self) -> Option<Gap> {
        self.gap
    }

    /// Input and frame of a tick, if it is among the last ones.
    #[must_use]
    pub fn at(&self, tick: u32) -> Option<(&Call, &joint_loop::Frame<SENSORS>)> {
        self.frames.iter().rev().find(|(_, frame)| frame.tick == tick).map(|(call, frame)| (call, frame))
    }
}

/// The fields that differ between the board's and the host's frame of a tick, compared by their bits.
#[must_use]
pub fn differences(board: &Frame, host: &joint_loop::Frame<SENSORS>) -> Vec<Difference> {
    let host = Frame::from(host);
    let mut found = Vec::new();
    let tick = host.tick;
    let mut compare = |field, same: bool, board: String, host: String| {
        if !same {
            found.push(Difference { tick, field, board, host });
        }
    };
    let angles = |frame: &Frame| frame.sensors.map(|sensor| sensor.map(|sensor| sensor.angle_rad.to_bits()));
    let degrees = |frame: &Frame| format!("{:?}", frame.sensors.map(|sensor| sensor.map(|sensor| sensor.angle_deg())));
    compare("sensor", angles(board) == angles(&host), degrees(board), degrees(&host));
    let validity = |frame: &Frame| frame.sensors.map(|sensor| sensor.map_or("none", |sensor| sensor.validity.name()));
    compare("validity", validity(board) == validity(&host), validity(board).join(", "), validity(&host).join(", "));
    compare("state", board.state == host.state, board.state.name().into(), host.state.name().into());
    compare("cause", board.cause == host.cause, board.cause.name().into(), host.cause.name().into());
    let bits = |follow: &Follow| {
        let Follow { state, fault, stride_s, phase_error_rad, confidence } = *follow;
        (state, fault, [stride_s, phase_error_rad, confidence].map(f32::to_bits))
    };
    let same = board.following.as_ref().map(bits) == host.following.as_ref().map(bits);
    compare("following", same, format!("{:?}", board.following), format!("{:?}", host.following));
    let same = board.setpoints_rad.map(f32::to_bits) == host.setpoints_rad.map(f32::to_bits);
    compare("set", same, format!("{:?}", board.setpoints_deg()), format!("{:?}", host.setpoints_deg()));
    let same = board.pulses_us == host.pulses_us;
    compare("pulse", same, format!("{:?}", board.pulses_us), format!("{:?}", host.pulses_us));
    for (field, board, host) in [
        ("late", board.late, host.late),
        ("missed", board.missed, host.missed),
        ("overruns", board.overruns, host.overruns),
        ("limited", board.limited.into(), host.limited.into()),
        ("limited_ticks", board.limited_ticks, host.limited_ticks),
        ("seq", board.seq, host.seq),
    ] {
        compare(field, board == host, board.to_string(), host.to_string());
    }
    let hash = |frame: &Frame| format!("{:016x}", frame.setpoint_hash);
    compare("hash", board.setpoint_hash == host.setpoint_hash, hash(board), hash(&host));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::default_loop::typical_loop;
    use cpg_core::entrainment::Lock;
    use hgod_adc::Validity;
    use joint_loop::{Cause, Sample, SupervisorState};
    use joint_units::AdcCode;

    fn call(code: u16) -> Call {
        let sample = Sample { codes: [AdcCode(code); SENSORS], vrefint: AdcCode(1652), ..Sample::default() };
        Call::of(&sample, 1)
    }

    fn one(first_tick: u32, call: Call) -> Inputs {
        Inputs { first_tick, calls: [call].into_iter().collect() }
    }

    fn replay() -> Replay {
        let mut replay = Replay::new(typical_loop().unwrap());
        for first_tick in [1, 11, 21, 31, 41] {
            let calls = (0..10).map(|n| call(2099 + first_tick as u16 + n)).collect();
            assert_eq!(replay.feed(&Inputs { first_tick, calls }), Ok(()));
        }
        replay
    }

    #[test]
    fn each_field_that_differs_is_named() {
        let replay = replay();
        let (_, frame) = replay.at(50).unwrap();
        let same = Frame::from(frame);
        assert_eq!(differences(&same, frame), []);
        let flip = |x: f32| f32::from_bits(x.to_bits() ^ 1);
        type Change = fn(&mut Frame, fn(f32) -> f32);
        let changes: [(&str, Change); 14] = [
            ("sensor", |tick, flip| {
                let sensor = tick.sensors[0].as_mut().unwrap();
                sensor.angle_rad = flip(sensor.angle_rad);
            }),
            ("validity", |tick, _| tick.sensors[0].as_mut().unwrap().validity = Validity::Rate),
            ("cause", |tick, _| tick.cause = Cause::Gap),
            ("following", |tick, _| {
                tick.following = Some(Follow {
                    state: Lock::Locked,
                    fault: None,
                    phase_error_rad: 0.0,
                    stride_s: 1.0,
                    confidence: 1.0,
                })
            }),
            ("overruns", |tick, _| tick.overruns ^= 1),
            ("limited_ticks", |tick, _| tick.limited_ticks ^= 1),
            ("state", |tick, _| tick.state = SupervisorState::Walking),
            ("set", |tick, flip| tick.setpoints_rad[3] = flip(tick.setpoints_rad[3])),
            ("pulse", |tick, _| tick.pulses_us[0] ^= 1),
            ("late", |tick, _| tick.late ^= 1),
            ("missed", |tick, _| tick.missed ^= 1),
            ("limited", |tick, _| tick.limited ^= 1),
            ("seq", |tick, _| tick.seq ^= 1),
            ("hash", |tick, _| tick.setpoint_hash ^= 1),
        ];
        for (field, change) in changes {
            let mut other = same;
            change(&mut other, flip);
            let found = differences(&other, frame);
            assert_eq!(found.iter().map(|d| (d.tick, d.field)).collect::<Vec<_>>(), [(50, field)]);
        }
    }

    #[test]
    fn a_line_that_does_not_follow_ends_the_replay_for_good() {
        let mut replay = replay();
        let line = |first_tick| one(first_tick, call(2200));
        let gap = Gap { after: 50, found: 61 };
        assert_eq!(replay.feed(&line(61)), Err(gap));
        assert_eq!((replay.tick(), replay.gap()), (50, Some(gap)));
        assert_eq!(replay.feed(&line(51)), Err(gap), "what comes later does not mend it");
        assert_eq!(gap.to_string(), "inputs of ticks 51 to 60 were lost");
    }

    #[test]
    fn a_missed_period_is_no_gap() {
        let mut replay = replay();
        let late = Call { elapsed: 3, ..call(2200) };
        assert_eq!(replay.feed(&one(53, late)), Ok(()));
        assert_eq!((replay.tick(), replay.calls(), replay.at(51).is_none()), (53, 51, true));
    }
}
